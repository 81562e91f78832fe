/// \file The ensemble: reproducible, uniform where it must be, exact about slow drifts.

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>

#include "coarse/walkers.hpp"
#include "core/check.hpp"
#include "support/coarse_exact.hpp"

namespace hemowalk::coarse {
namespace {

constexpr double gap = 50e-6;
using Type = Face::Type;

double wavy_D(double y) { return 1e-10 * (1 + 0.8 * std::cos(2 * std::numbers::pi * y / gap)); }
double still(double) { return 0; }

struct Outcome {
  std::vector<std::int64_t> numbers;
  std::vector<double> places, spread;
  bool operator==(const Outcome&) const = default;
};

Outcome walk_with(int threads, const std::vector<std::int64_t>& stops, StepLaw step_law, Type bottom) {
  omp_set_num_threads(threads);
  Case c = make_case(gap, bottom, Type::reflect, 5003, 5e-3, 42);
  c.bottom.rate = bottom == Type::trap ? 0.05 : 2e-6;
  c.shear_rate = 100;
  WalkSettings s;
  s.step_law = step_law;
  s.memory = 10e-3;
  s.tail_exponent = 3;
  s.tail_fraction = 0.02;
  s.cell_free_layer = 2e-6;
  s.track_flow_direction = bottom == Type::reflect;
  Walkers w(c, make_slab_law(gap, 256, wavy_D, [](double y) { return 1e-7 * std::sin(y / gap); }), s);
  for (const auto stop : stops) w.advance_to(stop);
  const auto n = w.count(10);
  Outcome o{n.histogram, w.heights(), {}};
  o.numbers.insert(o.numbers.end(), n.absorbed.begin(), n.absorbed.end());
  o.numbers.insert(o.numbers.end(), n.trapped.begin(), n.trapped.end());
  if (s.track_flow_direction) o.spread = {w.spread().mean, w.spread().variance};
  omp_set_num_threads(omp_get_num_procs());
  return o;
}

TEST(Walkers, AreTheSameBitForBitWhateverTheThreadsAndStops) {
  for (const StepLaw law : {StepLaw::gaussian, StepLaw::persistent, StepLaw::heavy_tail})
    for (const Type bottom : {Type::reflect, Type::absorb, Type::robin, Type::trap}) {
      if (law != StepLaw::gaussian && bottom != Type::reflect && bottom != Type::trap) continue;
      const Outcome one = walk_with(1, {1301}, law, bottom);
      EXPECT_EQ(one, walk_with(2, {1301}, law, bottom));
      Outcome stops = walk_with(3, {1, 2, 7, 511, 514, 1301}, law, bottom);
      if (bottom == Type::reflect || bottom == Type::trap) {
        EXPECT_EQ(one, stops);
      } else {  // absorbed walkers are taken out at other times, so the stored order may differ, not the
                // walkers
        EXPECT_EQ(one.numbers, stops.numbers);
        auto a = one.places, b = stops.places;
        std::sort(a.begin(), a.end());
        std::sort(b.begin(), b.end());
        EXPECT_EQ(a, b);
      }
    }
}

TEST(Walkers, AnotherSeedWalksDifferently) {
  Case c = make_case(gap, Type::reflect, Type::reflect, 1000, 5e-3, 1);
  Walkers a(c, constant_slab(gap, 1e-10));
  c.seed = 2;
  Walkers b(c, constant_slab(gap, 1e-10));
  a.advance_to(10);
  b.advance_to(10);
  EXPECT_NE(a.heights(), b.heights());
}

/// Chi-squared p-value of "uniform" for walkers that started uniform.
double uniformity(const SlabLaw& law, double dt, double end, bool ito_drift, std::int64_t walkers = 150'000,
                  StepLaw step_law = StepLaw::gaussian, double memory = 0) {
  WalkSettings s;
  s.ito_drift = ito_drift;
  s.step_law = step_law;
  s.memory = memory;
  Walkers w(make_case(law.height, Type::reflect, Type::reflect, walkers, dt, 5), law, s);
  w.advance_to(std::llround(end / dt));
  const auto n = w.count(50);
  return p_value(n.histogram, std::vector<double>(50, static_cast<double>(walkers) / 50));
}

TEST(Walkers, UniformStaysUniformUnderDOfY) {
  const auto wavy = make_slab_law(gap, 256, wavy_D, still);
  // Weak bias of the density: order dt D'' = 2e-3 x 1.3 = 0.3 %, against 1.6 % statistical error per bin.
  EXPECT_GT(uniformity(wavy, 2e-3, 4, true), alpha);
  EXPECT_LT(uniformity(wavy, 2e-3, 4, false), 1e-12) << "the test does not see a missing D'";
  // D' different from zero at the walls, as measured ones have it
  const auto layered = make_slab_law(
      gap, 256, [](double y) { return 1e-10 * (1 - 0.6 * std::exp(-std::min(y, gap - y) / 6e-6)); }, still);
  EXPECT_GT(uniformity(layered, 1e-3, 2, true), alpha);
  EXPECT_LT(uniformity(layered, 1e-3, 2, false), 1e-12);
}

TEST(Walkers, DriftGivesItsSteadyProfile) {
  // c ~ exp(int v/D) with both varying: v = v0 D/D0 gives exp(v0 y/D0)
  const double v0 = -8e-6, D0 = 1e-10, height = 20e-6, dt = 1e-3;
  const auto D = [&](double y) { return D0 * (1 + 0.4 * std::cos(2 * std::numbers::pi * y / height)); };
  const auto law = make_slab_law(height, 256, D, [&](double y) { return v0 * D(y) / D0; });
  const std::int64_t walkers = 100'000;
  Walkers w(make_case(height, Type::reflect, Type::reflect, walkers, dt, 6), law);
  w.advance_to(4000);  // relaxation time below H^2/(0.9 D0 pi^2) = 0.45 s: e^-8 of the start is left
  const auto n = w.count(40);
  std::vector<double> expected(40);
  double total = 0;
  for (int i = 0; i < 40; ++i) total += expected[i] = std::exp(v0 * height * (i + 0.5) / 40 / D0);
  for (double& e : expected) e *= static_cast<double>(walkers) / total;
  EXPECT_GT(p_value(n.histogram, expected), alpha);
  // 5 % wrong drift is seen
  total = 0;
  for (int i = 0; i < 40; ++i) total += expected[i] = std::exp(1.05 * v0 * height * (i + 0.5) / 40 / D0);
  for (double& e : expected) e *= static_cast<double>(walkers) / total;
  EXPECT_LT(p_value(n.histogram, expected), alpha);
}

TEST(Walkers, KeepADriftFarBelowTheResolutionOfAFloat) {
  // 0.82 mm, v dt = 10 pm: a float position near the top has steps of 49 to 61 pm.
  const double H = 0.82e-3, v = 1e-9, dt = 10e-3, D = 1e-18;
  const std::int64_t walkers = 20'000, steps = 4000;
  Walkers w(make_case(H, Type::reflect, Type::reflect, walkers, dt, 8),
            make_slab_law(
                H, 256, [&](double) { return D; }, [&](double) { return v; }));
  const auto before = w.heights();
  w.advance_to(steps);
  const auto after = w.heights();
  double moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) moved += after[i] - before[i];
  moved /= static_cast<double>(before.size());
  const double t = dt * static_cast<double>(steps),
               sigma = std::sqrt(2 * D * t / static_cast<double>(walkers));
  // Truncating a step of rms 185 units loses 0.4/185 of its mean; 4 sigma of noise is 6e-4.
  EXPECT_NEAR(moved / (v * t), 1, 0.4 / 185 + 4 * sigma / (v * t));
}

TEST(Walkers, DiffuseByTwoDt) {
  const double H = 0.82e-3, D = 1e-10, dt = 10e-3;
  const std::int64_t walkers = 200'000, steps = 100;
  Walkers w(make_case(H, Type::periodic, Type::periodic, walkers, dt, 9), constant_slab(H, D));
  const auto before = w.heights();
  w.advance_to(steps);
  const auto after = w.heights();
  double square = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    double d = after[i] - before[i];
    d -= H * std::round(d / H);
    square += d * d / static_cast<double>(walkers);
  }
  const double expected = 2 * D * dt * static_cast<double>(steps);
  const double sigma = std::sqrt(2.0 / static_cast<double>(walkers));
  EXPECT_LT(std::abs(square / expected - 1), normal_quantile(1 - alpha / 2) * sigma);
  EXPECT_LT(normal_quantile(1 - alpha / 2) * sigma, 0.05) << "the test would not see a D wrong by 5 %";
}

