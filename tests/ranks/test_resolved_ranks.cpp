// The resolved solver on 1 to 4 ranks: the same flow to round-off, cells that wander through all slabs,
// budgets over all ranks, restarts on as many and on other ranks. Started with three ranks (one case with
// four); groups of fewer are cut from them.

#include <omp.h>
#include <unistd.h>

#include <filesystem>

#include "core/check.hpp"
#include "core/data/trajectories.hpp"
#include "ranks/crowd.hpp"
#include "resolved/resolve.hpp"
#include "resolved/stepper.hpp"

namespace hemowalk::resolved {
namespace {

using namespace test;

/// The runs of \p counts ranks against that of one.
template <class Real>
void expect_agreement(const data::Scene& scene, int steps, double relative,
                      const std::vector<InitialCell>& cells = crowd(),
                      const std::vector<int>& counts = {2, 3}) {
  Whole one, start;
  on(1, [&](const mpi::Ranks& ranks) {
    Simulation<Real> sim(scene, cells, ranks);
    start = whole(sim);
    for (int i = 0; i < steps; ++i) sim.step();
    one = whole(sim);
  });
  for (const int n : counts)
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<Real> sim(scene, cells, ranks);
      for (int i = 0; i < steps; ++i) sim.step();
      double contacts = static_cast<double>(sim.contact_summary().contacts);
      ranks.sum({&contacts, 1});
      EXPECT_GT(contacts, 20) << "the cells should touch";
      const Whole many = whole(sim);
      if (!ranks.root()) return;
      const double moved = largest_difference(one.position, start.position);
      EXPECT_GT(moved, 0.3) << "the cells should move";
      EXPECT_LT(largest_difference(many.velocity, one.velocity), relative * one.largest_speed)
          << n << " ranks";
      EXPECT_LT(largest_difference(many.position, one.position), relative * moved) << n << " ranks";
    });
}

// Round-off of sums in another order, 1e-16, through a hundred steps of contact and membranes (it grows
// tenfold in some 30 steps at most).
TEST(RanksOfTheSolver, AgreeInDoubleOverHundredSteps) { expect_agreement<double>(long_scene(), 100, 1e-10); }

TEST(RanksOfTheSolver, AgreeWithTwoSlipFactorsAndPointLoads) {
  data::Scene scene = long_scene();
  scene.coupling.theta_t = 0.8;  // two fields are read, hence exchanged
  scene.cells.loads = {{2, "+z", 0.05, {0, 0, 20e-12}}, {2, "-z", 0.05, {0, 0, -20e-12}}};
  expect_agreement<double>(scene, 60, 1e-10);
}

// Slabs of 30 and 31 planes, and of 20, 20 and 21.
TEST(RanksOfTheSolver, AgreeWithUnevenSlabs) { expect_agreement<double>(long_scene(32, 61), 60, 1e-10); }

// Of four ranks each has one that is no neighbour. Borders at planes 0, 20, 40 and 60 of 81: all have a red
// cell across. Needs four processes: test_four_ranks; left out of test_resolved_ranks.
TEST(RanksOfTheSolver, FourAgreeWithOne) {
  ASSERT_GE(world().count(), 4) << "start it with four processes";
  auto cells = crowd();
  cells.insert(cells.begin() + 4, {0, {12, 16, 79}, mesh::rotation({1, 0, 0}, 0.2), {}});
  expect_agreement<double>(long_scene(32, 81), 60, 1e-10, cells, {4});
}

// The same with a round-off of 6e-8.
TEST(RanksOfTheSolver, AgreeInSingle) { expect_agreement<float>(long_scene(), 100, 1e-3); }

