#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "core/check.hpp"
#include "core/io.hpp"
#include "workflow/campaign.hpp"

using namespace hemowalk;
using namespace hemowalk::workflow;
namespace fs = std::filesystem;

namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

template <class Read>
std::string errors_of(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string campaign_errors(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return errors_of([&] { parse_campaign("format: hemowalk.campaign/1\n" + text, "c.yaml", overrides); });
}
Campaign campaign(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_campaign("format: hemowalk.campaign/1\n" + text, "c.yaml", overrides);
}
std::string case_errors(const std::string& text) {
  return errors_of([&] { coarse::parse_case("format: hemowalk.coarse/1\n" + text, "k.yaml"); });
}

const std::string inline_scene = "scene: {cells: {hematocrit: 0.35}, time: {end: 0.5 s}}\n";

class CampaignFiles : public testing::Test {
 protected:
  CampaignFiles() : folder(fs::temp_directory_path() / ("hemowalk_campaign_" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~CampaignFiles() override { fs::remove_all(folder); }
  fs::path folder;
};

}  // namespace

// coarse.yaml
// -----------------------------------------------------------------------------------------------------------

TEST(SchemaCoarse, ValuesArriveInSi) {
  const auto c = coarse::parse_case(R"(format: hemowalk.coarse/1
law: {D: 1e-10 m2/s}
domain: {height: 0.82 mm, bottom: absorb, top: reflect}
flow: {couette: 100 1/s}
walkers: 1e6
dt: 10 ms
end: 300 s
output: [20 s, 60 s, 2 min, 300 s]
initial: uniform
seed: 7
)",
                                    "dir/impact_r.yaml");
  EXPECT_EQ(c.constant_D, 1e-10);
  EXPECT_EQ(c.height, 0.82e-3);
  EXPECT_EQ(c.bottom.type, coarse::Face::Type::absorb);
  EXPECT_EQ(c.top.type, coarse::Face::Type::reflect);
  EXPECT_EQ(c.shear_rate, 100);
  EXPECT_EQ(c.walkers, 1000000);
  EXPECT_EQ(c.dt, 0.01);
  EXPECT_EQ(c.output, (std::vector<double>{20, 60, 120, 300}));
  EXPECT_EQ(c.seed, 7u);
  EXPECT_EQ(c.name, "impact_r");
}

TEST(SchemaCoarse, Faces) {
  const auto c = coarse::parse_case(
      "format: hemowalk.coarse/1\nlaw: {D: 1 um2/s}\ndomain: {bottom: {robin: 2 mm/s}, top: {trap: 3 s}}\n",
      "k");
  EXPECT_EQ(c.bottom.type, coarse::Face::Type::robin);
  EXPECT_EQ(c.bottom.rate, 2e-3);
  EXPECT_EQ(c.top.type, coarse::Face::Type::trap);
  EXPECT_EQ(c.top.rate, 3);
  EXPECT_EQ(c.output, std::vector<double>{300});
  const auto d = coarse::parse_case(
      "format: hemowalk.coarse/1\nlaw: {D: 1 um2/s}\ndomain: {bottom: {trap: {residence: 3 s, layer: 4 "
      "um}}}\n",
      "k");
  EXPECT_EQ(d.bottom.rate, 3);
  EXPECT_EQ(d.bottom.layer, 4e-6);
}

TEST(SchemaCoarse, Errors) {
  const std::string D = "law: {D: 1e-10 m2/s}\n";
  EXPECT_EQ(case_errors(D), "");
  EXPECT_TRUE(contains(case_errors(""), "`law` is missing"));
  EXPECT_TRUE(contains(case_errors("law: nowhere.yaml\n"), "k.yaml:2:6: law: file"));
  EXPECT_TRUE(contains(case_errors("law: {D: 1e-10}\n"),
                       "has no unit (a diffusivity or kinematic viscosity is expected) write 1e-10 um2/s"));
  EXPECT_TRUE(contains(case_errors(D + "output: [2 s, 1 s]\n"), "output.1: 1 s is not after"));
  EXPECT_TRUE(contains(case_errors(D + "end: 1 s\noutput: [2 s]\n"), "output.0: 2 s is after end"));
  EXPECT_TRUE(contains(case_errors(D + "walkers: 1.5\n"), "not a whole number"));
  EXPECT_TRUE(contains(case_errors(D + "walkers: 0\n"), "out of range"));
  EXPECT_TRUE(contains(case_errors(D + "dt: 2 s\nend: 1 s\n"), "not one step fits"));
  EXPECT_TRUE(contains(case_errors(D + "domain: {bottom: periodic}\n"), "make both periodic"));
  EXPECT_TRUE(contains(case_errors(D + "domain: {bottom: absorbb}\n"), "did you mean `absorb`?"));
  EXPECT_TRUE(contains(case_errors(D + "domain: {bottom: {robin: 3 s}}\n"),
                       "measures a time (a velocity is expected)"));
  EXPECT_TRUE(contains(case_errors(D + "domain: {bottom: {robbin: 3 mm/s}}\n"), "did you mean `robin`?"));
  EXPECT_TRUE(contains(case_errors(D + "name: a/b\n"), "names a file"));
}

// campaign.yaml
// ---------------------------------------------------------------------------------------------------------

TEST(SchemaCampaign, DefaultsAndSettings) {
  const auto c = campaign(inline_scene + R"(calibrate: {t0: 200 ms, lag: 15 ms, layer: [10 um, 40 um]}
launcher: {type: local, slots: 2, ranks: 3, threads: 4}
on_failure: {action: retry, attempts: 5}
out: results
coarse: [{law: {D: 1e-10 m2/s}}, {name: device, domain: {height: 1 mm}}]
)");
  EXPECT_EQ(c.name, "c");
  EXPECT_EQ(c.calibrate.t0, 0.2);
  EXPECT_EQ(c.calibrate.lag, 0.015);
  EXPECT_EQ((*c.calibrate.core)[1], 4e-5);
  EXPECT_EQ(c.launcher.slots, 2);
  EXPECT_EQ(c.launcher.ranks, 3);
  EXPECT_EQ(c.launcher.threads, 4);
  EXPECT_EQ(c.on_failure.action, OnFailureAction::retry);
  EXPECT_EQ(c.on_failure.attempts, 5);
  EXPECT_EQ(c.out, "results");
  ASSERT_EQ(c.coarse.size(), 2u);
  EXPECT_EQ(c.coarse[0].name, "coarse1");
  EXPECT_EQ(c.coarse[1].name, "device");
  EXPECT_FALSE(c.coarse[1].constant_D);
  EXPECT_TRUE(c.coarse[1].law_file.empty());
  const auto d = campaign(inline_scene);
  EXPECT_EQ(d.calibrate.t0, 0.3);
  EXPECT_FALSE(d.calibrate.lag);
  EXPECT_FALSE(d.calibrate.core);
  EXPECT_EQ(d.out, "out/c");
  EXPECT_EQ(d.seed(), 1u);
}

TEST(SchemaCampaign, ASweepIsTheProductLastKeyFastest) {
  const auto c = campaign(inline_scene +
                          "sweep: {cells.kinds.rbc.kappa_damping: [0.5, 0.9], domain.size.1: [50 um, 100 um, "
                          "500 um]}\nreplicas: 2\n");
  const auto runs = expand(c);
  ASSERT_EQ(runs.size(), 12u);
  std::set<std::string> hashes;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto& run = runs[i];
    EXPECT_EQ(run.point, i / 2);
    EXPECT_EQ(run.replica, static_cast<int>(i % 2));
    EXPECT_EQ(run.scene.find_kind("rbc")->kappa_damping, i < 6 ? 0.5 : 0.9);
    EXPECT_EQ(run.scene.domain.size[1], (std::vector<double>{5e-5, 1e-4, 5e-4})[i / 2 % 3]);
    EXPECT_EQ(run.labels[0].second, i < 6 ? "0.5" : "0.9");
    EXPECT_EQ(run.labels[1].first, "domain.size.1");
    EXPECT_EQ(run.scene.seed == 1, run.replica == 0);
    EXPECT_EQ(run.scene.seed, replica_seed(1, run.replica));
    EXPECT_EQ(run.hash12.size(), 12u);
    EXPECT_TRUE(hashes.insert(run.hash12).second);
  }
  EXPECT_EQ(c.title(), "c: kappa_damping = 0.5, 0.9 x size.1 = 50 um, 100 um, 500 um x 2 replicas");
}

