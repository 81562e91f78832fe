#pragma once
/// \file Kernels of contact on the device: who is near whom (rarely), and forces (every step). What a contact
/// does is geometry.hpp, law.hpp, walls.hpp and surface_normal.hpp; contact::Contact is the definition of
/// right.
///
/// Forces and their reactions meet from many threads. They are added as 64-bit integers (multiples of 2^-46):
/// such a sum does not depend on the order, and what a vertex gains its triangle loses to the last bit.

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/block.hpp"
#include "core/device.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/contact/geometry.hpp"
#include "resolved/contact/law.hpp"
#include "resolved/contact/surface_normal.hpp"
#include "resolved/contact/walls.hpp"

namespace hemowalk::contact {

inline constexpr double force_grain = 1.0 / (std::int64_t{1} << 46);
HEMO_HD inline std::int64_t to_grains(double force) {
  return static_cast<std::int64_t>(std::llrint(force / force_grain));
}

struct Triangle3 {
  std::uint32_t corner[3];
  HEMO_HD std::uint32_t operator[](int k) const { return corner[k]; }
};

/// One shape's part of the tables.
struct Surface {
  const Triangle3* triangles;
  const std::uint32_t *ring_begin, *ring;
  const double* area;
  std::uint32_t vertices, count;  ///< of vertices, of triangles
};

/// A triangle that a vertex may meet.
struct Near {
  std::uint32_t group;  ///< body and image: the nearest triangle of each group counts
  std::uint32_t triangle;
};

/// An integer that orders like the float.
HEMO_HD inline int ordered(float f) {
  int bits;
  std::memcpy(&bits, &f, sizeof bits);
  return bits >= 0 ? bits : bits ^ 0x7fffffff;
}
HEMO_HD inline float unordered(int bits) {
  bits = bits >= 0 ? bits : bits ^ 0x7fffffff;
  float f;
  std::memcpy(&f, &bits, sizeof f);
  return f;
}

/// Sums over all contacts; integers, so that any order will do.
struct Tally {
  std::int64_t wall_force[2][3];  ///< grains, of this step
  double wall_before[2][3];       ///< sum of the steps before it: in grains it would overflow
  std::int64_t energy;            ///< grains
  unsigned contacts, wall_contacts;
  int gap, wall_gap;  ///< smallest, as ordered bits
  unsigned searches;
  int overflow;      ///< minus the length of the longest list that did not fit; 0 = all fit
  int largest_edge;  ///< minus its square as ordered bits, while a search is on or when cells are torn

  HEMO_HD double longest_edge_squared() const { return static_cast<double>(unordered(-largest_edge)); }
};

/// Longest edge of a triangle, dx, that is searched for: half the smallest period that is allowed. Cells with
/// a longer one are torn: no physics is left, and each vertex would look at all others.
inline constexpr double torn_edge = 8;

/// What all kernels of contact see: bodies, their vertices, and lists. Slots are vertices of all bodies; a
/// body's vertices follow each other.
template <class Real>
struct Crowd {
  Law law;
  Domain domain;
  std::uint32_t slots;
  std::int32_t own;                    ///< bodies from this one on are neighbours' copies (see Body::owned)
  int capacity;                        ///< entries per slot
  const Surface* surface;              ///< [shape]
  const std::uint32_t *shape, *first;  ///< [body] shape, first slot
  const std::int32_t* body;            ///< [slot]
  const Origin* origin;                ///< [body]
  const Node4<Real>* local;            ///< [slot]
  Origin* reference_origin;            ///< [slot] at the last search
  Node4<Real>* reference;              ///< [slot]
  unsigned* stale;                     ///< someone has moved too far: search
  std::uint32_t* count;                ///< [slot] length of its list
  Near* near;                          ///< [entry][slot]
  std::int64_t* force;                 ///< [slot][3] grains
  const std::int64_t* load;            ///< [slot][3] grains: where the sum starts; null: zero
  Tally* tally;

  HEMO_HD static const std::int32_t* at(const Origin& o) { return reinterpret_cast<const std::int32_t*>(&o); }
  HEMO_HD Real reach() const { return static_cast<Real>(law.range > law.depth ? law.range : law.depth); }
  HEMO_HD double period(int d) const { return reinterpret_cast<const double*>(&domain.period)[d]; }

