#pragma once
/// \file Kernels of the device markers: bin by node, interpolate, spread. No sum meets an atomic: markers are
/// counted with integer atomics and then put in the order of their numbers, and every node of the force field
/// is summed by one thread, in that order.
///
/// Bins are cubes of bin_edge nodes; "node" means the node left of a marker, wrapped into the period; along
/// an axis with walls it lies in [-1, n - 1]. The 4 x 4 x 4 kernel begins at node - 1. A block divided along
/// z has bins beyond its ends too, for markers that reach into it and for who looks for neighbours (contact);
/// what lies still farther shares the outermost bins.

#include "core/block.hpp"
#include "core/device.hpp"
#include "resolved/ibm/markers.hpp"
#include "resolved/ibm/site.hpp"

namespace hemowalk::ibm {

inline constexpr int bin_edge = 4;
/// A block of the spreading kernel owns a cube of tile_edge nodes. A thread owns the nodes that agree with it
/// modulo 4 along every axis: the kernel of any marker covers exactly one of them, so threads never meet.
inline constexpr int tile_edge = 8;

/// Bins and tiles of a block.
struct Bins {
  Block block;
  bool walls_y;
  int beyond;   ///< nodes with bins below and above a block that is divided along z; 0: periodic
  int x, y, z;  ///< bins along the axes
  int tiles_x, tiles_y, tiles_z;

  HEMO_HD static int ceil_div(int a, int b) { return (a + b - 1) / b; }
  HEMO_HD static Bins make(const Block& block, bool walls_y, bool divided_z) {
    Bins b{block, walls_y, divided_z ? 16 : 0, 0, 0, 0, 0, 0, 0};
    b.x = ceil_div(block.nx, bin_edge);
    b.y = ceil_div(block.ny + (walls_y ? 1 : 0), bin_edge);
    b.z = ceil_div(block.nz + 2 * b.beyond, bin_edge);
    b.tiles_x = ceil_div(block.nx, tile_edge);
    b.tiles_y = ceil_div(block.ny + (walls_y ? 4 : 0), tile_edge);
    b.tiles_z = ceil_div(block.nz, tile_edge);
    return b;
  }
  HEMO_HD std::size_t count() const {
    return static_cast<std::size_t>(x) * static_cast<std::size_t>(y) * static_cast<std::size_t>(z);
  }
  HEMO_HD std::size_t tiles() const {
    return static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y) *
           static_cast<std::size_t>(tiles_z);
  }
  HEMO_HD int bin_y(int node) const { return (node + (walls_y ? 1 : 0)) / bin_edge; }
  /// Node along z, wrapped or, on a divided block, at most a little beyond the bins: nothing reaches from
  /// there.
  HEMO_HD int node_z(int node) const {
    if (!beyond) return node < 0 || node >= block.nz ? ((node % block.nz) + block.nz) % block.nz : node;
    const int low = -2 * beyond, high = block.nz + 2 * beyond;
    return node < low ? low : node > high ? high : node;
  }
  HEMO_HD int bin_z(int node) const {
    const int k = node + beyond, last = block.nz + 2 * beyond - 1;
    return (k < 0 ? 0 : k > last ? last : k) / bin_edge;
  }
  HEMO_HD std::uint32_t bin(int i, int by, int bz) const {
    return static_cast<std::uint32_t>((bz * y + by) * x + i / bin_edge);
  }
  /// First node of a tile along y: two rows beyond a wall belong to tiles too, they hold the wall's share.
  HEMO_HD int tile_y(int t) const { return t * tile_edge - (walls_y ? 2 : 0); }
};

/// A marker on the lattice: lowest node of its kernel and the weights along the axes. One cache line of two
/// markers in single precision.
template <class Real>
struct alignas(16) Placed {
  Real x[4], y[4], z[4];
  std::int16_t i, j, k, unused;
  std::uint32_t marker, spare;
};

/// What is wrong with the markers; read by the host when it waits.
struct MarkerFault {
  int marker;  ///< lowest number of a marker that is not finite or lies outside the walls; or no_fault
};
inline constexpr int no_fault = 0x7fffffff;

template <class Real>
struct NodeOfMarker {
  int i, j, k;
  Real fx, fy, fz;
  bool good;
};

