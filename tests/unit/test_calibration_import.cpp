/// Garbage in: a clear refusal. The importer and the checks before any estimate.

#include <gtest/gtest.h>

#include <unistd.h>
#include <cmath>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "calibration/calibration.hpp"
#include "calibration/synthetic.hpp"
#include "core/check.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;
namespace fs = std::filesystem;

/// The message of the InputError that \p action must throw.
template <class Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return "";
}
bool mentions(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

data::Trajectories good() {
  Synthetic s;
  s.platelets = 5;
  s.duration = 0.5;
  return generate(s);
}
std::string refusal_of(data::Trajectories t, Options options = {}) {
  options.bootstrap = 10;
  return refusal([&] { calibrate({std::move(t)}, options); });
}

TEST(Checks, GoodDataPass) {
  Options o;
  o.bootstrap = 10;
  EXPECT_NO_THROW(calibrate({good()}, o));
}
TEST(Checks, NotANumber) {
  auto t = good();
  t.kinds["platelet"].position[(17 * 5 + 3) * 3 + 1] = std::nan("");
  const std::string why = refusal_of(t);
  EXPECT_TRUE(mentions(why, "platelet 3 in sample 17 is not a number")) << why;
}
TEST(Checks, UnsortedTimes) {
  auto t = good();
  std::swap(t.time[10], t.time[11]);
  EXPECT_TRUE(mentions(refusal_of(t), "times are not increasing (sample 11"));
}
TEST(Checks, OnePlatelet) {
  Synthetic s;
  s.platelets = 1;
  EXPECT_TRUE(mentions(refusal_of(generate(s)), "only one platelet"));
}
TEST(Checks, WrappedPositions) {
  auto t = good();
  auto& p = t.kinds["platelet"].position;
  for (std::size_t k = 2; k < p.size(); k += 3) p[k] = std::fmod(p[k], t.box[2]);
  EXPECT_TRUE(mentions(refusal_of(t), "positions along z are wrapped"));
}
TEST(Checks, TooShort) {
  Options o;
  o.t0 = 0.48;
  EXPECT_TRUE(mentions(refusal_of(good(), o), "too short a run"));
}
// Whatever the length and the number of cells: a refusal, or a law of finite numbers that its own reader
// takes.
TEST(Checks, ShortRunsGiveAFiniteLawOrNone) {
  const auto file = fs::temp_directory_path() / ("hemowalk_law_" + std::to_string(::getpid()) + ".yaml");
  int laws = 0, refusals = 0;
  for (int platelets : {2, 6})
    for (double duration : {0.03, 0.042, 0.05, 0.1})
      for (double gap : {10e-6, 50e-6}) {
        Synthetic s;
        s.platelets = platelets;
        s.duration = duration;
        s.gap = gap;
        s.seed = 7;
        Options o;
        o.t0 = 0;
        o.bootstrap = 20;
        try {
          const Calibration c = calibrate({generate(s)}, o);
          ++laws;
          EXPECT_TRUE(c.law.core.D > 0 && std::isfinite(c.law.core.D_sigma)) << platelets << " " << duration;
          for (const auto* rows : {&c.law.profile.D_draws, &c.law.profile.v_draws})
            for (const auto& row : *rows)
              for (double v : row)
                ASSERT_TRUE(std::isfinite(v)) << platelets << " " << duration << " " << gap;
          for (const auto* row : {&c.law.profile.D, &c.law.profile.v})
            for (double v : *row) ASSERT_TRUE(std::isfinite(v)) << platelets << " " << duration << " " << gap;
          ASSERT_NO_THROW(data::write_transport_law(c.law, file.string()));
          ASSERT_NO_THROW(data::read_transport_law(file.string()));
        } catch (const InputError& e) {
          ++refusals;
          EXPECT_TRUE(mentions(e.what(), "(")) << e.what();
        }
      }
  fs::remove(file);
  EXPECT_GE(refusals, 4);  // 0.03 s holds fewer than 40 samples
  EXPECT_GE(laws, 4);
}
TEST(Checks, OutsideTheWalls) {
  auto t = good();
  t.kinds["platelet"].position[1] = -3e-6;
  EXPECT_TRUE(mentions(refusal_of(t), "outside the walls"));
}
TEST(Checks, UnknownKindNamesTheKnownOnes) {
  Options o;
  o.kind = "rbc";
  EXPECT_TRUE(mentions(refusal_of(good(), o), "the file holds: platelet"));
}
TEST(Checks, NoRuns) {
  EXPECT_TRUE(mentions(refusal([] { calibrate({}, {}); }), "no trajectories given"));
}

/// A folder of text files that is removed again.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("hemowalk_import_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path / name) << text; }
};

TEST(Import, UnwrapsWithThePeriodOfTheData) {
  const Folder folder;
  // Two platelets that move 3.01 um per sample along z in a period of 49.5 um, and do not move along x.
  for (int id : {7, 12}) {
    std::string text;
    for (int k = 0; k < 400; ++k)
      text += std::to_string(8000.0 * k) + ",20," + std::to_string(10 + id) + "," +
              std::to_string(std::fmod(0.5 * id + 3.01 * k, 49.5)) + "\n";
    folder.write("body_" + std::to_string(id) + "_ComPos.log", text);
  }
  const data::Trajectories t = import_text_folder(folder.path);
  const data::Tracks& p = t.kinds.at("platelet");
  ASSERT_EQ(p.cells(), 2u);
  EXPECT_EQ(p.id[0], 12);  // files in alphabetical order
  EXPECT_NEAR(t.box[2], 49.5e-6, 1e-12);
  EXPECT_NEAR(t.box[0], 50e-6, 1e-12);
  // Files carry six decimals of a um: 400 steps add no error, since each sample is shifted by whole periods.
  EXPECT_NEAR(p.at(399, 1, 2) - p.at(0, 1, 2), 399 * 3.01e-6, 2e-12);
  EXPECT_NEAR(t.time[1] - t.time[0], 1e-3, 1e-12);
}
TEST(Import, NamesFileAndLine) {
  const Folder folder;
  folder.write("a1.log", "0,1,2,3\n8000,1,2\n");
  EXPECT_TRUE(mentions(refusal([&] { import_text_folder(folder.path); }), "a1.log:2: not a row"));
  folder.write("a1.log", "0,1,2,3\n8000,1,nan,2\n");
  EXPECT_TRUE(
      mentions(refusal([&] { import_text_folder(folder.path); }), "a1.log:2: a value is not a number"));
  folder.write("a1.log", "8000,1,2,3\n0,1,2,2\n");
  EXPECT_TRUE(
      mentions(refusal([&] { import_text_folder(folder.path); }), "a1.log:2: steps are not increasing"));
  folder.write("a1.log", "");
  EXPECT_TRUE(mentions(refusal([&] { import_text_folder(folder.path); }), "is empty"));
}
TEST(Import, RefusesUnequalSamples) {
  const Folder folder;
  folder.write("a1.log", "0,1,2,3\n8000,1,2,3\n");
  folder.write("a2.log", "0,1,2,3\n9000,1,2,3\n");
  EXPECT_TRUE(mentions(refusal([&] { import_text_folder(folder.path); }), "other time steps"));
}
TEST(Import, RefusesMissingOrEmptyFolder) {
  const Folder folder;
  EXPECT_TRUE(mentions(refusal([&] { import_text_folder(folder.path); }), "no .log, .csv or .txt file"));
  EXPECT_TRUE(mentions(refusal([&] { import_text_folder(folder.path / "nowhere"); }), "no folder"));
}

}  // namespace
