#include "resolved/surface_traction.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace hemowalk::resolved {

bool exterior_node(const mesh::Vec3& x, const mesh::Vec3& normal,
                   const std::function<bool(const Node3&)>& is_fluid, Node3& node) {
  constexpr double equal = 1e-6;            // dx: lengths this close are the same
  std::array<std::array<int, 4>, 3> index;  // the farthest first
  std::array<std::array<double, 4>, 3> away, along;
  for (int d = 0; d < 3; ++d) {
    const int first = static_cast<int>(std::floor(x[d] - 0.5)) - 1;
    for (int a = 0; a < 4; ++a) {
      index[d][a] = first + (normal[d] > 0 ? 3 - a : a);
      away[d][a] = index[d][a] + 0.5 - x[d];
      along[d][a] = normal[d] * away[d][a];
    }
  }
  double farthest = 0, square = 0;
  bool found = false;
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b)
      for (int a = 0; a < 4; ++a) {
        const double reach = along[0][a] + along[1][b] + along[2][c];
        const double distance = away[0][a] * away[0][a] + away[1][b] * away[1][b] + away[2][c] * away[2][c];
        const bool better =
            !found || reach > farthest + equal || (reach > farthest - equal && distance < square - equal);
        const Node3 candidate{index[0][a], index[1][b], index[2][c]};
        if (!better || !is_fluid(candidate)) continue;
        farthest = reach, square = distance, node = candidate, found = true;
      }
  return found;
}

mesh::Vec3 surface_force(double area, const mesh::Vec3& n, double pressure,
                         const std::array<double, 6>& viscous) {
  const auto& [xx, yy, zz, xy, xz, yz] = viscous;
  return {area * (xx * n[0] + xy * n[1] + xz * n[2] - pressure * n[0]),
          area * (xy * n[0] + yy * n[1] + yz * n[2] - pressure * n[1]),
          area * (xz * n[0] + yz * n[1] + zz * n[2] - pressure * n[2])};
}

void subtract_mean(const std::vector<double>& area, std::vector<double>& pressure) {
  double sum = 0, total = 0;
  for (std::size_t k = 0; k < area.size(); ++k) sum += area[k] * pressure[k], total += area[k];
  for (double& p : pressure) p -= sum / total;
}

OneRings::OneRings(const mesh::TriangleMesh& mesh) {
  std::vector<std::set<int>> ring(mesh.vertices.size());
  for (const auto& t : mesh.triangles)
    for (const int a : t) ring[a].insert(t.begin(), t.end());  // itself too
  begin_.push_back(0);
  for (const auto& r : ring) {
    vertex_.insert(vertex_.end(), r.begin(), r.end());
    begin_.push_back(static_cast<int>(vertex_.size()));
  }
}

void OneRings::median(std::vector<mesh::Vec3>& force, std::vector<mesh::Vec3>& scratch) const {
  scratch = force;
  std::vector<double> values;
  for (std::size_t k = 0; k + 1 < begin_.size(); ++k)
    for (int d = 0; d < 3; ++d) {
      values.clear();
      for (int i = begin_[k]; i < begin_[k + 1]; ++i) values.push_back(scratch[vertex_[i]][d]);
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      force[k][d] = *middle;
      if (values.size() % 2 == 0) force[k][d] = (*middle + *std::max_element(values.begin(), middle)) / 2;
    }
}

}  // namespace hemowalk::resolved
