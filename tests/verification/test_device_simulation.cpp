// The whole step on the device against the host's: cells, fluid, contact and momentum.

#include <gtest/gtest.h>

#include <cmath>

#include "core/check.hpp"
#include "resolved/device_simulation.hpp"
#include "resolved/device_solid.hpp"
#include "resolved/stepper.hpp"
#include "support/blood_scene.hpp"
#include "support/places.hpp"

namespace hemowalk::resolved {
namespace {

using namespace hemowalk::test;

class DeviceSimulationTest : public OnPlace {};
HEMOWALK_ON_BOTH_PLACES(DeviceSimulationTest);

data::Scene small_scene(double acceleration = 32) { return plasma_scene({12, 14, 12}, acceleration); }

// Two red cells nearly touching, a platelet close to the moving wall, all near or across periodic faces.
std::vector<InitialCell> small_crowd() {
  return {{0, {12, 7.5, 23}, mesh::rotation({1, 0, 0}, 0.3), {}},
          {0, {15, 14.2, 21}, mesh::rotation({1, 0, 0.4}, 0.2), {}},
          {1, {1, 25.9, 12}, mesh::rotation({0, 0, 1}, 0.2), {}}};
}

struct Difference {
  double position = 0, velocity = 0, speed = 0, fluid = 0;
};

template <class Real>
Difference difference(const Simulation<Real>& a, const Simulation<Real>& b) {
  Difference worst;
  const auto grow = [](double& to, double d) {
    to = std::abs(d) <= to ? to : std::abs(d);
  };  // lets NaN through
  for (std::size_t g = 0; g < a.groups().size(); ++g)
    std::visit(
        [&](const auto& x) {
          const auto& y = std::get<std::decay_t<decltype(x)>>(b.groups()[g].cells);
          const auto at = x.layout();
          for (int c = 0; c < x.count(); ++c)
            for (int k = 0; k < x.vertices(); ++k)
              for (int d = 0; d < 3; ++d) {
                grow(worst.position, x.position(c, k)[d] - y.position(c, k)[d]);
                grow(worst.velocity,
                     double(x.velocities()[at.at(c, k, d)]) - double(y.velocities()[at.at(c, k, d)]));
                grow(worst.speed, double(x.velocities()[at.at(c, k, d)]));
              }
        },
        a.groups()[g].cells);
  const Block& block = a.block();
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const auto n = block.at(i, j, k);
        grow(worst.fluid, double(a.velocity()[n].x) - double(b.velocity()[n].x));
        grow(worst.fluid, double(a.velocity()[n].y) - double(b.velocity()[n].y));
        grow(worst.fluid, double(a.velocity()[n].z) - double(b.velocity()[n].z));
      }
  return worst;
}

void expect_close_in_double(Place place, const data::Scene& scene, int steps) {
  Simulation<double> host(scene, small_crowd()), result(scene, small_crowd());
  Queue queue(place);
  DeviceSimulation<double> device(queue, host);
  for (int i = 0; i < steps; ++i) host.step(), device.step();
  device.download(result);
  const Difference d = difference(host, result);
  EXPECT_EQ(result.fluid_steps(), host.fluid_steps());
  EXPECT_GT(host.contact_summary().contacts, 0) << "the scene should exercise contact";
  EXPECT_EQ(result.contact_summary().contacts, host.contact_summary().contacts);
  // Round-off of a step (some 1e-14 of speeds and of 1 dx) grows with the number of steps; a suspension that
  // touches is not chaotic yet within a hundred strains' hundredth (gamma t = 0.5). A wrong term of 1e-6
  // would show.
  const double tolerance = 1e-12 * steps;
  EXPECT_GT(d.speed, 1e6 * tolerance);
  EXPECT_LT(d.position, tolerance);
  EXPECT_LT(d.velocity, tolerance);
  EXPECT_LT(d.fluid, tolerance);
}

TEST_P(DeviceSimulationTest, FollowsTheHostInDouble) {
  expect_close_in_double(GetParam(), small_scene(), 150);
}

TEST_P(DeviceSimulationTest, FollowsTheHostWithADeformablePlatelet) {
  data::Scene scene = small_scene();
  auto& platelet = scene.cells.kinds[1];
  platelet.law = data::Kind::Law::paper, platelet.bending.modulus = 100e-18;
  expect_close_in_double(GetParam(), scene, 60);
}

// A run goes on from what TakeMoments left, so one that is loaded must start from that too, not from the
// host's velocity, which another compiler rounds otherwise: a host whose velocity is off changes nothing.
TEST_P(DeviceSimulationTest, TakesTheVelocityFromItsOwnPopulations) {
  for (const int before : {0, 1}) {  // parities
    std::vector<std::byte> first;
    for (const float off : {0.f, 1e-3f}) {
      Simulation<float> host(small_scene(), small_crowd());
      for (int i = 0; i < before; ++i) host.step();
      for (const auto& node : host.velocity()) const_cast<Node4<float>&>(node).z += off;
      Queue queue(GetParam());
      DeviceSimulation<float> device(queue, host);
      for (int i = 0; i < 3; ++i) device.step();
      device.download(host);
      const auto state = host.save();
      if (first.empty()) first = state;
      EXPECT_TRUE(state == first);
    }
  }
}

TEST_P(DeviceSimulationTest, FollowsTheHostWithSeveralFluidStepsAndIterations) {
  // An even number of fluid steps needs one graph, an odd one two. (Longer runs with few solid steps blow up
  // on both.)
  for (const int every : {2, 3}) {
    data::Scene scene = small_scene(4);
    scene.coupling.solid_every = every;
    scene.coupling.iterations = 6;
    expect_close_in_double(GetParam(), scene, every == 2 ? 30 : 8);
  }
}

TEST_P(DeviceSimulationTest, FollowsTheHostInAForcedFlowWithLoads) {
  data::Scene scene = small_scene();
  scene.flow.type = data::Flow::Type::poiseuille;
  scene.flow.mean_velocity = 1e-3;
  scene.cells.loads = {{0, "+x", 0.02, {5e-12, 0, 0}}, {0, "-x", 0.02, {-5e-12, 0, 0}}};
  Simulation<double> host(scene, small_crowd()), result(scene, small_crowd());
  Queue queue(GetParam());
  DeviceSimulation<double> device(queue, host);
  for (int i = 0; i < 60; ++i) host.step(), device.step();
  device.download(result);
  const Difference d = difference(host, result);
  EXPECT_LT(d.position, 60e-12);
  EXPECT_LT(d.velocity, 60e-12);
  const Momentum a = host.momentum(), b = result.momentum();
  EXPECT_GT(std::abs(a.from_body_force[2]), 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.from_body_force[i], b.from_body_force[i], 1e-10 * std::abs(a.from_body_force[2]));
    EXPECT_NEAR(a.from_loads[i], b.from_loads[i], 1e-10);
  }
}

