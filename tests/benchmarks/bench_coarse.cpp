/// \file Speed of the coarse walk beside the ceiling of its random numbers, and error against cost of the
/// step. Ratios of one run only: the machine is shared. `bench_coarse [walkers] [seconds per row]`

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>

#include "coarse/fokker_planck.hpp"
#include "coarse/walkers.hpp"
#include "support/coarse_exact.hpp"

using namespace hemowalk;
using namespace hemowalk::coarse;
using Type = Face::Type;

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Processor time of all threads: what others on the machine do does not count (caches and clock aside).
double cpu_now() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmRSS:", 0) == 0) return std::atof(line.c_str() + 6) / 1024;
  return 0;
}

/// Walker-steps per second, best of three thirds of the given time, each beside the ceiling measured just
/// before.
void row(const std::string& name, const SlabLaw& law, const Face& bottom, const Face& top,
         const WalkSettings& s, std::int64_t walkers, double seconds) {
  Case c = make_case(law.height, bottom.type, top.type, walkers, 10e-3, 1);
  c.bottom = bottom;
  c.top = top;
  Walkers w(c, law, s);
  double best = 0, best_fraction = 0, best_cpu = 0;
  for (int third = 0; third < 3; ++third) {
    const double ceiling = normal_numbers_per_second(seconds / 9) / omp_get_max_threads();
    const double start = now(), cpu_start = cpu_now();
    const std::int64_t before = w.steps_walked();
    while (now() - start < seconds / 3) w.advance_to(w.step() + 512);
    const auto walked = static_cast<double>(w.steps_walked() - before);
    const double rate = walked / (now() - start);
    const double rate_cpu = walked / (cpu_now() - cpu_start);
    best_cpu = std::max(best_cpu, rate_cpu);
    best = std::max(best, rate);
    best_fraction = std::max(best_fraction, rate_cpu / ceiling);
  }
  fmt::print("| {} | {:.0f} | {:.2f} | {:.0f} |\n", name, best / 1e6, best_fraction, best_cpu / 1e6);
}

void speed(std::int64_t walkers, double seconds) {
  const double H = 0.82e-3;
  const auto layered = [&](double y) { return 1e-10 * (1 - 0.8 * std::exp(-std::min(y, H - y) / 5e-6)); };
  const auto still = [](double) { return 0.0; };
  const SlabLaw one = constant_slab(H, 1e-10), table = make_slab_law(H, 2048, layered, still);
  const SlabLaw drift = make_slab_law(H, 2048, layered, [&](double y) { return 1e-8 * (1 - 2 * y / H); });
  const Face reflect{}, absorb{Type::absorb, 0, 0}, robin{Type::robin, 1e-6, 0}, trap{Type::trap, 1, 3e-6};
  fmt::print("\n{} threads, {} walkers, dt 10 ms, ceiling {:.0f} M normal numbers/s\n\n",
             omp_get_max_threads(), walkers, normal_numbers_per_second(seconds / 2) / 1e6);
  fmt::print(
      "| walk | M walker-steps/s | fraction of the ceiling | M per s of processor time "
      "|\n|---|---|---|---|\n");
  row("D constant, reflect + reflect", one, reflect, reflect, {}, walkers, seconds);
  row("D(y) table, reflect + reflect", table, reflect, reflect, {}, walkers, seconds);
  row("D(y) table, absorb + reflect", table, absorb, reflect, {}, walkers, seconds);
  row("D(y) table, robin + trap", table, robin, trap, {}, walkers, seconds);
  row("D(y) and v(y), absorb + reflect", drift, absorb, reflect, {}, walkers, seconds);
  WalkSettings s;
  s.track_flow_direction = true;
  row("D(y) table, reflect + reflect, flow tracked", table, reflect, reflect, s, walkers, seconds);
  s = {};
  s.step_law = StepLaw::persistent;
  s.memory = 10e-3;
  row("persistent, D(y) table, absorb + reflect", table, absorb, reflect, s, walkers, seconds);
  s = {};
  s.step_law = StepLaw::heavy_tail;
  s.tail_exponent = 4;
  s.tail_fraction = 0.02;
  row("heavy tail, D(y) table, absorb + reflect", table, absorb, reflect, s, walkers, seconds);
}

/// Absorbed fraction of a 50 um slab after 1.6 s: error and cost of the face schemes over dt, and of the
/// equation.
void accuracy() {
  const double H = 50e-6, D = 1e-10, t = 1.6, k = 8e-6;
  const std::int64_t walkers = 1'000'000;
  fmt::print("\nAbsorbed fraction, slab of 50 um, 1.6 s, {} walkers: error (sampling 5e-4) and cost\n\n",
             walkers);
  fmt::print("| face | scheme | dt, s | error | s |\n|---|---|---|---|---|\n");
  const char* names[] = {"plain", "bridge", "exact"};
  for (const Type type : {Type::absorb, Type::robin}) {
    const double exact = type == Type::absorb ? absorbed_exactly(D, t, H) : reacted_exactly(k, D, t, H);
    for (const WallScheme scheme : {WallScheme::plain, WallScheme::bridge, WallScheme::exact})
      for (const double dt : {0.04, 0.01, 0.0025}) {
        if (type == Type::absorb && scheme == WallScheme::bridge) continue;  // the same as exact
        Case c = make_case(H, type, Type::reflect, walkers, dt, 5);
        c.bottom.rate = k;
        WalkSettings s;
        s.scheme = scheme;
        const double start = now();
        Walkers w(c, constant_slab(H, D), s);
        w.advance_to(std::llround(t / dt));
        const double p = static_cast<double>(w.count(1).absorbed[0]) / static_cast<double>(walkers);
        fmt::print("| {} | {} | {} | {:+.5f} | {:.3f} |\n", type == Type::absorb ? "absorb" : "robin",
                   names[static_cast<int>(scheme)], dt, p - exact, now() - start);
      }
    for (const int cells : {128, 512}) {
      const double start = now();
      FokkerPlanck solver(constant_slab(H, D), {type, k, 0}, {}, cells);
      solver.advance(t, 400);
      fmt::print("| {} | fokker_planck, {} cells | {} | {:+.6f} | {:.4f} |\n",
                 type == Type::absorb ? "absorb" : "robin", cells, t / 400, solver.absorbed() - exact,
                 now() - start);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t walkers = argc > 1 ? std::atoll(argv[1]) : 1 << 20;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 3;
  speed(walkers, seconds);
  accuracy();
  const double before = memory_mb();
  const std::int64_t many = 100'000'000;
  const double start = now();
  Walkers w(make_case(0.82e-3, Type::absorb, Type::reflect, many, 10e-3, 1), constant_slab(0.82e-3, 1e-10));
  const double set_up = now() - start;
  w.advance_to(8);
  fmt::print(
      "\n1e8 walkers: {:.0f} MB ({:.1f} bytes each), set up in {:.1f} s, 8 steps {:.0f} M walker-steps/s\n",
      memory_mb() - before, (memory_mb() - before) * 1048576 / static_cast<double>(many), set_up,
      8e8 / (now() - start - set_up) / 1e6);
}
