#pragma once
/// \file Experiments with one or two deformable cells in the resolved solver: scenes and measured figures.

#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "resolved/build.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/recovery.hpp"
#include "resolved/simulation.hpp"
#include "support/single_body.hpp"

namespace hemowalk::test {

inline data::Kind red_cell_kind(double kappa) {
  data::Kind k;
  k.name = "rbc", k.kappa_damping = kappa;
  return k;
}
inline data::Kind platelet_kind() {
  data::Kind k;
  k.name = "platelet", k.shape.type = data::Shape::Type::platelet, k.subdivision = 4;
  k.law = data::Kind::Law::rigid;
  return k;
}

/// The published coupling and its contact as a scene file sets them by `scheme: paper`, `model:
/// particle_in_kernel`.
inline void use_paper_coupling(data::Scene& scene) {
  data::Coupling& c = scene.coupling;
  c.scheme = data::Coupling::Scheme::paper, c.kernel = data::Coupling::Kernel::phi4, c.retraction = 0,
  c.solid_every = 2, c.iterations = 4;
  c.velocity_cap = 0.03, c.median_filter = true;
  scene.contact.model = data::Contact::Model::particle_in_kernel, scene.contact.range = 1e-6;
}

/// Couette flow at 100 1/s between walls that move at +-U/2; box in um (x, y, z).
inline data::Scene shear_scene(const data::Vec3& box, double acceleration, std::vector<data::Kind> kinds) {
  data::Scene scene;
  for (int d = 0; d < 3; ++d) scene.domain.size[d] = 1e-6 * box[d];
  scene.flow.walls = data::Flow::Walls::both;
  scene.acceleration = acceleration;
  scene.cells.kinds = std::move(kinds);
  return scene;
}

inline mesh::Observables observe(const resolved::Simulation<float>& sim, int group, int cell) {
  return std::visit([&](const auto& g) { return g.observe(cell); }, sim.groups()[group].cells);
}

struct Shear {
  double strain = 0;                        ///< over which all of the following are taken
  double deformation = 0, inclination = 0;  ///< means
  double marker_turn = 0;                   ///< |angle| the material marker went round the centre, rad
  double axis_turn = 0;                     ///< |angle| the material's axis turned in the shear plane, rad
  double shape_turn = 0;                    ///< |angle| the shape's long axis turned there, rad: tumbling
  double volume = 1;                        ///< at the end over the start

  double marker_frequency() const { return marker_turn / (2 * M_PI * strain); }  ///< over the shear rate
  double shape_frequency() const { return shape_turn / (2 * M_PI * strain); }    ///< over the shear rate
};

/// Follows a cell through a shear flow from the strain \p from on: until the marker has gone half way round
/// and the cell, symmetric as it is, looks as it did (it hurries and lingers in between, so that no other
/// interval gives its frequency), or to the strain \p until.
class ShearRecord {
 public:
  ShearRecord(const mesh::Observables& start, double from, double until)
      : last_(start), volume_(start.volume), from_(from), until_(until) {}

  void add(double strain, const mesh::Observables& o) {
    const auto axis = [](const mesh::Observables& at) { return std::atan2(at.axis[1], at.axis[2]); };
    if (strain > from_ && !done()) {
      const double turn = std::remainder(o.tank_treading_angle - last_.tank_treading_angle, 2 * M_PI),
                   left = M_PI - std::abs(turned_),
                   share = std::min(1.0, left / std::max(std::abs(turn), 1e-9));
      turned_ += share * turn;
      tumbled_ += share * std::remainder(axis(o) - axis(last_), 2 * M_PI);
      leant_ += share * std::remainder(o.inclination - last_.inclination, M_PI);
      deformation_ += o.taylor_deformation, inclination_ += o.inclination, samples_ += 1;
      end_ = strain - (1 - share) * (strain - before_);
    }
    last_ = o, before_ = strain;
  }
  /// Nothing more will be counted.
  bool done() const { return before_ >= until_ || std::abs(turned_) > (1 - 1e-9) * M_PI; }
  Shear result() const {
    return {end_ - from_,       deformation_ / samples_, inclination_ / samples_, std::abs(turned_),
            std::abs(tumbled_), std::abs(leant_),        last_.volume / volume_};
  }

