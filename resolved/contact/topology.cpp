#include "resolved/contact/topology.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "core/check.hpp"
#include "resolved/contact/surface_normal.hpp"

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

template <class T>
Point<T> pseudo_normal(const Topology& shape, const Point<T>* x, std::uint32_t t, T wb, T wc) {
  const auto at = [x](std::uint32_t v) { return x[v]; };
  return surface_normal<T>(shape, at, t, wb, wc);
}

template Point<float> pseudo_normal(const Topology&, const Point<float>*, std::uint32_t, float, float);
template Point<double> pseudo_normal(const Topology&, const Point<double>*, std::uint32_t, double, double);

}  // namespace hemowalk::contact