// Single precision of the forces is of order 1e-4 relative, displacements here of order 1 dx (as in
// Simulation.SinglePrecisionFollowsDouble).
TEST_P(DeviceSimulationTest, FollowsTheHostInSinglePrecision) {
  Simulation<float> host(small_scene(), small_crowd()), result(small_scene(), small_crowd());
  Queue queue(GetParam());
  DeviceSimulation<float> device(queue, host);
  for (int i = 0; i < 200; ++i) host.step(), device.step();
  device.download(result);
  const Difference d = difference(host, result);
  EXPECT_LT(d.position, 1e-3);
  EXPECT_LT(d.velocity, 1e-4 * 0.05 * 10);
}

template <class Real>
void expect_momentum_to_close(Place place, double relative) {
  Simulation<Real> sim(small_scene(), small_crowd());
  const auto start = sim.momentum().fluid;
  Queue queue(place);
  DeviceSimulation<Real> device(queue, sim);
  for (int i = 0; i < 300; ++i) device.step();
  device.download(sim);
  const Momentum m = sim.momentum();
  const double scale = std::abs(m.to_upper_wall[2]);
  EXPECT_GT(scale, 1);
  for (int d = 0; d < 3; ++d)
    EXPECT_LT(std::abs(m.fluid[d] + m.cells[d] + m.to_lower_wall[d] + m.to_upper_wall[d] - start[d]),
              relative * scale);
}
// Round-off of some 1e4 nodes and 600 markers over 300 steps, relative to the impulse on a wall; contact
// forces are multiples of 1.4e-14 and cancel exactly.
TEST_P(DeviceSimulationTest, MomentumClosesInDouble) { expect_momentum_to_close<double>(GetParam(), 1e-12); }
TEST_P(DeviceSimulationTest, MomentumClosesInSingle) { expect_momentum_to_close<float>(GetParam(), 1e-5); }

