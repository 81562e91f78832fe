// The run loop: pack, step, sample, checkpoint, write. Everything that leaves a run folder passes here.

#include "resolved/resolve.hpp"

#include <fmt/core.h>
#include <omp.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "core/check.hpp"
#include "core/data/trajectories.hpp"
#include "core/log.hpp"
#include "core/provenance.hpp"
#include "resolved/bytes.hpp"
#include "resolved/checkpoint.hpp"
#include "resolved/gather.hpp"
#include "resolved/packing.hpp"
#include "resolved/recorder.hpp"
#include "resolved/recovery.hpp"
#include "resolved/simulation.hpp"
#include "resolved/stepper.hpp"
#include "resolved/surface_output.hpp"

namespace hemowalk::resolved {

namespace {

namespace fs = std::filesystem;
using data::Scene;

/// Fluid steps between two events, a whole number of coupling steps, at least one.
std::int64_t interval(double seconds, const LatticeUnits& units, int solid_every) {
  if (!(seconds > 0)) return 0;
  const auto coupling = std::llround(units.steps(seconds) / solid_every);
  return std::max<std::int64_t>(1, coupling) * solid_every;
}

struct Schedule {
  std::int64_t end, sample, profile, average, surface, checkpoint;
  Schedule(const Scene& scene, const LatticeUnits& units) {
    const int every = scene.coupling.solid_every;
    end = interval(scene.time.end, units, every);
    sample = interval(scene.time.sample, units, every);
    profile = interval(scene.time.profile, units, every);
    average = profile > 0 ? std::max<std::int64_t>(every, profile / 20 / every * every) : 0;
    surface = interval(scene.time.surface, units, every);
    checkpoint = interval(scene.time.checkpoint_every.value_or(0), units, every);
  }
};

bool due(std::int64_t step, std::int64_t every) { return every > 0 && step % every == 0; }

template <class Real>
class Run {
 public:
  Run(const Scene& scene, const RunOptions& options, const std::vector<InitialCell>& cells)
      : scene_(scene),
        options_(options),
        simulation_(scene, cells, options.ranks),
        recorder_(simulation_),
        schedule_(scene, simulation_.units()) {
    recorder_.trajectories().version = version();
  }

  RunSummary go() {
    const double start = omp_get_wtime();
    const std::int64_t first = resume();
    if (schedule_.surface > 0 && root()) surfaces_ = make_surfaces();
    if (first == 0) {
      if (root()) measure_recovery();
      outputs(0);
    }
    double last_checkpoint = omp_get_wtime();
    mpi::Agreement agreement(options_.ranks);
    Stepper<Real> stepper(simulation_);
    while (stepper.fluid_steps() < schedule_.end) {
      EnergyBudget budget;
      stepper.step(sampled(stepper.fluid_steps() + scene_.coupling.solid_every) ? &budget : nullptr);
      const std::int64_t step = stepper.fluid_steps();
      if (wanted(step)) stepper.sync();
      outputs(step, budget);
      const bool by_clock = root() && scene_.time.checkpoint_wall > 0 &&
                            omp_get_wtime() - last_checkpoint > scene_.time.checkpoint_wall;
      const bool asked = options_.stop_requested && options_.stop_requested();
      const unsigned agreed = agreement.any((asked ? stop_flag : 0) | (by_clock ? checkpoint_flag : 0));
      const bool stop = agreed & stop_flag;
      if (agreed || due(step, schedule_.checkpoint)) {
        stepper.sync();
        checkpoint();
        last_checkpoint = omp_get_wtime();
      }
      if (stop)
        throw Interrupted(fmt::format("stopped at {:.4g} s of {:.4g} s with a checkpoint", simulation_.time(),
                                      scene_.time.end));
    }
    options_.ranks.on_root([&] {
      data::write_trajectories(recorder_.trajectories(), options_.out + "/trajectories.h5");
      fs::remove_all(folder());
    });
    return summary(omp_get_wtime() - start);
  }

 private:
  static constexpr unsigned stop_flag = 1, checkpoint_flag = 2;

  /// The shape-recovery time is a diagnostic: where it cannot be measured the run goes on and says so.
  void measure_recovery() {
    try {
      recorder_.trajectories().t_c = recovery_time(scene_);
    } catch (const Error& e) {
      log_warning(std::string("shape-recovery time not measured: ") + e.what());
    }
  }

  bool root() const { return options_.ranks.root(); }
  std::string folder() const { return options_.out + "/checkpoint"; }

  std::unique_ptr<SurfaceOutput> make_surfaces() const {
    std::vector<SurfaceKind> kinds;
    for (const auto& group : simulation_.groups())
      std::visit(
          [&](const auto& g) {
            const std::string& name = scene_.cells.kinds[group.kind].name;
            const auto cells = recorder_.trajectories().kinds.at(name).cells();
            kinds.push_back({name, g.rest().triangles, g.vertices(), static_cast<int>(cells)});
          },
          group.cells);
    return std::make_unique<SurfaceOutput>(options_.out, std::move(kinds),
                                           simulation_.fluid_steps() > 0 ? simulation_.time() : -1);
  }

