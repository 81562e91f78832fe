#include "calibration/synthetic.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/check.hpp"
#include "core/random.hpp"

namespace hemowalk::calibration {
namespace {

constexpr int substeps = 8;

/// y folded into [0, gap] by mirrors at both walls.
double fold(double y, double gap) {
  y = std::fmod(std::abs(y), 2 * gap);
  return y > gap ? 2 * gap - y : y;
}

double D_slope(const Synthetic& s, double y) {
  const double k = 2 * std::numbers::pi / s.gap;
  return -s.D * s.D_contrast * k * std::sin(k * y);
}

/// Exact joint step of an Ornstein-Uhlenbeck velocity (variance D/memory) and its integral.
struct MemoryStep {
  double decay, travel, s_v, s_xv, s_x;

  MemoryStep(double D, double memory, double h) {
    const double e = std::exp(-h / memory), variance = D / memory;
    decay = e;
    travel = memory * (1 - e);
    const double vv = variance * (1 - e * e);
    const double xv = D * (1 - e) * (1 - e);
    const double xx = 2 * D * (h - 2 * memory * (1 - e) + memory * (1 - e * e) / 2);
    s_v = std::sqrt(vv);
    s_xv = xv / s_v;
    s_x = std::sqrt(std::max(0.0, xx - s_xv * s_xv));
  }
  /// Returns the displacement and advances \p v.
  double operator()(double& v, RandomSequence& random) const {
    const double a = random.normal(), b = random.normal();
    const double dx = travel * v + s_xv * a + s_x * b;
    v = decay * v + s_v * a;
    return dx;
  }
};

/// One platelet: the height after each sample.
class Walk {
 public:
  Walk(const Synthetic& s, std::uint64_t id)
      : s_(s),
        random_(s.seed, Stream::synthetic, id),
        step_(s.D, s.memory > 0 ? s.memory : 1, s.D_contrast == 0 ? s.sample : s.sample / substeps) {
    y_ = random_.uniform(0, s.gap);
    z_ = random_.uniform(0, s.gap);
    x_ = random_.uniform(0, s.gap);
    if (s.memory > 0) v_ = std::sqrt(s.D / s.memory) * random_.normal();
  }

  void sample() {
    const double before = height();
    if (s_.D_contrast == 0)
      y_ += s_.memory > 0 ? step_(v_, random_) : std::sqrt(2 * s_.D * s_.sample) * random_.normal();
    else
      for (int k = 0; k < substeps; ++k) local_step(s_.sample / substeps);
    if (s_.jump_fraction > 0 && random_.uniform() < s_.jump_fraction) y_ += s_.jump_size * random_.normal();
    x_ += std::sqrt(2 * s_.D * s_.sample) * random_.normal();
    z_ += s_.shear_rate * s_.sample * (before + height()) / 2;
  }

  double x() const { return x_; }
  double z() const { return z_; }
  /// The walk lives on the unfolded line: by symmetry its mirror image is the reflected walk.
  double height() const { return fold(y_, s_.gap); }

 private:
  void local_step(double h) {
    const double D = true_D(s_, y_), slope = D_slope(s_, y_);  // both continue evenly beyond the walls
    if (s_.memory > 0) {
      y_ += std::sqrt(D / s_.D) * step_(v_, random_) + slope / 2 * h;
      return;
    }
    const double g = random_.normal();
    y_ += slope * h + std::sqrt(2 * D * h) * g + slope / 2 * h * (g * g - 1);
  }

  const Synthetic& s_;
  RandomSequence random_;
  MemoryStep step_;
  double x_ = 0, y_ = 0, z_ = 0, v_ = 0;
};

}  // namespace

double true_D(const Synthetic& s, double y) {
  return s.D * (1 + s.D_contrast * std::cos(2 * std::numbers::pi * y / s.gap));
}

double true_layer_D(const Synthetic& s, double low, double high) {
  const double k = 2 * std::numbers::pi / s.gap;
  return s.D * (1 + s.D_contrast * (std::sin(k * high) - std::sin(k * low)) / (k * (high - low)));
}

double jump_D(const Synthetic& s) { return s.jump_fraction * s.jump_size * s.jump_size / (2 * s.sample); }

data::Trajectories generate(const Synthetic& s) {
  require(s.platelets >= 1 && s.sample > 0 && s.duration >= s.sample && s.gap > 0 && s.D > 0 && s.memory >= 0,
          "synthetic trajectories need platelets, sample, duration, gap and D above zero (memory may be "
          "zero) check "
          "the values");
  require(std::abs(s.D_contrast) < 1, "D_contrast must lie between -1 and 1 (D would vanish) lower it");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  data::Trajectories out;
  out.version = "synthetic";
  out.shear_rate = s.shear_rate;
  out.box = {s.gap, s.gap, s.gap};
  out.walls_y = {0, s.gap};
  out.hematocrit_true = s.hematocrit;
  out.kappa_damping = out.t_c = out.Ca = out.Re = nan;
  out.seed = s.seed;
  const auto samples = static_cast<std::size_t>(std::llround(s.duration / s.sample)) + 1;
  const auto cells = static_cast<std::size_t>(s.platelets);
  for (std::size_t t = 0; t < samples; ++t) out.time.push_back(static_cast<double>(t) * s.sample);
  data::Tracks& tracks = out.kinds["platelet"];
  tracks.position.resize(samples * cells * 3);
  for (std::size_t n = 0; n < cells; ++n) tracks.id.push_back(static_cast<std::int64_t>(n));
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < cells; ++n) {
    Walk walk(s, n);
    for (std::size_t t = 0; t < samples; ++t) {
      if (t) walk.sample();
      double* p = &tracks.position[(t * cells + n) * 3];
      p[0] = walk.x();
      p[1] = walk.height();
      p[2] = walk.z();
    }
  }
  return out;
}

}  // namespace hemowalk::calibration