 private:
  mesh::Observables last_;
  double volume_, from_, until_;
  double before_ = 0, end_ = 0, turned_ = 0, tumbled_ = 0, leant_ = 0, deformation_ = 0, inclination_ = 0,
         samples_ = 0;
};
constexpr double between_looks = 0.025;  ///< strain

/// One red cell, its axis turned by \p angle out of the gradient direction; what ShearRecord sees.
struct ShearCase {
  double kappa = 0, angle = 0.5, shear_rate = 100, acceleration = 50;
  double from = 10, until = 60;  ///< strains
  mesh::Vec3 shift{};            ///< from the middle of the box, dx
  data::Coupling coupling;
  double dx = 0.5;             ///< um
  data::Vec3 box{14, 16, 14};  ///< um
};

/// Of a red cell's mesh that follows the lattice: 258, 578, 1026 vertices at dx 0.5, 1/3, 0.25 um.
inline int subdivision_at(double dx) { return static_cast<int>(std::lround(4 / dx)); }

inline Shear red_cell_in_shear(const ShearCase& c) {
  auto kind = red_cell_kind(c.kappa);
  kind.subdivision = subdivision_at(c.dx);
  auto scene = shear_scene(c.box, c.acceleration, {kind});
  scene.fluid.dx = 1e-6 * c.dx;
  scene.flow.shear_rate = c.shear_rate, scene.coupling = c.coupling;
  mesh::Vec3 middle{};
  for (int d = 0; d < 3; ++d) middle[d] = c.box[d] / 2 / c.dx + c.shift[d];
  resolved::Simulation<float> sim(scene, {{0, middle, mesh::rotation({1, 0, 0}, c.angle), {}}});
  const double rate = sim.units().rate(c.shear_rate);
  const int every = std::max(1, static_cast<int>(between_looks / rate));
  ShearRecord record(observe(sim, 0, 0), c.from, c.until);
  for (int i = 1; !record.done(); ++i) {
    sim.step();
    if (i % every == 0) record.add(i * rate, observe(sim, 0, 0));
  }
  return record.result();
}

/// Two bodies, the first and the last of \p kinds, that pass each other: they start apart_before um from each
/// other along the flow and offset um across it.
struct CollisionCase {
  std::vector<data::Kind> kinds;
  double acceleration = 50, offset = 2.5;                          ///< um
  double dx = 0.5;                                                 ///< um; meshes follow it
  double wider = 1;                                                ///< the box over the usual one
  std::function<void(data::Scene&)> change = [](data::Scene&) {};  ///< what else is different
};
constexpr double apart_before = 11;              ///< um
constexpr data::Vec3 collision_box{14, 18, 36};  ///< um; images along the flow are farther than the partner

struct Collision {
  double net = 0;   ///< um across the flow that each was moved by for good
  double peak = 0;  ///< um, the most in between
  std::vector<double> along,
      across;  ///< um: distance along the flow, by how much each has been moved by then

