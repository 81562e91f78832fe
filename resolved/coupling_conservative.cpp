// coupling: conservative (method 5.2, docs/adr/0003 and 0008): implicit in the solid, slip-corrected, equal
// and opposite.

#include <omp.h>

#include <algorithm>

#include "resolved/coupling.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/retraction.hpp"
#include "resolved/simulation.hpp"
#include "resolved/slip_correction.hpp"
#include "resolved/stopwatch.hpp"

namespace hemowalk::resolved {

template <class Real>
void Simulation<Real>::couple_conservative() {
  {
    Stopwatch watch(timings_.interpolation);
    markers_->interpolate(velocity_.view(), reading_.view());
  }
  {
    Stopwatch watch(timings_.communication);
    copies_->send_readings(reading_.view());
  }
  {
    Stopwatch watch(timings_.contact);
    press();
  }
  {
    Stopwatch watch(timings_.communication);
    copies_->receive_readings(reading_.view());
  }
  if (!one_theta_) {
    ibm::fill_velocity_halo(block_, {true, faces_.periodic_y, faces_.periodic_z, {}, {}}, force_.view());
    fields_.fill(force_.view());
    read_field(force_.view(), force_reading_.view());
  }
  {
    Stopwatch watch(timings_.solid);
    retract();
    predict();
    move_cells();
    impulses();
  }
  {
    Stopwatch watch(timings_.communication);
    copies_->send_impulses(impulse_.view());
  }
  spread(h_);
}

/// Retraction as a change of coordinates (docs/adr/0008): the coupling point x_s = x - delta n(x) is a
/// function of the vertices, so its velocity is v - delta dn/dt, and a force J at x_s acts on the vertices as
/// J and, through -delta (dn/dx)^T, as forces on the corners of the triangles around. Virtual work and both
/// momenta are then conserved, and a rigid rotation of fluid and cell together feels no force. dn/dt and J
/// are those of the last step. Deformable platelets: drawn_in() in place of the normals.
template <class Real>
void Simulation<Real>::retract() {
  const Real delta = static_cast<Real>(scene_.coupling.retraction);
  if (delta == 0) return;
  for (auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          constexpr int lanes = std::decay_t<decltype(g)>::lanes;
          const auto& triangles = g.rest().triangles;
          const int vertices = g.vertices();
          const std::size_t length = static_cast<std::size_t>(vertices) * 3 * lanes;
#pragma omp parallel for schedule(static)
          for (int b = 0; b < g.batches(); ++b) {
            const Real *x = g.offsets().data + b * length, *v = g.velocities().data + b * length;
            Real* rate = normal_rate_.data() + 3 * static_cast<std::size_t>(group.first_marker) + b * length;
            Real* force =
                couple_force_.data() + 3 * static_cast<std::size_t>(group.first_marker) + b * length;
            Real* sum = scratch_.data() + static_cast<std::size_t>(omp_get_thread_num()) * scratch_stride_;
            std::fill(rate, rate + length, Real(0));
            std::fill(force, force + length, Real(0));
            if constexpr (requires { g.held(); })
              continue;  // rigid bodies move their coupling points themselves
            const Node4<Real>* J =
                impulse_.data() + group.first_marker + static_cast<std::size_t>(b) * vertices * lanes;
            if (!group.surface.mirror.empty()) {
              draw_in<lanes>(
                  group.surface, [&](int k) { return all_lanes<lanes>(v, k); }, rate);
              draw_in<lanes>(
                  group.surface, [&](int k) { return all_lanes<lanes>(J + k * lanes); }, force);
              continue;
            }
            std::fill(sum, sum + length, Real(0));
            for (const auto& t : triangles) add_normals<lanes>(t, x, v, sum, rate);
            for (int k = 0; k < vertices; ++k)
              to_unit_normal<lanes>(delta, J + k * lanes, sum + 3 * k * lanes, rate + 3 * k * lanes);
            for (const auto& t : triangles) add_couples<lanes>(t, x, sum, force);
          }
        },
        group.cells);
}

