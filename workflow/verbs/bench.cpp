/// \file hemowalk bench: time per step by part, beside ceilings of this machine measured in the same run.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "core/mpi.hpp"
#include "core/progress.hpp"
#include "resolved/bench.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {
namespace {

using resolved::BenchReport;
using resolved::Timings;

/// Blood between a resting and a sliding wall, the paper's cells (docs/reference.md, scene.yaml).
struct NamedScene {
  const char *name, *size, *hematocrit, *description;
};
constexpr NamedScene scenes[] = {
    {"reference", "[50 um, 50 um, 50 um]", "0.35", "the reference work: 476 red cells, 95 platelets"},
    {"box20", "[20 um, 20 um, 20 um]", "0.35", "the quickstart's box"},
    {"ht45", "[50 um, 50 um, 50 um]", "0.45", "the reference at 45 %"},
    {"h100", "[50 um, 100 um, 50 um]", "0.35", "twice as high"},
    {"box100", "[100 um, 100 um, 100 um]", "0.35", "eight times the reference"},
    {"h500", "[50 um, 500 um, 50 um]", "0.35", "ten times as high"},
    {"paper_100x1000x100", "[100 um, 1000 um, 100 um]", "0.35", "the paper's largest case (needs 16 GB)"},
};

std::string scene_text(const NamedScene& scene) {
  return fmt::format(R"(format: hemowalk.scene/1
domain: {{size: {}, geometry: slab}}
flow: {{type: couette, shear_rate: 100 1/s, walls: top}}
cells:
  hematocrit: {}
  platelets_per_rbc: 0.2
  kinds:
    rbc: {{shape: rbc, subdivision: 8, density: 1125 kg/m3, law: paper, kappa_damping: 0.9}}
    platelet: {{shape: platelet, subdivision: 4, law: rigid}}
time: {{end: 1 s, sample: 1 ms}}
)",
                     scene.size, scene.hematocrit);
}

data::Scene find_scene(const std::string& name, const Flags& flags) {
  for (const auto& scene : scenes)
    if (name == scene.name)
      return data::parse_scene(scene_text(scene), "bench scene " + name, overrides(flags));
  std::string known;
  for (const auto& scene : scenes) known += (known.empty() ? "" : ", ") + std::string(scene.name);
  throw InputError("unknown bench scene `" + name + "` (it is none of " + known +
                   ") choose one of them, or give a scene file");
}

struct Row {
  const char *name, *key;
  double Timings::*time;
};
constexpr Row rows[] = {{"fluid", "fluid", &Timings::fluid},
                        {"interpolation, positions", "interpolation", &Timings::interpolation},
                        {"spreading", "spreading", &Timings::spreading},
                        {"solid", "solid", &Timings::solid},
                        {"contact", "contact", &Timings::contact},
                        {"communication", "communication", &Timings::communication},
                        {"other", "other", &Timings::other}};

std::array<std::pair<const char*, const char*>, 3> places(const data::Scene& scene) {
  const auto name = [](Place place) { return place == Place::host ? "host" : "device"; };
  return {{{"fluid", name(scene.place.fluid)},
           {"coupling", name(scene.place.coupling)},
           {"solid", name(scene.place.solid)}}};
}

nlohmann::ordered_json to_json(const std::string& name, const data::Scene& scene, const BenchReport& r) {
  const Timings& t = r.parts;
  nlohmann::ordered_json o;
  o["scene"] = name;
  o["nodes"] = r.nodes, o["markers"] = r.markers, o["cells"] = {{"rbc", r.rbc}, {"platelet", r.platelets}};
  o["threads"] = r.threads, o["ranks"] = r.ranks;
  o["precision"] = scene.fluid.precision == data::Fluid::Precision::double_ ? "double" : "single";
  o["acceleration"] = scene.acceleration;
  for (const auto& [part, place] : places(scene)) o["place"][part] = place;
  o["packing"] = r.packing;
  o["steps"] = r.parts.steps;
  o["step_ms"] = {{"median", 1e3 * r.step.median},
                  {"mean", 1e3 * r.step.mean},
                  {"min", 1e3 * r.step.min},
                  {"mad", 1e3 * r.step.mad}};
  for (const auto& row : rows) {
    o["parts_ms"][row.key] = finite(1e3 * (t.*row.time));
    const double least = r.least.*row.time;
    o["fraction_of_ceiling"][row.key] = least > 0 ? finite(least / (t.*row.time)) : nullptr;
  }
  o["paper_groups_ms"] = {{"fluid", 1e3 * t.fluid},
                          {"ibm", 1e3 * (t.interpolation + t.spreading)},
                          {"solid", 1e3 * t.solid},
                          {"communication", 1e3 * t.communication},
                          {"other", 1e3 * (t.contact + t.other)}};
  o["ceilings"] = {{"bandwidth_gb_per_s", 1e-9 * r.bandwidth}, {"fma_gflop_per_s", 1e-9 * r.fma}};
  o["fluid"] = {{"mlups", finite(r.mlups())},
                {"bytes_per_node", r.bytes_per_node},
                {"fraction_of_roofline", r.least.fluid > 0 ? finite(r.least.fluid / t.fluid) : nullptr}};
  o["memory_mb"] = 1e-6 * r.memory;
  o["iterations_mean"] = r.iterations_mean;
  o["momentum_residual_rel"] = r.momentum_residual;
  o["wall_s_per_simulated_s"] = r.step.mean / r.simulated_per_step;
  return o;
}

