#pragma once
/// \file From a case and its law to the numbers a walk runs on, for host and device.

#include <algorithm>
#include <array>
#include <vector>

#include "coarse/slab_law.hpp"
#include "coarse/walk.hpp"

namespace hemowalk::coarse {

/// How the walk is carried out; the physics is in Case and SlabLaw.
struct WalkSettings {
  WallScheme scheme = WallScheme::exact;
  StepLaw step_law = StepLaw::gaussian;
  double memory = 0;                            ///< s, persistent
  double tail_exponent = 0, tail_fraction = 0;  ///< heavy_tail: P(|step| > x) ~ x^-exponent, exponent > 2
  double cell_free_layer = 0;                   ///< m, for traps that state no layer
  bool track_flow_direction = false;            ///< z = sum of u(y) dt
  bool ito_drift = true;  ///< false drops D': wrong on purpose, for the test of the test
};

/// The model with its tables; whoever walks puts the tables where the walk runs and sets the model's
/// pointers.
struct WalkTables {
  std::vector<float> variance, drift;  ///< [cells + 2]
  WalkModel model;
  bool table = false;   ///< D or v depend on y
  bool drifts = false;  ///< v is not zero everywhere
};

/// \throws InputError when dt is too long for the slab (rms step > height/8), a trap has no layer, or the
/// step law is unusable.
WalkTables make_walk(const Case& the_case, const SlabLaw& law, const WalkSettings& settings);

/// Where the walkers are.
struct WalkCounts {
  std::array<std::int64_t, 2> absorbed{}, trapped{};  ///< bottom, top
  std::vector<std::int64_t> histogram;                ///< free walkers per bin of equal height
};

/// What a step is compiled for: does the law depend on y, and is there a drift?
template <StepLaw S, bool Table, bool Drift>
struct WalkKind {
  static constexpr StepLaw step_law = S;
  static constexpr bool table = Table, drift = Drift;
};

/// From \p step on to \p end in legs of 512 steps, between which absorbed walkers leave:
/// leg(WalkKind, first step, last step).
template <class Leg>
void walk_legs(const WalkModel& model, bool table, std::int64_t& step, std::int64_t end, const Leg& leg) {
  while (step < end) {
    const std::int64_t first = step, last = std::min<std::int64_t>(step + 512, end);
    const auto with = [&]<StepLaw S>() {
      if (!table)
        leg(WalkKind<S, false, false>{}, first, last);
      else if (!model.drift)
        leg(WalkKind<S, true, false>{}, first, last);
      else
        leg(WalkKind<S, true, true>{}, first, last);
    };
    switch (model.step_law) {
      case StepLaw::gaussian:
        with.template operator()<StepLaw::gaussian>();
        break;
      case StepLaw::persistent:
        with.template operator()<StepLaw::persistent>();
        break;
      case StepLaw::heavy_tail:
        with.template operator()<StepLaw::heavy_tail>();
        break;
    }
    step = last;
  }
}

}  // namespace hemowalk::coarse
