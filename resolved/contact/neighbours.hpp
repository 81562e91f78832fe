#pragma once
/// \file Neighbours: which vertices are near which triangles of other bodies, and for how long that list
/// holds.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "resolved/contact/contact.hpp"
#include "resolved/contact/grid.hpp"
#include "resolved/contact/topology.hpp"

namespace hemowalk::contact {

/// Vertices of all bodies, one body after another, relative to the body's origin.
template <class Real>
struct Cloud {
  std::vector<Body> bodies;
  std::vector<std::uint32_t> first;  ///< [bodies + 1] into x
  std::vector<Origin> origin;        ///< [bodies]
  std::vector<Point<Real>> x;

  std::size_t vertices(std::size_t b) const { return first[b + 1] - first[b]; }
};

/// A triangle that may be the nearest one.
struct Candidate {
  std::uint32_t triangle;
  float distance;  ///< at the time of the search, dx; never above the true one
};

/// A vertex near another body.
struct Entry {
  std::uint32_t vertex;             ///< of its body
  std::uint32_t candidates, count;  ///< stretch of the body's candidate list, nearest first
  float gap;                        ///< signed, at the time of the search, dx
};

/// A vertex pressed by a triangle of another body.
template <class Real>
struct Press {
  std::uint32_t triangle;
  Real wb, wc;
  Point<Real> force;  ///< on the vertex; minus this on the triangle
};

/// One body seen from another: entries and, after an evaluation, presses.
struct Link {
  std::uint32_t target;
  std::array<std::int32_t, 3> wraps;  ///< the target stands at its origin + wraps * period
  std::uint32_t entries_begin, entries_end;
  std::uint32_t presses_begin, presses_end;
};

/// What the vertices of one body have in reach.
template <class Real>
struct Neighbourhood {
  std::vector<Link> links;  ///< by target, then image
  std::vector<Entry> entries;
  std::vector<Candidate> candidates;
  std::vector<Press<Real>> presses;
};

/// How a body moved since the search: every vertex within `spread` of a shift by `mean`.
struct Motion {
  std::array<double, 3> mean;
  double spread;
};

/// Upper limit of how much the distance between points of two bodies has changed since the search.
inline double approach(const Motion& a, const Motion& b) {
  const double x = a.mean[0] - b.mean[0], y = a.mean[1] - b.mean[1], z = a.mean[2] - b.mean[2];
  return std::sqrt(x * x + y * y + z * z) + a.spread + b.spread;
}

/// Who looks at a body: link \p link of body \p body.
struct Incoming {
  std::uint32_t body, link;
};

template <class Real>
class Neighbours {
 public:
  Neighbours(const Law& law, const Domain& domain, const std::vector<Topology>& shapes)
      : law_(law),
        domain_(domain),
        shapes_(shapes),
        reach_(std::max(law.range, law.depth)),
        skin_(law.skin) {}

  /// Makes the lists hold for the positions in \p cloud: measures motions and searches again where needed.
  /// Moves origins by whole periods, to the images that the lists know.
  void update(Cloud<Real>& cloud);
  /// Positions of the last search, exactly. Sums depend on the order of candidates at that time, so a restart
  /// goes on from the same lists. Empty before the first search.
  std::vector<std::byte> save() const;
  /// Searches at the saved positions. \p cloud has the bodies and lends its memory. \throws InputError if
  /// they differ.
  void restore(View<const std::byte> state, Cloud<Real>& cloud);
  /// Forgets the lists: bodies changed.
  void reset() { valid_ = false; }
  void set_domain(const Domain& domain) { domain_ = domain, valid_ = false; }

