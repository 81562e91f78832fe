#include "resolved/simulation.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/coupling.hpp"
#include "resolved/slip_correction.hpp"

namespace hemowalk::resolved {

namespace {

/// Adds the wall time of a scope to one part.
class Stopwatch {
 public:
  explicit Stopwatch(double& part) : part_(part), start_(omp_get_wtime()) {}
  ~Stopwatch() { part_ += omp_get_wtime() - start_; }

 private:
  double& part_;
  double start_;
};

std::array<double, 3>& operator+=(std::array<double, 3>& a, const std::array<double, 3>& b) {
  for (int d = 0; d < 3; ++d) a[d] += b[d];
  return a;
}

/// Lane l of vertex k in a field [vertex][3][lane].
template <int lanes, class Real>
HEMO_INLINE Vector<Real> at_lane(const Real* field, int k, int l) {
  const Real* p = field + 3 * k * lanes + l;
  return {p[0], p[lanes], p[2 * lanes]};
}
template <int lanes, class Real>
HEMO_INLINE void set_lane(const Vector<Real>& v, Real* field, int k, int l) {
  Real* p = field + 3 * k * lanes + l;
  p[0] = v.x, p[lanes] = v.y, p[2 * lanes] = v.z;
}

/// A triangle's area vector and its rate, added to the three corners. [vertex][3][lane]
template <int lanes, class Real>
HEMO_INLINE void add_normals(const std::array<int, 3>& t, const Real* x, const Real* v, Real* sum,
                             Real* rate) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Vector<Real> x0 = at_lane<lanes>(x, t[0], l), v0 = at_lane<lanes>(v, t[0], l);
    const AreaVector<Real> area =
        area_vector(at_lane<lanes>(x, t[1], l) - x0, at_lane<lanes>(x, t[2], l) - x0,
                    at_lane<lanes>(v, t[1], l) - v0, at_lane<lanes>(v, t[2], l) - v0);
    for (int i = 0; i < 3; ++i) {
      set_lane<lanes>(at_lane<lanes>(sum, t[i], l) + area.normal, sum, t[i], l);
      set_lane<lanes>(at_lane<lanes>(rate, t[i], l) + area.rate, rate, t[i], l);
    }
  }
}

/// From the sum of area vectors round a vertex and its rate: rate <- delta dn/dt, sum <- the vertex's couple.
template <int lanes, class Real>
HEMO_INLINE void to_unit_normal(Real delta, const Node4<Real>* J, Real* sum, Real* rate) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Retraction<Real> r = retraction(delta, at_lane<lanes>(sum, 0, l), at_lane<lanes>(rate, 0, l),
                                          Vector<Real>{J[l].x, J[l].y, J[l].z});
    set_lane<lanes>(r.rate, rate, 0, l);
    set_lane<lanes>(r.couple, sum, 0, l);
  }
}

/// Forces of the couples on the corners of a triangle.
template <int lanes, class Real>
HEMO_INLINE void add_couples(const std::array<int, 3>& t, const Real* x, const Real* g, Real* force) {
#pragma omp simd
  for (int l = 0; l < lanes; ++l) {
    const Vector<Real> sum =
        at_lane<lanes>(g, t[0], l) + at_lane<lanes>(g, t[1], l) + at_lane<lanes>(g, t[2], l);
    const Vector<Real> p[3] = {at_lane<lanes>(x, t[0], l), at_lane<lanes>(x, t[1], l),
                               at_lane<lanes>(x, t[2], l)};
    set_lane<lanes>(at_lane<lanes>(force, t[0], l) + couple_force(sum, p[1], p[2]), force, t[0], l);
    set_lane<lanes>(at_lane<lanes>(force, t[1], l) + couple_force(sum, p[2], p[0]), force, t[1], l);
    set_lane<lanes>(at_lane<lanes>(force, t[2], l) + couple_force(sum, p[0], p[1]), force, t[2], l);
  }
}

}  // namespace

