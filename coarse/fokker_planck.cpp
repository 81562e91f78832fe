#include "coarse/fokker_planck.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/check.hpp"

namespace hemowalk::coarse {

namespace {

/// p/(e^p - 1).
double bernoulli(double p) { return std::abs(p) < 1e-5 ? 1 - p / 2 + p * p / 12 : p / std::expm1(p); }

/// Flux through a face of the grid from cell a to cell b at distance h: from_a c_a - from_b c_b.
struct Exchange {
  double from_a, from_b;
};
Exchange exchange(double D, double v, double h) {
  const double p = v * h / D;
  return {D / h * bernoulli(-p), D / h * bernoulli(p)};
}

constexpr double gamma_ = 1 - std::numbers::sqrt2 / 2;

}  // namespace

FokkerPlanck::FokkerPlanck(const SlabLaw& law, const Face& bottom, const Face& top, int cells,
                           double cell_free_layer)
    : periodic_(bottom.type == Face::Type::periodic),
      trap_{bottom.type == Face::Type::trap, top.type == Face::Type::trap},
      cell_(law.height / cells),
      height_(law.height) {
  require(cells >= 8, "the Fokker-Planck grid has fewer than 8 cells (nothing is resolved) use more");
  const std::size_t n = cells + 2;
  unknown_.assign(n, 1.0);
  unknown_.front() = unknown_.back() = 0;
  lower_.assign(n, 0);
  middle_.assign(n, 0);
  upper_.assign(n, 0);
  add_interior(law);
  add_face(law, bottom, 0, cell_free_layer);
  add_face(law, top, 1, cell_free_layer);
  for (auto* v : {&factor_lower_, &factor_middle_, &factor_upper_, &correction_, &stage_one_, &stage_two_})
    v->assign(n, 0);
}

void FokkerPlanck::release(double low, double high) {
  for (int i = 0; i < cells(); ++i) {
    const double overlap = std::min(high, (i + 1) * cell_) - std::max(low, i * cell_);
    unknown_[i + 1] = std::max(0.0, overlap) / cell_ * height_ / (high - low);
  }
}

void FokkerPlanck::add_interior(const SlabLaw& law) {
  const int cells = this->cells();
  // between cells i and i + 1 of the unknowns (cell 0 is unknown 1)
  for (int i = 1; i < cells; ++i) {
    const double y = i * cell_;
    const Exchange e = exchange(law.D_at(y), law.v_at(y), cell_);
    middle_[i] -= e.from_a / cell_;
    upper_[i] += e.from_b / cell_;
    lower_[i + 1] += e.from_a / cell_;
    middle_[i + 1] -= e.from_b / cell_;
  }
  if (periodic_) {
    const Exchange e = exchange(law.D_at(0), law.v_at(0), cell_);
    middle_[cells] -= e.from_a / cell_;
    corner_top_ = e.from_a / cell_;
    middle_[1] -= e.from_b / cell_;
    corner_bottom_ = e.from_b / cell_;
  }
}

void FokkerPlanck::add_face(const SlabLaw& law, const Face& face, int side, double cell_free_layer) {
  if (face.type == Face::Type::reflect || face.type == Face::Type::periodic) return;
  // Half a cell lies between the first cell's centre and the face; drift towards the face counts as inward.
  const double y = side == 0 ? 0 : height_;
  const double towards = side == 0 ? -law.v_at(y) : law.v_at(y);
  const Exchange half = exchange(law.D_at(y), towards, cell_ / 2);
  // Uptake velocity k and release rate r of the face; the concentration at the face is in balance at once:
  // half.from_a c - half.from_b c_face = k c_face - r amount.
  double k = HUGE_VAL, release = 0;
  if (face.type == Face::Type::robin) k = face.rate;
  if (face.type == Face::Type::trap) {
    const double layer = face.layer > 0 ? face.layer : cell_free_layer;
    require(std::isfinite(layer) && layer > 0 && face.rate > 0,
            "a trap needs a residence time and the thickness of its layer (neither the face nor the law's "
            "cell_free_layer states one) use a law with a cell-free layer");
    k = layer / face.rate;
    release = 1 / face.rate;
  }
  const double taken_share = std::isinf(k) ? 1 : k / (half.from_b + k);
  const double rate_in = half.from_a * taken_share / cell_;
  const double rate_out = release * (1 - taken_share);
  const std::size_t n = unknown_.size(), amount = side == 0 ? 0 : n - 1, first = side == 0 ? 1 : n - 2;
  middle_[first] -= rate_in;
  middle_[amount] -= rate_out;
  (side == 0 ? upper_ : lower_)[amount] += rate_in;
  (side == 0 ? lower_ : upper_)[first] += rate_out;
}

void FokkerPlanck::rate(const std::vector<double>& u, std::vector<double>& result) const {
  const std::size_t n = u.size();
  result[0] = middle_[0] * u[0] + upper_[0] * u[1];
  for (std::size_t i = 1; i + 1 < n; ++i)
    result[i] = lower_[i] * u[i - 1] + middle_[i] * u[i] + upper_[i] * u[i + 1];
  result[n - 1] = lower_[n - 1] * u[n - 2] + middle_[n - 1] * u[n - 1];
  result[1] += corner_top_ * u[n - 2];
  result[n - 2] += corner_bottom_ * u[1];
}

void FokkerPlanck::factorise(double step) {
  if (step == factorised_for_) return;
  factorised_for_ = step;
  const std::size_t n = unknown_.size();
  const double s = gamma_ * step;
  std::vector<double> middle(n);
  for (std::size_t i = 0; i < n; ++i) middle[i] = 1 - s * middle_[i];
  // Periodic: rank-one correction (Sherman-Morrison) u w^T with u = (g, .., -s corner_bottom), w = (1, ..,
  // q).
  const double top_right = -s * corner_top_, bottom_left = -s * corner_bottom_;
  const double g = -middle[1], q = top_right / g;
  if (periodic_) {
    middle[1] -= g;
    middle[n - 2] -= bottom_left * q;
  }
  factor_middle_[0] = middle[0];
  for (std::size_t i = 1; i < n; ++i) {
    factor_lower_[i] = -s * lower_[i] / factor_middle_[i - 1];
    factor_middle_[i] = middle[i] - factor_lower_[i] * (-s * upper_[i - 1]);
  }
  for (std::size_t i = 0; i < n; ++i) factor_upper_[i] = -s * upper_[i];
  weight_last_ = 0;
  correction_scale_ = 0;
  if (!periodic_) return;
  std::vector<double> z(n, 0.0);
  z[1] = g;
  z[n - 2] = bottom_left;
  solve(z);
  correction_ = z;
  weight_last_ = q;
  correction_scale_ = 1 / (1 + z[1] + q * z[n - 2]);
}

void FokkerPlanck::solve(std::vector<double>& x) const {
  const std::size_t n = x.size();
  for (std::size_t i = 1; i < n; ++i) x[i] -= factor_lower_[i] * x[i - 1];
  x[n - 1] /= factor_middle_[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) x[i] = (x[i] - factor_upper_[i] * x[i + 1]) / factor_middle_[i];
  if (correction_scale_ == 0) return;
  const double amount = correction_scale_ * (x[1] + weight_last_ * x[n - 2]);
  for (std::size_t i = 0; i < n; ++i) x[i] -= amount * correction_[i];
}

void FokkerPlanck::advance(double duration, int steps) {
  if (duration <= 0) return;
  require(steps > 0, "the Fokker-Planck solver was given no steps");
  const double step = duration / steps;
  factorise(step);
  const std::size_t n = unknown_.size();
  for (int k = 0; k < steps; ++k) {
    // (1 - g h A) k1 = A u;  (1 - g h A) k2 = A (u + (1 - g) h k1);  u += h ((1 - g) k1 + g k2)
    rate(unknown_, stage_one_);
    solve(stage_one_);
    for (std::size_t i = 0; i < n; ++i) unknown_[i] += (1 - gamma_) * step * stage_one_[i];
    rate(unknown_, stage_two_);
    solve(stage_two_);
    for (std::size_t i = 0; i < n; ++i) unknown_[i] += gamma_ * step * stage_two_[i];
  }
}

double FokkerPlanck::taken(bool by_traps) const {
  double amount = 0;
  if (trap_[0] == by_traps) amount += unknown_.front();
  if (trap_[1] == by_traps) amount += unknown_.back();
  return amount / cells();
}

std::vector<double> FokkerPlanck::profile(int bins) const {
  require(bins > 0 && cells() % bins == 0, "profile bins must divide the Fokker-Planck cells");
  const int per_bin = cells() / bins;
  std::vector<double> c(bins, 0.0);
  for (int i = 0; i < cells(); ++i) c[i / per_bin] += unknown_[i + 1] / per_bin;
  return c;
}

}  // namespace hemowalk::coarse
