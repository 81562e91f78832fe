// coupling: paper (method 5.1 and 12, docs/adr/0011): the fluid is driven to the markers' velocity by
// multi-direct forcing, the solid gets the stress of the fluid outside. The two are not equal and opposite;
// momentum() shows by how much.

#include <omp.h>

#include <cstring>

#include "resolved/mesh/lane_vector.hpp"
#include "resolved/simulation.hpp"
#include "resolved/stopwatch.hpp"

namespace hemowalk::resolved {

/// Solid step: contact, the fluid's forces on the vertices, the cells' new velocities and positions.
template <class Real>
void Simulation<Real>::couple_paper() {
  {
    Stopwatch watch(timings_.contact);
    read_normals();
    press();
  }
  Stopwatch watch(timings_.solid);
  fluid_forces();
  move_cells();
}

template <class Real>
void Simulation<Real>::read_normals() {
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto at = g.layout();
          const auto normals = g.normals();
#pragma omp parallel for schedule(static)
          for (int c = 0; c < g.count(); ++c)
            for (int k = 0; k < g.vertices(); ++k)
              paper_->normal[group.marker(c, k)] = {normals[at.at(c, k, 0)], normals[at.at(c, k, 1)],
                                                    normals[at.at(c, k, 2)], 0};
        },
        group.cells);
}

/// v_pred = v^n + h F/m, F the traction outside, or the contact force where a foreign particle is in the
/// kernel, and loads.
template <class Real>
void Simulation<Real>::fluid_forces() {
  const auto wrap = [](int i, int n) { return (i % n + n) % n; };
  const auto wrapped = [&](const Node3& n) {
    return Node3{wrap(n[0], block_.nx), faces_.periodic_y ? wrap(n[1], block_.ny) : n[1],
                 wrap(n[2], block_.nz)};
  };
  const auto is_fluid = [&](const Node3& node) {
    const Node3 n = wrapped(node);
    return n[1] >= 0 && n[1] < block_.ny && !fluid_.is_solid(n[0], n[1], n[2]);
  };
  for (auto& group : groups_)
    std::visit(
        [&](auto& g) {
          const int vertices = g.vertices();
          const auto at = g.layout();
          const auto velocities = g.velocities();
          const auto predicted = g.predicted();
          const OneRings& rings = paper_->rings[static_cast<std::size_t>(&group - groups_.data())];
#pragma omp parallel
          {
            std::vector<double> pressure(vertices);
            std::vector<std::array<double, 6>> viscous(vertices);
            std::vector<mesh::Vec3> normal(vertices), force(vertices), scratch(vertices);
#pragma omp for schedule(dynamic, 4)
            for (int c = 0; c < g.count(); ++c) {
              const auto& origin = origin_[group.first_body + c];
              for (int k = 0; k < vertices; ++k) {
                const Node4<Real> x = vertices_[group.marker(c, k)], n = paper_->normal[group.marker(c, k)];
                normal[k] = {n.x, n.y, n.z};
                Node3 node;
                lbm::NodeStress stress;
                if (exterior_node({origin[0] + double(x.x), origin[1] + double(x.y), origin[2] + double(x.z)},
                                  normal[k], is_fluid, node)) {
                  const Node3 i = wrapped(node);
                  stress = fluid_.stress(i[0], i[1], i[2]);
                }
                pressure[k] = stress.pressure, viscous[k] = stress.viscous;
              }
              subtract_mean(group.weight, pressure);
              for (int k = 0; k < vertices; ++k)
                force[k] = surface_force(group.weight[k], normal[k], pressure[k], viscous[k]);
              if (scene_.coupling.median_filter) rings.median(force, scratch);
              for (int k = 0; k < vertices; ++k) {
                const Node4<Real> press = contact_force_[group.marker(c, k)];
                const double other[3] = {press.x, press.y, press.z}, fluid = press.w > 0 ? 0 : 1;
                for (int d = 0; d < 3; ++d)
                  predicted[at.at(c, k, d)] = static_cast<Real>(
                      velocities[at.at(c, k, d)] + h_ / group.mass[k] * (fluid * force[k][d] + other[d]));
              }
            }
          }
        },
        group.cells);
}

