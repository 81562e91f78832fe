/// \file The walk against exact solutions: absorbing and reacting slabs, traps, weak orders, dispersion.

#include <gtest/gtest.h>

#include <cmath>

#include "coarse/fokker_planck.hpp"
#include "coarse/walkers.hpp"
#include "support/coarse_exact.hpp"

namespace hemowalk::coarse {
namespace {

using Type = Face::Type;

/// p-value of what a face took between output times (and what is left) against the exact fractions.
template <class Exact>
double fractions_p_value(Walkers& w, double dt, const std::vector<double>& times, const Exact& exact) {
  std::vector<std::int64_t> counts;
  std::vector<double> expected;
  std::int64_t counted = 0;
  double before = 0;
  const auto n = static_cast<double>(w.size());
  for (const double t : times) {
    w.advance_to(std::llround(t / dt));
    const auto taken = w.count(1).absorbed;
    counts.push_back(taken[0] + taken[1] - counted);
    counted = taken[0] + taken[1];
    expected.push_back((exact(t) - before) * n);
    before = exact(t);
  }
  counts.push_back(w.size() - counted);
  expected.push_back((1 - before) * n);
  return p_value(counts, expected);
}

TEST(AbsorbingSlab, FollowsTheSeriesOfTheImpactRSlab) {
  const double H = 0.82e-3;
  // the numbers of the method note are the series
  const std::vector<double> times{20, 60, 120, 300};
  const double note_1[] = {.062, .107, .151, .238}, note_2[] = {.070, .122, .172, .272},
               note_3[] = {.688, .954, .997, 1};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(absorbed_exactly(1e-10, times[i], H), note_1[i], 5.1e-4);
    EXPECT_NEAR(absorbed_exactly(1.3e-10, times[i], H), note_2[i], 5.1e-4);
    EXPECT_NEAR(absorbed_exactly(1.3e-8, times[i], H), note_3[i], 5.1e-4);
  }
  const auto p = [&](double walked_D, double exact_D, double dt, std::uint64_t seed) {
    Walkers w(make_case(H, Type::absorb, Type::reflect, 400'000, dt, seed), constant_slab(H, walked_D));
    return fractions_p_value(w, dt, times, [&](double t) { return absorbed_exactly(exact_D, t, H); });
  };
  // With a constant D the bridge is exact at any dt that is short against H^2/D.
  EXPECT_GT(p(1e-10, 1e-10, 1.0, 1), alpha);
  EXPECT_GT(p(1.3e-10, 1.3e-10, 1.0, 2), alpha);
  EXPECT_LT(p(1.05e-10, 1e-10, 1.0, 3), alpha) << "the test does not see a D wrong by 5 %";
}

TEST(AbsorbingSlab, AtTheTimeStepOfTheDefaultCase) {
  const double H = 0.82e-3, dt = 10e-3;
  Walkers w(make_case(H, Type::absorb, Type::reflect, 100'000, dt, 4), constant_slab(H, 1e-10));
  EXPECT_GT(fractions_p_value(w, dt, {1, 5, 20}, [&](double t) { return absorbed_exactly(1e-10, t, H); }),
            alpha);
}

TEST(ReactingSlab, FollowsItsEigenvalueSeries) {
  const double H = 50e-6, D = 1e-10, dt = 5e-3;
  for (const double k : {4e-7, 8e-6, 1e-4}) {  // k H/D = 0.2, 4, 50; e = k sqrt(dt/D) up to 0.7
    Case c = make_case(H, Type::robin, Type::reflect, 200'000, dt, 12);
    c.bottom.rate = k;
    Walkers w(c, constant_slab(H, D));
    EXPECT_GT(fractions_p_value(w, dt, {0.25, 1, 3}, [&](double t) { return reacted_exactly(k, D, t, H); }),
              alpha);
  }
  Case c = make_case(H, Type::robin, Type::reflect, 200'000, dt, 13);
  c.bottom.rate = 1.05 * 4e-6;
  Walkers w(c, constant_slab(H, D));
  EXPECT_LT(fractions_p_value(w, dt, {0.25, 1, 3}, [&](double t) { return reacted_exactly(4e-6, D, t, H); }),
            alpha)
      << "the test does not see a rate wrong by 5 %";
}

struct Point {
  double error, sigma;
};

/// Error of the absorbed fraction at time t against \p exact.
Point error_of(const SlabLaw& law, const Face& bottom, WallScheme scheme, double dt, double t, double exact,
               std::int64_t walkers) {
  Case c = make_case(law.height, bottom.type, Type::reflect, walkers, dt, 21);
  c.bottom = bottom;
  WalkSettings s;
  s.scheme = scheme;
  Walkers w(c, law, s);
  w.advance_to(std::llround(t / dt));
  const double p = static_cast<double>(w.count(1).absorbed[0]) / static_cast<double>(walkers);
  return {p - exact, std::sqrt(p * (1 - p) / static_cast<double>(walkers))};
}

TEST(WeakOrder, OfTheAbsorbingFaceIsOneHalfPlainAndExactWithTheBridge) {
  const double H = 50e-6, D = 1e-10, t = 1.6;
  const SlabLaw law = constant_slab(H, D);
  const double exact = absorbed_exactly(D, t, H);
  std::vector<double> errors;
  for (const double dt : {0.04, 0.01, 0.0025}) {
    const Point plain = error_of(law, {Type::absorb, 0, 0}, WallScheme::plain, dt, t, exact, 200'000);
    errors.push_back(-plain.error);
    EXPECT_GT(errors.back(), 5 * plain.sigma) << dt;  // misses walkers that came back
    const Point bridge = error_of(law, {Type::absorb, 0, 0}, WallScheme::exact, dt, t, exact, 200'000);
    EXPECT_LT(std::abs(bridge.error), normal_quantile(1 - alpha / 2) * bridge.sigma) << dt;
  }
  // dt/4 halves the error of order 1/2
  EXPECT_NEAR(errors[0] / errors[1], 2, 0.4);
  EXPECT_NEAR(errors[1] / errors[2], 2, 0.4);
}

TEST(WeakOrder, OfTheReactingFaceSchemes) {
  const double H = 50e-6, D = 1e-10, t = 1.6, k = 8e-6;
  const SlabLaw law = constant_slab(H, D);
  const double exact = reacted_exactly(k, D, t, H);
  const Face face{Type::robin, k, 0};
  for (const WallScheme scheme : {WallScheme::plain, WallScheme::bridge}) {
    std::vector<double> errors;
    for (const double dt : {0.04, 0.01})
      errors.push_back(error_of(law, face, scheme, dt, t, exact, 200'000).error);
    EXPECT_NEAR(errors[0] / errors[1], 2, 0.6);  // order 1/2
  }
  for (const double dt : {0.04, 0.01}) {
    const Point p = error_of(law, face, WallScheme::exact, dt, t, exact, 200'000);
    EXPECT_LT(std::abs(p.error), normal_quantile(1 - alpha / 2) * p.sigma) << dt;
  }
}

TEST(WeakOrder, IsOneForDOfYAndDrift) {
  // v = -q x, D = D0 (1 + x^2/L^2) about the middle: with a = D0/L^2 the steady second moment is D0/(q - 3
  // a), and that of the Euler scheme with step dt is D0/(q - 3 a - dt (q - 2 a)^2/2): first order in dt,
  // known exactly.
  const double H = 100e-6, D0 = 1e-10, L = 20e-6, q = 7, a = D0 / (L * L);
  const SlabLaw law = make_slab_law(
      H, 1024, [&](double y) { return D0 * (1 + std::pow((y - H / 2) / L, 2)); },
      [&](double y) { return -q * (y - H / 2); });
  const std::int64_t walkers = 200'000;
  const double exact = D0 / (q - 3 * a);
  double before = 0;
  for (const double dt : {0.1, 0.05, 0.025}) {
    Walkers w(make_case(H, Type::reflect, Type::reflect, walkers, dt, 22), law);
    w.advance_to(std::llround(3 / dt));  // e^-37 of the start is left
    double second = 0, fourth = 0;
    for (const double y : w.heights()) {
      const double x2 = std::pow(y - H / 2, 2) / static_cast<double>(walkers);
      second += x2;
      fourth += x2 * x2 * static_cast<double>(walkers);
    }
    const double euler = D0 / (q - 3 * a - dt * std::pow(q - 2 * a, 2) / 2);
    const double sigma = std::sqrt((fourth - second * second) / static_cast<double>(walkers));
    EXPECT_NEAR(second, euler, normal_quantile(1 - alpha / 2) * sigma) << dt;
    if (before > 0) {
      EXPECT_NEAR((second - exact) / before, 0.5, 0.15) << dt;
    }
    before = second - exact;
  }
}

TEST(Trap, HoldsItsShareInEquilibriumAndFillsAsTheEquationSays) {
  const double H = 20e-6, D = 1e-10, dt = 5e-3, layer = 3e-6;
  const std::int64_t walkers = 100'000;
  Case c = make_case(H, Type::trap, Type::reflect, walkers, dt, 31);
  c.bottom.rate = 0.5;
  c.bottom.layer = layer;
  Walkers w(c, constant_slab(H, D));
  FokkerPlanck solver(constant_slab(H, D), c.bottom, c.top, 512);
  const double z = normal_quantile(1 - alpha / 2);
  double before = 0;
  for (const double t : {0.1, 0.5, 2.0}) {
    w.advance_to(std::llround(t / dt));
    solver.advance(t - before, 500);
    before = t;
    const double p = solver.trapped(), sigma = std::sqrt(p * (1 - p) / static_cast<double>(walkers));
    // O(dt/residence): a walker caught in mid-step may not leave in the same step
    EXPECT_NEAR(static_cast<double>(w.count(1).trapped[0]) / static_cast<double>(walkers), p,
                z * sigma + 0.5 * p * dt / 0.5)
        << t;
  }
  w.advance_to(std::llround(12 / dt));
  const double p = layer / (H + layer), sigma = std::sqrt(p * (1 - p) / static_cast<double>(walkers));
  const auto n = w.count(10);
  EXPECT_NEAR(static_cast<double>(n.trapped[0]) / static_cast<double>(walkers), p,
              z * sigma + 0.5 * p * dt / 0.5);
  // and the slab above it is uniform again
  const auto free = static_cast<double>(walkers - n.trapped[0]);
  EXPECT_GT(p_value(n.histogram, std::vector<double>(10, free / 10)), alpha);
}

TEST(TaylorDispersion, OfACouetteFlow) {
  // Variance along the flow, uniform start: 2 int_0^t (t - s) C(s) ds with
  // C(s) = sum over odd k of gamma^2 8 H^2/(k pi)^4 exp(-(k pi/H)^2 D s); for long times 2 t gamma^2 H^4/(120
  // D).
  const double H = 20e-6, D = 1e-10, gamma = 100, dt = 2e-3;
  const std::int64_t walkers = 100'000;
  Case c = make_case(H, Type::reflect, Type::reflect, walkers, dt, 41);
  c.shear_rate = gamma;
  WalkSettings s;
  s.track_flow_direction = true;
  Walkers w(c, constant_slab(H, D), s);
  for (const double t : {0.1, 1.0, 5.0}) {
    w.advance_to(std::llround(t / dt));
    double exact = 0;
    for (int k = 1; k < 60; k += 2) {
      const double a = std::pow(k * std::numbers::pi / H, 2) * D;
      exact += 2 * gamma * gamma * 8 * H * H / std::pow(k * std::numbers::pi, 4) *
               (t / a + std::expm1(-a * t) / (a * a));
    }
    const auto spread = w.spread();
    const double n = static_cast<double>(walkers), z = normal_quantile(1 - alpha / 2);
    EXPECT_LT(std::abs(spread.mean - gamma * H / 2 * t), z * std::sqrt(exact / n)) << t;
    // kurtosis between 1.8 (start) and 3 (late): sigma of a variance is at most sqrt(2/n) of it; the midpoint
    // rule loses dt^2-terms only, the reflection a share dt/relaxation = 0.5 %
    EXPECT_LT(std::abs(spread.variance / exact - 1), z * std::sqrt(2 / n) + 0.005) << t;
    if (t == 5.0) {
      EXPECT_NEAR(exact / (2 * t * gamma * gamma * std::pow(H, 4) / (120 * D)), 1, 0.1);
    }
  }
}

}  // namespace
}  // namespace hemowalk::coarse