  void add(double distance, double moved) {
    along.push_back(distance), across.push_back(moved);
    net = moved, peak = std::max(peak, moved);
  }
};

/// The run ends when they are as far apart on the other side as at the start; NaN if that takes a strain
/// of 40.
inline Collision collide(const CollisionCase& c) {
  data::Vec3 box = collision_box;
  for (double& length : box) length *= c.wider;
  auto kinds = c.kinds;
  for (auto& k : kinds) k.subdivision = static_cast<int>(std::lround(k.subdivision * 0.5 / c.dx));
  const int last = static_cast<int>(kinds.size()) - 1;
  auto scene = shear_scene(box, c.acceleration, std::move(kinds));
  scene.fluid.dx = 1e-6 * c.dx;
  c.change(scene);
  const double half = c.offset / 2 / c.dx, away = apart_before / 2 / c.dx;
  const double x = box[0] / 2 / c.dx, y = box[1] / 2 / c.dx, z = box[2] / 2 / c.dx;
  resolved::Simulation<float> sim(scene, {{0, {x, y + half, z - away}, mesh::identity_rotation, {}},
                                          {last, {x, y - half, z + away}, mesh::identity_rotation, {}}});
  const double rate = sim.units().rate(100);
  const auto second = [&] { return last ? observe(sim, 1, 0) : observe(sim, 0, 1); };
  const double start = observe(sim, 0, 0).centre[1] - second().centre[1];
  Collision out;
  for (int i = 1; i < 40 / rate; ++i) {
    sim.step();
    if (i % 50) continue;
    const auto a = observe(sim, 0, 0).centre, b = second().centre;
    out.add(c.dx * (a[2] - b[2]), c.dx / 2 * (a[1] - b[1] - start));  // half of it each
    if (a[2] - b[2] > 2 * away) return out;
  }
  out.net = out.peak = std::nan("");
  return out;
}

/// How far, um, the upper of two red cells (kappa 0.5, dx 0.5 um) that collide as above moves across the flow
/// where there is no other: tumbling and lift off the walls, over the time in which undisturbed they would
/// pass.
inline double drift_alone(double acceleration, double offset) {
  const auto scene = shear_scene(collision_box, acceleration, {red_cell_kind(0.5)});
  resolved::Simulation<float> sim(scene,
                                  {{0, {14, 18 + offset, 36 - apart_before}, mesh::identity_rotation, {}}});
  const double start = observe(sim, 0, 0).centre[1];
  const auto steps = static_cast<std::int64_t>(2 * apart_before / offset / sim.units().rate(100));
  for (std::int64_t i = 0; i < steps; ++i) sim.step();
  return 0.5 * (observe(sim, 0, 0).centre[1] - start);
}

/// What is left of the displacements \p imposed on the vertices of a cell at \p rest: their projection.
inline double share_left(const std::vector<mesh::Vec3>& now, const std::vector<mesh::Vec3>& rest,
                         const std::vector<mesh::Vec3>& imposed) {
  mesh::Vec3 centre{};
  for (const auto& p : now)
    for (int d = 0; d < 3; ++d) centre[d] += p[d] / static_cast<double>(now.size());
  double sum = 0, square = 0;
  for (std::size_t k = 0; k < now.size(); ++k)
    for (int d = 0; d < 3; ++d) {
      const double u = imposed[k][d];
      sum += (now[k][d] - centre[d] - rest[k][d]) * u, square += u * u;
    }
  return sum / square;
}

/// How a red cell lying any way comes back, s: stretched by \p strain along its own x axis and released in
/// fluid at rest; time constant of the displacement imposed from 80 to 40 % of it (the program's t_c is the
/// 1/e time of the length, below). Periodic \p box, um; looks \p every so many steps.
inline double return_time(double kappa, double acceleration, const mesh::Quaternion& orientation, double box,
                          int every, double dx = 0.5, double strain = 0.1,
                          const data::Coupling& coupling = {}) {
  const double middle = box / 2 / dx;
  auto kind = red_cell_kind(kappa);
  kind.subdivision = subdivision_at(dx);
  auto scene = shear_scene({box, box, box}, acceleration, {kind});
  scene.fluid.dx = 1e-6 * dx;
  scene.domain.geometry = data::Domain::Geometry::periodic, scene.flow.type = data::Flow::Type::rest;
  scene.coupling = coupling;
  auto rest = resolved::make_mesh(scene.cells.kinds[0], scene.fluid.dx).vertices;
  auto x = rest, imposed = rest;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const mesh::Vec3 p = rest[k];
    imposed[k] = mesh::rotate(orientation, {p[0] * strain, 0, p[2] / (1 + strain) - p[2]});
    rest[k] = mesh::rotate(orientation, p);
    for (int d = 0; d < 3; ++d) x[k][d] = middle + rest[k][d] + imposed[k][d];
  }
  resolved::Simulation<float> sim(scene, {{0, {middle, middle, middle}, orientation, x}});
  const auto& cells = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
  double early = 0;
  while (sim.time() < 2) {
    for (int i = 0; i < every; ++i) sim.step();
    const double left = share_left(cells.positions(0), rest, imposed);
    if (early == 0 && left < 0.8) early = sim.time();
    if (left < 0.4) return (sim.time() - early) / std::log(2.0);
  }
  return std::nan("");
}

/// Speed along the force, over force/(viscosity dx), of a cell that is pulled along its axis, which points
/// along \p axis, in a periodic box of plasma at rest (um); relative to the mean flow. dx = 0.5 um.
inline double settled_speed(const data::Kind& kind, double box, const mesh::Vec3& axis,
                            const mesh::Vec3& shift = {}) {
  auto scene = shear_scene({box, box, box}, 5, {kind});
  scene.domain.geometry = data::Domain::Geometry::periodic, scene.flow.type = data::Flow::Type::rest;
  const auto along = mesh::scale(1 / mesh::norm(axis), axis);
  const double pull = 0.2e-12;
  data::Vec3 force{};
  for (int d = 0; d < 3; ++d) force[d] = pull * along[d];
  scene.cells.loads = {{0, "+x", 1.0, force}};
  // The axis of the rest shape is y.
  const auto turn = mesh::cross({0, 1, 0}, along);
  const double sine = mesh::norm(turn), angle = std::atan2(sine, along[1]);
  const auto q = sine > 0 ? mesh::rotation(turn, angle) : mesh::identity_rotation;
  resolved::Simulation<double> sim(scene, {{0, {box + shift[0], box + shift[1], box + shift[2]}, q, {}}});
  const double n = sim.block().nx;
  for (int i = 0; i < settling_steps(n); ++i) sim.step();
  const resolved::Momentum m = sim.momentum();
  double speed = 0;
  for (int d = 0; d < 3; ++d)
    speed += along[d] * (mean_velocity(sim, d) - (m.fluid[d] + m.cells[d]) / (n * n * n));
  return speed * sim.fluid().viscosity() / sim.units().force(pull);
}

/// The program's t_c (resolved/recovery.hpp) of a red cell, s.
inline double recovery_time(double kappa, double acceleration) {
  return resolved::recovery_time(shear_scene({20, 20, 20}, 1, {red_cell_kind(kappa)}), acceleration);
}

}  // namespace hemowalk::test
