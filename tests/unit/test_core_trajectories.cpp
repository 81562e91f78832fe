#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/check.hpp"
#include "core/data/trajectories.hpp"
#include "core/hdf5.hpp"
#include "core/io.hpp"

using namespace hemowalk;
using namespace hemowalk::data;
namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__)
// HDF5 1.10 leaks a little on its own error paths: damaged files are read below.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }
#endif

namespace {

Trajectories sample() {
  Trajectories t;
  t.acceleration = 16;
  t.shear_rate = 100;
  t.box = {50e-6, 40e-6, 30e-6};
  t.walls_y = {0, 40e-6};
  t.hematocrit_true = 0.348;
  t.kappa_damping = 0.9;
  t.t_c = std::nan("");
  t.Ca = 0.08;
  t.Re = 1.6e-3;
  t.seed = 9007199254740993;  // not a double
  t.scene_yaml = "domain: {}\n";
  t.input_sha256 = "0123";
  t.time = {0, 1e-3, 1.75e-3, 3e-3};
  for (const char* kind : {"platelet", "rbc"}) {
    Tracks& tracks = t.kinds[kind];
    tracks.id = {7, 3};
    for (int i = 0; i < 4 * 2 * 3; ++i) {
      tracks.position.push_back(1e-6 * i / 3);
      tracks.orientation.push_back(i % 3 == 0);
    }
    for (const char* name : {"taylor_deformation", "volume"})
      for (int i = 0; i < 8; ++i) tracks.observables[name].push_back(0.1 * i);
  }
  t.profile.time = {1e-3, 2e-3};
  t.profile.y = {1e-6, 2e-6, 3e-6};
  for (int i = 0; i < 18; ++i) t.profile.velocity.push_back(i);
  t.profile.hematocrit.assign(6, 0.3);
  t.profile.shear_stress.assign(6, 0.1);
  t.diagnostics.time = {1e-3};
  t.diagnostics.momentum_residual = {1e-9, 2e-9, 3e-9};
  t.diagnostics.energy_residual = {std::nan("")};
  t.diagnostics.mass_error = t.diagnostics.volume_error_max = t.diagnostics.max_speed_ratio = {0.5};
  t.diagnostics.overlap_max = t.diagnostics.slip_rms = {1e-8};
  return t;
}

class TrajectoriesFile : public testing::Test {
 protected:
  TrajectoriesFile() : folder(fs::temp_directory_path() / ("hemowalk_h5_" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~TrajectoriesFile() override { fs::remove_all(folder); }
  std::string path() const { return folder / "trajectories.h5"; }
  template <class E>
  static std::string message(const std::function<void()>& action) {
    try {
      action();
    } catch (const E& error) {
      return error.what();
    }
    return "no error";
  }
  /// The error of writing sample() after a change.
  std::string refusal(const std::function<void(Trajectories&)>& spoil) const {
    Trajectories t = sample();
    spoil(t);
    return message<InputError>([&] { write_trajectories(t, path()); });
  }
  fs::path folder;
};

}  // namespace

TEST_F(TrajectoriesFile, RoundTripIsExact) {
  const Trajectories a = sample();
  write_trajectories(a, path());
  const Trajectories b = read_trajectories(path());
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.box, b.box);
  EXPECT_EQ(a.walls_y, b.walls_y);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.scene_yaml, b.scene_yaml);
  EXPECT_EQ(a.input_sha256, b.input_sha256);
  EXPECT_EQ(a.acceleration, b.acceleration);
  EXPECT_EQ(a.shear_rate, b.shear_rate);
  EXPECT_EQ(a.hematocrit_true, b.hematocrit_true);
  EXPECT_EQ(a.kappa_damping, b.kappa_damping);
  EXPECT_TRUE(std::isnan(b.t_c));
  EXPECT_EQ(a.Ca, b.Ca);
  EXPECT_EQ(a.Re, b.Re);
  ASSERT_EQ(b.kinds.size(), 2u);
  for (const auto& [name, tracks] : a.kinds) {
    EXPECT_EQ(tracks.id, b.kinds.at(name).id);
    EXPECT_EQ(tracks.position, b.kinds.at(name).position);
    EXPECT_EQ(tracks.orientation, b.kinds.at(name).orientation);
    EXPECT_EQ(tracks.observables, b.kinds.at(name).observables);
  }
  EXPECT_EQ(a.profile.velocity, b.profile.velocity);
  EXPECT_EQ(a.profile.hematocrit, b.profile.hematocrit);
  EXPECT_EQ(a.diagnostics.momentum_residual, b.diagnostics.momentum_residual);
  EXPECT_EQ(a.diagnostics.slip_rms, b.diagnostics.slip_rms);
  EXPECT_TRUE(std::isnan(b.diagnostics.energy_residual[0]));
}

