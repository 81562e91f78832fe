#pragma once
/// \file CoupledStep: what a step asks of one cell, in one launch: retraction and v_pred, the solid step,
/// marker impulses and new positions. One block of threads per cell, one thread per vertex.

#include <cstdint>

#include "core/block.hpp"
#include "core/device.hpp"
#include "resolved/coupling.hpp"
#include "resolved/mesh/cell_fields.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/slip_correction.hpp"

namespace hemowalk::resolved {

/// Corners of a triangle.
struct Corners {
  int v[3];
};

/// What the coupling knows of a group of cells and of the markers; all arrays on the device. The marker of
/// vertex k of cell c is slot first_slot + c vertices + k.
template <class Real>
struct CellCoupling {
  using V = Vector<Real>;
  mesh::CellFields<Real> cells;
  const int *ring_begin, *ring;  ///< per vertex: 4 triangle + corner
  const Corners* triangle;
  const Real *mass, *weight, *inverse_metric;  ///< [vertices] m, a, 1/(m + k a)
  SlipCorrection<Real> slip;
  Real half_body_force[3], h, delta;
  Real force_grain;  ///< contact forces are multiples of this
  std::uint32_t first_slot, first_body;
  int nodes[3];                ///< of the domain; 0 along an axis that is not periodic
  double first[3], lowest[3];  ///< of the block in it; lowest node of the image to be seen, from there

  Node4<Real>* reading;               ///< [slot] I[u* + theta F/2]; then w
  Node4<Real>* impulse;               ///< [slot]
  const std::int64_t* contact_force;  ///< [slot][3]
  Node4<Real>*vertex, *site;          ///< [slot] relative to origin: membrane, retracted
  std::int32_t* origin;               ///< [body][3]
  mesh::Vec3* couple;                 ///< [cell] rigid bodies: torque of contact about the coupling points
  const int* mirror;                  ///< [vertices] deformable platelets (drawn_in()); else null
  Real half_axial, half_radial;

  static std::size_t shared_bytes(int vertices) {
    return 12 * static_cast<std::size_t>(vertices) * sizeof(Real);
  }
  HEMO_HD std::size_t slot(unsigned cell, int k) const {
    return first_slot + static_cast<std::size_t>(cell) * static_cast<std::size_t>(cells.vertices) +
           static_cast<std::size_t>(k);
  }
  HEMO_HD static V vector(const Node4<Real>& n) { return {n.x, n.y, n.z}; }

  static constexpr int phases_before = 4;
  HEMO_HD void before(int phase, unsigned cell, int me, int threads, unsigned char* shared) const {
    const int n = cells.vertices;
    if (phase == 3) {
      if (couple && me == 0) couple[cell] = contact_couple(cell);
      return;
    }
    Real *x = reinterpret_cast<Real*>(shared), *v = x + 3 * n, *rate = v + 3 * n, *couples = rate + 3 * n;
    for (int k = me; k < n; k += threads) {
      if (phase == 0) {
        mesh::put3(cells.get(cells.offset, cell, k), x, n, k);
        mesh::put3(cells.get(cells.velocity, cell, k), v, n, k);
      } else if (phase == 1 && cells.held) {  // rigid bodies move their coupling points themselves
        mesh::put3(V{Real(0), Real(0), Real(0)}, rate, n, k);
        mesh::put3(V{Real(0), Real(0), Real(0)}, couples, n, k);
      } else if (phase == 1 && mirror) {
        const auto lost = drawn(k, [&](int j) { return mesh::get3(v, n, j); }),
                   forced = drawn(k, [&](int j) { return vector(impulse[slot(cell, j)]); });
        mesh::put3(lost, rate, n, k);
        mesh::put3(forced, couples, n, k);
      } else if (phase == 1) {
        V sum{Real(0), Real(0), Real(0)}, change = sum;
        for (int i = ring_begin[k]; i < ring_begin[k + 1]; ++i) {
          const Corners& t = triangle[ring[i] >> 2];
          const auto edge = [&](const Real* field, int c) {
            return mesh::get3(field, n, t.v[c]) - mesh::get3(field, n, t.v[0]);
          };
          const AreaVector<Real> area = area_vector(edge(x, 1), edge(x, 2), edge(v, 1), edge(v, 2));
          sum = sum + area.normal;
          change = change + area.rate;
        }
        const Retraction<Real> r = retraction(delta, sum, change, vector(impulse[slot(cell, k)]));
        mesh::put3(r.rate, rate, n, k);
        mesh::put3(r.couple, couples, n, k);
      } else {
        predict(cell, k, x, v, rate, couples);
      }
    }
  }

  /// drawn_in() of \p field at vertex k.
  template <class Field>
  HEMO_HD V drawn(int k, const Field& field) const {
    V sum = field(0);
    for (int j = 1; j < cells.vertices; ++j) sum = sum + field(j);
    return drawn_in(half_axial, half_radial, field(k), field(mirror[k]),
                    Real(1) / static_cast<Real>(cells.vertices) * sum);
  }