// Both walls push the crowd for 300 steps; every pair of contacts and every kernel across a border is booked.
template <class Real>
void expect_momentum_to_close(double relative) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      data::Scene scene = long_scene();
      scene.cells.loads = {{0, "+x", 0.1, {10e-12, 0, 0}}};
      Simulation<Real> sim(scene, crowd(), ranks);
      const auto start = sim.momentum().fluid;
      for (int i = 0; i < 300; ++i) sim.step();
      const Momentum m = sim.momentum();
      const double scale = std::abs(m.to_upper_wall[2]);
      EXPECT_GT(scale, 1);
      EXPECT_GT(m.from_loads[0], 0);
      for (int d = 0; d < 3; ++d)
        EXPECT_LT(std::abs(m.fluid[d] + m.cells[d] + m.to_lower_wall[d] + m.to_upper_wall[d] -
                           m.from_loads[d] - start[d]),
                  relative * scale)
            << "component " << d << ", " << n << " ranks";
    });
}
TEST(RanksOfTheSolver, MomentumClosesInDouble) { expect_momentum_to_close<double>(1e-12); }
TEST(RanksOfTheSolver, MomentumClosesInSingle) { expect_momentum_to_close<float>(1e-5); }

// Once through all slabs and the periodic border: every rank has had the cells, none was lost or doubled.
TEST(RanksOfTheSolver, CellsTravelThroughAllSlabs) {
  std::vector<double> one, fluid;
  double scale = 0;
  for (const int n : {1, 2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<double> sim(fast_scene(), travellers(), ranks);
      const auto start = whole(sim).position;
      for (int i = 0; i < 760; ++i) {
        sim.step();
        if (i % 100 != 0) continue;
        double cells = sim.bodies();
        ranks.sum({&cells, 1});
        ASSERT_EQ(cells, 2);
      }
      const Whole end = whole(sim);
      if (n > 1) {
        EXPECT_GE(sim.arrivals(), n == 3 ? 1 : 2) << "rank " << ranks.rank() << " of " << n;
      }
      if (!ranks.root()) return;
      if (n == 1) {
        one = end.position, fluid = end.velocity, scale = end.largest_speed;
        EXPECT_GT(largest_difference(one, start), 60) << "once round the box";
        return;
      }
      // 760 steps of one smooth motion; coordinates of some 100 with a round-off of 1e-14.
      EXPECT_LT(largest_difference(end.position, one), 1e-9) << n << " ranks";
      EXPECT_LT(largest_difference(end.velocity, fluid), 1e-10 * scale) << n << " ranks";
    });
}

/// The paper's hybrid on ranks, each with a device for its cells; the kernels run on the host.
data::Scene with_solid_on_device(data::Scene scene) {
  scene.place.solid = Place::device;
  return scene;
}

// Tolerances as between numbers of ranks, above.
TEST(RanksOfTheSolver, HybridFollowsTheHost) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<double> host(long_scene(), crowd(), ranks);
      Simulation<double> hybrid(with_solid_on_device(long_scene()), crowd(), ranks);
      Stepper<double> stepper(hybrid, Place::host);
      const Whole start = whole(host);
      for (int i = 0; i < 40; ++i) host.step(), stepper.step();
      stepper.sync();
      const Whole a = whole(host), b = whole(hybrid);
      if (!ranks.root()) return;
      EXPECT_GT(largest_difference(a.position, start.position), 0.1);
      EXPECT_LT(largest_difference(a.position, b.position), 1e-11) << n << " ranks";
      EXPECT_LT(largest_difference(a.velocity, b.velocity), 1e-10 * a.largest_speed) << n << " ranks";
    });
}

// Cells that pass to another rank leave one device and enter another, with all of their state; so does a
// state that is loaded, of a step in which other cells were on these ranks.
TEST(RanksOfTheSolver, HybridHandsCellsOver) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<double> host(fast_scene(), travellers(), ranks);
      Simulation<double> hybrid(with_solid_on_device(fast_scene()), travellers(), ranks);
      Stepper<double> stepper(hybrid, Place::host);
      std::vector<std::byte> middle;
      std::int64_t before = 0;
      for (int i = 0; i < 120; ++i) {
        if (i == 60) {
          stepper.sync();
          middle = hybrid.save();
          before = hybrid.arrivals();
        }
        host.step(), stepper.step();
      }
      double arrivals = static_cast<double>(hybrid.arrivals() - before);
      ranks.sum({&arrivals, 1});
      EXPECT_GT(arrivals, 0) << "the stretch should see a cell pass";
      stepper.sync();
      const auto end = hybrid.save();
      const Whole a = whole(host), b = whole(hybrid);
      if (ranks.root()) {
        EXPECT_LT(largest_difference(a.position, b.position), 1e-10) << n << " ranks";
        EXPECT_LT(largest_difference(a.velocity, b.velocity), 1e-10 * a.largest_speed) << n << " ranks";
      }
      hybrid.load({middle.data(), middle.size()});
      while (hybrid.fluid_steps() < 120) stepper.step();
      stepper.sync();
      EXPECT_TRUE(hybrid.save() == end) << "rank " << ranks.rank() << " of " << n;
    });
}

