#pragma once
/// \file What D depends on: the quantities that enter the regression, and how.

#include <string>
#include <vector>

#include "calibration/calibration.hpp"

namespace hemowalk::calibration {

inline constexpr double red_cell_radius = 4e-6;  ///< m, the r of D/(gamma r^2)

/// A condition that may explain D, as it enters the regression.
struct Regressor {
  using Conditions = data::TransportLaw::Conditions;
  std::string name;
  double Conditions::*member;
  double (*forward)(double);   ///< condition -> regressor
  double (*backward)(double);  ///< regressor -> condition
};
/// ln shear rate, hematocrit, ln kappa/(1-kappa) (the drag per membrane area is proportional to kappa/(1 -
/// kappa): the material's own number), ln shape-recovery time, ln capillary number, ln gap. In this order:
/// the first of two that vary together is kept.
const std::vector<Regressor>& regressors();

/// The claims that were stated before the data (docs/calibration.md), not yet tested.
std::vector<Hypothesis> stated_hypotheses();

/// D predicted by the regression, in ln D with its standard error (scatter between calibrations included).
struct Predicted {
  double log_D = 0, sigma = 0;
};
Predicted predict(const ConditionFit& fit, const data::TransportLaw::Conditions& at);

}  // namespace hemowalk::calibration
