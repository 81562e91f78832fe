#pragma once
/// \file The two inner loops of the host fluid, SIMD along x: collide a run of nodes in place, and take
/// moments.
///
/// Both see a row through 19 pointers: p[i][x] is where population i of node x is stored *now*. In the AA
/// pattern the collided population i goes where its opposite was read, p[opposite(i)][x], in even and odd
/// steps alike; only the pointers differ (own slots, or the opposite slots of the neighbours). Every number
/// is touched by one node alone, so rows and threads may run in any order.

#include "resolved/lbm/node_packs.hpp"
#include "resolved/lbm/pointers.hpp"

namespace hemowalk::lbm {

template <class Real>
struct Force3 {
  Real x, y, z;
};

namespace detail {

/// Loads the populations of W nodes from x on; lanes from \p active on are zero and are not touched in
/// memory.
template <Wall wall, bool whole, int W, class Real, class N>
HEMO_INLINE void load_populations(const RowPointers<Real>& row, int x, int active, N (&f)[directions]) {
  const N index([](auto l) { return Real(int(l)); });
  const auto mask = index < Real(active);
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    if constexpr (whole) {
      f[i] = load<Real, W>(row.p[i] + x);
    } else {
      f[i] = 0;
      where(mask, f[i]).copy_from(row.p[i] + x, stdx::element_aligned);
    }
    if constexpr (leaves(wall, i)) f[i] += row.wall_term[i];
  });
}

/// Momentum carried towards the wall by the collided populations \p f, added to \p sum in double.
template <Wall wall, bool whole, class N>
HEMO_INLINE void add_outgoing(const N (&f)[directions], int active, double (&sum)[3]) {
  for (int l = 0; l < (whole ? int(N::size()) : active); ++l) {
    unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
      constexpr int i = decltype(direction)::value;
      if constexpr (leaves(wall, opposite(i))) {
        for (int a = 0; a < 3; ++a) sum[a] += c[i][a] * static_cast<double>(f[i][l]);
      }
    });
  }
}

/// Asks for the lines of the W nodes that lie 1 KiB ahead: beside 19 streams the hardware loses this one.
template <int write, int W, class Node>
HEMO_INLINE void prefetch(const Node* nodes) {
  const char* p = reinterpret_cast<const char*>(nodes) + 1024;
  for (std::size_t b = 0; b < W * sizeof(Node); b += 64) __builtin_prefetch(p + b, write, 3);
}

template <Wall wall, bool whole, int W, class Real>
HEMO_INLINE void collide_pack(const RowPointers<Real>& row, int x, int active, const Node4<Real>* force,
                              const Force3<Real>& body, const Relaxation<Real>& rate, double (&outgoing)[3]) {
  using N = Pack<Real, W>;
  N f[directions];
  load_populations<wall, whole, W>(row, x, active, f);
  N fx(body.x), fy(body.y), fz(body.z);
  if (force) {
    N x4, y4, z4;
    prefetch<0, W>(force + x);
    load_nodes<Real, W>(force + x, x4, y4, z4);
    fx += x4;
    fy += y4;
    fz += z4;
  }
  collide(f, fx, fy, fz, rate);
  if constexpr (wall != Wall::none) add_outgoing<wall, whole>(f, active, outgoing);
  const N index([](auto l) { return Real(int(l)); });
  const auto mask = index < Real(active);
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value, o = opposite(i);
    if constexpr (leaves(wall, o)) f[i] += row.wall_term[o];
    if constexpr (whole) {
      store<Real, W>(f[i], row.p[o] + x);
    } else {
      where(mask, f[i]).copy_to(row.p[o] + x, stdx::element_aligned);
    }
  });
}

template <Wall wall, bool whole, int W, class Real>
HEMO_INLINE void moments_pack(const RowPointers<Real>& row, int x, int active, Node4<Real>* velocity) {
  using N = Pack<Real, W>;
  N f[directions];
  load_populations<wall, whole, W>(row, x, active, f);
  split_parities(f);
  const Moments<N> m = moments_of_parities(f);
  const N inverse_density = Real(1) / (Real(1) + m.density);
  const N ux = m.x * inverse_density, uy = m.y * inverse_density, uz = m.z * inverse_density;
  if constexpr (whole) {
    prefetch<1, W>(velocity + x);
    store_nodes<Real, W>(ux, uy, uz, m.density, velocity + x);
  } else {
    Node4<Real> nodes[W];
    store_nodes<Real, W>(ux, uy, uz, m.density, nodes);
    for (int l = 0; l < active; ++l) velocity[x + l] = nodes[l];
  }
}

}  // namespace detail

/// body(pack width, whole, x, active) for packs that cover begin .. end-1. A rest of half or a quarter of a
/// pack gets a pack of its size, any other rest a pack with idle lanes.
template <class Real, class Body>
HEMO_INLINE void for_packs(int begin, int end, Body&& body) {
  constexpr int W = lanes<Real>;
  using Yes = std::true_type;
  int x = begin;
  for (; x + W <= end; x += W) body(std::integral_constant<int, W>{}, Yes{}, x, W);
  const int rest = end - x;
  if (rest == 0) return;
  if constexpr (W >= 4) {
    if (rest == W / 2) return body(std::integral_constant<int, W / 2>{}, Yes{}, x, rest);
    if (rest == W / 4) return body(std::integral_constant<int, W / 4>{}, Yes{}, x, rest);
  }
  body(std::integral_constant<int, W>{}, std::false_type{}, x, rest);
}

/// Collides nodes begin .. end-1 of a row in place. \p force (of the node x = 0; may be null) is read up to
/// one pack beyond the last node: a field's halo planes lie there. \p outgoing gains the momentum that
/// populations carry towards the wall.
template <Wall wall, class Real>
void collide_run(const RowPointers<Real>& row, int begin, int end, const Node4<Real>* force,
                 const Force3<Real>& body, const Relaxation<Real>& rate, double (&outgoing)[3]) {
  for_packs<Real>(begin, end, [&](auto width, auto whole, int x, int active) HEMO_INLINE_LAMBDA {
    detail::collide_pack<wall, whole(), width()>(row, x, active, force, body, rate, outgoing);
  });
}

/// velocity += share force on \p nodes nodes: x, y and z; the fourth component of both is left alone.
template <class Real>
void add_share(const Node4<Real>* force, Real share, int nodes, Node4<Real>* velocity) {
  constexpr int W = lanes<Real>, nodes_per_pack = W / 4;
  int i = 0;
  if constexpr (nodes_per_pack > 0) {
    const Pack<Real, W> component([](auto l) { return Real(int(l) % 4); });
    const auto vector = component < Real(3);
    for (; i + nodes_per_pack <= nodes; i += nodes_per_pack) {
      auto u = load<Real, W>(&velocity[i].x);
      where(vector, u) += share * load<Real, W>(&force[i].x);
      store<Real, W>(u, &velocity[i].x);
    }
  }
  for (; i < nodes; ++i) {
    velocity[i].x += share * force[i].x, velocity[i].y += share * force[i].y,
        velocity[i].z += share * force[i].z;
  }
}

/// u* and rho - 1 of nodes begin .. end-1 of a row.
template <Wall wall, class Real>
void moments_run(const RowPointers<Real>& row, int begin, int end, Node4<Real>* velocity) {
  for_packs<Real>(begin, end, [&](auto width, auto whole, int x, int active) HEMO_INLINE_LAMBDA {
    detail::moments_pack<wall, whole(), width()>(row, x, active, velocity);
  });
}

}  // namespace hemowalk::lbm
