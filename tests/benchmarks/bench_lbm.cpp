// Speed of the fluid beside the memory bandwidth of the same minute. Columns: MLUPS (median and best of the
// steps timed), GB/s = bytes the layout must move / median time, roofline = that over the bandwidth of an
// in-place update of a 320 MB array (2 x element size, same threads, median of 7). A 50^3 block fits the
// cache: its fraction of the memory roofline may exceed 1.

#include <benchmark/benchmark.h>
#include <omp.h>

#include <algorithm>
#include <vector>

#include "core/ceilings.hpp"
#include "resolved/lbm/fluid.hpp"

namespace {

using namespace hemowalk;

enum class Call { moments, collide, advance };

template <class Real>
void fluid_step(benchmark::State& state, Call call) {
  const int n = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(1));
  omp_set_num_threads(threads);
  const Block block{n, n, n};
  lbm::Parameters parameters;
  parameters.upper_wall_velocity = {0, 0, 0.01};
  lbm::Fluid<Real> fluid(block, parameters);
  fluid.initialise([&](double y) { return 0.01 * y / n; });
  Array<Node4<Real>> force(block.size()), velocity(block.size());
  const auto step = [&] {
    if (call == Call::advance) {
      fluid.advance(force.view(), velocity.view());
    } else if (call == Call::collide) {
      fluid.collide_and_stream(force.view());
    } else {
      fluid.moments(velocity.view());
    }
  };
  const double ceiling_before = memory_bandwidth();
  for (int t = 0; t < 4; ++t) step();
  std::vector<double> times;
  for (auto _ : state) {
    const double start = omp_get_wtime();
    step();
    times.push_back(omp_get_wtime() - start);
    state.SetIterationTime(times.back());
  }
  const double ceiling = std::max(ceiling_before, memory_bandwidth());
  const double bytes = call == Call::advance   ? lbm::Fluid<Real>::bytes_per_node_advance()
                       : call == Call::collide ? lbm::Fluid<Real>::bytes_per_node_collide()
                                               : lbm::Fluid<Real>::bytes_per_node_moments();
  const auto nodes = static_cast<double>(block.interior());
  state.counters["MLUPS"] = 1e-6 * nodes / middle_of(times);
  state.counters["best"] = 1e-6 * nodes / *std::min_element(times.begin(), times.end());
  state.counters["GB/s"] = 1e-9 * bytes * nodes / middle_of(times);
  state.counters["ceiling"] = 1e-9 * ceiling;
  state.counters["roofline"] = bytes * nodes / middle_of(times) / ceiling;
}

void register_all() {
  const std::pair<const char*, Call> calls[] = {
      {"moments", Call::moments}, {"collide", Call::collide}, {"advance", Call::advance}};
  for (const auto& [name, call] : calls) {
    const auto add = [&](const std::string& title, void (*run)(benchmark::State&, Call)) {
      benchmark::RegisterBenchmark(title.c_str(), run, call)
          ->ArgNames({"n", "threads"})
          ->ArgsProduct({{100, 50}, {1, 2}})
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond)
          ->MinTime(0.5);
    };
    add(std::string("float/") + name, &fluid_step<float>);
    add(std::string("double/") + name, &fluid_step<double>);
  }
}

}  // namespace

int main(int argc, char** argv) {
  register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
