#pragma once
/// \file Kernels of the device fluid: they find populations and fields; what happens in a node is
/// collision.hpp.
///
/// One population set in place (AA pattern): an even step reads and writes a node's own slots, collided
/// population i going to the slot of its opposite; an odd step reads population i from the opposite slot of
/// the node it comes from and writes back there. Every number is touched by one thread alone.

#include "core/block.hpp"
#include "core/device.hpp"
#include "resolved/lbm/collision.hpp"
#include "resolved/lbm/pointers.hpp"

namespace hemowalk::lbm {

/// What the kernels know of a fluid. Populations are [direction][k][j][i], deviations f_i - w_i.
template <class Real>
struct Lattice {
  Block block;
  bool walls_y;
  Real* f;
  std::uint32_t stride;  ///< nodes
  Real body[3];
  Relaxation<Real> rate;
  Real wall_term[2][directions];  ///< 6 w_i c_i . u_wall where i leaves the lower, upper wall

  HEMO_HD std::uint32_t at(int i, int j, int k) const {
    return (static_cast<std::uint32_t>(k) * static_cast<std::uint32_t>(block.ny) +
            static_cast<std::uint32_t>(j)) *
               static_cast<std::uint32_t>(block.nx) +
           static_cast<std::uint32_t>(i);
  }
  HEMO_HD static int wrap(int i, int n) { return i < 0 ? i + n : i >= n ? i - n : i; }
};

struct NodeIndex {
  int i, j, k;
};
template <class Real>
HEMO_HD inline NodeIndex node_of(const Lattice<Real>& l, std::uint32_t n) {
  const std::uint32_t row = n / static_cast<std::uint32_t>(l.block.nx),
                      k = row / static_cast<std::uint32_t>(l.block.ny);
  return {static_cast<int>(n - row * static_cast<std::uint32_t>(l.block.nx)),
          static_cast<int>(row - k * static_cast<std::uint32_t>(l.block.ny)), static_cast<int>(k)};
}

/// Where population I of a node is stored before a step (and, as I's opposite, after it).
template <class Real>
struct SlotOf {
  Real* p;
  Real wall_term;
};
template <int I, bool odd, class Real>
HEMO_HD HEMO_INLINE SlotOf<Real> slot_of(const Lattice<Real>& l, const NodeIndex& x, std::uint32_t n) {
  constexpr int cx = c[I][0], cy = c[I][1], cz = c[I][2];
  if constexpr (!odd || I == 0) return {l.f + static_cast<std::size_t>(I) * l.stride + n, Real(0)};
  const int j = x.j - cy;
  if (cy != 0 && l.walls_y && (j < 0 || j >= l.block.ny))  // came back from the wall: waits in the own slot
    return {l.f + static_cast<std::size_t>(I) * l.stride + n, l.wall_term[j < 0 ? 0 : 1][I]};
  const std::uint32_t from = l.at(cx == 0 ? x.i : Lattice<Real>::wrap(x.i - cx, l.block.nx),
                                  cy == 0 ? x.j : Lattice<Real>::wrap(j, l.block.ny),
                                  cz == 0 ? x.k : Lattice<Real>::wrap(x.k - cz, l.block.nz));
  return {l.f + static_cast<std::size_t>(opposite(I)) * l.stride + from, Real(0)};
}

/// Populations of a node before a step.
template <bool odd, class Real>
HEMO_HD HEMO_INLINE void load(const Lattice<Real>& l, const NodeIndex& x, std::uint32_t n,
                              Real (&f)[directions]) {
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    const SlotOf<Real> slot = slot_of<i, odd>(l, x, n);
    f[i] = *slot.p + slot.wall_term;
  });
}

/// Collides node first + n in place. Nodes beside a wall leave the momentum they send into it.
template <class Real, bool odd>
struct CollideNodes {
  Lattice<Real> l;
  const Node4<Real>* force;  ///< field with halo; null: none
  Node4<Real>* outgoing;     ///< [2][nz][nx] momentum towards the lower, upper wall
  std::uint32_t first;

  HEMO_HD void operator()(std::size_t index) const {
    const auto n = static_cast<std::uint32_t>(first + index);
    const NodeIndex x = node_of(l, n);
    Real f[directions];
    load<odd>(l, x, n, f);
    Real fx = l.body[0], fy = l.body[1], fz = l.body[2];
    if (force) {
      const Node4<Real> F = force[l.block.at(x.i, x.j, x.k)];
      fx += F.x, fy += F.y, fz += F.z;
    }
    collide(f, fx, fy, fz, l.rate);
    if (l.walls_y && (x.j == 0 || x.j == l.block.ny - 1)) {
      const bool upper = x.j != 0;
      Real sum[3] = {0, 0, 0};
      unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
        constexpr int i = decltype(direction)::value, cx = c[i][0], cy = c[i][1], cz = c[i][2];
        if (cy != 0 && (cy > 0) == upper) {
          sum[0] += Real(cx) * f[i], sum[1] += Real(cy) * f[i], sum[2] += Real(cz) * f[i];
        }
      });
      outgoing[(static_cast<std::size_t>(upper) * static_cast<std::size_t>(l.block.nz) +
                static_cast<std::size_t>(x.k)) *
                   static_cast<std::size_t>(l.block.nx) +
               static_cast<std::size_t>(x.i)] = {sum[0], sum[1], sum[2], Real(0)};
    }
    unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
      constexpr int i = decltype(direction)::value, o = opposite(i);
      const SlotOf<Real> slot = slot_of<o, odd>(l, x, n);
      *slot.p = f[i] + slot.wall_term;
    });
  }
};