TEST(SchemaCampaign, ZipTakesValuesTogether) {
  const auto runs =
      expand(campaign(inline_scene + "sweep: {fluid.dx: [0.5 um, 0.25 um], fluid.tau: [2, 1]}\nzip: true\n"));
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[1].scene.fluid.dx, 2.5e-7);
  EXPECT_EQ(runs[1].scene.fluid.tau, 1);
  EXPECT_TRUE(
      contains(campaign_errors(inline_scene + "sweep: {fluid.dx: [0.5 um], fluid.tau: [2, 1]}\nzip: true\n"),
               "c.yaml:3:41: sweep.fluid.tau: 2 values, fluid.dx has 1"));
}

TEST(SchemaCampaign, ReplicaSeedsDifferAndAreExactInADouble) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t seed : {0ull, 1ull, 2ull})
    for (int r = 0; r < 100; ++r) {
      const auto s = replica_seed(seed, r);
      EXPECT_TRUE(seeds.insert(s).second);
      EXPECT_EQ(static_cast<std::uint64_t>(static_cast<double>(s)), s);
    }
  EXPECT_EQ(replica_seed(5, 0), 5u);
}

TEST(SchemaCampaign, AllProblemsOfAllScenesAtTheirPlaces) {
  const std::string errors = campaign_errors(R"(scene:
  fluid: {tau: 0.1}
  flow: {shear_rat: 1 1/s}
sweep:
  fluid.tou: [1]
  domain.size.1: [50.3 um, 4 s]
zip: yes
coarse: [nofile.yaml, {dt: 4}]
replicas: 0
sceen: x
)");
  for (const char* part :
       {"c.yaml:3:16: fluid.tau: `0.1` is out of range",
        "c.yaml:4:10: unknown key `flow.shear_rat` (not part of this format) did you mean `shear_rate`?",
        "c.yaml:6:3: unknown key `fluid.tou` (not part of this format) did you mean `fluid.tau`?",
        "c.yaml:7:19: domain.size.1: 50.3 um is no whole multiple",
        "c.yaml:7:28: domain.size.1: `s` measures a time", "c.yaml:8:6: zip: `yes` is not a truth value",
        "c.yaml:9:10: file `nofile.yaml` does not exist", "c.yaml:9:28: dt: `4` has no unit",
        "c.yaml:10:11: replicas: `0` is out of range",
        "c.yaml:11:1: unknown key `sceen` (not part of this format) did you mean `scene`?"})
    EXPECT_TRUE(contains(errors, part)) << part << "\n--\n" << errors;
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 9) << errors;
}

