// Flow bounded by static solid: a tube, and a closed surface from a file.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/packing.hpp"
#include "resolved/region.hpp"
#include "resolved/resolve.hpp"
#include "resolved/simulation.hpp"
#include "support/blood_scene.hpp"

namespace hemowalk::resolved {
namespace {

using Geometry = data::Domain::Geometry;

/// A tube along z, mean velocity 1 mm/s, lengths in um.
data::Scene tube_scene(double diameter, double width, double length) {
  data::Scene scene = test::blood_scene({width, width, length}, 0.2);
  scene.domain.geometry = Geometry::tube;
  scene.domain.tube_diameter = 1e-6 * diameter;
  scene.flow.type = data::Flow::Type::poiseuille;
  scene.flow.mean_velocity = 1e-3;
  scene.acceleration = 8;
  return scene;
}

/// Closed polygonal cylinder along z around (x, y), in um.
std::string write_cylinder(double x, double y, double radius, double low, double high, int n) {
  const std::string path = testing::TempDir() + "hemowalk_cylinder.off";
  std::ofstream out(path);
  out.precision(17);
  out << "OFF\n" << 2 * n + 2 << " " << 4 * n << " 0\n";
  for (const double z : {low, high})
    for (int i = 0; i < n; ++i)
      out << x + radius * std::cos(2 * M_PI * i / n) << " " << y + radius * std::sin(2 * M_PI * i / n) << " "
          << z << "\n";
  out << x << " " << y << " " << low << "\n" << x << " " << y << " " << high << "\n";
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    out << "3 " << i << " " << j << " " << n + j << "\n3 " << i << " " << n + j << " " << n + i << "\n";
    out << "3 " << 2 * n << " " << j << " " << i << "\n3 " << 2 * n + 1 << " " << n + i << " " << n + j
        << "\n";
  }
  return path;
}

TEST(Region, TubeFromAFileIsTheTube) {
  data::Scene tube = tube_scene(16, 20, 6);
  data::Scene file = tube;
  file.domain.geometry = Geometry::stl;
  // 400 corners: the polygon is 16 dx (1 - cos(pi/400)) = 5e-4 dx inside the circle, where no node is.
  file.domain.stl_file = write_cylinder(10, 10, 8, -1, 7, 400);
  file.domain.stl_unit = 1e-6;
  const Region one(tube), two(file);
  ASSERT_TRUE(one.has_solid() && two.has_solid());
  int fluid = 0;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) {
        ASSERT_EQ(one.solid(i, j, k), two.solid(i, j, k)) << i << " " << j << " " << k;
        fluid += !one.solid(i, j, k);
      }
  // Nodes in a circle of radius 16: pi 256 = 804.2; the lattice's count differs by less than its perimeter
  // / 10.
  EXPECT_NEAR(fluid / 12.0, M_PI * 256, 10);
  EXPECT_TRUE(one.solid(-1, 20, 5) && one.solid(40, 20, 5)) << "periodic images";
  EXPECT_NEAR(one.volume(), M_PI * 64e-12 * 6e-6, 1e-20);
  EXPECT_NEAR(two.volume() / one.volume(), 1, 0.01);
}

TEST(Region, SurfaceWithoutFluidIsRefused) {
  data::Scene scene = tube_scene(16, 20, 6);
  scene.domain.geometry = Geometry::stl;
  scene.domain.stl_file = write_cylinder(100, 100, 8, -1, 7, 40);
  scene.domain.stl_unit = 1e-6;
  EXPECT_THROW(Region{scene}, InputError);
}

TEST(Tube, PoiseuilleFlowStaysAsItStarts) {
  data::Scene scene = tube_scene(20, 22, 4);
  scene.cells = {};
  Simulation<double> sim(scene, {});
  const auto start = sim.momentum();
  for (int i = 0; i < 3000; ++i) sim.step();  // 3 R^2/(pi^2 nu) or so
  const auto now = sim.momentum();
  const auto mean = [&](const Momentum& m) {
    return m.fluid[2] / static_cast<double>(sim.fluid().fluid_nodes());
  };
  // Staircase walls lie within half a spacing of the circle: 2 dR/R in the mean velocity, with a mean dR of a
  // quarter at most.
  EXPECT_NEAR(mean(now) / mean(start), 1, 2 * 0.25 / 20);
  EXPECT_NEAR(sim.units().to_velocity(mean(now)), 1e-3, 0.06e-3);
  // In the steady state the wall takes what the body force gives.
  const auto before = sim.momentum();
  sim.step();
  const auto after = sim.momentum();
  const double given = after.from_body_force[2] - before.from_body_force[2];
  EXPECT_NEAR((after.to_solid[2] - before.to_solid[2]) / given, 1, 1e-3);
}

