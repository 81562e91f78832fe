#pragma once
/// \file Shape: what all rigid bodies of a type share.

#include <vector>

#include "resolved/rigid/motion.hpp"
#include "resolved/rigid/rigid.hpp"

namespace hemowalk::rigid {

/// Arms from the metric's centre in the body frame; inertia of the held points about it.
struct Shape {
  explicit Shape(const BodyType& type);

  std::vector<Vec3> arm, held, normal;  ///< body frame: vertices, held points
  Vec3 centre{};                        ///< of the metric, in the frame of type.rest
  Gyration gyration;
  std::vector<double> area;
  double bounding_radius = 0, volume = 0;
  int marker = 0;
};

}  // namespace hemowalk::rigid
