/// \file --json: exactly one object on stdout with the contract's keys, whatever the verb and however it
/// ends.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/device.hpp"
#include "integration/program.hpp"

namespace hemowalk::test {
namespace {

using Json = nlohmann::ordered_json;

const char* const campaign =
    "format: hemowalk.campaign/1\n"
    "trajectories: [{name: one, synthetic: {platelets: 20, duration: 600 ms}}]\n"
    "calibrate: {t0: 100 ms, bootstrap: 50}\n"
    "coarse: [{name: device, walkers: 1e4, dt: 1 s, end: 60 s}]\n"
    "out: results\n";

/// Parses stdout as a whole and checks its head; fails the test otherwise.
Json object_of(const Outcome& outcome, const std::string& verb) {
  const Json object = Json::parse(outcome.out, nullptr, false);
  EXPECT_TRUE(object.is_object()) << verb << " printed:\n" << outcome.out << outcome.err;
  if (!object.is_object()) return Json::object();
  std::vector<std::string> first;
  for (const auto& [key, value] : object.items())
    if (first.size() < 5) first.push_back(key);
  EXPECT_EQ(first, (std::vector<std::string>{"format", "version", "input_sha256", "seed", "warnings"}))
      << verb;
  EXPECT_EQ(object.value("format", ""), "hemowalk." + verb + "/1");
  EXPECT_TRUE(object.contains("warnings") && object["warnings"].is_array()) << verb;
  return object;
}

TEST(Json, BenchTellsPartsCeilingsAndMomentum) {
  const Scratch scratch;
  const auto bench = object_of(hemowalk(scratch, "bench --scene box20 --steps 3 --json"), "bench");
  EXPECT_EQ(bench["nodes"], 64000);
  EXPECT_EQ(bench["markers"], 30 * 258 + 6 * 66);
  EXPECT_EQ(bench["precision"], "single");
  double sum = 0;
  for (const char* part :
       {"fluid", "interpolation", "spreading", "solid", "contact", "communication", "other"}) {
    ASSERT_TRUE(bench["parts_ms"].contains(part)) << part;
    EXPECT_GE(bench["parts_ms"][part], 0) << part;
    sum += bench["parts_ms"][part].get<double>();
  }
  // Medians of parts need not add up to the median of the whole; on three steps of a busy machine within a
  // factor.
  EXPECT_GT(sum, 0.2 * bench["step_ms"]["median"].get<double>());
  EXPECT_LE(bench["step_ms"]["min"], bench["step_ms"]["median"]);
  EXPECT_GT(bench["ceilings"]["bandwidth_gb_per_s"], 0);
  EXPECT_GT(bench["ceilings"]["fma_gflop_per_s"], 0);
  EXPECT_EQ(bench["fluid"]["bytes_per_node"], 200);
  EXPECT_GT(bench["memory_mb"], 64000 * (19 + 8) * 4e-6);
  EXPECT_LT(bench["momentum_residual_rel"], 1e-5);

  const auto many = object_of(hemowalk(scratch, "bench --scene box20,box20 --steps 1 --json"), "bench");
  EXPECT_EQ(many["scenes"].size(), 2U);
  const auto unknown = hemowalk(scratch, "bench --scene box21 --json");
  EXPECT_EQ(unknown.code, 2) << unknown.err;
  EXPECT_NE(unknown.err.find("box20"), std::string::npos);
}

TEST(Json, EveryVerbPrintsOneObject) {
  const Scratch scratch;
  scratch.write("campaign.yaml", campaign);
  scratch.write("device.yaml",
                "format: hemowalk.coarse/1\nlaw: {D: 100 um2/s}\nwalkers: 1e4\ndt: 1 s\nend: 60 s\n");
  const auto check = object_of(hemowalk(scratch, "check campaign.yaml --json"), "check");
  EXPECT_EQ(check.value("kind", ""), "campaign");

  const auto plan = object_of(hemowalk(scratch, "plan campaign.yaml --json"), "plan");
  ASSERT_EQ(plan["runs"].size(), 1U);
  for (const char* key : {"hash", "action", "reason", "estimate"})
    EXPECT_TRUE(plan["runs"][0].contains(key)) << key;
  EXPECT_EQ(plan["runs"][0]["action"], "new");

  const auto run = object_of(hemowalk(scratch, "run campaign.yaml --json"), "run");
  EXPECT_EQ(run["runs"], 1);
  EXPECT_EQ(run["done"], 1);
  EXPECT_EQ(run["cached"], 0);
  EXPECT_EQ(object_of(hemowalk(scratch, "run campaign.yaml --json"), "run")["cached"], 1);

  const auto status = object_of(hemowalk(scratch, "status campaign.yaml --json"), "status");
  ASSERT_EQ(status["runs"].size(), 1U);
  EXPECT_EQ(status["runs"][0]["state"], "done");
  EXPECT_EQ(status["runs"][0]["hash"], plan["runs"][0]["hash"]);

  object_of(hemowalk(scratch, "report results --json"), "report");

  const std::string folder = "results/runs/" + plan["runs"][0]["hash"].get<std::string>();
  const auto calibrate =
      object_of(hemowalk(scratch, "calibrate " + folder + " --t0 100ms --bootstrap 50 --json"), "calibrate");
  for (const char* key : {"n_platelets", "duration_s", "walls_y_m", "estimators", "profile", "kurtosis",
                          "gate", "verdict", "law_file", "wall_s"})
    EXPECT_TRUE(calibrate.contains(key)) << key;
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / calibrate["law_file"].get<std::string>()));

