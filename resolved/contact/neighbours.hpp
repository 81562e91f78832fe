#pragma once
/// \file Neighbours: which vertices are near which triangles of other bodies, and for how long that list
/// holds.

#include <algorithm>
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
  void update(const Cloud<Real>& cloud);
  /// Forgets the lists: bodies changed.
  void reset() { valid_ = false; }

  std::vector<Neighbourhood<Real>>& of() { return near_; }
  const std::vector<Motion>& motions() const { return motions_; }
  /// Links that point at body \p b: [incoming_begin(b), incoming_begin(b + 1)), by looking body.
  const std::vector<std::uint32_t>& incoming_begin() const { return incoming_begin_; }
  const std::vector<Incoming>& incoming() const { return incoming_; }
  std::int64_t searches() const { return searches_; }
  /// Origin of body \p to as seen from the origin of body \p from, in the image \p wraps.
  Point<Real> shift(const Cloud<Real>& cloud, std::uint32_t from, std::uint32_t to,
                    const std::array<std::int32_t, 3>& wraps) const;

 private:
  static constexpr double far_ =
      6;  ///< dx beyond the skin within which pairs of bodies are watched one by one

  struct Hit {
    std::uint64_t key;  ///< target and image
    std::uint32_t triangle;
    float distance;
  };
  struct Found {
    std::uint64_t key;
    Entry entry;
  };
  struct Scratch {  ///< of one thread
    std::vector<Hit> hits;
    std::array<std::vector<float>, 9> corner;  ///< of the hits' triangles, relative to the vertex
    std::vector<Found> found;
    std::vector<Candidate> candidates;
    std::uint64_t link_key = 0;
  };

  bool holds(const Cloud<Real>& cloud);
  void search(const Cloud<Real>& cloud);
  void sort_triangles(const Cloud<Real>& cloud);
  void pair_bodies(const Cloud<Real>& cloud);
  void look_around(const Cloud<Real>& cloud, std::uint32_t body, Scratch& scratch);
  void find_triangles(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t vertex, Scratch& scratch);
  void measure_hits(Scratch& scratch);
  std::array<std::int32_t, 3> absolute(std::uint32_t from, std::uint64_t key) const;
  void take_entries(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t vertex, Scratch& scratch);
  void link_up(std::uint32_t body, Scratch& scratch);
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
  std::vector<std::array<std::uint32_t, 2>> watched_;  ///< pairs of bodies that could meet before the rest
  std::vector<Neighbourhood<Real>> near_;
  std::vector<std::uint32_t> incoming_begin_;
  std::vector<Incoming> incoming_;

  Grid grid_, body_grid_;
  std::vector<std::uint32_t> triangles_begin_;  ///< [bodies + 1]
  std::vector<Slot> slots_, body_slots_;
  std::vector<float> radius_;                         ///< of triangles about their centroid, before sorting
  std::vector<std::array<double, 3>> centre_, half_;  ///< of the bodies' bounding boxes
  std::vector<std::uint32_t> seen_;
  std::vector<std::uint8_t> meets_itself_;  ///< [bodies] its own image is near
  /// Triangles in cell order: centroid in the box, radius of the search sphere, body, number, wraps.
  std::vector<float> cx_, cy_, cz_, cr_;
  std::vector<float> cmark_;  ///< the body again, as a number that packs compare (exact below 2^24 bodies)
  std::vector<std::uint32_t> cbody_, ctriangle_;
  std::vector<std::array<std::int8_t, 4>> cwraps_;
  std::vector<Scratch> scratch_;
};

extern template class Neighbours<float>;
extern template class Neighbours<double>;

}  // namespace hemowalk::contact
