#include "resolved/npfem/reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "resolved/mesh/rigid_motion.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/terms/edge_bending.hpp"
#include "resolved/npfem/terms/helfrich.hpp"
#include "resolved/npfem/terms/local_area.hpp"
#include "resolved/npfem/terms/neo_hookean.hpp"
#include "resolved/npfem/terms/skalak.hpp"
#include "resolved/npfem/terms/skalak_hardening.hpp"
#include "resolved/npfem/terms/volume.hpp"

namespace hemowalk::npfem {
namespace {

using mesh::Vec3;
using Field = std::vector<Vec3>;
using V = Vector<double>;

V vec(const Vec3& a) { return {a[0], a[1], a[2]}; }
V between(const Field& x, int i, int j) { return vec(mesh::subtract(x[j], x[i])); }
void push(Field& f, int k, const V& v) { f[k][0] += v.x, f[k][1] += v.y, f[k][2] += v.z; }

/// Singular values of [e1 e2] R, R any root of the inverse rest metric: eigenvalues of the matrix B g.
std::array<double, 2> singular_values(const CellType::TriangleRest& r, const V& e1, const V& e2) {
  // R upper triangular with R R^T = B
  const double r22 = std::sqrt(r.b22), r12 = r.b12 / r22, r11 = std::sqrt(r.b11 - r12 * r12);
  const V c1 = r11 * e1, c2 = r12 * e1 + r22 * e2;
  const double a = dot(c1, c1), b = dot(c1, c2), c = dot(c2, c2);
  const double mean = (a + c) / 2, radius = std::hypot((a - c) / 2, b);
  const double s1 = std::sqrt(mean + radius);
  const V n = cross(c1, c2);
  return {s1, std::sqrt(dot(n, n)) / s1};
}

double helfrich_energy(const CellType& type, const Field& x) {
  std::vector<double> curvature(x.size(), 0.0);
  for (const auto& e : type.edges()) {
    const auto axis = mesh::subtract(x[e.v1], x[e.v0]);
    const auto left = mesh::cross(axis, mesh::subtract(x[e.v2], x[e.v0]));
    const auto right = mesh::cross(mesh::subtract(x[e.v3], x[e.v0]), axis);
    const double length = mesh::norm(axis);
    const double theta =
        std::atan2(mesh::dot(mesh::cross(left, right), axis) / length, mesh::dot(left, right));
    curvature[e.v0] += length * theta / 4;
    curvature[e.v1] += length * theta / 4;
  }
  const auto areas = mesh::vertex_areas({x, type.rest().triangles});
  double sum = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double excess = curvature[k] - areas[k] * type.material().reference_curvature;
    sum += 2 * type.material().bending_modulus * excess * excess / areas[k];
  }
  return sum;
}

double edge_energy(const CellType& type, const Field& x) {
  double sum = 0;
  for (std::size_t i = 0; i < type.edges().size(); ++i) {
    const auto& e = type.edges()[i];
    const auto& r = type.edge_rest()[i];
    Vec3 vector{};
    mesh::accumulate(vector, r.w0, x[e.v0]);
    mesh::accumulate(vector, r.w1, x[e.v1]);
    mesh::accumulate(vector, r.w2, x[e.v2]);
    mesh::accumulate(vector, r.w3, x[e.v3]);
    const double length =
        std::sqrt(mesh::dot(vector, vector) + type.bending_epsilon() * type.bending_epsilon());
    sum += r.stiffness / 2 * (length - r.length) * (length - r.length);
  }
  return sum;
}

StretchGradient<double> law_gradient(const Material& m, const Stretch<double>& s) {
  switch (m.law) {
    case Law::paper:
      return SkalakHardening<double>{m.B, m.D}.gradient(s) + LocalArea<double>{m.C}.gradient(s);
    case Law::neo_hookean:
      return NeoHookean<double>{m.Gs}.gradient(s);
    case Law::skalak:
      return Skalak<double>{m.Gs, m.skalak_C}.gradient(s);
  }
  return {0, 0, 0};
}

void add_edge_forces(const CellType& type, const Field& x, Field& f) {
  const double epsilon2 = type.bending_epsilon() * type.bending_epsilon();
  for (std::size_t i = 0; i < type.edges().size(); ++i) {
    const auto& e = type.edges()[i];
    const auto& r = type.edge_rest()[i];
    const RestEdge<double> rest{r.w1, r.w2, r.w3, r.stiffness, r.length};
    const V vector =
        edge_vector(rest, between(x, e.v0, e.v1), between(x, e.v0, e.v2), between(x, e.v0, e.v3));
    const double c = edge_bending_factor(rest, epsilon2, vector);
    push(f, e.v0, -c * r.w0 * vector);
    push(f, e.v1, -c * r.w1 * vector);
    push(f, e.v2, -c * r.w2 * vector);
    push(f, e.v3, -c * r.w3 * vector);
  }
}

void add_helfrich_forces(const CellType& type, const Field& x, Field& f) {
  const double modulus = type.material().bending_modulus, h0 = type.material().reference_curvature;
  std::vector<double> per_curvature(x.size(), 0.0);
  const auto hinge = [&](const mesh::Edge& e) {
    return dihedral(between(x, e.v0, e.v1), between(x, e.v0, e.v2), between(x, e.v0, e.v3));
  };
  for (const auto& e : type.edges()) {
    const auto d = hinge(e);
    per_curvature[e.v0] += d.length * d.theta / 4;
    per_curvature[e.v1] += d.length * d.theta / 4;
  }
  auto per_area = mesh::vertex_areas({x, type.rest().triangles});
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double ratio = per_curvature[k] / per_area[k] - h0;
    per_curvature[k] = 4 * modulus * ratio;
    per_area[k] = -2 * modulus * ratio * (2 * h0 + ratio);
  }
  for (const auto& e : type.edges()) {
    const auto d = hinge(e);
    const double w = -(per_curvature[e.v0] + per_curvature[e.v1]) / 4;
    push(f, e.v0, w * d.length * d.d0 - w * d.theta * d.tangent);
    push(f, e.v1, w * d.length * d.d1 + w * d.theta * d.tangent);
    push(f, e.v2, w * d.length * d.d2);
    push(f, e.v3, w * d.length * d.d3);
  }
  for (const auto& t : type.rest().triangles) {
    const V e1 = between(x, t[0], t[1]), e2 = between(x, t[0], t[2]), n = cross(e1, e2);
    const double w = -(per_area[t[0]] + per_area[t[1]] + per_area[t[2]]) / (6 * std::sqrt(dot(n, n)));
    const V f1 = w * cross(e2, n), f2 = w * cross(n, e1);
    push(f, t[1], f1);
    push(f, t[2], f2);
    push(f, t[0], -1.0 * (f1 + f2));
  }
}

