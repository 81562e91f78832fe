#include "resolved/simulation.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/region.hpp"
#include "resolved/retraction.hpp"
#include "resolved/stopwatch.hpp"

namespace hemowalk::resolved {

namespace {

std::array<double, 3>& operator+=(std::array<double, 3>& a, const std::array<double, 3>& b) {
  for (int d = 0; d < 3; ++d) a[d] += b[d];
  return a;
}

/// Planes a slab needs so that a cell has markers on one neighbour only, and cells of both neighbours cannot
/// touch: two reaches, the contact's range, and the node by which a centre may be outside on either side.
double thickest_reach(const data::Scene& scene, const LatticeUnits& units,
                      const std::vector<InitialCell>& cells) {
  double radius = 0;
  std::vector<std::uint8_t> seen(scene.cells.kinds.size(), 0);
  for (const InitialCell& cell : cells)
    if (!std::exchange(seen[cell.kind], 1))
      radius = std::max(radius, mesh::bounding_radius(make_mesh(scene.cells.kinds[cell.kind], units.dx)));
  return cells.empty() ? 0 : 2 * radius + std::max(0.0, make_contact(scene, units).range) + 2;
}

lbm::Parameters fluid_of(const data::Scene& scene, const LatticeUnits& units, bool divided) {
  lbm::Parameters p = make_fluid(scene, units);
  p.divided_z = divided;
  return p;
}

ibm::Faces faces_of(const data::Scene& scene, const LatticeUnits& units, bool divided) {
  ibm::Faces faces = make_faces(scene, units);
  faces.periodic_z = !divided;
  return faces;
}

}  // namespace

template <class Real>
Simulation<Real>::Simulation(const data::Scene& scene, const std::vector<InitialCell>& cells,
                             mpi::Ranks ranks)
    : scene_(scene),
      units_(scene),
      decomposition_(make_block(scene), std::move(ranks), thickest_reach(scene, units_, cells)),
      block_(decomposition_.block()),
      faces_(faces_of(scene, units_, decomposition_.divided())),
      region_(scene),
      fluid_(block_, fluid_of(scene, units_, decomposition_.divided())),
      fields_(decomposition_, fluid_.border_size()),
      any_cells_(!cells.empty()),
      h_(scene.coupling.solid_every),
      scheme_(scene.coupling.scheme),
      one_theta_(scene.coupling.theta_n == scene.coupling.theta_t),
      velocity_(block_.size()),
      force_(block_.size()),
      handing_over_(decomposition_, Topic::cells) {
  for (const std::string& problem : coupling_problems(scene)) throw InputError(problem);
  require(
      scheme_ == Scheme::conservative || this->ranks().count() == 1,
      "coupling.scheme paper and peskin run on one rank (they read fields of the whole box) use one rank, "
      "or conservative");
  build_groups(cells);
  find_loads(cells);
  build_coupling();
  start_flow();
}

template <class Real>
void Simulation<Real>::start_flow() {
  if (region_.has_solid()) {
    const int first = decomposition_.first_plane();
    fluid_.set_solid([&](int i, int j, int k) { return region_.solid(i, j, first + k); });
    for (int k = 0; k < block_.nz; ++k)
      for (int j = 0; j < block_.ny; ++j)
        for (int i = 0; i < block_.nx; ++i)
          if (fluid_.is_solid(i, j, k)) solid_nodes_.push_back(block_.at(i, j, k));
  }
  fluid_.initialise([&](double x, double y, double) {
    return lbm::FlowPoint{1, {0, 0, steady_velocity(scene_, units_, x, y)}};
  });
  fluid_.moments(velocity_.view());
  fill_halo(velocity_.view());  // no force yet: u* is what markers read
}

template <class Real>
lbm::Vec3 Simulation<Real>::half_body_force() const {
  const auto& g = fluid_.parameters().body_force;
  return {g[0] / 2, g[1] / 2, g[2] / 2};
}

/// x^n of every vertex, relative to a lattice node near its cell, and the point where it touches the fluid:
/// drawn back along the normal by `retraction`, which cancels the hydrodynamic thickness of a smeared sheet
/// (platelets: to a smaller spheroid).
template <class Real>
void Simulation<Real>::read_positions() {
  const Real delta = static_cast<Real>(scene_.coupling.retraction);
  const std::array<int, 3> n{block_.nx, block_.ny, block_.nz};
  const std::array<bool, 2> periodic{faces_.periodic_x, faces_.periodic_y};
  const bool divided = decomposition_.divided();
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
                if (d == 2) {
                  node = decomposition_.localise(node);
                } else if (periodic[d]) {
                  node -= std::floor(node / n[d]) * n[d];
                }
                origin_[group.first_body + b * lanes + l][d] =
                    std::isfinite(node) ? static_cast<std::int32_t>(std::clamp(node, -1e6, 1e6)) : 0;
              }
            const std::size_t slot = group.first_marker + static_cast<std::size_t>(b) * vertices * lanes;
            const MirrorSurface& surface = group.surface;
            const auto at_lanes = [&](int k) {
              return all_lanes<lanes>(offsets + (static_cast<std::size_t>(b) * vertices) * 3 * lanes, k);
            };
            Vector<Pack<Real, lanes>> middle{};
            if (!surface.mirror.empty()) middle = mean_of<lanes, Real>(vertices, at_lanes);
            alignas(64) Real low[lanes], high[lanes];
            std::fill(low, low + lanes, std::numeric_limits<Real>::max());
            std::fill(high, high + lanes, std::numeric_limits<Real>::lowest());
            for (int k = 0; k < vertices; ++k) {
              const std::size_t at = (static_cast<std::size_t>(b) * vertices + k) * 3 * lanes;
              const Real *x = offsets + at, *normal = normals + at;
              alignas(64) Real back[3 * lanes];
              if (!surface.mirror.empty())
                set_lanes<lanes, Real>(drawn_in(Pack<Real, lanes>(static_cast<Real>(surface.axial / 2)),
                                                Pack<Real, lanes>(static_cast<Real>(surface.radial / 2)),
                                                at_lanes(k), at_lanes(surface.mirror[k]), middle),
                                       back, 0);
              else
                for (int i = 0; i < 3 * lanes; ++i) back[i] = delta * normal[i];
              Node4<Real>*vertex = vertices_.data() + slot + k * lanes,
              *site = sites_.data() + slot + k * lanes;
              for (int l = 0; l < lanes; ++l) {
                const Real px = fraction[0][l] + x[l], py = fraction[1][l] + x[lanes + l],
                           pz = fraction[2][l] + x[2 * lanes + l];
                vertex[l] = {px, py, pz, Real(0)};
                if constexpr (requires { g.held(); }) {
                  const Real* r = g.held().data + at;
                  site[l] = {fraction[0][l] + r[l], fraction[1][l] + r[lanes + l],
                             fraction[2][l] + r[2 * lanes + l], Real(0)};
                } else {
                  site[l] = {px - back[l], py - back[lanes + l], pz - back[2 * lanes + l], Real(0)};
                }
                low[l] = std::min(low[l], std::min(pz, site[l].z));
                high[l] = std::max(high[l], std::max(pz, site[l].z));
              }
            }
            for (int l = 0; divided && l < std::min(lanes, count - b * lanes); ++l) {
              const auto body = static_cast<std::size_t>(group.first_body + b * lanes + l);
              extent_[body] = {origin_[body][2] + double(low[l]), origin_[body][2] + double(high[l])};
            }
          }
        },
        group.cells);
}

