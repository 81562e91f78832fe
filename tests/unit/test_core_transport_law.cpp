#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "core/check.hpp"
#include "core/data/transport_law.hpp"
#include "core/io.hpp"
#include "core/random.hpp"

using namespace hemowalk;
using namespace hemowalk::data;

namespace {

TransportLaw sample() {
  TransportLaw law;
  RandomSequence random(4, Stream::test);
  const double nan = std::nan("");
  law.conditions = {100.0 / 3, 0.1 * 3, 1e-5 / 3, nan, nan, 0.08, 1.6e-3};
  law.core = {1.25e-10 / 3, 5.1e-12 / 7, 0.02, {1e-5, 4e-5}};
  for (int i = 0; i < 25; ++i) {
    law.profile.y.push_back(i * 2e-6 + 1e-7 * random.uniform());
    law.profile.D.push_back(1e-10 * random.uniform());
    law.profile.v.push_back(1e-7 * random.normal());
  }
  for (int d = 0; d < 10; ++d) {
    law.profile.D_draws.emplace_back();
    law.profile.v_draws.emplace_back();
    for (int i = 0; i < 25; ++i) {
      law.profile.D_draws.back().push_back(1e-10 * random.uniform());
      law.profile.v_draws.back().push_back(random.normal());
    }
  }
  law.memory = 0.0123456789012345678;
  law.step_law = {"heavy_tail", 0, 3.3, 0.01};
  law.cell_free_layer = nan;
  law.scaling = {0.4, 0.07};
  law.valid = {{10, 1000}, {0.2, 0.45}, 5e-3};
  law.gate = {
      false,
      {{"core shear", 0.43, 0.75, false, "plug: \"core\" shear, see [1]"}, {"drift", nan, 1, true, ""}}};
  law.provenance = {{"abc", "def"}, "0.1.0", 12345};
  return law;
}

class LawFile : public testing::Test {
 protected:
  LawFile()
      : path(std::filesystem::temp_directory_path() /
             ("hemowalk_law_" + std::to_string(::getpid()) + ".yaml")) {}
  ~LawFile() override { std::filesystem::remove(path); }
  static std::string refusal(const std::string& text) {
    try {
      parse_transport_law(text, "law.yaml");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  std::string path;
};

const std::string head = "format: hemowalk.transport_law/1\n";

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

}  // namespace

TEST_F(LawFile, RoundTripIsLossless) {
  const TransportLaw a = sample();
  write_transport_law(a, path);
  const TransportLaw b = read_transport_law(path);
  EXPECT_EQ(a.conditions.shear_rate, b.conditions.shear_rate);
  EXPECT_EQ(a.conditions.hematocrit, b.conditions.hematocrit);
  EXPECT_EQ(a.conditions.gap, b.conditions.gap);
  EXPECT_TRUE(same(a.conditions.kappa_damping, b.conditions.kappa_damping));
  EXPECT_TRUE(same(a.conditions.t_c, b.conditions.t_c));
  EXPECT_EQ(a.conditions.Ca, b.conditions.Ca);
  EXPECT_EQ(a.conditions.Re, b.conditions.Re);
  EXPECT_EQ(a.core.D, b.core.D);
  EXPECT_EQ(a.core.D_sigma, b.core.D_sigma);
  EXPECT_EQ(a.core.lag, b.core.lag);
  EXPECT_EQ(a.core.y_range, b.core.y_range);
  EXPECT_EQ(a.profile.y, b.profile.y);
  EXPECT_EQ(a.profile.D, b.profile.D);
  EXPECT_EQ(a.profile.v, b.profile.v);
  EXPECT_EQ(a.profile.D_draws, b.profile.D_draws);
  EXPECT_EQ(a.profile.v_draws, b.profile.v_draws);
  EXPECT_EQ(a.memory, b.memory);
  EXPECT_EQ(a.step_law.kind, b.step_law.kind);
  EXPECT_EQ(a.step_law.tail_exponent, b.step_law.tail_exponent);
  EXPECT_EQ(a.step_law.tail_fraction, b.step_law.tail_fraction);
  EXPECT_TRUE(std::isnan(b.cell_free_layer));
  EXPECT_EQ(a.scaling.shear_exponent, b.scaling.shear_exponent);
  EXPECT_EQ(a.scaling.sigma, b.scaling.sigma);
  EXPECT_EQ(a.valid.shear_rate, b.valid.shear_rate);
  EXPECT_EQ(a.valid.hematocrit, b.valid.hematocrit);
  EXPECT_EQ(a.valid.dt_min, b.valid.dt_min);
  EXPECT_EQ(a.gate.passed, b.gate.passed);
  ASSERT_EQ(b.gate.findings.size(), 2u);
  EXPECT_EQ(a.gate.findings[0].note, b.gate.findings[0].note);
  EXPECT_EQ(a.gate.findings[0].limit, b.gate.findings[0].limit);
  EXPECT_TRUE(std::isnan(b.gate.findings[1].value));
  EXPECT_EQ(a.provenance.inputs_sha256, b.provenance.inputs_sha256);
  EXPECT_EQ(a.provenance.seed, b.provenance.seed);
}

TEST_F(LawFile, StepLaws) {
  for (const char* kind : {"gaussian", "persistent", "heavy_tail"}) {
    TransportLaw law = TransportLaw::constant(1e-10);
    law.step_law.kind = kind;
    if (law.step_law.kind == "persistent") law.step_law.memory = 0.01;
    if (law.step_law.kind == "heavy_tail") law.step_law = {kind, 0, 2.5, 0.1};
    write_transport_law(law, path);
    const auto read = read_transport_law(path).step_law;
    EXPECT_EQ(read.kind, kind);
    EXPECT_EQ(read.memory, law.step_law.memory);
    EXPECT_EQ(read.tail_exponent, law.step_law.tail_exponent);
  }
  EXPECT_EQ(
      parse_transport_law(head + "core: {D_m2_per_s: 1e-10}\nmemory_s: 0.02\nstep_law: persistent\n", "l")
          .step_law.memory,
      0.02);
  EXPECT_NE(refusal(head + "core: {D_m2_per_s: 1e-10}\nstep_law: levy\n").find("gaussian"),
            std::string::npos);
}

TEST_F(LawFile, TheSmallestFile) {
  const auto law = parse_transport_law(head + "core: {D_m2_per_s: 1e-10}\n", "l");
  EXPECT_EQ(law.core.D, 1e-10);
  EXPECT_TRUE(law.profile.y.empty());
  EXPECT_TRUE(std::isnan(law.conditions.hematocrit));
  EXPECT_TRUE(law.gate.passed);
}

TEST_F(LawFile, WrongLawsAreRefusedByKey) {
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  const std::string core = "core: {D_m2_per_s: 1e-10}\n";
  EXPECT_TRUE(has(refusal(head), "`core` is missing"));
  EXPECT_TRUE(has(refusal(head + "core: {D_m2_per_s: -1}\n"),
                  "law.yaml:2:20: core.D_m2_per_s: `-1` is out of range"));
  EXPECT_TRUE(has(refusal(head + "core: {D_m2_per_s: .nan}\n"), "not finite"));
  EXPECT_TRUE(has(refusal(head + "core: {D_m2_per_s: 1e-10, y_range_m: [2, 1]}\n"),
                  "core.y_range_m: the first value is above the second"));
  EXPECT_TRUE(
      has(refusal(head + core + "profile: {y_m: [0, 2, 1], D_m2_per_s: [1, 1, 1], v_m_per_s: [0, 0, 0]}\n"),
          "profile.y_m.2: not above"));
  EXPECT_TRUE(has(refusal(head + core + "profile: {y_m: [0, 1], D_m2_per_s: [1], v_m_per_s: [0, 0]}\n"),
                  "profile.D_m2_per_s: 1 values for 2 heights"));
  EXPECT_TRUE(has(refusal(head + core +
                          "profile: {y_m: [0, 1], D_m2_per_s: [1, 1], v_m_per_s: [0, 0], draws: {D_m2_per_s: "
                          "[[1, 1]], v_m_per_s: []}}\n"),
                  "1 draws of D and 0 of v"));
  EXPECT_TRUE(has(refusal("format: hemowalk.scene/1\n"), "this reader expects hemowalk.transport_law/1"));
  EXPECT_TRUE(has(refusal(head + "core: {D: 1e-10}\n"), "unknown key `core.D`"));
}

TEST_F(LawFile, AConstantMustBePositive) {
  EXPECT_THROW(TransportLaw::constant(0), InputError);
  EXPECT_THROW(TransportLaw::constant(std::nan("")), InputError);
  EXPECT_EQ(TransportLaw::constant(2e-10).core.D, 2e-10);
}

TEST_F(LawFile, AThousandDrawsReadInTime) {
  TransportLaw law = sample();
  law.profile.D_draws.assign(1000, law.profile.D);
  law.profile.v_draws.assign(1000, law.profile.v);
  write_transport_law(law, path);
  EXPECT_EQ(read_transport_law(path).profile.D_draws, law.profile.D_draws);
}
