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

/// What the kernels know of a fluid. Populations are [direction][k][j][i], deviations f_i - w_i. A block
/// divided along z has the planes k = -1 and nz of its neighbours, in which only what crosses a border is
/// kept.
template <class Real>
struct Lattice {
  Block block;
  bool walls_y;
  int beyond;  ///< planes of other blocks on either side: 1, or 0 (periodic along z)
  Real* f;
  std::uint32_t stride;  ///< nodes, those of other blocks included
  Real body[3];
  Relaxation<Real> rate;
  Real wall_term[2][directions];  ///< 6 w_i c_i . u_wall where i leaves the lower, upper wall

  HEMO_HD std::uint32_t at(int i, int j, int k) const {
    return (static_cast<std::uint32_t>(k + beyond) * static_cast<std::uint32_t>(block.ny) +
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
          static_cast<int>(row - k * static_cast<std::uint32_t>(l.block.ny)), static_cast<int>(k) - l.beyond};
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
                                  cz == 0 || l.beyond ? x.k - cz : Lattice<Real>::wrap(x.k - cz, l.block.nz));
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
    const bool z = !l.beyond && near_face(x.k, l.block.nz);
    if (!near_face(x.i, l.block.nx) && !y && !z) return;
    for (int c = z ? -1 : 0; c <= (z ? 1 : 0); ++c)
      for (int b = y ? -1 : 0; b <= (y ? 1 : 0); ++b)
        for (int a = -1; a <= 1; ++a) {
          const int i = x.i + a * l.block.nx, j = x.j + b * l.block.ny, k = x.k + c * l.block.nz;
          if (inside(i, l.block.nx) && inside(j, l.block.ny) && inside(k, l.block.nz))
            velocity[l.block.at(i, j, k)] = u;
        }
  }
  HEMO_HD static bool inside(int i, int n) { return i >= -Block::halo && i < n + Block::halo; }
};

/// The populations that cross a border, to or from messages [side][5][ny][nx]: one thread per column of the
/// message, sides one after the other. After an even step the border planes go out to where the neighbour
/// will collide them; after an odd one the neighbour's planes, collided here, go back.
template <class Real, bool out>
struct CrossBorder {
  Lattice<Real> l;
  bool odd;  ///< the coming step is an odd one
  Real* message;

  HEMO_HD static std::size_t count(const Block& b) {
    return 2 * static_cast<std::size_t>(b.ny) * static_cast<std::size_t>(b.nx);
  }
  HEMO_HD void operator()(std::size_t n) const {
    const std::size_t plane = count(l.block) / 2;
    const bool high = n >= plane;
    const std::size_t node = high ? n - plane : n;
    const int i = static_cast<int>(node % static_cast<std::size_t>(l.block.nx)),
              j = static_cast<int>(node / static_cast<std::size_t>(l.block.nx));
    const int inner = high ? l.block.nz - 1 : 0, outer = high ? l.block.nz : -1;
    const std::uint32_t at = l.at(i, j, odd == out ? inner : outer);
    // Out of the low side go upward slots before an odd step, downward ones after it; in come the others.
    const bool upward = (high != odd) == out;
    Real* slot = message + (high ? 5 * plane : 0) + node;
    unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
      constexpr int d = decltype(direction)::value, cy = c[d][1], cz = c[d][2];
      if constexpr (cz != 0) {
        if ((cz > 0) != upward) return;
        Real& mine = l.f[static_cast<std::size_t>(d) * l.stride + at];
        [[maybe_unused]] const int from = j - cy;
        if constexpr (out)
          *slot = mine;
        else if (odd || !l.walls_y || (from >= 0 && from < l.block.ny))  // else it bounced off: nothing came
          mine = *slot;
        slot += plane;
      }
    });
  }
};

/// Writes the walls' velocities into the halo beyond them; once is enough. One thread per halo node of both
/// walls. The halo along z of a divided block is left alone.
template <class Real>
struct FillWallHalo {
  Block block;
  bool divided_z;
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
    if (divided_z && (k < 0 || k >= block.nz)) return;
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
