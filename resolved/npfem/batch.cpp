#include "resolved/npfem/batch.hpp"

#include <cstring>
#include <limits>

namespace hemowalk::npfem {
namespace {

// [[gnu::flatten]]: GCC's inliner gives up on packs half-way and then calls a function per arithmetic
// operation.

/// Partial sums of this many terms keep the round-off of a single precision sum small.
constexpr int chunk = 16;

/// Calls body(begin, end) for consecutive chunks of [0, n).
template <class Body>
void for_chunks(int n, const Body& body) {
  for (int begin = 0; begin < n; begin += chunk) body(begin, begin + chunk < n ? begin + chunk : n);
}

template <class To, class From>
std::vector<To> convert(const std::vector<From>& from) {
  return std::vector<To>(from.begin(), from.end());
}

}  // namespace

template <class Real>
Tables<Real>::Tables(const CellType& type)
    : vertices(type.rest().vertex_count()),
      material(type.material()),
      metric(convert<Real>(type.metric())),
      kappa(convert<Real>(type.kappa())),
      kappa_after(convert<Real>(type.kappa_after())),
      order(type.factor().order),
      row_begin(type.factor().row_begin),
      row_index(type.factor().row_index),
      column_begin(type.factor().column_begin),
      column_index(type.factor().column_index),
      row_value(convert<Real>(type.factor().row_value)),
      column_value(convert<Real>(type.factor().column_value)),
      inverse_diagonal(convert<Real>(type.factor().inverse_diagonal)),
      h(static_cast<Real>(type.h())),
      inverse_h(static_cast<Real>(1 / type.h())),
      rest_volume(static_cast<Real>(type.rest_volume())),
      rest_gradient_square(static_cast<Real>(type.rest_gradient_square())),
      epsilon2(static_cast<Real>(type.bending_epsilon() * type.bending_epsilon())),
      damped(type.material().drag_per_area > 0 && !type.material().damp_after),
      damp_after(type.material().drag_per_area > 0 && type.material().damp_after) {
  const auto real = [](double x) { return static_cast<Real>(x); };
  double total = 0;
  for (int k = 0; k < vertices; ++k) {
    total += type.metric()[k];
    mass_rate.push_back(real(type.metric()[k] / (type.h() * type.h() * (1 - type.kappa()[k]))));
  }
  total_metric = real(total);
  stiff_volume = material.volume_modulus > 0.5 * total / vertices / (type.h() * type.h());
  for (int t = 0; t < type.rest().triangle_count(); ++t) {
    const auto& v = type.rest().triangles[t];
    const auto& r = type.triangle_rest()[t];
    triangles.push_back(
        {v[0],
         v[1],
         v[2],
         {real(r.b11), real(r.b12), real(r.b22), real(r.b11 * r.b22 - r.b12 * r.b12), real(r.area)}});
  }
  for (std::size_t e = 0; e < type.edges().size(); ++e) {
    const auto& v = type.edges()[e];
    const auto& r = type.edge_rest()[e];
    edges.push_back(
        {v.v0, v.v1, v.v2, v.v3, {real(r.w1), real(r.w2), real(r.w3), real(r.stiffness), real(r.length)}});
  }
  std::vector<std::vector<std::pair<int, double>>> rows(vertices);
  for (const auto& e : type.laplacian()) {
    rows[e.row].push_back({e.column, e.value});
    if (e.row != e.column) rows[e.column].push_back({e.row, e.value});
  }
  lap_begin.push_back(0);
  for (const auto& row : rows) {
    for (auto [column, value] : row) lap_index.push_back(column), lap_value.push_back(real(value));
    lap_begin.push_back(static_cast<int>(lap_index.size()));
  }
}

template <class Real>
template <class LawType>
[[gnu::flatten, gnu::noinline]] auto BatchKernel<Real>::stretch_pass(const Real* offset, const LawType& law)
    -> P {
  Real *force = s_.force.data(), *gradient = s_.gradient.data();
  const Real* moved = s_.moved.data();
  P volume(0);
  for_chunks(static_cast<int>(t_.triangles.size()), [&](int begin, int end) {
    P part(0);
    for (int i = begin; i < end; ++i) {
      const auto& row = t_.triangles[i];
      const V r0 = load3(offset, row.v0), d0 = load3(moved, row.v0);
      const V e1 = (load3(offset, row.v1) - r0) + (load3(moved, row.v1) - d0);
      const V e2 = (load3(offset, row.v2) - r0) + (load3(moved, row.v2) - d0);
      const auto now = make_triangle(e1, e2);
      const auto stretch = stretch_of(row.rest, now);
      V f1, f2;
      stretch_forces(row.rest, now, stretch, law.gradient(stretch), f1, f2);
      add3(V{-(f1.x + f2.x), -(f1.y + f2.y), -(f1.z + f2.z)}, force, row.v0);
      add3(f1, force, row.v1);
      add3(f2, force, row.v2);
      add3(now.normal, gradient, row.v0);
      add3(now.normal, gradient, row.v1);
      add3(now.normal, gradient, row.v2);
      part += volume_share(r0 + d0, now.normal);
    }
    volume += part;
  });
  return volume * (Real(1) / Real(6));
}

template <class Real>
[[gnu::flatten, gnu::noinline]] void BatchKernel<Real>::edge_pass(const Real* offset) {
  Real* force = s_.force.data();
  const Real* moved = s_.moved.data();
  for (const auto& row : t_.edges) {
    const V r0 = load3(offset, row.v0), d0 = load3(moved, row.v0);
    const auto from0 = [&](int j) { return (load3(offset, j) - r0) + (load3(moved, j) - d0); };
    const V e = edge_vector(row.rest, from0(row.v1), from0(row.v2), from0(row.v3));
    const V f = edge_bending_factor(row.rest, t_.epsilon2, e) * e;
    const V f1 = -row.rest.w1 * f, f2 = -row.rest.w2 * f, f3 = -row.rest.w3 * f;
    add3(f1, force, row.v1);
    add3(f2, force, row.v2);
    add3(f3, force, row.v3);
    add3(Real(-1) * (f1 + f2 + f3), force, row.v0);
  }
}

template <class Real>
[[gnu::flatten, gnu::noinline]] void BatchKernel<Real>::helfrich_pass(const Real* offset) {
  const Real modulus = static_cast<Real>(t_.material.bending_modulus);
  const Real h0 = static_cast<Real>(t_.material.reference_curvature);
  Real *force = s_.force.data(), *curvature = s_.curvature.data(), *area = s_.area.data();
  std::memset(curvature, 0, sizeof(Real) * s_.curvature.size());
  std::memset(area, 0, sizeof(Real) * s_.area.size());
  const auto add = [](const P& value, Real* field, int k) {
    Real* p = field + static_cast<std::size_t>(k) * W;
    store<Real, W>(load<Real, W>(p) + value, p);
  };
  const auto at = [](const Real* field, int k) {
    return load<Real, W>(field + static_cast<std::size_t>(k) * W);
  };
  using std::sqrt;
  for (const auto& row : t_.triangles) {
    const V n = cross(between(offset, row.v0, row.v1), between(offset, row.v0, row.v2));
    const P third = sqrt(dot(n, n)) * (Real(1) / Real(6));
    for (int v : {row.v0, row.v1, row.v2}) add(third, area, v);
  }
  const auto hinge = [&](const auto& row) {
    return dihedral(between(offset, row.v0, row.v1), between(offset, row.v0, row.v2),
                    between(offset, row.v0, row.v3));
  };
  for (const auto& row : t_.edges) {
    const auto d = hinge(row);
    const P quarter = Real(0.25) * (d.length * d.theta);
    add(quarter, curvature, row.v0);
    add(quarter, curvature, row.v1);
  }
  for (int k = 0; k < t_.vertices; ++k) {  // M_i, A_i -> dE/dM_i, dE/dA_i
    const P a = at(area, k), excess = at(curvature, k) - h0 * a, ratio = excess / a;
    store<Real, W>(4 * modulus * ratio, curvature + static_cast<std::size_t>(k) * W);
    store<Real, W>(-2 * modulus * (ratio * (2 * h0 + ratio)), area + static_cast<std::size_t>(k) * W);
  }
  for (const auto& row : t_.edges) {
    const auto d = hinge(row);
    const P w = Real(-0.25) * (at(curvature, row.v0) + at(curvature, row.v1));
    const P wl = w * d.length;
    const V along = (w * d.theta) * d.tangent;
    add3(wl * d.d0 - along, force, row.v0);
    add3(wl * d.d1 + along, force, row.v1);
    add3(wl * d.d2, force, row.v2);
    add3(wl * d.d3, force, row.v3);
  }
  for (const auto& row : t_.triangles) {
    const V e1 = between(offset, row.v0, row.v1), e2 = between(offset, row.v0, row.v2), n = cross(e1, e2);
    const P w =
        (at(area, row.v0) + at(area, row.v1) + at(area, row.v2)) * (Real(-1) / Real(6)) / sqrt(dot(n, n));
    const V f1 = w * cross(e2, n), f2 = w * cross(n, e1);
    add3(f1, force, row.v1);
    add3(f2, force, row.v2);
    add3(Real(-1) * (f1 + f2), force, row.v0);
  }
}

template <class Real>
[[gnu::flatten]] auto BatchKernel<Real>::membrane_forces(const Real* offset) -> P {
  std::memset(s_.force.data(), 0, sizeof(Real) * s_.force.size());
  std::memset(s_.gradient.data(), 0, sizeof(Real) * s_.gradient.size());
  const auto& m = t_.material;
  const auto real = [](double x) { return static_cast<Real>(x); };
  P volume(0);
  switch (m.law) {
    case Law::paper:
      volume = stretch_pass(offset, PaperLaw<Real>{{real(m.B), real(m.D)}, {real(m.C)}});
      break;
    case Law::neo_hookean:
      volume = stretch_pass(offset, NeoHookean<Real>{real(m.Gs)});
      break;
    case Law::skalak:
      volume = stretch_pass(offset, Skalak<Real>{real(m.Gs), real(m.skalak_C)});
      break;
  }
  if (m.bending == Bending::paper) edge_pass(offset);
  if (m.bending == Bending::helfrich) helfrich_pass(offset);
  P square(t_.rest_gradient_square);
  if (m.volume_force == VolumeForce::paper) {
    square = P(0);
    for (int k = 0; k < t_.vertices; ++k) {
      const V g = load3(s_.gradient.data(), k);
      square += dot(g, g);
    }
    square *= Real(1) / Real(36);
  }
  return volume_factor(real(m.volume_modulus), t_.rest_volume, volume, square) * (Real(1) / Real(6));
}

template <class Real>
void BatchKernel<Real>::forces(const BatchFields<Real>& b) {
  std::memcpy(s_.moved.data(), b.residual, sizeof(Real) * s_.moved.size());
  const P p = membrane_forces(b.offset);
  for (int k = 0; k < t_.vertices; ++k) add3(-p * load3(s_.gradient.data(), k), s_.force.data(), k);
}

template <class Real>
auto BatchKernel<Real>::stored_power(const BatchFields<Real>& b) -> P {
  const Real half = t_.h / 2;
  for (int k = 0; k < t_.vertices; ++k)
    store3(load3(b.residual, k) - half * load3(b.velocity, k), s_.moved.data(), k);
  const P p = membrane_forces(b.offset);
  P power(0);
  for (int k = 0; k < t_.vertices; ++k)
    power += dot(p * load3(s_.gradient.data(), k) - load3(s_.force.data(), k), load3(b.velocity, k));
  return power;
}

template <class Real>
[[gnu::flatten]] auto BatchKernel<Real>::find_frame(const BatchFields<Real>& b) -> Frame {
  mesh::Inertia<P> inertia;
  mesh::Momentum<P> momentum;
  for_chunks(t_.vertices, [&](int begin, int end) {
    mesh::Inertia<P> i;
    mesh::Momentum<P> p;
    for (int k = begin; k < end; ++k) {
      const V r = load3(b.offset, k);
      i.add(t_.metric[k], r);
      p.add(t_.metric[k], r, load3(b.predicted, k));
    }
    inertia.add(i), momentum.add(p);
  });
  const mesh::Body<P> body(P(t_.total_metric), inertia);
  return {body, body.motion(momentum)};
}

template <class Real>
auto BatchKernel<Real>::aim(const BatchFields<Real>& b, const Frame& frame, bool damping, int k) const
    -> Aim {
  const V free = load3(b.predicted, k);
  if (!damping) return {free, t_.mass_rate[k] * (1 - t_.kappa[k])};
  return {free + t_.kappa[k] * (frame.at(load3(b.offset, k)) - free), t_.mass_rate[k]};
}

template <class Real>
[[gnu::flatten]] auto BatchKernel<Real>::unbalance(const BatchFields<Real>& b, const Frame& frame,
                                                   bool damping) -> P {
  const P p = membrane_forces(b.offset);
  P square(0);
  for (int k = 0; k < t_.vertices; ++k) {
    const auto [wanted, rate] = aim(b, frame, damping, k);
    const V inertia = rate * (t_.h * wanted - load3(s_.increment.data(), k));
    square += dot(inertia, inertia);
    add3(inertia - p * load3(s_.gradient.data(), k), s_.force.data(), k);
  }
  if (t_.material.rayleigh_beta > 0) add_rayleigh();
  return square;
}

/// - beta Lap v, v = d/h.
template <class Real>
[[gnu::flatten]] void BatchKernel<Real>::add_rayleigh() {
  const Real factor = static_cast<Real>(-t_.material.rayleigh_beta) * t_.inverse_h;
  for (int k = 0; k < t_.vertices; ++k) {
    V sum{P(0), P(0), P(0)};
    for (int i = t_.lap_begin[k]; i < t_.lap_begin[k + 1]; ++i)
      sum = sum + t_.lap_value[i] * load3(s_.increment.data(), t_.lap_index[i]);
    add3(factor * sum, s_.force.data(), k);
  }
}

/// The implicit step is x' = v'(x) by backward Euler, m/(h (1 - kappa)) (v' - wanted) = F_int(x); here
/// classical Runge-Kutta, stable while h^2 (1 - kappa)/m times the stiffness stays below 2.8.
template <class Real>
void BatchKernel<Real>::runge_kutta(const BatchFields<Real>& b, const Frame& frame, bool damping) {
  constexpr Real weight[4] = {Real(1. / 6), Real(1. / 3), Real(1. / 3), Real(1. / 6)};
  constexpr Real ahead[4] = {Real(0.5), Real(0.5), Real(1), Real(0)};
  Real* sum = s_.response.data();
  std::memset(sum, 0, sizeof(Real) * s_.response.size());
  std::memset(s_.increment.data(), 0, sizeof(Real) * s_.increment.size());
  std::memcpy(s_.moved.data(), b.residual, sizeof(Real) * s_.moved.size());
  for (int stage = 0; stage < 4; ++stage) {
    const P p = membrane_forces(b.offset);
    for (int k = 0; k < t_.vertices; ++k) {
      const auto [wanted, rate] = aim(b, frame, damping, k);
      const V force = load3(s_.force.data(), k) - p * load3(s_.gradient.data(), k);
      const V d = t_.h * wanted + (1 / rate) * force;
      store3(load3(sum, k) + weight[stage] * d, sum, k);
      store3(load3(b.residual, k) + ahead[stage] * d, s_.moved.data(), k);
    }
  }
  std::memcpy(s_.increment.data(), sum, sizeof(Real) * s_.increment.size());
}

/// x <- N^{-1} x by two triangular sweeps, the three components and all lanes at
/// once.
template <class Real>
[[gnu::flatten, gnu::noinline]] void BatchKernel<Real>::solve(Real* x) {
  const int n = t_.vertices;
  for (int p = 0; p < n; ++p) {
    V sum = load3(x, t_.order[p]);
    for (int i = t_.row_begin[p]; i < t_.row_begin[p + 1]; ++i)
      sum = sum - t_.row_value[i] * load3(x, t_.row_index[i]);
    store3(sum, x, t_.order[p]);
  }
  for (int p = n - 1; p >= 0; --p) {
    V sum = t_.inverse_diagonal[p] * load3(x, t_.order[p]);
    for (int i = t_.column_begin[p]; i < t_.column_begin[p + 1]; ++i)
      sum = sum - t_.column_value[i] * load3(x, t_.column_index[i]);
    store3(sum, x, t_.order[p]);
  }
}

/// With u = N^{-1} g and c = k_v/sum |g|^2: (N + c g g^T)^{-1} r = N^{-1} r - u c (u.r)/(1 + c g.u).
template <class Real>
[[gnu::flatten]] void BatchKernel<Real>::solve_with_volume() {
  std::memcpy(s_.response.data(), s_.gradient.data(), sizeof(Real) * s_.response.size());
  solve(s_.response.data());
  P gu(0), ur(0);
  for (int k = 0; k < t_.vertices; ++k) {
    const V u = load3(s_.response.data(), k);
    gu += dot(load3(s_.gradient.data(), k), u);
    ur += dot(u, load3(s_.force.data(), k));
  }
  // scratch.gradient holds 6 g
  const Real c = static_cast<Real>(t_.material.volume_modulus) / (36 * t_.rest_gradient_square);
  const P factor = c * ur / (1 + c * gu);
  solve(s_.force.data());
  for (int k = 0; k < t_.vertices; ++k) add3(-factor * load3(s_.response.data(), k), s_.force.data(), k);
}

template <class Real>
[[gnu::flatten]] auto BatchKernel<Real>::correct(const BatchFields<Real>& b) -> P {
  P change(0), total(0);
  for (int k = 0; k < t_.vertices; ++k) {
    const V y = load3(s_.force.data(), k), d = load3(s_.increment.data(), k) + y;
    store3(d, s_.increment.data(), k);
    store3(load3(b.residual, k) + d, s_.moved.data(), k);
    change += dot(y, y);
    total += dot(d, d);
  }
  using std::max;
  return change / max(total, P(Real(1e-30)));
}

/// d <- d + kappa (h (V + omega x r) - d).
template <class Real>
[[gnu::flatten]] void BatchKernel<Real>::damp(const BatchFields<Real>& b, const Frame& frame) {
  for (int k = 0; k < t_.vertices; ++k) {
    const V d = load3(s_.increment.data(), k);
    store3(d + t_.kappa_after[k] * (t_.h * frame.at(load3(b.offset, k)) - d), s_.increment.data(), k);
  }
}

/// Velocities above \p limit are shortened to it.
template <class Real>
[[gnu::flatten]] void BatchKernel<Real>::cap(const BatchFields<Real>& b, Real limit) {
  for (int k = 0; k < t_.vertices; ++k) store3(shortened(load3(b.velocity, k), limit), b.velocity, k);
}

/// v = d/h, with its rigid part replaced by that of v_pred: internal forces change neither the linear nor the
/// angular momentum (about x^n), whether the iteration has converged or not.
template <class Real>
[[gnu::flatten]] void BatchKernel<Real>::project(const BatchFields<Real>& b, const Frame& frame) {
  // The momentum of the difference, not the difference of momenta: its rounding does not add up over steps.
  mesh::Momentum<P> missing;
  for_chunks(t_.vertices, [&](int begin, int end) {
    mesh::Momentum<P> part;
    for (int k = begin; k < end; ++k)
      part.add(t_.metric[k], load3(b.offset, k),
               load3(b.predicted, k) - t_.inverse_h * load3(s_.increment.data(), k));
    missing.add(part);
  });
  const auto lost = frame.body.motion(missing);
  const V velocity = lost.velocity, spin = lost.spin;
  for (int k = 0; k < t_.vertices; ++k)
    store3(t_.inverse_h * load3(s_.increment.data(), k) +
               (velocity + cross(spin, load3(b.offset, k) - frame.body.centre())),
           b.velocity, k);
}

/// x += h v. The mean goes into the double anchor, the rest into offset + residual without loss.
/// \returns a number per lane that is finite if all of it was.
template <class Real>
[[gnu::flatten]] auto BatchKernel<Real>::move(const BatchFields<Real>& b) -> P {
  V mean{P(0), P(0), P(0)};
  for_chunks(t_.vertices, [&](int begin, int end) {
    V part{P(0), P(0), P(0)};
    for (int k = begin; k < end; ++k) part = part + load3(b.velocity, k);
    mean = mean + part;
  });
  mean = (t_.h / static_cast<Real>(t_.vertices)) * mean;
  const P* component[3] = {&mean.x, &mean.y, &mean.z};
  for (int d = 0; d < 3; ++d)
    for (int lane = 0; lane < W; ++lane)
      b.anchor[d * W + lane] += static_cast<double>(Real((*component[d])[lane]));
  const auto two_sum = [](const P& x, const P& y, P& error) {
    const P sum = x + y, part = sum - x;
    error = (x - (sum - part)) + (y - part);
    return sum;
  };
  for (int k = 0; k < t_.vertices; ++k) {
    const V x = load3(b.offset, k);
    const V y = (t_.h * load3(b.velocity, k) - mean) + load3(b.residual, k);
    V sum, error;
    sum.x = two_sum(x.x, y.x, error.x);
    sum.y = two_sum(x.y, y.y, error.y);
    sum.z = two_sum(x.z, y.z, error.z);
    store3(sum, b.offset, k);
    store3(error, b.residual, k);
  }
  return mean.x + mean.y + mean.z;
}

template <class Real>
[[gnu::flatten, gnu::noinline]] void BatchKernel<Real>::update_normals(const BatchFields<Real>& b) {
  std::memset(b.normal, 0, sizeof(Real) * 3 * Scratch<Real>::size(t_.vertices));
  for (const auto& row : t_.triangles) {
    const V r0 = load3(b.offset, row.v0);
    const V n = cross(load3(b.offset, row.v1) - r0, load3(b.offset, row.v2) - r0);
    for (int v : {row.v0, row.v1, row.v2}) add3(n, b.normal, v);
  }
  using std::max;
  using std::sqrt;
  for (int k = 0; k < t_.vertices; ++k) {
    const V n = load3(b.normal, k);
    store3((1 / sqrt(max(dot(n, n), P(Real(1e-30))))) * n, b.normal, k);
  }
}

template <class Real>
auto BatchKernel<Real>::step(const BatchFields<Real>& b, const mesh::StepOptions& options) -> Report {
  // Start from the last velocity: what is wrong with the stand-in then acts on dv/dt only. Starting from
  // v_pred instead would let the stand-in resist the motion itself.
  for (int k = 0; k < t_.vertices; ++k) {
    const V d = t_.h * load3(b.velocity, k);
    store3(d, s_.increment.data(), k);
    store3(load3(b.residual, k) + d, s_.moved.data(), k);
  }
  const bool damping = options.damping && t_.damped;
  const Frame frame = find_frame(b);
  Report report{P(0), P(0), P(0)};
  if (options.runge_kutta) runge_kutta(b, frame, damping);
  for (int i = 0; i < options.iterations && !options.runge_kutta; ++i) {
    unbalance(b, frame, damping);
    t_.stiff_volume ? solve_with_volume() : solve(s_.force.data());
    report.increment = correct(b);
  }
  if (options.measure_residual) {
    const P scale = unbalance(b, frame, damping);
    P square(0);
    for (int k = 0; k < t_.vertices; ++k) {
      const V r = load3(s_.force.data(), k);
      square += dot(r, r);
    }
    using std::max;
    report.residual = square / max(scale, P(Real(1e-30)));
  }
  if (options.damping && t_.damp_after) damp(b, frame);
  project(b, frame);
  if (options.velocity_cap < std::numeric_limits<double>::infinity())
    cap(b, static_cast<Real>(options.velocity_cap));
  report.probe = move(b);
  update_normals(b);
  return report;
}

template <class Real>
auto BatchKernel<Real>::drift(const BatchFields<Real>& b) -> Report {
  std::memcpy(b.velocity, b.predicted, sizeof(Real) * 3 * Scratch<Real>::size(t_.vertices));
  Report report{P(0), P(0), move(b)};
  update_normals(b);
  return report;
}

template struct Tables<float>;
template struct Tables<double>;
template class BatchKernel<float>;
template class BatchKernel<double>;

}  // namespace hemowalk::npfem
