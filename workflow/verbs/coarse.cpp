/// \file hemowalk coarse: a transport law and a device -> concentration and absorbed fraction

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "coarse/simulation.hpp"
#include "core/check.hpp"
#include "core/log.hpp"
#include "core/progress.hpp"
#include "workflow/command.hpp"
#include "workflow/process.hpp"

namespace hemowalk::workflow {
namespace {

namespace fs = std::filesystem;

int coarse_walk(const Flags& flags, const std::string& method) {
  require(!flags.file.empty(), "coarse needs a case (coarse.yaml) give its file: hemowalk coarse FILE");
  const auto the_case = coarse::read_case(flags.file, overrides(flags));
  const bool solve = method == "fokker_planck";
  if (const std::string problem = coarse::place_problem(the_case); !solve) require(problem.empty(), problem);
  const auto law = the_case.constant_D ? data::TransportLaw::constant(*the_case.constant_D)
                                       : data::read_transport_law(the_case.law_file);
  Progress progress(the_case.name);
  coarse::RunOptions options;
  options.strict = flags.strict;
  options.fokker_planck = solve;
  options.progress = [&](double fraction) {
    progress.update(fraction);
    if (stop_requested())
      throw Interrupted("stopped by a signal (a walk keeps no checkpoint) start it again");
  };
  catch_stop_signals();
  const auto result = coarse::run(the_case, law, options);
  for (const auto& w : result.warnings) log_warning(w);

  const auto file =
      (fs::path(flags.out.empty() ? "." : flags.out) / (the_case.name + ".h5")).lexically_normal().string();
  coarse::write_result(result, the_case, file);
  if (flags.json) {
    auto object = nlohmann::ordered_json::parse(coarse::to_json(result, the_case));
    object["file"] = file;
    print_json(object);
    return 0;
  }
  fmt::print("{}: {} walkers, {} ({})\n\n{:>12}{:>20}{:>14}{:>14}\n", the_case.name, result.walkers,
             result.method, result.reason, "time (s)", "absorbed fraction", "sampling", "law");
  for (std::size_t i = 0; i < result.time.size(); ++i)
    fmt::print("{:>12.6g}{:>20.6f}{:>14.2g}{:>14.2g}\n", result.time[i], result.absorbed_fraction[i],
               result.absorbed_sigma[i],
               i < result.absorbed_law_sigma.size() ? result.absorbed_law_sigma[i] : 0.0);
  fmt::print("\n{}\n", file);
  return 0;
}

}  // namespace

void add_coarse(CLI::App& program, Session& session) {
  auto method = std::make_shared<std::string>("walk");
  auto* verb = add_verb(
      program, session, "coarse", "transport law + device -> concentration, absorbed fraction",
      takes_file | takes_set | takes_out | takes_threads | takes_seed | takes_strict,
      [&session, method] { return coarse_walk(session.flags, *method); }, "coarse.yaml");
  verb->add_option("--method", *method, "walk (default) or fokker_planck, its equation without noise")
      ->check(CLI::IsMember({"walk", "fokker_planck"}))
      ->type_name("NAME");
}

}  // namespace hemowalk::workflow
