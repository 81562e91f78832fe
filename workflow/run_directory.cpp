#include "workflow/run_directory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/io.hpp"

namespace hemowalk::workflow {

namespace {
constexpr std::array<const char*, 6> state_names{"queued", "running",   "done",
                                                 "failed", "timed_out", "interrupted"};
}

std::string to_string(State state) { return state_names[static_cast<std::size_t>(state)]; }

std::optional<Status> read_status(const std::string& run_folder) {
  const std::string path = run_folder + "/status.json";
  if (!std::filesystem::exists(path)) return std::nullopt;
  const auto json = nlohmann::json::parse(read_file(path), nullptr, false);
  if (!json.is_object()) return std::nullopt;
  try {
    Status status;
    const auto name = json.at("state").get<std::string>();
    const auto found = std::find(state_names.begin(), state_names.end(), name);
    if (found == state_names.end()) return std::nullopt;
    status.state = static_cast<State>(found - state_names.begin());
    if (json.contains("exit_code") && json["exit_code"].is_number())
      status.exit_code = json["exit_code"].get<int>();
    status.reason = json.value("reason", "");
    status.attempt = json.value("attempt", 0);
    status.steps = json.value("steps", std::int64_t{0});
    status.wall = json.value("wall_s", 0.0);
    status.progress = json.value("progress", 0.0);
    status.line = json.value("line", "");
    return status;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

void write_status(const std::string& run_folder, const Status& status) {
  nlohmann::ordered_json json;
  json["state"] = to_string(status.state);
  json["exit_code"] =
      status.exit_code ? nlohmann::ordered_json(*status.exit_code) : nlohmann::ordered_json(nullptr);
  json["reason"] = status.reason;
  json["attempt"] = status.attempt;
  json["steps"] = status.steps;
  json["wall_s"] = status.wall;
  json["progress"] = status.progress;
  json["line"] = status.line;
  write_file_atomic(run_folder + "/status.json", json.dump(2) + "\n");
}

Lock::Lock(const std::string& path) {
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) throw_io_error("cannot create the lock", path);
  held_ = flock(fd_, LOCK_EX | LOCK_NB) == 0;
}

Lock::~Lock() {
  if (fd_ >= 0) close(fd_);
}

bool Lock::wait(double seconds) {
  using clock = std::chrono::steady_clock;
  const auto until = clock::now() + std::chrono::duration<double>(seconds);
  while (!held_) {
    held_ = flock(fd_, LOCK_EX | LOCK_NB) == 0;
    if (held_ || clock::now() > until) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return held_;
}

}  // namespace hemowalk::workflow
