#pragma once
/// \file Shape recovery: how long a stretched cell takes to return, measured in the solver's own plasma.

#include "core/data/scene.hpp"

namespace hemowalk::resolved {

/// t_c of the first deformable kind of \p scene, s: a single cell, 8 % longer along z and narrower along x,
/// is let go in plasma at rest; t_c is when its extra length has fallen to 1/e. Always coupled
/// conservatively: the other schemes do not stand this acceleration. Runs at \p acceleration
/// (inertia takes 0.02 % between 16 and 32 at kappa 0.5; without kappa some 3 % at 50) in a small periodic
/// box, in seconds of wall time. NaN without a deformable kind, or if the shape has not come back after \p
/// limit.
double recovery_time(const data::Scene& scene, double acceleration = 100, double limit = 0.3);

}  // namespace hemowalk::resolved