double inner(const Field& a, const Field& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += mesh::dot(a[k], b[k]);
  return sum;
}
void axpy(double s, const Field& a, Field& y) {
  for (std::size_t k = 0; k < a.size(); ++k) mesh::accumulate(y[k], s, a[k]);
}

Field lap(const CellType& type, const Field& d) {
  Field y(d.size(), Vec3{});
  for (const auto& e : type.laplacian()) {
    mesh::accumulate(y[e.row], e.value, d[e.column]);
    if (e.row != e.column) mesh::accumulate(y[e.column], e.value, d[e.row]);
  }
  return y;
}

/// The incremental potential g(d) = sum metric/(2 h^2) |d - h v_pred|^2 + E(x + d) + beta/(2h) d Lap d, and
/// its slope.
class Potential {
 public:
  Potential(const CellType& type, const State& s, const Field& v_pred)
      : type_(type), s_(s), v_pred_(v_pred) {}

  double value(const Field& d) const {
    auto x = s_.x;
    axpy(1, d, x);
    const double h = type_.h();
    double sum = energy(type_, x).total();
    for (std::size_t k = 0; k < d.size(); ++k) {
      const auto gap = mesh::subtract(d[k], mesh::scale(h, v_pred_[k]));
      sum += rate(k) / 2 * mesh::dot(gap, gap);
    }
    if (type_.material().rayleigh_beta > 0)
      sum += type_.material().rayleigh_beta / (2 * h) * inner(d, lap(type_, d));
    return sum;
  }
  /// -dg/dd; \p scale receives the size of the inertial forces.
  Field unbalance(const Field& d, double& scale) const {
    auto x = s_.x;
    axpy(1, d, x);
    const double h = type_.h();
    Field r = forces(type_, x);
    scale = 0;
    for (std::size_t k = 0; k < d.size(); ++k) {
      const double m = rate(k);
      const auto inertia = mesh::scale(m, mesh::subtract(mesh::scale(h, v_pred_[k]), d[k]));
      mesh::accumulate(r[k], 1, inertia);
      scale += m * m * h * h * mesh::dot(v_pred_[k], v_pred_[k]) + mesh::dot(inertia, inertia);
    }
    scale = std::sqrt(scale);
    if (type_.material().rayleigh_beta > 0) axpy(-type_.material().rayleigh_beta / h, lap(type_, d), r);
    return r;
  }

 private:
  double rate(std::size_t k) const {
    return type_.metric()[k] / (type_.h() * type_.h() * (1 - type_.kappa()[k]));
  }
  const CellType& type_;
  const State& s_;
  const Field& v_pred_;
};

