/// \file hemowalk_device: the reference work on a bare machine with a GPU. Packs (or reads) a box of blood,
/// runs it on the device and on the host, compares the two, and prints where the time of a step goes. See
/// docs/evidence/gpu.md.

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "core/check.hpp"
#include "core/text.hpp"
#include "resolved/device_simulation.hpp"
#include "resolved/packing.hpp"
#include "resolved/stepper.hpp"
#include "tools/bandwidth.hpp"

namespace hemowalk {
namespace {

constexpr const char* usage =
    "usage: hemowalk_device [--hybrid] [--place device|host] [--box UM] [--height UM] [--hematocrit H]\n"
    "                       [--acceleration S] [--check STEPS] [--bench STEPS] [--cells FILE] [--threads N]\n"
    "                       [--seed N]\n"
    "  --hybrid      the solid on the device, fluid, coupling and contact on the host; else everything on "
    "it\n"
    "  --box 50 --hematocrit 0.35 is the reference work: 476 red cells and 95 platelets.\n"
    "  --check 200   steps on both places, compared (0: none)\n"
    "  --bench 400   steps timed (0: none)\n"
    "  --cells FILE  packed cells: read if the file is there, else packed and written\n"
    "  --place host  runs the device's kernels on the host, thread by thread: a test, slow\n";

struct Options {
  Place place = Place::device;
  bool hybrid = false;
  double box = 50, height = 0, hematocrit = 0.35, acceleration = 1;
  int check = 200, bench = 400, threads = 0;
  std::uint64_t seed = 1;
  std::string cells;
};

double number(const std::string& key, const std::string& text) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  require(used == text.size() && used > 0, key + " " + text + " (not a number) see --help");
  return value;
}

Options parse(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; i += 2) {
    const std::string key = argv[i];
    if (key == "--help") {
      std::fputs(usage, stdout);
      std::exit(0);
    }
    if (key == "--hybrid") {
      o.hybrid = true, --i;
      continue;
    }
    require(i + 1 < argc, key + " (it needs a value) see --help");
    const std::string value = argv[i + 1];
    if (key == "--place") {
      require(value == "device" || value == "host", "--place " + value + " (device or host) see --help");
      o.place = value == "host" ? Place::host : Place::device;
    } else if (key == "--box") {
      o.box = number(key, value);
    } else if (key == "--height") {
      o.height = number(key, value);
    } else if (key == "--hematocrit") {
      o.hematocrit = number(key, value);
    } else if (key == "--acceleration") {
      o.acceleration = number(key, value);
    } else if (key == "--check") {
      o.check = static_cast<int>(number(key, value));
    } else if (key == "--bench") {
      o.bench = static_cast<int>(number(key, value));
    } else if (key == "--threads") {
      o.threads = static_cast<int>(number(key, value));
    } else if (key == "--seed") {
      o.seed = static_cast<std::uint64_t>(number(key, value));
    } else if (key == "--cells") {
      o.cells = value;
    } else {
      throw InputError(key + " (unknown option) see --help");
    }
  }
  require(o.box > 0 && o.check >= 0 && o.bench >= 0 && o.acceleration > 0,
          "box, steps and acceleration must not be negative (nothing to run) see --help");
  return o;
}

/// The paper's blood between a fixed and a moving wall; platelets rigid.
data::Scene blood(const Options& o) {
  data::Scene scene;
  scene.domain.size = {1e-6 * o.box, 1e-6 * (o.height > 0 ? o.height : o.box), 1e-6 * o.box};
  scene.acceleration = o.acceleration;
  scene.cells.hematocrit = o.hematocrit;
  scene.cells.platelets_per_rbc = 0.2;
  scene.seed = o.seed;
  data::Kind rbc, platelet;
  rbc.name = "rbc";
  platelet.name = "platelet";
  platelet.shape.type = data::Shape::Type::platelet;
  platelet.subdivision = 4;
  platelet.law = data::Kind::Law::rigid;
  scene.cells.kinds = {rbc, platelet};
  scene.place.solid = Place::device;
  if (!o.hybrid) scene.place.fluid = scene.place.coupling = Place::device;
  return scene;
}

using resolved::InitialCell;

