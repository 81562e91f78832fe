#pragma once
/// \file Area of the cut of a closed surface with horizontal planes: the hematocrit profile, exactly.

#include <array>
#include <cmath>
#include <vector>

namespace hemowalk::resolved {

/// Adds to area[j] the area of the section of a closed, outward oriented surface with the plane y = (j + 1/2)
/// spacing. Green's theorem over the segments in which triangles cross the plane; cost: triangles x planes
/// crossed. \param vertex callable k -> std::array<double, 3>
template <class Vertex, class Triangles>
void add_cross_sections(const Vertex& vertex, const Triangles& triangles, double spacing,
                        std::vector<double>& area) {
  for (const auto& t : triangles) {
    const std::array<std::array<double, 3>, 3> p{vertex(t[0]), vertex(t[1]), vertex(t[2])};
    const double low = std::min({p[0][1], p[1][1], p[2][1]}), high = std::max({p[0][1], p[1][1], p[2][1]});
    const int first = std::max(0, static_cast<int>(std::ceil(low / spacing - 0.5)));
    const int last =
        std::min(static_cast<int>(area.size()) - 1, static_cast<int>(std::floor(high / spacing - 0.5)));
    if (first > last) continue;
    const double nx = (p[1][1] - p[0][1]) * (p[2][2] - p[0][2]) - (p[1][2] - p[0][2]) * (p[2][1] - p[0][1]);
    const double nz = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    for (int j = first; j <= last; ++j) {
      const double c = (j + 0.5) * spacing;
      // A vertex on the plane counts as above it: every section stays a closed polygon.
      std::array<std::array<double, 2>, 2> end{};  // x, z of the two crossings
      int crossings = 0;
      for (int e = 0; e < 3 && crossings < 2; ++e) {
        const auto &a = p[e], &b = p[(e + 1) % 3];
        if ((a[1] >= c) == (b[1] >= c)) continue;
        const double w = (c - a[1]) / (b[1] - a[1]);
        end[crossings++] = {a[0] + w * (b[0] - a[0]), a[2] + w * (b[2] - a[2])};
      }
      if (crossings < 2) continue;
      // Counter-clockwise about +y the tangent is y x n = (n_z, -n_x).
      double twice = end[0][1] * end[1][0] - end[0][0] * end[1][1];
      if ((end[1][0] - end[0][0]) * nz - (end[1][1] - end[0][1]) * nx < 0) twice = -twice;
      area[j] += 0.5 * twice;
    }
  }
}

}  // namespace hemowalk::resolved