  std::vector<Neighbourhood<Real>>& of() { return near_; }
  const std::vector<Motion>& motions() const { return motions_; }
  /// Links that point at body b: incoming()[incoming_begin()[b] .. incoming_begin()[b + 1]), by looking body.
  const std::vector<std::uint32_t>& incoming_begin() const { return incoming_begin_; }
  const std::vector<Incoming>& incoming() const { return incoming_; }
  std::int64_t searches() const { return searches_; }
  /// Upper limit of how much a vertex's distance to points of a body that moved by \p other has changed since
  /// the search.
  double moved(const Cloud<Real>& cloud, std::size_t body, std::uint32_t vertex, const Motion& other) const {
    const std::size_t i = cloud.first[body] + vertex;
    const Point<Real> d = cloud.x[i] - reference_[i];
    const auto& now = cloud.origin[body];
    const auto& then = reference_origin_[body];
    const double x = now[0] - then[0] + double(d.x) - other.mean[0],
                 y = now[1] - then[1] + double(d.y) - other.mean[1],
                 z = now[2] - then[2] + double(d.z) - other.mean[2];
    return std::sqrt(x * x + y * y + z * z) + other.spread;
  }
  /// Whether a body's bounding box, moved as the body did since the search, may reach beyond planes y = low,
  /// high.
  bool beyond(std::size_t b, double low, double high) const {
    const Motion& m = motions_[b];
    return boxes_[b].low[1] + m.mean[1] - m.spread < low || boxes_[b].high[1] + m.mean[1] + m.spread > high;
  }
  /// Origin of body \p to as seen from the origin of body \p from, in the image \p wraps.
  Point<Real> shift(const Cloud<Real>& cloud, std::uint32_t from, std::uint32_t to,
                    const std::array<std::int32_t, 3>& wraps) const;

 private:
  static constexpr double far_ = 6;  ///< dx beyond the skin within which pairs of bodies are watched

  /// Bounding box, absolute coordinates.
  struct Box {
    std::array<double, 3> low, high;
  };
  struct Hit {
    std::uint32_t triangle;
    float distance;
  };
  /// Points or spheres side by side, room for whole packs.
  struct Stretch {
    std::vector<float> x, y, z, r;
    std::vector<std::uint32_t> number;
    std::size_t count = 0;

    void start(std::size_t most);
    void add(float px, float py, float pz, float pr, std::uint32_t n) {
      x[count] = px, y[count] = py, z[count] = pz, r[count] = pr, number[count++] = n;
    }
    void pad();  ///< fills the last pack with points that are far from everything
  };
  struct Scratch {                             ///< of one thread
    Stretch vertices, triangles;               ///< of the looking and the other body, near each other
    std::vector<Hit> hits;                     ///< of one vertex
    std::array<std::vector<float>, 9> corner;  ///< of the hits' triangles, relative to the vertex
  };

  template <class Place>
  void choose_images(Cloud<Real>& cloud, const Place& place) const;
  bool holds(const Cloud<Real>& cloud);
  void search(const Cloud<Real>& cloud);
  void bound(const Cloud<Real>& cloud, std::size_t body);
  void pair_bodies(const Cloud<Real>& cloud);
  void look_around(const Cloud<Real>& cloud, std::uint32_t body, Scratch& scratch);
  void look_at(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target,
               const std::array<std::int32_t, 3>& wraps, Scratch& scratch);
  bool select(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target, const Point<Real>& shift,
              Scratch& scratch) const;
  void find_hits(const Cloud<Real>& cloud, std::uint32_t target, const Point<Real>& p, std::size_t vertex,
                 Scratch& scratch) const;
  void measure_hits(Scratch& scratch) const;
  void take_entry(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target, const Point<Real>& p,
                  std::uint32_t vertex, Scratch& scratch);
  void collect_incoming(std::size_t bodies);

  Law law_;
  Domain domain_;
  const std::vector<Topology>& shapes_;
  double reach_, skin_;  ///< largest unsigned distance of interest; list margin
  bool valid_ = false;
  std::int64_t searches_ = 0;

  std::vector<Point<Real>> reference_;  ///< positions at the search
  std::vector<Origin> reference_origin_;
  std::vector<Motion> motions_;
  std::vector<std::array<std::uint32_t, 2>> watched_;   ///< pairs of bodies that could meet before the rest
  std::vector<std::uint32_t> targets_begin_, targets_;  ///< per body: whom it may be near to, itself too
  std::vector<Neighbourhood<Real>> near_;
  std::vector<std::uint32_t> incoming_begin_;
  std::vector<Incoming> incoming_;

  std::vector<Box> boxes_;
  Grid grid_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> seen_;
  std::vector<std::uint32_t> spheres_begin_;  ///< [bodies + 1]
  /// Centroid of every triangle relative to its body's origin and radius of the sphere to search around it.
  std::vector<float> gx_, gy_, gz_, gr_;
  std::vector<Scratch> scratch_;
};

extern template class Neighbours<float>;
extern template class Neighbours<double>;

}  // namespace hemowalk::contact
