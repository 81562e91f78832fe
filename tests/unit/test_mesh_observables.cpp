#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "resolved/mesh/observables.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

std::vector<Vec3> placed(const TriangleMesh& rest, const Quaternion& q, const Vec3& at) {
  auto x = rest.vertices;
  for (auto& p : x) p = add(at, rotate(q, p));
  return x;
}

/// A polyhedron inscribed in an ellipsoid is the affine image of one in the unit sphere, whose second moments
/// are isotropic by symmetry: the ratios of the semi-axes are exact whatever n.
TEST(Observe, EllipsoidInTheShearPlane) {
  const auto rest = ellipsoid({1.5, 1, 3}, 6);
  const double tilt = 0.4;  // long axis z turned towards y
  const auto o = observe(rest, placed(rest, rotation({1, 0, 0}, -tilt), {10, 20, 30}), marker_vertex(rest));
  EXPECT_NEAR(o.taylor_deformation, (3.0 - 1) / (3 + 1), 1e-12);
  EXPECT_NEAR(o.inclination, tilt, 1e-12);
  EXPECT_NEAR(o.semi_axes[0] / o.semi_axes[2], 3, 1e-12);
  EXPECT_NEAR(o.semi_axes[0] / o.semi_axes[1], 2, 1e-12);
  EXPECT_NEAR(o.axial_diameter, 6, 1e-12);
  EXPECT_NEAR(o.transverse_diameter, 3, 1e-12);
  EXPECT_NEAR(o.tank_treading_angle, tilt, 1e-12);
  EXPECT_NEAR(o.centre[0], 10, 1e-12);
  EXPECT_NEAR(o.volume, volume(rest), 1e-10);
}

TEST(Observe, AxisFollowsTheBody) {
  const auto rest = red_cell(1, 6);
  for (int i = 0; i < 20; ++i) {
    const auto q = rotation({std::sin(i + 1.0), std::cos(3.0 * i), std::sin(7.0 * i)}, 0.3 + 0.9 * i);
    const auto o = observe(rest, placed(rest, q, {1, 2, 3}), marker_vertex(rest));
    const auto exact = rotate(q, {0, 1, 0});
    EXPECT_NEAR(dot(o.axis, exact), 1, 1e-12);
    EXPECT_NEAR(dot(o.short_axis, exact), 1, 1e-10);
  }
}

TEST(Rotation, QuaternionAndMatrixAgreeWithRodrigues) {
  const Vec3 axis{1, 2, -2}, r{0.3, -1, 2};
  const double angle = 0.7;
  const Vec3 u = scale(1.0 / 3, axis);
  const Vec3 exact = add(scale(std::cos(angle), r), add(scale(std::sin(angle), cross(u, r)),
                                                        scale((1 - std::cos(angle)) * dot(u, r), u)));
  EXPECT_NEAR(norm(subtract(rotate(rotation(axis, angle), r), exact)), 0, 1e-15);
  const auto twice = multiply(rotation(axis, angle), rotation(axis, angle));
  EXPECT_NEAR(norm(subtract(rotate(twice, r), rotate(rotation(axis, 2 * angle), r))), 0, 1e-14);
}

}  // namespace
}  // namespace hemowalk::mesh
