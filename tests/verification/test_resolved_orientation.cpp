// A cell does not know where the lattice's axes and nodes are: moved and turned it goes at the same speed.
#include <gtest/gtest.h>

#include <cmath>

#include "support/red_cells.hpp"

namespace hemowalk::resolved {
namespace {

// The mobility of a sphere in a cubic array is a tensor with the cube's symmetry, hence the same along any
// direction: what differs is the lattice's (and the mesh's, which turns along): 0.5 % with phi3, 0.1 with
// phi4. A red cell: test_red_cells.cpp.
TEST(Orientation, DragOfASphericalMembraneDoesNotKnowTheLattice) {
  data::Kind kind = test::red_cell_kind(0.5);
  kind.shape = test::sphere_shape(2.5), kind.subdivision = 8;
  const double straight = test::settled_speed(kind, 12, {0, 1, 0});
  EXPECT_NEAR(test::settled_speed(kind, 12, {1, 0, 0}) / straight, 1, 1e-9) << "axes are alike";
  EXPECT_NEAR(test::settled_speed(kind, 12, {0, 1, 0}, {0.5, 0.25, 0.3}) / straight, 1, 0.008) << "moved";
  for (const mesh::Vec3& axis : {mesh::Vec3{0, 1, 1}, {1, 1, 1}, {0.3, 1, 0.1}})
    EXPECT_NEAR(test::settled_speed(kind, 12, axis) / straight, 1, 0.008)
        << axis[0] << " " << axis[1] << " " << axis[2];
}

}  // namespace
}  // namespace hemowalk::resolved