void write_cells(const std::string& path, const std::vector<InitialCell>& cells) {
  std::ofstream out(path, std::ios::binary);
  const auto put = [&](const void* data, std::size_t bytes) {
    out.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
  };
  const std::uint64_t count = cells.size();
  put("HW-CELLS", 8);
  put(&count, sizeof count);
  for (const InitialCell& c : cells) {
    const std::int64_t kind = c.kind, vertices = static_cast<std::int64_t>(c.vertices.size());
    put(&kind, sizeof kind), put(&vertices, sizeof vertices);
    put(c.centre.data(), sizeof c.centre), put(c.orientation.data(), sizeof c.orientation);
    if (vertices > 0) put(c.vertices.data(), c.vertices.size() * sizeof(c.vertices[0]));
  }
  if (!out.flush())
    throw IoError("cannot write " + path + " (disk full or no such folder) give another --cells file");
}

std::vector<InitialCell> read_cells(std::ifstream& in, const std::string& path) {
  const auto take = [&](void* data, std::size_t bytes) {
    if (!in.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes)))
      throw IoError(path + " is cut short (not a file of packed cells) remove it and pack again");
  };
  char magic[8];
  std::uint64_t count = 0;
  take(magic, 8);
  require(std::memcmp(magic, "HW-CELLS", 8) == 0,
          path + " holds no packed cells (another kind of file) name another");
  take(&count, sizeof count);
  std::vector<InitialCell> cells;
  for (std::uint64_t i = 0; i < count; ++i) {
    InitialCell& c = cells.emplace_back();
    std::int64_t kind = 0, vertices = 0;
    take(&kind, sizeof kind), take(&vertices, sizeof vertices);
    require(vertices >= 0 && vertices < 1'000'000,
            path + " is damaged (a cell of impossible size) pack again");
    c.kind = static_cast<int>(kind);
    take(c.centre.data(), sizeof c.centre), take(c.orientation.data(), sizeof c.orientation);
    c.vertices.resize(static_cast<std::size_t>(vertices));
    if (vertices > 0) take(c.vertices.data(), c.vertices.size() * sizeof(c.vertices[0]));
  }
  return cells;
}

std::vector<InitialCell> make_cells(const data::Scene& scene, const Options& o) {
  if (!o.cells.empty()) {
    std::ifstream in(o.cells, std::ios::binary);
    if (in) return read_cells(in, o.cells);
  }
  const double start = omp_get_wtime();
  auto cells = resolved::pack(scene);
  std::printf("packed %zu cells in %.0f s\n", cells.size(), omp_get_wtime() - start);
  if (!o.cells.empty()) write_cells(o.cells, cells);
  return cells;
}

using Simulation = resolved::Simulation<float>;
using DeviceSimulation = resolved::DeviceSimulation<float>;
using Stepper = resolved::Stepper<float>;

/// Root mean square and largest difference of cell positions (dx) and of the fluid's velocity over the
/// wall's.
struct Difference {
  double position_rms = 0, position_max = 0, velocity_rms = 0;
};

Difference compare(const Simulation& a, const Simulation& b) {
  Difference d;
  double n = 0;
  for (std::size_t g = 0; g < a.groups().size(); ++g)
    std::visit(
        [&](const auto& x) {
          const auto& y = std::get<std::decay_t<decltype(x)>>(b.groups()[g].cells);
          for (int c = 0; c < x.count(); ++c)
            for (int k = 0; k < x.vertices(); ++k, ++n) {
              const auto p = x.position(c, k), q = y.position(c, k);
              for (int i = 0; i < 3; ++i) {
                const double e = p[i] - q[i];
                d.position_rms += e * e;
                d.position_max = std::max(d.position_max, std::abs(e));
              }
            }
        },
        a.groups()[g].cells);
  d.position_rms = n > 0 ? std::sqrt(d.position_rms / n) : 0;
  const Block& block = a.block();
  double speed = 0;
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const auto p = a.velocity()[block.at(i, j, k)], q = b.velocity()[block.at(i, j, k)];
        d.velocity_rms += (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y) + (p.z - q.z) * (p.z - q.z);
        speed = std::max(speed, std::abs(static_cast<double>(p.z)));
      }
  d.velocity_rms = std::sqrt(d.velocity_rms / static_cast<double>(block.interior())) / std::max(speed, 1e-30);
  return d;
}