/// The rigid part of a velocity field: the rigid motion with its momenta in the metric, at positions x.
Field rigid_part(const CellType& type, const Field& x, const Field& v) {
  const auto& m = type.metric();
  Vec3 origin{};  // near the body, for round-off
  for (const auto& p : x) mesh::accumulate(origin, 1.0 / static_cast<double>(x.size()), p);
  const auto arm = [&](std::size_t k) { return vec(mesh::subtract(x[k], origin)); };
  double mass = 0;
  mesh::Inertia<double> inertia;
  mesh::Momentum<double> momentum;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mass += m[k];
    inertia.add(m[k], arm(k));
    momentum.add(m[k], arm(k), vec(v[k]));
  }
  const mesh::Body<double> body(mass, inertia);
  const auto motion = body.motion(momentum);
  Field result(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const V u = motion.velocity + cross(motion.spin, arm(k) - body.centre());
    result[k] = {u.x, u.y, u.z};
  }
  return result;
}

/// Limited-memory BFGS with H0 = N^{-1}.
class Lbfgs {
 public:
  explicit Lbfgs(const CellType& type) : type_(type) {}
  /// Search direction for the unbalance \p r (= minus the gradient).
  Field direction(Field r) const {
    std::vector<double> alpha(pairs_.size());
    for (std::size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = pairs_[i].rho * inner(pairs_[i].s, r);
      axpy(-alpha[i], pairs_[i].y, r);
    }
    auto q = apply_inverse(type_, std::move(r));
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      axpy(alpha[i] - pairs_[i].rho * inner(pairs_[i].y, q), pairs_[i].s, q);
    return q;
  }
  void remember(Field s, Field y) {
    const double sy = inner(s, y);
    if (sy <= 0) return;
    pairs_.push_back({std::move(s), std::move(y), 1 / sy});
    if (pairs_.size() > 10) pairs_.pop_front();
  }
  void forget() { pairs_.clear(); }

 private:
  struct Pair {
    Field s, y;
    double rho;
  };
  const CellType& type_;
  std::deque<Pair> pairs_;
};

}  // namespace

Energy energy(const CellType& type, const Field& x) {
  const auto& m = type.material();
  Energy e;
  for (int t = 0; t < type.rest().triangle_count(); ++t) {
    const auto& v = type.rest().triangles[t];
    const auto& r = type.triangle_rest()[t];
    const auto [s1, s2] = singular_values(r, between(x, v[0], v[1]), between(x, v[0], v[2]));
    switch (m.law) {
      case Law::paper:
        e.stretch += r.area * skalak_hardening_energy(m.B, m.D, s1, s2);
        e.area += r.area * local_area_energy(m.C, s1, s2);
        break;
      case Law::neo_hookean:
        e.stretch += r.area * neo_hookean_energy(m.Gs, s1, s2);
        break;
      case Law::skalak:
        e.stretch += r.area * skalak_energy(m.Gs, m.skalak_C, s1, s2);
        break;
    }
  }
  if (m.bending == Bending::paper) e.bending = edge_energy(type, x);
  if (m.bending == Bending::helfrich) e.bending = helfrich_energy(type, x);
  const double excess = mesh::volume({x, type.rest().triangles}) - type.rest_volume();
  e.volume = m.volume_modulus / 2 * excess * excess / type.rest_gradient_square();
  return e;
}

Field forces(const CellType& type, const Field& x) {
  const auto& m = type.material();
  Field f(x.size(), Vec3{}), gradient(x.size(), Vec3{});
  for (int t = 0; t < type.rest().triangle_count(); ++t) {
    const auto& v = type.rest().triangles[t];
    const auto& r = type.triangle_rest()[t];
    const RestTriangle<double> rest{r.b11, r.b12, r.b22, r.b11 * r.b22 - r.b12 * r.b12, r.area};
    const auto now = make_triangle(between(x, v[0], v[1]), between(x, v[0], v[2]));
    const auto s = stretch_of(rest, now);
    V f1, f2;
    stretch_forces(rest, now, s, law_gradient(m, s), f1, f2);
    push(f, v[1], f1);
    push(f, v[2], f2);
    push(f, v[0], -1.0 * (f1 + f2));
    for (int k : v) push(gradient, k, (1.0 / 6) * now.normal);
  }
  if (m.bending == Bending::paper) add_edge_forces(type, x, f);
  if (m.bending == Bending::helfrich) add_helfrich_forces(type, x, f);
  const double square =
      m.volume_force == VolumeForce::gradient ? type.rest_gradient_square() : inner(gradient, gradient);
  const double p =
      volume_factor(m.volume_modulus, type.rest_volume(), mesh::volume({x, type.rest().triangles}), square);
  axpy(-p, gradient, f);
  return f;
}