  void write_surfaces() {
    std::vector<double> position;
    for (const auto& group : simulation_.groups()) {
      const int vertices = std::visit([](const auto& g) { return g.vertices(); }, group.cells);
      const auto all = gather_cells(options_.ranks, group, 3 * static_cast<std::size_t>(vertices),
                                    [&](const auto& g, int c, double* out) {
                                      for (const auto& x : g.positions(c))
                                        for (int d = 0; d < 3; ++d)
                                          *out++ = simulation_.units().to_length(x[d]);
                                    });
      position.insert(position.end(), all.values.begin(), all.values.end());
    }
    if (root()) surfaces_->append(simulation_.time(), position);
  }

  /// Will outputs() read the simulation?
  bool wanted(std::int64_t step) const {
    return due(step, schedule_.average) || due(step, schedule_.profile) || due(step, schedule_.surface) ||
           sampled(step) || step >= schedule_.end;
  }

  bool sampled(std::int64_t step) const { return due(step, schedule_.sample); }

  void outputs(std::int64_t step, const EnergyBudget& budget = {}) {
    if (due(step, schedule_.average) && step > 0) recorder_.accumulate_profile(simulation_);
    if (due(step, schedule_.profile)) recorder_.close_profile(simulation_);
    if (due(step, schedule_.surface)) write_surfaces();
    if (!sampled(step)) return;
    recorder_.sample(simulation_, budget);
    if (!root()) return;
    guard();
    if (options_.progress)
      options_.progress(static_cast<double>(step) / static_cast<double>(schedule_.end), state_line());
  }

  /// The watch over the physics, once per sample: what no later step could repair stops the run.
  void guard() const {
    const auto& d = recorder_.trajectories().diagnostics;
    for (const auto& [name, tracks] : recorder_.trajectories().kinds)
      for (std::size_t i = tracks.position.size() - 3 * tracks.cells(); i < tracks.position.size(); ++i) {
        const double lower = recorder_.trajectories().walls_y[0], upper = recorder_.trajectories().walls_y[1];
        const std::size_t cell = (i % (3 * tracks.cells())) / 3;
        const bool outside = i % 3 == 1 && scene_.domain.geometry != data::Domain::Geometry::periodic &&
                             (tracks.position[i] < lower || tracks.position[i] > upper);
        if (!std::isfinite(tracks.position[i]) || outside)
          throw PhysicsError(fmt::format(
              "{} {} was lost at step {} (its centre is {} um along {}) lower the acceleration", name,
              tracks.id[cell], simulation_.fluid_steps(), 1e6 * tracks.position[i], "xyz"[i % 3]));
      }
    if (d.volume_error_max.back() > 0.2)
      throw PhysicsError(
          fmt::format("a cell's volume is off by {:.0f} % at step {} (blow-up) lower the acceleration or "
                      "raise coupling.iterations",
                      100 * d.volume_error_max.back(), simulation_.fluid_steps()));
  }

  std::string state_line() const {
    const auto& d = recorder_.trajectories().diagnostics;
    return fmt::format("t {:.1f} ms  volume error {:.2g}  momentum {:.1g}  overlap {:.2g} um",
                       1e3 * simulation_.time(), d.volume_error_max.back(),
                       std::abs(d.momentum_residual[d.momentum_residual.size() - 1]),
                       1e6 * d.overlap_max.back());
  }

  /// One file, written by the root: it needs memory for the state of all ranks.
  void checkpoint() {
    auto parts = options_.ranks.gather(simulation_.save());
    options_.ranks.on_root([&] {
      fs::create_directories(folder());
      data::write_trajectories(recorder_.trajectories(), folder() + "/trajectories.h5");
      const auto& t = recorder_.trajectories();
      Checkpoint c{scene_.input_sha256, version(), {}, recorder_.save()};
      std::size_t bytes = 0;
      for (const auto& part : parts) bytes += sizeof(std::uint64_t) + part.size();
      c.solver.reserve(bytes);
      for (auto& part : parts) {
        put(c.solver, part.data(), part.size());
        part = {};
      }
      c.recorder.insert(c.recorder.end(),
                        {static_cast<double>(t.time.size()), static_cast<double>(t.profile.time.size()),
                         static_cast<double>(t.diagnostics.time.size())});
      write_checkpoint(c, folder() + "/state.bin");
    });
  }

  /// \returns the step to go on from, 0 for a fresh start.
  std::int64_t resume() {
    std::vector<std::vector<std::byte>> parts;
    std::vector<std::byte> recorder;
    options_.ranks.on_root([&] { read_state(parts, recorder); });
    options_.ranks.broadcast(recorder);
    if (recorder.empty()) return 0;
    const auto mine = options_.ranks.scatter(parts);
    simulation_.load({mine.data(), mine.size()});
    std::vector<double> sums(recorder.size() / sizeof(double));
    std::memcpy(sums.data(), recorder.data(), recorder.size());
    recorder_.load(sums);
    return simulation_.fluid_steps();
  }

