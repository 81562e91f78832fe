#pragma once
/// \file Walkers: the ensemble. 6 bytes per walker (10 with a persistent walk, +8 with the flow direction).

#include <array>
#include <cstdint>
#include <vector>

#include "coarse/lanes.hpp"
#include "coarse/walk_model.hpp"
#include "core/array.hpp"

namespace hemowalk::coarse {

/// N walkers in a slab, independent of each other; each one is a function of (seed, id) alone. They advance
/// in blocks of 1024: a block walks all steps of a leg in cache and registers, absorbed walkers are taken out
/// between legs. Threads share blocks; every sum is one of integers or runs over blocks in order, so results
/// are bit-identical for any number of threads and any sequence of advance() calls with the same sum.
class Walkers {
 public:
  /// Walkers of \p the_case (walkers, dt, faces, seed), uniform over the slab.
  /// \throws InputError when dt is too long for the slab (rms step > height/8) or a trap has no layer.
  Walkers(const Case& the_case, const SlabLaw& law, const WalkSettings& settings = {});

  /// Walks on to step \p step (no-op if already there).
  void advance_to(std::int64_t step);
  std::int64_t step() const { return step_; }
  std::int64_t size() const { return size_; }
  /// Steps actually walked: absorbed walkers take none (granularity: a leg).
  std::int64_t steps_walked() const { return steps_walked_; }

  WalkCounts count(int bins) const;

  /// Mean (m) and variance (m2) of the way along the flow, over all walkers; needs track_flow_direction and
  /// faces that keep every walker.
  struct Spread {
    double mean = 0, variance = 0;
  };
  Spread spread() const;
  /// Height of walker positions, m, in storage order; for tests. Absorbed and trapped ones are left out.
  std::vector<double> heights() const;

 private:
  static constexpr int width = 16, sets = 4, block = 1024;

  template <StepLaw S, bool Table, bool Drift>
  void walk_block(std::int64_t b, std::int64_t begin, std::int64_t end);
  void compact(std::int64_t b);
  std::int64_t blocks() const { return static_cast<std::int64_t>(active_.size()); }

  std::int64_t size_, step_ = 0, steps_walked_ = 0;
  double height_, dt_, shear_rate_;
  bool table_ = false;
  WalkModel model_;
  Array<float> variance_, drift_;
  Array<std::int32_t> y_;
  Array<std::uint16_t> offset_;
  Array<float> memory_;
  Array<std::int64_t> way_;                            ///< sum of 2 y over steps
  std::vector<std::int32_t> active_;                   ///< [blocks] stored walkers
  std::vector<std::array<std::int32_t, 2>> absorbed_;  ///< [blocks] taken out so far
};

/// The ceiling the walk is measured against: normal numbers per second of processor time, made the walk's way
/// and only summed up; added over all threads, each working for \p seconds of its own processor time.
double normal_numbers_per_second(double seconds);

}  // namespace hemowalk::coarse