/// Node and fractions of origin + local, wrapped.
template <class Real>
HEMO_HD inline NodeOfMarker<Real> node_of_marker(const Bins& bins, const std::int32_t* origin,
                                                 const Node4<Real>& p) {
  const auto finite = [](Real v) { return v > Real(-1e6) && v < Real(1e6); };
  if (!(finite(p.x) && finite(p.y) && finite(p.z))) return {0, 0, 0, Real(0), Real(0), Real(0), false};
  const auto x = split(origin[0], p.x), y = split(origin[1], p.y), z = split(origin[2], p.z);
  const auto wrap = [](int i, int n) {
    const int r = i % n;
    return r < 0 ? r + n : r;
  };
  const bool inside = !bins.walls_y || (y.node >= -1 && y.node < bins.block.ny);
  return {wrap(x.node, bins.block.nx),
          bins.walls_y ? (inside ? y.node : 0) : wrap(y.node, bins.block.ny),
          bins.node_z(z.node),
          x.fraction,
          y.fraction,
          z.fraction,
          inside};
}

/// Counts the marker in its bin and remembers its (arbitrary) place in it.
template <class Real>
struct CountMarkers {
  Bins bins;
  const std::int32_t* body;    ///< [marker]
  const Origin* origin;        ///< [body]
  const Node4<Real>* site;     ///< [marker]
  std::uint32_t *count, *bin;  ///< [bin], [marker]
  std::uint32_t* place;        ///< [marker]
  MarkerFault* fault;

  HEMO_HD void operator()(std::size_t m) const {
    const auto at = node_of_marker(bins, reinterpret_cast<const std::int32_t*>(origin + body[m]), site[m]);
    if (!at.good) atomic_min(&fault->marker, static_cast<int>(m));
    bin[m] = bins.bin(at.i, bins.bin_y(at.j), bins.bin_z(at.k));
    place[m] = atomic_add(count + bin[m], 1);
  }
};

/// Exclusive sums of the counts, one block; the counts are cleared for the next step. begin has one entry
/// more.
struct ScanBins {
  static constexpr int threads = 1024, groups = 32;
  std::uint32_t bins;
  std::uint32_t *count, *begin;

  static constexpr std::size_t shared_bytes() { return (threads + groups + 1) * sizeof(std::uint32_t); }
  HEMO_HD int phases() const { return 4; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto* part = reinterpret_cast<std::uint32_t*>(shared);  // [threads], then [groups + 1]
    auto* group = part + threads;
    const std::uint32_t each = (bins + threads - 1) / threads, first = at.thread * each;
    const std::uint32_t last = first + each < bins ? first + each : bins;
    if (phase == 0) {
      std::uint32_t sum = 0;
      for (std::uint32_t b = first; b < last; ++b) sum += count[b];
      part[at.thread] = sum;
    } else if (phase == 1) {
      if (at.thread >= groups) return;
      std::uint32_t sum = 0;
      for (int t = 0; t < threads / groups; ++t) sum += part[at.thread * (threads / groups) + t];
      group[at.thread] = sum;
    } else if (phase == 2) {
      if (at.thread > 0) return;
      std::uint32_t sum = 0;
      for (int g = 0; g < groups; ++g) {
        const std::uint32_t here = group[g];
        group[g] = sum;
        sum += here;
      }
      begin[bins] = sum;
    } else {
      std::uint32_t sum = group[at.thread / (threads / groups)];
      for (std::uint32_t t = at.thread / (threads / groups) * (threads / groups); t < at.thread; ++t)
        sum += part[t];
      for (std::uint32_t b = first; b < last; ++b) {
        begin[b] = sum;
        sum += count[b];
        count[b] = 0;
      }
    }
  }
};

/// Markers by bin, in arbitrary order within it.
struct ListMarkers {
  const std::uint32_t *bin, *place, *begin;
  std::uint32_t* listed;
  HEMO_HD void operator()(std::size_t m) const {
    listed[begin[bin[m]] + place[m]] = static_cast<std::uint32_t>(m);
  }
};

/// Puts the markers of a bin in the order of their numbers and works out their weights.
template <class Real>
struct PlaceMarkers {
  Bins bins;
  Kernel kernel;
  const std::int32_t* body;
  const Origin* origin;
  const Node4<Real>* site;
  const std::uint32_t *bin, *begin, *listed;
  Placed<Real>* placed;

  HEMO_HD void operator()(std::size_t at) const {
    const std::uint32_t m = listed[at], b = bin[m];
    std::uint32_t rank = begin[b];
    for (std::uint32_t o = begin[b]; o < begin[b + 1]; ++o) rank += listed[o] < m;
    const auto node = node_of_marker(bins, reinterpret_cast<const std::int32_t*>(origin + body[m]), site[m]);
    const auto x = weights(kernel, node.fx), y = weights(kernel, node.fy), z = weights(kernel, node.fz);
    const Real on = node.good ? Real(1) : Real(0);  // a marker that blew up takes no part
    placed[rank] = {{x.w0 * on, x.w1 * on, x.w2 * on, x.w3 * on},
                    {y.w0, y.w1, y.w2, y.w3},
                    {z.w0, z.w1, z.w2, z.w3},
                    static_cast<std::int16_t>(node.i - 1),
                    static_cast<std::int16_t>(node.j - 1),
                    static_cast<std::int16_t>(node.k - 1),
                    0,
                    m,
                    0};
  }
};