  /// Periods to take off a difference of positions.
  HEMO_HD int wraps(double difference, int d) const {
    const double p = period(d);
    return p > 0 ? static_cast<int>(std::floor(difference / p + 0.5)) : 0;
  }
  /// Origin of body \p to as seen from body \p from, in the image shifted by minus \p wraps periods.
  HEMO_HD Point<Real> shift(std::int32_t from, std::int32_t to, const int (&wraps)[3]) const {
    Real s[3];
    for (int d = 0; d < 3; ++d)
      s[d] = static_cast<Real>(at(origin[to])[d] - at(origin[from])[d] - wraps[d] * period(d));
    return {s[0], s[1], s[2]};
  }
  HEMO_HD Point<Real> point(std::uint32_t slot) const {
    return {local[slot].x, local[slot].y, local[slot].z};
  }
  /// Image of body \p to nearest to a point of body \p from, judged by slot \p other.
  HEMO_HD void image(std::uint32_t slot, std::uint32_t other, int (&w)[3]) const {
    const std::int32_t from = body[slot], to = body[other];
    const Point<Real> p = point(slot), q = point(other);
    const double d[3] = {static_cast<double>(q.x - p.x), static_cast<double>(q.y - p.y),
                         static_cast<double>(q.z - p.z)};
    for (int k = 0; k < 3; ++k) w[k] = wraps(at(origin[to])[k] - at(origin[from])[k] + d[k], k);
  }
};

/// Starts the sums and asks for a search when a vertex has moved by half the skin since the last one.
template <class Real>
struct StartForces {
  Crowd<Real> s;
  HEMO_HD void operator()(std::size_t i) const {
    if (i == 0) {
      Tally& t = *s.tally;
      for (int w = 0; w < 2; ++w)
        for (int d = 0; d < 3; ++d) {
          t.wall_before[w][d] += force_grain * static_cast<double>(t.wall_force[w][d]);
          t.wall_force[w][d] = 0;
        }
      t.energy = 0, t.contacts = 0, t.wall_contacts = 0;
      t.gap = ordered(1e30f), t.wall_gap = ordered(1e30f);
    }
    for (int d = 0; d < 3; ++d)
      s.force[3 * i + static_cast<std::size_t>(d)] = s.load ? s.load[3 * i + static_cast<std::size_t>(d)] : 0;
    const std::int32_t b = s.body[i];
    const Node4<Real> now = s.local[i], then = s.reference[i];
    const double d[3] = {static_cast<double>(now.x - then.x), static_cast<double>(now.y - then.y),
                         static_cast<double>(now.z - then.z)};
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      double m = Crowd<Real>::at(s.origin[b])[k] - Crowd<Real>::at(s.reference_origin[i])[k] + d[k];
      m -= s.wraps(m, k) * s.period(k);
      square += m * m;
    }
    if (!(square <= 0.25 * s.law.skin * s.law.skin)) *s.stale = 1;  // all who write write the same
  }
};

/// Longest edge of all triangles, when a search is due: one thread per slot, its ring.
template <class Real>
struct MeasureEdges {
  Crowd<Real> s;
  HEMO_HD void operator()(std::size_t i) const {
    if (*s.stale == 0) return;
    const std::int32_t b = s.body[i];
    const Surface& surface = s.surface[s.shape[b]];
    const std::uint32_t first = s.first[b], v = static_cast<std::uint32_t>(i) - first;
    Real longest = 0;
    for (std::uint32_t r = surface.ring_begin[v]; r < surface.ring_begin[v + 1]; ++r)
      for (int k = 0; k < 3; ++k) {
        const Point<Real> e =
            s.point(first + surface.triangles[surface.ring[r]][k]) - s.point(static_cast<std::uint32_t>(i));
        const Real square = dot(e, e);
        longest = square > longest ? square : longest;
      }
    atomic_min(&s.tally->largest_edge, -ordered(static_cast<float>(longest)));  // of minus: the largest
  }
};

/// Bins of the markers (ibm), as far as a search needs them; filled by who knows both.
struct BinView {
  Block block;
  bool walls_y;
  int beyond;                   ///< nodes with bins below and above a block divided along z; 0: periodic
  int edge, x, y, z;            ///< nodes per bin, bins along the axes
  const std::uint32_t* begin;   ///< [bins + 1]
  const std::uint32_t* listed;  ///< slots by bin
  double slack;                 ///< how far a slot's bin may be from its vertex, dx
};

