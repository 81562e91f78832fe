// Interpolation and spreading of the reference work: 129 078 markers on 100^3 nodes.
#include <benchmark/benchmark.h>

#include <random>

#include "resolved/ibm/markers.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::ibm;

template <class Real>
struct Case {
  Block block{100, 100, 100};
  std::size_t n = 545 * 256;
  std::vector<std::int32_t> body;
  Array<Origin> origin{545};
  Array<Node4<Real>> local, value, field;
  Markers<Real> markers;
  Case() : body(n), local(n), value(n), field(block.size()), markers(block, Faces{}, Kernel::phi4, fill()) {
    markers.locate(origin.view(), local.view());
  }
  // Spheres of 256 markers, radius 5 dx: as local in memory as cells are.
  const std::vector<std::int32_t>& fill() {
    std::mt19937 gen(1);
    std::normal_distribution<Real> g;
    std::uniform_int_distribution<int> at(6, 93);
    for (std::size_t b = 0; b < 545; ++b) {
      origin[b] = {at(gen), at(gen), at(gen)};
      for (std::size_t m = b * 256; m < (b + 1) * 256; ++m) {
        const Real x = g(gen), y = g(gen), z = g(gen), r = 5 / std::sqrt(x * x + y * y + z * z);
        local[m] = {x * r, y * r, z * r, 0}, value[m] = {x, y, z, 0}, body[m] = static_cast<int>(b);
      }
    }
    return body;
  }
};

template <class Real>
void locate(benchmark::State& state) {
  Case<Real> c;
  for (auto _ : state) c.markers.locate(c.origin.view(), c.local.view());
  state.SetItemsProcessed(state.iterations() * c.n);
}
template <class Real>
void interpolate(benchmark::State& state) {
  Case<Real> c;
  for (auto _ : state) c.markers.interpolate(c.field.view(), c.value.view());
  state.SetItemsProcessed(state.iterations() * c.n);
}
template <class Real>
void spread(benchmark::State& state) {
  Case<Real> c;
  for (auto _ : state) c.markers.spread(c.value.view(), c.field.view());
  state.SetItemsProcessed(state.iterations() * c.n);
}
BENCHMARK(locate<float>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(interpolate<float>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(spread<float>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(interpolate<double>)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(spread<double>)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