TEST(SchemaCampaign, WhatItStartsFrom) {
  EXPECT_TRUE(contains(campaign_errors("scene:\n"), "c.yaml:2:1: scene: no value"));
  EXPECT_TRUE(contains(campaign_errors("scene: [1]\n"), "c.yaml:2:8: "));
  EXPECT_TRUE(contains(campaign_errors("replicas: 2\n"), "neither `scene` nor `trajectories`"));
  EXPECT_TRUE(contains(campaign_errors(inline_scene + "trajectories: [{synthetic: {}}]\n"), "together"));
  EXPECT_TRUE(contains(campaign_errors("trajectories: [{synthetic: {}}]\nsweep: {fluid.tau: [1, 2]}\n"),
                       "`sweep` without `scene`"));
  EXPECT_TRUE(contains(campaign_errors("trajectories: [{synthetic: {}, import: x}]\n"),
                       "2 of synthetic, import and file"));
  EXPECT_TRUE(contains(campaign_errors("trajectories: [{import: nowhere}]\n"), "does not exist"));
  EXPECT_TRUE(
      contains(campaign_errors("scene: nowhere.yaml\n"), "c.yaml:2:8: file `nowhere.yaml` does not exist"));
}

TEST(SchemaCampaign, Sources) {
  const auto c = campaign(R"(trajectories:
  - {synthetic: {platelets: 20, D: 50 um2/s, memory: 10 ms, jump_fraction: 0.01, jump_size: 3 um, seed: 3}, name: known}
  - {import: nowhere, optional: true}
replicas: 3
)");
  ASSERT_EQ(c.sources.size(), 4u);
  std::set<std::string> hashes;
  for (int r = 0; r < 3; ++r) {
    EXPECT_EQ(c.sources[r].name, "known");
    EXPECT_EQ(c.sources[r].synthetic.platelets, 20);
    EXPECT_EQ(c.sources[r].synthetic.D, 5e-11);
    EXPECT_EQ(c.sources[r].synthetic.memory, 0.01);
    EXPECT_EQ(c.sources[r].synthetic.jump_size, 3e-6);
    EXPECT_EQ(c.sources[r].synthetic.seed, replica_seed(3, r));
    EXPECT_EQ(c.sources[r].replica, r);
    EXPECT_TRUE(hashes.insert(c.sources[r].hash).second);
  }
  EXPECT_FALSE(c.sources[3].present);
  EXPECT_EQ(c.sources[3].point, 1u);
  ASSERT_EQ(c.warnings.size(), 1u);
  EXPECT_TRUE(contains(c.warnings[0], "c.yaml:4:14: trajectories.1.import"));
  EXPECT_TRUE(expand(c).empty());
  EXPECT_EQ(c.seed(), 3u);
}

