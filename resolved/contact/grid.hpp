#pragma once
/// \file Grid: points sorted into equal cells, periodic along chosen axes, so that everything within one cell
/// edge of a point is found in the cells around it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace hemowalk::contact {

/// Where one point fell: its cell and how many periods were taken off to bring it into the box.
struct Slot {
  std::uint32_t cell;
  std::array<std::int32_t, 3> wraps;
};

class Grid {
 public:
  /// Cells of at least \p edge that cover [low, high] (axes without period) or one period from 0. Never more
  /// cells than \p most, so that a few far-flung points cost no memory.
  void shape(const std::array<double, 3>& low, const std::array<double, 3>& high,
             const std::array<double, 3>& period, double edge, std::size_t most) {
    period_ = period;
    for (;; edge *= 1.26) {
      for (int k = 0; k < 3; ++k) {
        const double length = period[k] > 0 ? period[k] : std::max(high[k] - low[k], 1e-9);
        cells_[k] = static_cast<int>(std::clamp(std::floor(length / edge), 1.0, 1e6));
        low_[k] = period[k] > 0 ? 0 : low[k];
        inverse_[k] = cells_[k] / length;
      }
      if (static_cast<double>(cells_[0]) * cells_[1] * cells_[2] <=
          static_cast<double>(std::max<std::size_t>(most, 1)))
        break;
    }
    begin_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2] + 1, 0);
  }

  /// Brings \p x into the box (in place) and names its cell.
  Slot locate(std::array<double, 3>& x) const {
    Slot slot{0, {0, 0, 0}};
    std::array<int, 3> i;
    for (int k = 0; k < 3; ++k) {
      if (period_[k] > 0) {
        slot.wraps[k] = static_cast<std::int32_t>(std::floor(x[k] / period_[k]));
        x[k] -= slot.wraps[k] * period_[k];
      }
      i[k] = std::clamp(static_cast<int>((x[k] - low_[k]) * inverse_[k]), 0, cells_[k] - 1);
    }
    slot.cell =
        static_cast<std::uint32_t>((static_cast<std::size_t>(i[2]) * cells_[1] + i[1]) * cells_[0] + i[0]);
    return slot;
  }

  /// Counting sort: afterwards order()[begin(c) .. begin(c + 1)) are the points of cell c, in their given
  /// order.
  void sort(const std::vector<Slot>& slots, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) ++begin_[slots[i].cell + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    order_.resize(count);
    for (std::size_t i = 0; i < count; ++i) order_[begin_[slots[i].cell]++] = static_cast<std::uint32_t>(i);
    for (std::size_t c = begin_.size() - 1; c > 0; --c) begin_[c] = begin_[c - 1];
    begin_[0] = 0;
  }
  const std::vector<std::uint32_t>& order() const { return order_; }

  /// visit(begin, end, wraps): stretches of order() around a cell; their points sit at x + wraps * period.
  /// Each periodic image is visited once.
  template <class Visit>
  void around(std::uint32_t cell, Visit&& visit) const {
    const std::array<int, 3> at{static_cast<int>(cell % cells_[0]),
                                static_cast<int>(cell / cells_[0] % cells_[1]),
                                static_cast<int>(cell / cells_[0] / cells_[1])};
    std::array<std::int32_t, 3> wraps{};
    for (int dz = -1; dz <= 1; ++dz) {
      const int z = wrapped(at[2] + dz, 2, wraps[2]);
      if (z < 0) continue;
      for (int dy = -1; dy <= 1; ++dy) {
        const int y = wrapped(at[1] + dy, 1, wraps[1]);
        if (y < 0) continue;
        const std::size_t row = (static_cast<std::size_t>(z) * cells_[1] + y) * cells_[0];
        wraps[0] = 0;  // cells that follow each other along x are one stretch
        const int first = std::max(at[0] - 1, 0), last = std::min(at[0] + 1, cells_[0] - 1);
        visit(begin_[row + first], begin_[row + last + 1], wraps);
        for (const int x : {at[0] - 1, at[0] + 1}) {
          if (x >= 0 && x < cells_[0]) continue;
          const int image = wrapped(x, 0, wraps[0]);
          if (image >= 0) visit(begin_[row + image], begin_[row + image + 1], wraps);
        }
      }
    }
  }

 private:
  /// Cell number along an axis, or -1 where the box ends.
  int wrapped(int i, int axis, std::int32_t& wraps) const {
    wraps = 0;
    if (i >= 0 && i < cells_[axis]) return i;
    if (period_[axis] <= 0) return -1;
    wraps = i < 0 ? -1 : 1;
    return i < 0 ? cells_[axis] - 1 : 0;
  }

  std::array<double, 3> period_{}, low_{}, inverse_{};
  std::array<int, 3> cells_{1, 1, 1};
  std::vector<std::uint32_t> begin_{0, 0}, order_;
};

}  // namespace hemowalk::contact
