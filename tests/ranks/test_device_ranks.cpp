// The whole step on several devices, one per rank, against the host's ranks, and the solid alone spread
// evenly over them. Without a GPU the kernels run on the host, thread by thread.

#include "core/check.hpp"
#include "ranks/crowd.hpp"
#include "resolved/stepper.hpp"
#include "support/places.hpp"

namespace hemowalk::resolved {
namespace {

using namespace test;

class DevicesOfRanks : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DevicesOfRanks);

constexpr data::Places whole_step{Place::device, Place::device, Place::device};
constexpr data::Places solid_with_fluid{Place::host, Place::host, Place::device};
constexpr data::Places solid_evenly{Place::host, Place::host, Place::device,
                                    data::Places::Distribution::even};

data::Scene at(const data::Places& places, data::Scene scene) {
  scene.place = places;
  return scene;
}

double sum_over(const mpi::Ranks& ranks, double value) {
  ranks.sum({&value, 1});
  return value;
}

/// A simulation with its step, or parts of it, on devices.
template <class Real>
struct OnDevices {
  OnDevices(Place place, const data::Scene& scene, const std::vector<InitialCell>& cells,
            const mpi::Ranks& ranks, const data::Places& places = whole_step)
      : sim(at(places, scene), cells, ranks), place(place) {
    take();
  }
  void take() {
    stepper.reset();
    stepper = std::make_unique<Stepper<Real>>(sim, place);
  }
  void steps(int n) {
    for (int i = 0; i < n; ++i) stepper->step();
    stepper->sync();
  }
  Simulation<Real> sim;
  Place place;
  std::unique_ptr<Stepper<Real>> stepper;
};

template <class Real>
void expect_the_host(Place place, const data::Scene& scene, const std::vector<InitialCell>& cells, int steps,
                     double relative, int least_contacts) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<Real> host(scene, cells, ranks);
      const Whole start = whole(host);
      for (int i = 0; i < steps; ++i) host.step();
      OnDevices<Real> device(place, scene, cells, ranks);
      device.steps(steps);
      const double here = sum_over(ranks, static_cast<double>(host.contact_summary().contacts)),
                   there = sum_over(ranks, static_cast<double>(device.sim.contact_summary().contacts));
      const double energy = sum_over(ranks, host.contact_summary().energy),
                   other = sum_over(ranks, device.sim.contact_summary().energy);
      const Whole a = whole(host), b = whole(device.sim);
      if (!ranks.root()) return;
      EXPECT_GE(here, least_contacts);
      EXPECT_EQ(here, there);
      EXPECT_NEAR(energy, other, 1e-6 * energy);
      const double moved = largest_difference(a.position, start.position);
      EXPECT_GT(moved, 0.02);
      EXPECT_LT(largest_difference(a.position, b.position), relative * moved) << n << " ranks";
      EXPECT_LT(largest_difference(a.velocity, b.velocity), relative * a.largest_speed) << n << " ranks";
    });
}

// Tolerances as between numbers of ranks (test_resolved_ranks.cpp).
TEST_P(DevicesOfRanks, FollowTheHostInDouble) {
  expect_the_host<double>(GetParam(), long_scene(), crowd(), 100, 1e-10, 20);
}

TEST_P(DevicesOfRanks, FollowTheHostWithLoadsAndSeveralFluidSteps) {
  for (const int every : {2, 3}) {
    data::Scene scene = long_scene(4);
    scene.coupling.solid_every = every;
    scene.coupling.iterations = 6;
    scene.cells.loads = {{2, "+z", 0.05, {0, 0, 5e-12}}, {0, "-x", 0.05, {-5e-12, 0, 0}}};
    expect_the_host<double>(GetParam(), scene, crowd(), 9, 1e-10, 1);
  }
}

// Some 1e-4 of the forces is round-off, displacements are of order 1 dx (test_device_simulation.cpp).
TEST_P(DevicesOfRanks, FollowTheHostInSingle) {
  expect_the_host<float>(GetParam(), long_scene(), crowd(), 60, 1e-3, 20);
}