  const auto walk = object_of(hemowalk(scratch, "coarse device.yaml --json"), "coarse");
  for (const char* key : {"method", "reason", "time_s", "absorbed_fraction", "absorbed_sigma",
                          "absorbed_law_sigma", "profile", "walkers", "walker_steps_per_s", "wall_s"})
    EXPECT_TRUE(walk.contains(key)) << key;
}

const std::string slab =
    "format: hemowalk.coarse/1\nlaw: {D: 100 um2/s}\nwalkers: 1e5\ndt: 1 s\nend: 600 s\nplace: ";

// Nothing is started or written that this machine cannot finish; a check elsewhere only warns.
TEST(DevicePlace, IsRefusedWhereThereIsNoGpu) {
  if (device_present()) GTEST_SKIP() << "there is a device";
  const Scratch scratch;
  scratch.write("slab.yaml", slab + "device\n");
  scratch.write("scene.yaml",
                "format: hemowalk.scene/1\ndomain: {size: [10 um, 10 um, 10 um]}\ntime: {end: 1 us}\n"
                "place: {fluid: device, coupling: device, solid: device}\n");
  std::string with_device = campaign;
  with_device.replace(with_device.find("end: 60 s"), 9, "end: 60 s, place: device");
  scratch.write("campaign.yaml", with_device);
  for (const char* words : {"coarse slab.yaml --out results", "resolve scene.yaml --out results",
                            "run campaign.yaml --out results"}) {
    const auto refused = hemowalk(scratch, words);
    EXPECT_EQ(refused.code, 2) << words << refused.err;
    EXPECT_NE(refused.err.find("no GPU is visible, or this program was built without CUDA"),
              std::string::npos)
        << words << refused.err;
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "results")) << words;
  }
  for (const char* words : {"check slab.yaml --json", "check campaign.yaml --json"}) {
    const auto check = hemowalk(scratch, words);
    EXPECT_EQ(check.code, 0) << check.err;
    EXPECT_EQ(object_of(check, "check")["warnings"].size(), 1u) << words;
  }
  scratch.write("nowhere.yaml", slab + "gpu\n");
  const auto unknown = hemowalk(scratch, "check nowhere.yaml");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.err.find("nowhere.yaml:6:8"), std::string::npos) << unknown.err;
}

// The same random numbers: of 100 000 walkers below one in a thousand may fare otherwise by a rounding.
TEST(DevicePlace, WalksTheSameWalk) {
  if (!device_present()) GTEST_SKIP() << "no GPU is visible, or this program was built without CUDA";
  const Scratch scratch;
  Json walk[2];
  for (const char* place : {"host", "device"}) {
    scratch.write("slab.yaml", slab + place + "\n");
    walk[place[0] == 'd'] = object_of(hemowalk(scratch, "coarse slab.yaml --json"), "coarse");
  }
  EXPECT_NE(walk[1]["reason"].get<std::string>().find("on the device"), std::string::npos);
  EXPECT_GT(walk[0]["absorbed_fraction"][0], 0.1);
  EXPECT_NEAR(walk[0]["absorbed_fraction"][0], walk[1]["absorbed_fraction"][0], 1e-3);
}

TEST(Json, ErrorsAreObjectsToo) {
  const Scratch scratch;
  scratch.write("bad.yaml", "format: hemowalk.campaign/1\nreplica: 3\n");
  const auto bad = hemowalk(scratch, "run bad.yaml --json");
  EXPECT_EQ(bad.code, 2);
  const auto object = object_of(bad, "run");
  EXPECT_EQ(object["error"]["exit_code"], 2);
  EXPECT_NE(object["error"]["message"].get<std::string>().find("bad.yaml:2:1"), std::string::npos);

  const auto usage = hemowalk(scratch, "plan --nonsense --json");
  EXPECT_EQ(usage.code, 2);
  EXPECT_TRUE(Json::parse(usage.out, nullptr, false).is_object()) << usage.out;
}

TEST(Json, TheSeedOfTheCommandLineArrives) {
  const Scratch scratch;
  scratch.write("campaign.yaml", campaign);
  const auto a = object_of(hemowalk(scratch, "plan campaign.yaml --json"), "plan"),
             b = object_of(hemowalk(scratch, "plan campaign.yaml --seed 7 --json"), "plan");
  EXPECT_EQ(b["seed"], 7);
  EXPECT_EQ(b["runs"][0]["seed"], 7);
  EXPECT_NE(a["runs"][0]["hash"], b["runs"][0]["hash"]);
}

}  // namespace
}  // namespace hemowalk::test
