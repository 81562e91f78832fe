// Calibration's hold-out with the coarse walk: the law as it is handed on, walked as a user would walk it,
// predicts cells that the fit has not seen.
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/synthetic.hpp"
#include "workflow/coarse_walk.hpp"

namespace hemowalk::workflow {
namespace {

calibration::Calibration calibrated(const calibration::Walk& walk) {
  calibration::Synthetic truth;
  truth.platelets = 200;
  truth.D_contrast = 0.3;
  calibration::Options options;
  options.bootstrap = 50;
  options.walk = walk;
  return calibration::calibrate({calibration::generate(truth)}, options);
}

// Four standard errors; the walk and the propagator predict the same but for the walk's step (its weak error
// at the walls) and 4096 walkers per bin.
TEST(HoldoutWalk, PredictsUnseenCells) {
  const auto c = calibrated(coarse_walk());
  ASSERT_GE(c.holdout_walk.lag.size(), 3u);
  ASSERT_EQ(c.holdout_walk.lag, c.holdout.lag);
  for (std::size_t k = 0; k < c.holdout_walk.lag.size(); ++k) {
    EXPECT_NEAR(c.holdout_walk.msd_ratio[k], 1, 4 * c.holdout_walk.msd_sigma[k]);
    EXPECT_NEAR(c.holdout_walk.msd_ratio[k] / c.holdout.msd_ratio[k], 1, 0.03);
    EXPECT_GT(c.holdout_walk.histogram_p[k], 5e-4);
  }
  EXPECT_GT(c.holdout_walk.profile_p, 5e-4);
}

// The same statistics see a walk that is 30 % too fast.
TEST(HoldoutWalk, SeesAWalkThatIsTooFast) {
  const auto c = calibrated([](data::TransportLaw law, const auto& walls, int bins, const auto& lags) {
    for (double& D : law.profile.D) D *= 1.3;
    return coarse_walk()(law, walls, bins, lags);
  });
  EXPECT_GT(1 - c.holdout_walk.msd_ratio[0], 4 * c.holdout_walk.msd_sigma[0]);
  EXPECT_LT(c.holdout_walk.histogram_p[0], 5e-4);
}

}  // namespace
}  // namespace hemowalk::workflow
