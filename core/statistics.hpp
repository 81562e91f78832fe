#pragma once
/// \file Small statistics on plain vectors (GSL underneath).

#include <vector>

namespace hemowalk {

/// Arithmetic mean. \throws InputError when empty.
double mean(const std::vector<double>& x);
/// Sample variance with n - 1. \throws InputError when n < 2.
double variance(const std::vector<double>& x);
/// Sample standard deviation with n - 1. \throws InputError when n < 2.
double standard_deviation(const std::vector<double>& x);
/// Standard error of the mean of independent values.
double standard_error(const std::vector<double>& x);
/// Excess kurtosis m4/m2^2 - 3 with population moments (0 for a normal law; NaN when all values are equal).
double excess_kurtosis(const std::vector<double>& x);
/// Quantile with linear interpolation between order statistics, p in [0, 1]; sorts a copy.
double quantile(std::vector<double> x, double p);
double median(std::vector<double> x);

/// P(Z <= z) of the standard normal law.
double normal_cdf(double z);
/// z with P(Z <= z) = p, p in (0, 1).
double normal_quantile(double p);
/// P(X > x) of the chi-squared law: the p-value of a goodness-of-fit sum.
double chi_squared_tail(double x, double degrees_of_freedom);
/// P(D > d) of the Kolmogorov-Smirnov statistic for n values (asymptotic, Stephens' small-n correction).
double kolmogorov_tail(double d, std::size_t n);

/// y = intercept + slope x by least squares; sigmas from the residuals (unweighted) or from the weights'
/// sigmas.
struct LinearFit {
  double intercept = 0, slope = 0;
  double intercept_sigma = 0, slope_sigma = 0, covariance = 0;
  double chi_squared = 0;  ///< residual sum of squares, weighted where sigmas are given
};
/// \throws InputError when sizes differ, n < 2 or all x are equal.
LinearFit fit_line(const std::vector<double>& x, const std::vector<double>& y);
/// Weights 1/sigma^2.
LinearFit fit_line(const std::vector<double>& x, const std::vector<double>& y,
                   const std::vector<double>& sigma);

}  // namespace hemowalk