// Cells that a wall carries through the slabs by a tenth of a node per step: lists of copies are made anew
// every twenty steps, each cell passes from device to device, and ranks without any cell take part. A state
// that is loaded in between goes on with the same bits: no sum depends on which copies are listed.
TEST_P(DevicesOfRanks, HandCellsOver) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      Simulation<double> host(fast_scene(), travellers(), ranks);
      const Whole start = whole(host);
      for (int i = 0; i < 240; ++i) host.step();
      OnDevices<double> device(GetParam(), fast_scene(), travellers(), ranks);
      std::vector<std::byte> middle;
      for (int i = 0; i < 8; ++i) {
        device.steps(30);
        EXPECT_EQ(sum_over(ranks, device.sim.bodies()), 2);
        if (i == 2) middle = device.sim.save();
      }
      const double passed = sum_over(ranks, static_cast<double>(device.sim.arrivals()));
      EXPECT_EQ(passed, sum_over(ranks, static_cast<double>(host.arrivals())));
      EXPECT_GE(passed, 2);
      const Whole a = whole(host), b = whole(device.sim);
      if (ranks.root()) {
        EXPECT_GT(largest_difference(a.position, start.position), 20);
        // One smooth motion; coordinates of some 100 with a round-off of 1e-14.
        EXPECT_LT(largest_difference(a.position, b.position), 1e-9) << n << " ranks";
        EXPECT_LT(largest_difference(a.velocity, b.velocity), 1e-10 * a.largest_speed) << n << " ranks";
      }
      OnDevices<double> again(GetParam(), fast_scene(), travellers(), ranks);
      again.sim.load({middle.data(), middle.size()});
      again.take();
      again.steps(150);
      const Whole c = whole(again.sim);
      EXPECT_TRUE(again.sim.fluid().save() == device.sim.fluid().save());
      EXPECT_TRUE(b.position == c.position) << "rank " << ranks.rank() << " of " << n;
    });
}

// A state is taken down and up again at both parities of the fluid.
TEST_P(DevicesOfRanks, GoOnFromASavedState) {
  on(2, [&](const mpi::Ranks& ranks) {
    OnDevices<float> through(GetParam(), long_scene(), crowd(), ranks);
    through.steps(9);
    for (const int middle : {4, 5}) {
      OnDevices<float> first(GetParam(), long_scene(), crowd(), ranks),
          second(GetParam(), long_scene(), crowd(), ranks);
      first.steps(middle);
      const auto state = first.sim.save();
      second.sim.load({state.data(), state.size()});
      second.take();
      second.steps(9 - middle);
      EXPECT_TRUE(second.sim.fluid().save() == through.sim.fluid().save()) << middle;
      EXPECT_TRUE(whole(second.sim).position == whole(through.sim).position) << middle;
    }
  });
}

// Every wrong pair of contacts, marker that two ranks count or none, and load that is booked twice when its
// cell passes to another rank would show. Tolerances as in test_resolved_ranks.cpp.
template <class Real>
void expect_momentum_to_close(Place place, const data::Scene& plain, const std::vector<InitialCell>& cells,
                              int steps, double relative) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      data::Scene scene = plain;
      scene.cells.loads = {{0, "+x", 0.1, {10e-12, 0, 0}}};
      OnDevices<Real> device(place, scene, cells, ranks);
      const auto start = device.sim.momentum();
      device.steps(steps);
      const Momentum m = device.sim.momentum();
      const double scale = std::abs(m.to_upper_wall[2]);
      EXPECT_GT(scale, 1);
      EXPECT_GT(m.from_loads[0], 0);
      for (int d = 0; d < 3; ++d)
        EXPECT_LT(std::abs(m.total()[d] - start.total()[d]), relative * scale)
            << "component " << d << ", " << n << " ranks";
    });
}
TEST_P(DevicesOfRanks, MomentumClosesInDouble) {
  expect_momentum_to_close<double>(GetParam(), long_scene(), crowd(), 100, 1e-12);
  expect_momentum_to_close<double>(GetParam(), fast_scene(), travellers(), 200, 1e-12);
}
TEST_P(DevicesOfRanks, MomentumClosesInSingle) {
  expect_momentum_to_close<float>(GetParam(), long_scene(), crowd(), 100, 1e-5);
}

