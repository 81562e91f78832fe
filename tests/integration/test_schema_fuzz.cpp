/// \file Readers against damaged, spliced and random input: an Error that names the file, or a valid value;
/// never a crash, never another exception, never for long.

#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "core/check.hpp"
#include "core/data/scene.hpp"
#include "core/data/transport_law.hpp"
#include "core/random.hpp"
#include "workflow/campaign.hpp"

using namespace hemowalk;

namespace {

const std::string scene = R"(format: hemowalk.scene/1
domain: {size: [50 um, 50 um, 50 um], geometry: {tube: {diameter: 40 um}}}
flow: {type: poiseuille, mean_velocity: 1 mm/s}
cells:
  kinds:
    rbc: {shape: rbc, law: {skalak: {Gs: 5 pN/um, C: 1}}, bending: {model: helfrich, reference_curvature: 0 1/um}}
    ball: {shape: sphere, radius: 3 um, law: rigid}
  explicit:
    - {kind: rbc, position: [25 um, 25 um, 25 um], axis: [0, 1, 0], angle: 30 deg}
    - kind: ball
      position: [1 um, 2 um, 3 um]
  loads: [{cell: 0, end: "+x", fraction: 0.02, force: [25 pN, 0 pN, 0 pN]}]
coupling: {velocity_cap: off, theta: [0.97, 0.5]}
time: {end: 1 s, checkpoint: {wall: 10 min}}
)";
const std::string law = R"(format: hemowalk.transport_law/1
core: {D_m2_per_s: 1e-10, D_sigma: 5e-12, lag_s: 0.02, y_range_m: [1e-5, 4e-5]}
profile: {y_m: [0, 1e-5], D_m2_per_s: [1e-10, 2e-10], v_m_per_s: [0, 0], draws: {D_m2_per_s: [[1, 2]], v_m_per_s: [[0, 0]]}}
step_law: {heavy_tail: {exponent: 3, fraction: 0.1}}
gate: {passed: false, findings: [{name: "a: b", value: null, limit: 1, passed: false, note: 'x'}]}
)";
const std::string campaign = R"(format: hemowalk.campaign/1
scene:
  cells: {hematocrit: 0.35}
sweep:
  cells.kinds.rbc.kappa_damping: [0.5, 0.9]
  domain.size.1: [50 um, 100 um]
replicas: 2
calibrate: {t0: 300 ms, lag: auto, layer: [10 um, 40 um]}
coarse: [{law: {D: 1e-10 m2/s}, domain: {bottom: {robin: 1 mm/s}}}]
on_failure: {action: retry}
)";

struct Reader {
  const char* name;
  const std::string* text;
  std::function<void(const std::string&)> read;
};
const Reader readers[] = {
    {"scene", &scene, [](const std::string& t) { data::parse_scene(t, "fuzz.yaml"); }},
    {"law", &law, [](const std::string& t) { data::parse_transport_law(t, "fuzz.yaml"); }},
    {"campaign", &campaign, [](const std::string& t) { workflow::parse_campaign(t, "fuzz.yaml"); }},
};

/// Reads; returns true if it was refused. Anything but an Error with a message fails the test.
bool refused(const Reader& reader, const std::string& text) {
  const auto start = std::chrono::steady_clock::now();
  bool failed = false;
  try {
    reader.read(text);
  } catch (const Error& error) {
    failed = true;
    EXPECT_NE(std::string(error.what()).find("fuzz.yaml"), std::string::npos) << error.what();
    EXPECT_EQ(error.code, Exit::usage);
  } catch (const std::exception& error) {
    ADD_FAILURE() << reader.name << ": " << error.what() << "\n" << text;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_LT(seconds, 30) << reader.name << " hangs on\n"
                         << text.substr(0, 2000);  // a hang, not a speed limit
  return failed;
}

const std::string alphabet = "{}[]:,-?!&*#|>'\"%@`~ \n\t0123456789.eumsnaif<=/\\\x01\x80\xc3";

std::string damaged(const std::string& text, RandomSequence& random) {
  std::string result = text;
  const std::size_t edits = 1 + random.below(4);
  for (std::size_t e = 0; e < edits && !result.empty(); ++e) {
    const std::size_t at = random.below(result.size()), length = 1 + random.below(12);
    switch (random.below(5)) {
      case 0:
        result[at] = alphabet[random.below(alphabet.size())];
        break;
      case 1:
        result.insert(at, 1, alphabet[random.below(alphabet.size())]);
        break;
      case 2:
        result.erase(at, length);
        break;
      case 3:
        result.insert(at, result.substr(random.below(result.size()), 3 * length));
        break;
      default:
        result.resize(at);
        break;
    }
  }
  return result;
}

}  // namespace

TEST(Fuzz, TheUndamagedTextsAreAccepted) {
  for (const Reader& reader : readers) EXPECT_FALSE(refused(reader, *reader.text)) << reader.name;
}

TEST(Fuzz, DamagedTexts) {
  RandomSequence random(20240601, Stream::test);
  for (const Reader& reader : readers) {
    int count = 0;
    const int n = 800;
    for (int i = 0; i < n; ++i) count += refused(reader, damaged(*reader.text, random));
    EXPECT_GT(count, n / 2) << reader.name;  // damage is noticed far more often than not
  }
}

TEST(Fuzz, RandomBytesAndRandomPunctuation) {
  RandomSequence random(7, Stream::test);
  for (const Reader& reader : readers)
    for (int i = 0; i < 500; ++i) {
      std::string text = i % 3 ? reader.text->substr(0, reader.text->find('\n') + 1) : "";
      const std::size_t length = random.below(300);
      for (std::size_t k = 0; k < length; ++k)
        text += i % 2 ? static_cast<char>(random.below(256)) : alphabet[random.below(alphabet.size())];
      refused(reader, text);
    }
}

TEST(Fuzz, LongThings) {
  const std::string head = "format: hemowalk.scene/1\n";
  const Reader& reader = readers[0];
  EXPECT_TRUE(refused(reader, head + std::string(1000000, 'a')));
  EXPECT_TRUE(refused(reader, head + "domain: " + std::string(100000, '[')));
  EXPECT_TRUE(refused(reader, head + "domain: " + std::string(100000, '{')));
  EXPECT_TRUE(refused(reader, head + std::string(100000, '-')));
  std::string dashes;
  for (int i = 0; i < 5000; ++i) dashes += "- ";
  EXPECT_TRUE(refused(reader, head + "domain:\n  " + dashes));
  EXPECT_TRUE(refused(reader, head + "seed: " + std::string(100000, '9')));
  EXPECT_TRUE(refused(reader, head + "fluid: {dx: 1 " + std::string(100000, 'm') + "}"));
  std::string keys = head;
  for (int i = 0; i < 5000; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_TRUE(refused(reader, keys));
  std::string deep = head;
  for (int i = 0; i < 200; ++i) deep += std::string(i, ' ') + "a:\n";
  EXPECT_TRUE(refused(reader, deep));
}