template <class Real>
void Simulation<Real>::check_finite(const Group<Real>& group, const mesh::StepReport& report) const {
  if (report.bad_cell < 0) return;
  const auto id = std::visit([&](const auto& g) { return g.id(report.bad_cell); }, group.cells);
  throw PhysicsError("cell " + std::to_string(id) + " (" + scene_.cells.kinds[group.kind].name +
                     ") is no longer finite at step " + std::to_string(fluid_steps_) +
                     " (blow-up) lower the acceleration or raise coupling.iterations");
}

template <class Real>
void Simulation<Real>::move_cells() {
  mesh::StepOptions options;
  options.iterations = scene_.coupling.iterations;
  if (scheme_ == Scheme::paper && scene_.coupling.velocity_cap)
    options.velocity_cap = *scene_.coupling.velocity_cap;
  options.runge_kutta = scene_.coupling.integrator == data::Coupling::Integrator::runge_kutta;
  solid_report_ = {};
  const auto reports = solid_.step ? solid_.step(options) : std::vector<mesh::StepReport>{};
  for (auto& group : groups_) {
    const auto report = solid_.step ? reports[static_cast<std::size_t>(&group - groups_.data())]
                                    : std::visit([&](auto& g) { return g.step(options); }, group.cells);
    check_finite(moved()[static_cast<std::size_t>(&group - groups_.data())], report);
    solid_report_.increment = std::max(solid_report_.increment, report.increment);
  }
}

