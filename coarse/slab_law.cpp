#include "coarse/slab_law.hpp"

#include <fmt/format.h>
#include <gsl/gsl_interp.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace hemowalk::coarse {

bool SlabLaw::has_drift() const {
  return std::any_of(v.begin(), v.end(), [](double x) { return x != 0; });
}
double SlabLaw::largest_D() const { return *std::max_element(D.begin(), D.end()); }

namespace {

double between_nodes(const std::vector<double>& f, double position) {
  const double x = std::clamp(position, 0.0, static_cast<double>(f.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(x), f.size() - 2);
  return f[i] + (x - static_cast<double>(i)) * (f[i + 1] - f[i]);
}

/// Monotone cubic (Steffen) through the nodes, constant beyond them; linear through two nodes.
class Curve {
 public:
  Curve(const std::vector<double>& x, const std::vector<double>& f) : x_(x), f_(f) {
    const auto* type = x.size() >= 3 ? gsl_interp_steffen : gsl_interp_linear;
    if (x.size() >= 2) {
      interpolation_.reset(gsl_interp_alloc(type, x.size()));
      gsl_interp_init(interpolation_.get(), x_.data(), f_.data(), x_.size());
    }
  }
  double operator()(double x) const {
    if (!interpolation_ || x <= x_.front()) return f_.front();
    if (x >= x_.back()) return f_.back();
    return gsl_interp_eval(interpolation_.get(), x_.data(), f_.data(), x, nullptr);
  }

 private:
  struct Free {
    void operator()(gsl_interp* p) const { gsl_interp_free(p); }
  };
  std::vector<double> x_, f_;
  std::unique_ptr<gsl_interp, Free> interpolation_;
};

/// Where the walls of the measured gap lie in the coordinates of the profile, and how thick its layers are.
struct MeasuredGap {
  double low, high, layer;
  double height() const { return high - low; }
};

/// D below this share of the core value is raised to it.
constexpr double smallest_share_of_core = 0.01;

bool known(double x) { return std::isfinite(x) && x > 0; }

MeasuredGap measured_gap(const data::TransportLaw& law) {
  const auto& y = law.profile.y;
  const double bin = y.size() > 1 ? (y.back() - y.front()) / static_cast<double>(y.size() - 1) : 0;
  const double gap = known(law.conditions.gap) ? law.conditions.gap : y.back() - y.front() + bin;
  // Profile nodes are bin centres that cover the gap evenly: its middle is theirs, wherever y = 0 lies.
  const double middle = (y.front() + y.back()) / 2;
  MeasuredGap g{middle - gap / 2, middle + gap / 2, 0.2 * gap};
  if (law.core.y_range[1] > law.core.y_range[0])
    g.layer = std::min(law.core.y_range[0] - g.low, g.high - law.core.y_range[1]);
  g.layer = std::clamp(g.layer, 0.02 * gap, gap / 2);
  return g;
}

void check_profile(const std::vector<double>& y, const std::vector<double>& D, const std::vector<double>& v) {
  require(D.size() == y.size() && v.size() == y.size(),
          "the law's profile has arrays of different length (y_m, D_m2_per_s and v_m_per_s belong together) "
          "calibrate again");
  for (std::size_t i = 0; i < y.size(); ++i) {
    require(std::isfinite(y[i]) && std::isfinite(D[i]) && std::isfinite(v[i]) && D[i] > 0, [&] {
      return fmt::format(
          "the law's profile is not usable at node {} (D = {:g} m2/s, v = {:g} m/s are not finite) "
          "drop the node or calibrate with wider bins",
          i, D[i], v[i]);
    });
    require(i == 0 || y[i] > y[i - 1], "the law's profile is not sorted (y_m must increase) sort it");
  }
}

/// D and v over the measured gap, of the law itself (draw -1) or of one of its draws.
struct GapProfile {
  Curve D, v;
  MeasuredGap gap;

  GapProfile(const data::TransportLaw& law, int draw)
      : D(law.profile.y, usable_D(law, draw)), v(law.profile.y, drift(law, draw)), gap(measured_gap(law)) {}

  /// 1 in the wall layer, 0 in the core, a cosine over half a layer thickness in between.
  double layer_weight(double d) const {
    const double join = std::min(1.5 * gap.layer, gap.height() / 2);
    if (d >= join) return 0;
    if (d <= gap.layer) return 1;
    return (1 + std::cos(std::numbers::pi * (d - gap.layer) / (join - gap.layer))) / 2;
  }
  /// At distance d from a wall: mean of both walls; v counts away from the wall.
  double layer_D(double d) const { return (D(gap.low + d) + D(gap.high - d)) / 2; }
  double layer_v(double d) const { return (v(gap.low + d) - v(gap.high - d)) / 2; }

 private:
  /// An estimate may reach zero or below, a walker cannot.
  static std::vector<double> usable_D(const data::TransportLaw& law, int draw) {
    auto D = draw < 0 ? law.profile.D : law.profile.D_draws.at(draw);
    for (double& x : D) x = std::isnan(x) ? x : std::max(x, law.core.D * smallest_share_of_core);
    check_profile(law.profile.y, D, drift(law, draw));
    return D;
  }
  static const std::vector<double>& drift(const data::TransportLaw& law, int draw) {
    const bool drawn = draw >= 0 && static_cast<std::size_t>(draw) < law.profile.v_draws.size();
    return drawn ? law.profile.v_draws[draw] : law.profile.v;
  }
};

double mean_over(const Curve& f, double a, double b) {
  double sum = 0;
  constexpr int n = 64;
  for (int i = 0; i < n; ++i) sum += f(a + (b - a) * (i + 0.5) / n);
  return sum / n;
}

int cells_for(double height, double profile_spacing) {
  int cells = 256;
  while (cells < 4096 && height / cells > profile_spacing / 16) cells *= 2;
  return cells;
}

/// (shear / measured shear)^exponent.
double shear_factor(const data::TransportLaw& law, const Case& the_case, double exponent_score) {
  if (the_case.constant_D || the_case.shear_rate == 0 || !known(law.conditions.shear_rate)) return 1;
  const double exponent = law.scaling.shear_exponent + exponent_score * law.scaling.sigma;
  return std::pow(std::abs(the_case.shear_rate) / law.conditions.shear_rate, exponent);
}

}  // namespace

double SlabLaw::D_at(double y) const { return between_nodes(D, y / spacing()); }
double SlabLaw::v_at(double y) const { return between_nodes(v, y / spacing()); }

SlabLaw map_law(const data::TransportLaw& law, const Case& the_case, const LawDraw& draw) {
  const double factor = shear_factor(law, the_case, draw.exponent_score);
  require(known(law.core.D),
          "the law has no positive core D (core.D_m2_per_s) calibrate again or give law: {D: ..}");
  const double sigma = known(law.core.D_sigma) ? law.core.D_sigma : 0;
  const double core = std::max(law.core.D + draw.core_score * sigma, law.core.D / 20);
  const double height = the_case.height;
  if (law.profile.y.empty() || the_case.constant_D || the_case.bottom.type == Face::Type::periodic)
    return {height, {factor * core, factor * core}, {0, 0}};

  const GapProfile profile(law, draw.draw);
  // A draw brings its own level; without draws the profile moves with the core value.
  const double level = draw.draw < 0 ? core / law.core.D : 1;
  const MeasuredGap& gap = profile.gap;
  const int cells = cells_for(height, gap.height() / static_cast<double>(law.profile.y.size()));
  if (std::abs(height - gap.height()) <= 0.01 * gap.height()) {
    const auto in_gap = [&](double y) { return gap.low + y * gap.height() / height; };
    return make_slab_law(
        height, cells, [&](double y) { return factor * level * profile.D(in_gap(y)); },
        [&](double y) { return factor * profile.v(in_gap(y)); });
  }
  return make_slab_law(
      height, cells,
      [&](double y) {
        const double d = std::min(y, height - y), w = profile.layer_weight(d);
        return factor * (w > 0 ? core + w * (level * profile.layer_D(d) - core) : core);
      },
      [&](double y) {
        const double d = std::min(y, height - y), w = profile.layer_weight(d);
        return w > 0 ? (y <= height / 2 ? factor : -factor) * w * profile.layer_v(d) : 0;
      });
}

std::vector<LawDraw> law_ensemble(const data::TransportLaw& law, int count) {
  const std::size_t n_draws = law.profile.D_draws.size();
  const bool has_draws = n_draws >= 2 && !law.profile.y.empty();
  if (count < 2 || (!has_draws && !known(law.core.D_sigma) && !known(law.scaling.sigma))) return {};
  const int n = has_draws ? std::min<int>(count, static_cast<int>(n_draws)) : count;
  std::vector<LawDraw> members(n);
  for (int i = 0; i < n; ++i) {
    members[i].core_score = normal_quantile((i + 0.5) / n);
    // the exponent is independent of D: the same quantiles in a scattered order (golden-ratio sequence)
    const double scattered = std::fmod((i + 0.5) * std::numbers::phi, 1.0);
    members[i].exponent_score = normal_quantile(scattered);
  }
  // mid-quantiles spread a little less than the law they stand for: restore mean 0, variance 1
  for (double LawDraw::*score : {&LawDraw::core_score, &LawDraw::exponent_score}) {
    double mean = 0, square = 0;
    for (const auto& m : members) mean += m.*score / n;
    for (const auto& m : members) square += (m.*score - mean) * (m.*score - mean) / (n - 1);
    for (auto& m : members) m.*score = (m.*score - mean) / std::sqrt(square);
  }
  if (!has_draws) return members;
  const MeasuredGap gap = measured_gap(law);
  std::vector<std::pair<double, int>> level(n);
  for (int i = 0; i < n; ++i) {
    const int draw = static_cast<int>(static_cast<std::size_t>(i) * n_draws / n);
    require(law.profile.D_draws[draw].size() == law.profile.y.size(),
            "a draw of the law's profile has the wrong length (D_draws belong to y_m) calibrate again");
    level[i] = {
        mean_over(Curve(law.profile.y, law.profile.D_draws[draw]), gap.low + gap.layer, gap.high - gap.layer),
        draw};
  }
  std::sort(level.begin(), level.end());
  for (int i = 0; i < n; ++i) members[i].draw = level[i].second;
  return members;
}

std::vector<std::string> validity_findings(const data::TransportLaw& law, const Case& the_case) {
  std::vector<std::string> findings;
  if (the_case.constant_D) return findings;
  const auto& shear = law.valid.shear_rate;
  const double rate = std::abs(the_case.shear_rate);
  if (rate > 0 && (rate < shear[0] || rate > shear[1]))
    findings.push_back(
        fmt::format("shear rate {:g} 1/s is outside the law's validity ({:g} to {:g} 1/s was measured) use a "
                    "law calibrated "
                    "there",
                    rate, shear[0], shear[1]));
  if (the_case.dt < law.valid.dt_min)
    findings.push_back(
        fmt::format("dt = {:g} s is below the law's shortest step ({:g} s: displacements are still "
                    "correlated there) raise dt "
                    "or use a persistent step law",
                    the_case.dt, law.valid.dt_min));
  if (!law.gate.passed) {
    std::string names;
    for (const auto& f : law.gate.findings)
      if (!f.passed) names += (names.empty() ? "" : ", ") + f.name;
    findings.push_back("the law failed its artefact gate (" +
                       (names.empty() ? std::string("no finding named") : names) +
                       ") do not trust its D before the findings are explained");
  }
  const auto low = std::count_if(law.profile.D.begin(), law.profile.D.end(),
                                 [&](double D) { return D < law.core.D * smallest_share_of_core; });
  if (low > 0)
    findings.push_back(
        fmt::format("D is below {:g} of the core value at {} of {} nodes of the law's profile (too few "
                    "platelets there?) that share of the core value is used; calibrate with wider bins",
                    smallest_share_of_core, low, law.profile.D.size()));
  if (!law.profile.y.empty() && the_case.bottom.type != Face::Type::periodic) {
    const MeasuredGap gap = measured_gap(law);
    if (the_case.height < 0.99 * (gap.high - gap.low))
      findings.push_back(
          fmt::format("the slab of {:g} um is thinner than the measured gap of {:g} um (its wall layers "
                      "overlap) use a law from "
                      "a gap of this height",
                      the_case.height * 1e6, (gap.high - gap.low) * 1e6));
  }
  return findings;
}

}  // namespace hemowalk::coarse
