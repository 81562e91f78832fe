#pragma once
// Two flat sheets of markers with prescribed velocities in a channel whose walls move with them: the fluid
// outside the gap is at rest relative to its sheet, so all friction comes from the gap. Lattice units.

#include <cmath>
#include <vector>

#include "resolved/ibm/markers.hpp"
#include "resolved/lbm/fluid.hpp"
#include "resolved/slip_correction.hpp"

namespace hemowalk::test_support {

struct SheetCase {
  double gap = 1, retraction = 0.7, theta_n = 0.97, theta_t = 0.97, chi = 8.0 / 3, tau = 2, spacing = 1.43;
  double offset = 0;  // of the pair against the lattice, in dx
  ibm::Kernel kernel = ibm::Kernel::phi4;
  int steps = 500;
};

// Friction per area over mu U/gap: 1 is right.
inline double relative_friction(const SheetCase& c) {
  const int n = 20, height = 32;
  const Block block{n, height, n};
  const double U = 0.01, nu = (c.tau - 0.5) / 3;
  ibm::Faces faces{true, false, true, {0, 0, -U / 2}, {0, 0, U / 2}};
  lbm::Parameters p;
  p.tau = c.tau;
  p.lower_wall_velocity = faces.lower_wall, p.upper_wall_velocity = faces.upper_wall;
  lbm::Fluid<double> fluid(block, p);
  const double y0 = height / 2.0 + c.offset - c.gap / 2, y1 = y0 + c.gap;
  fluid.initialise([&](double y) {
    return y < y0 ? -U / 2 : y > y1 ? U / 2 : -U / 2 + U * (y - y0) / c.gap;
  });
  const int m = static_cast<int>(std::lround(n / c.spacing)), count = 2 * m * m;
  const double spacing = static_cast<double>(n) / m, a = c.chi * spacing * spacing;
  Array<ibm::Origin> origin(1);
  Array<Node4<double>> site(count), u(count), f(count), J(count), velocity(block.size()), force(block.size());
  for (int s = 0; s < 2; ++s)
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k)
        site[(s * m + i) * m + k] = {(i + .25) * spacing, s ? y1 + c.retraction : y0 - c.retraction,
                                     (k + .25) * spacing, 0};
  ibm::Markers<double> markers(block, faces, c.kernel, std::vector<std::int32_t>(count, 0));
  markers.locate(origin.view(), site.view());
  const resolved::SlipCorrection<double> correct{c.theta_n, c.theta_t};
  fluid.moments(velocity.view());
  double drag = 0;
  for (int step = 0; step < c.steps; ++step) {
    ibm::fill_velocity_halo(block, faces, velocity.view());
    ibm::fill_velocity_halo(block, {true, false, true, {}, {}}, force.view());
    markers.interpolate(velocity.view(), u.view());
    markers.interpolate(force.view(), f.view());
    drag = 0;
    for (int i = 0; i < count; ++i) {
      const int s = i / (m * m);
      const double ui[3] = {u[i].x, u[i].y, u[i].z}, fi[3] = {f[i].x / 2, f[i].y / 2, f[i].z / 2};
      const double Ji[3] = {J[i].x, J[i].y, J[i].z}, normal[3] = {0, s ? -1.0 : 1.0, 0};
      double w[3];
      correct(ui, fi, Ji, 1 / a, normal, w);
      const double v = s ? U / 2 : -U / 2;
      J[i] = {-a * w[0], -a * w[1], a * (v - w[2]), 0};
      drag += (s ? 1 : -1) * J[i].z / 2;
    }
    for (auto& x : force) x = {0, 0, 0, 0};
    markers.spread(J.view(), force.view());
    ibm::fold_force_halo(block, faces, force.view());
    fluid.advance(force.view(), velocity.view());
  }
  return drag / (n * n) / (nu * U / c.gap);
}

}  // namespace hemowalk::test_support