/// out[m] = sum over nodes of phi(x - X_m) field(x); zero where the kernel lies beyond the field along z.
/// Four threads per marker, one per column of nodes along x: a warp reads whole rows of 64 bytes.
template <class Real>
struct Interpolate {
  static constexpr int threads = 128;
  Block block;
  std::uint32_t count;
  const Placed<Real>* placed;
  const Node4<Real>* field;
  Node4<Real>* out;

  static constexpr std::size_t shared_bytes() { return threads * sizeof(Node4<Real>); }
  HEMO_HD int phases() const { return 2; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto* part = reinterpret_cast<Node4<Real>*>(shared);
    const std::uint32_t p = (at.block * threads + at.thread) / 4, a = at.thread % 4;
    if (p >= count) return;
    const Placed<Real>& m = placed[p];
    if (phase == 0) {
      if (m.k < -Block::halo || m.k + 4 > block.nz + Block::halo) {
        part[at.thread] = {Real(0), Real(0), Real(0), Real(0)};
        return;
      }
      const std::size_t row = block.row(), plane = block.plane();
      const Node4<Real>* base = field + block.at(m.i, m.j, m.k) + a;
      Node4<Real> sum{Real(0), Real(0), Real(0), Real(0)};
      for (int c = 0; c < 4; ++c)
        for (int b = 0; b < 4; ++b) {
          const Node4<Real> u = base[static_cast<std::size_t>(c) * plane + static_cast<std::size_t>(b) * row];
          const Real w = m.y[b] * m.z[c];
          sum.x += w * u.x, sum.y += w * u.y, sum.z += w * u.z, sum.w += w * u.w;
        }
      const Real w = m.x[a];
      part[at.thread] = {w * sum.x, w * sum.y, w * sum.z, w * sum.w};
    } else if (a == 0) {
      const Node4<Real>* q = part + at.thread;
      out[m.marker] = {(q[0].x + q[1].x) + (q[2].x + q[3].x), (q[0].y + q[1].y) + (q[2].y + q[3].y),
                       (q[0].z + q[1].z) + (q[2].z + q[3].z), (q[0].w + q[1].w) + (q[2].w + q[3].w)};
    }
  }
};

/// field(x) = sum over markers of phi(x - X_m) value[m], for every interior node and, with walls, two rows
/// beyond each: the whole field is written, nothing has to be cleared or folded.
template <class Real>
struct Spread {
  static constexpr int threads = 64, slots = 8;
  Bins bins;
  const std::uint32_t* begin;
  const Placed<Real>* placed;
  const Node4<Real>* value;
  Node4<Real>* field;

  static constexpr std::size_t shared_bytes() { return sizeof(Real) * 3 * slots * threads; }
  HEMO_HD int phases() const { return 1; }

  /// Kernel bases from which a node of [low, low + tile_edge) is reached, seen in the image shifted by \p
  /// shift, as a range of nodes in [lowest, n): may be empty.
  struct Range {
    int first, last;
  };
  HEMO_HD static Range nodes(int low, int shift, int lowest, int n) {
    const int first = low - 2 - shift, last = low + tile_edge - shift;
    return {first > lowest ? first : lowest, last < n - 1 ? last : n - 1};
  }