TEST_F(CampaignFiles, SceneAndCaseFilesAreRelativeToTheCampaign) {
  write_file_atomic(folder / "scenes" / "a.yaml", "format: hemowalk.scene/1\nfluid: {tau: 1.5}\n");
  write_file_atomic(folder / "device.yaml", "format: hemowalk.coarse/1\nwalkers: 10\n");
  write_file_atomic(folder / "c.yaml",
                    "format: hemowalk.campaign/1\nscene: scenes/a.yaml\ncoarse: [device.yaml]\n");
  const std::string file = folder / "c.yaml";
  const auto c = read_campaign(file, {"scene.fluid.dx=1 um", "coarse.0.end=5 s", "replicas=2"});
  const auto runs = expand(c);
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].scene.fluid.tau, 1.5);
  EXPECT_EQ(runs[0].scene.fluid.dx, 1e-6);
  EXPECT_EQ(c.coarse.at(0).name, "device");
  EXPECT_EQ(c.coarse.at(0).end, 5);
  // The same scene inline has the same hash, and its file may be exchanged from the command line.
  EXPECT_EQ(expand(parse_campaign("format: hemowalk.campaign/1\nscene: {fluid: {tau: 1.5, dx: 1 um}}\n",
                                  "x.yaml"))[0]
                .hash12,
            runs[0].hash12);
  write_file_atomic(folder / "b.yaml", "format: hemowalk.scene/1\nfluid: {tau: 1.25}\n");
  EXPECT_EQ(expand(read_campaign(file, {"scene=b.yaml"}))[0].scene.fluid.tau, 1.25);
  // Errors point into the file that has them.
  write_file_atomic(folder / "scenes" / "a.yaml", "format: hemowalk.scene/1\nfluid:\n  tau: 0.2\n");
  EXPECT_TRUE(contains(errors_of([&] { read_campaign(file); }),
                       "scenes/a.yaml:3:8: fluid.tau: `0.2` is out of range"));
}