template <class Real>
Simulation<Real>::Simulation(const data::Scene& scene, const std::vector<InitialCell>& cells)
    : scene_(scene),
      units_(scene),
      block_(make_block(scene)),
      faces_(make_faces(scene, units_)),
      fluid_(block_, make_fluid(scene, units_)),
      h_(scene.coupling.solid_every),
      one_theta_(scene.coupling.theta_n == scene.coupling.theta_t),
      velocity_(block_.size()),
      force_(block_.size()) {
  build_groups(cells);
  build_coupling();
  start_flow();
}

template <class Real>
void Simulation<Real>::build_groups(const std::vector<InitialCell>& cells) {
  const double steps = h_;
  for (int kind = 0; kind < static_cast<int>(scene_.cells.kinds.size()); ++kind) {
    if (std::none_of(cells.begin(), cells.end(), [&](const InitialCell& c) { return c.kind == kind; }))
      continue;
    const data::Kind& k = scene_.cells.kinds[kind];
    mesh::TriangleMesh rest = make_mesh(k, units_.dx);
    const std::vector<double> area = mesh::vertex_areas(rest);
    const double excess = (k.density / units_.density - 1) * mesh::volume(rest) / rest.vertex_count();
    std::vector<double> mass(area.size(), excess), weight(area.size()), metric(area.size());
    for (std::size_t v = 0; v < area.size(); ++v) {
      weight[v] = scene_.coupling.chi * area[v];
      metric[v] = mass[v] + steps * weight[v];
      require(
          metric[v] > 0,
          "cells.kinds." + k.name +
              ".density is too low (the implicit mass of a vertex is not positive) raise it or coupling.chi");
    }
    const bool is_rigid = k.law == data::Kind::Law::rigid;
    auto make = [&]() -> std::variant<npfem::Membranes<Real>, rigid::RigidBodies<Real>> {
      if (is_rigid) return rigid::RigidBodies<Real>(rigid::BodyType{rest, mass, metric, h_});
      return npfem::Membranes<Real>(
          std::make_shared<npfem::CellType>(rest, make_material(k, units_), metric, h_));
    };
    Group<Real> group{make(), kind,  static_cast<std::int32_t>(bodies_), static_cast<std::uint32_t>(slots_),
                      mass,   weight};
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (cells[c].kind != kind) continue;
      std::visit(
          [&](auto& g) {
            const int index = g.add(static_cast<std::int64_t>(c), cells[c].centre, cells[c].orientation);
            if constexpr (requires { g.set_positions(index, cells[c].vertices); })
              if (!cells[c].vertices.empty()) g.set_positions(index, cells[c].vertices);
          },
          group.cells);
    }
    bodies_ += group.count();
    std::visit(
        [&](const auto& g) { slots_ += static_cast<std::size_t>(g.batches()) * g.vertices() * g.lanes; },
        group.cells);
    groups_.push_back(std::move(group));
  }
}

