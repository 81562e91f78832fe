#include <gtest/gtest.h>

#include <cmath>

#include "core/check.hpp"
#include "core/random.hpp"
#include "core/statistics.hpp"

using namespace hemowalk;

TEST(Philox, KnownAnswers) {
  // Known-answer vectors of Philox 4x32-10: all-zero and all-one counters and keys. The stream occupies the
  // top byte of the last counter word and step the rest, so both are reachable through random_bits.
  const RandomBits zero = random_bits(0, static_cast<Stream>(0), 0, 0);
  EXPECT_EQ(zero.word[0], 0x6627e8d5u);
  EXPECT_EQ(zero.word[1], 0xe169c58du);
  EXPECT_EQ(zero.word[2], 0xbc57ac4cu);
  EXPECT_EQ(zero.word[3], 0x9b00dbd8u);
  const RandomBits ones = random_bits(~0ull, static_cast<Stream>(0xff), ~0ull, ~0ull);
  EXPECT_EQ(ones.word[0], 0x408f276du);
  EXPECT_EQ(ones.word[1], 0x41c83b0eu);
  EXPECT_EQ(ones.word[2], 0xa20bc7c6u);
  EXPECT_EQ(ones.word[3], 0x6d5451fdu);
}

TEST(Philox, EveryPartOfTheKeyMatters) {
  const auto word = [](std::uint64_t seed, Stream s, std::uint64_t id, std::uint64_t step) {
    return random_bits(seed, s, id, step).word[0];
  };
  const std::uint32_t base = word(7, Stream::test, 5, 3);
  EXPECT_EQ(base, word(7, Stream::test, 5, 3));
  EXPECT_NE(base, word(8, Stream::test, 5, 3));
  EXPECT_NE(base, word(7 + (1ull << 40), Stream::test, 5, 3));
  EXPECT_NE(base, word(7, Stream::packing, 5, 3));
  EXPECT_NE(base, word(7, Stream::test, 5 + (1ull << 40), 3));
  EXPECT_NE(base, word(7, Stream::test, 5, 3 + (1ull << 40)));
}

TEST(Philox, EndsOfTheUnitIntervalAreExcluded) {
  EXPECT_GT(uniform_float(0), 0.0f);
  EXPECT_LT(uniform_float(~0u), 1.0f);
  EXPECT_GT(uniform_double(0, 0), 0.0);
  EXPECT_LT(uniform_double(~0u, ~0u), 1.0);
}

/// Kolmogorov distance between sorted probabilities and the uniform law.
static double kolmogorov_distance(std::vector<double> p) {
  std::sort(p.begin(), p.end());
  double d = 0;
  const double n = static_cast<double>(p.size());
  for (std::size_t i = 0; i < p.size(); ++i)
    d = std::max({d, p[i] - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - p[i]});
  return d;
}

// alpha = 1e-3 per test with fixed seeds; the power check uses the same test on values wrong by 5 %.
TEST(Philox, NormalNumbersFollowTheNormalLaw) {
  const std::size_t n = 20000;
  std::vector<double> right, wrong, single;
  for (std::size_t i = 0; i < n / 2; ++i) {
    const auto z = normal2(random_bits(1, Stream::test, i, 0));
    for (int k = 0; k < 2; ++k) {
      right.push_back(normal_cdf(z[k]));
      wrong.push_back(normal_cdf(z[k] * 1.05));
    }
    const auto f = normal4(random_bits(2, Stream::test, i, 0));
    for (int k = 0; k < 4; ++k) single.push_back(normal_cdf(f[k]));
  }
  EXPECT_GT(kolmogorov_tail(kolmogorov_distance(right), right.size()), 1e-3);
  EXPECT_GT(kolmogorov_tail(kolmogorov_distance(single), single.size()), 1e-3);
  EXPECT_LT(kolmogorov_tail(kolmogorov_distance(wrong), wrong.size()), 1e-3);
}

