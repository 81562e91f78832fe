#pragma once
/// \file Tests on cells that the fit has not seen: does the walk predict them, and which step law does it
/// best?

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "calibration/calibration.hpp"
#include "calibration/local_law.hpp"

namespace hemowalk::calibration {

/// The local law fitted to the even and to the odd cells of every run.
using HalfFits = std::array<LocalFit, 2>;
HalfFits fit_halves(const Ensemble& ensemble, double lag);

/// What becomes of cells by the law of one half: for each lag the matrix of Calibration's Walk.
using Prediction =
    std::function<std::vector<Eigen::MatrixXd>(std::size_t half, const std::vector<double>& lags)>;
/// By the propagator of the fits themselves.
Prediction propagated(const HalfFits& halves);

/// Two folds of cells (odd and even within a run). The law fitted to one half walks the other half's cells
/// from where they are: mean-squared displacement at each lag (all origins, error over cells), the
/// displacements' probability integral transform under the predicted law (disjoint displacements, so it is
/// uniform and independent if the law is right), and the profile at the end of the window from the positions
/// at t0.
Calibration::Holdout hold_out(const Ensemble& ensemble, const Layer& core, const Prediction& predict);

/// Step laws compared by the log-likelihood of unseen cells at one lag, nats per step relative to the
/// Gaussian.
Calibration::StepChoice compare_steps(const Ensemble& ensemble, const Layer& core, const HalfFits& halves,
                                      double lag);

/// The step law that goes on: Gaussian, valid for steps from the shortest lag on at which unseen cells do not
/// significantly (2 standard errors) prefer another; if there is none up to \p longest, the one they prefer
/// there.
struct StepSelection {
  data::TransportLaw::StepLaw law;
  double dt_min = 0;  ///< s
  std::string reason;
  std::vector<Calibration::StepChoice> choices;
};
StepSelection select_step_law(const Ensemble& ensemble, const Layer& core, const HalfFits& halves,
                              double memory, double longest = 0.1);

/// Cells near the walls: how many come, how many leave again, how long they stay.
/// \p zone: thickness of the near-wall zones above either wall, m.
Calibration::Residence residence(const Ensemble& ensemble, const Layer& core, double zone);

}  // namespace hemowalk::calibration