template <class Real>
void Simulation<Real>::build_coupling() {
  std::vector<std::int32_t> body_of(slots_, -1);
  std::vector<contact::Shape> shapes;
  std::vector<contact::Body> bodies;
  for (const auto& group : groups_) {
    std::visit(
        [&](const auto& g) {
          contact::Shape shape;
          for (const auto& t : g.rest().triangles)
            for (const int v : t) shape.triangles.push_back(static_cast<std::uint32_t>(v));
          shape.area = g.vertex_areas();
          shapes.push_back(std::move(shape));
          for (int c = 0; c < g.count(); ++c) {
            for (int k = 0; k < g.vertices(); ++k) body_of[group.marker(c, k)] = group.first_body + c;
            bodies.push_back({group.marker(c, 0), static_cast<std::uint32_t>(g.lanes),
                              static_cast<std::uint16_t>(shapes.size() - 1), true});
          }
        },
        group.cells);
  }
  markers_ =
      std::make_unique<ibm::Markers<Real>>(block_, faces_, make_kernel(scene_.coupling.kernel), body_of);
  const contact::Law law = make_contact(scene_, units_);
  if (law.stiffness > 0 && bodies_ > 0) {
    contact_ = std::make_unique<contact::Contact<Real>>(law, make_domain(scene_, block_), shapes);
    contact_->set_bodies(std::move(bodies));
  }
  origin_ = Array<ibm::Origin>(bodies_);
  vertices_ = Array<Node4<Real>>(slots_), sites_ = Array<Node4<Real>>(slots_);
  reading_ = Array<Node4<Real>>(slots_), impulse_ = Array<Node4<Real>>(slots_),
  contact_force_ = Array<Node4<Real>>(slots_);
  normal_rate_ = Array<Real>(3 * slots_), couple_force_ = Array<Real>(3 * slots_);
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          scratch_stride_ = std::max<std::size_t>(scratch_stride_, 3 * g.vertices() * g.lanes);
        },
        group.cells);
  scratch_ = Array<Real>(scratch_stride_ * omp_get_max_threads());
  if (!one_theta_) force_reading_ = Array<Node4<Real>>(slots_);
  add_loads();
}

/// Point loads act on the given fraction of a cell's vertices, those farthest towards one end of the rest
/// shape.
template <class Real>
void Simulation<Real>::add_loads() {
  for (const auto& load : scene_.cells.loads)
    for (const auto& group : groups_)
      std::visit(
          [&](const auto& g) {
            for (int c = 0; c < g.count(); ++c) {
              if (g.id(c) != load.cell) continue;
              const int axis = load.end[1] - 'x';
              const double sign = load.end[0] == '-' ? -1 : 1;
              const auto x = g.positions(c);
              std::vector<int> order(x.size());
              for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
              std::stable_sort(order.begin(), order.end(),
                               [&](int a, int b) { return sign * x[a][axis] > sign * x[b][axis]; });
              const int n =
                  std::max(1, static_cast<int>(std::lround(load.fraction * static_cast<double>(x.size()))));
              for (int i = 0; i < n; ++i) {
                std::array<double, 3> share{};
                for (int d = 0; d < 3; ++d) share[d] = units_.force(load.force[d]) / n;
                loads_.push_back({group.marker(c, order[i]), share});
              }
            }
          },
          group.cells);
}

template <class Real>
void Simulation<Real>::start_flow() {
  fluid_.initialise([&](double y) { return steady_velocity(scene_, units_, y); });
  fluid_.moments(velocity_.view());
  complete_velocity();
}

/// velocity_ = u* + theta/2 F (interior), then its halo: what markers read.
template <class Real>
void Simulation<Real>::complete_velocity() {
  if (one_theta_ && bodies_ > 0) {
    const Real weight = static_cast<Real>(0.5 * scene_.coupling.theta_n);
    const Node4<Real>* force = force_.data();
    Node4<Real>* velocity = velocity_.data();
#pragma omp parallel for schedule(static)
    for (int k = 0; k < block_.nz; ++k)
      for (int j = 0; j < block_.ny; ++j) {
        const std::size_t row = block_.at(0, j, k);
        const Real* f = &force[row].x;
        Real* u = &velocity[row].x;
        for (int i = 0; i < 4 * block_.nx; ++i) u[i] += weight * f[i];
      }
  }
  ibm::fill_velocity_halo(block_, faces_, velocity_.view());
}

template <class Real>
lbm::Vec3 Simulation<Real>::half_body_force() const {
  const auto& g = fluid_.parameters().body_force;
  return {g[0] / 2, g[1] / 2, g[2] / 2};
}