template <class Real>
void Simulation<Real>::check_lengths(View<const Extent> extents) const {
  for (const auto& group : groups_)
    for (int c = 0; c < group.count() && decomposition_.divided(); ++c) {
      const Extent& e = extents[group.first_body + c];
      if (e.high - e.low < decomposition_.whole().nz) continue;
      const auto id = std::visit([&](const auto& g) { return g.id(c); }, group.cells);
      throw PhysicsError("cell " + std::to_string(id) + " (" + scene_.cells.kinds[group.kind].name +
                         ") is longer than the box at step " + std::to_string(fluid_steps_) +
                         " (blow-up) lower the acceleration or raise coupling.iterations");
    }
}

/// Positions of the own cells to the neighbours, theirs to here; markers and bodies anew where the lists
/// changed.
template <class Real>
void Simulation<Real>::share_positions() {
  check_lengths(std::as_const(extent_).view());
  const auto change =
      copies_->exchange({extent_.data(), bodies_}, origin_.view(), vertices_.view(), sites_.view());
  if (change.markers) {
    fit_arrays();
    markers_->assign(copies_->body_of());
  }
  if (change.bodies) set_contact_bodies();
  copies_->place(origin_.view(), vertices_.view(), sites_.view());
}

template <class Real>
void Simulation<Real>::set_contact_bodies() {
  if (contact_) contact_->set_bodies(copies_->bodies());
  if (paper_ && paper_->contact) paper_->contact->set_bodies(copies_->bodies());
}

/// Readings of a field at all own markers, wherever they lie.
template <class Real>
void Simulation<Real>::read_field(View<const Node4<Real>> field, View<Node4<Real>> reading) {
  markers_->interpolate(field, reading);
  Stopwatch watch(timings_.communication);
  copies_->send_readings(reading);
  copies_->receive_readings(reading);
}

/// Contact and point loads.
template <class Real>
void Simulation<Real>::press() {
  if (contact_) {
    contact_summary_ = contact_->compute(origin_.view(), vertices_.view(), contact_force_.view());
  } else if (paper_ && paper_->contact) {
    contact_summary_ = paper_->contact->compute(origin_.view(), vertices_.view(), paper_->normal.view(),
                                                contact_force_.view());
  } else if (!loads_.empty()) {
    std::memset(static_cast<void*>(contact_force_.data()), 0, contact_force_.size() * sizeof(Node4<Real>));
  }
  for (const auto& load : loads_) {
    if (load.slot < 0) continue;
    auto& f = contact_force_[load.slot];
    f.x += static_cast<Real>(load.force[0]), f.y += static_cast<Real>(load.force[1]),
        f.z += static_cast<Real>(load.force[2]);
    for (int d = 0; d < 3; ++d) taken_.from_loads[d] += h_ * load.force[d];
  }
}

