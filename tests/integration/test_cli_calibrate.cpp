/// \file calibrate as a user meets it: what it refuses, what --strict changes, plans, laws over conditions.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "calibration/synthetic.hpp"
#include "core/data/trajectories.hpp"
#include "core/data/transport_law.hpp"
#include "integration/program.hpp"

namespace hemowalk::test {
namespace {

using Json = nlohmann::json;

calibration::Synthetic few() {
  calibration::Synthetic s;
  s.platelets = 12;
  s.duration = 0.5;
  return s;
}
void write(const Scratch& scratch, const std::string& name, const data::Trajectories& t) {
  data::write_trajectories(t, (scratch.path() / name).string());
}
bool says(const Outcome& o, const std::string& words) { return o.err.find(words) != std::string::npos; }
const std::string quick = " --t0 100ms --bootstrap 50 ";

// Exit code 2, the reason on stderr, nothing on stdout, no file.
TEST(Calibrate, RefusesGarbage) {
  struct Case {
    const char* words;
    std::function<void(data::Trajectories&)> spoil;
  };
  const Case cases[] = {
      {"only one platelet",
       [](auto& t) {
         auto s = few();
         s.platelets = 1;
         t = calibration::generate(s);
       }},
      {"are wrapped",
       [](auto& t) {
         auto& p = t.kinds["platelet"].position;
         for (std::size_t k = 2; k < p.size(); k += 3) p[k] = std::fmod(p[k], t.box[2]);
       }},
      {"too short a run",
       [](auto& t) {
         auto s = few();
         s.duration = 0.12;
         t = calibration::generate(s);
       }},
  };
  for (const Case& c : cases) {
    const Scratch scratch;
    auto t = calibration::generate(few());
    c.spoil(t);
    write(scratch, "run.h5", t);
    const auto o = hemowalk(scratch, "calibrate run.h5" + quick);
    EXPECT_EQ(o.code, 2) << c.words << o.err;
    EXPECT_TRUE(says(o, c.words)) << c.words << "\n" << o.err;
    EXPECT_TRUE(o.out.empty()) << o.out;
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "transport_law.yaml")) << c.words;
    EXPECT_EQ(hemowalk(scratch, "calibrate run.h5 --json" + quick).code, 2) << c.words;
  }
}

// Our own writer takes no NaN and no unsorted times: these come as text files.
TEST(Calibrate, RefusesGarbageInTextFiles) {
  const auto row = [](double step, double y) {
    return std::to_string(step) + ",20," + std::to_string(y) + ",10\n";
  };
  const struct {
    const char* words;
    std::string spoilt;  ///< instead of the row at step 200
  } cases[] = {{"is not a number", std::to_string(200 * 8000) + ",20,nan,10\n"},
               {"steps are not increasing", row(7 * 8000, 20)},
               {"not a row of the form", "step 200\n"}};
  for (const auto& c : cases) {
    const Scratch scratch;
    std::filesystem::create_directory(scratch.path() / "tracks");
    for (int id = 1; id <= 3; ++id) {
      std::string text;
      for (int k = 0; k < 500; ++k)
        text += k == 200 && id == 2 ? c.spoilt : row(8000.0 * k, 20 + id + 0.1 * (k % 7));
      scratch.write("tracks/body_" + std::to_string(id) + "_ComPos.log", text);
    }
    const auto o = hemowalk(scratch, "calibrate --import tracks" + quick);
    EXPECT_EQ(o.code, 2) << c.words << o.err;
    EXPECT_TRUE(says(o, c.words) && says(o, "body_2_ComPos.log:201")) << c.words << "\n" << o.err;
    EXPECT_TRUE(o.out.empty());
    EXPECT_FALSE(std::filesystem::exists(scratch.path() / "transport_law.yaml")) << c.words;
  }
}

TEST(Calibrate, AFailedGateIsLoudAndWithStrictAnError) {
  const Scratch scratch;
  auto s = few();
  s.jump_fraction = 0.01;
  s.jump_size = 4e-6;
  write(scratch, "run.h5", calibration::generate(s));
  const auto strict = hemowalk(scratch, "calibrate run.h5 --strict" + quick);
  EXPECT_EQ(strict.code, 4) << strict.err;
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "transport_law.yaml"));
  const auto o = hemowalk(scratch, "calibrate run.h5 --json" + quick);
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(says(o, "artefact gate FAILED")) << o.err;
  EXPECT_EQ(Json::parse(o.out)["gate"]["passed"], false);
  EXPECT_FALSE(data::read_transport_law((scratch.path() / "transport_law.yaml").string()).gate.passed);
}

