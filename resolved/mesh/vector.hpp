#pragma once
/// \file Arithmetic on Vec3 for code that is not hot.

#include <cmath>

#include "core/portability.hpp"
#include "resolved/mesh/mesh.hpp"

namespace hemowalk::mesh {

HEMO_HD inline Vec3 add(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
HEMO_HD inline Vec3 subtract(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
HEMO_HD inline Vec3 scale(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
HEMO_HD inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
HEMO_HD inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
HEMO_HD inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
HEMO_HD inline void accumulate(Vec3& sum, double s, const Vec3& a) {
  for (int d = 0; d < 3; ++d) sum[d] += s * a[d];
}

}  // namespace hemowalk::mesh
