#pragma once
/// \file Settings and outcome of one solid step, common to all groups of cells.

#include <limits>

namespace hemowalk::mesh {

struct StepOptions {
  int iterations = 1;        ///< quasi-Newton iterations (membranes)
  bool runge_kutta = false;  ///< classical, in place of the implicit step (membranes)
  bool damping = true;       ///< kappa damping (membranes)
  double velocity_cap = std::numeric_limits<double>::infinity();  ///< largest speed a vertex moves with
  bool measure_residual = false;  ///< one more force evaluation, fills StepReport::residual (membranes)
};

struct StepReport {
  double residual =
      0;  ///< max over cells of |r|/|metric (v - v_pred)/h|, r the unbalanced force; if measured
  double increment = 0;  ///< max over cells of |last correction|/|displacement| of the iteration
  int worst_cell = -1;   ///< where increment is largest
  int bad_cell = -1;     ///< first cell with a value that is not finite; -1: none
};

}  // namespace hemowalk::mesh
