/// \file The finite-volume solver: observed orders, conservation, exact solutions, and the walk beside it.

#include <gtest/gtest.h>

#include <cmath>

#include "coarse/fokker_planck.hpp"
#include "coarse/walkers.hpp"
#include "support/coarse_exact.hpp"

namespace hemowalk::coarse {
namespace {

using Type = Face::Type;
constexpr double H = 50e-6, D0 = 1e-10;

double absorbed_by(const SlabLaw& law, const Face& bottom, const Face& top, int cells, double t, int steps) {
  FokkerPlanck solver(law, bottom, top, cells);
  solver.advance(t, steps);
  return solver.absorbed();
}

TEST(FokkerPlanck, ConvergesToTheSeriesWithSecondOrderInSpace) {
  const SlabLaw law = constant_slab(H, D0);
  double before = 0;
  for (const int cells : {32, 64, 128, 256}) {
    const double error =
        std::abs(absorbed_by(law, {Type::absorb, 0, 0}, {}, cells, 2, 2000) - absorbed_exactly(D0, 2, H));
    if (before > 0) {
      EXPECT_NEAR(std::log2(before / error), 2, 0.15) << cells;
    }
    before = error;
  }
}

TEST(FokkerPlanck, ReactingFaceConvergesWithSecondOrderInSpace) {
  const SlabLaw law = constant_slab(H, D0);
  const double k = 4e-6;
  double before = 0;
  for (const int cells : {32, 64, 128}) {
    const double error =
        std::abs(absorbed_by(law, {Type::robin, k, 0}, {}, cells, 2, 2000) - reacted_exactly(k, D0, 2, H));
    if (before > 0) {
      EXPECT_NEAR(std::log2(before / error), 2, 0.2) << cells;
    }
    before = error;
  }
}

TEST(FokkerPlanck, IsSecondOrderInTime) {
  // against a fine time step on the same grid; the start has a jump at the face, which L-stability damps
  const SlabLaw law = make_slab_law(
      H, 256, [](double y) { return D0 * (1 - 0.6 * std::exp(-y / 8e-6)); },
      [](double y) { return -1e-6 * y / H; });
  const Face bottom{Type::absorb, 0, 0}, top{Type::trap, 0.3, 3e-6};
  const double exact = absorbed_by(law, bottom, top, 128, 3, 20000);
  double before = 0;
  for (const int steps : {40, 80, 160}) {
    const double error = std::abs(absorbed_by(law, bottom, top, 128, 3, steps) - exact);
    if (before > 0) {
      EXPECT_NEAR(std::log2(before / error), 2, 0.35) << steps;
    }
    before = error;
  }
}

TEST(FokkerPlanck, ConservesWalkersToRoundOff) {
  const SlabLaw law = make_slab_law(
      H, 256, [](double y) { return D0 * (1 + 0.7 * std::sin(9 * y / H)); },
      [](double y) { return 5e-6 * y / H; });
  for (const Type top : {Type::reflect, Type::absorb, Type::robin, Type::trap}) {
    FokkerPlanck solver(law, {Type::trap, 0.1, 2e-6}, {top, 3e-6, 1e-6}, 200);
    solver.advance(1.5, 300);
    double free = 0;
    for (const double c : solver.concentration()) free += c / 200;
    EXPECT_NEAR(free + solver.absorbed() + solver.trapped(), 1, 1e-12);
  }
}

TEST(FokkerPlanck, SteadyStatesAreExact) {
  // constant v/D: c ~ exp(v y/D), exactly at the cell centres' mutual ratios
  const double v = -6e-6;
  const SlabLaw law = make_slab_law(
      H, 16, [](double) { return D0; }, [&](double) { return v; });
  FokkerPlanck solver(law, {}, {}, 64);
  solver.advance(200, 400);
  const auto c = solver.concentration();
  for (std::size_t i = 1; i < c.size(); ++i)
    EXPECT_NEAR(c[i] / c[i - 1] / std::exp(v * H / 64 / D0), 1, 1e-9);
  // trap: amount = layer x concentration
  FokkerPlanck trapped(constant_slab(H, D0), {Type::trap, 0.7, 5e-6}, {}, 64);
  trapped.advance(400, 400);
  EXPECT_NEAR(trapped.trapped(), 5.0 / 55, 1e-9);
}

TEST(FokkerPlanck, PeriodicSlabIsTransparent) {
  // a drift round the period changes nothing; D(y) neither
  const SlabLaw law = make_slab_law(
      H, 256, [](double y) { return D0 * (1 + 0.5 * std::cos(2 * std::numbers::pi * y / H)); },
      [](double) { return 3e-6; });
  const Face p{Type::periodic, 0, 0};
  FokkerPlanck solver(law, p, p, 128);
  solver.advance(5, 100);
  double sum = 0;
  for (const double c : solver.concentration()) {
    EXPECT_NEAR(c, 1, 1e-10);
    sum += c / 128;
  }
  EXPECT_NEAR(sum, 1, 1e-12);
}

/// One walk and one solve of the same case; counts in 16 bins + absorbed + trapped against the solver's.
double agreement(const SlabLaw& law, const SlabLaw& solved, const Face& bottom, const Face& top, double dt,
                 double t, std::int64_t walkers) {
  Case c = make_case(law.height, bottom.type, top.type, walkers, dt, 77);
  c.bottom = bottom;
  c.top = top;
  Walkers w(c, law);
  w.advance_to(std::llround(t / dt));
  const auto n = w.count(16);
  FokkerPlanck solver(solved, bottom, top, 512);
  solver.advance(t, 1000);
  auto counts = n.histogram;
  std::vector<double> expected = solver.profile(16);
  for (double& e : expected) e *= static_cast<double>(walkers) / 16;
  if (solver.absorbed() > 0) {
    counts.push_back(n.absorbed[0] + n.absorbed[1]);
    expected.push_back(solver.absorbed() * static_cast<double>(walkers));
  }
  if (solver.trapped() > 0) {
    counts.push_back(n.trapped[0] + n.trapped[1]);
    expected.push_back(solver.trapped() * static_cast<double>(walkers));
  }
  return p_value(counts, expected);
}

TEST(WalkAndFokkerPlanck, AgreeForEveryKindOfFace) {
  const auto make = [](double factor) {
    return make_slab_law(
        H, 256, [=](double y) { return factor * D0 * (1 - 0.5 * std::exp(-std::min(y, H - y) / 8e-6)); },
        [](double y) { return -1e-6 * (1 - 2 * y / H); });
  };
  const SlabLaw law = make(1), wrong = make(1.05);
  const double dt = 2e-3, t = 1.5;
  const std::int64_t walkers = 100'000;
  const Face absorb{Type::absorb, 0, 0}, robin{Type::robin, 4e-6, 0}, trap{Type::trap, 0.5, 4e-6}, reflect{};
  EXPECT_GT(agreement(law, law, absorb, reflect, dt, t, walkers), alpha);
  EXPECT_GT(agreement(law, law, robin, absorb, dt, t, walkers), alpha);
  EXPECT_GT(agreement(law, law, trap, reflect, dt, t, walkers), alpha);
  EXPECT_GT(agreement(law, law, robin, trap, dt, t, walkers), alpha);
  EXPECT_LT(agreement(law, wrong, absorb, absorb, dt, t, walkers), alpha) << "a D wrong by 5 % goes unseen";
}

}  // namespace
}  // namespace hemowalk::coarse