TEST_P(DeviceSimulationTest, OrderOfThreadsChangesNoBit) {
  std::vector<std::byte> first;
  for (const HostThreads order : {HostThreads::forward, HostThreads::backward, HostThreads::scattered}) {
    ThreadOrder now(order);
    Simulation<float> sim(small_scene(), small_crowd());
    Queue queue(GetParam());
    DeviceSimulation<float> device(queue, sim);
    for (int i = 0; i < 10; ++i) device.step();
    device.download(sim);
    std::vector<std::byte> state = sim.fluid().save();
    for (const auto& group : sim.groups())
      std::visit(
          [&](const auto& g) {
            std::vector<std::byte> cell(g.state_bytes());
            for (int c = 0; c < g.count(); ++c) {
              g.save(c, cell.data());
              state.insert(state.end(), cell.begin(), cell.end());
            }
          },
          group.cells);
    if (first.empty()) first = state;
    EXPECT_TRUE(first == state);
  }
}

// A state taken up in the middle goes on as if nothing had happened; contact lists are searched anew, which
// changes no force.
TEST_P(DeviceSimulationTest, GoesOnFromADownloadedState) {
  for (const int middle : {4, 5}) {  // both parities of the fluid
    Simulation<float> whole(small_scene(), small_crowd()), parts(small_scene(), small_crowd());
    Queue queue(GetParam());
    {
      DeviceSimulation<float> device(queue, whole);
      for (int i = 0; i < 9; ++i) device.step();
      device.download(whole);
    }
    {
      DeviceSimulation<float> device(queue, parts);
      for (int i = 0; i < middle; ++i) device.step();
      device.download(parts);
    }
    DeviceSimulation<float> device(queue, parts);
    for (int i = middle; i < 9; ++i) device.step();
    device.download(parts);
    EXPECT_TRUE(whole.fluid().save() == parts.fluid().save());
    EXPECT_EQ(difference(whole, parts).position, 0);
  }
}

TEST_P(DeviceSimulationTest, AStepIsOneGraphWithoutCopies) {
  Simulation<float> host(small_scene(), small_crowd());
  Queue queue(GetParam());
  DeviceSimulation<float> device(queue, host);
  device.step();
  device.step();
  // locate 4, interpolate 1, contact 4, cells 2, spread 2, fluid: collision and moments of a slab, first
  // plane, last plane(s), walls
  EXPECT_EQ(device.kernels(), 4u + 1 + 4 + 2 + 2 + 5);
  const PartTimes times = device.time_parts(2);
  EXPECT_GT(times.fluid, 0);
  EXPECT_GT(times.solid, 0);
  EXPECT_EQ(device.fluid_steps(), 4);
}

