#pragma once
/// \file Gaps to the walls that enclose the fluid.

#include "resolved/contact/contact.hpp"
#include "resolved/contact/geometry.hpp"

namespace hemowalk::contact {

template <class T>
struct WallGap {
  T gap;            ///< dx, negative beyond the wall
  Point<T> normal;  ///< into the fluid
  int wall;         ///< 0 lower (or tube), 1 upper
};

/// Gap of a point, given relative to a body's origin, to the nearest wall.
template <class T>
class WallGaps {
 public:
  HEMO_HD WallGaps(const Walls& walls, const Origin& origin)
      : geometry_(walls.geometry),
        lower_(static_cast<T>(walls.lower - origin[1])),
        upper_(static_cast<T>(walls.upper - origin[1])),
        x_(static_cast<T>(walls.x - origin[0])),
        y_(static_cast<T>(walls.y - origin[1])),
        radius_(static_cast<T>(walls.radius)),
        distance_(walls.distance),
        nodes_(walls.nodes),
        scale_(walls.scale),
        origin_{origin[0], origin[1], origin[2] + walls.first_plane} {}

  HEMO_HD WallGap<T> operator()(const Point<T>& p) const {
    if (geometry_ == Walls::Geometry::slab) {
      const T below = p.y - lower_, above = upper_ - p.y;
      return below <= above ? WallGap<T>{below, {T(0), T(1), T(0)}, 0}
                            : WallGap<T>{above, {T(0), T(-1), T(0)}, 1};
    }
    if (geometry_ == Walls::Geometry::surface) return of_surface(p);
    using std::sqrt;
    const T dx = p.x - x_, dy = p.y - y_, r = sqrt(dx * dx + dy * dy);
    const T inverse = r > T(0) ? T(1) / r : T(0);
    return {radius_ - r, {-dx * inverse, -dy * inverse, T(0)}, 0};
  }

 private:
  /// Trilinear interpolation of the distance and its gradient.
  HEMO_HD WallGap<T> of_surface(const Point<T>& p) const {
    using std::floor;
    const T x[3] = {p.x, p.y, p.z};
    int node[3][2];
    T weight[3][2];
    for (int d = 0; d < 3; ++d) {
      const double at = (origin_[d] + static_cast<double>(x[d])) * scale_ - 0.5, whole = floor(at);
      weight[d][1] = static_cast<T>(at - whole), weight[d][0] = T(1) - weight[d][1];
      for (int s = 0; s < 2; ++s) {
        const int i = (static_cast<int>(whole) + s) % nodes_[d];
        node[d][s] = i < 0 ? i + nodes_[d] : i;
      }
    }
    T gap = 0, slope[3] = {};
    for (int c = 0; c < 8; ++c) {
      const int a = c & 1, b = c >> 1 & 1, e = c >> 2;
      const T v = static_cast<T>(
          distance_[(static_cast<std::size_t>(node[2][e]) * nodes_[1] + node[1][b]) * nodes_[0] +
                    node[0][a]]);
      gap += weight[0][a] * weight[1][b] * weight[2][e] * v;
      slope[0] += (a ? v : -v) * weight[1][b] * weight[2][e];
      slope[1] += weight[0][a] * (b ? v : -v) * weight[2][e];
      slope[2] += weight[0][a] * weight[1][b] * (e ? v : -v);
    }
    return {gap / static_cast<T>(scale_), {slope[0], slope[1], slope[2]}, 0};
  }

  Walls::Geometry geometry_;
  T lower_, upper_, x_, y_, radius_;
  const float* distance_;
  std::array<int, 3> nodes_;
  double scale_;
  Origin origin_;
};

}  // namespace hemowalk::contact
