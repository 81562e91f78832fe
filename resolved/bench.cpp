#include "resolved/bench.hpp"

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "core/ceilings.hpp"
#include "core/check.hpp"
#include "core/statistics.hpp"
#include "resolved/device_simulation.hpp"
#include "resolved/packing.hpp"
#include "resolved/resolve.hpp"
#include "resolved/stepper.hpp"

namespace hemowalk::resolved {

namespace {

using data::Scene;

/// Resident memory of this process, bytes (0 where the system does not say).
double resident_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "VmRSS:") {
      double kib = 0;
      status >> kib;
      return 1024 * kib;
    }
  return 0;
}

/// Cells of \p scene; a box of several 50 um per axis is filled with repetitions of a packed part of it.
/// Cells stay between the walls of their part and the parts are periodic in x and z, so the whole has no
/// overlap.
std::vector<InitialCell> place_cells(const Scene& scene, std::string& how) {
  constexpr double part_size = 50e-6;
  const LatticeUnits units(scene);
  std::array<int, 3> repeats{1, 1, 1};
  Scene part = scene;
  for (int d = 0; d < 3; ++d) {
    const int n = static_cast<int>(std::lround(scene.domain.size[d] / part_size));
    const double nodes = units.length(scene.domain.size[d]) / std::max(1, n);
    if (n < 2 || std::abs(nodes - std::round(nodes)) > 1e-6) continue;
    repeats[d] = n, part.domain.size[d] = scene.domain.size[d] / n;
  }
  const bool whole = repeats == std::array{1, 1, 1} || !scene.cells.placements.empty();
  const auto cells = pack(whole ? scene : part);
  if (whole) {
    how = "packed";
    return cells;
  }
  how = fmt::format("packed box of {:g} x {:g} x {:g} um, repeated {} x {} x {}", 1e6 * part.domain.size[0],
                    1e6 * part.domain.size[1], 1e6 * part.domain.size[2], repeats[0], repeats[1], repeats[2]);
  std::vector<InitialCell> all;
  all.reserve(cells.size() * repeats[0] * repeats[1] * repeats[2]);
  for (int i = 0; i < repeats[0]; ++i)
    for (int j = 0; j < repeats[1]; ++j)
      for (int k = 0; k < repeats[2]; ++k)
        for (InitialCell cell : cells) {
          const std::array<int, 3> at{i, j, k};
          for (int d = 0; d < 3; ++d) {
            const double shift = at[d] * units.length(part.domain.size[d]);
            cell.centre[d] += shift;
            for (auto& v : cell.vertices) v[d] += shift;
          }
          all.push_back(std::move(cell));
        }
  return all;
}

/// Flops and bytes a part cannot do without, and the time they take at the ceilings, whichever is longer.
struct Ceilings {
  double bandwidth, fma;
  double time(double bytes, double flops) const { return std::max(bytes / bandwidth, flops / fma); }
};

template <class Real>
Timings least_times(const Ceilings& ceilings, double nodes, double markers) {
  Timings least;
  const double real = sizeof(Real);
  least.fluid = ceilings.time(nodes * lbm::Fluid<Real>::bytes_per_node_advance(), 0);
  // Kernels: 64 nodes x 4 components, one multiply-add each; the field passes through memory once, markers
  // bring a position and take a value (spreading also clears the field and fetches what it adds to).
  least.interpolation = ceilings.time(nodes * 4 * real + markers * (4 + 4 + 4) * real, 2 * 64 * 4 * markers);
  least.spreading = ceilings.time(nodes * 3 * 4 * real + markers * (4 + 4) * real, 2 * 64 * 3 * markers);
  return least;
}

/// Parts of a step on a device, s per fluid step.
template <class Real>
Timings device_parts(DeviceSimulation<Real>& device, int steps, int every, bool one_rank) {
  const double unknown = std::nan("");
  Timings parts{unknown, unknown, unknown, unknown, unknown, unknown, unknown, 0};
  if (!one_rank) return parts;
  const PartTimes t = device.time_parts(steps);
  return {t.fluid / every, (t.locate + t.interpolation) / every, t.spreading / every, t.solid / every,
          t.contact / every};
}

