// Contact in a crowd as dense as the reference work (476 red cells of 258 vertices and 95 platelets of 66 in
// 100^3 nodes): a step with a valid neighbour list, a step with a search, and the mean over a sheared run at
// the shear per step of acceleration 16.
#include <benchmark/benchmark.h>

#include "core/random.hpp"
#include "tests/support/contact_bodies.hpp"

using namespace hemowalk;

namespace {

/// Layers of tilted discs with the platelets between them.
test::ContactBodies<float> reference_crowd() {
  test::ContactBodies<float> set;
  const int rbc = set.add_shape(mesh::red_cell(2, 8)), platelet = set.add_shape(mesh::platelet(2, 4));
  RandomSequence random(1, Stream::test);
  const auto tilt = [&](double size) {
    return mesh::rotation({random.uniform(-1, 1), 0, random.uniform(-1, 1)}, size * random.uniform());
  };
  int cells = 0;
  for (int j = 0; j < 14; ++j)
    for (int i = 0; i < 6; ++i)
      for (int k = 0; k < 6 && cells < 476; ++k, ++cells)
        set.add(rbc,
                {(i + 0.5 * (j % 2)) * 100 / 6.0 + random.uniform(-0.4, 0.4),
                 (j + 0.5) * 100 / 14.0 + random.uniform(-0.7, 0.7), (k + 0.5 * (j % 2)) * 100 / 6.0},
                tilt(0.25));
  for (int p = 0; p < 95; ++p)
    set.add(platelet, {(p % 6 + 0.25) * 100 / 6.0, (p / 6 + 0.1) * 100 / 16.0, (p % 5 + 0.25) * 100 / 5.0},
            tilt(3));
  return set;
}

const contact::Law law{1.0, 0.01, 1.0, 0.35};
const contact::Domain box{{100, 0, 100}, {contact::Walls::Geometry::slab, 0, 100, 0, 0, 0}};

void count(benchmark::State& state, const contact::Summary& sum, const test::ContactBodies<float>& set) {
  state.counters["markers"] = static_cast<double>(set.local.size());
  state.counters["contacts"] = static_cast<double>(sum.contacts);
  state.counters["markers/s"] = benchmark::Counter(static_cast<double>(set.local.size()),
                                                   benchmark::Counter::kIsIterationInvariantRate);
}

void step_with_valid_list(benchmark::State& state) {
  auto set = reference_crowd();
  auto contact = set.contact(law, box);
  contact::Summary sum = set.compute(contact);
  for (auto _ : state) sum = set.compute(contact);
  count(state, sum, set);
}

void step_with_search(benchmark::State& state) {
  auto set = reference_crowd();
  auto contact = set.contact(law, box);
  contact::Summary sum;
  for (auto _ : state) {
    contact.set_bodies(set.bodies);
    sum = set.compute(contact);
  }
  count(state, sum, set);
}

/// Bodies advected by the shear 2e-4 per step and turned by half of it.
void sheared_run(benchmark::State& state) {
  auto set = reference_crowd();
  auto contact = set.contact(law, box);
  contact::Summary sum = set.compute(contact);
  const float rate = 2e-4f;
  for (auto _ : state) {
    state.PauseTiming();
    for (std::size_t b = 0; b < set.bodies.size(); ++b) {
      const float centre = static_cast<float>(set.at(static_cast<int>(b), 0)[1] - 50);
      for (std::size_t v = 0; v < set.vertices(static_cast<int>(b)); ++v) {
        auto& p = set.local[set.bodies[b].first + v];
        const float y = p.y, z = p.z;
        p.z += rate * (centre + 0.5f * y), p.y -= 0.5f * rate * z;
      }
    }
    state.ResumeTiming();
    sum = set.compute(contact);
  }
  count(state, sum, set);
  state.counters["steps/search"] =
      static_cast<double>(state.iterations()) / static_cast<double>(contact.searches());
}

BENCHMARK(step_with_valid_list)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(step_with_search)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(sheared_run)->Unit(benchmark::kMillisecond)->Iterations(500)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
