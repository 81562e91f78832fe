#pragma once
/// \file Cells and deformations for tests of the solid, in the paper's coherent units (um, us, fg).

#include <cstdint>
#include <memory>
#include <vector>

#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/cell_type.hpp"

namespace hemowalk::support {

/// Deterministic numbers in [-1/2, 1/2) (splitmix64).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  double operator()() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53 - 0.5;
  }

 private:
  std::uint64_t state_;
};

/// Every vertex moved by up to \p size/2 per coordinate.
inline std::vector<mesh::Vec3> shaken(std::vector<mesh::Vec3> x, double size, std::uint64_t seed) {
  Numbers numbers(seed);
  for (auto& p : x)
    for (double& c : p) c += size * numbers();
  return x;
}

/// A red cell with the paper's moduli times \p stiffness and \p vertex_mass on every vertex.
inline std::shared_ptr<const npfem::CellType> red_cell_type(int n, npfem::Material material = {},
                                                            double h = 0.25, double body_mass = 400.3 * 258) {
  auto rest = mesh::red_cell(1, n);
  const double m = body_mass / rest.vertex_count();
  std::vector<double> metric(rest.vertex_count(), m);
  return std::make_shared<const npfem::CellType>(std::move(rest), material, std::move(metric), h);
}

inline double largest(const std::vector<mesh::Vec3>& f) {
  double size = 0;
  for (const auto& p : f) size = std::max(size, mesh::norm(p));
  return size;
}
inline double largest_difference(const std::vector<mesh::Vec3>& a, const std::vector<mesh::Vec3>& b) {
  double size = 0;
  for (std::size_t k = 0; k < a.size(); ++k) size = std::max(size, mesh::norm(mesh::subtract(a[k], b[k])));
  return size;
}

}  // namespace hemowalk::support
