#pragma once
/// \file The fields of a group of cells as they lie on the host, for exchange with a device: see Layout.

#include <cstddef>

#include "resolved/mesh/lanes.hpp"

namespace hemowalk::rigid {
struct BodyMotion;
}

namespace hemowalk::mesh {

template <class Real>
struct HostFields {
  int vertices, batches;
  double* anchor;                       ///< [batch][3][lane]
  Real *offset, *velocity, *normal;     ///< [batch][vertex][3][lane]
  Real* predicted;                      ///< likewise
  Real* held = nullptr;                 ///< rigid bodies: coupling points, likewise
  double* couple = nullptr;             ///< rigid bodies: [cell][3] torque of the next step
  rigid::BodyMotion* motion = nullptr;  ///< rigid bodies: [cell]
  std::size_t batch_size() const { return static_cast<std::size_t>(vertices) * 3 * lanes_of<Real>; }
};

}  // namespace hemowalk::mesh
