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
        radius_(static_cast<T>(walls.radius)) {}

  HEMO_HD WallGap<T> operator()(const Point<T>& p) const {
    if (geometry_ == Walls::Geometry::slab) {
      const T below = p.y - lower_, above = upper_ - p.y;
      return below <= above ? WallGap<T>{below, {T(0), T(1), T(0)}, 0}
                            : WallGap<T>{above, {T(0), T(-1), T(0)}, 1};
    }
    using std::sqrt;
    const T dx = p.x - x_, dy = p.y - y_, r = sqrt(dx * dx + dy * dy);
    const T inverse = r > T(0) ? T(1) / r : T(0);
    return {radius_ - r, {-dx * inverse, -dy * inverse, T(0)}, 0};
  }

 private:
  Walls::Geometry geometry_;
  T lower_, upper_, x_, y_, radius_;
};

}  // namespace hemowalk::contact
