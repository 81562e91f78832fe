#include "calibration/trends.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/gate.hpp"
#include "core/statistics.hpp"
#include "core/text.hpp"

namespace hemowalk::calibration {
namespace {

/// Local shear of the cells' mean velocity at bin centres inside the layer, by centred differences over two
/// bins.
struct LocalShear {
  std::vector<double> y, rate;
};
LocalShear local_shear(const Ensemble& e, const Layer& core) {
  const CellVelocity v = cell_velocity(e, 12);
  LocalShear s;
  for (std::size_t k = 1; k + 1 < v.y.size(); ++k) {
    const double rate = (v.along[k + 1] - v.along[k - 1]) / (v.y[k + 1] - v.y[k - 1]);
    if (!core.contains(v.y[k]) || !std::isfinite(rate) || rate <= 0) continue;
    s.y.push_back(v.y[k]);
    s.rate.push_back(rate);
  }
  return s;
}

double log_slope(const LocalShear& s, const LocalLaw& law) {
  std::vector<double> x, y;
  for (std::size_t k = 0; k < s.y.size(); ++k) {
    x.push_back(std::log(s.rate[k]));
    y.push_back(std::log(law.D(s.y[k])));
  }
  return fit_line(x, y).slope;
}

}  // namespace

ShearExponent shear_exponent(const Ensemble& e, const Layer& core, const LocalFit& fit) {
  ShearExponent out;
  if (!(e.shear_rate > 0)) return out;
  const LocalShear s = local_shear(e, core);
  if (s.y.size() < 4) {
    out.note = "too few heights with a known local shear";
    return out;
  }
  out.low = *std::min_element(s.rate.begin(), s.rate.end());
  out.high = *std::max_element(s.rate.begin(), s.rate.end());
  if (out.high < 1.3 * out.low) {
    out.note = formatted("local shear %.0f .. %.0f 1/s is too even to tell; n = 1 +- 0.3 assumed", out.low,
                         out.high);
    return out;
  }
  std::vector<double> draws;
  for (const LocalLaw& d : fit.draws) draws.push_back(log_slope(s, d));
  if (draws.size() < 2) return out;
  const double n = log_slope(s, fit.law), sigma = standard_deviation(draws);
  if (sigma > 0.3) {
    out.note = formatted("n = %.2f +- %.2f says less than n = 1 +- 0.3, which is assumed", n, sigma);
    return out;
  }
  out.n = n;
  out.sigma = sigma;
  out.measured = true;
  out.note = formatted("D ~ shear^(%.2f +- %.2f) over local shear %.0f .. %.0f 1/s inside the run", n, sigma,
                       out.low, out.high);
  return out;
}

}  // namespace hemowalk::calibration
