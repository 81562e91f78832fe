#pragma once
/// \file One run's folder, DIR/runs/<hash12>: its state on disk and the lock that says somebody works in it.

#include <cstdint>
#include <optional>
#include <string>

namespace hemowalk::workflow {

enum class State { queued, running, done, failed, timed_out, interrupted };
std::string to_string(State state);

/// status.json: {state, exit_code, reason, attempt, steps, wall_s, progress, line}.
struct Status {
  State state = State::queued;
  std::optional<int> exit_code;
  std::string reason;  ///< why it is in this state, one line
  int attempt = 0;     ///< how often it was started
  std::int64_t steps = 0;
  double wall = 0;      ///< s, all attempts together
  double progress = 0;  ///< fraction done
  std::string line;     ///< what it is doing, one line
};

/// Empty if there is none or it cannot be understood (a run without a status starts anew).
std::optional<Status> read_status(const std::string& run_folder);
/// Replaces status.json in one step. \throws IoError
void write_status(const std::string& run_folder, const Status& status);

/// An exclusive lock on a file, held while the object lives; the system frees it when the process dies.
class Lock {
 public:
  /// Creates \p path if needed. Does not wait: ask held(). \throws IoError
  explicit Lock(const std::string& path);
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;
  ~Lock();
  bool held() const { return held_; }
  /// Waits for the holder, at most \p seconds. \returns held()
  bool wait(double seconds);

 private:
  int fd_ = -1;
  bool held_ = false;
};

}  // namespace hemowalk::workflow