TEST_P(DeviceSimulationTest, BlowUpIsNamed) {
  data::Scene scene = small_scene();
  Simulation<float> host(scene, small_crowd());
  auto& cells = std::get<npfem::Membranes<float>>(host.groups()[0].cells);
  std::vector<mesh::Vec3> v(static_cast<std::size_t>(cells.vertices()), mesh::Vec3{0, 0, 0});
  v[7][0] = std::nan("");
  cells.set_velocities(1, v);
  Queue queue(GetParam());
  DeviceSimulation<float> device(queue, host);
  device.step();
  EXPECT_THROW(device.check(), PhysicsError);
}

// Several cases fill one device: each has its queue and its graphs, and they do not feel each other.
TEST_P(DeviceSimulationTest, CasesSideBySideDoNotMeet) {
  const double s[2] = {32, 16};
  std::vector<std::byte> alone[2];
  for (int c = 0; c < 2; ++c) {
    Simulation<float> sim(small_scene(s[c]), small_crowd());
    Queue queue(GetParam());
    DeviceSimulation<float> device(queue, sim);
    for (int i = 0; i < 5; ++i) device.step();
    device.download(sim);
    alone[c] = sim.fluid().save();
  }
  Simulation<float> first(small_scene(s[0]), small_crowd()), second(small_scene(s[1]), small_crowd());
  Queue queues[2] = {Queue(GetParam()), Queue(GetParam())};
  DeviceSimulation<float> one(queues[0], first), two(queues[1], second);
  for (int i = 0; i < 5; ++i) one.step(), two.step();
  one.download(first), two.download(second);
  EXPECT_TRUE(first.fluid().save() == alone[0]);
  EXPECT_TRUE(second.fluid().save() == alone[1]);
}

// The paper's hybrid: fluid, coupling and contact on the host, the cells' step on the device, in one to many
// parts (a part is a batch of 8 cells in double precision, so these cells are one part and the rest of 20
// spheres two).
TEST_P(DeviceSimulationTest, HybridFollowsTheHost) {
  data::Scene scene = small_scene();
  Simulation<double> host(scene, small_crowd());
  scene.place.solid = Place::device;
  Simulation<double> hybrid(scene, small_crowd());
  EnergyBudget budget, other;
  {
    Stepper<double> stepper(hybrid, GetParam());
    for (int i = 0; i < 99; ++i) host.step(), stepper.step();
    host.step(&budget), stepper.step(&other);
    EXPECT_EQ(stepper.fluid_steps(), 100);
    stepper.sync();
  }
  const Difference d = difference(host, hybrid);
  EXPECT_GT(d.speed, 0.01);
  EXPECT_LT(d.position, 100e-12);
  EXPECT_LT(d.velocity, 100e-12);
  EXPECT_LT(d.fluid, 100e-12);
  const auto& a = std::get<rigid::RigidBodies<double>>(host.groups()[1].cells);
  const auto& b = std::get<rigid::RigidBodies<double>>(hybrid.groups()[1].cells);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a.orientation(0)[i], b.orientation(0)[i], 1e-10);
  const auto at = [](const EnergyBudget& b, int i) { return (&b.walls)[i]; };
  for (int i = 0; i < static_cast<int>(sizeof budget / sizeof(double)); ++i)
    EXPECT_NEAR(at(budget, i), at(other, i), 1e-9 * budget.viscous)
        << "term " << i << " of the energy budget";
  EXPECT_GT(std::abs(budget.contact), 1e-6 * budget.viscous);
  hybrid.step();  // on the host again
}

