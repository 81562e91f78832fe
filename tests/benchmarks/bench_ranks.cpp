// Time per step of the resolved solver on as many ranks as mpirun starts, where it goes, what is sent, and
// what the messages cost by themselves.
//   mpirun -n 2 bench_ranks X Y Z [um] HEMATOCRIT STEPS

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "core/mpi.hpp"
#include "resolved/packing.hpp"
#include "support/blood_scene.hpp"

namespace {

using namespace hemowalk;

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[v.size() / 2];
}

/// There and back between ranks 0 and 1. \returns s per message, the least.
double ping_pong(const mpi::Ranks& ranks, std::size_t bytes) {
  std::vector<std::byte> data(bytes);
  std::vector<double> times;
  for (int i = 0; i < 2000 && ranks.rank() < 2; ++i) {
    const double start = omp_get_wtime();
    mpi::Messages way(ranks);
    for (int turn = 0; turn < 2; ++turn) {
      if (turn == ranks.rank())
        way.send(1 - ranks.rank(), 9, {data.data(), bytes});
      else
        way.receive(1 - ranks.rank(), 9, View<std::byte>{data.data(), bytes});
      way.wait();
    }
    times.push_back((omp_get_wtime() - start) / 2);
  }
  double nothing = 0;
  ranks.max({&nothing, 1});
  return times.empty() ? 0 : *std::min_element(times.begin(), times.end());
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
  {
    const auto ranks = mpi::Ranks::world();
    const auto scene = [&] {
      auto s = test::blood_scene({number(1, 20), number(2, 20), number(3, 40)}, number(4, 0.35));
      s.acceleration = 16;
      return s;
    }();
    const auto cells = number(4, 0.35) > 0 ? resolved::pack(scene) : std::vector<resolved::InitialCell>{};
    resolved::Simulation<float> sim(scene, cells, ranks);
    for (int i = 0; i < 10; ++i) sim.step();
    sim.timings() = {};
    std::vector<double> times;
    const auto& t = sim.timings();
    const auto parts_now = [&] {
      return std::array<double, 6>{t.fluid, t.interpolation, t.spreading,
                                   t.solid, t.contact,       t.communication};
    };
    // Least time of each part: what it costs undisturbed, on a machine that others use too.
    std::array<double, 6> least, before = parts_now();
    least.fill(1e300);
    for (int i = 0; i < number(5, 50); ++i) {
      const double start = omp_get_wtime();
      sim.step();
      times.push_back(1e3 * (omp_get_wtime() - start));
      const auto now = parts_now();
      for (std::size_t p = 0; p < now.size(); ++p) least[p] = std::min(least[p], 1e3 * (now[p] - before[p]));
      before = now;
    }
    ranks.sum({least.data(), least.size()});
    for (double& p : least) p /= ranks.count();
    const double per = 1e3 / static_cast<double>(t.steps);
    double most[3] = {double(sim.markers()), double(sim.bodies()), double(sim.bytes_per_step())};
    double sums[3] = {most[0], most[1], double(sim.arrivals())};
    ranks.max({most, 3});
    ranks.sum({sums, 3});
    double parts[7] = {t.fluid, t.interpolation, t.spreading, t.solid, t.contact, t.communication, t.other};
    ranks.sum({parts, 7});
    for (double& p : parts) p *= per / ranks.count();
    if (ranks.root()) {
      double load = 0;
      std::ifstream("/proc/loadavg") >> load;
      fmt::print("{} ranks x {} threads, {} nodes, {} cells, load average {:.1f}\n", ranks.count(),
                 omp_get_max_threads(), sim.decomposition().whole().interior(), cells.size(), load);
      fmt::print(
          "  step {:.2f} ms median, {:.2f} least; mean over ranks: fluid {:.2f} interpolation {:.2f} "
          "spreading "
          "{:.2f} solid {:.2f} contact {:.2f} communication {:.2f} other {:.2f}\n",
          median(times), *std::min_element(times.begin(), times.end()), parts[0], parts[1], parts[2],
          parts[3], parts[4], parts[5], parts[6]);
      fmt::print(
          "  least of each part: fluid {:.2f} interpolation {:.2f} spreading {:.2f} solid {:.2f} contact "
          "{:.2f} "
          "communication {:.2f}; without communication {:.2f}\n",
          least[0], least[1], least[2], least[3], least[4], least[5],
          least[0] + least[1] + least[2] + least[3] + least[4]);
      fmt::print(
          "  busiest rank over mean: markers {:.3f}, cells {:.3f}; sent per rank and step {:.0f} kB; cells "
          "passed "
          "on {:.0f}\n",
          sums[0] > 0 ? most[0] * ranks.count() / sums[0] : 1,
          sums[1] > 0 ? most[1] * ranks.count() / sums[1] : 1, most[2] / 1e3, sums[2]);
    }
    if (ranks.count() > 1)
      for (const std::size_t bytes : {8, 4096, 65536, 1 << 20}) {
        const double s = ping_pong(ranks, bytes);
        if (ranks.root())
          fmt::print("  message of {} bytes: {:.2f} us, {:.2f} GB/s\n", bytes, 1e6 * s, bytes / s / 1e9);
      }
  }
  mpi::finish();
}
