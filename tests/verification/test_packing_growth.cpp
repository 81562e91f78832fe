// Packings against what they promise: no overlap, walls kept, shapes deformed but volumes kept, the same bits
// for any number of threads, uniform orientations, clear errors.
#include <gtest/gtest.h>
#include <omp.h>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/packing.hpp"
#include "tests/support/blood_scene.hpp"
#include "tests/support/contact_bodies.hpp"

using namespace hemowalk;
using mesh::Vec3;

namespace {

std::vector<Vec3> vertices_of(const resolved::InitialCell& cell, const mesh::TriangleMesh& rest) {
  if (!cell.vertices.empty()) return cell.vertices;
  std::vector<Vec3> x;
  for (const Vec3& r : rest.vertices) {
    const Vec3 turned = mesh::rotate(cell.orientation, r);
    x.push_back({cell.centre[0] + turned[0], cell.centre[1] + turned[1], cell.centre[2] + turned[2]});
  }
  return x;
}

/// Independent measurement, in double, of the cells as they are handed out.
contact::Overlap overlap_of(const data::Scene& scene, const std::vector<resolved::InitialCell>& cells) {
  test::ContactBodies<double> set;
  for (const auto& kind : scene.cells.kinds) set.add_shape(resolved::make_mesh(kind, scene.fluid.dx));
  for (const auto& cell : cells) {
    const int b = set.add(cell.kind, cell.centre);
    const auto x = vertices_of(cell, set.meshes[cell.kind]);
    for (std::size_t v = 0; v < x.size(); ++v) {
      const auto& o = set.origin[b];
      set.local[set.bodies[b].first + v] = {x[v][0] - o[0], x[v][1] - o[1], x[v][2] - o[2], 0};
    }
  }
  const contact::Domain domain = resolved::make_domain(scene, resolved::make_block(scene));
  return contact::measure_overlap(domain, set.shapes, set.bodies, set.origins(), set.positions(), 1.0);
}

void expect_packed(double hematocrit, int red, int platelets) {
  const data::Scene scene = test::blood_scene({20, 20, 20}, hematocrit);
  resolved::PackingReport report;
  const auto cells = resolved::pack(scene, &report);
  ASSERT_EQ(cells.size(), static_cast<std::size_t>(red + platelets));
  const contact::Overlap overlap = overlap_of(scene, cells);
  EXPECT_EQ(overlap.inside, 0);
  EXPECT_EQ(overlap.outside_walls, 0);
  // The packing works in single precision: positions are good to 1e-5 dx.
  EXPECT_GE(overlap.minimum_gap, resolved::smallest_packed_gap - 1e-4);
  EXPECT_NEAR(overlap.minimum_gap, report.minimum_gap, 1e-4);
  EXPECT_GE(overlap.minimum_wall_gap, resolved::smallest_packed_gap - 1e-4);
  int deformed = 0;
  for (const auto& cell : cells) {
    mesh::TriangleMesh m = resolved::make_mesh(scene.cells.kinds[cell.kind], scene.fluid.dx);
    const double rest = mesh::volume(m);
    m.vertices = vertices_of(cell, m);
    EXPECT_NEAR(mesh::volume(m) / rest, 1,
                scene.cells.kinds[cell.kind].law == data::Kind::Law::rigid ? 1e-12 : 0.01);
    deformed += !cell.vertices.empty();
    for (const int d : {0, 2}) EXPECT_TRUE(cell.centre[d] >= 0 && cell.centre[d] < 40);
  }
  EXPECT_EQ(deformed, red);
}

}  // namespace

TEST(PackingGrowth, Hematocrit35) { expect_packed(0.35, 30, 6); }
TEST(PackingGrowth, Hematocrit45) { expect_packed(0.45, 39, 7); }
TEST(PackingGrowth, Hematocrit55) { expect_packed(0.55, 47, 9); }

