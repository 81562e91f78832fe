#include "workflow/local_launcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <memory>
#include <thread>

#include "core/check.hpp"
#include "core/device_choice.hpp"
#include "core/log.hpp"
#include "core/progress.hpp"
#include "workflow/process.hpp"

namespace hemowalk::workflow {

namespace {

using clock = std::chrono::steady_clock;
double seconds_since(clock::time_point start) {
  return std::chrono::duration<double>(clock::now() - start).count();
}

/// A run in a child process.
struct Active {
  std::size_t job;
  clock::time_point started;
  std::unique_ptr<Child> child;
  int tries;
  int slot;  ///< among those that run at the same time
  bool out_of_time = false, told_to_stop = false;
};

/// What the child left behind, put right where it could not write its own end.
Status last_status(const Active& run, const Ending& ending, const std::string& folder, double time_limit,
                   int stop_signal) {
  Status status = read_status(folder).value_or(Status{});
  const bool child_said_so = status.state != State::running && status.state != State::queued;
  if (run.out_of_time) {
    status.state = State::timed_out;
    status.reason = "over the time limit of " + format_duration(time_limit);
  } else if (ending.signal || !child_said_so) {
    const bool stopped =
        ending.exit_code == static_cast<int>(Exit::interrupted) ||
        (run.told_to_stop && (ending.signal == stop_signal || ending.exit_code == 128 + stop_signal));
    status.state = stopped ? State::interrupted : State::failed;
    status.reason = describe(ending) + ", see log.txt";
  }
  if (ending.exit_code) status.exit_code = *ending.exit_code;
  write_status(folder, status);
  return status;
}

/// Reruns are bit-identical: what the input or the physics did wrong comes back, what the machine did may
/// not.
bool worth_retrying(const Status& status) {
  if (status.state == State::timed_out) return true;  // continues from its checkpoint
  if (status.state != State::failed) return false;
  const int code = status.exit_code.value_or(-1);
  return code != static_cast<int>(Exit::usage) && code != static_cast<int>(Exit::physics) &&
         code != static_cast<int>(Exit::refused);
}

class Pool {
 public:
  Pool(const std::vector<Job>& jobs, const LaunchOptions& options)
      : jobs_(jobs), options_(options), status_(jobs.size()), done_(jobs.size(), 0.0), progress_("runs") {
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      waiting_.push_back({j, 0});
      status_[j] = read_status(jobs[j].folder).value_or(Status{});
      total_cost_ += jobs[j].cost;
    }
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    threads_ = options.threads > 0
                   ? options.threads
                   : std::max(1, cores / (std::max(1, options.slots) * std::max(1, options.ranks)));
    if (options.ranks > 1) launcher_ = mpirun(cores);
  }

  std::vector<Status> run() {
    bool told = false;
    while (!waiting_.empty() || !active_.empty()) {
      if (stop_requested() && !told) {
        told = stopping_ = true;
        stop_children();
        log_info("stopping: the runs in progress write their checkpoints");
      }
      while (!stopping_ && !waiting_.empty() &&
             static_cast<int>(active_.size()) < std::max(1, options_.slots))
        start_next();
      if (stopping_ && active_.empty()) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      for (std::size_t k = active_.size(); k-- > 0;) look_after(k);
      show();
    }
    return status_;
  }

 private:
  struct Waiting {
    std::size_t job;
    int tries;
  };

  /// How runs of several ranks start. Each rank gets cores of its own where they suffice; runs side by side
  /// would all be bound to the first cores, so they are left to the system.
  std::vector<std::string> mpirun(int cores) const {
    const auto program = find_program("mpirun");
    require(program.has_value(),
            "launcher.ranks is " + std::to_string(options_.ranks) +
                " and there is no mpirun (runs of several ranks start through it) install "
                "Open MPI, or use launcher.ranks: 1");
    std::vector<std::string> words{*program, "--quiet", "-n", std::to_string(options_.ranks)};
    const bool own_cores = options_.slots <= 1 && options_.ranks * threads_ <= cores;
    const std::vector<std::string> binding =
        own_cores
            ? std::vector<std::string>{"--map-by", "slot:PE=" + std::to_string(threads_), "--bind-to", "core"}
            : std::vector<std::string>{"--bind-to", "none"};
    words.insert(words.end(), binding.begin(), binding.end());
    // After SIGTERM Open MPI kills within a second: ranks need time for their checkpoint.
    words.insert(words.end(), {"--mca", "odls_base_sigkill_timeout", "600"});
    return words;
  }
  /// mpirun passes SIGUSR1 on to all ranks and lives on, where SIGTERM ends it.
  int stop_signal() const { return launcher_.empty() ? SIGTERM : SIGUSR1; }

