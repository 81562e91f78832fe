// The shape-recovery time t_c that every run reports.
#include <gtest/gtest.h>

#include <cmath>

#include "resolved/recovery.hpp"
#include "support/blood_scene.hpp"

namespace hemowalk::resolved {
namespace {

double t_c(double kappa) {
  data::Scene scene = test::blood_scene({20, 20, 20}, 0.3);
  scene.cells.kinds[0].kappa_damping = kappa;
  return recovery_time(scene);
}

// A drag proportional to kappa/(1 - kappa) (1, 4) beside that of the plasma, against the same elasticity: t_c
// is a straight line in it. With the third point (9/4 at kappa 9/13) on that line within what a nonlinear
// shape allows.
TEST(RecoveryTime, IsAStraightLineInTheDrag) {
  const double one = t_c(0.5), middle = t_c(9.0 / 13), four = t_c(0.8);
  EXPECT_GT(one, 5e-3);
  EXPECT_LT(one, 50e-3);
  EXPECT_GT(four, 1.5 * one);
  EXPECT_NEAR(middle, one + (four - one) * (9.0 / 4 - 1) / 3, 0.05 * middle);
}

TEST(RecoveryTime, IsUnknownForRigidCells) {
  data::Scene scene = test::blood_scene({20, 20, 20}, 0.3);
  scene.cells.kinds[0].law = data::Kind::Law::rigid;
  EXPECT_TRUE(std::isnan(recovery_time(scene)));
}

}  // namespace
}  // namespace hemowalk::resolved
