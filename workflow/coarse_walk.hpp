#pragma once
/// \file The coarse walk as calibration tests it: does what a user would run predict cells it has not seen?

#include "calibration/calibration.hpp"

namespace hemowalk::workflow {

/// coarse::run() from every bin, 4096 walkers each, in steps as long as the law allows (dt_min, at least 5
/// ms) and the gap bears.
calibration::Walk coarse_walk();

}  // namespace hemowalk::workflow
