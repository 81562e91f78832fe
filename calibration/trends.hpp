#pragma once
/// \file The law over conditions: what several calibrations, or one with uneven shear, say about D beyond one
/// value; and how much data an error costs.

#include <string>
#include <vector>

#include "calibration/calibration.hpp"
#include "calibration/local_law.hpp"
#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// Exponent of D(y) ~ (local shear rate)^n inside one run, from the cells' own velocity profile over the
/// core. Where the shear is too even to tell (spread below 30 %), n = 1 +- 0.3: Stokes flow at constant
/// capillary number gives 1, and the error is what published exponents scatter by.
struct ShearExponent {
  double n = 1, sigma = 0.3;
  bool measured = false;
  double low = 0, high = 0;  ///< 1/s, range of the local shear
  std::string note;
};
ShearExponent shear_exponent(const Ensemble& ensemble, const Layer& core, const LocalFit& fit);

}  // namespace hemowalk::calibration
