#pragma once
/// \file One rigid body in a box: what the fluid makes of its size, and the exact figures to compare with.

#include <cmath>

#include "resolved/simulation.hpp"

namespace hemowalk::test {

inline data::Kind rigid_kind() {
  data::Kind kind;
  kind.law = data::Kind::Law::rigid;
  return kind;
}

/// A body in the middle of a cubic box; lengths in um.
struct BodyCase {
  data::Shape shape;
  data::Kind material = rigid_kind();  ///< law and moduli
  int subdivision = 4;
  double box = 12, dx = 0.5;
  data::Coupling coupling;
  double acceleration = 5;  ///< small: the body hardly turns while the flow settles
  mesh::Vec3 offset{};      ///< of the centre from the middle of the box, dx
  mesh::Quaternion orientation = mesh::identity_rotation;
};

inline data::Shape sphere_shape(double radius) {
  data::Shape shape;
  shape.type = data::Shape::Type::sphere, shape.radii = {1e-6 * radius, 1e-6 * radius, 1e-6 * radius};
  return shape;
}
inline data::Shape platelet_shape() {
  data::Shape shape;
  shape.type = data::Shape::Type::platelet;
  return shape;
}

inline data::Scene scene_of(const BodyCase& c) {
  data::Scene scene;
  scene.fluid.dx = 1e-6 * c.dx;
  const double box = std::lround(c.box / c.dx) * scene.fluid.dx;
  scene.domain.size = {box, box, box};
  scene.coupling = c.coupling;
  scene.acceleration = c.acceleration;
  scene.flow.walls = data::Flow::Walls::both;
  data::Kind kind = c.material;
  kind.name = "body", kind.shape = c.shape, kind.subdivision = c.subdivision;
  kind.density = scene.fluid.density;
  scene.cells.kinds = {kind};
  return scene;
}

inline resolved::InitialCell body_of(const BodyCase& c) {
  const double middle = std::lround(c.box / c.dx) / 2.0;
  return {0, {middle + c.offset[0], middle + c.offset[1], middle + c.offset[2]}, c.orientation, {}};
}

/// Steps until the flow round a body in a box of n nodes is steady: exp(-8) of its slowest odd mode is left.
inline int settling_steps(double nodes, double tau = 2) {
  return static_cast<int>(8 * nodes * nodes / ((tau - 0.5) / 3 * 4 * M_PI * M_PI));
}

/// About x, of the points of the only cell of \p sim, which x is a principal axis of.
inline double spin(const resolved::Simulation<double>& sim) {
  return std::visit(
      [&](const auto& cells) {
        if constexpr (requires { cells.angular_velocity(0); }) {
          return cells.angular_velocity(0)[0];
        } else {
          const auto x = cells.positions(0);
          const auto v = [&](int k, int d) { return cells.velocities()[cells.layout().at(0, k, d)]; };
          mesh::Vec3 centre{}, drift{};
          for (int k = 0; k < cells.vertices(); ++k)
            for (int d = 0; d < 3; ++d)
              centre[d] += x[k][d] / cells.vertices(), drift[d] += v(k, d) / cells.vertices();
          double turn = 0, inertia = 0;
          for (int k = 0; k < cells.vertices(); ++k) {
            const double y = x[k][1] - centre[1], z = x[k][2] - centre[2];
            turn += y * (v(k, 2) - drift[2]) - z * (v(k, 1) - drift[1]), inertia += y * y + z * z;
          }
          return turn / inertia;
        }
      },
      sim.groups()[0].cells);
}

/// Angular velocity over shear rate of a free body between walls that move at +-U/2, as it lies.
inline double rotation_rate(const BodyCase& c) {
  const data::Scene scene = scene_of(c);
  resolved::Simulation<double> sim(scene, {body_of(c)});
  const int steps = settling_steps(sim.block().ny);
  for (int i = 0; i < steps; ++i) sim.step();
  return spin(sim) / sim.units().rate(scene.flow.shear_rate);
}

/// Jeffery period times shear rate of a disc-like body of revolution (axis y): its angular velocity is
/// slow cos^2 + fast sin^2 of the angle, so the two ends of the orbit give the period 2 pi/sqrt(slow fast).
inline double jeffery_period(BodyCase c, double* aspect = nullptr) {
  c.orientation = mesh::identity_rotation;
  const double slow = rotation_rate(c);
  c.orientation = mesh::rotation({1, 0, 0}, M_PI / 2);
  const double fast = rotation_rate(c);
  if (aspect) *aspect = std::sqrt(fast / slow);
  return 2 * M_PI / std::sqrt(slow * fast);
}

/// Of the points of the only cell of \p sim.
inline double mean_velocity(const resolved::Simulation<double>& sim, int axis) {
  return std::visit(
      [&](const auto& cells) {
        double sum = 0;
        for (int k = 0; k < cells.vertices(); ++k) sum += cells.velocities()[cells.layout().at(0, k, axis)];
        return sum / cells.vertices();
      },
      sim.groups()[0].cells);
}

/// Radius, um, of the sphere with the Stokes drag of the body along \p axis (0, 1, 2): a force in a periodic
/// box, corrected for its images (Hasimoto 1959).
inline double stokes_radius(const BodyCase& c, int axis) {
  data::Scene scene = scene_of(c);
  scene.domain.geometry = data::Domain::Geometry::periodic;
  scene.flow.type = data::Flow::Type::rest;
  data::Vec3 pull{};
  pull[axis] = 1e-12;
  scene.cells.loads = {{0, "+z", 1.0, pull}};
  resolved::Simulation<double> sim(scene, {body_of(c)});
  const double n = sim.block().ny, viscosity = (scene.fluid.tau - 0.5) / 3;
  const double force = sim.units().force(1e-12);
  const int steps = settling_steps(n);
  for (int i = 0; i < steps; ++i) sim.step();
  const resolved::Momentum m = sim.momentum();
  const double mean = (m.fluid[axis] + m.cells[axis]) / (n * n * n);
  const double speed = mean_velocity(sim, axis) - mean;
  // F/(6 pi mu U) = a/(1 - 2.8373 r + 4.19 r^3 - 27.4 r^6), r = a/n, rises with a up to r = 0.3.
  double low = 0, high = 0.3 * n;
  for (int i = 0; i < 60; ++i) {
    const double a = (low + high) / 2, r = a / n;
    const double drag = a / (1 - 2.8373 * r + 4.19 * r * r * r - 27.4 * std::pow(r, 6));
    (drag < force / (6 * M_PI * viscosity * speed) ? low : high) = a;
  }
  return low * c.dx;
}

/// Radius of the sphere with the drag of an ellipsoid along its axis \p axis (Oberbeck 1876):
/// 16 pi mu U/(chi + alpha a^2) = 6 pi mu R U.
inline double exact_stokes_radius(const mesh::Vec3& radii, int axis) {
  // lambda = s^2/(1 - s)^2 maps [0, inf) on [0, 1); midpoint rule.
  const int n = 20000;
  double chi = 0, alpha = 0;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n, lambda = s * s / ((1 - s) * (1 - s));
    double product = 1;
    for (const double a : radii) product *= a * a + lambda;
    const double weight = 2 * s / std::pow(1 - s, 3) / n / std::sqrt(product);
    chi += weight, alpha += weight / (radii[axis] * radii[axis] + lambda);
  }
  return 8.0 / 3 / (chi + alpha * radii[axis] * radii[axis]);
}

inline double exact_jeffery_period(double aspect) { return 2 * M_PI * (aspect + 1 / aspect); }

}  // namespace hemowalk::test