/// Relative momentum that appeared from nowhere.
double momentum_residual(const Simulation& sim, const resolved::Momentum& start) {
  const auto m = sim.momentum();
  double residual = 0, scale = 1e-30;
  for (int d = 0; d < 3; ++d) {
    const double gained =
        m.to_lower_wall[d] + m.to_upper_wall[d] - start.to_lower_wall[d] - start.to_upper_wall[d];
    residual =
        std::max(residual, std::abs(m.fluid[d] + m.cells[d] - start.fluid[d] - start.cells[d] + gained));
    scale = std::max(scale, std::abs(m.to_upper_wall[d] - start.to_upper_wall[d]));
  }
  return residual / scale;
}

/// Single precision moves a vertex by rounding alone: 2^-24 of a speed of 0.05 and of forces good to 1e-4 per
/// step. In a crowd neighbours that differ by so much part exponentially with strain, but slowly at first: in
/// a box of 20 um at 35 % 2.7e-8 dx rms at a strain of 0.02, 4.5e-8 at 0.1, 8.4e-8 at 0.2 (emulated), a
/// factor of e per 0.16. The limits stand 1e4 above that; a check beyond a strain of 1 would need others.
bool check(Place place, const data::Scene& scene, const std::vector<InitialCell>& cells, int steps) {
  Simulation host(scene, cells), device_state(scene, cells);
  const auto start = host.momentum();
  Stepper device(device_state, place);
  const double t0 = omp_get_wtime();
  for (int i = 0; i < steps; ++i) host.step();
  const double t1 = omp_get_wtime();
  for (int i = 0; i < steps; ++i) device.step();
  device.sync();
  const double t2 = omp_get_wtime();
  const Difference d = compare(host, device_state);
  const double residual = momentum_residual(device_state, start);
  const double strain = scene.flow.shear_rate * device_state.time();
  const bool good =
      d.position_rms < 1e-3 && d.position_max < 2e-2 && d.velocity_rms < 1e-3 && residual < 1e-4;
  std::printf(
      "check, %d steps (strain %.3g): positions differ by %.2e rms, %.2e at most (dx), fluid velocity by "
      "%.2e of\n"
      "  the wall's; momentum residual %.1e; contacts %lld on the host, %lld on the device: %s\n"
      "  host %.2f ms per step (%d threads), %s %.3f ms with what it sets up\n",
      steps, strain, d.position_rms, d.position_max, d.velocity_rms, residual,
      static_cast<long long>(host.contact_summary().contacts),
      static_cast<long long>(device_state.contact_summary().contacts), good ? "agree" : "DO NOT AGREE",
      1e3 * (t1 - t0) / steps, omp_get_max_threads(), device.whole() ? "device" : "both",
      1e3 * (t2 - t1) / steps);
  return good;
}

using Rows = std::vector<std::pair<const char*, double>>;

void print_shares(const Rows& rows, double sum) {
  std::printf("%-28s %10s %10s\n", "part", "us/step", "share");
  for (const auto& [name, seconds] : rows)
    std::printf("%-28s %10.1f %9.1f %%\n", name, 1e6 * seconds, 100 * seconds / sum);
}

/// The published configuration: what the host does beside the device's share.
void bench_hybrid(Place place, const data::Scene& scene, const std::vector<InitialCell>& cells, int steps) {
  Simulation sim(scene, cells);
  Stepper stepper(sim, place);
  for (int i = 0; i < 20; ++i) stepper.step();
  sim.timings() = {};
  const double start = omp_get_wtime();
  for (int i = 0; i < steps; ++i) stepper.step();
  const double seconds = (omp_get_wtime() - start) / steps;
  const resolved::Timings& t = sim.timings();
  std::printf(
      "\n%zu nodes, %zu markers, %d cells; solid on the device, the rest on %d threads of the host\n\n",
      sim.block().interior(), sim.markers(), sim.bodies(), omp_get_max_threads());
  print_shares({{"fluid", t.fluid / steps},
                {"interpolation, positions", t.interpolation / steps},
                {"solid, with its copies", t.solid / steps},
                {"spreading", t.spreading / steps},
                {"contact", t.contact / steps},
                {"other", seconds - t.accounted() / steps}},
               seconds);
  std::printf("%-28s %10.1f\n", "whole step", 1e6 * seconds);
}

