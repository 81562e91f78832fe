#pragma once
/// \file Where a vertex of a cell lies in memory. Cells of one type stand side by side in the SIMD lanes:
/// cell c is lane c % lanes of batch c / lanes, and every field is [batch][vertex][component][lane].

#include <cstddef>

#include "core/portability.hpp"

namespace hemowalk::mesh {

/// Cells per batch: one 512-bit register (16 float, 8 double).
template <class Real>
inline constexpr int lanes_of = static_cast<int>(64 / sizeof(Real));

/// Index arithmetic for the fields of one group of cells.
template <class Real>
struct Layout {
  static constexpr int lanes = lanes_of<Real>;
  int vertices = 0;  ///< per cell

  /// Component \p d of vertex \p k of cell \p c in a vector field [batch][vertex][3][lane].
  HEMO_HD std::size_t at(int c, int k, int d) const {
    return ((static_cast<std::size_t>(c / lanes) * vertices + k) * 3 + d) * lanes + c % lanes;
  }
  /// The same in a scalar field [batch][vertex][lane].
  HEMO_HD std::size_t at(int c, int k) const {
    return (static_cast<std::size_t>(c / lanes) * vertices + k) * lanes + c % lanes;
  }
  /// Component \p d of a per-cell double vector [batch][3][lane] (anchors).
  HEMO_HD std::size_t anchor(int c, int d) const {
    return (static_cast<std::size_t>(c / lanes) * 3 + d) * lanes + c % lanes;
  }
};

}  // namespace hemowalk::mesh
