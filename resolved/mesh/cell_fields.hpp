#pragma once
/// \file The fields of one kind of cells as device kernels see them: one block of threads per cell, one
/// thread per vertex, so every field is [cell][component][vertex], padded to whole cache lines.

#include <cstddef>

#include "core/portability.hpp"
#include "resolved/mesh/lane_vector.hpp"

namespace hemowalk::mesh {

template <class Real>
struct CellFields {
  int vertices, pitch;  ///< per cell; pitch >= vertices
  double* anchor;       ///< [cell][3], absolute
  Real *offset, *velocity, *normal, *predicted;
  Real* held = nullptr;  ///< rigid bodies: the points that touch the fluid, like offset

  /// The same fields from cell \p first on.
  CellFields from(std::size_t first) const {
    CellFields f = *this;
    const std::size_t skip = at(first, 0, 0);
    f.anchor += 3 * first, f.offset += skip, f.velocity += skip, f.normal += skip, f.predicted += skip;
    if (held) f.held += skip;
    return f;
  }
  static constexpr int padded(int vertices) { return (vertices + 31) / 32 * 32; }
  HEMO_HD std::size_t at(std::size_t cell, int d, int k) const {
    return (cell * 3 + static_cast<std::size_t>(d)) * static_cast<std::size_t>(pitch) +
           static_cast<std::size_t>(k);
  }
  HEMO_HD Vector<Real> get(const Real* field, std::size_t cell, int k) const {
    return {field[at(cell, 0, k)], field[at(cell, 1, k)], field[at(cell, 2, k)]};
  }
  HEMO_HD void put(const Vector<Real>& v, Real* field, std::size_t cell, int k) const {
    field[at(cell, 0, k)] = v.x, field[at(cell, 1, k)] = v.y, field[at(cell, 2, k)] = v.z;
  }
};

/// The three components of vertex k of a field [component][vertex] in shared memory.
template <class Real>
HEMO_HD HEMO_INLINE Vector<Real> get3(const Real* field, int vertices, int k) {
  return {field[k], field[vertices + k], field[2 * vertices + k]};
}
template <class Real>
HEMO_HD HEMO_INLINE void put3(const Vector<Real>& v, Real* field, int vertices, int k) {
  field[k] = v.x, field[vertices + k] = v.y, field[2 * vertices + k] = v.z;
}

}  // namespace hemowalk::mesh
