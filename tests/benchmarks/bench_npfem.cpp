/// Cost of the solid: the reference work's 476 red cells (30 batches in single precision), in lattice units.
#include <benchmark/benchmark.h>
#include <omp.h>

#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/rigid/rigid.hpp"

namespace {

using namespace hemowalk;

template <class Real>
npfem::Membranes<Real> red_cells(int count, npfem::Bending bending) {
  auto rest = mesh::red_cell(2, 8);
  npfem::Material m;
  for (double* modulus : {&m.B, &m.C, &m.D, &m.volume_modulus}) *modulus /= 8200;
  m.bending = bending;
  m.bending_modulus *= 4.0 / 8200;
  std::vector<double> metric;
  for (double a : mesh::vertex_areas(rest)) metric.push_back(0.278 + 8.0 / 3 * a);
  npfem::Membranes<Real> cells(std::make_shared<const npfem::CellType>(rest, m, metric, 1));
  for (int c = 0; c < count; ++c) cells.add(c, {20.0 * c, 50, 50}, mesh::rotation({1, 2, 3}, c));
  const auto at = cells.layout();
  for (int c = 0; c < count; ++c)
    for (int k = 0; k < cells.vertices(); ++k)
      cells.predicted()[at.at(c, k, 2)] = static_cast<Real>(1e-5) * cells.offsets()[at.at(c, k, 1)];
  return cells;
}

/// A whole step; Arg: iterations. The difference between arguments is the cost of an iteration.
template <class Real, npfem::Bending bending>
void step(benchmark::State& state) {
  auto cells = red_cells<Real>(476, bending);
  mesh::StepOptions options;
  options.iterations = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(cells.step(options));
  state.counters["vertices/s"] = benchmark::Counter(
      476.0 * 258, benchmark::Counter::kIsIterationInvariantRate, benchmark::Counter::kIs1000);
  state.counters["threads"] = omp_get_max_threads();
}
BENCHMARK(step<float, npfem::Bending::paper>)
    ->Arg(1)
    ->Arg(2)
    ->Arg(6)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(step<float, npfem::Bending::helfrich>)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK(step<double, npfem::Bending::paper>)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

/// 95 rigid platelets.
void rigid_step(benchmark::State& state) {
  auto rest = mesh::platelet(2, 4);
  std::vector<double> metric;
  for (double a : mesh::vertex_areas(rest)) metric.push_back(0.1 + 8.0 / 3 * a);
  rigid::RigidBodies<float> bodies({rest, metric, metric, 1});
  for (int c = 0; c < 95; ++c) bodies.add(c, {9.0 * c, 0, 0}, mesh::rotation({1, 2, 3}, c));
  for (auto _ : state) benchmark::DoNotOptimize(bodies.step());
}
BENCHMARK(rigid_step)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