/// x^n of every vertex, relative to a lattice node near its cell, and the point where it touches the fluid:
/// drawn back along the normal by `retraction`, which cancels the hydrodynamic thickness of a smeared sheet.
template <class Real>
void Simulation<Real>::read_positions() {
  const Real delta = static_cast<Real>(scene_.coupling.retraction);
  const std::array<int, 3> n{block_.nx, block_.ny, block_.nz};
  const std::array<bool, 3> periodic{faces_.periodic_x, faces_.periodic_y, faces_.periodic_z};
  for (auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          constexpr int lanes = std::decay_t<decltype(g)>::lanes;
          const double* anchors = g.anchors().data;
          const Real *offsets = g.offsets().data, *normals = g.normals().data;
          const int count = g.count(), vertices = g.vertices();
#pragma omp parallel for schedule(static)
          for (int b = 0; b < g.batches(); ++b) {
            alignas(64) Real fraction[3][lanes];
            for (int d = 0; d < 3; ++d)
              for (int l = 0; l < lanes; ++l) {
                const double a = anchors[(static_cast<std::size_t>(b) * 3 + d) * lanes + l],
                             whole = std::floor(a);
                fraction[d][l] = static_cast<Real>(a - whole);
                if (b * lanes + l >= count) continue;
                double node = whole;
                if (periodic[d]) node -= std::floor(node / n[d]) * n[d];
                origin_[group.first_body + b * lanes + l][d] =
                    std::isfinite(node) ? static_cast<std::int32_t>(std::clamp(node, -1e6, 1e6)) : 0;
              }
            const std::size_t slot = group.first_marker + static_cast<std::size_t>(b) * vertices * lanes;
            for (int k = 0; k < vertices; ++k) {
              const Real* x = offsets + (static_cast<std::size_t>(b) * vertices + k) * 3 * lanes;
              const Real* normal = normals + (static_cast<std::size_t>(b) * vertices + k) * 3 * lanes;
              Node4<Real>*vertex = vertices_.data() + slot + k * lanes,
              *site = sites_.data() + slot + k * lanes;
              for (int l = 0; l < lanes; ++l) {
                const Real px = fraction[0][l] + x[l], py = fraction[1][l] + x[lanes + l],
                           pz = fraction[2][l] + x[2 * lanes + l];
                vertex[l] = {px, py, pz, Real(0)};
                site[l] = {px - delta * normal[l], py - delta * normal[lanes + l],
                           pz - delta * normal[2 * lanes + l], Real(0)};
              }
            }
          }
        },
        group.cells);
}

/// Retraction as a change of coordinates (docs/adr/0007): the coupling point x_s = x - delta n(x) is a
/// function of the vertices, so its velocity is v - delta dn/dt, and a force J at x_s acts on the vertices as
/// J and, through -delta (dn/dx)^T, as forces on the corners of the triangles around. Virtual work and both
/// momenta are then conserved, and a rigid rotation of fluid and cell together feels no force. dn/dt and J
/// are those of the last step.
template <class Real>
void Simulation<Real>::retract() {
  const Real delta = static_cast<Real>(scene_.coupling.retraction);
  if (delta == 0) return;
  for (auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          constexpr int lanes = std::decay_t<decltype(g)>::lanes;
          const auto& triangles = g.rest().triangles;
          const int vertices = g.vertices();
          const std::size_t length = static_cast<std::size_t>(vertices) * 3 * lanes;
#pragma omp parallel for schedule(static)
          for (int b = 0; b < g.batches(); ++b) {
            const Real *x = g.offsets().data + b * length, *v = g.velocities().data + b * length;
            Real* rate = normal_rate_.data() + 3 * static_cast<std::size_t>(group.first_marker) + b * length;
            Real* force =
                couple_force_.data() + 3 * static_cast<std::size_t>(group.first_marker) + b * length;
            Real* sum = scratch_.data() + static_cast<std::size_t>(omp_get_thread_num()) * scratch_stride_;
            std::fill(rate, rate + length, Real(0));
            std::fill(force, force + length, Real(0));
            std::fill(sum, sum + length, Real(0));
            for (const auto& t : triangles) add_normals<lanes>(t, x, v, sum, rate);
            const Node4<Real>* J =
                impulse_.data() + group.first_marker + static_cast<std::size_t>(b) * vertices * lanes;
            for (int k = 0; k < vertices; ++k)
              to_unit_normal<lanes>(delta, J + k * lanes, sum + 3 * k * lanes, rate + 3 * k * lanes);
            for (const auto& t : triangles) add_couples<lanes>(t, x, sum, force);
          }
        },
        group.cells);
}

