#include "core/statistics.hpp"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_fit.h>
#include <gsl/gsl_statistics_double.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/check.hpp"

namespace hemowalk {
namespace {

void require_size(const std::vector<double>& x, std::size_t least, const char* what) {
  require(x.size() >= least, [&] {
    return std::string(what) + " of " + std::to_string(x.size()) + " values (needs at least " +
           std::to_string(least) + ") use more data";
  });
}

void require_line(const std::vector<double>& x, const std::vector<double>& y) {
  require_size(x, 2, "straight-line fit");
  require(x.size() == y.size(), "straight-line fit: x and y differ in length (one y per x)");
  require(std::any_of(x.begin(), x.end(), [&](double v) { return v != x.front(); }),
          "straight-line fit: all x are equal (the slope is undetermined)");
}

LinearFit from_covariances(double c0, double c1, double c00, double c01, double c11, double chi_squared) {
  return {c0, c1, std::sqrt(c00), std::sqrt(c11), c01, chi_squared};
}

}  // namespace

double mean(const std::vector<double>& x) {
  require_size(x, 1, "mean");
  return gsl_stats_mean(x.data(), 1, x.size());
}

double variance(const std::vector<double>& x) {
  require_size(x, 2, "variance");
  return gsl_stats_variance(x.data(), 1, x.size());
}

double standard_deviation(const std::vector<double>& x) { return std::sqrt(variance(x)); }

double standard_error(const std::vector<double>& x) {
  return std::sqrt(variance(x) / static_cast<double>(x.size()));
}

double excess_kurtosis(const std::vector<double>& x) {
  const double m = mean(x);
  double m2 = 0, m4 = 0;
  for (const double v : x) {
    const double s = (v - m) * (v - m);
    m2 += s;
    m4 += s * s;
  }
  return m4 * static_cast<double>(x.size()) / (m2 * m2) - 3;
}

double quantile(std::vector<double> x, double p) {
  require_size(x, 1, "quantile");
  require(p >= 0 && p <= 1, "quantile: p outside [0, 1]");
  std::sort(x.begin(), x.end());
  return gsl_stats_quantile_from_sorted_data(x.data(), 1, x.size(), p);
}

double median(std::vector<double> x) { return quantile(std::move(x), 0.5); }

double normal_cdf(double z) { return gsl_cdf_ugaussian_P(z); }

double normal_quantile(double p) {
  require(p > 0 && p < 1, "normal quantile: p outside (0, 1)");
  return gsl_cdf_ugaussian_Pinv(p);
}

double chi_squared_tail(double x, double degrees_of_freedom) {
  return gsl_cdf_chisq_Q(x, degrees_of_freedom);
}

double kolmogorov_tail(double d, std::size_t n) {
  const double root = std::sqrt(static_cast<double>(n));
  const double t = d * (root + 0.12 + 0.11 / root);
  if (t < 0.2) return 1;  // the series needs many terms there and the sum is 1 to 1e-12
  double sum = 0;
  for (int k = 1; k <= 100; ++k) sum += (k % 2 ? 2 : -2) * std::exp(-2.0 * k * k * t * t);
  return std::clamp(sum, 0.0, 1.0);
}

LinearFit fit_line(const std::vector<double>& x, const std::vector<double>& y) {
  require_line(x, y);
  double c0, c1, c00, c01, c11, chi;
  gsl_fit_linear(x.data(), 1, y.data(), 1, x.size(), &c0, &c1, &c00, &c01, &c11, &chi);
  return from_covariances(c0, c1, c00, c01, c11, chi);
}

LinearFit fit_line(const std::vector<double>& x, const std::vector<double>& y,
                   const std::vector<double>& sigma) {
  require_line(x, y);
  require(sigma.size() == x.size(), "straight-line fit: x and sigma differ in length (one sigma per x)");
  std::vector<double> weight(sigma.size());
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    require(sigma[i] > 0, "straight-line fit: a sigma is not positive (its weight would be infinite)");
    weight[i] = 1 / (sigma[i] * sigma[i]);
  }
  double c0, c1, c00, c01, c11, chi;
  gsl_fit_wlinear(x.data(), 1, weight.data(), 1, y.data(), 1, x.size(), &c0, &c1, &c00, &c01, &c11, &chi);
  return from_covariances(c0, c1, c00, c01, c11, chi);
}

}  // namespace hemowalk