void bench_whole(Queue& queue, const data::Scene& scene, const std::vector<InitialCell>& cells, int steps) {
  Simulation host(scene, cells);
  DeviceSimulation device(queue, host);
  const double bandwidth =
      measure_bandwidth(queue, queue.place() == Place::host ? std::size_t{1} << 28 : std::size_t{1} << 30);
  for (int i = 0; i < 20; ++i) device.step();
  const auto parts = device.time_parts(std::max(2, steps / 8));
  std::vector<double> times;  // of rounds of ten
  for (int r = 0; r < std::max(1, steps / 10); ++r) {
    const auto start = queue.now();
    for (int i = 0; i < 10; ++i) device.step();
    const auto end = queue.now();
    queue.wait();
    times.push_back(1e5 * end.seconds_since(start));
  }
  device.check();
  std::sort(times.begin(), times.end());
  const double step_us = times[times.size() / 2];
  const double nodes = static_cast<double>(host.block().interior()),
               markers = static_cast<double>(host.markers());
  const double every = scene.coupling.solid_every;
  // Per node: 19 populations read and written, and read once more for the moments unless the cache still has
  // them; force read twice, velocity written.
  const double least = (2 * 19 + 3 * 4) * sizeof(float), most = least + 19 * sizeof(float);
  std::printf(
      "\n%.0f nodes, %.0f markers, %d cells; one graph of %zu kernels per step; %.0f MB on the device\n",
      nodes, markers, host.bodies(), device.kernels(), static_cast<double>(device.memory_bytes()) / 1e6);
  std::printf("bandwidth (update in place): %.0f GB/s\n\n", bandwidth / 1e9);
  print_shares({{"bins and weights", parts.locate},
                {"interpolation", parts.interpolation},
                {"contact", parts.contact},
                {"solid, retraction, impulses", parts.solid},
                {"spreading", parts.spreading},
                {"fluid", parts.fluid}},
               parts.sum());
  std::printf("%-28s %10.1f\n", "sum, launched one by one", 1e6 * parts.sum());
  std::printf("%-28s %10.1f   (%.1f .. %.1f)\n\n", "whole step, as a graph", step_us, times.front(),
              times.back());
  std::printf("fluid: %.0f MLUPS, %.0f-%.0f bytes per node, %.0f-%.0f %% of the bandwidth\n",
              1e-6 * every * nodes / parts.fluid, least, most,
              100 * every * least * nodes / parts.fluid / bandwidth,
              100 * every * most * nodes / parts.fluid / bandwidth);
  const double seconds = scene.fluid.time_step() * every * scene.acceleration;
  std::printf("one simulated second: %.2f h at acceleration %g\n", 1e-6 * step_us / seconds / 3600,
              scene.acceleration);
  std::printf(
      "{\"format\": \"hemowalk.device_bench/1\", \"nodes\": %.0f, \"markers\": %.0f, \"cells\": %d, "
      "\"step_us\": "
      "%.2f, \"parts_us\": {\"locate\": %.2f, \"interpolation\": %.2f, \"contact\": %.2f, \"solid\": %.2f, "
      "\"spreading\": %.2f, \"fluid\": %.2f}, \"bandwidth_gb_per_s\": %.1f, \"memory_mb\": %.1f}\n",
      nodes, markers, host.bodies(), step_us, 1e6 * parts.locate, 1e6 * parts.interpolation,
      1e6 * parts.contact, 1e6 * parts.solid, 1e6 * parts.spreading, 1e6 * parts.fluid, bandwidth / 1e9,
      static_cast<double>(device.memory_bytes()) / 1e6);
}

int run(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  const Options o = parse(argc, argv);
  if (o.threads > 0) omp_set_num_threads(o.threads);
  Queue queue(o.place);
  const data::Scene scene = blood(o);
  const auto cells = make_cells(scene, o);
  const bool good = o.check == 0 || check(o.place, scene, cells, o.check);
  if (o.bench > 0)
    o.hybrid ? bench_hybrid(o.place, scene, cells, o.bench) : bench_whole(queue, scene, cells, o.bench);
  return good ? 0 : static_cast<int>(Exit::physics);
}

}  // namespace
}  // namespace hemowalk

int main(int argc, char** argv) {
  try {
    return hemowalk::run(argc, argv);
  } catch (const hemowalk::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return static_cast<int>(e.code);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "internal error: %s\n", e.what());
    return static_cast<int>(hemowalk::Exit::internal);
  }
}
