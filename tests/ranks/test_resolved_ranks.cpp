// The resolved solver on 1, 2 and 3 ranks: the same flow to round-off, cells that wander through all slabs,
// budgets over all ranks, restarts on as many and on other ranks. Started with three ranks; groups of fewer
// are cut from them.

#include <omp.h>

#include <cmath>

#include "core/check.hpp"
#include "ranks/ranks_main.hpp"
#include "resolved/gather.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {
namespace {

using test::world;

/// 24 x 28 x 60 nodes: three slabs are just thick enough for a red cell.
data::Scene long_scene(double acceleration = 32) {
  data::Scene scene;
  scene.domain.size = {12e-6, 14e-6, 30e-6};
  scene.acceleration = acceleration;
  data::Kind rbc, platelet;
  rbc.name = "rbc";
  platelet.name = "platelet", platelet.shape.type = data::Shape::Type::platelet, platelet.subdivision = 4;
  platelet.law = data::Kind::Law::rigid;
  scene.cells.kinds = {rbc, platelet};
  return scene;
}

/// Red cells across every border of two and of three slabs (planes 0, 20, 30, 40), in contact with each other
/// and with platelets on the border; one platelet at the moving wall. Lattice units.
std::vector<InitialCell> crowd() {
  return {{0, {12, 7.5, 20}, mesh::rotation({1, 0, 0}, 0.3), {}},
          {0, {15, 14.2, 18}, mesh::rotation({1, 0, 0.4}, 0.2), {}},
          {0, {12, 13, 37}, mesh::rotation({0, 0, 1}, 0.1), {}},
          {0, {11, 9, 58}, mesh::rotation({1, 0, 0}, -0.2), {}},
          {1, {12, 17, 30.4}, mesh::rotation({0, 0, 1}, 0.1), {}},
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

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
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

template <class Real>
void expect_agreement(const data::Scene& scene, int steps, double relative) {
  Whole one, start;
  for (const int n : {1, 2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<Real> sim(scene, crowd(), ranks);
      if (n == 1) start = whole(sim);
      double contacts = 0;
      for (int i = 0; i < steps; ++i) sim.step();
      contacts = static_cast<double>(sim.contact_summary().contacts);
      ranks.sum({&contacts, 1});
      EXPECT_GT(contacts, 20) << "the cells should touch";
      const Whole many = whole(sim);
      if (!ranks.root()) return;
      if (n == 1) {
        one = many;
        return;
      }
      const double moved = largest_difference(one.position, start.position);
      EXPECT_GT(moved, 0.3) << "the cells should move";
      EXPECT_LT(largest_difference(many.velocity, one.velocity), relative * one.largest_speed)
          << n << " ranks";
      EXPECT_LT(largest_difference(many.position, one.position), relative * moved) << n << " ranks";
    });
}

TEST(RanksOfTheSolver, AgreeInDoubleOverHundredSteps) { expect_agreement<double>(long_scene(), 100, 1e-10); }

}  // namespace
}  // namespace hemowalk::resolved