  /// The checkpoint, cut for the ranks there are; nothing if there is none.
  void read_state(std::vector<std::vector<std::byte>>& parts, std::vector<std::byte>& recorder) {
    const std::string state = folder() + "/state.bin";
    if (!options_.resume || !fs::exists(state)) return;
    Checkpoint c = read_checkpoint(state);
    require(c.input_sha256 == scene_.input_sha256,
            state + " belongs to another scene (the hashes of the inputs differ) remove it to start afresh");
    require(c.recorder.size() > 3, state + " is damaged (no record sizes) remove it to start afresh");
    for (Reader in({c.solver.data(), c.solver.size()}); !in.at_end();) parts.push_back(in.take<std::byte>());
    if (static_cast<int>(parts.size()) != options_.ranks.count()) {
      log_info(fmt::format("the checkpoint was made on {} ranks: cut for {}", parts.size(),
                           options_.ranks.count()));
      parts = redistribute<Real>(parts, simulation_.decomposition().whole(), options_.ranks.count());
    }
    recorder_.trajectories() = data::read_trajectories(folder() + "/trajectories.h5");
    const auto size = [&](int from_end) {
      return static_cast<std::size_t>(c.recorder[c.recorder.size() - from_end]);
    };
    truncate(recorder_.trajectories(), size(3), size(2), size(1));
    c.recorder.resize(c.recorder.size() - 3);
    recorder.resize(c.recorder.size() * sizeof(double));
    std::memcpy(recorder.data(), c.recorder.data(), recorder.size());
  }

  /// The record may be newer than the state when a run was killed between the two files: drop the surplus.
  static void truncate(data::Trajectories& t, std::size_t samples, std::size_t profiles,
                       std::size_t diagnostics) {
    t.time.resize(samples);
    for (auto& [name, tracks] : t.kinds) {
      tracks.position.resize(samples * tracks.cells() * 3);
      if (!tracks.orientation.empty()) tracks.orientation.resize(samples * tracks.cells() * 3);
      for (auto& [what, values] : tracks.observables) values.resize(samples * tracks.cells());
    }
    const std::size_t Y = t.profile.y.size();
    t.profile.time.resize(profiles);
    t.profile.velocity.resize(profiles * Y * 3);
    t.profile.hematocrit.resize(profiles * Y);
    t.profile.shear_stress.resize(profiles * Y);
    auto& d = t.diagnostics;
    d.time.resize(diagnostics), d.momentum_residual.resize(3 * diagnostics);
    for (auto* v :
         {&d.energy_residual, &d.mass_error, &d.volume_error_max, &d.max_speed_ratio, &d.overlap_max,
          &d.slip_rms, &d.power_in, &d.power_viscous, &d.power_damping, &d.power_slip, &d.power_stressless,
          &d.power_membranes, &d.power_contact, &d.power_inertia})
      v->resize(diagnostics);
  }

  RunSummary summary(double wall) const {
    RunSummary s;
    s.steps = simulation_.fluid_steps();
    s.wall = wall;
    s.hematocrit_true = recorder_.trajectories().hematocrit_true;
    for (const auto& [name, tracks] : recorder_.trajectories().kinds)
      (name == "platelet" ? s.platelets : s.rbc) += static_cast<int>(tracks.cells());
    return s;
  }

  Scene scene_;
  RunOptions options_;
  Simulation<Real> simulation_;
  Recorder<Real> recorder_;
  Schedule schedule_;
  std::unique_ptr<SurfaceOutput> surfaces_;
};

/// The root's cells on all ranks.
void share_cells(const mpi::Ranks& ranks, std::vector<InitialCell>& cells) {
  if (ranks.count() == 1) return;
  std::vector<std::byte> bytes;
  if (ranks.root())
    for (const InitialCell& c : cells) {
      put(bytes, &c.kind, 1), put(bytes, c.centre.data(), 3);
      put(bytes, &c.orientation, 1), put(bytes, c.vertices.data(), c.vertices.size());
    }
  ranks.broadcast(bytes);
  cells.clear();
  for (Reader in({bytes.data(), bytes.size()}); !in.at_end();) {
    InitialCell& c = cells.emplace_back();
    in.into(&c.kind, 1), in.into(c.centre.data(), 3);
    in.into(&c.orientation, 1);
    c.vertices = in.take<mesh::Vec3>();
  }
}

}  // namespace

RunSummary resolve(const Scene& scene, const RunOptions& options) {
  const auto problems = preflight(scene);
  if (!problems.empty()) {
    std::string all;
    for (const auto& p : problems) all += (all.empty() ? "" : "\n") + p;
    throw InputError(all);
  }
  RunSummary summary;
  options.ranks.guarded([&] {
    // Packing is not divided: the root packs, and all get the same cells.
    std::vector<InitialCell> cells;
    options.ranks.on_root([&] {
      cells = pack(scene);
      fs::create_directories(options.out);
    });
    share_cells(options.ranks, cells);
    summary = scene.fluid.precision == data::Fluid::Precision::double_
                  ? Run<double>(scene, options, cells).go()
                  : Run<float>(scene, options, cells).go();
  });
  return summary;
}

}  // namespace hemowalk::resolved
