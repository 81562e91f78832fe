#pragma once
/// \file Scenes for 1 to 4 ranks, what all ranks together hold, and groups of ranks.

#include <algorithm>
#include <cmath>
#include <vector>

#include "ranks/ranks_main.hpp"
#include "resolved/gather.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"

namespace hemowalk::test {

using namespace resolved;

/// 24 x 28 x \p planes nodes: slabs of 20 planes are just thick enough for a red cell.
inline data::Scene long_scene(double acceleration = 32, int planes = 60) {
  return test::plasma_scene({12, 14, 0.5 * planes}, acceleration);
}

/// Red cells across every border of two and of three slabs (planes 0, 20, 30, 40), in contact with each other
/// and with platelets on the border; one platelet at the moving wall. Lattice units.
inline std::vector<InitialCell> crowd() {
  return {{0, {12, 7.5, 20}, mesh::rotation({1, 0, 0}, 0.3), {}},
          {0, {15, 14.2, 18}, mesh::rotation({1, 0, 0.4}, 0.2), {}},
          {0, {12, 13, 37}, mesh::rotation({0, 0, 1}, 0.1), {}},
          {0, {11, 9, 58}, mesh::rotation({1, 0, 0}, -0.2), {}},
          {1, {12, 17, 30.4}, mesh::rotation({0, 0, 1}, 0.1), {}},
          {1,
           {15.3, 12.5, 26.9},
           mesh::rotation({1, 0, 0}, 1.5708),
           {}},  // upright, at the rim of the second cell
          {1, {12, 25.9, 40.2}, mesh::rotation({0, 0, 1}, 0.2), {}}};
}

/// What all ranks together hold, on the root.
struct Whole {
  std::vector<double> velocity;  ///< of the fluid, [k][j][i][3]
  std::vector<double> position;  ///< of all vertices, cells by id
  double largest_speed = 0;
};

template <class Real>
Whole whole(const Simulation<Real>& sim) {
  Whole w;
  std::vector<std::byte> mine;
  const Block& b = sim.block();
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i) {
        const auto& u = sim.velocity()[b.at(i, j, k)];
        const double v[3] = {u.x, u.y, u.z};
        const auto* raw = reinterpret_cast<const std::byte*>(v);
        mine.insert(mine.end(), raw, raw + sizeof v);
      }
  for (const auto& part : sim.ranks().gather(mine)) {
    const auto* u = reinterpret_cast<const double*>(part.data());
    w.velocity.insert(w.velocity.end(), u, u + part.size() / sizeof(double));
  }
  for (const auto& group : sim.groups()) {
    const std::size_t n =
        std::visit([](const auto& g) { return 3 * static_cast<std::size_t>(g.vertices()); }, group.cells);
    const auto all = gather_cells(sim.ranks(), group, n, [](const auto& g, int c, double* out) {
      for (const auto& x : g.positions(c)) out = std::copy(x.begin(), x.end(), out);
    });
    w.position.insert(w.position.end(), all.values.begin(), all.values.end());
  }
  for (const double u : w.velocity) w.largest_speed = std::max(w.largest_speed, std::abs(u));
  return w;
}

inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double d = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) d = std::max(d, std::abs(a[i] - b[i]));
  return d;
}

/// Runs \p body(ranks) on the first \p count ranks; the others wait.
template <class Body>
void on(int count, const Body& body) {
  const mpi::Ranks ranks = world().first(count);
  if (world().rank() < count) body(ranks);
  test::barrier();
}

/// A platelet near a wall that moves by a tenth of a node per step, behind it a red cell.
inline data::Scene fast_scene() {
  data::Scene scene = long_scene(285);
  scene.cells.kinds[0].kappa_damping = 0;
  return scene;
}
inline std::vector<InitialCell> travellers() {
  return {{1, {12, 24.5, 15}, mesh::rotation({0, 0, 1}, 0.1), {}},
          {0, {12, 19.5, 55}, mesh::rotation({0, 0, 1}, 0.1), {}}};
}

}  // namespace hemowalk::test