/// Lists the triangles of other bodies within reach + skin of each vertex, when a search is due. A triangle
/// is found through its corner nearest to the vertex, which is no farther than sqrt(d^2 + edge^2/3).
template <class Real>
struct FindNear {
  Crowd<Real> s;
  BinView bins;

  /// Cells that blow up may be anywhere.
  HEMO_HD static int node(double x) {
    return static_cast<int>(std::floor(std::fmin(std::fmax(x, -1e9), 1e9)));
  }
  /// Nodes of an axis to look at: one or two stretches within [lowest, n).
  struct Stretches {
    int first[2], last[2], count;
  };
  HEMO_HD static Stretches stretches(double low, double high, int n, bool periodic, int edge) {
    int lo = node(low), hi = node(high);
    if (!periodic) return {{lo > -1 ? lo : -1, 0}, {hi < n - 1 ? hi : n - 1, 0}, 1};
    if (hi - lo + 1 + 2 * edge >= n) return {{0, 0}, {n - 1, 0}, 1};
    const int around = static_cast<int>(std::floor(static_cast<double>(lo) / n)) * n;
    lo -= around, hi -= around;
    if (hi < n) return {{lo, 0}, {hi, 0}, 1};
    return {{lo, 0}, {n - 1, hi - n}, 2};
  }

  /// Along z on a divided block, counted from the first node with a bin: what lies beyond the bins is in the
  /// outermost ones.
  HEMO_HD Stretches along_divided_z(double low, double high) const {
    const int last = bins.block.nz + 2 * bins.beyond - 1;
    const auto clamp = [last, this](double z) {
      const int k = node(z) + bins.beyond;
      return k < 0 ? 0 : k > last ? last : k;
    };
    return {{clamp(low), 0}, {clamp(high), 0}, 1};
  }

  HEMO_HD void operator()(std::size_t index) const {
    if (*s.stale == 0) return;
    const auto me = static_cast<std::uint32_t>(index);
    const std::int32_t b = s.body[me];
    s.reference[me] = s.local[me];
    s.reference_origin[me] = s.origin[b];
    const Point<Real> p = s.point(me);
    const double edge2 = s.tally->longest_edge_squared();
    if (edge2 > torn_edge * torn_edge) {
      s.count[me] = 0;
      return;
    }
    const double within = static_cast<double>(s.reach()) + s.law.skin,
                 radius = std::sqrt(within * within + edge2 / 3) + 1e-3;
    const double reach = radius + bins.slack + 0.5;
    const std::int32_t* o = Crowd<Real>::at(s.origin[b]);
    const double x[3] = {o[0] + static_cast<double>(p.x), o[1] + static_cast<double>(p.y),
                         o[2] + static_cast<double>(p.z)};
    const Block& block = bins.block;
    const Stretches sx = stretches(x[0] - 0.5 - reach, x[0] + reach, block.nx, true, bins.edge),
                    sy = stretches(x[1] - 0.5 - reach, x[1] + reach, block.ny, !bins.walls_y, bins.edge),
                    sz = bins.beyond ? along_divided_z(x[2] - 0.5 - reach, x[2] + reach)
                                     : stretches(x[2] - 0.5 - reach, x[2] + reach, block.nz, true, bins.edge);
    std::uint32_t found = 0;
    const int off = bins.walls_y ? 1 : 0;
    for (int c = 0; c < sz.count; ++c)
      for (int bz = sz.first[c] / bins.edge; bz <= sz.last[c] / bins.edge; ++bz)
        for (int d = 0; d < sy.count; ++d)
          for (int by = (sy.first[d] + off) / bins.edge; by <= (sy.last[d] + off) / bins.edge; ++by)
            for (int e = 0; e < sx.count; ++e) {
              const int row = (bz * bins.y + by) * bins.x;
              for (std::uint32_t i = bins.begin[row + sx.first[e] / bins.edge];
                   i < bins.begin[row + sx.last[e] / bins.edge + 1]; ++i)
                look(me, bins.listed[i], static_cast<Real>(radius * radius),
                     static_cast<Real>(within * within), found);
            }
    if (found > static_cast<std::uint32_t>(s.capacity)) {
      atomic_min(&s.tally->overflow, -static_cast<int>(found));
      found = static_cast<std::uint32_t>(s.capacity);
    }
    s.count[me] = found;
    sort(me, found);
  }

