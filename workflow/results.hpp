#pragma once
/// \file results.json: everything a campaign found, as numbers the report draws (SI, units in the keys).

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calibration/calibration.hpp"
#include "coarse/simulation.hpp"
#include "core/data/trajectories.hpp"

namespace hemowalk::workflow {

using Json = nlohmann::ordered_json;

/// Box, gap, shear rate, hematocrit, kappa_damping, t_c, Ca, Re, acceleration of the first run.
Json conditions_json(const data::Trajectories& run);
/// How many cells of each kind one run tracks.
Json cells_json(const data::Trajectories& run);
/// Mean square wall-normal displacement since the first sample, averaged over cells and runs: shows the
/// transient.
Json record_json(const std::vector<data::Trajectories>& runs, const std::string& kind, double t0);
/// Profiles of velocity, hematocrit and stress averaged over runs and the time after \p t0; null without
/// profiles.
Json blood_json(const std::vector<data::Trajectories>& runs, double t0);
/// The first run's diagnostics against time; null without any.
Json diagnostics_json(const data::Trajectories& run);
/// The calibrate --json object and `core`: the D the law uses.
Json calibration_json(const calibration::Calibration& result);
/// The coarse --json object with the case and, for plain absorbing or reflecting faces, the exact series.
Json coarse_json(const coarse::Result& result, const coarse::Case& the_case, const data::TransportLaw& law);

/// Absorbed fraction of walkers that start uniformly in a slab of height \p H, constant \p D, one absorbing
/// face: 1 - sum 2/l^2 exp(-l^2 D t/H^2), l = (k + 1/2) pi. With two absorbing faces each half is such a
/// slab.
double absorbed_fraction(double D, double H, double t, int absorbing_faces);

}  // namespace hemowalk::workflow
