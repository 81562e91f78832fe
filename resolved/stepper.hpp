#pragma once
/// \file Stepper: takes a Simulation's steps where its scene says (place: fluid, coupling, solid). All on the
/// host: the Simulation itself. All on the device: DeviceSimulation. The solid alone: the paper's hybrid,
/// DeviceSolid or (place.distribution: even) EvenSolid.

#include <cstdint>
#include <memory>
#include <string>

#include "core/data/scene.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

template <class Real>
class DeviceSimulation;

/// Why these places do not go together, or nothing.
std::string place_problem(const data::Scene& scene);

template <class Real>
class Stepper {
 public:
  /// \p simulation must outlive this and is left alone from now on but for sync(). \p device: where what
  /// belongs on a device is to run; Place::host runs the device's kernels thread by thread, for tests (all).
  /// \throws InputError when there is no device or it lacks something the scene asks for.
  Stepper(Simulation<Real>& simulation, Place device = Place::device);
  ~Stepper();

  /// One coupling step. The Simulation may fall behind. \throws PhysicsError naming cell and step. \p budget:
  /// as Simulation::step(); zeros where the whole step is on the device.
  void step(EnergyBudget* budget = nullptr);
  /// Brings the Simulation up to date (all).
  void sync();
  /// Returns when the device has done what was asked for, for timing.
  void wait();
  /// The whole step on the device; null where some of it is on the host.
  DeviceSimulation<Real>* whole();
  std::int64_t fluid_steps() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class Stepper<float>;
extern template class Stepper<double>;

}  // namespace hemowalk::resolved