  HEMO_HD void operator()(int, BlockThread at, unsigned char* shared) const {
    Real* sum = reinterpret_cast<Real*>(shared) + at.thread;  // [slot][component], stride threads
    for (int s = 0; s < 3 * slots; ++s) sum[s * threads] = Real(0);
    const int t = static_cast<int>(at.block), me = static_cast<int>(at.thread);
    const int i0 = t % bins.tiles_x * tile_edge, j0 = bins.tile_y(t / bins.tiles_x % bins.tiles_y),
              k0 = t / bins.tiles_x / bins.tiles_y * tile_edge;
    const Block& block = bins.block;
    for (int sz = bins.beyond ? 0 : -block.nz; sz <= (bins.beyond ? 0 : block.nz); sz += block.nz) {
      const Range z = nodes(k0, sz, -bins.beyond, block.nz + bins.beyond);
      if (z.first > z.last) continue;
      for (int bz = bins.bin_z(z.first); bz <= bins.bin_z(z.last); ++bz)
        for (int sy = bins.walls_y ? 0 : -block.ny; sy <= (bins.walls_y ? 0 : block.ny); sy += block.ny) {
          const Range y = nodes(j0, sy, bins.walls_y ? -1 : 0, block.ny);
          if (y.first > y.last) continue;
          for (int by = bins.bin_y(y.first); by <= bins.bin_y(y.last); ++by)
            for (int sx = -block.nx; sx <= block.nx; sx += block.nx) {
              const Range x = nodes(i0, sx, 0, block.nx);
              if (x.first > x.last) continue;
              const int row = (bz * bins.y + by) * bins.x;
              add(begin[row + x.first / bin_edge], begin[row + x.last / bin_edge + 1], i0 - sx, j0 - sy,
                  k0 - sz, me, sum);
            }
        }
    }
    store(i0, j0, k0, me, sum);
  }

  /// Adds markers [first, last) to the nodes of thread \p me; (i0, j0, k0): the tile's corner as they see it.
  HEMO_HD void add(std::uint32_t first, std::uint32_t last, int i0, int j0, int k0, int me, Real* sum) const {
    const int a = me & 3, b = me >> 2 & 3, c = me >> 4;
    for (std::uint32_t p = first; p < last; ++p) {
      const Placed<Real>& m = placed[p];
      const int ri = m.i - i0, rj = m.j - j0, rk = m.k - k0;
      const int oi = (a - ri) & 3, oj = (b - rj) & 3, ok = (c - rk) & 3;  // which of the four weights
      const int i = ri + oi, j = rj + oj, k = rk + ok;                    // my node of this kernel
      if ((i | j | k) < 0 || i >= tile_edge || j >= tile_edge || k >= tile_edge) continue;
      const Real w = m.x[oi] * m.y[oj] * m.z[ok];
      const Node4<Real> v = value[m.marker];
      Real* mine = sum + ((i >> 2) + 2 * (j >> 2) + 4 * (k >> 2)) * 3 * threads;
      mine[0] += w * v.x;
      mine[threads] += w * v.y;
      mine[2 * threads] += w * v.z;
    }
  }

  HEMO_HD void store(int i0, int j0, int k0, int me, const Real* sum) const {
    const int a = me & 3, b = me >> 2 & 3, c = me >> 4;
    const Block& block = bins.block;
    for (int s = 0; s < slots; ++s) {
      const int i = i0 + a + 4 * (s & 1), j = j0 + b + 4 * (s >> 1 & 1), k = k0 + c + 4 * (s >> 2);
      if (i >= block.nx || k >= block.nz || j >= block.ny + (bins.walls_y ? 2 : 0)) continue;
      const Real* mine = sum + s * 3 * threads;
      field[block.at(i, j, k)] = {mine[0], mine[threads], mine[2 * threads], Real(0)};
    }
  }
};

/// Adds what fell beyond the walls to the sums since the start: one block per plane and wall, fixed order,
/// double precision.
template <class Real>
struct SumWallShare {
  static constexpr int threads = 64;
  Block block;
  double h;  ///< fluid steps in which the force acts
  const Node4<Real>* field;
  double* total;  ///< [2][nz][3]
  double* last;   ///< [2][nz][3] of this step

  static constexpr std::size_t shared_bytes() { return 3 * threads * sizeof(double); }
  HEMO_HD int phases() const { return 2; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto* part = reinterpret_cast<double*>(shared);
    const int wall = static_cast<int>(at.block) / block.nz, k = static_cast<int>(at.block) % block.nz;
    if (phase == 0) {
      double sum[3] = {0, 0, 0};
      for (int level = 0; level < 2; ++level)
        for (int i = static_cast<int>(at.thread); i < block.nx; i += threads) {
          const Node4<Real> F = field[block.at(i, wall == 0 ? -1 - level : block.ny + level, k)];
          sum[0] += static_cast<double>(F.x), sum[1] += static_cast<double>(F.y),
              sum[2] += static_cast<double>(F.z);
        }
      for (int d = 0; d < 3; ++d) part[d * threads + static_cast<int>(at.thread)] = sum[d];
      return;
    }
    if (at.thread >= 3) return;
    double sum = 0;
    for (int t = 0; t < threads; ++t) sum += part[static_cast<int>(at.thread) * threads + t];
    last[at.block * 3 + at.thread] = sum;
    total[at.block * 3 + at.thread] += h * sum;
  }
};

}  // namespace hemowalk::ibm