  HEMO_HD void predict(unsigned cell, int k, const Real* x, const Real* v, const Real* rate,
                       const Real* couples) const {
    const int n = cells.vertices;
    const std::size_t s = slot(cell, k);
    V force = contact_force_on(s);
    if (mirror) force = force + mesh::get3(couples, n, k);
    for (int i = ring_begin[k]; !mirror && i < ring_begin[k + 1]; ++i) {
      const Corners& t = triangle[ring[i] >> 2];
      const int corner = ring[i] & 3;
      const V g =
          mesh::get3(couples, n, t.v[0]) + mesh::get3(couples, n, t.v[1]) + mesh::get3(couples, n, t.v[2]);
      const int from = corner == 2 ? 0 : corner + 1, to = corner == 0 ? 2 : corner - 1;
      force = force + couple_force(g, mesh::get3(x, n, t.v[from]), mesh::get3(x, n, t.v[to]));
    }
    const Node4<Real> u = reading[s];
    const Real read[3] = {u.x, u.y, u.z}, J[3] = {impulse[s].x, impulse[s].y, impulse[s].z};
    Real w[3];
    slip.combined(read, J, Real(1) / weight[k], w);
    const V dn = mesh::get3(rate, n, k);
    const V felt{w[0] + half_body_force[0] + dn.x, w[1] + half_body_force[1] + dn.y,
                 w[2] + half_body_force[2] + dn.z};
    reading[s] = {felt.x, felt.y, felt.z, Real(0)};
    cells.put(predicted_velocity(felt, mesh::get3(v, n, k), force, mass[k], h, inverse_metric[k]),
              cells.predicted, cell, k);
  }

  HEMO_HD V contact_force_on(std::size_t s) const {
    const std::int64_t* f = contact_force + 3 * s;
    return {static_cast<Real>(f[0]) * force_grain, static_cast<Real>(f[1]) * force_grain,
            static_cast<Real>(f[2]) * force_grain};
  }

  /// v_pred belongs to the coupling points: what a force at the surface turns beyond them.
  HEMO_HD mesh::Vec3 contact_couple(unsigned cell) const {
    mesh::Vec3 sum{0, 0, 0};
    for (int k = 0; k < cells.vertices; ++k) {
      const V arm = cells.get(cells.offset, cell, k) - cells.get(cells.held, cell, k),
              F = contact_force_on(slot(cell, k));
      mesh::accumulate(sum, 1, mesh::cross(mesh::Vec3{arm.x, arm.y, arm.z}, mesh::Vec3{F.x, F.y, F.z}));
    }
    return sum;
  }

  HEMO_HD void after(unsigned cell, int me, int threads) const {
    for (int k = me; k < cells.vertices; k += threads) {
      const std::size_t s = slot(cell, k);
      const V J = marker_impulse(weight[k], cells.get(cells.velocity, cell, k), vector(reading[s]));
      impulse[s] = {J.x, J.y, J.z, Real(0)};
    }
    place(cell, me, threads);
  }

  /// x^n of every vertex, relative to a lattice node near its cell, and the point where it touches the fluid.
  HEMO_HD void place(unsigned cell, int me, int threads) const {
    Real fraction[3];
    for (int d = 0; d < 3; ++d) {
      const double a = cells.anchor[3 * static_cast<std::size_t>(cell) + static_cast<std::size_t>(d)],
                   whole = std::floor(a);
      fraction[d] = static_cast<Real>(a - whole);
      if (me != 0) continue;
      double node = whole - first[d];
      if (nodes[d] > 0) node -= std::floor((node - lowest[d]) / nodes[d]) * nodes[d];
      if (!(node > -1e6 && node < 1e6)) node = 0;  // blown up: the markers will tell
      origin[3 * (first_body + static_cast<std::size_t>(cell)) + static_cast<std::size_t>(d)] =
          static_cast<std::int32_t>(node);
    }
    for (int k = me; k < cells.vertices; k += threads) {
      const std::size_t s = slot(cell, k);
      const V p = V{fraction[0], fraction[1], fraction[2]} + cells.get(cells.offset, cell, k),
              q = cells.held ? V{fraction[0], fraction[1], fraction[2]} + cells.get(cells.held, cell, k)
                  : mirror   ? p - drawn(k, [&](int j) { return cells.get(cells.offset, cell, j); })
                             : p - delta * cells.get(cells.normal, cell, k);
      vertex[s] = {p.x, p.y, p.z, Real(0)};
      site[s] = {q.x, q.y, q.z, Real(0)};
    }
  }
};

/// The kernel. \tparam Solid: npfem::MembraneStep or rigid::BodyStep.
template <class Real, class Solid>
struct CoupledStep {
  static constexpr int threads = Solid::threads;
  CellCoupling<Real> coupling;
  Solid solid;

  HEMO_HD int phases() const { return CellCoupling<Real>::phases_before + solid.phases() + 1; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    constexpr int head = CellCoupling<Real>::phases_before;
    if (phase < head) return coupling.before(phase, at.block, static_cast<int>(at.thread), threads, shared);
    if (phase < head + solid.phases()) return solid(phase - head, at, shared);
    coupling.after(at.block, static_cast<int>(at.thread), threads);
  }
};

/// Positions of the markers alone, before the first step.
template <class Real>
struct PlaceCells {
  static constexpr int threads = 96;
  CellCoupling<Real> coupling;
  HEMO_HD int phases() const { return 1; }
  HEMO_HD void operator()(int, BlockThread at, unsigned char*) const {
    coupling.place(at.block, static_cast<int>(at.thread), threads);
  }
};

}  // namespace hemowalk::resolved
