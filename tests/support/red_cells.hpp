#pragma once
/// \file Experiments with one or two deformable cells in the resolved solver: scenes and measured figures.

#include <cmath>
#include <cstdio>
#include <vector>

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
  double deformation = 0, inclination = 0;  ///< means over the second half of the run
  double marker_turn = 0;                   ///< |angle| the material marker went round the centre, rad
  double axis_turn = 0;                     ///< |angle| the symmetry axis turned in the shear plane, rad
  double volume = 1;                        ///< at the end over the start
  mesh::Vec3 centre{};                      ///< at the end, dx
};

/// One red cell, its axis turned by \p angle out of the gradient direction, for a strain of \p strain.
inline Shear red_cell_in_shear(double acceleration, double kappa, double strain, const mesh::Vec3& shift,
                               double angle = 0.5) {
  const auto scene = shear_scene({14, 16, 14}, acceleration, {red_cell_kind(kappa)});
  resolved::Simulation<float> sim(
      scene, {{0, {14 + shift[0], 16 + shift[1], 14 + shift[2]}, mesh::rotation({1, 0, 0}, angle), {}}});
  const double rate = sim.units().rate(100);
  const int steps = static_cast<int>(strain / rate), every = std::max(1, steps / 400);
  const auto unwrapped = [](double now, double before) { return std::remainder(now - before, 2 * M_PI); };
  mesh::Observables o = observe(sim, 0, 0);
  const double volume = o.volume;
  double marker = o.tank_treading_angle, axis = std::atan2(o.axis[1], o.axis[2]), samples = 0;
  double turned = 0, tumbled = 0;
  Shear out;
  for (int i = 1; i <= steps; ++i) {
    sim.step();
    if (i % every) continue;
    o = observe(sim, 0, 0);
    turned += unwrapped(o.tank_treading_angle, marker), marker = o.tank_treading_angle;
    const double now = std::atan2(o.axis[1], o.axis[2]);
    tumbled += unwrapped(now, axis), axis = now;
    if (2 * i > steps)
      out.deformation += o.taylor_deformation, out.inclination += o.inclination, samples += 1;
  }
  out.deformation /= samples, out.inclination /= samples;
  out.marker_turn = std::abs(turned), out.axis_turn = std::abs(tumbled);
  out.volume = o.volume / volume, out.centre = o.centre;
  return out;
}

/// Two bodies that pass each other: net separation across the flow after the encounter minus before, um.
/// They start 11 um apart along the flow and \p offset um across it, and the run ends when they are as far
/// apart on the other side.
inline double net_displacement(double acceleration, bool with_platelet, double offset, double kappa = 0.5) {
  const data::Vec3 box{14, 18, 36};  // images along the flow stay farther away than the partner
  std::vector<data::Kind> kinds{red_cell_kind(kappa)};
  if (with_platelet) kinds.push_back(platelet_kind());
  auto scene = shear_scene(box, acceleration, kinds);
  const double half = offset / 2 / 0.5, apart = 11.0 / 2 / 0.5;  // dx
  resolved::Simulation<float> sim(
      scene, {{0, {14, 18 + half, 36 - apart}, mesh::identity_rotation, {}},
              {with_platelet ? 1 : 0, {14, 18 - half, 36 + apart}, mesh::identity_rotation, {}}});
  const double rate = sim.units().rate(100);
  const auto second = [&] { return with_platelet ? observe(sim, 1, 0) : observe(sim, 0, 1); };
  const double start = observe(sim, 0, 0).centre[1] - second().centre[1];
  for (int i = 1; i < 40 / rate; ++i) {
    sim.step();
    if (i % 50) continue;
    const auto a = observe(sim, 0, 0).centre, b = second().centre;
    if (a[2] - b[2] > 2 * apart) return 0.5 * (a[1] - b[1] - start);
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
  const auto& cells = std::get<npfem::Membranes<double>>(sim.groups()[0].cells);
  double speed = 0;
  for (int d = 0; d < 3; ++d) {
    double mean = 0;
    for (int k = 0; k < cells.vertices(); ++k) mean += cells.velocities()[cells.layout().at(0, k, d)];
    speed += along[d] * (mean / cells.vertices() - (m.fluid[d] + m.cells[d]) / (n * n * n));
  }
  return speed * sim.fluid().viscosity() / sim.units().force(pull);
}

/// The program's t_c (resolved/recovery.hpp) of a red cell, s.
inline double recovery_time(double kappa, double acceleration) {
  return resolved::recovery_time(shear_scene({20, 20, 20}, 1, {red_cell_kind(kappa)}), acceleration);
}

}  // namespace hemowalk::test
