#include "resolved/contact/topology.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "core/check.hpp"

namespace hemowalk::contact {

Topology::Topology(const Shape& shape) : area(shape.area) {
  const std::size_t n = area.size();
  require(shape.triangles.size() % 3 == 0 && !shape.triangles.empty(),
          "contact: triangle list has " + std::to_string(shape.triangles.size()) +
              " numbers (three per triangle are needed) check the mesh");
  require(*std::min_element(area.begin(), area.end()) > 0,
          "contact: a vertex has no area (it belongs to no triangle) remove it from the mesh");
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t i = 0; i < shape.triangles.size(); i += 3) {
    const Corners c{shape.triangles[i], shape.triangles[i + 1], shape.triangles[i + 2]};
    for (int k = 0; k < 3; ++k) {
      require(c[k] < n, "contact: triangle refers to vertex " + std::to_string(c[k]) + " (the mesh has " +
                            std::to_string(n) + ") check the mesh");
      ++edges[{c[k], c[(k + 1) % 3]}];
    }
    triangles.push_back(c);
  }
  for (const auto& [edge, count] : edges)
    require(count == 1 && edges.count({edge.second, edge.first}),
            "contact: mesh is not closed at edge " + std::to_string(edge.first) + "-" +
                std::to_string(edge.second) + " (inside and outside need a closed, consistently oriented " +
                "surface) repair the mesh");
  ring_begin.assign(n + 1, 0);
  for (const Corners& c : triangles)
    for (const std::uint32_t v : c) ++ring_begin[v + 1];
  for (std::size_t v = 0; v < n; ++v) ring_begin[v + 1] += ring_begin[v];
  ring.resize(ring_begin[n]);
  std::vector<std::uint32_t> cursor(ring_begin.begin(), ring_begin.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t v : triangles[t]) ring[cursor[v]++] = t;
}

namespace {

template <class T>
Point<T> normal_of(const Topology& shape, const Point<T>* x, std::uint32_t t) {
  const Corners& c = shape.triangles[t];
  return unit_normal(x[c[0]], x[c[1]], x[c[2]]);
}

template <class T>
Point<T> vertex_normal(const Topology& shape, const Point<T>* x, std::uint32_t v) {
  Point<T> sum{0, 0, 0};
  for (std::uint32_t i = shape.ring_begin[v]; i < shape.ring_begin[v + 1]; ++i) {
    const Corners& c = shape.triangles[shape.ring[i]];
    const int k = c[0] == v ? 0 : c[1] == v ? 1 : 2;
    const Point<T> e = x[c[(k + 1) % 3]] - x[v], f = x[c[(k + 2) % 3]] - x[v];
    const Point<T> n = cross(e, f);
    const T sine = std::sqrt(dot(n, n));
    if (sine > 0) sum = sum + (std::atan2(sine, dot(e, f)) / sine) * n;
  }
  return sum;
}

template <class T>
Point<T> edge_normal(const Topology& shape, const Point<T>* x, std::uint32_t t, std::uint32_t v,
                     std::uint32_t w) {
  Point<T> sum = normal_of(shape, x, t);
  for (std::uint32_t i = shape.ring_begin[v]; i < shape.ring_begin[v + 1]; ++i) {
    const std::uint32_t other = shape.ring[i];
    const Corners& c = shape.triangles[other];
    if (other != t && (c[0] == w || c[1] == w || c[2] == w)) sum = sum + normal_of(shape, x, other);
  }
  return sum;
}

}  // namespace

template <class T>
Point<T> pseudo_normal(const Topology& shape, const Point<T>* x, std::uint32_t t, T wb, T wc) {
  const T zero = sizeof(T) == 4 ? T(1e-6) : T(1e-13);
  const T weight[3] = {T(1) - wb - wc, wb, wc};
  const Corners& c = shape.triangles[t];
  for (int k = 0; k < 3; ++k)
    if (weight[k] >= T(1) - zero) return vertex_normal(shape, x, c[k]);
  for (int k = 0; k < 3; ++k)
    if (weight[k] <= zero) return edge_normal(shape, x, t, c[(k + 1) % 3], c[(k + 2) % 3]);
  return normal_of(shape, x, t);
}

template Point<float> pseudo_normal(const Topology&, const Point<float>*, std::uint32_t, float, float);
template Point<double> pseudo_normal(const Topology&, const Point<double>*, std::uint32_t, double, double);

}  // namespace hemowalk::contact