template <class Real>
void expect_momentum_to_close(double relative) {
  data::Scene scene = tube_scene(14, 16, 12);
  // A red cell whose rim is within a kernel of the wall, a platelet beside the axis.
  const std::vector<InitialCell> cells{{0, {16 + 5.2, 16, 12}, mesh::rotation({1, 0, 0}, 1.3), {}},
                                       {1, {8, 16, 14}, mesh::rotation({0, 0, 1}, 0.2), {}}};
  Simulation<Real> sim(scene, cells);
  const auto start = sim.momentum();
  for (int i = 0; i < 200; ++i) sim.step();
  const auto end = sim.momentum();
  EXPECT_GT(std::abs(end.to_solid[2]), 1);
  for (int d = 0; d < 3; ++d)
    EXPECT_LT(std::abs(end.total()[d] - start.total()[d]), relative * end.scale()) << "component " << d;
}

TEST(Tube, MomentumOfFluidCellsAndSolidClosesInDouble) { expect_momentum_to_close<double>(1e-12); }
TEST(Tube, MomentumOfFluidCellsAndSolidClosesInSingle) { expect_momentum_to_close<float>(1e-5); }

/// A red cell pulled along x against the wall of a tube given by its diameter or as a surface from a file.
/// \returns the largest distance of a vertex from the axis, dx.
template <class Real>
double pressed_against_wall(bool from_file, Momentum& start, Momentum& end) {
  data::Scene scene = tube_scene(14, 16, 12);
  scene.flow.type = data::Flow::Type::rest;
  scene.cells.loads = {{0, "+x", 1.0, {300e-12, 0, 0}}};
  if (from_file) {
    scene.domain.geometry = Geometry::stl;
    scene.domain.stl_file = write_cylinder(8, 8, 7, -1, 13, 300), scene.domain.stl_unit = 1e-6;
  }
  const std::vector<InitialCell> cells{{0, {16 + 9.5, 16, 12}, mesh::rotation({0, 0, 1}, M_PI / 2), {}}};
  Simulation<Real> sim(scene, cells);
  start = sim.momentum();
  double farthest = 0;
  for (int i = 0; i < 400; ++i) sim.step();
  end = sim.momentum();
  const auto& group = sim.groups()[0];
  for (const auto& x : std::visit([](const auto& g) { return g.positions(0); }, group.cells))
    farthest = std::max(farthest, std::hypot(x[0] - 16, x[1] - 16));
  return farthest;
}

// Radius 14 dx. The polygon of 300 sides lies within 14 (1 - cos(pi/300)) = 8e-4 dx of the circle, the
// trilinear distance within dx^2/(8 R) = 9e-3 dx of the polygon's.
TEST(Tube, ACellPressedAgainstASurfaceFromAFileStaysOffItAsOffTheTube) {
  Momentum start, end;
  const double tube = pressed_against_wall<double>(false, start, end);
  const double impulse = end.to_lower_wall[0];
  const double file = pressed_against_wall<double>(true, start, end);
  EXPECT_LT(file, 14);
  EXPECT_GT(file, 13) << "the cell should be within the contact's range";
  EXPECT_NEAR(file, tube, 0.02);
  // The position hardly knows where the surface is, the reaction does: 0.1 dx more of gap take 44 % of it, so
  // 0.01 dx are some 5 %.
  EXPECT_NEAR(end.to_lower_wall[0] / impulse, 1, 0.06);
  EXPECT_GT(std::abs(end.to_lower_wall[0]), 1e-3 * end.from_loads[0]) << "the reaction is the wall's";
  for (int d = 0; d < 3; ++d)
    EXPECT_LT(std::abs(end.total()[d] - start.total()[d]), 1e-11 * end.scale()) << "component " << d;
}

TEST(Tube, PackingStaysInsideASurfaceFromAFile) {
  data::Scene scene = tube_scene(20, 22, 20);
  scene.domain.geometry = Geometry::stl;
  scene.domain.stl_file = write_cylinder(11, 11, 10, 0, 20, 100), scene.domain.stl_unit = 1e-6;
  const auto cells = pack(scene);
  ASSERT_EQ(static_cast<int>(cells.size()), census(scene).rbc + census(scene).platelets);
  for (const auto& cell : cells)
    for (const auto& v : cell.vertices) EXPECT_LT(std::hypot(v[0] - 22, v[1] - 22), 20);
}

TEST(Tube, PackingStaysInsideAndCountsTheTubesVolume) {
  data::Scene scene = tube_scene(20, 22, 20);
  EXPECT_EQ(census(scene).rbc, static_cast<int>(0.2 * M_PI * 100 * 20 / 91.79921));
  const auto cells = pack(scene);
  ASSERT_EQ(static_cast<int>(cells.size()), census(scene).rbc + census(scene).platelets);
  for (const auto& cell : cells)
    for (const auto& v : cell.vertices) EXPECT_LT(std::hypot(v[0] - 22, v[1] - 22), 20);
}

TEST(Tube, NeedsSolidAroundIt) {
  EXPECT_TRUE(preflight(tube_scene(20, 22, 20)).empty());
  const auto problems = preflight(tube_scene(20, 21, 20));
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_NE(problems[0].find("domain.size.0"), std::string::npos);
}

}  // namespace
}  // namespace hemowalk::resolved
