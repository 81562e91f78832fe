/// The 95 published trajectories: the deterministic point values of docs/reference.md, and the errors as
/// stated.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calibration/calibration.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;

const std::string folder = std::string(HEMOWALK_SOURCE_DIR) + "/../shared/data/kotsalos2020_platelets";

class Published : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::is_directory(folder)) return;
    runs = new std::vector<data::Trajectories>{import_text_folder(folder)};
    result = new Calibration(calibrate(*runs, Options{}));
  }
  void SetUp() override {
    if (!result) GTEST_SKIP() << "published trajectories are not here (" << folder << ")";
  }
  static inline std::vector<data::Trajectories>* runs = nullptr;
  static inline Calibration* result = nullptr;
};

TEST_F(Published, PointValuesToOnePercent) {
  EXPECT_NEAR(result->find("paper")->D, 1.002e-10, 0.01 * 1.002e-10);
  EXPECT_EQ(result->find("paper")->n, 75);
  EXPECT_NEAR(result->find("paper_all")->D, 0.977e-10, 0.01 * 0.977e-10);
  EXPECT_EQ(result->find("paper_all")->n, 95);
  EXPECT_NEAR(result->find("plateau")->D, 1.250e-10, 0.01 * 1.250e-10);
  EXPECT_NEAR(result->find("plateau")->lag, 20e-3, 1e-9);
}

// The stated errors are bootstrap errors themselves (two digits); two bootstraps over the same 95 platelets
// with 1000 draws agree to 1/sqrt(2 * 1000) = 2.2 %, rounding adds up to 6 %, choices of the statistic some
// per cent.
TEST_F(Published, ErrorsAsStated) {
  EXPECT_NEAR(result->find("paper")->sigma, 0.17e-10, 0.15 * 0.17e-10);
  EXPECT_NEAR(result->find("plateau")->sigma, 0.051e-10, 0.15 * 0.051e-10);
}

TEST_F(Published, KurtosisFallsWithLag) {
  const auto at = [&](double lag) {
    for (std::size_t k = 0; k < result->kurtosis.lag.size(); ++k)
      if (std::abs(result->kurtosis.lag[k] - lag) < 1e-6) return result->kurtosis.excess[k];
    return std::nan("");
  };
  // The method note does not say which layer and origins its 68, 2.2 and 0.15 use; the choice moves them by
  // this much.
  EXPECT_NEAR(at(1e-3), 68, 10);
  EXPECT_NEAR(at(20e-3), 2.2, 0.5);
  EXPECT_NEAR(at(100e-3), 0.15, 0.1);
}

TEST_F(Published, PeriodIsReadOffTheData) {
  const data::Trajectories& t = runs->front();
  EXPECT_NEAR(t.box[0], 49.5e-6, 1e-12);
  EXPECT_NEAR(t.box[2], 49.5e-6, 1e-12);
  EXPECT_NEAR(t.walls_y[0], 1e-6, 1e-12);
  EXPECT_TRUE(std::isnan(t.kappa_damping));
  EXPECT_NEAR(t.time[302] - t.time[301], 0.75e-3, 1e-9);
}

// What the method note found wrong with these trajectories, by name.
TEST_F(Published, GateFiresAndSaysWhy) {
  EXPECT_FALSE(result->law.gate.passed);
  const auto value = [&](const std::string& name) {
    for (const auto& f : result->law.gate.findings)
      if (f.name == name) {
        EXPECT_FALSE(f.passed) << name;
        EXPECT_FALSE(f.note.empty()) << name;
        return f.value;
      }
    ADD_FAILURE() << "no finding " << name;
    return std::nan("");
  };
  EXPECT_NEAR(value("cross_stream_jumps"), 0.0035, 0.0005);
  EXPECT_NEAR(value("vorticity_velocity_over_wall"), 0.93 / 4.8, 0.02);
  EXPECT_LT(value("core_shear_over_nominal"), 0.75);
  EXPECT_GT(value("wall_symmetry"), 1.8);
  EXPECT_GT(value("max_displacement_over_wall"), 2.7);
  value("velocity_antisymmetry");
}

TEST_F(Published, RemovingJumpsLowersD) {
  const double ratio = result->find("without_jumps")->D / result->find("plateau")->D;
  EXPECT_LT(ratio, 1 - 0.14);  // the note says 16 % at this threshold, up to 29 % below it
  EXPECT_GT(ratio, 1 - 0.29);
}

TEST_F(Published, PlateletsLeaveTheWallAgain) {
  EXPECT_EQ(result->residence.near_at_t0, 16);
  EXPECT_EQ(result->residence.left_of_t0, 13);
}

TEST_F(Published, HeavyTailsDoNotSurviveCoarseGraining) {
  EXPECT_EQ(result->step_choices.front().best, "heavy_tail");
  EXPECT_EQ(result->law.step_law.kind, "gaussian");
  EXPECT_NEAR(result->law.valid.dt_min, 50e-3, 1e-6);
}

TEST_F(Published, UnseenPlateletsAreAsPredicted) {
  for (std::size_t k = 0; k < result->holdout.lag.size(); ++k) {
    EXPECT_NEAR(result->holdout.msd_ratio[k], 1, 3.5 * result->holdout.msd_sigma[k]);
    EXPECT_GT(result->holdout.histogram_p[k], 1e-3);
  }
}

TEST_F(Published, JsonHasOnlyFiniteNumbersAndTheContractKeys) {
  const auto j = nlohmann::ordered_json::parse(to_json(*result));
  EXPECT_EQ(j.begin().key(), "format");
  for (const char* key :
       {"version", "input_sha256", "seed", "warnings", "n_platelets", "duration_s", "walls_y_m", "estimators",
        "profile", "kurtosis", "gate", "verdict", "law_file", "wall_s"})
    EXPECT_TRUE(j.contains(key)) << key;
  EXPECT_EQ(j["input_sha256"].get<std::string>().size(), 64u);
}

}  // namespace
