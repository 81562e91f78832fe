#pragma once
/// \file Eigenvalues of symmetric 3x3 matrices and the rotation nearest to a matrix, by Jacobi rotations.

#include <algorithm>
#include <array>
#include <cmath>

#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {

struct Eigen3 {
  Vec3 value{};                  ///< descending
  std::array<Vec3, 3> vector{};  ///< orthonormal
};

inline Eigen3 eigen_symmetric(Matrix3 a) {
  Matrix3 v{1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int sweep = 0; sweep < 60; ++sweep) {
    const double off = a[1] * a[1] + a[2] * a[2] + a[5] * a[5];
    if (off <= 1e-32 * (a[0] * a[0] + a[4] * a[4] + a[8] * a[8])) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[3 * p + q] == 0) continue;
        const double theta = (a[4 * q] - a[4 * p]) / (2 * a[3 * p + q]);
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        const auto turn = [&](double& x, double& y) {
          const double old = x;
          x = c * old - s * y, y = s * old + c * y;
        };
        for (int k = 0; k < 3; ++k) turn(a[3 * k + p], a[3 * k + q]);
        for (int k = 0; k < 3; ++k) turn(a[3 * p + k], a[3 * q + k]);
        for (int k = 0; k < 3; ++k) turn(v[3 * k + p], v[3 * k + q]);
      }
  }
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int i, int j) { return a[4 * i] > a[4 * j]; });
  Eigen3 result;
  for (int i = 0; i < 3; ++i) {
    result.value[i] = a[4 * order[i]];
    result.vector[i] = {v[order[i]], v[3 + order[i]], v[6 + order[i]]};
  }
  return result;
}

/// The rotation R that maximises tr(R^T a): polar factor of a = sum x r^T (fit of x to R r), det R = +1.
inline Matrix3 nearest_rotation(const Matrix3& a) {
  Matrix3 ata{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) ata[3 * i + j] += a[3 * k + i] * a[3 * k + j];
  const auto e = eigen_symmetric(ata);
  std::array<Vec3, 3> u;
  for (int i = 0; i < 2; ++i) {
    u[i] = transform(a, e.vector[i]);
    const double length = norm(u[i]);
    u[i] = scale(length > 0 ? 1 / length : 0, u[i]);
  }
  u[2] = cross(u[0], u[1]);
  const Vec3 w = cross(e.vector[0], e.vector[1]);  // right-handed partner of the first two
  Matrix3 r{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      r[3 * i + j] = u[0][i] * e.vector[0][j] + u[1][i] * e.vector[1][j] + u[2][i] * w[j];
  return r;
}

}  // namespace hemowalk::mesh
