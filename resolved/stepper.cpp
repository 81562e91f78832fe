#include "resolved/stepper.hpp"

#include "core/check.hpp"
#include "resolved/device_simulation.hpp"
#include "resolved/device_solid.hpp"
#include "resolved/even_solid.hpp"

namespace hemowalk::resolved {

std::string place_problem(const data::Scene& scene) {
  const auto& p = scene.place;
  if (p.fluid == p.coupling && (p.coupling == p.solid || p.fluid == Place::host)) return {};
  return "place: this combination is not available (everything on one place, or the solid alone on the "
         "device) set "
         "fluid and coupling alike";
}

template <class Real>
struct Stepper<Real>::Impl {
  Simulation<Real>& simulation;
  Queue queue;
  std::unique_ptr<DeviceSimulation<Real>> whole;
  std::unique_ptr<DeviceSolid<Real>> solid;
  std::unique_ptr<EvenSolid<Real>> even;

  Impl(Simulation<Real>& s, Place place) : simulation(s), queue(place) {}
};

template <class Real>
Stepper<Real>::Stepper(Simulation<Real>& simulation, Place device) {
  const auto& place = simulation.scene().place;
  const std::string problem = place_problem(simulation.scene());
  require(problem.empty(), problem);
  require(!simulation.solid_is_elsewhere(),
          "two Steppers of one simulation (each moves its cells) destroy the first before making another");
  const bool any = place.solid == Place::device;
  impl_ = std::make_unique<Impl>(simulation, any ? device : Place::host);
  if (!any) return;
  require(
      simulation.scene().coupling.integrator == data::Coupling::Integrator::implicit,
      "coupling.integrator runge_kutta on the device (its kernels know the implicit step) use place: host");
  if (place.fluid == Place::device) {
    impl_->whole = std::make_unique<DeviceSimulation<Real>>(impl_->queue, simulation);
  } else if (place.distribution == data::Places::Distribution::even) {
    impl_->even = std::make_unique<EvenSolid<Real>>(device, simulation.groups(), simulation.ranks(),
                                                    simulation.timings());
    EvenSolid<Real>* even = impl_->even.get();
    simulation.set_solid({[even](const mesh::StepOptions& options) { return even->step(options); },
                          &even->solved(),
                          {},
                          {},
                          [even] { even->take_over(); }});
  } else {
    impl_->solid = std::make_unique<DeviceSolid<Real>>(device, simulation.groups());
    DeviceSolid<Real>* solid = impl_->solid.get();
    simulation.set_solid({[solid](const mesh::StepOptions& options) { return solid->step(options); },
                          nullptr,
                          [solid] { solid->give_back(); },
                          [solid] { solid->take_over(); },
                          {}});
  }
}

template <class Real>
Stepper<Real>::~Stepper() {
  if (impl_ && (impl_->solid || impl_->even)) impl_->simulation.set_solid({});
}

template <class Real>
void Stepper<Real>::step(EnergyBudget* budget) {
  impl_->whole ? impl_->whole->step() : impl_->simulation.step(budget);
}

template <class Real>
void Stepper<Real>::sync() {
  if (impl_->whole) impl_->whole->download(impl_->simulation);
  if (impl_->solid) impl_->solid->download();
  if (impl_->even) impl_->even->download();
}

template <class Real>
void Stepper<Real>::wait() {
  impl_->queue.wait();
}

template <class Real>
DeviceSimulation<Real>* Stepper<Real>::whole() {
  return impl_->whole.get();
}

template <class Real>
std::int64_t Stepper<Real>::fluid_steps() const {
  return impl_->whole ? impl_->whole->fluid_steps() : impl_->simulation.fluid_steps();
}

template class Stepper<float>;
template class Stepper<double>;

}  // namespace hemowalk::resolved