TEST_F(TrajectoriesFile, EveryDatasetStatesItsUnits) {
  write_trajectories(sample(), path());
  const auto file = hdf5::File::open(path());
  int datasets = 0;
  for (const std::string group : {"/", "/platelet", "/rbc", "/profile", "/diagnostics"})
    for (const std::string& name : file.datasets(group)) {
      const std::string dataset = (group == "/" ? "" : group) + "/" + name;
      EXPECT_NO_THROW(file.units(dataset)) << dataset;
      ++datasets;
    }
  EXPECT_EQ(datasets, 1 + 2 * 5 + 5 + 8);
  EXPECT_EQ(file.units("/platelet/position"), "m");
  EXPECT_EQ(file.units("/platelet/volume"), "m3");
  EXPECT_EQ(file.units("/profile/shear_stress"), "Pa");
  EXPECT_EQ(file.shape("/platelet/position"), (hdf5::Shape{4, 2, 3}));
  EXPECT_EQ(file.shape("/profile/velocity"), (hdf5::Shape{2, 3, 3}));
  EXPECT_EQ(file.text_attribute("format"), "hemowalk.trajectories/1");
}

TEST_F(TrajectoriesFile, OtherUnitsAreConvertedAndWrongOnesRefused) {
  const auto write = [&](const char* units) {
    auto file = hdf5::File::create(path());
    file.write_attribute("format", std::string("hemowalk.trajectories/1"));
    file.write_attribute("box", std::vector<double>{1e-6, 1e-6, 1e-6});
    file.write_attribute("walls_y", std::vector<double>{0, 1e-6});
    file.write("/time", {2}, std::vector<double>{0, 5}, "ms");
    file.write("/platelet/id", {1}, std::vector<std::int64_t>{1}, "1");
    file.write("/platelet/position", {2, 1, 3}, std::vector<double>{1, 2, 3, 4, 5, 6}, units);
    file.close();
  };
  write("um");
  const auto t = read_trajectories(path());
  EXPECT_DOUBLE_EQ(t.time[1], 5e-3);
  EXPECT_DOUBLE_EQ(t.kinds.at("platelet").at(1, 0, 1), 5e-6);
  EXPECT_TRUE(std::isnan(t.kappa_damping));
  write("s");
  const std::string text = message<InputError>([&] { read_trajectories(path()); });
  EXPECT_NE(text.find("/platelet/position: units `s` measures a time (a length is expected)"),
            std::string::npos)
      << text;
}

TEST_F(TrajectoriesFile, InconsistentDataNameTheDataset) {
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(refusal([](auto& t) { t.time[2] = t.time[1]; }), "/time: value 2 is 0.001 after 0.001"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.time[3] = std::nan(""); }), "/time: value 3 is not finite"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds.clear(); }), "no cells"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.time.clear(); }), "/time: no samples"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["rbc"].position.pop_back(); }), "/rbc/position: 23 values"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["rbc"].position[7] = std::nan(""); }),
                  "/rbc/position: not finite at time 1, cell 0"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["rbc"].position[10] = INFINITY; }),
                  "/rbc/position: not finite at time 1, cell 1"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["rbc"].observables["area"] = {1}; }), "/rbc/area: 1 values"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["rbc"].id = {3, 3}; }), "/rbc/id: an id appears twice"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.kinds["profile"] = t.kinds["rbc"]; }), "/profile: no name"));
  EXPECT_TRUE(has(refusal([](auto& t) { t.profile.velocity.pop_back(); }), "/profile/velocity"));
  EXPECT_TRUE(has(refusal([](auto& t) {
                    t.diagnostics.slip_rms.clear();
                    t.diagnostics.mass_error = {1, 2};
                  }),
                  "/diagnostics/mass_error"));
  EXPECT_FALSE(fs::exists(path()));
}

TEST_F(TrajectoriesFile, BadFilesAreRefusedNotBelieved) {
  EXPECT_NE(message<InputError>([&] { read_trajectories(folder / "absent.h5"); }), "no error");
  write_file_atomic(path(), "this is no HDF5 file");
  EXPECT_NE(message<InputError>([&] { read_trajectories(path()); }).find("not an HDF5 file"),
            std::string::npos);
  // Truncated and damaged copies of a good file: an error or a good read, never a crash.
  write_trajectories(sample(), path());
  const std::string good = read_file(path());
  int refused = 0;
  for (std::size_t k = 1; k <= 40; ++k) {
    std::string bad = good;
    if (k % 2)
      bad.resize(good.size() * k / 41);
    else
      for (std::size_t i = 0; i < 16; ++i) bad[(k * 7919 + i * 104729) % good.size()] ^= 0x5a;
    write_file_atomic(path(), bad);
    try {
      read_trajectories(path());
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, 20);  // every truncation is seen
}

TEST_F(TrajectoriesFile, ALongSceneFitsIntoTheAttribute) {
  Trajectories t = sample();
  t.scene_yaml.assign(300000, 'x');
  write_trajectories(t, path());
  EXPECT_EQ(read_trajectories(path()).scene_yaml, t.scene_yaml);
}

TEST_F(TrajectoriesFile, AFailedWriteLeavesTheOldFile) {
  write_trajectories(sample(), path());
  EXPECT_NE(refusal([](auto& t) { t.time[1] = -1; }), "no error");
  EXPECT_EQ(read_trajectories(path()).time.size(), 4u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}
