#pragma once
/// \file Rotations in double: unit quaternions (w, x, y, z) and 3x3 matrices (row major).

#include <array>
#include <cmath>

#include "core/portability.hpp"
#include "resolved/mesh/mesh.hpp"

namespace hemowalk::mesh {

using Quaternion = std::array<double, 4>;  ///< w, x, y, z; unit length
using Matrix3 = std::array<double, 9>;     ///< row major

inline constexpr Quaternion identity_rotation{1, 0, 0, 0};

/// Rotation about \p axis (any length > 0) by \p angle, rad.
HEMO_HD inline Quaternion rotation(const Vec3& axis, double angle) {
  const double length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  if (length == 0) return identity_rotation;
  const double s = std::sin(angle / 2) / length;
  return {std::cos(angle / 2), s * axis[0], s * axis[1], s * axis[2]};
}

/// First \p b, then \p a.
HEMO_HD inline Quaternion multiply(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

HEMO_HD inline Quaternion normalized(const Quaternion& q) {
  const double s = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {s * q[0], s * q[1], s * q[2], s * q[3]};
}

// Where a rigid body's points are follows from its orientation alone: computed anew from a saved state they
// must be what the last step left, to the bit and whichever compiler made it. So matrix() and transform() say
// where they round: nothing is left to contract.

/// a b + c d, rounded twice.
HEMO_HD inline double sum_of_products(double a, double b, double c, double d) {
  return std::fma(a, b, c * d);
}

HEMO_HD inline Matrix3 matrix(const Quaternion& q) {
  const auto [w, x, y, z] = q;
  return {std::fma(-2.0, sum_of_products(y, y, z, z), 1.0),
          2 * sum_of_products(x, y, -w, z),
          2 * sum_of_products(x, z, w, y),
          2 * sum_of_products(x, y, w, z),
          std::fma(-2.0, sum_of_products(x, x, z, z), 1.0),
          2 * sum_of_products(y, z, -w, x),
          2 * sum_of_products(x, z, -w, y),
          2 * sum_of_products(y, z, w, x),
          std::fma(-2.0, sum_of_products(x, x, y, y), 1.0)};
}

HEMO_HD inline Vec3 transform(const Matrix3& m, const Vec3& v) {
  const auto row = [&](int i) {
    return std::fma(m[i], v[0], sum_of_products(m[i + 1], v[1], m[i + 2], v[2]));
  };
  return {row(0), row(3), row(6)};
}
HEMO_HD inline Vec3 rotate(const Quaternion& q, const Vec3& v) { return transform(matrix(q), v); }

}  // namespace hemowalk::mesh
