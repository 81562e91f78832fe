// Devices of the runs of a campaign: runs that are under way together start at devices of their own. The runs
// are this program itself, which writes down which device it would take.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "core/device_choice.hpp"
#include "workflow/local_launcher.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;
constexpr int devices_of_machine = 5;

/// What a run leaves: one device per rank.
std::vector<std::set<int>> devices_of_runs(int runs, int slots, int ranks) {
  const fs::path folder = fs::temp_directory_path() / ("hemowalk_launcher_" + std::to_string(getpid()));
  std::vector<Job> jobs;
  for (int j = 0; j < runs; ++j) {
    jobs.push_back({folder / std::to_string(j), "run", 1});
    fs::create_directories(jobs.back().folder);
  }
  LaunchOptions options;
  options.slots = slots, options.ranks = ranks, options.threads = 1;
  std::vector<std::set<int>> devices;
  for (const Status& status : run_jobs(jobs, options)) EXPECT_EQ(status.state, State::done) << status.reason;
  for (const Job& job : jobs) {
    devices.emplace_back();
    for (const auto& entry : fs::directory_iterator(job.folder))
      if (entry.path().extension() == ".device") devices.back().insert(std::stoi(entry.path().stem()));
  }
  fs::remove_all(folder);
  return devices;
}

TEST(LocalLauncher, RunsSideBySideTakeDevicesOfTheirOwn) {
  const auto devices = devices_of_runs(2, 2, 1);
  EXPECT_EQ(devices[0], std::set<int>{0});
  EXPECT_EQ(devices[1], std::set<int>{1});
}

TEST(LocalLauncher, ASlotThatBecomesFreeIsTakenAgain) {
  const auto devices = devices_of_runs(3, 1, 1);
  for (const auto& d : devices) EXPECT_EQ(d, std::set<int>{0});
}

TEST(LocalLauncher, RanksOfARunTakeTheNextDevices) {
  const auto devices = devices_of_runs(2, 2, 2);
  EXPECT_EQ(devices[0], (std::set<int>{0, 1}));
  EXPECT_EQ(devices[1], (std::set<int>{2, 3}));
}

// A driver that was itself given devices from the fourth on, of five: the second run begins again at the
// first.
TEST(LocalLauncher, SlotsCountFromTheDriversFirstDevice) {
  setenv("HEMOWALK_DEVICE", "4", 1);
  const auto devices = devices_of_runs(2, 2, 1);
  unsetenv("HEMOWALK_DEVICE");
  EXPECT_EQ(devices[0], std::set<int>{4});
  EXPECT_EQ(devices[1], std::set<int>{0});
}

/// As `hemowalk resolve FOLDER/scene.yaml --out FOLDER --resume`.
int run(const fs::path& folder) {
  std::ofstream(folder / (std::to_string(device_of_process(devices_of_machine)) + ".device"));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // until the others have been started
  Status status;
  status.state = State::done;
  const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
  if (!rank || std::string(rank) == "0") write_status(folder, status);
  return 0;
}

}  // namespace
}  // namespace hemowalk::workflow

int main(int argc, char** argv) {
  if (argc > 4 && std::string(argv[1]) == "resolve") return hemowalk::workflow::run(argv[4]);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
