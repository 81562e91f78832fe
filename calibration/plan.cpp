/// \file What an error of D costs in platelet-seconds.

#include <algorithm>
#include <cmath>
#include <string>

#include "calibration/calibration.hpp"
#include "core/check.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {

Plan plan_for(double relative_error, const PlanInput& in) {
  require(relative_error > 0 && relative_error < 1,
          "the error asked for must lie between 0 and 1 (relative) give 0.1 for 10 %");
  require(in.shear_rate > 0 || in.lag > 0,
          "neither shear rate nor lag given (one sets the other) give the shear rate");
  Plan p;
  p.relative_error = relative_error;
  const double lag = in.lag > 0 ? in.lag : 2 / in.shear_rate;
  if (in.measured && in.measured->core.D_sigma > 0 && in.platelet_seconds > 0) {
    const double now = in.measured->core.D_sigma / in.measured->core.D;
    p.platelet_seconds = in.platelet_seconds * (now / relative_error) * (now / relative_error);
    p.note = formatted("scaled from %.3g platelet-seconds that gave %.1f %%", in.platelet_seconds, 100 * now);
  } else {
    // Brownian, overlapping displacements: variance of the MSD (4/3) lag/time. Heavy tails and uneven layers
    // cost another factor 1.9 in the published run.
    p.platelet_seconds = 1.9 * (4.0 / 3) * lag / (relative_error * relative_error) / in.share_in_layer;
    p.note = "from theory: (4/3) lag/error^2 per share of platelets in the layer, times 1.9 for heavy tails";
  }
  const double window = std::max(in.run_time - in.t0, 0.0);
  p.runs = window > 0 && in.platelets > 0
               ? std::max(3, static_cast<int>(std::ceil(p.platelet_seconds / (window * in.platelets))))
               : 3;
  p.platelets_single_origin = static_cast<int>(std::ceil(1.55 * 1.55 / (relative_error * relative_error)));
  return p;
}

}  // namespace hemowalk::calibration