/// Slip-corrected fluid velocity w at every vertex and v_pred = (m v^n + k a w + h F)/(m + k a) (method 5.2,
/// 2-3).
template <class Real>
void Simulation<Real>::predict() {
  const SlipCorrection<Real> correct{static_cast<Real>(scene_.coupling.theta_n),
                                     static_cast<Real>(scene_.coupling.theta_t)};
  const auto gravity = half_body_force();
  const Real g[3] = {static_cast<Real>(gravity[0]), static_cast<Real>(gravity[1]),
                     static_cast<Real>(gravity[2])};
  const Real h = static_cast<Real>(h_);
  for (auto& group : groups_)
    std::visit(
        [&](auto& cells) {
          constexpr int lanes = std::decay_t<decltype(cells)>::lanes;
          const Real *velocities = cells.velocities().data, *normals = cells.normals().data;
          Real* predicted = cells.predicted().data;
          const int vertices = cells.vertices();
          if constexpr (requires { cells.held(); }) {
            // v_pred belongs to the coupling points: what a force at the surface turns beyond them is a
            // couple.
            const auto at = cells.layout();
#pragma omp parallel for schedule(static)
            for (int c = 0; c < cells.count(); ++c)
              for (int k = 0; k < vertices; ++k) {
                const Node4<Real> F = contact_force_[group.marker(c, k)];
                mesh::Vec3 arm;
                for (int d = 0; d < 3; ++d)
                  arm[d] = cells.offsets()[at.at(c, k, d)] - cells.held()[at.at(c, k, d)];
                cells.add_couple(c, mesh::cross(arm, mesh::Vec3{F.x, F.y, F.z}));
              }
          }
#pragma omp parallel for schedule(static)
          for (int b = 0; b < cells.batches(); ++b)
            for (int k = 0; k < vertices; ++k) {
              const std::size_t scalar = (static_cast<std::size_t>(b) * vertices + k) * lanes,
                                vector = 3 * scalar;
              const std::size_t slot = group.first_marker + scalar;
              const Real m = static_cast<Real>(group.mass[k]), a = static_cast<Real>(group.weight[k]),
                         inverse_a = 1 / a;
              const Real inverse_metric = static_cast<Real>(1 / (group.mass[k] + h_ * group.weight[k]));
              for (int l = 0; l < lanes; ++l) {
                Node4<Real>& u = reading_[slot + l];
                const Node4<Real> F = contact_force_[slot + l];
                const Real read[3] = {u.x, u.y, u.z};
                const Real J[3] = {impulse_[slot + l].x, impulse_[slot + l].y, impulse_[slot + l].z};
                Real w[3];
                if (one_theta_) {
                  correct.combined(read, J, inverse_a, w);
                } else {
                  const Node4<Real> f = force_reading_[slot + l];
                  const Real half[3] = {f.x / 2, f.y / 2, f.z / 2};
                  const Real normal[3] = {normals[vector + l], normals[vector + lanes + l],
                                          normals[vector + 2 * lanes + l]};
                  correct(read, half, J, inverse_a, normal, w);
                }
                const std::size_t at = 3 * static_cast<std::size_t>(group.first_marker) + vector + l;
                for (int d = 0; d < 3; ++d) w[d] += g[d] + normal_rate_[at + d * lanes];
                u = {w[0], w[1], w[2], Real(0)};
                const Vector<Real> force{F.x + couple_force_[at], F.y + couple_force_[at + lanes],
                                         F.z + couple_force_[at + 2 * lanes]};
                const Vector<Real> v{velocities[vector + l], velocities[vector + lanes + l],
                                     velocities[vector + 2 * lanes + l]};
                const Vector<Real> next =
                    predicted_velocity(Vector<Real>{w[0], w[1], w[2]}, v, force, m, h, inverse_metric);
                predicted[vector + l] = next.x, predicted[vector + lanes + l] = next.y,
                                   predicted[vector + 2 * lanes + l] = next.z;
              }
            }
        },
        group.cells);
}

/// J = a (v - w): what each marker gives the fluid in each of the k fluid steps.
template <class Real>
void Simulation<Real>::impulses() {
  for (auto& group : groups_)
    std::visit(
        [&](const auto& cells) {
          constexpr int lanes = std::decay_t<decltype(cells)>::lanes;
          const Real* velocities = cells.velocities().data;
          const int vertices = cells.vertices();
#pragma omp parallel for schedule(static)
          for (int b = 0; b < cells.batches(); ++b)
            for (int k = 0; k < vertices; ++k) {
              const std::size_t scalar = (static_cast<std::size_t>(b) * vertices + k) * lanes;
              const std::size_t slot = group.first_marker + scalar;
              const Real a = static_cast<Real>(group.weight[k]);
              const Real* v = velocities + 3 * scalar;
              const int used = std::min(lanes, cells.count() - b * lanes);
              for (int l = 0; l < lanes; ++l) {
                const Node4<Real> w = reading_[slot + l];
                const Node4<Real> none{0, 0, 0, 0};  // idle lanes give nothing
                const Vector<Real> J = marker_impulse(a, Vector<Real>{v[l], v[lanes + l], v[2 * lanes + l]},
                                                      Vector<Real>{w.x, w.y, w.z});
                impulse_[slot + l] = l < used ? Node4<Real>{J.x, J.y, J.z, 0} : none;
              }
            }
        },
        group.cells);
}

template void Simulation<float>::couple_conservative();
template void Simulation<float>::retract();
template void Simulation<float>::predict();
template void Simulation<float>::impulses();
template void Simulation<double>::couple_conservative();
template void Simulation<double>::retract();
template void Simulation<double>::predict();
template void Simulation<double>::impulses();

}  // namespace hemowalk::resolved