TEST_P(DevicesOfRanks, OrderOfThreadsChangesNoBit) {
  on(3, [&](const mpi::Ranks& ranks) {
    std::vector<std::byte> first;
    Whole positions;
    for (const HostThreads order : {HostThreads::forward, HostThreads::backward, HostThreads::scattered}) {
      ThreadOrder now(order);
      OnDevices<float> device(GetParam(), long_scene(), crowd(), ranks);
      device.steps(10);
      const auto state = device.sim.fluid().save();
      const Whole all = whole(device.sim);
      if (first.empty()) first = state, positions = all;
      EXPECT_TRUE(first == state) << "rank " << ranks.rank();
      EXPECT_TRUE(positions.position == all.position);
    }
  });
}

TEST_P(DevicesOfRanks, PlasmaAlone) {
  on(3, [&](const mpi::Ranks& ranks) {
    data::Scene scene = long_scene();
    scene.flow.type = data::Flow::Type::poiseuille;
    scene.flow.mean_velocity = 1e-3;
    Simulation<double> host(scene, {}, ranks);
    OnDevices<double> device(GetParam(), scene, {}, ranks);
    for (int i = 0; i < 21; ++i) host.step();
    device.steps(21);
    const Whole a = whole(host), b = whole(device.sim);
    EXPECT_LE(largest_difference(a.velocity, b.velocity), 1e-13 * a.largest_speed);
  });
}

// A blow-up on one rank is named by its cell's number in the scene and ends all ranks.
void expect_blow_up_to_be_named(Place place, const data::Places& places) {
  on(2, [&](const mpi::Ranks& ranks) {
    Simulation<float> sim(at(places, long_scene()), crowd(), ranks);
    for (auto& group : sim.groups())
      if (auto* cells = std::get_if<npfem::Membranes<float>>(&group.cells))
        for (int c = 0; c < cells->count(); ++c)
          if (cells->id(c) == 2) {
            std::vector<mesh::Vec3> v(static_cast<std::size_t>(cells->vertices()), mesh::Vec3{0, 0, 0});
            v[7][0] = std::nan("");
            cells->set_velocities(c, v);
          }
    try {
      ranks.guarded([&] {
        Stepper<float> stepper(sim, place);
        stepper.step();
        stepper.sync();
      });
      ADD_FAILURE() << "a cell with NaN goes on";
    } catch (const Error& error) {
      EXPECT_EQ(static_cast<int>(error.code), 3);
      EXPECT_NE(std::string(error.what()).find("cell 2 "), std::string::npos) << error.what();
    }
  });
}
TEST_P(DevicesOfRanks, BlowUpIsNamedOnAllRanks) { expect_blow_up_to_be_named(GetParam(), whole_step); }
TEST_P(DevicesOfRanks, BlowUpIsNamedByWhoSolvesTheCell) {
  expect_blow_up_to_be_named(GetParam(), solid_evenly);
}

/// Four red cells and three platelets, all in the lower third of the box.
std::vector<InitialCell> one_sided() {
  std::vector<InitialCell> cells;
  for (const double y : {4.5, 10.5, 16.5, 22.5})
    cells.push_back({0, {12, y, 10}, mesh::identity_rotation, {}});
  for (const double y : {7.0, 13.0, 19.0}) cells.push_back({1, {0, y, 10}, mesh::identity_rotation, {}});
  return cells;
}