TEST(Walkers, PersistentWalkHasItsMemoryAndItsD) {
  // <x^2> = 2 D (t - m (1 - exp(-t/m))) for a stationary Ornstein-Uhlenbeck velocity, at any dt
  const double H = 0.82e-3, D = 1e-10, memory = 10e-3;
  const std::int64_t walkers = 200'000;
  for (const double dt : {1e-4, 2e-3, 50e-3}) {
    WalkSettings s;
    s.step_law = StepLaw::persistent;
    s.memory = memory;
    Walkers w(make_case(H, Type::periodic, Type::periodic, walkers, dt, 10), constant_slab(H, D), s);
    const auto before = w.heights();
    for (const std::int64_t steps : {5, 40}) {
      w.advance_to(steps);
      const auto after = w.heights();
      double square = 0;
      for (std::size_t i = 0; i < before.size(); ++i) {
        double d = after[i] - before[i];
        d -= H * std::round(d / H);
        square += d * d / static_cast<double>(walkers);
      }
      const double t = dt * static_cast<double>(steps),
                   expected = 2 * D * (t + memory * std::expm1(-t / memory));
      EXPECT_LT(std::abs(square / expected - 1), normal_quantile(1 - alpha / 2) * std::sqrt(2.0 / walkers))
          << dt;
    }
  }
  // and keeps uniform uniform, with the part of D' its own correlations do not bring
  const auto wavy = make_slab_law(gap, 256, wavy_D, still);
  EXPECT_GT(uniformity(wavy, 5e-3, 4, true, 100'000, StepLaw::persistent, 5e-3), alpha);
  EXPECT_LT(uniformity(wavy, 5e-3, 4, false, 100'000, StepLaw::persistent, 5e-3), 1e-12);
}

TEST(Walkers, HeavyTailHasItsVarianceAndItsTail) {
  const double H = 0.82e-3, D = 1e-10, dt = 10e-3, a = 5, f = 0.05;
  const std::int64_t walkers = 400'000;
  WalkSettings s;
  s.step_law = StepLaw::heavy_tail;
  s.tail_exponent = a;
  s.tail_fraction = f;
  Walkers w(make_case(H, Type::periodic, Type::periodic, walkers, dt, 11), constant_slab(H, D), s);
  const auto before = w.heights();
  w.advance_to(1);
  const auto after = w.heights();
  double square = 0, fourth = 0;
  std::int64_t far = 0;
  const double body = 1 / std::sqrt(1 - f + 4 * f * a / (a - 2)), limit = 6 * body;
  for (std::size_t i = 0; i < before.size(); ++i) {
    double d = after[i] - before[i];
    d = (d - H * std::round(d / H)) / std::sqrt(2 * D * dt);
    square += d * d / static_cast<double>(walkers);
    fourth += d * d * d * d / static_cast<double>(walkers);
    far += std::abs(d) > limit;
  }
  const double z = normal_quantile(1 - alpha / 2);
  EXPECT_LT(std::abs(square - 1), z * std::sqrt((fourth - 1) / static_cast<double>(walkers)));
  const double expected = f * std::pow(limit / (2 * body), -a) * static_cast<double>(walkers);
  EXPECT_LT(std::abs(static_cast<double>(far) - expected), z * std::sqrt(expected));
}

TEST(Walkers, RefuseWhatCannotBeWalked) {
  EXPECT_THROW(Walkers(make_case(gap, Type::absorb, Type::reflect, 100, 10, 1), constant_slab(gap, 1e-10)),
               InputError);
  EXPECT_THROW(
      Walkers(make_case(gap, Type::periodic, Type::reflect, 100, 1e-3, 1), constant_slab(gap, 1e-10)),
      InputError);
  Case c = make_case(gap, Type::trap, Type::reflect, 100, 1e-3, 1);
  c.bottom.rate = 1;
  EXPECT_THROW(Walkers(c, constant_slab(gap, 1e-10)), InputError);  // no layer stated anywhere
  c.bottom.layer = 2e-6;
  EXPECT_NO_THROW(Walkers(c, constant_slab(gap, 1e-10)));
}

}  // namespace
}  // namespace hemowalk::coarse
