/// \file The program: one binary, one sub-command per verb. Errors become exit codes here and nowhere else.

#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/mpi.hpp"
#include "core/provenance.hpp"
#include "core/yaml/document.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {
namespace {

/// Verbs of the contract that later versions bring.
const std::map<std::string, std::string> later_verbs{
    {"chart", "measures error against cost over the numerical settings"},
    {"stability", "maps where each method fails"},
    {"export", "converts results for other programs"}};

/// An unknown or future verb, said before the parser sees it. \throws InputError
void check_verb(const CLI::App& program, const std::string& word) {
  if (word.empty() || word[0] == '-') return;
  std::vector<std::string> names;
  for (const CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; })) {
    if (verb->get_name() == word) return;
    names.push_back(verb->get_name());
  }
  if (const auto later = later_verbs.find(word); later != later_verbs.end())
    throw InputError("`" + word + "` is not in this version (" + later->second +
                     "; planned) see hemowalk --help for what is");
  const auto near = yaml::nearest(word, names);
  throw InputError("unknown command `" + word + "` (it is none of the program's verbs) " +
                   (near.empty() ? "see hemowalk --help" : "did you mean `" + near + "`?"));
}

/// The last word on an error: readable on stderr, and the one JSON object if that was asked for.
int fail(const Session& session, bool json, int code, const std::string& message) {
  if (mpi::world_rank() != 0) return code;  // the root says it, once
  log_error(message);
  if (json) {
    auto object = json_head(session.verb.empty() ? "error" : session.verb, "", std::nullopt);
    object["error"] = {{"exit_code", code}, {"message", message}};
    print_json(object);
  }
  return code;
}

int run(int argc, char** argv) {
  Session session;
  session.arguments.assign(argv, argv + argc);
  CLI::App program{
      "Cellular blood flow: from resolved cells to the diffusion of platelets and transport at device "
      "scale.\n"
      "scene -> [resolve] -> trajectories -> [calibrate] -> transport law -> [coarse] -> report"};
  program.name("hemowalk");
  program.set_version_flag("--version", program_description());
  program.require_subcommand(1);
  program.footer(
      "Start here:  hemowalk run examples/quickstart.yaml\n"
      "Exit codes: 0 done, 1 internal error, 2 bad input, 3 physics failed, 4 refused, 5 failed runs, 74 "
      "disk, 75 stopped.");
  add_check(program, session);
  add_plan(program, session);
  add_run(program, session);
  add_status(program, session);
#if defined(HEMOWALK_WITH_RESOLVED)
  add_resolve(program, session);
  add_bench(program, session);
#endif
  add_calibrate(program, session);
  add_coarse(program, session);
  add_report(program, session);
  add_schema(program, session);
  add_test(program, session);

  const bool json =
      std::find(session.arguments.begin(), session.arguments.end(), "--json") != session.arguments.end();
  try {
    if (argc > 1) check_verb(program, argv[1]);
    program.parse(argc, argv);
    if (session.flags.threads > 0) omp_set_num_threads(session.flags.threads);
    return session.action();
  } catch (const CLI::Success& asked) {  // --help, --version
    return program.exit(asked);
  } catch (const CLI::ParseError& error) {
    if (argc == 1) {
      std::fputs(program.help().c_str(), stderr);
      return static_cast<int>(Exit::usage);
    }
    return fail(session, json, static_cast<int>(Exit::usage),
                std::string(error.what()) + " (usage) see hemowalk " +
                    (argc > 1 && argv[1][0] != '-' ? argv[1] + std::string(" ") : "") + "--help");
  } catch (const Error& error) {
    return fail(session, json, static_cast<int>(error.code), error.what());
  } catch (const std::bad_alloc&) {
    return fail(session, json, static_cast<int>(Exit::usage),
                "out of memory (the input asks for more than this machine has) make it smaller");
  } catch (const std::exception& error) {
    return fail(session, json, static_cast<int>(Exit::internal),
                std::string("internal error: ") + error.what());
  }
}

}  // namespace
}  // namespace hemowalk::workflow

int main(int argc, char** argv) {
  const int code = hemowalk::workflow::run(argc, argv);
  hemowalk::mpi::finish();
  return code;
}
