#pragma once
/// \file DeviceBodies: the bodies of a RigidBodies group on a Queue's place, one block of threads per body.

#include "core/device.hpp"
#include "resolved/rigid/device_step.hpp"
#include "resolved/rigid/rigid.hpp"

namespace hemowalk::rigid {

/// With the face of npfem::DeviceMembranes.
template <class Real>
class DeviceBodies {
 public:
  using Step = BodyStep<Real>;

  DeviceBodies(Queue& queue, const RigidBodies<Real>& host);

  int count() const { return count_; }
  int vertices() const { return fields_.vertices; }
  const mesh::CellFields<Real>& fields() const { return fields_; }
  Step body(const StepOptions& options) const;
  std::size_t shared_bytes() const { return Step::shared_bytes(); }
  /// Enqueues one step of all bodies from fields().predicted. RigidBodies::step defines what it does.
  void step(const StepOptions& options = {});
  /// [cell] torque beside what v_pred carries, for the next step.
  Vec3* couples() { return couple_.data(); }
  const BodyMotion* motion() const { return motion_.data(); }  ///< [cell]

  /// Takes over any number of bodies.
  void upload(const RigidBodies<Real>& host);
  void download(RigidBodies<Real>& host) const;
  StepReport report() const;
  std::size_t memory_bytes() const;

 private:
  void fit(int count, int vertices);

  Queue& queue_;
  int count_ = 0;
  mesh::CellFields<Real> fields_{};
  Gyration gyration_;
  Array<Vec3> arm_, held_, shape_normal_;
  Array<double> metric_, anchor_;
  Array<BodyMotion> motion_;
  Array<Vec3> couple_;
  Array<Real> offset_, held_now_, velocity_, normal_, predicted_;
};

extern template class DeviceBodies<float>;
extern template class DeviceBodies<double>;

}  // namespace hemowalk::rigid
