#pragma once
/// \file A red cell's solid alone, pulled as by optical tweezers.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "resolved/npfem/membranes.hpp"
#include "support/cells.hpp"

namespace hemowalk::support {

struct Stretched {
  double axial = 0, transverse = 0;  // um: centre to centre of the pulled patches, width across
};

/// Red cells pulled along x at 2 % of their vertices on each side with the given forces, at rest again after
/// 3 ms. Any drag leads there; here 3 % of the velocity per step.
inline std::vector<Stretched> stretch(const npfem::Material& material, const std::vector<double>& forces_pN) {
  const auto type = red_cell_type(8, material);
  const int n = type->rest().vertex_count(), patch = static_cast<int>(std::lround(0.02 * n));
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return type->rest().vertices[a][0] < type->rest().vertices[b][0]; });
  npfem::Membranes<double> cells(type);
  const int count = static_cast<int>(forces_pN.size());
  for (int c = 0; c < count; ++c) cells.add(c, {0, 0, 0}, mesh::identity_rotation);
  const auto at = cells.layout();
  const double kick = type->h() / patch / type->metric()[0];
  for (int i = 0; i < 12000; ++i) {
    const auto v = cells.velocities();
    for (std::size_t j = 0; j < v.size; ++j) cells.predicted()[j] = 0.97 * v[j];
    const double ramp = std::min(1.0, i / 1000.0);
    for (int c = 0; c < count; ++c)
      for (int k = 0; k < patch; ++k) {
        cells.predicted()[at.at(c, order[k], 0)] -= ramp * kick * forces_pN[c];
        cells.predicted()[at.at(c, order[n - 1 - k], 0)] += ramp * kick * forces_pN[c];
      }
    cells.step({.iterations = 2});
  }
  std::vector<Stretched> out(count);
  for (int c = 0; c < count; ++c) {
    for (int k = 0; k < patch; ++k)
      out[c].axial += (cells.position(c, order[n - 1 - k])[0] - cells.position(c, order[k])[0]) / patch;
    double low = 1e9, high = -1e9;
    for (const auto& p : cells.positions(c)) low = std::min(low, p[2]), high = std::max(high, p[2]);
    out[c].transverse = high - low;
  }
  return out;
}

}  // namespace hemowalk::support