// The densest packing too: there cells touch from the first radius on, and one bit that differs is seen.
TEST(PackingGrowth, SameBitsForAnyNumberOfThreadsAndOthersFromAnotherSeed) {
  for (const double hematocrit : {0.3, 0.55}) {
    const data::Scene scene = test::blood_scene({16, 16, 16}, hematocrit, 5);
    const int before = omp_get_max_threads();
    omp_set_num_threads(1);
    const auto one = resolved::pack(scene);
    omp_set_num_threads(3);
    const auto three = resolved::pack(scene);
    omp_set_num_threads(before);
    const auto other = resolved::pack(test::blood_scene({16, 16, 16}, hematocrit, 6));
    ASSERT_EQ(one.size(), three.size());
    ASSERT_EQ(one.size(), other.size());
    for (std::size_t c = 0; c < one.size(); ++c) {
      ASSERT_EQ(one[c].centre, three[c].centre) << hematocrit;
      ASSERT_EQ(one[c].orientation, three[c].orientation) << hematocrit;
      ASSERT_EQ(one[c].vertices, three[c].vertices) << hematocrit;
      EXPECT_NE(one[c].centre, other[c].centre) << hematocrit;
    }
  }
}

// Sixty-four rigid ellipsoids in a dilute box: uniform on SO(3) means every entry of the rotation matrix has
// mean 0 and variance 1/3. With n = 64 x 10 seeds the mean of each has standard deviation sqrt(1/3/640) =
// 0.023; nine entries, alpha = 1e-4 in all: 4.4 sigma = 0.10. A bias of the size of Euler angles drawn
// uniformly (mean square of the polar entry 1/2 instead of 1/3) is far outside: standard deviation of that
// mean is sqrt(4/45/640) = 0.012.
TEST(PackingGrowth, OrientationsAreUniform) {
  double mean[9]{}, square[9]{};
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    data::Scene scene = test::blood_scene({40, 40, 40}, 0.0068, seed);
    scene.cells.kinds.pop_back();
    scene.cells.platelets_per_rbc = 0;
    scene.cells.kinds[0].shape = {data::Shape::Type::ellipsoid, {1.4e-6, 1e-6, 1.2e-6}, "", 1};
    scene.cells.kinds[0].law = data::Kind::Law::rigid;
    scene.cells.kinds[0].subdivision = 3;
    for (const auto& cell : resolved::pack(scene)) {
      const auto m = mesh::matrix(cell.orientation);
      for (int i = 0; i < 9; ++i) mean[i] += m[i], square[i] += m[i] * m[i];
      ++n;
    }
  }
  ASSERT_GT(n, 600);
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(mean[i] / n, 0, 4.4 * std::sqrt(1 / 3.0 / n));
    EXPECT_NEAR(square[i] / n, 1 / 3.0, 4.4 * std::sqrt(4 / 45.0 / n));
  }
}

TEST(PackingGrowth, ImpossibleHematocritIsAnInputError) {
  for (const double hematocrit :
       {0.95, 0.8}) {  // more than there is room for; more than discs can be jammed to
    try {
      resolved::pack(test::blood_scene({12, 12, 12}, hematocrit));
      FAIL() << hematocrit << " was packed";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("hematocrit"), std::string::npos) << text;
      EXPECT_NE(text.find("dx"), std::string::npos) << text;
    }
  }
}

TEST(PackingPlacement, ExplicitCellsStandWhereTheyAreToldTo) {
  data::Scene scene = test::blood_scene({20, 20, 20}, 0);
  scene.cells.hematocrit.reset();
  scene.cells.platelets_per_rbc = 0;
  scene.cells.placements = {{"rbc", {10e-6, 10e-6, 10e-6}, {1, 0, 0}, 0.5},
                            {"platelet", {10e-6, 14e-6, 10e-6}, {0, 1, 0}, 0}};
  const auto cells = resolved::pack(scene);
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_NEAR(cells[0].centre[1], 20, 1e-12);
  EXPECT_NEAR(cells[0].orientation[1], std::sin(0.25), 1e-12);
  EXPECT_EQ(cells[1].kind, 1);
  scene.cells.placements[1].position[1] = 11e-6;
  EXPECT_THROW(resolved::pack(scene), InputError);  // in the red cell
  scene.cells.placements[1].position[1] = 19.9e-6;
  EXPECT_THROW(resolved::pack(scene), InputError);  // through the wall
  scene.cells.placements[1].kind = "white";
  EXPECT_THROW(resolved::pack(scene), InputError);
}