/// Slip-corrected fluid velocity w at every vertex and v_pred = (m v^n + k a w + h F)/(m + k a) (method 5.2,
/// 2-3).
template <class Real>
void Simulation<Real>::predict() {
  const SlipCorrection<Real> correct{static_cast<Real>(scene_.coupling.theta_n),
                                     static_cast<Real>(scene_.coupling.theta_t)};
  const auto gravity = half_body_force();
  const Real g[3] = {static_cast<Real>(gravity[0]), static_cast<Real>(gravity[1]),
                     static_cast<Real>(gravity[2])};
  const Real h = static_cast<Real>(h_);
  for (auto& group : groups_)
    std::visit(
        [&](auto& cells) {
          constexpr int lanes = std::decay_t<decltype(cells)>::lanes;
          const Real *velocities = cells.velocities().data, *normals = cells.normals().data;
          Real* predicted = cells.predicted().data;
          const int vertices = cells.vertices();
#pragma omp parallel for schedule(static)
          for (int b = 0; b < cells.batches(); ++b)
            for (int k = 0; k < vertices; ++k) {
              const std::size_t scalar = (static_cast<std::size_t>(b) * vertices + k) * lanes,
                                vector = 3 * scalar;
              const std::size_t slot = group.first_marker + scalar;
              const Real m = static_cast<Real>(group.mass[k]), a = static_cast<Real>(group.weight[k]),
                         inverse_a = 1 / a;
              const Real inverse_metric = static_cast<Real>(1 / (group.mass[k] + h_ * group.weight[k]));
              for (int l = 0; l < lanes; ++l) {
                Node4<Real>& u = reading_[slot + l];
                const Node4<Real> F = contact_force_[slot + l];
                const Real read[3] = {u.x, u.y, u.z};
                const Real J[3] = {impulse_[slot + l].x, impulse_[slot + l].y, impulse_[slot + l].z};
                Real w[3];
                if (one_theta_) {
                  correct.combined(read, J, inverse_a, w);
                } else {
                  const Node4<Real> f = force_reading_[slot + l];
                  const Real half[3] = {f.x / 2, f.y / 2, f.z / 2};
                  const Real normal[3] = {normals[vector + l], normals[vector + lanes + l],
                                          normals[vector + 2 * lanes + l]};
                  correct(read, half, J, inverse_a, normal, w);
                }
                const std::size_t at = 3 * static_cast<std::size_t>(group.first_marker) + vector + l;
                for (int d = 0; d < 3; ++d) w[d] += g[d] + normal_rate_[at + d * lanes];
                u = {w[0], w[1], w[2], Real(0)};
                const Vector<Real> force{F.x + couple_force_[at], F.y + couple_force_[at + lanes],
                                         F.z + couple_force_[at + 2 * lanes]};
                const Vector<Real> v{velocities[vector + l], velocities[vector + lanes + l],
                                     velocities[vector + 2 * lanes + l]};
                const Vector<Real> next =
                    predicted_velocity(Vector<Real>{w[0], w[1], w[2]}, v, force, m, h, inverse_metric);
                predicted[vector + l] = next.x, predicted[vector + lanes + l] = next.y,
                                   predicted[vector + 2 * lanes + l] = next.z;
              }
            }
        },
        group.cells);
}

