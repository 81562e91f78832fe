#include "workflow/command.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "core/provenance.hpp"

namespace hemowalk::workflow {

CLI::App* add_verb(CLI::App& program, Session& session, const std::string& name,
                   const std::string& description, unsigned accepts, std::function<int()> action,
                   const std::string& file_description) {
  Flags& flags = session.flags;
  CLI::App* verb = program.add_subcommand(name, description);
  if (accepts & takes_file) verb->add_option("FILE", flags.file, file_description)->type_name("");
  if (accepts & takes_set)
    verb->add_option("--set", flags.set, "change one key of the input, e.g. --set domain.size.1='100 um'")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->take_all();
  if (accepts & takes_out) verb->add_option("--out", flags.out, "folder to write into")->type_name("DIR");
  if (accepts & takes_threads)
    verb->add_option("--threads", flags.threads, "threads to use (default: all cores)")
        ->type_name("N")
        ->check(CLI::PositiveNumber);
  if (accepts & takes_seed)
    verb->add_option("--seed", flags.seed, "seed of the random numbers")->type_name("N");
  if (accepts & takes_strict)
    verb->add_flag("--strict", flags.strict,
                   "a failed artefact gate or use outside the stated validity is an error (exit 4)");
  verb->add_flag("--json", flags.json, "print one JSON object on stdout, everything else on stderr");
  verb->callback([&session, name, action = std::move(action)] {
    session.verb = name;
    session.action = action;
  });
  return verb;
}

nlohmann::ordered_json finite(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json finite(const std::vector<double>& values) {
  auto array = nlohmann::ordered_json::array();
  for (const double v : values) array.push_back(finite(v));
  return array;
}

nlohmann::ordered_json json_head(const std::string& verb, const std::string& input_sha256,
                                 std::optional<std::uint64_t> seed,
                                 const std::vector<std::string>& warnings) {
  nlohmann::ordered_json head;
  head["format"] = "hemowalk." + verb + "/1";
  head["version"] = version();
  head["input_sha256"] =
      input_sha256.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(input_sha256);
  head["seed"] = seed ? nlohmann::ordered_json(*seed) : nlohmann::ordered_json(nullptr);
  head["warnings"] = warnings;
  return head;
}

void print_json(const nlohmann::ordered_json& object) {
  const std::string text =
      object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

std::vector<std::string> overrides(const Flags& flags) {
  auto result = flags.set;
  if (flags.seed) result.push_back("seed=" + std::to_string(*flags.seed));
  return result;
}

}  // namespace hemowalk::workflow
