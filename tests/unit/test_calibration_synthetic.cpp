/// The synthetic generator is the ruler of every calibration test: here it is measured against exact results.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calibration/synthetic.hpp"
#include "core/check.hpp"
#include "core/statistics.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;

constexpr double alpha = 1e-4;  // per test; seeds are fixed, so a pass stays a pass

/// z of the sample mean of values against an expectation.
double z_of(const std::vector<double>& values, double expected) {
  return (mean(values) - expected) / standard_error(values);
}
double z_limit() { return normal_quantile(1 - alpha / 2); }

/// Heights of all platelets in one sample.
std::vector<double> heights(const data::Trajectories& t, std::size_t sample) {
  const auto& p = t.kinds.at("platelet");
  std::vector<double> y;
  for (std::size_t n = 0; n < p.cells(); ++n) y.push_back(p.at(sample, n, 1));
  return y;
}

/// Chi-squared p-value of "uniform over the gap" in 10 bins; platelets are independent.
double uniform_p(const std::vector<double>& y, double gap) {
  std::vector<double> bins(10, 0);
  for (double v : y) bins[static_cast<std::size_t>(std::min(9.0, 10 * v / gap))] += 1;
  const double expected = static_cast<double>(y.size()) / 10;
  double chi = 0;
  for (double b : bins) chi += (b - expected) * (b - expected) / expected;
  return chi_squared_tail(chi, 9);
}

/// Mean of cos(pi y/gap), weighted with its start: the slowest mode of the slab decays as exp(-D (pi/gap)^2
/// t).
std::vector<double> mode_products(const data::Trajectories& t, double gap) {
  std::vector<double> products;
  const auto a = heights(t, 0), b = heights(t, t.time.size() - 1);
  for (std::size_t n = 0; n < a.size(); ++n)
    products.push_back(2 * std::cos(std::numbers::pi * a[n] / gap) * std::cos(std::numbers::pi * b[n] / gap));
  return products;
}

TEST(Synthetic, ReflectingSlabIsExact) {
  Synthetic s;
  s.platelets = 200000;
  s.gap = 10e-6;
  s.duration = 0.08;
  s.sample = 0.02;  // 2 um per step in a 10 um gap: any error of the reflection would show
  const double k = std::numbers::pi / s.gap, expected = std::exp(-s.D * k * k * s.duration);
  const auto t = generate(s);
  EXPECT_LT(std::abs(z_of(mode_products(t, s.gap), expected)), z_limit());
  // Power: without reflection (a free walk read modulo the gap) or with D wrong by 10 % the mode is off.
  EXPECT_GT(std::abs(z_of(mode_products(t, s.gap), std::exp(-1.1 * s.D * k * k * s.duration))), z_limit());
  EXPECT_GT(uniform_p(heights(t, 4), s.gap), alpha);
}

TEST(Synthetic, FreeStepsHaveVariance2Dt) {
  Synthetic s;
  s.platelets = 200;
  s.duration = 0.5;
  s.gap = 1e-3;
  const auto t = generate(s);
  const auto& p = t.kinds.at("platelet");
  std::vector<double> squares;
  for (std::size_t k = 1; k < t.time.size(); ++k)
    for (std::size_t n = 0; n < p.cells(); ++n)
      squares.push_back(std::pow(p.at(k, n, 1) - p.at(k - 1, n, 1), 2));
  EXPECT_LT(std::abs(z_of(squares, 2 * s.D * s.sample)), z_limit());
  EXPECT_GT(std::abs(z_of(squares, 2 * 1.05 * s.D * s.sample)), z_limit());
}

TEST(Synthetic, UniformStaysUniformUnderLocalD) {
  Synthetic s;
  s.platelets = 20000;
  s.gap = 20e-6;
  s.D_contrast = 0.8;
  s.duration = 0.4;  // (gap/2pi)^2/D = 0.1 s: a missing drift D' would empty the fast places
  s.sample = 5e-3;
  const auto t = generate(s);
  EXPECT_GT(uniform_p(heights(t, t.time.size() - 1), s.gap), alpha);
}

