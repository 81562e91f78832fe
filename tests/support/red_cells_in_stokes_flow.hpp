#pragma once
/// \file The references for a red cell's experiments in red_cells.hpp: the same cell alone in unbounded
/// Stokes flow, by the boundary integral, kappa 0.

#include "support/boundary_integral.hpp"
#include "support/red_cells.hpp"

namespace hemowalk::test {

constexpr double plasma_viscosity = 1.025e-3;  ///< Pa s = pN s/um2

/// Instead of red_cell_in_shear; 4 subdivision^2 + 2 vertices.
inline Shear red_cell_in_stokes_flow(const ShearCase& c, int subdivision = 8) {
  const auto rest = mesh::red_cell(1, subdivision);
  const npfem::CellType type(rest, npfem::Material{}, std::vector<double>(rest.vertices.size(), 1.0), 1);
  auto start = rest.vertices;
  for (auto& p : start) p = mesh::rotate(mesh::rotation({1, 0, 0}, c.angle), p);
  const auto shear = [&](const mesh::Vec3& p) { return mesh::Vec3{0, 0, c.shear_rate * p[1]}; };
  MembraneInStokesFlow cell(type, rest, plasma_viscosity, shear, start);
  ShearRecord record(mesh::observe(rest, start, type.marker()), c.from, c.until);
  for (int i = 1; !record.done(); ++i) {
    cell.advance(between_looks / c.shear_rate);
    record.add(i * between_looks, mesh::observe(rest, cell.vertices(), type.marker()));
  }
  return record.result();
}

/// Instead of return_time, s.
inline double return_time_in_stokes_flow(double strain = 0.1, int subdivision = 8) {
  const auto at_rest = mesh::red_cell(1, subdivision);
  const auto& rest = at_rest.vertices;
  const npfem::CellType type(at_rest, npfem::Material{}, std::vector<double>(rest.size(), 1.0), 1);
  auto x = rest, imposed = rest;
  for (std::size_t k = 0; k < x.size(); ++k) {
    imposed[k] = {rest[k][0] * strain, 0, rest[k][2] / (1 + strain) - rest[k][2]};
    x[k] = mesh::add(rest[k], imposed[k]);
  }
  constexpr double dt = 10e-6;
  MembraneInStokesFlow cell(
      type, at_rest, plasma_viscosity, [](const mesh::Vec3&) { return mesh::Vec3{}; }, x);
  double early = 0;
  for (int i = 1; i * dt < 0.1; ++i) {
    cell.advance(dt);
    const double left = share_left(cell.vertices(), rest, imposed);
    if (early == 0 && left < 0.8) early = i * dt;
    if (left < 0.4) return (i * dt - early) / std::log(2.0);
  }
  return std::nan("");
}

}  // namespace hemowalk::test