TEST(Calibrate, SeveralRunsAndAReport) {
  const Scratch scratch;
  std::string files;
  for (int k = 1; k <= 3; ++k) {
    auto s = few();
    s.seed = static_cast<std::uint64_t>(k);
    const std::string name = "run" + std::to_string(k) + ".h5";
    write(scratch, name, calibration::generate(s));
    files += " " + name;
  }
  const auto o = hemowalk(scratch, "calibrate" + files + " --report --json" + quick);
  ASSERT_EQ(o.code, 0) << o.err;
  const auto j = Json::parse(o.out);
  EXPECT_EQ(j["n_runs"], 3);
  EXPECT_EQ(j["n_platelets"], 36);
  EXPECT_TRUE(j["law"]["D_over_gamma_r2"].is_number());
  EXPECT_NE(slurp(scratch.path() / "report.html").find("turitto1972"), std::string::npos);
  const auto table = hemowalk(scratch, "calibrate run1.h5" + quick);
  EXPECT_NE(table.out.find("turitto1972 *"), std::string::npos) << table.out;  // a row of the chart
  EXPECT_NE(table.out.find("68 % interval"), std::string::npos);
}

TEST(Calibrate, PlansPlateletSeconds) {
  const Scratch scratch;
  const auto theory = hemowalk(scratch, "calibrate --plan 5% --json");
  ASSERT_EQ(theory.code, 0) << theory.err;
  const auto p = Json::parse(theory.out)["plan"][0];
  EXPECT_NEAR(p["platelet_seconds"].get<double>(), 34, 0.5);  // the method's figure for 5 % at 100/s
  EXPECT_EQ(p["platelets_single_origin"], 961);               // (1.55/0.05)^2
  EXPECT_GE(p["runs"].get<int>(), 3);
  EXPECT_EQ(Json::parse(hemowalk(scratch, "calibrate --plan --json").out)["plan"].size(), 4u);

  write(scratch, "run.h5", calibration::generate(few()));
  const auto scaled = hemowalk(scratch, "calibrate run.h5 --plan 0.1 --json" + quick);
  ASSERT_EQ(scaled.code, 0) << scaled.err;
  const auto q = Json::parse(scaled.out)["plan"][0];
  EXPECT_NE(q["note"].get<std::string>().find("scaled from 4.8 platelet-seconds"), std::string::npos) << q;
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "transport_law.yaml"));
  for (const char* bad : {"0", "150%", "much"})
    EXPECT_EQ(hemowalk(scratch, std::string("calibrate --plan ") + bad).code, 2) << bad;
}

TEST(Calibrate, LawOverConditions) {
  const Scratch scratch;
  for (const double g : {50.0, 100.0, 200.0}) {
    auto s = few();
    s.shear_rate = g;
    s.D = 1e-12 * g;
    std::string name = "g";  // appended: GCC 12 warns of "g" + temporary
    name += std::to_string(static_cast<int>(g));
    write(scratch, name + ".h5", calibration::generate(s));
    ASSERT_EQ(hemowalk(scratch, "calibrate " + name + ".h5 --out " + name + quick).code, 0);
  }
  const std::string laws = "calibrate --laws g50 g100/transport_law.yaml g200 ";
  const auto o = hemowalk(scratch, laws + "--at 'shear_rate=140 1/s' --out between --json");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto j = Json::parse(o.out)["over_conditions"];
  // D goes with the shear rate by construction; 12 cells over 0.4 s give about 10 % each.
  EXPECT_NEAR(j["scaling"]["shear_exponent"].get<double>(), 1, 4 * j["scaling"]["sigma"].get<double>());
  EXPECT_EQ(j["hypotheses"][0]["outcome"], "not tested");
  const auto law = data::read_transport_law((scratch.path() / "between/transport_law.yaml").string());
  EXPECT_NEAR(law.core.D, 1.4e-10, 5 * law.core.D_sigma);
  EXPECT_EQ(law.conditions.shear_rate, 140);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() / "between/law_over_conditions.json"));

  EXPECT_EQ(hemowalk(scratch, laws + "--at 'shear_rate=900 1/s' --out beyond").code, 4);
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "beyond"));
  EXPECT_EQ(hemowalk(scratch, laws + "--at shear=3").code, 2);
  EXPECT_EQ(hemowalk(scratch, "calibrate --laws g50").code, 2);
  EXPECT_EQ(hemowalk(scratch, "calibrate g50.h5 --at hematocrit=0.4").code, 2);
  EXPECT_EQ(hemowalk(scratch, "calibrate --laws nowhere").code, 2);
}

}  // namespace
}  // namespace hemowalk::test