template <class Real>
void Simulation<Real>::move_cells() {
  mesh::StepOptions options;
  options.iterations = scene_.coupling.iterations;
  solid_report_ = {};
  const auto reports = solid_step_ ? solid_step_(options) : std::vector<mesh::StepReport>{};
  for (auto& group : groups_) {
    const auto report = solid_step_ ? reports[static_cast<std::size_t>(&group - groups_.data())]
                                    : std::visit([&](auto& g) { return g.step(options); }, group.cells);
    if (report.bad_cell >= 0) {
      const auto id = std::visit([&](const auto& g) { return g.id(report.bad_cell); }, group.cells);
      throw PhysicsError("cell " + std::to_string(id) + " (" + scene_.cells.kinds[group.kind].name +
                         ") is no longer finite at step " + std::to_string(fluid_steps_) +
                         " (blow-up) lower the acceleration or raise coupling.iterations");
    }
    solid_report_.increment = std::max(solid_report_.increment, report.increment);
  }
}

/// J = a (v - w): what each marker gives the fluid in each of the k fluid steps.
template <class Real>
void Simulation<Real>::impulses() {
  for (auto& group : groups_)
    std::visit(
        [&](const auto& cells) {
          constexpr int lanes = std::decay_t<decltype(cells)>::lanes;
          const Real* velocities = cells.velocities().data;
          const int vertices = cells.vertices();
#pragma omp parallel for schedule(static)
          for (int b = 0; b < cells.batches(); ++b)
            for (int k = 0; k < vertices; ++k) {
              const std::size_t scalar = (static_cast<std::size_t>(b) * vertices + k) * lanes;
              const std::size_t slot = group.first_marker + scalar;
              const Real a = static_cast<Real>(group.weight[k]);
              const Real* v = velocities + 3 * scalar;
              const int used = std::min(lanes, cells.count() - b * lanes);
              for (int l = 0; l < lanes; ++l) {
                const Node4<Real> w = reading_[slot + l];
                const Node4<Real> none{0, 0, 0, 0};  // idle lanes give nothing
                const Vector<Real> J = marker_impulse(a, Vector<Real>{v[l], v[lanes + l], v[2 * lanes + l]},
                                                      Vector<Real>{w.x, w.y, w.z});
                impulse_[slot + l] = l < used ? Node4<Real>{J.x, J.y, J.z, 0} : none;
              }
            }
        },
        group.cells);
}