/// Velocity u* plus share x force of node first + n, and rho - 1, written to the field and to the node's
/// images in the periodic halo. \tparam odd: the coming step is an odd one.
template <class Real, bool odd>
struct TakeMoments {
  Lattice<Real> l;
  const Node4<Real>* force;  ///< null: none
  Real share;
  Node4<Real>* velocity;
  std::uint32_t first;

  HEMO_HD void operator()(std::size_t index) const {
    const auto n = static_cast<std::uint32_t>(first + index);
    const NodeIndex x = node_of(l, n);
    Real f[directions];
    load<odd>(l, x, n, f);
    split_parities(f);
    const Moments<Real> m = moments_of_parities(f);
    const Real inverse_density = Real(1) / (Real(1) + m.density);
    Node4<Real> u{m.x * inverse_density, m.y * inverse_density, m.z * inverse_density, m.density};
    if (force) {
      const Node4<Real> F = force[l.block.at(x.i, x.j, x.k)];
      u.x += share * F.x, u.y += share * F.y, u.z += share * F.z;
    }
    put(u, x);
  }

  HEMO_HD static bool near_face(int i, int n) { return i < Block::halo || i >= n - Block::halo; }
  HEMO_HD void put(const Node4<Real>& u, const NodeIndex& x) const {
    velocity[l.block.at(x.i, x.j, x.k)] = u;
    const bool y = !l.walls_y && near_face(x.j, l.block.ny);
    if (!near_face(x.i, l.block.nx) && !y && !near_face(x.k, l.block.nz)) return;
    for (int c = -1; c <= 1; ++c)
      for (int b = y ? -1 : 0; b <= (y ? 1 : 0); ++b)
        for (int a = -1; a <= 1; ++a) {
          const int i = x.i + a * l.block.nx, j = x.j + b * l.block.ny, k = x.k + c * l.block.nz;
          if (inside(i, l.block.nx) && inside(j, l.block.ny) && inside(k, l.block.nz))
            velocity[l.block.at(i, j, k)] = u;
        }
  }
  HEMO_HD static bool inside(int i, int n) { return i >= -Block::halo && i < n + Block::halo; }
};

/// Writes the walls' velocities into the halo beyond them; once is enough. One thread per halo node of both
/// walls.
template <class Real>
struct FillWallHalo {
  Block block;
  Node4<Real> lower, upper;
  Node4<Real>* velocity;

  HEMO_HD static std::size_t count(const Block& b) {
    return 2 * static_cast<std::size_t>(Block::halo) * b.row() *
           (static_cast<std::size_t>(b.nz) + 2 * Block::halo);
  }
  HEMO_HD void operator()(std::size_t n) const {
    const int i = static_cast<int>(n % block.row()) - Block::halo;
    n /= block.row();
    const int level = static_cast<int>(n % (2 * Block::halo));
    const int k = static_cast<int>(n / (2 * Block::halo)) - Block::halo;
    const bool high = level >= Block::halo;
    velocity[block.at(i, high ? block.ny + level - Block::halo : -1 - level, k)] = high ? upper : lower;
  }
};

/// Adds the momentum given to the walls in this step to the sums since the start: one block per plane and
/// wall. Fixed order, double precision.
template <class Real>
struct SumWallImpulse {
  static constexpr int threads = 64;
  int nx, nz;
  double per_node[2][3];  ///< due to the walls' motion
  const Node4<Real>* outgoing;
  double* total;  ///< [2][nz][3]

  HEMO_HD int phases() const { return 2; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto* part = reinterpret_cast<double*>(shared);  // [3][threads]
    if (phase == 0) {
      double sum[3] = {0, 0, 0};
      for (int i = static_cast<int>(at.thread); i < nx; i += threads) {
        const Node4<Real> p = outgoing[static_cast<std::size_t>(at.block) * static_cast<std::size_t>(nx) +
                                       static_cast<std::size_t>(i)];
        sum[0] += static_cast<double>(p.x), sum[1] += static_cast<double>(p.y),
            sum[2] += static_cast<double>(p.z);
      }
      for (int d = 0; d < 3; ++d) part[d * threads + static_cast<int>(at.thread)] = sum[d];
      return;
    }
    if (at.thread >= 3) return;
    double sum = 0;
    for (int t = 0; t < threads; ++t) sum += part[static_cast<int>(at.thread) * threads + t];
    const int wall = static_cast<int>(at.block) / nz;
    total[at.block * 3 + at.thread] += 2 * sum + nx * per_node[wall][at.thread];
  }
};

}  // namespace hemowalk::lbm
