#pragma once
/// \file What all verbs share: the common flags, the head of --json, and how a verb enters the program.

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hemowalk::workflow {

/// The flags of docs/reference.md that any verb may take.
struct Flags {
  std::string file;                   ///< the verb's FILE
  std::vector<std::string> set;       ///< --set dotted.key=value
  std::string out;                    ///< --out DIR
  int threads = 0;                    ///< --threads; 0 = all cores
  std::optional<std::uint64_t> seed;  ///< --seed
  bool strict = false, json = false;
};

/// One call of the program: filled by the parser, run by main().
struct Session {
  Flags flags;
  std::string verb;
  std::vector<std::string> arguments;  ///< argv, for "how to reproduce"
  std::function<int()> action;         ///< returns the exit code
};

/// Which common flags a verb takes.
enum Accepts : unsigned {
  takes_file = 1,
  takes_set = 2,
  takes_out = 4,
  takes_threads = 8,
  takes_seed = 16,
  takes_strict = 32
};

/// Adds the sub-command \p name with --json and the flags in \p accepts. Its action runs when it is called.
CLI::App* add_verb(CLI::App& program, Session& session, const std::string& name,
                   const std::string& description, unsigned accepts, std::function<int()> action,
                   const std::string& file_description = "input file");

/// format, version, input_sha256, seed, warnings: the first keys of every --json object.
nlohmann::ordered_json json_head(const std::string& verb, const std::string& input_sha256,
                                 std::optional<std::uint64_t> seed,
                                 const std::vector<std::string>& warnings = {});

/// NaN and infinity become null; JSON has no others.
nlohmann::ordered_json finite(double value);
nlohmann::ordered_json finite(const std::vector<double>& values);

/// Prints \p object on stdout.
void print_json(const nlohmann::ordered_json& object);

/// --set with --seed appended as "seed=N".
std::vector<std::string> overrides(const Flags& flags);

/// Each verb lives in verbs/<name>.cpp.
void add_check(CLI::App&, Session&);
void add_plan(CLI::App&, Session&);
void add_run(CLI::App&, Session&);
void add_status(CLI::App&, Session&);
void add_resolve(CLI::App&, Session&);
void add_bench(CLI::App&, Session&);
void add_calibrate(CLI::App&, Session&);
void add_coarse(CLI::App&, Session&);
void add_report(CLI::App&, Session&);
void add_schema(CLI::App&, Session&);
void add_test(CLI::App&, Session&);

}  // namespace hemowalk::workflow
