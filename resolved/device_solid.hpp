#pragma once
/// \file DeviceSolid: only the cells' step on the device, fluid, coupling and contact on the host (the
/// paper's hybrid). The groups are cut into equal parts, each with a queue of its own, so that one part is
/// copied while another computes: v_pred goes up; positions, velocities and normals come down. Membranes'
/// rounding residuals stay on the device.

#include <memory>
#include <variant>
#include <vector>

#include "core/device.hpp"
#include "resolved/npfem/device_membranes.hpp"
#include "resolved/rigid/device_bodies.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

template <class Real>
class DeviceSolid {
 public:
  /// Takes over the cells of \p groups, which must outlive this. \p parts per group.
  DeviceSolid(Place place, std::vector<Group<Real>>& groups, int parts = 4);
  ~DeviceSolid();

  /// One solid step of all groups, from and to the host's fields. \returns a report per group.
  std::vector<mesh::StepReport> step(const mesh::StepOptions& options);
  /// What the host's fields do not hold (rounding residuals) comes down too: for checkpoints and output.
  void download();
  /// Before cells come to the groups or go: all of their state is there, and their memory may move.
  void give_back();
  /// After it: takes over the cells that are there now.
  void take_over();

 private:
  struct Part;
  struct Share;
  template <class Exchange>
  void for_groups(const Exchange& exchange);

  int parts_;
  std::vector<std::unique_ptr<Share>> shares_;
};

extern template class DeviceSolid<float>;
extern template class DeviceSolid<double>;

}  // namespace hemowalk::resolved