Field apply_inverse(const CellType& type, Field b) {
  const auto& f = type.factor();
  const int n = static_cast<int>(f.order.size());
  for (int p = 0; p < n; ++p)
    for (int i = f.row_begin[p]; i < f.row_begin[p + 1]; ++i)
      mesh::accumulate(b[f.order[p]], -f.row_value[i], b[f.row_index[i]]);
  for (int p = n - 1; p >= 0; --p) {
    auto& y = b[f.order[p]];
    y = mesh::scale(f.inverse_diagonal[p], y);
    for (int i = f.column_begin[p]; i < f.column_begin[p + 1]; ++i)
      mesh::accumulate(y, -f.column_value[i], b[f.column_index[i]]);
  }
  return b;
}

SolveReport step_implicit(const CellType& type, State& s, const Field& v_pred, double tolerance,
                          int max_iterations, bool project) {
  const Field rigid = rigid_part(type, s.x, v_pred);
  Field damped = v_pred;
  for (std::size_t k = 0; k < damped.size(); ++k)
    mesh::accumulate(damped[k], type.kappa()[k], mesh::subtract(rigid[k], v_pred[k]));
  const Potential potential(type, s, damped);
  Lbfgs lbfgs(type);
  const double h = type.h();
  Field d(s.x.size());
  for (std::size_t k = 0; k < d.size(); ++k) d[k] = mesh::scale(h, v_pred[k]);
  SolveReport report;
  double scale = 0, value = potential.value(d);
  Field r = potential.unbalance(d, scale);
  for (; report.iterations < max_iterations; ++report.iterations) {
    report.residual = std::sqrt(inner(r, r)) / std::max(scale, 1e-300);
    if (report.residual < tolerance) break;
    auto step = lbfgs.direction(r);
    if (inner(step, r) <= 0) {
      lbfgs.forget();
      step = lbfgs.direction(r);
    }
    // Armijo; near convergence the energy's round-off hides the decrease and the full step is taken.
    double length = 1, trial_value = 0;
    Field trial;
    for (int cut = 0; cut < 30; ++cut, length /= 2) {
      trial = d;
      axpy(length, step, trial);
      trial_value = potential.value(trial);
      if (trial_value <= value - 1e-4 * length * inner(step, r) + 1e-12 * std::abs(value)) break;
    }
    const Field old = r;
    r = potential.unbalance(trial, scale);
    Field y = old;
    axpy(-1, r, y);
    for (auto& p : step) p = mesh::scale(length, p);
    lbfgs.remember(step, y);
    d = trial, value = trial_value;
  }
  for (std::size_t k = 0; k < d.size(); ++k) {
    s.v[k] = mesh::scale(1 / h, d[k]);
    mesh::accumulate(s.v[k], type.kappa_after()[k], mesh::subtract(rigid[k], s.v[k]));
  }
  if (project) {
    axpy(-1, rigid_part(type, s.x, s.v), s.v);
    axpy(1, rigid, s.v);
  }
  axpy(h, s.v, s.x);
  return report;
}

double damping_power(const CellType& type, const Field& x, const Field& v) {
  const auto rigid = rigid_part(type, x, v);
  double power = 0;
  for (std::size_t k = 0; k < v.size(); ++k) {
    const auto own = mesh::subtract(v[k], rigid[k]);
    power += type.material().drag_per_area * type.vertex_areas()[k] * mesh::dot(own, own);
  }
  const double beta = type.material().rayleigh_beta;
  return beta > 0 ? power + beta * inner(v, lap(type, v)) : power;
}

void step_rk4(const CellType& type, State& s, double t, double dt, const ExternalForce& external) {
  const std::size_t n = s.x.size();
  const auto acceleration = [&](double time, const Field& x, const Field& v) {
    Field f = forces(type, x), e(n, Vec3{});
    external(time, x, v, e);
    axpy(1, e, f);
    for (std::size_t k = 0; k < n; ++k) f[k] = mesh::scale(1 / type.metric()[k], f[k]);
    return f;
  };
  const Field x0 = s.x, v0 = s.v;
  Field dx(n, Vec3{}), dv(n, Vec3{}), v = v0, a = acceleration(t, x0, v0);
  constexpr double weight[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6}, ahead[3] = {.5, .5, 1};
  for (int stage = 0; stage < 4; ++stage) {
    axpy(weight[stage] * dt, v, dx);
    axpy(weight[stage] * dt, a, dv);
    if (stage == 3) break;
    Field x = x0, next = v0;
    axpy(ahead[stage] * dt, v, x);
    axpy(ahead[stage] * dt, a, next);
    v = next;
    a = acceleration(t + ahead[stage] * dt, x, v);
  }
  axpy(1, dx, s.x);
  axpy(1, dv, s.v);
}

}  // namespace hemowalk::npfem
