#pragma once
/// \file Child processes: a run that crashes takes nothing but itself down.

#include <sys/types.h>

#include <csignal>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace hemowalk::workflow {

/// How a child ended: exactly one of the two is set.
struct Ending {
  std::optional<int> exit_code;
  std::optional<int> signal;
};

/// A running child of this process. It gets a signal when this process dies, so that it can write a
/// checkpoint.
class Child {
 public:
  /// Starts \p arguments[0] with stdout and stderr appended to \p log_file, in this process's environment
  /// with \p environment on top, and without what says that mpirun or srun started this process.
  /// \param at_parents_death signal. \throws IoError
  Child(const std::vector<std::string>& arguments, const std::string& log_file,
        const std::map<std::string, std::string>& environment = {}, int at_parents_death = SIGTERM);
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  /// Kills a child that is still there and waits for it.
  ~Child();

  pid_t pid() const { return pid_; }
  /// Empty while it runs.
  std::optional<Ending> poll();
  void signal(int number) const;

 private:
  pid_t pid_ = -1;
  std::optional<Ending> ending_;
};

/// "exit code 3", "killed by signal 11 (Segmentation fault)".
std::string describe(const Ending& ending);

/// Path of a program that the user could start by its name.
std::optional<std::string> find_program(const std::string& name);

/// Path of the running program.
std::string this_program();

/// SIGTERM, SIGINT and SIGUSR1 set a flag instead of ending the program; a second SIGINT ends it at once.
void catch_stop_signals();
bool stop_requested();

}  // namespace hemowalk::workflow
