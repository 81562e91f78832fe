#pragma once
/// \file From a case and its law to the numbers a walk runs on, for host and device.

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

}  // namespace hemowalk::coarse
