#pragma once
/// \file Topology: what contact needs to know of a closed triangle mesh besides its triangles.

#include <cstdint>
#include <vector>

#include "resolved/contact/contact.hpp"
#include "resolved/contact/geometry.hpp"

namespace hemowalk::contact {

using Corners = std::array<std::uint32_t, 3>;

struct Topology {
  std::vector<Corners> triangles;
  std::vector<double> area;               ///< [V] dx^2
  std::vector<std::uint32_t> ring_begin;  ///< [V + 1]
  std::vector<std::uint32_t> ring;        ///< triangles around each vertex

  /// \throws InputError when the mesh is not closed, two triangles run along an edge in the same direction,
  /// or areas are not positive.
  explicit Topology(const Shape& shape);
  std::size_t vertices() const { return area.size(); }
};

/// Outward direction at a surface point, such that its sign against p - q tells on which side p is: the
/// normal of the face, the sum of both normals on an edge, the angle-weighted sum at a vertex (Baerentzen &
/// Aanaes 2005). \p x: positions of the body's vertices; the point is on triangle \p t with weights wb, wc.
template <class T>
Point<T> pseudo_normal(const Topology& shape, const Point<T>* x, std::uint32_t t, T wb, T wc);

}  // namespace hemowalk::contact