/// Impulses of all markers that lie here, and of what falls into halo and walls; walls and static solid take
/// their shares in so many fluid \p steps.
template <class Real>
void Simulation<Real>::spread(double steps) {
  {
    Stopwatch watch(timings_.spreading);
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(force_.size()); ++i) force_[i] = {0, 0, 0, 0};
  }
  {
    Stopwatch watch(timings_.communication);
    copies_->receive_impulses(impulse_.view());
  }
  {
    Stopwatch watch(timings_.spreading);
    markers_->spread(impulse_.view(), force_.view());
  }
  {
    Stopwatch watch(timings_.communication);
    fields_.fold(force_.view());
  }
  Stopwatch watch(timings_.spreading);
  force_on_walls_ = ibm::fold_force_halo(block_, faces_, force_.view());
  take_force_from_solid(steps);
  force_on_walls_[0] += contact_summary_.wall_force[0], force_on_walls_[1] += contact_summary_.wall_force[1];
  for (int d = 0; d < 3; ++d) {
    taken_.to_lower_wall[d] += steps * force_on_walls_[0][d];
    taken_.to_upper_wall[d] += steps * force_on_walls_[1][d];
  }
}

/// What was spread on static solid is the solid's impulse, and no force on the fluid: the adjoint of reading
/// zero velocity there.
template <class Real>
void Simulation<Real>::take_force_from_solid(double steps) {
  for (const std::size_t n : solid_nodes_) {
    Node4<Real>& f = force_[n];
    taken_.to_solid[0] += steps * f.x, taken_.to_solid[1] += steps * f.y, taken_.to_solid[2] += steps * f.z;
    f = {0, 0, 0, 0};
  }
}

/// Where all cells and markers are.
template <class Real>
void Simulation<Real>::find_cells() {
  {
    Stopwatch watch(timings_.communication);
    hand_over(*copies_);
  }
  {
    Stopwatch watch(timings_.interpolation);
    read_positions();
  }
  {
    Stopwatch watch(timings_.communication);
    share_positions();
  }
  Stopwatch watch(timings_.interpolation);
  markers_->locate(origin_.view(), sites_.view());
}

template <class Real>
void Simulation<Real>::stream_and_collide(Real force_share) {
  const View<const Node4<Real>> force = present_force();
  {
    Stopwatch watch(timings_.fluid);
    fluid_.begin_advance(force, velocity_.view(), force_share);
  }
  {
    Stopwatch watch(timings_.communication);
    fields_.stream(fluid_);
  }
  Stopwatch watch(timings_.fluid);
  fluid_.end_advance(force, velocity_.view(), force_share);
  const auto impulse = fluid_.wall_impulse();
  taken_.to_lower_wall += impulse.lower, taken_.to_upper_wall += impulse.upper;
  taken_.to_solid += impulse.solid;
  for (int d = 0; d < 3; ++d)
    taken_.from_body_force[d] +=
        fluid_.parameters().body_force[d] * static_cast<double>(fluid_.fluid_nodes());
}

/// One fluid step with the present force; velocities of the new state for interpolation.
template <class Real>
void Simulation<Real>::advance_fluid(Real force_share) {
  if (fluid_step_)
    fluid_step_(present_force(), velocity_.view(), force_share);
  else
    stream_and_collide(force_share);
  fill_halo(velocity_.view());
}

/// The halo of a velocity field: images, walls, other ranks.
template <class Real>
void Simulation<Real>::fill_halo(View<Node4<Real>> velocity) {
  {
    Stopwatch watch(timings_.fluid);
    ibm::fill_velocity_halo(block_, faces_, velocity);
  }
  Stopwatch watch(timings_.communication);
  fields_.fill(velocity);
}

template <class Real>
void Simulation<Real>::step(EnergyBudget* budget) {
  const double start = omp_get_wtime(), before = timings_.accounted();
  if (scheme_ != Scheme::conservative) budget = nullptr;  // the others are not booked
  if (budget) open_budget(*budget);
  if (any_cells_) {
    find_cells();
    switch (scheme_) {
      case Scheme::conservative:
        couple_conservative();
        break;
      case Scheme::paper:
        couple_paper();
        break;
      case Scheme::peskin:
        couple_peskin();
        break;
    }
  }
  for (int k = 0; k < scene_.coupling.solid_every; ++k) {
    if (any_cells_ && scheme_ == Scheme::paper) drive_fluid(k);  // its force is renewed in every fluid step
    if (budget) count_fluid(*budget, present_force(), k == 0);
    advance_fluid(k + 1 == scene_.coupling.solid_every ? velocity_share() : Real(0));
  }
  if (budget) close_budget(*budget);
  fluid_steps_ += scene_.coupling.solid_every;
  timings_.steps += scene_.coupling.solid_every;
  timings_.other += omp_get_wtime() - start - (timings_.accounted() - before);
}