TEST(RanksOfTheSolver, ThreadsChangeNoBit) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      std::vector<std::byte> first;
      for (const int threads : {1, 2, 3}) {
        omp_set_num_threads(threads);
        Simulation<float> sim(long_scene(100), crowd(), ranks);
        for (int i = 0; i < 40; ++i) sim.step();
        const auto state = sim.save();
        if (first.empty()) first = state;
        EXPECT_TRUE(first == state) << threads << " threads, rank " << ranks.rank() << " of " << n;
      }
      omp_set_num_threads(1);
    });
}

// The state is taken in every step of a stretch in which cells pass from rank to rank.
TEST(RanksOfTheSolver, RestartOnAsManyRanksChangesNoBit) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<float> sim(fast_scene(), travellers(), ranks);
      std::vector<std::vector<std::byte>> middle;
      std::int64_t before = 0;
      for (int i = 0; i < 120; ++i) {
        if (i >= 60 && i % 7 == 0) middle.push_back(sim.save());
        if (i == 60) before = sim.arrivals();
        sim.step();
      }
      double arrivals = static_cast<double>(sim.arrivals() - before);
      ranks.sum({&arrivals, 1});
      EXPECT_GT(arrivals, 0) << "the stretch should see a cell pass";
      const auto end = sim.save();
      for (std::size_t s = 0; s < middle.size(); ++s) {
        Simulation<float> again(fast_scene(), travellers(), ranks);
        again.load({middle[s].data(), middle[s].size()});
        while (again.fluid_steps() < sim.fluid_steps()) again.step();
        EXPECT_TRUE(again.save() == end) << "state " << s << ", rank " << ranks.rank() << " of " << n;
      }
    });
}

// States of three, two and one rank go on as each other's, up to the order of sums.
TEST(RanksOfTheSolver, RestartOnOtherRanksIsTheSameRun) {
  std::vector<std::vector<std::byte>> parts[3];
  std::vector<Whole> ends(3);
  for (const int n : {1, 2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<double> sim(long_scene(), crowd(), ranks);
      for (int i = 0; i < 31; ++i) sim.step();
      parts[n - 1] = ranks.gather(sim.save());
      for (int i = 0; i < 30; ++i) sim.step();
      ends[n - 1] = whole(sim);
    });
  for (const auto& [from, to] : {std::pair{1, 3}, {3, 2}, {2, 1}, {1, 2}, {3, 1}})
    on(to, [&, from = from, to = to](const mpi::Ranks& ranks) {
      Simulation<double> sim(long_scene(), crowd(), ranks);
      std::vector<std::vector<std::byte>> cut;
      if (ranks.root()) cut = redistribute<double>(parts[from - 1], sim.decomposition().whole(), to);
      const auto mine = ranks.scatter(cut);
      sim.load({mine.data(), mine.size()});
      EXPECT_EQ(sim.fluid_steps(), 31);
      for (int i = 0; i < 30; ++i) sim.step();
      const Whole end = whole(sim);
      if (!ranks.root()) return;
      const Whole& same = ends[from - 1];
      EXPECT_LT(largest_difference(end.velocity, same.velocity), 1e-10 * same.largest_speed)
          << from << " to " << to;
      EXPECT_LT(largest_difference(end.position, same.position), 1e-11) << from << " to " << to;
    });
}

