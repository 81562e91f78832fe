/// \file The face: run, method, warnings, the law's uncertainty, JSON and HDF5.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "coarse/simulation.hpp"
#include "core/check.hpp"
#include "core/hdf5.hpp"
#include "support/coarse_exact.hpp"

namespace hemowalk::coarse {
namespace {

Case impact_r(double D) {
  Case c;
  c.constant_D = D;
  c.walkers = 50'000;
  c.dt = 1;
  c.end = 300;
  c.output = {20, 60, 120, 300};
  c.seed = 3;
  c.input_sha256 = "abc";
  return c;
}

data::TransportLaw uncertain(double D, double sigma) {
  data::TransportLaw law = data::TransportLaw::constant(D);
  law.core.D_sigma = sigma;
  law.conditions.shear_rate = 100;
  law.valid.shear_rate = {50, 200};
  return law;
}

TEST(CoarseRun, GivesTheSeriesWithItsSamplingError) {
  const Case c = impact_r(1e-10);
  const Result r = run(c, data::TransportLaw::constant(1e-10));
  EXPECT_EQ(r.method, "walk");
  ASSERT_EQ(r.time, c.output);
  for (std::size_t k = 0; k < 4; ++k) {
    const double p = absorbed_exactly(1e-10, c.output[k], c.height);
    EXPECT_NEAR(r.absorbed_sigma[k], std::sqrt(p * (1 - p) / 50'000.0), 0.05 * r.absorbed_sigma[k]);
    EXPECT_LT(std::abs(r.absorbed_fraction[k] - p), normal_quantile(1 - alpha / 2) * r.absorbed_sigma[k]);
    EXPECT_TRUE(std::isnan(r.absorbed_law_sigma[k]));  // a bare D states no uncertainty
    double free = 0;
    for (std::size_t i = 0; i < r.profile.y.size(); ++i) free += r.profile.c[k * r.profile.y.size() + i];
    EXPECT_NEAR(free / static_cast<double>(r.profile.y.size()) + r.absorbed_fraction[k], 1, 1e-12);
  }
  EXPECT_GT(r.walker_steps_per_s, 0);
}

/// Walkers let go in a layer spread as the equation says: every bin of the profile within its own counting
/// error (Bonferroni over bins and times), and the first output is the layer itself.
TEST(CoarseRun, ReleasesWalkersInALayer) {
  Case c = impact_r(1e-10);
  c.height = 50e-6, c.dt = 0.05, c.end = 5, c.output = {0, 0.5, 5};
  c.walkers = 200'000;
  c.release = {10e-6, 12.5e-6};
  RunOptions o;
  o.bins = 20;
  const Result walked = run(c, data::TransportLaw::constant(1e-10), o);
  o.fokker_planck = true;
  const Result solved = run(c, data::TransportLaw::constant(1e-10), o);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_DOUBLE_EQ(walked.profile.c[i], i == 4 ? 20 : 0);
    EXPECT_NEAR(solved.profile.c[i], i == 4 ? 20 : 0, 1e-9);
  }
  const double bound = normal_quantile(1 - alpha / 80);
  for (std::size_t k = 20; k < 60; ++k) {
    const double p = solved.profile.c[k] / 20;  // share of the walkers in the bin
    EXPECT_LT(std::abs(walked.profile.c[k] / 20 - p), bound * std::sqrt(p * (1 - p) / 2e5) + 1e-4) << k;
  }
  for (const auto& layer : {std::array{5e-6, 5e-6}, std::array{-1e-6, 5e-6}, std::array{40e-6, 51e-6}}) {
    c.release = layer;
    EXPECT_THROW(run(c, data::TransportLaw::constant(1e-10)), InputError);
  }
}

TEST(CoarseRun, CarriesTheLawsUncertaintyToTheResult) {
  Case c = impact_r(0);
  c.constant_D.reset();
  c.shear_rate = 100;
  RunOptions o;
  o.fokker_planck = true;
  const Result r = run(c, uncertain(1e-10, 1e-11), o);
  for (std::size_t k = 0; k < 4; ++k) {
    // linear propagation: sigma |d absorbed/dD|; 10 % in D bends the root a little
    const double t = c.output[k],
                 slope = (absorbed_exactly(1.01e-10, t, c.height) - absorbed_exactly(0.99e-10, t, c.height)) /
                         0.02e-10;
    EXPECT_NEAR(r.absorbed_law_sigma[k] / (slope * 1e-11), 1, 0.02) << t;
    EXPECT_NEAR(r.absorbed_fraction[k], absorbed_exactly(1e-10, t, c.height), 2e-4);
    EXPECT_EQ(r.absorbed_sigma[k], 0);
  }
  auto exponent_only = uncertain(1e-10, 0);
  exponent_only.scaling.shear_exponent = 1;
  exponent_only.scaling.sigma = 0.2;
  c.shear_rate = 150;  // D x 1.5^(1 +- 0.2): 8.1 %
  const Result e = run(c, exponent_only, o);
  EXPECT_NEAR(e.absorbed_law_sigma[0] / r.absorbed_law_sigma[0] / std::sqrt(1.5) / 0.81, 1, 0.05);
  o.law_draws = 0;
  EXPECT_TRUE(std::isnan(run(c, exponent_only, o).absorbed_law_sigma[0]));
}

// place: device, its kernels run by the host: the same walk but for walkers whose fate hangs on a rounding.
TEST(CoarseRun, GivesTheSameOnTheDevice) {
  Case c = impact_r(1e-10);
  RunOptions o;
  o.device = Place::host;
  const Result host = run(c, {}, o);
  c.place = Place::device;
  const Result device = run(c, {}, o);
  EXPECT_EQ(device.reason, host.reason + ", on the device");
  EXPECT_GT(device.walker_steps_per_s, 0);
  ASSERT_EQ(device.absorbed_fraction.size(), 4u);
  const double one = 1.0 / static_cast<double>(c.walkers);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(device.absorbed_fraction[k], host.absorbed_fraction[k], 5 * one);
  ASSERT_EQ(device.profile.c.size(), host.profile.c.size());
  for (std::size_t i = 0; i < host.profile.c.size(); ++i)
    EXPECT_NEAR(device.profile.c[i], host.profile.c[i], 5 * 64 * one);
  o.track_flow_direction = true;
  c.bottom.type = Face::Type::reflect;
  EXPECT_THROW(run(c, {}, o), InputError) << "the device does not keep the way along the flow";
}

TEST(CoarseRun, WarnsOutsideTheLawAndRefusesWhenStrict) {
  Case c = impact_r(0);
  c.constant_D.reset();
  c.walkers = 100;
  c.shear_rate = 1000;
  const auto law = uncertain(1e-10, 0);
  EXPECT_EQ(run(c, law).warnings.size(), 1u);
  RunOptions strict;
  strict.strict = true;
  EXPECT_THROW(run(c, law, strict), Refused);
  c.shear_rate = 100;
  EXPECT_NO_THROW(run(c, law, strict));
}

TEST(CoarseRun, ReportsWholeSteps) {
  Case c = impact_r(1e-10);
  c.walkers = 100;
  c.dt = 0.7;
  c.output = {1, 2.1};
  const Result r = run(c, data::TransportLaw::constant(1e-10));
  EXPECT_DOUBLE_EQ(r.time[0], 0.7);
  EXPECT_DOUBLE_EQ(r.time[1], 2.1);
  EXPECT_EQ(r.warnings.size(), 1u);
  c.output = {400};
  EXPECT_THROW(run(c, data::TransportLaw::constant(1e-10)), InputError);
}

TEST(CoarseRun, TakesTheStepLawFromTheLaw) {
  Case c = impact_r(0);
  c.constant_D.reset();
  c.walkers = 2000;
  c.end = 5;
  c.output = {5};
  auto law = uncertain(1e-10, 0);
  law.step_law.kind = "persistent";
  law.step_law.memory = 0.5;
  EXPECT_NE(run(c, law).reason.find("persistent"), std::string::npos);
  law.step_law.kind = "heavy_tail";
  EXPECT_THROW(run(c, law), InputError);  // no exponent
  law.step_law.tail_exponent = 4;
  law.step_law.tail_fraction = 0.05;
  EXPECT_NE(run(c, law).reason.find("heavy"), std::string::npos);
  law.step_law.kind = "levy";
  EXPECT_THROW(run(c, law), InputError);
}

TEST(CoarseRun, TracksTheFlowOnlyWhereNobodyIsLost) {
  Case c = impact_r(1e-10);
  c.walkers = 1000;
  c.shear_rate = 100;
  c.output = {20};
  RunOptions o;
  o.track_flow_direction = true;
  EXPECT_THROW(run(c, data::TransportLaw::constant(1e-10), o), InputError);
  c.bottom.type = Face::Type::reflect;
  const Result r = run(c, data::TransportLaw::constant(1e-10), o);
  // mean position of 1000 uniform walkers: H/2 +- H/sqrt(12 x 1000)
  EXPECT_NEAR(r.flow.mean_z.at(0) / (100 * c.height / 2 * 20), 1, 4 * 2 / std::sqrt(12000.0));
}

TEST(CoarseOutput, JsonHasTheContractsKeysAndNoNaN) {
  const Case c = impact_r(1e-10);
  RunOptions o;
  o.fokker_planck = true;
  const Result r = run(c, data::TransportLaw::constant(1e-10), o);
  const auto j = nlohmann::ordered_json::parse(to_json(r, c));
  std::vector<std::string> first;
  for (auto it = j.begin(); first.size() < 5; ++it) first.push_back(it.key());
  EXPECT_EQ(first, (std::vector<std::string>{"format", "version", "input_sha256", "seed", "warnings"}));
  EXPECT_EQ(j["format"], "hemowalk.coarse/1");
  EXPECT_EQ(j["method"], "fokker_planck");
  EXPECT_EQ(j["time_s"].size(), 4u);
  EXPECT_TRUE(j["absorbed_law_sigma"][0].is_null());
  EXPECT_TRUE(j["walkers"].is_null());
  EXPECT_EQ(j["profile"]["c"].size(), 4u);
  EXPECT_EQ(j["profile"]["c"][0].size(), j["profile"]["y_m"].size());
}

TEST(CoarseOutput, FileReadsBackWithUnits) {
  Case c = impact_r(1e-10);
  c.walkers = 1000;
  const Result r = run(c, data::TransportLaw::constant(1e-10));
  const auto folder =
      std::filesystem::temp_directory_path() / ("hemowalk_coarse_" + std::to_string(getpid()));
  const std::string path = folder / "coarse" / "test.h5";
  write_result(r, c, path);
  auto file = hdf5::File::open(path);
  EXPECT_EQ(file.read("/absorbed_fraction"), r.absorbed_fraction);
  EXPECT_EQ(file.read("/profile/c"), r.profile.c);
  EXPECT_EQ(file.shape("/profile/c"), (hdf5::Shape{4, r.profile.y.size()}));
  EXPECT_EQ(file.units("/time"), "s");
  EXPECT_EQ(file.units("/profile/y"), "m");
  EXPECT_EQ(file.text_attribute("method"), "walk");
  file.close();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace hemowalk::coarse