/// Which device solves a cell changes nothing: no kernel sees more than one cell, and where the points of a
/// rigid body that passes with its fluid are the host finds to the last bit (rotation.hpp).
template <class Real>
void expect_even_to_change_no_bit(Place place, const data::Scene& scene,
                                  const std::vector<InitialCell>& cells, int steps, int least_passed) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      OnDevices<Real> with_fluid(place, scene, cells, ranks, solid_with_fluid),
          even(place, scene, cells, ranks, solid_evenly);
      const Whole start = whole(even.sim);
      with_fluid.steps(steps), even.steps(steps);
      const double passed = sum_over(ranks, static_cast<double>(even.sim.arrivals()));
      const Whole a = whole(with_fluid.sim), b = whole(even.sim);
      if (!ranks.root()) return;
      EXPECT_GE(passed, least_passed) << n << " ranks";
      EXPECT_GT(largest_difference(a.position, start.position), 0.02);
      EXPECT_EQ(largest_difference(a.position, b.position), 0) << n << " ranks";
      EXPECT_EQ(largest_difference(a.velocity, b.velocity), 0) << n << " ranks";
    });
}
TEST_P(DevicesOfRanks, EvenDistributionChangesNoBit) {
  expect_even_to_change_no_bit<double>(GetParam(), fast_scene(), travellers(), 120, 1);
  expect_even_to_change_no_bit<float>(GetParam(), long_scene(), crowd(), 20, 0);
  expect_even_to_change_no_bit<double>(GetParam(), long_scene(), one_sided(), 10, 0);
}

TEST_P(DevicesOfRanks, EvenDistributionOfCellsInOneSlab) {
  for (const int n : {2, 3})
    on(n, [&](const mpi::Ranks& ranks) {
      OnDevices<float> even(GetParam(), long_scene(), one_sided(), ranks, solid_evenly);
      EXPECT_EQ(even.sim.bodies(), ranks.root() ? 7 : 0);
      std::vector<double> count(3 * static_cast<std::size_t>(n));  // [rank][all, red cells, platelets]
      for (const auto& group : even.sim.moved())
        for (const int i : {0, 1 + group.kind}) count[3 * ranks.rank() + i] += group.count();
      ranks.sum({count.data(), count.size()});
      const double cells[3] = {7, 4, 3};
      for (int i = 0; i < 3; ++i) {
        double sum = 0;
        for (int r = 0; r < n; ++r) {
          sum += count[3 * r + i];
          EXPECT_LT(std::abs(count[3 * r + i] - cells[i] / n), 1) << "rank " << r << " of " << n;
        }
        EXPECT_EQ(sum, cells[i]);
      }
    });
}

// A state saved by either distribution goes on in either, with the same bits, and also where other cells were
// solved before; cells pass before it and after it.
TEST_P(DevicesOfRanks, EvenDistributionGoesOnFromASavedState) {
  on(2, [&](const mpi::Ranks& ranks) {
    const auto make = [&](const data::Places& places) {
      return OnDevices<double>(GetParam(), fast_scene(), travellers(), ranks, places);
    };
    auto even = make(solid_evenly);
    even.steps(160);
    const auto middle = even.sim.save();
    const auto before = sum_over(ranks, static_cast<double>(even.sim.arrivals()));
    even.steps(120);
    const auto end = even.sim.save();
    const auto after = sum_over(ranks, static_cast<double>(even.sim.arrivals()));
    EXPECT_GE(before, 1);
    EXPECT_GT(after, before);
    even.sim.load({middle.data(), middle.size()});
    even.steps(120);
    EXPECT_TRUE(even.sim.save() == end) << "rank " << ranks.rank();
    for (const auto& places : {solid_evenly, solid_with_fluid}) {
      auto other = make(places);
      other.sim.load({middle.data(), middle.size()});
      other.take();
      other.steps(120);
      EXPECT_TRUE(other.sim.save() == end) << "rank " << ranks.rank();
    }
  });
}

}  // namespace
}  // namespace hemowalk::resolved
