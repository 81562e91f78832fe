#pragma once
/// \file BodyStep: one step of one rigid body by one block of threads, in double precision. What a turn does
/// is motion.hpp; RigidBodies::step is the definition of right.

#include "core/device.hpp"
#include "resolved/mesh/cell_fields.hpp"
#include "resolved/rigid/motion.hpp"

namespace hemowalk::rigid {

template <class Real>
struct BodyStep {
  static constexpr int threads = 96, workers = 16;
  mesh::CellFields<Real> cells;
  Gyration gyration;
  const Vec3 *arm, *held, *normal;  ///< [vertices] body frame: vertices, held points (BodyType), normals
  const double* metric;             ///< [vertices]
  BodyMotion* motion;               ///< [cell]
  Vec3* couple;                     ///< [cell] torque beside what v_pred carries; forgotten after the step

  /// The same for the bodies from \p first on.
  BodyStep from(std::size_t first) const {
    BodyStep s = *this;
    s.cells = cells.from(first), s.motion += first, s.couple += first;
    return s;
  }

  struct Shared {
    Vec3 linear[workers], angular[workers];
    Vec3 velocity, turn;
    Matrix3 before, after;
  };
  static constexpr std::size_t shared_bytes() { return sizeof(Shared); }
  HEMO_HD int phases() const { return 3; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto& s = *reinterpret_cast<Shared*>(shared);
    const int me = static_cast<int>(at.thread);
    if (phase == 0) {
      if (me < workers) sum_momenta(at.block, me, s);
    } else if (phase == 1) {
      if (me == 0) find_motion(at.block, s);
    } else {
      move(at.block, me, s);
    }
  }

  /// Momenta of v_pred about the centre, by parts.
  HEMO_HD void sum_momenta(unsigned cell, int me, Shared& s) const {
    const auto turn = mesh::matrix(motion[cell].orientation);
    const int each = (cells.vertices + workers - 1) / workers, begin = each * me;
    Vec3 linear{0, 0, 0}, angular{0, 0, 0};
    for (int k = begin; k < begin + each && k < cells.vertices; ++k) {
      const auto v = cells.get(cells.predicted, cell, k);
      const Vec3 p{metric[k] * static_cast<double>(v.x), metric[k] * static_cast<double>(v.y),
                   metric[k] * static_cast<double>(v.z)};
      mesh::accumulate(linear, 1, p);
      mesh::accumulate(angular, 1, mesh::cross(mesh::transform(turn, held[k]), p));
    }
    s.linear[me] = linear;
    s.angular[me] = angular;
  }

  HEMO_HD void find_motion(unsigned cell, Shared& s) const {
    Vec3 linear{0, 0, 0}, angular = mesh::scale(gyration.h, couple[cell]);
    couple[cell] = {0, 0, 0};
    for (int w = 0; w < workers; ++w)
      mesh::accumulate(linear, 1, s.linear[w]), mesh::accumulate(angular, 1, s.angular[w]);
    BodyMotion& m = motion[cell];
    s.before = mesh::matrix(m.orientation);
    m.velocity = mesh::scale(1 / gyration.mass, linear);
    m.spin = gyration.spin_of(angular, s.before);
    const Turn step(mesh::scale(gyration.h, m.spin));
    m.orientation = turned(step, m.orientation);
    s.velocity = m.velocity;
    s.turn = step.vector;
    s.after = mesh::matrix(m.orientation);
    for (int d = 0; d < 3; ++d)
      cells.anchor[3 * static_cast<std::size_t>(cell) + d] += gyration.h * m.velocity[d];
  }

  HEMO_HD void move(unsigned cell, int me, const Shared& s) const {
    const Turn step(s.turn);
    for (int k = me; k < cells.vertices; k += threads) {
      const auto chord = step.chord(mesh::transform(s.before, held[k]));
      const auto r = mesh::transform(s.after, arm[k]), n = mesh::transform(s.after, normal[k]),
                 q = mesh::transform(s.after, held[k]);
      for (int d = 0; d < 3; ++d) {
        const std::size_t i = cells.at(cell, d, k);
        cells.velocity[i] = static_cast<Real>(s.velocity[d] + chord[d] / gyration.h);
        cells.offset[i] = static_cast<Real>(r[d]);
        cells.held[i] = static_cast<Real>(q[d]);
        cells.normal[i] = static_cast<Real>(n[d]);
      }
    }
  }
};

}  // namespace hemowalk::rigid