template <class Real>
BenchReport run(const Scene& scene, const BenchOptions& options) {
  const auto say = [&](double fraction, const std::string& what) {
    if (options.progress && options.ranks.root()) options.progress(fraction, what);
  };
  const auto sum = [&](double value) {
    options.ranks.sum({&value, 1});
    return value;
  };
  BenchReport report;
  // All ranks measure at the same time: together they have what the machine has.
  const Ceilings before{sum(memory_bandwidth()), sum(fma_rate<Real>())};
  say(0, "packing");
  std::vector<InitialCell> cells = place_cells(scene, report.packing);
  for (const auto& cell : cells)
    (scene.cells.kinds[cell.kind].name == "platelet" ? report.platelets : report.rbc) += 1;
  Simulation<Real> simulation(scene, cells, options.ranks);
  cells = {};
  report.nodes = simulation.decomposition().whole().interior();
  report.markers = static_cast<std::size_t>(sum(static_cast<double>(simulation.markers())));
  report.ranks = options.ranks.count();
  report.threads = omp_get_max_threads();
  report.simulated_per_step = simulation.units().to_time(1);
  report.bytes_per_node = lbm::Fluid<Real>::bytes_per_node_advance();
  Stepper<Real> stepper(simulation, options.device);
  DeviceSimulation<Real>* device = stepper.whole();
  for (int i = 0; i < options.warm_up; ++i) stepper.step();
  stepper.sync();

  using Part = double Timings::*;
  constexpr std::array<Part, 7> parts{&Timings::fluid, &Timings::interpolation, &Timings::spreading,
                                      &Timings::solid, &Timings::contact,       &Timings::communication,
                                      &Timings::other};
  const int every = scene.coupling.solid_every;
  std::array<std::vector<double>, parts.size()> times;
  std::vector<double> whole;
  const auto start = simulation.momentum();
  // A device is not waited for after each step.
  const int round = device ? std::min(10, options.steps) : 1, rounds = options.steps / round;
  for (int i = 0; i < rounds; ++i) {
    simulation.timings() = {};
    const double began = omp_get_wtime();
    for (int s = 0; s < round; ++s) stepper.step();
    stepper.wait();
    whole.push_back((omp_get_wtime() - began) / round / every);
    for (std::size_t p = 0; p < parts.size(); ++p) times[p].push_back(simulation.timings().*parts[p] / every);
    say(static_cast<double>(i + 1) / rounds, fmt::format("{:.1f} ms per step", 1e3 * whole.back()));
  }
  stepper.sync();
  const auto end = simulation.momentum();
  for (int d = 0; d < 3 && end.scale() > 0; ++d)
    report.momentum_residual =
        std::max(report.momentum_residual, std::abs(end.total()[d] - start.total()[d]) / end.scale());
  report.memory = sum(resident_memory());
  for (std::size_t p = 0; p < parts.size(); ++p) report.parts.*parts[p] = median(times[p]);
  if (device)
    report.parts = device_parts(*device, std::max(2, options.steps / 8), every, options.ranks.count() == 1);
  report.parts.steps = static_cast<std::int64_t>(rounds) * round * every;
  report.step.median = median(whole), report.step.min = *std::min_element(whole.begin(), whole.end());
  for (const double t : whole) report.step.mean += t / static_cast<double>(whole.size());
  for (auto& t : whole) t = std::abs(t - report.step.median);
  report.step.mad = median(whole);
  report.iterations_mean = scene.coupling.iterations;
  // The machine may be shared: the better of two measurements is the ceiling.
  const Ceilings ceilings{std::max(before.bandwidth, sum(memory_bandwidth())),
                          std::max(before.fma, sum(fma_rate<Real>()))};
  report.bandwidth = ceilings.bandwidth, report.fma = ceilings.fma;
  if (device) return report;
  report.least =
      least_times<Real>(ceilings, static_cast<double>(report.nodes), static_cast<double>(report.markers));
  return report;
}

}  // namespace

BenchReport bench(const Scene& scene, const BenchOptions& options) {
  require(options.steps > 0, "steps is not positive (there is nothing to time) use --steps 50");
  require(scene.place.solid == Place::host || options.device == Place::host || device_present(), no_device);
  std::string problems;
  for (const auto& p : preflight(scene)) problems += (problems.empty() ? "" : "\n") + p;
  require(problems.empty(), problems);
  return scene.fluid.precision == data::Fluid::Precision::double_ ? run<double>(scene, options)
                                                                  : run<float>(scene, options);
}

}  // namespace hemowalk::resolved