std::array<double, 3> Momentum::total() const {
  std::array<double, 3> sum{};
  for (int d = 0; d < 3; ++d)
    sum[d] = fluid[d] + cells[d] + to_lower_wall[d] + to_upper_wall[d] + to_solid[d] - from_body_force[d] -
             from_loads[d];
  return sum;
}

double Momentum::scale() const {
  double sum = 0;
  for (const auto* part : {&to_lower_wall, &to_upper_wall, &to_solid, &from_body_force, &from_loads, &fluid})
    for (const double component : *part) sum += std::abs(component);
  return sum;
}

template <class Real>
Momentum Simulation<Real>::momentum() const {
  static_assert(sizeof(Momentum) == 21 * sizeof(double));
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
  ranks().sum({m.fluid.data(), sizeof(Momentum) / sizeof(double)});
  return m;
}

template <class Real>
lbm::Totals Simulation<Real>::totals() const {
  lbm::Totals t = fluid_.totals();
  double sums[4] = {t.mass, t.momentum[0], t.momentum[1], t.momentum[2]};
  ranks().sum({sums, 4});
  return {sums[0], {sums[1], sums[2], sums[3]}};
}

template <class Real>
double Simulation<Real>::slip_rms() {
  if (!any_cells_) return 0;
  // Where the whole step is elsewhere the markers here do not follow the cells.
  if (scene_.place.fluid == Place::device) return std::numeric_limits<double>::quiet_NaN();
  // Of the coupling points against u = u* + F/2 there; velocity_ holds u* + theta/2 F.
  Array<Node4<Real>> u(copies_->slots()), f(copies_->slots());
  read_field(velocity_.view(), u.view());
  Array<Node4<Real>> field(force_.size());
  std::memcpy(static_cast<void*>(field.data()), force_.data(), force_.size() * sizeof(Node4<Real>));
  ibm::fill_velocity_halo(block_, {true, faces_.periodic_y, faces_.periodic_z, {}, {}}, field.view());
  fields_.fill(field.view());
  read_field(field.view(), f.view());
  const double rest = 0.5 - static_cast<double>(velocity_share());
  const auto gravity = half_body_force();
  double sums[2] = {0, 0};  // of squares, of markers
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto v = g.velocities();
          const auto layout = g.layout();
          for (int c = 0; c < g.count(); ++c)
            for (int k = 0; k < g.vertices(); ++k) {
              ++sums[1];
              const auto m = group.marker(c, k);
              const double uk[3] = {u[m].x + rest * f[m].x, u[m].y + rest * f[m].y, u[m].z + rest * f[m].z};
              for (int d = 0; d < 3; ++d) {
                const double site =
                    v[layout.at(c, k, d)] -
                    normal_rate_[3 * static_cast<std::size_t>(group.first_marker) + layout.at(c, k, d)];
                const double slip = site - uk[d] - gravity[d];
                sums[0] += slip * slip;
              }
            }
        },
        group.cells);
  ranks().sum({sums, 2});
  return std::sqrt(sums[0] / sums[1]);
}

template <class Real>
std::size_t Simulation<Real>::bytes_per_step() const {
  if (!decomposition_.divided()) return 0;
  const std::size_t planes =
      any_cells_ ? 2 * FieldExchange<Real>::planes_sent : FieldExchange<Real>::planes_sent;
  return copies_->bytes_per_step() + planes * block_.plane() * sizeof(Node4<Real>) +
         2 * scene_.coupling.solid_every * fluid_.border_size() * sizeof(Real);
}

template <class Real>
std::size_t Simulation<Real>::memory_bytes() const {
  return fluid_.memory_bytes() +
         (velocity_.size() + force_.size() + 5 * vertices_.size() + force_reading_.size()) *
             sizeof(Node4<Real>) +
         copies_->memory_bytes();
}

template class Simulation<float>;
template class Simulation<double>;

}  // namespace hemowalk::resolved
