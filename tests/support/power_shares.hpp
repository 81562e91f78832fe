#pragma once
/// \file Where the power of a flow goes, over sampled steps.

#include <cstdio>

#include "resolved/energy.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::test {

/// Sums of the energy budget, printed as shares of what is fed in.
struct Shares {
  resolved::EnergyBudget sum;  ///< over the sampled steps
  int steps = 0;

  template <class Real>
  void sample(resolved::Simulation<Real>& sim) {
    resolved::EnergyBudget b;
    sim.step(&b);
    auto* to = &sum.walls;
    const auto* from = &b.walls;
    for (std::size_t i = 0; i < sizeof b / sizeof(double); ++i) to[i] += from[i];
    ++steps;
  }
  /// Share of slip and of modes without stress, which a finer lattice should lose.
  double numerical() const { return (sum.slip + sum.stressless) / sum.fed(); }
  void print(const char* what) const {
    const double p = sum.fed() / 100;
    std::printf(
        "%s: plasma %.2f, kappa %.3f, slip %.3f, lattice %.3f, membranes %.3f, contact %.3f, inertia %.3f, "
        "residual %.4f %%\n",
        what, sum.viscous / p, sum.damping / p, sum.slip / p, sum.stressless / p, sum.membranes / p,
        sum.contact / p, sum.inertia / p, 100 * sum.residual());
    std::fflush(stdout);
  }
};

}  // namespace hemowalk::test
