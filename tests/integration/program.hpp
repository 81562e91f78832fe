#pragma once
/// \file The program as a user calls it: arguments in, exit code, stdout and stderr out; and a folder that
/// goes away.

#include <stdlib.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace hemowalk::test {

inline std::string slurp(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A temporary folder, removed at the end.
class Scratch {
 public:
  Scratch() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hemowalk_test_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Scratch() { std::filesystem::remove_all(path_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// Runs "hemowalk ARGUMENTS" (shell syntax) in \p folder.
inline Outcome hemowalk(const Scratch& folder, const std::string& arguments) {
  const std::string command =
      "cd '" + folder.path().string() + "' && '" HEMOWALK_PROGRAM "' " + arguments + " >.out 2>.err";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(folder.path() / ".out"),
          slurp(folder.path() / ".err")};
}

}  // namespace hemowalk::test
