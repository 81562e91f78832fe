// Moments of the discrete delta functions: what interpolation and spreading rest on.
#include <gtest/gtest.h>

#include "resolved/ibm/kernel.hpp"

namespace hemowalk::ibm {
namespace {

constexpr double round_off = 1e-14;

template <class Function>
void expect_moments(Function phi, bool second_sum) {
  for (int s = 0; s < 1000; ++s) {
    const double f = s / 1000.0;
    const Weights<double> w = phi(f);
    EXPECT_NEAR(w.w0 + w.w1 + w.w2 + w.w3, 1, round_off) << f;        // partition of unity
    EXPECT_NEAR(-w.w0 * 1 + w.w2 * 1 + w.w3 * 2, f, round_off) << f;  // linear functions
    if (second_sum) {
      EXPECT_NEAR(w.w0 * w.w0 + w.w1 * w.w1 + w.w2 * w.w2 + w.w3 * w.w3, 3.0 / 8, round_off) << f;
    }
    for (const double v : {w.w0, w.w1, w.w2, w.w3}) EXPECT_GE(v, -round_off);
  }
}

TEST(Kernel, MomentsOfPhi4) {
  expect_moments([](double f) { return phi4(f); }, true);
}
TEST(Kernel, MomentsOfPhi3) {
  expect_moments([](double f) { return phi3(f); }, false);
}
TEST(Kernel, MomentsOfPhi2) {
  expect_moments([](double f) { return phi2(f); }, false);
}

TEST(Kernel, Phi4SplitsEvenlyBetweenEvenAndOddNodes) {
  for (int s = 0; s < 100; ++s) {
    const auto w = phi4(s / 100.0);
    EXPECT_NEAR(w.w0 + w.w2, 0.5, round_off);
    EXPECT_NEAR(w.w1 + w.w3, 0.5, round_off);
  }
}

TEST(Kernel, Phi3IsContinuousWhereTheNearestNodeChanges) {
  const auto below = phi3(0.5 - 1e-12), above = phi3(0.5 + 1e-12);
  EXPECT_NEAR(below.w0, above.w0, 1e-11);
  EXPECT_NEAR(below.w1, above.w1, 1e-11);
  EXPECT_NEAR(below.w2, above.w2, 1e-11);
  EXPECT_NEAR(below.w3, above.w3, 1e-11);
}

}  // namespace
}  // namespace hemowalk::ibm