/// Multi-direct forcing in one fluid step: of n cycles each adds delta_k = A_k (rho_k U_k - j_k) to what
/// marker k gives, all readings before any spreading; j includes what earlier cycles gave.
/// \param fluid_step of this solid step, from 0: markers have moved so often by U.
template <class Real>
void Simulation<Real>::drive_fluid(int fluid_step) {
  const auto for_markers = [&](const auto& body) {
    for (const auto& group : groups_)
      std::visit(
          [&](const auto& g) {
            const auto at = g.layout();
            const auto v = g.velocities();
#pragma omp parallel for schedule(static)
            for (int c = 0; c < g.count(); ++c)
              for (int k = 0; k < g.vertices(); ++k)
                body(group.marker(c, k), static_cast<Real>(group.weight[k]),
                     mesh::Vector<Real>{v[at.at(c, k, 0)], v[at.at(c, k, 1)], v[at.at(c, k, 2)]});
          },
          group.cells);
  };
  {
    Stopwatch watch(timings_.interpolation);
    if (fluid_step > 0) {
      for_markers([&](std::size_t m, Real, const mesh::Vector<Real>& U) {
        sites_[m].x += U.x, sites_[m].y += U.y, sites_[m].z += U.z;
      });
      markers_->locate(origin_.view(), sites_.view());
    }
    std::memset(static_cast<void*>(impulse_.data()), 0, impulse_.size() * sizeof(Node4<Real>));
  }
  const auto& g = fluid_.parameters().body_force;
  const mesh::Vector<Real> pull{static_cast<Real>(g[0]), static_cast<Real>(g[1]), static_cast<Real>(g[2])};
  for (int cycle = 0; cycle < scene_.coupling.cycles; ++cycle) {
    {
      Stopwatch watch(timings_.interpolation);
      read_momentum(cycle > 0);
      for_markers([&](std::size_t m, Real area, const mesh::Vector<Real>& U) {
        const Node4<Real> j = reading_[m];
        const Real rho = 1 + j.w;
        impulse_[m].x += area * (rho * U.x - j.x - pull.x),
            impulse_[m].y += area * (rho * U.y - j.y - pull.y),
            impulse_[m].z += area * (rho * U.z - j.z - pull.z);
      });
    }
    spread(cycle + 1 == scene_.coupling.cycles ? 1 : 0);
  }
}

/// I[j] and I[rho - 1] at the markers; \p with_force: j + F.
template <class Real>
void Simulation<Real>::read_momentum(bool with_force) {
  View<Node4<Real>> momentum = paper_->momentum.view();
#pragma omp parallel for schedule(static)
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (std::size_t n = block_.at(0, j, k); n < block_.at(block_.nx, j, k); ++n) {
        const Node4<Real> u = velocity_[n], F = force_[n];
        const Real rho = 1 + u.w, share = with_force ? Real(1) : Real(0);
        momentum[n] = {rho * u.x + share * F.x, rho * u.y + share * F.y, rho * u.z + share * F.z, u.w};
      }
  ibm::fill_velocity_halo(block_, faces_, momentum);
  markers_->interpolate(momentum, reading_.view());
}

template void Simulation<float>::couple_paper();
template void Simulation<float>::read_normals();
template void Simulation<float>::fluid_forces();
template void Simulation<float>::drive_fluid(int);
template void Simulation<float>::read_momentum(bool);
template void Simulation<double>::couple_paper();
template void Simulation<double>::read_normals();
template void Simulation<double>::fluid_forces();
template void Simulation<double>::drive_fluid(int);
template void Simulation<double>::read_momentum(bool);

}  // namespace hemowalk::resolved
