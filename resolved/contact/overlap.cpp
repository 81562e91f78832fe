#include <omp.h>

#include "core/simd.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/contact/geometry.hpp"
#include "resolved/contact/topology.hpp"
#include "resolved/contact/walls.hpp"

namespace hemowalk::contact {

namespace {

using Lanes = Pack<double, 8>;

/// A body's triangles side by side, ready for packs; the last pack repeats the last triangle.
struct Facets {
  std::vector<double> corner[3][3];  ///< [corner][axis]
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void set(const Topology& shape, const Point<double>* x) {
    const std::size_t n = shape.triangles.size(), padded = (n + 7) / 8 * 8;
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) corner[c][k].resize(padded);
    for (std::size_t t = 0; t < padded; ++t)
      for (int c = 0; c < 3; ++c) {
        const Point<double>& p = x[shape.triangles[std::min(t, n - 1)][c]];
        const double axis[3] = {p.x, p.y, p.z};
        for (int k = 0; k < 3; ++k) {
          corner[c][k][t] = axis[k];
          low[k] = std::min(low[k], axis[k]);
          high[k] = std::max(high[k], axis[k]);
        }
      }
  }
  Point<Lanes> load_corner(int c, std::size_t t) const {
    return {load<double, 8>(&corner[c][0][t]), load<double, 8>(&corner[c][1][t]),
            load<double, 8>(&corner[c][2][t])};
  }
  /// Nearest triangle of all, exactly.
  std::uint32_t nearest(const Point<double>& p, std::size_t triangles) const {
    const Point<Lanes> q{Lanes(p.x), Lanes(p.y), Lanes(p.z)};
    double best = 1e300;
    std::size_t where = 0;
    for (std::size_t t = 0; t < corner[0][0].size(); t += 8) {
      const Lanes d = nearest_on_triangle(q, load_corner(0, t), load_corner(1, t), load_corner(2, t)).squared;
      if (stdx::hmin(d) >= best) continue;
      for (std::size_t l = 0; l < 8; ++l)
        if (d[l] < best) best = d[l], where = t + l;
    }
    return static_cast<std::uint32_t>(std::min(where, triangles - 1));
  }
};

struct Measured {
  Facets facets;
  std::vector<Point<double>> x;  ///< absolute
  Overlap worst;
};

void merge(Overlap& into, const Overlap& part) {
  if (part.minimum_gap < into.minimum_gap)
    into.minimum_gap = part.minimum_gap, into.first = part.first, into.second = part.second;
  into.minimum_wall_gap = std::min(into.minimum_wall_gap, part.minimum_wall_gap);
  into.inside += part.inside;
  into.outside_walls += part.outside_walls;
}

}  // namespace

template <class Real>
Overlap measure_overlap(const Domain& domain, const std::vector<Shape>& shapes,
                        const std::vector<Body>& bodies, View<const Origin> origin,
                        View<const Node4<Real>> local, double within) {
  std::vector<Topology> topology;
  for (const Shape& shape : shapes) topology.emplace_back(shape);
  const auto count = static_cast<std::ptrdiff_t>(bodies.size());
  std::vector<Measured> all(bodies.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < count; ++b) {
    const Body& body = bodies[b];
    for (std::size_t v = 0; v < topology[body.shape].vertices(); ++v) {
      const Node4<Real>& p = local[body.first + v * body.stride];
      all[b].x.push_back(
          {origin[b][0] + double(p.x), origin[b][1] + double(p.y), origin[b][2] + double(p.z)});
    }
    all[b].facets.set(topology[body.shape], all[b].x.data());
  }
#pragma omp parallel for schedule(dynamic, 4)
  for (std::ptrdiff_t a = 0; a < count; ++a) {
    Measured& me = all[a];
    if (domain.walls.geometry != Walls::Geometry::none) {
      const WallGaps<double> walls(domain.walls, {0, 0, 0});
      for (const Point<double>& p : me.x) {
        const double gap = walls(p).gap;
        me.worst.minimum_wall_gap = std::min(me.worst.minimum_wall_gap, gap);
        me.worst.outside_walls += gap < 0;
      }
    }
    for (std::ptrdiff_t b = 0; b < count; ++b) {
      const Facets& other = all[b].facets;
      // Images of b whose box, grown by `within`, meets a's box.
      std::array<int, 3> first{}, last{};
      for (int k = 0; k < 3; ++k) {
        const double period = domain.period[k];
        const double below = me.facets.low[k] - other.high[k] - within,
                     above = me.facets.high[k] - other.low[k] + within;
        first[k] = period > 0 ? static_cast<int>(std::ceil(below / period)) : below <= 0 ? 0 : 1;
        last[k] = period > 0 ? static_cast<int>(std::floor(above / period)) : above >= 0 ? 0 : -1;
      }
      for (int i = first[0]; i <= last[0]; ++i)
        for (int j = first[1]; j <= last[1]; ++j)
          for (int k = first[2]; k <= last[2]; ++k) {
            if (a == b && i == 0 && j == 0 && k == 0) continue;
            const Point<double> shift{i * domain.period[0], j * domain.period[1], k * domain.period[2]};
            const Topology& shape = topology[bodies[b].shape];
            for (const Point<double>& v : me.x) {
              const Point<double> p = v - shift;
              if (p.x < other.low[0] - within || p.x > other.high[0] + within ||
                  p.y < other.low[1] - within || p.y > other.high[1] + within ||
                  p.z < other.low[2] - within || p.z > other.high[2] + within)
                continue;
              const std::uint32_t t = other.nearest(p, shape.triangles.size());
              const Corners& c = shape.triangles[t];
              const Point<double>* x = all[b].x.data();
              const auto q = nearest_on_triangle(p, x[c[0]], x[c[1]], x[c[2]]);
              const bool outside = dot(q.to_point, pseudo_normal(shape, x, t, q.wb, q.wc)) >= 0;
              const double gap = outside ? std::sqrt(q.squared) : -std::sqrt(q.squared);
              me.worst.inside += !outside;
              if (gap > within || gap >= me.worst.minimum_gap) continue;
              me.worst.minimum_gap = gap;
              me.worst.first = static_cast<std::int32_t>(a);
              me.worst.second = static_cast<std::int32_t>(b);
            }
          }
    }
  }
  Overlap result;
  for (const Measured& m : all) merge(result, m.worst);
  return result;
}

template Overlap measure_overlap(const Domain&, const std::vector<Shape>&, const std::vector<Body>&,
                                 View<const Origin>, View<const Node4<float>>, double);
template Overlap measure_overlap(const Domain&, const std::vector<Shape>&, const std::vector<Body>&,
                                 View<const Origin>, View<const Node4<double>>, double);

}  // namespace hemowalk::contact