  void stop_children() {
    for (auto& a : active_) {
      a.told_to_stop = true;
      a.child->signal(stop_signal());
    }
  }

  void start_next() {
    const auto [j, tries] = waiting_.front();
    waiting_.pop_front();
    const Job& job = jobs_[j];
    std::vector<std::string> arguments = launcher_;
    arguments.insert(arguments.end(), {this_program(), "resolve", job.folder + "/scene.yaml", "--out",
                                       job.folder, "--resume"});
    const int slot = free_slot();
    // Runs that are under way together start at devices of their own, where there are enough.
    const int device = first_device_of_run() + slot * std::max(1, options_.ranks);
    const std::map<std::string, std::string> environment{{"OMP_NUM_THREADS", std::to_string(threads_)},
                                                         {"HEMOWALK_DEVICE", std::to_string(device)}};
    active_.push_back(
        {j, clock::now(),
         std::make_unique<Child>(arguments, job.folder + "/log.txt", environment, stop_signal()), tries + 1,
         slot});
  }

  /// Lowest number that no run under way has.
  int free_slot() const {
    for (int slot = 0;; ++slot)
      if (std::none_of(active_.begin(), active_.end(), [slot](const Active& a) { return a.slot == slot; }))
        return slot;
  }

  void look_after(std::size_t k) {
    Active& run = active_[k];
    const Job& job = jobs_[run.job];
    if (const auto ending = run.child->poll()) {
      status_[run.job] = last_status(run, *ending, job.folder, options_.time_limit, stop_signal());
      const Status status = status_[run.job];
      const int tries = run.tries;
      const std::size_t j = run.job;
      active_.erase(active_.begin() + static_cast<std::ptrdiff_t>(k));
      finished(j, tries, status);
      return;
    }
    if (options_.time_limit > 0 && !run.out_of_time && seconds_since(run.started) > options_.time_limit) {
      run.out_of_time = true;
      run.child->signal(stop_signal());
    }
  }

  void finished(std::size_t j, int tries, const Status& status) {
    if (status.state == State::done) {
      done_[j] = 1;
      return;
    }
    if (status.state == State::interrupted) {
      stopping_ = true;
      return;
    }
    log_warning(jobs_[j].title + ": " + to_string(status.state) + " (" + status.reason + ")");
    if (options_.on_failure == OnFailure::retry && tries < options_.attempts && worth_retrying(status)) {
      log_info(fmt::format("{}: trying again ({} of {})", jobs_[j].title, tries + 1, options_.attempts));
      waiting_.push_back({j, tries});
      return;
    }
    done_[j] = 1;
    if (options_.on_failure == OnFailure::abort) {
      stopping_ = true;
      stop_children();
    }
  }

  void show() {
    std::string note =
        fmt::format("{} of {} finished", std::count(done_.begin(), done_.end(), 1.0), jobs_.size());
    double cost = 0;
    for (std::size_t j = 0; j < jobs_.size(); ++j) cost += done_[j] * jobs_[j].cost;
    for (const auto& a : active_) {
      const auto status = read_status(jobs_[a.job].folder);
      if (!status || status->state != State::running) continue;
      cost += status->progress * jobs_[a.job].cost;
      note += " · " + jobs_[a.job].title + " " + status->line;
    }
    progress_.update(total_cost_ > 0 ? cost / total_cost_ : 1, note);
  }

  const std::vector<Job>& jobs_;
  const LaunchOptions& options_;
  std::deque<Waiting> waiting_;
  std::vector<Active> active_;
  std::vector<Status> status_;
  std::vector<double> done_;
  double total_cost_ = 0;
  int threads_ = 1;
  std::vector<std::string> launcher_;  ///< words before the program's; none on one rank
  bool stopping_ = false;
  Progress progress_;
};

}  // namespace

std::vector<Status> run_jobs(const std::vector<Job>& jobs, const LaunchOptions& options) {
  if (jobs.empty()) return {};
  return Pool(jobs, options).run();
}

}  // namespace hemowalk::workflow
