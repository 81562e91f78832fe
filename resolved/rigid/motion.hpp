#pragma once
/// \file How a rigid body turns by a finite angle, in double precision: bodies for host and device.

#include <cmath>

#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::rigid {

using mesh::Matrix3;
using mesh::Quaternion;
using mesh::Vec3;

/// Six degrees of freedom, but for the place of the centre.
struct BodyMotion {
  Quaternion orientation;
  Vec3 velocity, spin;  ///< of the centre; angular
};

HEMO_HD inline Matrix3 transposed(const Matrix3& m) {
  return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

/// Rotation by the vector \p turn (rad): r -> r + a turn x r + b turn x (turn x r).
struct Turn {
  HEMO_HD explicit Turn(const Vec3& turn) : vector(turn) {
    const double t2 = mesh::dot(turn, turn), t = std::sqrt(t2);
    a = t2 < 1e-6 ? 1 - t2 / 6 * (1 - t2 / 20) : std::sin(t) / t;
    const double s = t2 < 1e-6 ? 1 - t2 / 24 * (1 - t2 / 80) : std::sin(t / 2) / (t / 2);
    b = s * s / 2;
  }
  HEMO_HD Vec3 chord(const Vec3& r) const {
    const auto once = mesh::cross(vector, r);
    return mesh::add(mesh::scale(a, once), mesh::scale(b, mesh::cross(vector, once)));
  }
  Vec3 vector;
  double a, b;
};

/// Inertia about the metric's centre in the body frame, and the time step.
struct Gyration {
  double mass = 0, h = 1;
  Matrix3 inertia{}, inverse_inertia{};

  /// omega from the angular momentum \p l about the centre, world frame: l = a I omega + b h omega x I omega,
  /// where the second part comes from the chords of a finite turn (and is the gyroscopic term). \p turn: body
  /// to world.
  HEMO_HD Vec3 spin_of(const Vec3& l, const Matrix3& turn) const {
    const auto target = mesh::transform(transposed(turn), l);
    Vec3 omega = mesh::transform(inverse_inertia, target);
    for (int i = 0; i < 50; ++i) {
      const Turn now(mesh::scale(h, omega));
      const auto gyro = mesh::cross(omega, mesh::transform(inertia, omega));
      const auto next = mesh::scale(
          1 / now.a, mesh::transform(inverse_inertia, mesh::subtract(target, mesh::scale(now.b * h, gyro))));
      const double change = mesh::norm(mesh::subtract(next, omega));
      omega = next;
      if (change <= 1e-15 * mesh::norm(omega)) break;
    }
    return mesh::transform(turn, omega);
  }
};

/// The orientation after \p step.
HEMO_HD inline Quaternion turned(const Turn& step, const Quaternion& orientation) {
  return mesh::normalized(mesh::multiply(mesh::rotation(step.vector, mesh::norm(step.vector)), orientation));
}

}  // namespace hemowalk::rigid
