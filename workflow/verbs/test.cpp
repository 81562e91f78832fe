/// \file hemowalk test: the launcher beside the sources builds and runs the tests; the program only finds it.

#include <unistd.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "core/check.hpp"
#include "workflow/command.hpp"
#include "workflow/process.hpp"

namespace hemowalk::workflow {

void add_test(CLI::App& program, Session& session) {
  auto* verb = add_verb(
      program, session, "test", "build and run the tests: test [--label validation] [ctest arguments]", 0,
      [&session] {
        // <root>/build/<preset>/bin/hemowalk
        const auto root =
            std::filesystem::path(this_program()).parent_path().parent_path().parent_path().parent_path();
        const std::string launcher = (root / "hemowalk").string();
        require(std::filesystem::exists(launcher), "the tests need the sources (no launcher at " + launcher +
                                                       ") run ./hemowalk test in a source folder");
        std::vector<std::string> texts{launcher, "test"};
        texts.insert(texts.end(), session.arguments.begin() + 2, session.arguments.end());
        std::vector<char*> arguments;
        for (auto& t : texts) arguments.push_back(t.data());
        arguments.push_back(nullptr);
        execv(arguments[0], arguments.data());
        throw IoError("cannot start " + launcher + " (execv failed) check its permissions");
        return 1;
      });
  verb->allow_extras();
}

}  // namespace hemowalk::workflow
