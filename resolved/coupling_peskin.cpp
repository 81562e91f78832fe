// coupling: peskin (Peskin 1972; docs/adr/0011): membranes without mass give their elastic force to the fluid
// and move with it. Explicit: equal and opposite, but stable only for soft membranes or small time steps.

#include <omp.h>

#include <cmath>
#include <limits>

#include "resolved/mesh/lane_vector.hpp"
#include "resolved/simulation.hpp"
#include "resolved/stopwatch.hpp"

namespace hemowalk::resolved {

/// F = spread(F_int(x^n) + contact + loads), U = I[u* + F/2], x^{n+1} = x^n + U.
template <class Real>
void Simulation<Real>::couple_peskin() {
  {
    Stopwatch watch(timings_.contact);
    press();
  }
  {
    Stopwatch watch(timings_.solid);
    membrane_forces();
  }
  {
    Stopwatch watch(timings_.communication);
    copies_->send_impulses(impulse_.view());
  }
  spread(1);
  {
    Stopwatch watch(timings_.interpolation);
    add_half_force();
  }
  fill_halo(velocity_.view());
  {
    Stopwatch watch(timings_.interpolation);
    read_field(velocity_.view(), reading_.view());
  }
  Stopwatch watch(timings_.solid);
  follow_fluid();
}

/// Elastic force of every vertex, shortened to coupling.force_cap, plus contact and loads.
template <class Real>
void Simulation<Real>::membrane_forces() {
  const Real cap = scene_.coupling.force_cap ? static_cast<Real>(units_.force(*scene_.coupling.force_cap))
                                             : std::numeric_limits<Real>::max();
  for (auto& group : groups_) {
    auto& membranes = std::get<npfem::Membranes<Real>>(group.cells);
    const std::size_t first = 3 * static_cast<std::size_t>(group.first_marker);
    membranes.internal_forces({couple_force_.data() + first, couple_force_.size() - first});
    const auto at = membranes.layout();
#pragma omp parallel for schedule(static)
    for (int c = 0; c < membranes.count(); ++c)
      for (int k = 0; k < membranes.vertices(); ++k) {
        const Real* f = couple_force_.data() + first;
        const auto given =
            shortened(mesh::Vector<Real>{f[at.at(c, k, 0)], f[at.at(c, k, 1)], f[at.at(c, k, 2)]}, cap);
        const Node4<Real> other = contact_force_[group.marker(c, k)];
        impulse_[group.marker(c, k)] = {given.x + other.x, given.y + other.y, given.z + other.z, 0};
      }
  }
}

/// velocity_ = u* + F/2: the fluid's velocity in the middle of the coming kick; the fluid step writes it
/// anew.
template <class Real>
void Simulation<Real>::add_half_force() {
#pragma omp parallel for schedule(static)
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (std::size_t n = block_.at(0, j, k); n < block_.at(block_.nx, j, k); ++n) {
        Node4<Real>& u = velocity_[n];
        const Node4<Real>& F = force_[n];
        u.x += F.x / 2, u.y += F.y / 2, u.z += F.z / 2;
      }
}

template <class Real>
void Simulation<Real>::follow_fluid() {
  const auto gravity = half_body_force();
  const Real g[3] = {static_cast<Real>(gravity[0]), static_cast<Real>(gravity[1]),
                     static_cast<Real>(gravity[2])};
  for (auto& group : groups_) {
    auto& membranes = std::get<npfem::Membranes<Real>>(group.cells);
    const auto at = membranes.layout();
    const auto predicted = membranes.predicted();
#pragma omp parallel for schedule(static)
    for (int c = 0; c < membranes.count(); ++c)
      for (int k = 0; k < membranes.vertices(); ++k) {
        const Node4<Real> u = reading_[group.marker(c, k)];
        predicted[at.at(c, k, 0)] = u.x + g[0], predicted[at.at(c, k, 1)] = u.y + g[1],
                              predicted[at.at(c, k, 2)] = u.z + g[2];
      }
    check_finite(group, membranes.drift());
  }
}

template void Simulation<float>::couple_peskin();
template void Simulation<float>::membrane_forces();
template void Simulation<float>::add_half_force();
template void Simulation<float>::follow_fluid();
template void Simulation<double>::couple_peskin();
template void Simulation<double>::membrane_forces();
template void Simulation<double>::add_half_force();
template void Simulation<double>::follow_fluid();

}  // namespace hemowalk::resolved