template <class Real>
void Simulation<Real>::step() {
  const double start = omp_get_wtime();
  const double before =
      timings_.fluid + timings_.interpolation + timings_.spreading + timings_.solid + timings_.contact;
  if (bodies_ > 0) {
    {
      Stopwatch watch(timings_.interpolation);
      read_positions();
      markers_->locate(origin_.view(), sites_.view());
      markers_->interpolate(velocity_.view(), reading_.view());
      if (!one_theta_) {
        ibm::fill_velocity_halo(block_, {true, faces_.periodic_y, true, {}, {}}, force_.view());
        markers_->interpolate(force_.view(), force_reading_.view());
      }
    }
    {
      Stopwatch watch(timings_.contact);
      if (contact_)
        contact_summary_ = contact_->compute(origin_.view(), vertices_.view(), contact_force_.view());
      if (!loads_.empty()) {
        if (!contact_)
          std::memset(static_cast<void*>(contact_force_.data()), 0,
                      contact_force_.size() * sizeof(Node4<Real>));
        for (const auto& load : loads_) {
          auto& f = contact_force_[load.slot];
          f.x += static_cast<Real>(load.force[0]), f.y += static_cast<Real>(load.force[1]),
              f.z += static_cast<Real>(load.force[2]);
          for (int d = 0; d < 3; ++d) taken_.from_loads[d] += h_ * load.force[d];
        }
      }
    }
    {
      Stopwatch watch(timings_.solid);
      retract();
      predict();
      move_cells();
      impulses();
    }
    {
      Stopwatch watch(timings_.spreading);
#pragma omp parallel for schedule(static)
      for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(force_.size()); ++i)
        force_[i] = {0, 0, 0, 0};
      markers_->spread(impulse_.view(), force_.view());
      force_on_walls_ = ibm::fold_force_halo(block_, faces_, force_.view());
      force_on_walls_[0] += contact_summary_.wall_force[0],
          force_on_walls_[1] += contact_summary_.wall_force[1];
      for (int d = 0; d < 3; ++d) {
        taken_.to_lower_wall[d] += h_ * force_on_walls_[0][d];
        taken_.to_upper_wall[d] += h_ * force_on_walls_[1][d];
      }
    }
  }
  {
    Stopwatch watch(timings_.fluid);
    const View<const Node4<Real>> force =
        bodies_ > 0 ? View<const Node4<Real>>(force_.view()) : View<const Node4<Real>>{};
    for (int k = 0; k < scene_.coupling.solid_every; ++k) {
      fluid_.advance(force, velocity_.view());
      const auto impulse = fluid_.wall_impulse();
      taken_.to_lower_wall += impulse.lower, taken_.to_upper_wall += impulse.upper;
      for (int d = 0; d < 3; ++d)
        taken_.from_body_force[d] +=
            fluid_.parameters().body_force[d] * static_cast<double>(fluid_.fluid_nodes());
    }
    complete_velocity();
  }
  fluid_steps_ += scene_.coupling.solid_every;
  timings_.steps += scene_.coupling.solid_every;
  const double after =
      timings_.fluid + timings_.interpolation + timings_.spreading + timings_.solid + timings_.contact;
  timings_.other += omp_get_wtime() - start - (after - before);
}

template <class Real>
Momentum Simulation<Real>::momentum() const {
  Momentum m = taken_;
  m.fluid = fluid_.totals().momentum;
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto v = g.velocities();
          const auto layout = g.layout();
          for (int c = 0; c < g.count(); ++c)
            for (int k = 0; k < g.vertices(); ++k)
              for (int d = 0; d < 3; ++d) m.cells[d] += group.mass[k] * v[layout.at(c, k, d)];
        },
        group.cells);
  return m;
}

template <class Real>
double Simulation<Real>::slip_rms() {
  if (bodies_ == 0) return 0;
  // Of the coupling points against u = u* + F/2 there; velocity_ holds u* + theta/2 F.
  Array<Node4<Real>> u(slots_), f(slots_);
  markers_->interpolate(velocity_.view(), u.view());
  Array<Node4<Real>> field(force_.size());
  std::memcpy(static_cast<void*>(field.data()), force_.data(), force_.size() * sizeof(Node4<Real>));
  ibm::fill_velocity_halo(block_, {true, faces_.periodic_y, true, {}, {}}, field.view());
  markers_->interpolate(field.view(), f.view());
  const double rest = 0.5 * (1 - (one_theta_ ? scene_.coupling.theta_n : 0));
  const auto gravity = half_body_force();
  double sum = 0;
  std::size_t n = 0;
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto v = g.velocities();
          const auto layout = g.layout();
          for (int c = 0; c < g.count(); ++c)
            for (int k = 0; k < g.vertices(); ++k, ++n) {
              const auto m = group.marker(c, k);
              const double uk[3] = {u[m].x + rest * f[m].x, u[m].y + rest * f[m].y, u[m].z + rest * f[m].z};
              for (int d = 0; d < 3; ++d) {
                const double site =
                    v[layout.at(c, k, d)] -
                    normal_rate_[3 * static_cast<std::size_t>(group.first_marker) + layout.at(c, k, d)];
                const double slip = site - uk[d] - gravity[d];
                sum += slip * slip;
              }
            }
        },
        group.cells);
  return std::sqrt(sum / static_cast<double>(n));
}