TEST(Synthetic, LocalDIsTheStatedOne) {
  Synthetic s;
  s.platelets = 400000;
  s.D_contrast = 0.6;
  s.duration = s.sample = 1e-3;
  const auto t = generate(s);
  const auto a = heights(t, 0), b = heights(t, 1);
  for (double centre : {12.5e-6, 25e-6, 37.5e-6}) {
    std::vector<double> scaled;
    for (std::size_t n = 0; n < a.size(); ++n)
      if (std::abs(a[n] - centre) < 2e-6)
        scaled.push_back(std::pow(b[n] - a[n], 2) / (2 * true_D(s, a[n]) * s.sample));
    EXPECT_LT(std::abs(z_of(scaled, 1)), z_limit()) << centre;
    EXPECT_GT(std::abs(z_of(scaled, 1.05)), z_limit()) << centre;
  }
}

TEST(Synthetic, MemoryGivesTheOrnsteinUhlenbeckMsd) {
  Synthetic s;
  s.platelets = 20000;
  s.gap = 1e-3;
  s.memory = 10e-3;
  s.sample = 4e-3;
  s.duration = 40e-3;
  const auto t = generate(s);
  for (std::size_t k : {1u, 3u, 10u}) {
    std::vector<double> squares;
    const auto a = heights(t, 0), b = heights(t, k);
    for (std::size_t n = 0; n < a.size(); ++n) squares.push_back(std::pow(b[n] - a[n], 2));
    const double lag = t.time[k], e = std::exp(-lag / s.memory);
    EXPECT_LT(std::abs(z_of(squares, 2 * s.D * (lag - s.memory * (1 - e)))), z_limit()) << lag;
  }
}

TEST(Synthetic, MemoryAndLocalDKeepUniform) {
  Synthetic s;
  s.platelets = 20000;
  s.gap = 20e-6;
  s.D_contrast = 0.5;
  s.memory = 2e-3;
  s.duration = 0.4;
  s.sample = 2e-3;
  const auto t = generate(s);
  EXPECT_GT(uniform_p(heights(t, t.time.size() - 1), s.gap), alpha);
}

TEST(Synthetic, JumpsAddTheirShareOfD) {
  Synthetic s;
  s.platelets = 2000;
  s.gap = 1e-2;
  s.duration = 0.2;
  s.jump_fraction = 0.0035;
  s.jump_size = 3e-6;
  std::vector<double> squares;
  const auto t = generate(s);
  const auto a = heights(t, 0), b = heights(t, 200);
  for (std::size_t n = 0; n < a.size(); ++n) squares.push_back(std::pow(b[n] - a[n], 2));
  EXPECT_LT(std::abs(z_of(squares, 2 * (s.D + jump_D(s)) * s.duration)), z_limit());
  EXPECT_NEAR(jump_D(s), 0.1575 * s.D, 1e-14);
}

TEST(Synthetic, LayerMeanOfDIsTheIntegral) {
  Synthetic s;
  s.D_contrast = 0.5;
  double sum = 0;
  for (int k = 0; k < 30000; ++k) sum += true_D(s, 10e-6 + (k + 0.5) * 1e-9);
  EXPECT_NEAR(true_layer_D(s, 10e-6, 40e-6), sum / 30000, 1e-9 * s.D);
}

TEST(Synthetic, SamePlateletWhateverTheirNumber) {
  Synthetic few, many;
  few.platelets = 3;
  many.platelets = 9;
  few.duration = many.duration = 0.05;
  const auto a = generate(few), b = generate(many);
  for (std::size_t t = 0; t < a.time.size(); ++t)
    EXPECT_EQ(a.kinds.at("platelet").at(t, 2, 1), b.kinds.at("platelet").at(t, 2, 1));
}

TEST(Synthetic, RefusesVanishingD) {
  Synthetic s;
  s.D_contrast = 1;
  EXPECT_THROW(generate(s), InputError);
}

}  // namespace
