#pragma once
/// \file The artefact gate (method note, section 9): is the run fit to be calibrated at all? A failed gate is
/// said loudly and travels with the law; the numbers are still given.

#include <string>
#include <vector>

#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// Mean velocity of the cells against height, from their one-sample displacements after t0; errors over
/// cells.
struct CellVelocity {
  std::vector<double> y;              ///< m, bin centres, symmetric about the middle of the gap
  std::vector<double> along, across;  ///< m/s: z (flow) and x (vorticity); NaN in empty bins
  std::vector<double> along_sigma, across_sigma;
};
CellVelocity cell_velocity(const Ensemble& ensemble, int bins);

/// All findings that the data allow; what was not recorded is not judged. Limits (why):
/// - fastest displacement <= 1.25 wall speeds (nothing in a Couette cell outruns the wall; a quarter for
/// wobble);
/// - share of cross-stream jumps (see jump_threshold) <= 1e-4 (a Gaussian walk has 1e-5);
/// - mean velocity along vorticity <= 2 % of the wall speed, or within 3.5 standard errors of zero (no force
/// acts);
/// - velocity profile antisymmetric to 10 % of the wall speed (25 % where the recorded stress is uniform:
/// then cells are unevenly distributed, and no force is missing), or within 3.5 standard errors;
/// - shear in the middle 60 % of the gap: lowest >= 0.75 of nominal, highest - lowest <= 0.5 of nominal;
/// - total shear stress uniform: highest - lowest <= 10 % of the mean;
/// - as many cells near one wall as near the other: ratio <= 1.5, or within 2 standard errors of equal;
/// - cell volumes within 2 % of their start; momentum residual <= 1e-3; mass error <= 1e-3.
data::TransportLaw::Gate artefact_gate(const std::vector<data::Trajectories>& runs, const Ensemble& ensemble);

}  // namespace hemowalk::calibration