TEST(Philox, StepsAndIdsAreUncorrelated) {
  // The correlation of n independent pairs has standard error 1/sqrt(n): 3.9 sigma is alpha = 1e-4 two-sided.
  const int n = 40000;
  double by_step = 0, by_id = 0, within = 0;
  for (int i = 0; i < n; ++i) {
    const auto a = normal2(random_bits(3, Stream::test, 11, i)),
               b = normal2(random_bits(3, Stream::test, 11, i + 1));
    const auto c = normal2(random_bits(3, Stream::test, i, 4)),
               d = normal2(random_bits(3, Stream::test, i + 1, 4));
    by_step += a[0] * b[0];
    by_id += c[0] * d[0];
    within += a[0] * a[1];
  }
  const double limit = 3.9 * std::sqrt(static_cast<double>(n));
  EXPECT_LT(std::abs(by_step), limit);
  EXPECT_LT(std::abs(by_id), limit);
  EXPECT_LT(std::abs(within), limit);
}

TEST(Philox, SequenceIsReproducibleAndBounded) {
  RandomSequence a(9, Stream::test, 3), b(9, Stream::test, 3);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.normal(), b.normal());
  std::vector<int> count(7);
  for (int i = 0; i < 7000; ++i) ++count.at(a.below(7));
  double chi = 0;
  for (const int c : count) chi += (c - 1000.0) * (c - 1000.0) / 1000.0;
  EXPECT_GT(chi_squared_tail(chi, 6), 1e-3);
}

TEST(Statistics, MomentsOfASmallSample) {
  const std::vector<double> x{2, 4, 4, 4, 5, 5, 7, 9};
  EXPECT_DOUBLE_EQ(mean(x), 5);
  EXPECT_NEAR(variance(x), 32.0 / 7, 1e-14);
  EXPECT_NEAR(standard_error(x), std::sqrt(32.0 / 7 / 8), 1e-14);
  EXPECT_DOUBLE_EQ(median(x), 4.5);
  EXPECT_DOUBLE_EQ(quantile(x, 0), 2);
  EXPECT_DOUBLE_EQ(quantile(x, 1), 9);
  EXPECT_NEAR(excess_kurtosis({-1, -1, 1, 1}), -2, 1e-14);
  EXPECT_THROW(mean({}), InputError);
  EXPECT_THROW(variance({1}), InputError);
}

TEST(Statistics, NormalAndChiSquaredTables) {
  EXPECT_NEAR(normal_cdf(1.959963984540054), 0.975, 1e-14);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-12);
  EXPECT_NEAR(chi_squared_tail(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(kolmogorov_tail(1.3581 / 1000, 1000000), 0.05, 1e-4);  // the 5 % point of the asymptotic law
}

TEST(Statistics, StraightLineWithAndWithoutWeights) {
  const std::vector<double> x{0, 1, 2, 3}, exact{1, 3, 5, 7};
  const LinearFit line = fit_line(x, exact);
  EXPECT_NEAR(line.intercept, 1, 1e-13);
  EXPECT_NEAR(line.slope, 2, 1e-13);
  EXPECT_NEAR(line.slope_sigma, 0, 1e-13);
  // By hand: y = (0, 1, 1), x = (0, 1, 2): slope 1/2, intercept 1/6, residual sum 1/6, slope variance
  // (1/6)/2.
  const LinearFit noisy = fit_line({0, 1, 2}, {0, 1, 1});
  EXPECT_NEAR(noisy.slope, 0.5, 1e-14);
  EXPECT_NEAR(noisy.intercept, 1.0 / 6, 1e-14);
  EXPECT_NEAR(noisy.slope_sigma, std::sqrt(1.0 / 12), 1e-14);
  // Equal sigmas s: slope variance s^2 / sum (x - mean)^2 = 0.04/2.
  EXPECT_NEAR(fit_line({0, 1, 2}, {0, 1, 1}, {.2, .2, .2}).slope_sigma, std::sqrt(0.02), 1e-14);
  EXPECT_THROW(fit_line({1, 1}, {1, 2}), InputError);
  EXPECT_THROW(fit_line({1, 2}, {1, 2}, {1, 0}), InputError);
}
