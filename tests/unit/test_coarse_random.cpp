/// \file The walk's own random numbers and elementary functions against Random123 and the standard library.

#include <Random123/philox.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "coarse/lanes.hpp"
#include "coarse/normal.hpp"
#include "coarse/walk.hpp"
#include "core/statistics.hpp"
#include "support/coarse_exact.hpp"

namespace hemowalk::coarse {
namespace {

using Wide = Lanes<16>;

TEST(RandomBits, AreRandom123s) {
  std::mt19937_64 any(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::uint64_t seed = any();
    r123::Philox4x32::ctr_type counter;
    RandomBits mine;
    for (int w = 0; w < 4; ++w) counter[w] = mine.word[w] = static_cast<std::uint32_t>(any() >> (trial % 64));
    const r123::Philox4x32::key_type key = {
        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
    const auto expected = r123::Philox4x32()(counter, key);
    mine = philox_bits(mine, seed);
    for (int w = 0; w < 4; ++w) ASSERT_EQ(mine.word[w], expected[w]);
  }
  // known answers of the library's own tests: the step's upper byte belongs to the stream
  const RandomBits zero = philox_bits({{0, 0, 0, 0}}, 0);
  EXPECT_EQ(zero.word[0], 0x6627e8d5u);
  EXPECT_EQ(zero.word[3], 0x9b00dbd8u);
  EXPECT_NE(random_bits(1, Stream::test, 2, 3).word[0], random_bits(1, Stream::initial, 2, 3).word[0]);
}

TEST(LanePhilox, EqualsRandom123InEveryLane) {
  std::mt19937_64 any(7);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::uint64_t seed = any(), first = any() >> (trial % 60 + 2), step = any() >> (8 + trial % 50);
    const auto stream = trial % 2 ? Stream::coarse_walk : Stream::coarse_wall;
    const Wide::Bits offset([&](auto) { return static_cast<std::uint32_t>(any() & 0xffff); });
    const auto words = lane_bits<Wide>(seed, stream, first, offset, step);
    for (int l = 0; l < 16; ++l) {
      const RandomBits one = random_bits(seed, stream, first + offset[l], step);
      for (int w = 0; w < 4; ++w) ASSERT_EQ(words.word[w][l], one.word[w]) << trial << " lane " << l;
    }
  }
}

/// Largest |f(x)/exact(x) - 1| over the arguments, all lanes.
template <class F, class G>
double worst_relative(const std::vector<float>& x, const F& f, const G& exact) {
  double worst = 0;
  for (std::size_t i = 0; i + 16 <= x.size(); i += 16) {
    const Wide::Real result = f(load<float, 16>(&x[i]));
    for (int l = 0; l < 16; ++l) {
      const double e = exact(static_cast<double>(x[i + l]));
      worst = std::max(worst, std::abs(result[l] / e - 1));
    }
  }
  return worst;
}

std::vector<float> grid(double low, double high, int n, bool logarithmic) {
  std::vector<float> x(n);
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    x[i] = static_cast<float>(logarithmic ? low * std::pow(high / low, s) : low + (high - low) * s);
  }
  return x;
}

TEST(LaneFunctions, KeepTheirStatedAccuracy) {
  const auto log_exact = [](double x) { return -2 * std::log(x / 4294967296.0); };
  const auto log_lanes = [](Wide::Real x) { return minus_two_log<Wide>(x); };
  EXPECT_LT(worst_relative(grid(0.5, 4.29e9, 1 << 16, true), log_lanes, log_exact), 2e-7);
  // near the end of the range the result goes to zero: its relative accuracy must not
  EXPECT_LT(worst_relative(grid(4.29e9, 4.2949e9, 1 << 14, false), log_lanes, log_exact), 2e-7);
  EXPECT_LT(worst_relative(
                grid(-80, 80, 1 << 16, false), [](Wide::Real x) { return exponential<Wide>(x); },
                [](double x) { return std::exp(x); }),
            1e-5);  // the argument's own rounding: 80 x 2^-24 = 5e-6
  EXPECT_LT(worst_relative(
                grid(-2, 2, 1 << 16, false), [](Wide::Real x) { return exponential<Wide>(x); },
                [](double x) { return std::exp(x); }),
            3e-7);
  EXPECT_LT(worst_relative(
                grid(1e-3, 5, 1 << 14, false), [](Wide::Real x) { return erfcx<Wide>(x); },
                [](double x) { return std::exp(x * x) * std::erfc(x); }),
            4e-7);
  // asymptotic series for large arguments: 1/(x sqrt pi) (1 - 1/2x^2 + 3/4x^4 - 15/8x^6)
  EXPECT_LT(worst_relative(
                grid(30, 1e5, 1 << 10, true), [](Wide::Real x) { return erfcx<Wide>(x); },
                [](double x) {
                  const double q = 1 / (2 * x * x);
                  return (1 - q + 3 * q * q - 15 * q * q * q) / (x * std::sqrt(std::numbers::pi));
                }),
            4e-7);
}

TEST(LaneFunctions, SineAndCosineOfTheWholeCircle) {
  double worst = 0;
  for (std::uint64_t w = 0; w < (std::uint64_t{1} << 32); w += 16 * 40503) {
    const Wide::Bits words([&](auto l) { return static_cast<std::uint32_t>(w + 40503 * l); });
    Wide::Real c, s;
    unit_circle<Wide>(words, c, s);
    for (int l = 0; l < 16; ++l) {
      const double angle = 2 * std::numbers::pi * words[l] / 4294967296.0;
      worst = std::max({worst, std::abs(c[l] - std::cos(angle)), std::abs(s[l] - std::sin(angle))});
    }
  }
  EXPECT_LT(worst, 2e-7);
}

TEST(NormalPair, HasTheMomentsAndTheShapeOfTheNormalLaw) {
  constexpr int packs = 1 << 14, bins = 64;
  const Wide::Bits offset([](auto l) { return static_cast<std::uint32_t>(l); });
  std::vector<std::int64_t> counts(bins, 0);
  double sum = 0, square = 0, fourth = 0, cross = 0;
  for (int i = 0; i < packs; ++i) {
    const auto words = lane_bits<Wide>(11, Stream::test, 0, offset, i);
    const NormalPair<Wide> p(words.word[0], words.word[1]);
    for (int l = 0; l < 16; ++l) {
      const double r = std::sqrt(p.square[l]), a = r * p.cosine[l], b = r * p.sine[l];
      for (const double z : {a, b}) {
        sum += z;
        square += z * z;
        fourth += z * z * z * z;
        ++counts[std::min(static_cast<int>(normal_cdf(z) * bins), bins - 1)];
      }
      cross += a * b;
    }
  }
  const double n = 2.0 * packs * 16, limit = normal_quantile(1 - alpha / 2);
  EXPECT_LT(std::abs(sum / n), limit / std::sqrt(n));
  EXPECT_LT(std::abs(square / n - 1), limit * std::sqrt(2 / n));
  EXPECT_LT(std::abs(fourth / n - 3), limit * std::sqrt(96 / n));
  EXPECT_LT(std::abs(cross / (n / 2)), limit / std::sqrt(n / 2));
  EXPECT_GT(p_value(counts, std::vector<double>(bins, n / bins)), alpha);
}

TEST(UptakeProbability, GoesOverIntoTheAbsorbingBridgeAndTheSmallRateLaw) {
  using One = Lanes<1>;
  const float s = 3.0f;
  for (const float x0 : {0.1f, 1.0f, 2.5f})
    for (const float x1 : {0.05f, 0.7f, 3.0f}) {
      // infinitely fast uptake: 2/(1 + exp(2 x0 x1/s)) is the bridge for a mirrored end point
      const double bridge = 2 / (1 + std::exp(2.0 * x0 * x1 / s));
      EXPECT_NEAR(uptake_probability<One>(x0, x1, s, 1e5f) / bridge, 1, 1e-4);
    }
  // Mean uptake from a uniform concentration, small rate k: k dt per unit concentration (first order in k).
  const double k = 1e-3;
  double taken = 0;
  const double h = 0.02;
  for (double x0 = h / 2; x0 < 15; x0 += h)
    for (double x1 = h / 2; x1 < 15; x1 += h) {
      const double step =
          (std::exp(-(x1 - x0) * (x1 - x0) / (2 * s)) + std::exp(-(x1 + x0) * (x1 + x0) / (2 * s))) /
          std::sqrt(2 * std::numbers::pi * s);
      taken +=
          h * h * step *
          uptake_probability<One>(static_cast<float>(x0), static_cast<float>(x1), s, static_cast<float>(k));
    }
  // second order: - (4/3 sqrt(pi)) k e with e = k sqrt(2/s): below 1e-3 of the first
  EXPECT_NEAR(taken / k, 1, 2e-3);
}

}  // namespace
}  // namespace hemowalk::coarse
