#pragma once
/// \file Numbers of all cells of a kind on one rank, in the order of their ids.

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>
#include <vector>

#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

/// What a property of the cells of one kind looks like on the root; empty on other ranks.
struct Gathered {
  std::vector<std::int64_t> id;
  std::vector<double> values;  ///< [cell][n]
};

/// \p fill(g, c, out) writes \p n numbers of cell c of g; called in parallel (all).
template <class Real, class Fill>
Gathered gather_cells(const mpi::Ranks& ranks, const Group<Real>& group, std::size_t n, const Fill& fill) {
  const std::size_t length = n + 1;  // an id is exact in a double up to 2^53
  std::vector<std::byte> mine;
  std::visit(
      [&](const auto& g) {
        mine.resize(g.count() * length * sizeof(double));
        auto* rows = reinterpret_cast<double*>(mine.data());
#pragma omp parallel for schedule(static)
        for (int c = 0; c < g.count(); ++c) {
          rows[c * length] = static_cast<double>(g.id(c));
          fill(g, c, rows + c * length + 1);
        }
      },
      group.cells);
  std::vector<double> rows;
  for (const auto& part : ranks.gather(std::move(mine))) {
    const std::size_t at = rows.size();
    rows.resize(at + part.size() / sizeof(double));
    if (!part.empty()) std::memcpy(rows.data() + at, part.data(), part.size());
  }
  std::vector<std::size_t> order(rows.size() / length);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return rows[a * length] < rows[b * length]; });
  Gathered out;
  for (const std::size_t i : order) {
    out.id.push_back(static_cast<std::int64_t>(rows[i * length]));
    out.values.insert(out.values.end(), rows.begin() + i * length + 1, rows.begin() + (i + 1) * length);
  }
  return out;
}

}  // namespace hemowalk::resolved