TEST_P(DeviceSimulationTest, HybridCutsGroupsIntoParts) {
  Simulation<float> host(small_scene(), small_crowd());
  std::vector<Group<float>> groups[2];
  const auto type = std::get<npfem::Membranes<float>>(host.groups()[0].cells).type();
  for (auto& g : groups) {
    npfem::Membranes<float> cells(std::make_shared<npfem::CellType>(type));
    for (int c = 0; c < 37; ++c) cells.add(c, {20.0 * c, 0, 0}, mesh::rotation({1, 0.1 * c, 0}, 0.3));
    for (int c = 0; c < 37; ++c)
      for (int k = 0; k < cells.vertices(); ++k)
        for (int e = 0; e < 3; ++e)
          cells.predicted()[cells.layout().at(c, k, e)] = 1e-4f * float((7 * k + 3 * e + c) % 11);
    g.push_back({std::move(cells), 0, 0, 0, {}, {}});
  }
  DeviceSolid<float> solid(GetParam(), groups[1], 2);
  mesh::StepOptions options;
  for (int i = 0; i < 3; ++i) {
    const auto expected = std::visit([&](auto& g) { return g.step(options); }, groups[0][0].cells);
    const auto found = solid.step(options);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].increment, expected.increment, 1e-3 * expected.increment + 1e-6);
  }
  const auto& a = std::get<npfem::Membranes<float>>(groups[0][0].cells);
  const auto& b = std::get<npfem::Membranes<float>>(groups[1][0].cells);
  for (std::size_t i = 0; i < a.velocities().size; ++i) {
    ASSERT_NEAR(a.velocities()[i], b.velocities()[i], 1e-7) << "speeds are of order 1e-3";
    ASSERT_NEAR(a.offsets()[i], b.offsets()[i], 2e-6);
    ASSERT_NEAR(a.normals()[i], b.normals()[i], 1e-5);
  }
  for (int c = 0; c < 37; ++c)
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(a.anchor(c)[d], b.anchor(c)[d], 1e-6);
}

// place: device in a scene.
TEST_P(DeviceSimulationTest, StepperTakesTheWholeStepThere) {
  data::Scene scene = small_scene();
  Simulation<double> host(scene, small_crowd());
  scene.place = {Place::device, Place::device, Place::device};
  Simulation<double> sim(scene, small_crowd());
  Stepper<double> stepper(sim, GetParam());
  for (int i = 0; i < 10; ++i) host.step(), stepper.step();
  EXPECT_EQ(sim.fluid_steps(), 0) << "the Simulation falls behind";
  stepper.sync();
  EXPECT_EQ(sim.fluid_steps(), 10);
  EXPECT_LT(difference(host, sim).position, 10e-12);
}

TEST(Stepper, RefusesPlacesThatDoNotGoTogether) {
  data::Scene scene = small_scene();
  EXPECT_TRUE(place_problem(scene).empty());
  scene.place.fluid = Place::device;
  EXPECT_FALSE(place_problem(scene).empty());
  Simulation<float> sim(scene, small_crowd());
  EXPECT_THROW(Stepper<float>(sim, Place::host), InputError);
}

TEST(Stepper, IsTheOnlyOneOfItsSimulation) {
  data::Scene scene = small_scene();
  scene.place.solid = Place::device;
  Simulation<float> sim(scene, small_crowd());
  {
    Stepper<float> first(sim, Place::host);
    EXPECT_THROW(Stepper<float>(sim, Place::host), InputError);
    EXPECT_TRUE(sim.solid_is_elsewhere());
  }
  EXPECT_NO_THROW(Stepper<float>(sim, Place::host));
}

TEST(Stepper, AsksForAGpu) {
  if (device_present()) GTEST_SKIP() << "there is a device";
  data::Scene scene = small_scene();
  scene.place = {Place::device, Place::device, Place::device};
  Simulation<float> sim(scene, small_crowd());
  EXPECT_THROW(Stepper<float>{sim}, InputError);
}

TEST(DeviceSimulation, RefusesTwoThetas) {
  data::Scene scene = small_scene();
  scene.coupling.theta_t = 0.5;
  Simulation<float> host(scene, small_crowd());
  Queue queue(Place::host);
  EXPECT_THROW(DeviceSimulation<float>(queue, host), InputError);
}

}  // namespace
}  // namespace hemowalk::resolved