  HEMO_HD void look(std::uint32_t me, std::uint32_t other, Real radius2, Real within2,
                    std::uint32_t& found) const {
    const std::int32_t mine = s.body[me], theirs = s.body[other];
    if (mine >= s.own && theirs >= s.own) return;  // their own ranks see to that
    int w[3];
    s.image(me, other, w);
    if (theirs == mine && w[0] == 0 && w[1] == 0 && w[2] == 0) return;
    const Point<Real> p = s.point(me) - s.shift(mine, theirs, w), q = s.point(other) - p;
    const Real corner2 = dot(q, q);
    if (corner2 > radius2) return;
    const Surface& surface = s.surface[s.shape[theirs]];
    const std::uint32_t first = s.first[theirs], v = other - first;
    for (std::uint32_t r = surface.ring_begin[v]; r < surface.ring_begin[v + 1]; ++r) {
      const std::uint32_t t = surface.ring[r];
      const Triangle3 c = surface.triangles[t];
      Point<Real> x[3];
      bool nearest =
          true;  // a triangle may be listed by two corners that are equally near: that does no harm
      for (int k = 0; k < 3; ++k) {
        x[k] = s.point(first + c[k]);
        const Point<Real> e = x[k] - p;
        const Real d2 = dot(e, e);
        nearest = nearest && !(d2 < Real(0.9999) * corner2);
      }
      if (!nearest || nearest_on_triangle(p, x[0], x[1], x[2]).squared > within2) continue;
      if (found < static_cast<std::uint32_t>(s.capacity))
        s.near[static_cast<std::size_t>(found) * s.slots + me] = {group(theirs, w), t};
      ++found;
    }
  }
  /// Images are told apart by their last bits.
  HEMO_HD static std::uint32_t group(std::int32_t body, const int (&w)[3]) {
    return static_cast<std::uint32_t>(body) << 6 |
           static_cast<std::uint32_t>((w[0] & 3) | (w[1] & 3) << 2 | (w[2] & 3) << 4);
  }

  /// By group, then triangle: what is summed in floating point has one order, and groups are in one piece.
  HEMO_HD void sort(std::uint32_t me, std::uint32_t n) const {
    Near* list = s.near + me;
    const std::size_t stride = s.slots;
    for (std::uint32_t i = 1; i < n; ++i) {
      const Near here = list[i * stride];
      std::uint32_t j = i;
      for (; j > 0; --j) {
        const Near before = list[(j - 1) * stride];
        if (before.group < here.group || (before.group == here.group && before.triangle <= here.triangle))
          break;
        list[j * stride] = before;
      }
      list[j * stride] = here;
    }
  }
};

/// Forces of walls and of near surfaces on each vertex, and the reactions.
template <class Real>
struct PressVertices {
  Crowd<Real> s;