void print(const std::string& name, const data::Scene& scene, const BenchReport& r) {
  fmt::print(
      "{}: {} nodes, {} markers, {} red cells, {} platelets ({}); {} ranks of {} threads, acceleration "
      "{:g}\n",
      name, r.nodes, r.markers, r.rbc, r.platelets, r.packing, r.ranks, r.threads, scene.acceleration);
  for (const auto& [part, place] : places(scene))
    fmt::print("{} on the {}{}", part, place, part == std::string("solid") ? "\n" : ", ");
  fmt::print("ceilings of this run: {:.1f} GB/s, {:.0f} Gflop/s\n\n{:<26}{:>10}{:>9}{:>22}\n",
             1e-9 * r.bandwidth, 1e-9 * r.fma, "part", "ms/step", "share", "fraction of ceiling");
  for (const auto& row : rows) {
    const double time = r.parts.*row.time, least = r.least.*row.time;
    if (std::isnan(time)) continue;  // not timed: the whole step on several devices
    fmt::print("{:<26}{:>10.3f}{:>8.1f}%{:>22}\n", row.name, 1e3 * time, 100 * time / r.step.median,
               least > 0 ? fmt::format("{:.2f}", least / time) : "-");
  }
  fmt::print("{:<26}{:>10.3f}   (mean {:.3f}, min {:.3f}, median absolute deviation {:.3f}, {} steps)\n\n",
             "whole step", 1e3 * r.step.median, 1e3 * r.step.mean, 1e3 * r.step.min, 1e3 * r.step.mad,
             r.parts.steps);
  fmt::print("fluid {:.0f} MLUPS at {:.0f} bytes per node; {:.1f} ns per node and step; memory {:.0f} MB\n",
             r.mlups(), r.bytes_per_node, 1e9 * r.step.median / static_cast<double>(r.nodes),
             1e-6 * r.memory);
  fmt::print("momentum of fluid, cells and walls closes to {:.1e}; one second of blood takes {}\n",
             r.momentum_residual, format_duration(r.step.mean / r.simulated_per_step));
}

/// Several scenes: is the cost linear?
void print_scaling(const std::vector<std::pair<std::string, BenchReport>>& reports) {
  fmt::print("\n{:<22}{:>12}{:>9}{:>11}{:>12}{:>14}{:>12}{:>10}\n", "scene", "nodes", "cells", "ms/step",
             "ns/node", "fluid MLUPS", "bytes/node", "GB/s");
  for (const auto& [name, r] : reports)
    fmt::print("{:<22}{:>12}{:>9}{:>11.2f}{:>12.2f}{:>14.0f}{:>12.0f}{:>10.1f}\n", name, r.nodes,
               r.rbc + r.platelets, 1e3 * r.step.median, 1e9 * r.step.median / static_cast<double>(r.nodes),
               r.mlups(), r.memory / static_cast<double>(r.nodes), 1e-9 * r.bandwidth);
}

int bench(const Flags& flags, const std::string& names, int steps) {
  mpi::start();  // under mpirun or srun: all ranks time one run
  require(flags.file.empty() || names.empty(),
          "both a scene file and --scene are given (one is benched) drop one");
  std::vector<std::pair<std::string, data::Scene>> asked;
  if (!flags.file.empty()) {
    asked.emplace_back(flags.file, data::read_scene(flags.file, overrides(flags)));
  } else {
    std::stringstream list(names.empty() ? "reference" : names);
    for (std::string name; std::getline(list, name, ',');) asked.emplace_back(name, find_scene(name, flags));
  }
  std::vector<std::pair<std::string, BenchReport>> reports;
  auto all = nlohmann::ordered_json::array();
  const bool speaks = mpi::Ranks::world().root();
  for (const auto& [name, scene] : asked) {
    Progress progress(name);
    resolved::BenchOptions options;
    options.steps = steps;
    options.warm_up = std::min(steps, 10);
    options.ranks = mpi::Ranks::world();
    options.progress = [&](double fraction, const std::string& what) { progress.update(fraction, what); };
    reports.emplace_back(name, resolved::bench(scene, options));
    all.push_back(to_json(name, scene, reports.back().second));
    if (!flags.json && speaks) print(name, scene, reports.back().second);
  }
  if (!flags.json && speaks && reports.size() > 1) print_scaling(reports);
  if (!flags.json || !speaks) return 0;
  auto object = json_head("bench", asked.front().second.input_sha256, asked.front().second.seed);
  if (all.size() == 1) {
    object.update(all.front());
  } else {
    object["scenes"] = all;
  }
  print_json(object);
  return 0;
}

}  // namespace

void add_bench(CLI::App& program, Session& session) {
  auto names = std::make_shared<std::string>();
  auto steps = std::make_shared<int>(50);
  auto* verb = add_verb(
      program, session, "bench", "time per step by part, beside this machine's ceilings",
      takes_file | takes_set | takes_threads | takes_seed,
      [&session, names, steps] { return bench(session.flags, *names, *steps); }, "scene.yaml (or --scene)");
  verb->add_option(
          "--scene", *names,
          "reference (default), box20, ht45, h100, box100, h500, paper_100x1000x100; several with commas: a "
          "table of how cost scales")
      ->type_name("NAME");
  verb->add_option("--steps", *steps, "timed steps")->type_name("N");
}

}  // namespace hemowalk::workflow
