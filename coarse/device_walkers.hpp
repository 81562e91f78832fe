#pragma once
/// \file DeviceWalkers: the ensemble of walkers.hpp on a Queue's place, one thread per walker, the same
/// random numbers. Walkers is the definition of right; positions may differ from it by roundings, counts by
/// walkers that these move across a face or a bin.

#include <cstdint>

#include "coarse/walk_model.hpp"
#include "core/device.hpp"

namespace hemowalk::coarse {

/// 4 bytes per walker (8 with a persistent walk). A leg of the walk is one kernel in registers: memory is
/// touched twice per leg.
class DeviceWalkers {
 public:
  /// \p count walkers of \p walk (make_walk), uniform over the slab. The way along the flow is not tracked.
  DeviceWalkers(Queue& queue, const WalkTables& walk, std::int64_t count);

  /// Enqueues the walk on to step \p step (no-op if already there).
  void advance_to(std::int64_t step);
  std::int64_t step() const { return step_; }
  std::int64_t size() const { return size_; }
  /// Steps actually walked, as Walkers counts them; waits.
  std::int64_t steps_walked() const;

  WalkCounts count(int bins) const;
  /// Positions (2^30 = the slab's height; below zero: state::), by number; waits.
  std::vector<std::int32_t> positions() const;

 private:
  Queue& queue_;
  std::int64_t size_, step_ = 0;
  bool table_;
  WalkModel model_;
  Array<float> variance_, drift_, memory_;
  Array<std::int32_t> y_;
  Array<std::int64_t> walked_;  ///< steps, added up by groups of walkers
};

}  // namespace hemowalk::coarse