  HEMO_HD void operator()(std::size_t index) const {
    const auto me = static_cast<std::uint32_t>(index);
    if (me == 0 && *s.stale != 0) {
      *s.stale = 0;
      if (s.tally->longest_edge_squared() <= torn_edge * torn_edge) s.tally->largest_edge = 0;
      ++s.tally->searches;
    }
    press_wall(me);
    const std::uint32_t n = s.count[me];
    Nearest<Real> best{};
    std::uint32_t triangle = 0, other = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const Near here = s.near[static_cast<std::size_t>(i) * s.slots + me];
      const bool fresh = i == 0 || here.group != s.near[static_cast<std::size_t>(i - 1) * s.slots + me].group;
      if (fresh && i > 0) press(me, other, triangle, best);
      const auto target = static_cast<std::int32_t>(here.group >> 6);
      const Surface& surface = s.surface[s.shape[target]];
      const Triangle3 c = surface.triangles[here.triangle];
      const std::uint32_t first = s.first[target];
      const Point<Real> p = seen_from(me, first + c[0]);
      const Nearest<Real> q =
          nearest_on_triangle(p, s.point(first + c[0]), s.point(first + c[1]), s.point(first + c[2]));
      if (fresh || q.squared < best.squared)
        best = q, triangle = here.triangle, other = static_cast<std::uint32_t>(target);
    }
    if (n > 0) press(me, other, triangle, best);
  }

  /// My position relative to the origin of the body of \p slot.
  HEMO_HD Point<Real> seen_from(std::uint32_t me, std::uint32_t slot) const {
    int w[3];
    s.image(me, slot, w);
    return s.point(me) - s.shift(s.body[me], s.body[slot], w);
  }

  HEMO_HD void add(std::uint32_t slot, const std::int64_t (&f)[3]) const {
    for (int d = 0; d < 3; ++d) atomic_add(s.force + 3 * static_cast<std::size_t>(slot) + d, f[d]);
  }

  HEMO_HD void press(std::uint32_t me, std::uint32_t target, std::uint32_t t, Nearest<Real> q) const {
    const Surface& surface = s.surface[s.shape[target]];
    const std::uint32_t first = s.first[target];
    const Real limit = s.reach();
    if (q.squared > limit * limit) return;
    const Crowd<Real>& crowd = s;
    const auto at = [&crowd, first](std::uint32_t v) { return crowd.point(first + v); };
    const Point<Real> outward = surface_normal<Real>(surface, at, t, q.wb, q.wc);
    const Real distance = std::sqrt(q.squared), tiny = sizeof(Real) == 4 ? Real(1e-4) : Real(1e-9);
    const Real side = dot(q.to_point, outward) >= 0 ? Real(1) : Real(-1), gap = side * distance;
    if (gap >= Real(s.law.range) || gap < -Real(s.law.depth)) return;
    const Point<Real> normal = distance < tiny ? (Real(1) / std::sqrt(dot(outward, outward))) * outward
                                               : (side / distance) * q.to_point;
    const std::int32_t mine = s.body[me];
    const double area = s.surface[s.shape[mine]].area[me - s.first[mine]];
    const Potential<Real> potential{Real(s.law.range), Real(0.5 * s.law.stiffness * area)};
    const Point<Real> push = potential.force(gap) * normal;
    if (mine < s.own) {  // copies are counted where they live
      atomic_add(&s.tally->contacts, 1u);
      atomic_add(&s.tally->energy, to_grains(static_cast<double>(potential.energy(gap))));
    }
    atomic_min(&s.tally->gap, ordered(static_cast<float>(gap)));
    const Triangle3 c = surface.triangles[t];
    const Real part[3] = {push.x, push.y, push.z};
    std::int64_t whole[3], second[3], third[3], rest[3];
    for (int d = 0; d < 3; ++d) {
      whole[d] = to_grains(static_cast<double>(part[d]));
      second[d] = -to_grains(static_cast<double>(q.wb * part[d]));
      third[d] = -to_grains(static_cast<double>(q.wc * part[d]));
      rest[d] = -whole[d] - second[d] - third[d];  // nothing is lost
    }
    add(me, whole);
    add(first + c[0], rest), add(first + c[1], second), add(first + c[2], third);
  }

  HEMO_HD void press_wall(std::uint32_t me) const {
    if (s.domain.walls.geometry == Walls::Geometry::none) return;
    const std::int32_t b = s.body[me];
    if (b >= s.own) return;
    const WallGap<Real> wall = WallGaps<Real>(s.domain.walls, s.origin[b])(s.point(me));
    if (wall.gap >= Real(s.law.range)) return;
    const double area = s.surface[s.shape[b]].area[me - s.first[b]];
    const Potential<Real> potential{Real(s.law.range), Real(s.law.stiffness * area)};
    const Point<Real> push = potential.force(wall.gap) * wall.normal;
    const std::int64_t f[3] = {to_grains(static_cast<double>(push.x)), to_grains(static_cast<double>(push.y)),
                               to_grains(static_cast<double>(push.z))};
    add(me, f);
    Tally& t = *s.tally;
    for (int d = 0; d < 3; ++d) atomic_add(&t.wall_force[wall.wall][d], -f[d]);
    atomic_add(&t.energy, to_grains(static_cast<double>(potential.energy(wall.gap))));
    atomic_add(&t.wall_contacts, 1u);
    atomic_min(&t.wall_gap, ordered(static_cast<float>(wall.gap)));
  }
};

}  // namespace hemowalk::contact
