#pragma once
/// \file Exact solutions and statistics the tests of the coarse walk compare with.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "coarse/case.hpp"
#include "coarse/slab_law.hpp"
#include "core/statistics.hpp"

namespace hemowalk::coarse {

/// Absorbed fraction, uniform start, one absorbing and one reflecting face (method 11):
/// 1 - sum 2/l^2 exp(-l^2 D t/H^2), l = (k + 1/2) pi.
inline double absorbed_exactly(double D, double t, double height) {
  double rest = 0;
  for (int k = 0; k < 400; ++k) {
    const double l = (k + 0.5) * std::numbers::pi;
    rest += 2 / (l * l) * std::exp(-l * l * D * t / (height * height));
  }
  return 1 - rest;
}

/// The same with a partially reflecting face of rate k: eigenvalues b tan b = k H/D = L,
/// 1 - sum 2 L^2/(b^2 (b^2 + L^2 + L)) exp(-b^2 D t/H^2).
inline double reacted_exactly(double k, double D, double t, double height) {
  const double L = k * height / D;
  double rest = 0;
  for (int n = 0; n < 400; ++n) {
    double low = n * std::numbers::pi, high = (n + 0.5) * std::numbers::pi;
    for (int i = 0; i < 80; ++i) {  // b sin b - L cos b changes sign once in the interval
      const double b = (low + high) / 2;
      const bool below = (b * std::sin(b) - L * std::cos(b)) * (n % 2 ? -1 : 1) < 0;
      (below ? low : high) = b;
    }
    const double b = (low + high) / 2;
    rest += 2 * L * L / (b * b * (b * b + L * L + L)) * std::exp(-b * b * D * t / (height * height));
  }
  return 1 - rest;
}

/// p-value of counts against expected numbers (categories with an expectation below 5 are an error of the
/// test).
inline double p_value(const std::vector<std::int64_t>& counts, const std::vector<double>& expected,
                      int fitted = 1) {
  double sum = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    sum += std::pow(static_cast<double>(counts[i]) - expected[i], 2) / expected[i];
  return chi_squared_tail(sum, static_cast<double>(counts.size()) - fitted);
}

/// A slab with one D.
inline SlabLaw constant_slab(double height, double D) { return {height, {D, D}, {0, 0}}; }

inline Case make_case(double height, Face::Type bottom, Face::Type top, std::int64_t walkers, double dt,
                      std::uint64_t seed) {
  Case c;
  c.height = height;
  c.bottom = {bottom, 0, 0};
  c.top = {top, 0, 0};
  c.walkers = walkers;
  c.dt = dt;
  c.seed = seed;
  return c;
}

/// Level of every test with random numbers: a right program fails with this probability per new seed (the
/// seeds are fixed, so not at all once it has passed).
inline constexpr double alpha = 1e-3;

}  // namespace hemowalk::coarse