template <class Real>
std::size_t Simulation<Real>::memory_bytes() const {
  return fluid_.memory_bytes() +
         (velocity_.size() + force_.size() + 5 * slots_ + force_reading_.size()) * sizeof(Node4<Real>);
}

namespace {

template <class T>
void put(std::vector<std::byte>& out, const T* data, std::size_t n) {
  const std::uint64_t count = n;
  const auto* head = reinterpret_cast<const std::byte*>(&count);
  out.insert(out.end(), head, head + sizeof(count));
  const auto* raw = reinterpret_cast<const std::byte*>(data);
  out.insert(out.end(), raw, raw + n * sizeof(T));
}

class Reader {
 public:
  explicit Reader(View<const std::byte> in) : in_(in) {}
  template <class T>
  std::vector<T> take() {
    std::uint64_t n = 0;
    copy(&n, sizeof(n));
    require(n <= in_.size / sizeof(T),
            "the checkpoint is damaged (a length runs past its end) start from an older one");
    std::vector<T> v(n);
    copy(v.data(), n * sizeof(T));
    return v;
  }
  template <class T>
  void into(T* data, std::size_t n) {
    const auto v = take<T>();
    require(
        v.size() == n,
        "the checkpoint does not fit the scene (an array has another length) use the scene it was made with");
    if (n) std::memcpy(static_cast<void*>(data), v.data(), n * sizeof(T));
  }

 private:
  void copy(void* to, std::size_t bytes) {
    require(bytes <= in_.size - at_, "the checkpoint is damaged (it ends too early) start from an older one");
    if (bytes) std::memcpy(to, in_.data + at_, bytes);
    at_ += bytes;
  }
  View<const std::byte> in_;
  std::size_t at_ = 0;
};

}  // namespace

template <class Real>
std::vector<std::byte> Simulation<Real>::save() const {
  std::vector<std::byte> out;
  put(out, &fluid_steps_, 1);
  put(out, &taken_, 1);
  const auto fluid = fluid_.save();
  put(out, fluid.data(), fluid.size());
  put(out, velocity_.data(), velocity_.size());
  put(out, force_.data(), force_.size());
  put(out, impulse_.data(), impulse_.size());
  const auto sort = markers_->save();
  put(out, sort.data(), sort.size());
  const auto contacts = contact_ ? contact_->save() : std::vector<std::byte>{};
  put(out, contacts.data(), contacts.size());
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          std::vector<std::byte> cells(g.state_bytes() * g.count());
          for (int c = 0; c < g.count(); ++c) g.save(c, cells.data() + c * g.state_bytes());
          put(out, cells.data(), cells.size());
        },
        group.cells);
  return out;
}

template <class Real>
void Simulation<Real>::load(View<const std::byte> state) {
  Reader in(state);
  in.into(&fluid_steps_, 1);
  in.into(&taken_, 1);
  const auto fluid = in.take<std::byte>();
  fluid_.load({fluid.data(), fluid.size()});
  in.into(velocity_.data(), velocity_.size());
  in.into(force_.data(), force_.size());
  in.into(impulse_.data(), impulse_.size());
  const auto sort = in.take<std::byte>();
  markers_->load({sort.data(), sort.size()});
  const auto contacts = in.take<std::byte>();
  if (contact_) contact_->load({contacts.data(), contacts.size()});
  for (auto& group : groups_)
    std::visit(
        [&](auto& g) {
          const auto cells = in.take<std::byte>();
          const int count = g.count();
          require(cells.size() == g.state_bytes() * count,
                  "the checkpoint does not fit the scene (another number of cells) use the scene it was made "
                  "with");
          // Cells come back in the order they were saved in: lanes, and with them all sums, are the same.
          for (int c = count - 1; c >= 0; --c) g.remove(c);
          for (int c = 0; c < count; ++c) g.load(cells.data() + c * g.state_bytes());
        },
        group.cells);
}

template class Simulation<float>;
template class Simulation<double>;

}  // namespace hemowalk::resolved