// A whole run, packing and files included: the records of the root.
TEST(RanksOfTheSolver, RunsWriteTheSameRecord) {
  data::Scene scene = long_scene(50);
  scene.cells.hematocrit = 0.1;
  scene.cells.platelets_per_rbc = 1;
  scene.fluid.precision = data::Fluid::Precision::double_;
  scene.time.end = 0.5e-3, scene.time.sample = 0.1e-3, scene.time.profile = 0.25e-3;
  scene.time.checkpoint_wall = 0;
  scene.time.checkpoint_every = 0.2e-3;
  const auto folder =
      std::filesystem::temp_directory_path() / ("hemowalk_ranks_" + std::to_string(getppid()));
  data::Trajectories one;
  for (const int n : {1, 2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      RunOptions options;
      options.out = folder / std::to_string(n);
      options.ranks = ranks;
      const RunSummary summary = resolve(scene, options);
      if (!ranks.root()) return;
      EXPECT_GT(summary.rbc, 2);
      const auto many = data::read_trajectories(options.out + "/trajectories.h5");
      if (n == 1) {
        one = many;
        return;
      }
      EXPECT_EQ(many.time, one.time);
      EXPECT_EQ(many.hematocrit_true, one.hematocrit_true);
      // Round-off of a hundred steps, relative to the largest value of each list.
      const auto expect_same = [&](const std::vector<double>& a, const std::vector<double>& b,
                                   const std::string& what) {
        double most = 0;
        for (const double v : b) most = std::max(most, std::abs(v));
        EXPECT_GT(b.size(), 0u) << what;
        EXPECT_LE(largest_difference(a, b), 1e-9 * most) << what << " on " << n << " ranks";
      };
      for (const auto& [name, tracks] : one.kinds) {
        const auto& other = many.kinds.at(name);
        EXPECT_EQ(other.id, tracks.id);
        expect_same(other.position, tracks.position, name + " position");
        expect_same(other.orientation, tracks.orientation, name + " orientation");
        // In the plane of a body of revolution any two axes are principal ones: round-off chooses.
        for (const auto& [what, values] : tracks.observables)
          if (name != "platelet" || !what.ends_with("_diameter"))
            expect_same(other.observables.at(what), values, name + " " + what);
      }
      expect_same(many.profile.velocity, one.profile.velocity, "velocity");
      expect_same(many.profile.hematocrit, one.profile.hematocrit, "hematocrit");
      expect_same(many.profile.shear_stress, one.profile.shear_stress, "stress");
      expect_same(many.diagnostics.slip_rms, one.diagnostics.slip_rms, "slip");
      expect_same(many.diagnostics.volume_error_max, one.diagnostics.volume_error_max, "volume error");
      expect_same(many.diagnostics.overlap_max, one.diagnostics.overlap_max, "overlap");
      for (const double r : many.diagnostics.momentum_residual) EXPECT_LT(std::abs(r), 1e-11);
      // The first sample has no step before it, hence no powers.
      const auto later = [](const std::vector<double>& v) {
        return std::vector<double>(v.begin() + 1, v.end());
      };
      const auto &a = many.diagnostics, &b = one.diagnostics;
      for (const auto power : {&data::Diagnostics::power_in, &data::Diagnostics::power_viscous,
                               &data::Diagnostics::power_damping, &data::Diagnostics::power_slip})
        expect_same(later(a.*power), later(b.*power), "power");
      for (const double r : later(a.energy_residual)) EXPECT_LT(std::abs(r), 1e-3);
    });
  if (world().root()) std::filesystem::remove_all(folder);
}

TEST(RanksOfTheSolver, TooManyRanksAreRefused) {
  data::Scene scene = long_scene();
  scene.domain.size[2] = 20e-6;
  try {
    Simulation<float> sim(scene, {crowd()[0]}, world());
    FAIL() << "three slabs of 13 planes for a cell of 16";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("use 2 or fewer ranks"), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW(Simulation<float>(long_scene(), {crowd()[0]}, world()));
}

TEST(RanksOfTheSolver, OtherCouplingsAreRefusedOnSeveralRanks) {
  data::Scene scene = long_scene();
  scene.coupling.retraction = 0;
  scene.coupling.scheme = data::Coupling::Scheme::paper, scene.coupling.kernel = data::Coupling::Kernel::phi4;
  on(1, [&](const mpi::Ranks& ranks) { EXPECT_NO_THROW(Simulation<float>(scene, crowd(), ranks)); });
  on(2, [&](const mpi::Ranks& ranks) { EXPECT_THROW(Simulation<float>(scene, crowd(), ranks), InputError); });
}

}  // namespace
}  // namespace hemowalk::resolved
