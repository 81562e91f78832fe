// Physics pre-flight: what a scene asks for against what the method can do, before anything is computed.

#include <fmt/core.h>

#include <cmath>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/resolve.hpp"
#include "resolved/stepper.hpp"

namespace hemowalk::resolved {

namespace {

using data::Scene;

constexpr double largest_wall_speed = 0.1;        // lattice units; compressibility error ~ Ma^2 = 3 u^2
constexpr double largest_capsule_reynolds = 0.1;  // end of the Stokes regime (method 6)
constexpr double widest_mesh = 2.2;               // mean edge in dx: wider meshes leak
constexpr double narrowest_mesh = 0.2;            // mean edge in dx: markers that a kernel cannot tell apart

void check_available(const Scene& scene, std::vector<std::string>& problems) {
  using Geometry = data::Domain::Geometry;
  if (scene.domain.geometry == Geometry::stl && scene.flow.mean_velocity)
    problems.push_back(
        "flow.mean_velocity with a surface from a file (the driving force that gives it is not known) use "
        "flow.pressure_gradient");
  // Kernels reach two nodes beyond the wall: the box is periodic across, and the other side must be solid
  // too.
  for (int d = 0; d < 2 && scene.domain.geometry == Geometry::tube; ++d)
    if (scene.domain.size[d] < scene.domain.tube_diameter + 4 * scene.fluid.dx - 1e-12)
      problems.push_back(fmt::format(
          "domain.size.{} is {:.4g} um (a tube of {:.4g} um wants 2 dx of solid on either side) make it "
          "{:.4g} um or more",
          d, 1e6 * scene.domain.size[d], 1e6 * scene.domain.tube_diameter,
          1e6 * (scene.domain.tube_diameter + 4 * scene.fluid.dx)));
  for (auto& problem : coupling_problems(scene)) problems.push_back(std::move(problem));
  if (scene.coupling.scheme == data::Coupling::Scheme::conservative && scene.coupling.solid_every > 1 &&
      scene.coupling.retraction > 0)
    problems.push_back(
        "coupling.solid_every > 1 blows up with a retracted coupling surface (measured: "
        "docs/evidence/resolved.md) use "
        "solid_every: 1, or retraction: 0");
  if (scene.coupling.integrator == data::Coupling::Integrator::runge_kutta)
    for (const auto& kind : scene.cells.kinds)
      if (kind.rayleigh_beta > 0)
        problems.push_back(
            "cells.kinds." + kind.name +
            ".rayleigh_beta with coupling.integrator runge_kutta (it knows kappa_damping only) use "
            "0 us, or the implicit integrator");
  if (const std::string problem = place_problem(scene); !problem.empty()) problems.push_back(problem);
}

void check_flow(const Scene& scene, const LatticeUnits& units, std::vector<std::string>& problems) {
  const ibm::Faces faces = make_faces(scene, units);
  double speed = std::max(std::abs(faces.lower_wall[2]), std::abs(faces.upper_wall[2]));
  for (int i = 1; i < 8; ++i)
    speed = std::max(speed, std::abs(steady_velocity(scene, units, units.length(scene.domain.size[0]) / 2,
                                                     units.length(scene.domain.size[1]) * i / 8)));
  if (speed > largest_wall_speed)
    problems.push_back(
        fmt::format("the fastest flow is {:.3g} lattice units per step (limit {:g}: the fluid would be "
                    "compressible) lower acceleration to "
                    "{:.3g} or less{}",
                    speed, largest_wall_speed, scene.acceleration * largest_wall_speed / speed,
                    scene.flow.type == data::Flow::Type::couette && scene.flow.walls == data::Flow::Walls::top
                        ? ", or let both walls move (flow.walls: both)"
                        : ""));
  const auto& cap = scene.coupling.velocity_cap;
  if (scene.coupling.scheme == data::Coupling::Scheme::paper && cap && speed > *cap)
    problems.push_back(
        fmt::format("coupling.velocity_cap is {:g} and the fastest flow {:.3g} lattice units per step (cells "
                    "there could not follow it) raise the cap, or lower acceleration to {:.3g} or less",
                    *cap, speed, scene.acceleration * *cap / speed));
  const double rate = scene.flow.type == data::Flow::Type::couette ? scene.flow.shear_rate : 0;
  const double reynolds = scene.acceleration * rate * std::pow(3.91e-6, 2) / scene.fluid.kinematic_viscosity;
  if (!scene.cells.kinds.empty() && reynolds > largest_capsule_reynolds)
    problems.push_back(fmt::format(
        "the capsule Reynolds number is {:.3g} at this acceleration (limit {:g}: not Stokes flow any more) "
        "lower acceleration to {:.3g}",
        reynolds, largest_capsule_reynolds, scene.acceleration * largest_capsule_reynolds / reynolds));
}

void check_cells(const Scene& scene, const LatticeUnits& units, std::vector<std::string>& problems) {
  for (const auto& kind : scene.cells.kinds) {
    mesh::TriangleMesh rest;
    try {
      rest = make_mesh(kind, units.dx);
      coupling_points(kind, rest, scene.coupling);
    } catch (const Error& error) {
      problems.push_back("cells.kinds." + kind.name + ".shape: " + error.what());
      continue;
    }
    const double ratio = mesh::mean_edge(rest);
    if (ratio > widest_mesh || ratio < narrowest_mesh)
      problems.push_back(fmt::format(
          "cells.kinds.{}: the mesh's mean edge is {:.2f} dx (it must lie in [{:g}, {:g}] or membranes leak "
          "or jitter) choose subdivision {}",
          kind.name, ratio, narrowest_mesh, widest_mesh,
          std::max(2, static_cast<int>(std::lround(kind.subdivision * ratio / 1.5)))));
    const double radius = mesh::bounding_radius(rest);
    for (int d = 0; d < 3; ++d)
      if (units.length(scene.domain.size[d]) < 2 * radius)
        problems.push_back(fmt::format(
            "domain.size.{} is {:.3g} um (a {} is {:.3g} um across and would meet itself) enlarge the box", d,
            1e6 * scene.domain.size[d], kind.name, 2e6 * units.to_length(radius)));
  }
}

}  // namespace

std::vector<std::string> preflight(const Scene& scene) {
  std::vector<std::string> problems;
  const LatticeUnits units(scene);
  check_available(scene, problems);
  if (!(scene.fluid.tau > 0.5))
    problems.push_back(fmt::format("fluid.tau is {:g} (the viscosity would not be positive) choose tau > 0.5",
                                   scene.fluid.tau));
  try {
    make_block(scene);
  } catch (const InputError& error) {
    problems.push_back(error.what());
  }
  if (!problems.empty()) return problems;
  check_flow(scene, units, problems);
  check_cells(scene, units, problems);
  return problems;
}

}  // namespace hemowalk::resolved
