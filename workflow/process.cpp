#include "workflow/process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "core/check.hpp"

extern char** environ;

namespace hemowalk::workflow {

namespace {

volatile std::sig_atomic_t stop_flag = 0;

void on_stop(int number) {
  if (stop_flag && number == SIGINT) _exit(128 + SIGINT);
  stop_flag = 1;
}

/// Set by a launcher for the process it started, which its children are not.
bool of_launcher(const std::string& key) {
  return key.starts_with("OMPI_COMM_WORLD_") || key == "PMIX_RANK" || key == "PMIX_NAMESPACE" ||
         key == "PMI_RANK" || key == "PMI_SIZE";
}

/// This process's environment with \p changes applied, as KEY=VALUE texts.
std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text = *entry;
    const std::string key = text.substr(0, text.find('='));
    if (!changes.count(key) && !of_launcher(key)) result.push_back(text);
  }
  for (const auto& [key, value] : changes) result.push_back(key + "=" + value);
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (auto& t : texts) result.push_back(t.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

Child::Child(const std::vector<std::string>& arguments, const std::string& log_file,
             const std::map<std::string, std::string>& environment, int at_parents_death) {
  // Everything that allocates happens before fork(): the child may only make async-signal-safe calls.
  auto argument_texts = arguments;
  auto environment_texts = environment_with(environment);
  auto argv = pointers(argument_texts);
  auto envp = pointers(environment_texts);
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0)
    throw IoError("cannot write " + log_file + " (" + std::strerror(errno) + ") check permissions and space");
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, at_parents_death);
    if (getppid() != parent) _exit(75);
    setpgid(0, 0);  // Ctrl-C goes to the driver, which stops its children in order
    const int nothing = open("/dev/null", O_RDONLY);
    if (nothing >= 0) dup2(nothing, 0);
    dup2(log, 1);
    dup2(log, 2);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  const int failure = errno;
  close(log);
  if (pid_ < 0)
    throw IoError(std::string("cannot start a child process (") + std::strerror(failure) +
                  ") free some memory");
}

Child::~Child() {
  if (pid_ > 0 && !poll()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

std::optional<Ending> Child::poll() {
  if (ending_) return ending_;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  ending_.emplace();
  if (WIFEXITED(status)) ending_->exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) ending_->signal = WTERMSIG(status);
  return ending_;
}

void Child::signal(int number) const {
  if (pid_ > 0 && !ending_) kill(pid_, number);
}

std::string describe(const Ending& ending) {
  if (ending.signal)
    return "killed by signal " + std::to_string(*ending.signal) + " (" + strsignal(*ending.signal) + ")";
  return "exit code " + std::to_string(ending.exit_code.value_or(-1));
}

std::optional<std::string> find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::stringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const std::string file = folder + "/" + name; access(file.c_str(), X_OK) == 0) return file;
  return std::nullopt;
}

std::string this_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop;
  for (const int number : {SIGTERM, SIGINT, SIGUSR1}) sigaction(number, &action, nullptr);
}

bool stop_requested() { return stop_flag != 0; }

}  // namespace hemowalk::workflow