TEST_F(CampaignFiles, CanonicalTextReadsBackAndTheHashIsOfThePhysics) {
  write_file_atomic(folder / "law.yaml", "format: hemowalk.transport_law/1\ncore: {D_m2_per_s: 1e-10}\n");
  const std::string text = "format: hemowalk.campaign/1\n" + inline_scene +
                           "sweep: {fluid.tau: [1, 2]}\ncoarse: [{law: law.yaml, name: k}, {}]\n";
  const auto read = [&](const std::string& more) { return parse_campaign(text + more, folder / "c.yaml"); };
  const auto c = read("");
  const auto again = parse_campaign(c.source_text, "elsewhere.yaml");
  EXPECT_EQ(again.source_text, c.source_text);
  EXPECT_EQ(again.input_sha256, c.input_sha256);
  EXPECT_EQ(expand(again)[1].hash12, expand(c)[1].hash12);
  EXPECT_EQ(
      read("launcher: {slots: 7}\nout: elsewhere\nname: other\non_failure: {action: skip}\n").input_sha256,
      c.input_sha256);
  EXPECT_NE(read("replicas: 2\n").input_sha256, c.input_sha256);
  EXPECT_NE(read("calibrate: {t0: 100 ms}\n").input_sha256, c.input_sha256);
  write_file_atomic(folder / "law.yaml", "format: hemowalk.transport_law/1\ncore: {D_m2_per_s: 2e-10}\n");
  EXPECT_NE(read("").input_sha256, c.input_sha256);
}

TEST_F(CampaignFiles, ImportedDataCountByContent) {
  write_file_atomic(folder / "data" / "a.log", "0, 1, 2, 3\n");
  const std::string text = "format: hemowalk.campaign/1\ntrajectories: [{import: data, name: x}]\n";
  const auto hash = [&] { return parse_campaign(text, folder / "c.yaml").sources.at(0).hash; };
  const std::string before = hash();
  EXPECT_EQ(hash(), before);
  write_file_atomic(folder / "data" / "a.log", "0, 1, 2, 4\n");
  EXPECT_NE(hash(), before);
}

TEST_F(CampaignFiles, KindsOfFiles) {
  write_file_atomic(folder / "s.yaml", "format: hemowalk.scene/1\nnonsense: [\"\"]\n");
  write_file_atomic(folder / "t.yaml", "format: something\n");
  EXPECT_EQ(kind_of_file(folder / "s.yaml"), "scene");
  EXPECT_EQ(kind_of_file(folder / "t.yaml"), "");
  EXPECT_THROW(kind_of_file(folder / "absent"), InputError);
}

TEST(SchemaCampaign, TooManyRunsAreRefusedAtOnce) {
  std::string values = "[";
  for (int i = 0; i < 200; ++i) values += std::to_string(1 + i) + ", ";
  values += "1000]";
  EXPECT_TRUE(
      contains(campaign_errors(inline_scene + "sweep: {fluid.tau: " + values + ", seed: " + values + "}\n"),
               "more than 10000 runs"));
}

// Documentation from the same tables
// ------------------------------------------------------------------------------------

TEST(Reference, TheCommittedPageIsTheGeneratedOne) {
  EXPECT_EQ(read_file(std::string(HEMOWALK_SOURCE_DIR) + "/docs/reference.md"), reference_page())
      << "after a change of a format: hemowalk schema reference > docs/reference.md";
}

TEST(Reference, JsonSchemasAreJson) {
  for (const char* name : {"scene", "campaign", "coarse", "law"}) {
    const auto schema = nlohmann::json::parse(format_schema(name));
    EXPECT_EQ(schema["type"], "object") << name;
    EXPECT_TRUE(schema["properties"].contains("format")) << name;
    EXPECT_EQ(schema["additionalProperties"], false) << name;
  }
  EXPECT_TRUE(contains(errors_of([] { format_schema("scen"); }), "did you mean `scene`?"));
}
