#include "resolved/region.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/contact/geometry.hpp"
#include "resolved/mesh/mesh.hpp"
#include "resolved/mesh/mesh_file.hpp"

namespace hemowalk::resolved {

namespace {

using data::Domain;

/// x of the points where the line (y, z) crosses the surface, sorted. A vertex or edge exactly on the line
/// counts as above it, so that a closed surface is always crossed an even number of times.
std::vector<double> crossings(const mesh::TriangleMesh& surface, const std::vector<int>& triangles, double y,
                              double z) {
  std::vector<double> x;
  for (const int t : triangles) {
    const auto& c = surface.triangles[static_cast<std::size_t>(t)];
    // The segment in which the plane z cuts the triangle, then the point in which the line cuts the segment.
    double ends[2][2];
    int n = 0;
    for (int e = 0; e < 3 && n < 2; ++e) {
      // The lower number first: both triangles at an edge find the same point, to the bit.
      const auto [first, second] = std::minmax(c[e], c[(e + 1) % 3]);
      const auto &a = surface.vertices[first], &b = surface.vertices[second];
      if ((a[2] >= z) == (b[2] >= z)) continue;
      const double w = (z - a[2]) / (b[2] - a[2]);
      ends[n][0] = a[0] + w * (b[0] - a[0]), ends[n][1] = a[1] + w * (b[1] - a[1]);
      ++n;
    }
    if (n < 2 || (ends[0][1] >= y) == (ends[1][1] >= y)) continue;
    const double w = (y - ends[0][1]) / (ends[1][1] - ends[0][1]);
    x.push_back(ends[0][0] + w * (ends[1][0] - ends[0][0]));
  }
  std::sort(x.begin(), x.end());
  return x;
}

/// Nodes outside the closed surface; a surface that ends at the faces of the box (a vessel along z) is closed
/// there.
std::vector<std::uint8_t> outside(const mesh::TriangleMesh& surface, int nx, int ny, int nz) {
  std::vector<std::vector<int>> over(static_cast<std::size_t>(nz));  // triangles that a plane k may cut
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    double low = 1e300, high = -1e300;
    for (const int v : surface.triangles[t])
      low = std::min(low, surface.vertices[v][2]), high = std::max(high, surface.vertices[v][2]);
    for (int k = std::max(0, static_cast<int>(std::ceil(low - 0.5))); k < nz && k + 0.5 <= high; ++k)
      over[k].push_back(t);
  }
  std::vector<std::uint8_t> solid(static_cast<std::size_t>(nx) * ny * nz, 1);
#pragma omp parallel for schedule(dynamic, 1)
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const auto x = crossings(surface, over[k], j + 0.5, k + 0.5);
      for (std::size_t c = 0; c + 1 < x.size(); c += 2)
        for (int i = std::max(0, static_cast<int>(std::ceil(x[c] - 0.5))); i < nx && i + 0.5 < x[c + 1]; ++i)
          solid[(static_cast<std::size_t>(k) * ny + j) * nx + i] = 0;
    }
  return solid;
}

/// Distance of every node to the surface within \p limit, negative in the solid. What lies outside the box or
/// on its faces (the caps of a vessel) does not bound the flow; the rest repeats with the box.
std::vector<float> distances(const mesh::TriangleMesh& surface, const std::vector<std::uint8_t>& solid,
                             const std::array<int, 3>& n, float limit) {
  std::vector<float> gap(solid.size(), limit);
  const auto point = [&](int v) {
    const auto& x = surface.vertices[static_cast<std::size_t>(v)];
    return contact::Point<double>{x[0], x[1], x[2]};
  };
  for (const auto& t : surface.triangles) {
    int first[3], last[3];
    bool outside = false;
    for (int d = 0; d < 3; ++d) {
      const auto [low, high] =
          std::minmax({surface.vertices[t[0]][d], surface.vertices[t[1]][d], surface.vertices[t[2]][d]});
      first[d] = static_cast<int>(std::ceil(low - limit - 0.5));
      last[d] = static_cast<int>(std::floor(high + limit - 0.5));
      outside = outside || high <= 1e-6 || low >= n[d] - 1e-6;
    }
    if (outside) continue;
    const auto a = point(t[0]), b = point(t[1]), c = point(t[2]);
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int i = first[0]; i <= last[0]; ++i) {
          const auto wrap = [](int x, int period) { return (x % period + period) % period; };
          float& here =
              gap[(static_cast<std::size_t>(wrap(k, n[2])) * n[1] + wrap(j, n[1])) * n[0] + wrap(i, n[0])];
          const auto q = contact::nearest_on_triangle<double>({i + 0.5, j + 0.5, k + 0.5}, a, b, c);
          const double at[3] = {i + 0.5 - q.to_point.x, j + 0.5 - q.to_point.y, k + 0.5 - q.to_point.z};
          bool in_box = true;
          for (int d = 0; d < 3; ++d) in_box = in_box && at[d] >= -1e-6 && at[d] <= n[d] + 1e-6;
          if (in_box) here = std::min(here, static_cast<float>(std::sqrt(q.squared)));
        }
  }
  for (std::size_t m = 0; m < gap.size(); ++m)
    if (solid[m]) gap[m] = -gap[m];
  return gap;
}

}  // namespace

Region::Region(const data::Scene& scene) {
  const Block block = make_block(scene);
  nx_ = block.nx, ny_ = block.ny, nz_ = block.nz;
  const double dx = scene.fluid.dx;
  volume_ = scene.domain.size[0] * scene.domain.size[1] * scene.domain.size[2];
  if (scene.domain.geometry == Domain::Geometry::tube) {
    tube_radius_ = scene.domain.tube_diameter / dx / 2;
    volume_ = std::acos(-1.0) * tube_radius_ * tube_radius_ * nz_ * dx * dx * dx;
  }
  if (scene.domain.geometry != Domain::Geometry::stl) return;
  mesh::TriangleMesh surface = mesh::read_mesh(scene.domain.stl_file);
  for (auto& v : surface.vertices)
    for (double& c : v) c *= scene.domain.stl_unit / dx;
  solid_ = outside(surface, nx_, ny_, nz_);
  gap_ = distances(surface, solid_, {nx_, ny_, nz_}, gap_limit);
  const auto fluid = std::count(solid_.begin(), solid_.end(), 0);
  require(fluid > 0,
          scene.domain.stl_file +
              " leaves no fluid in the box (the surface bounds the flow, in the coordinates of the box) "
              "check domain.geometry.unit and where the surface lies");
  volume_ = static_cast<double>(fluid) * dx * dx * dx;
}

bool Region::solid(int i, int j, int k) const {
  const auto wrap = [](int n, int period) { return (n % period + period) % period; };
  i = wrap(i, nx_), j = wrap(j, ny_), k = wrap(k, nz_);
  if (!solid_.empty()) return solid_[(static_cast<std::size_t>(k) * ny_ + j) * nx_ + i] != 0;
  if (tube_radius_ == 0) return false;
  const double x = i + 0.5 - nx_ / 2.0, y = j + 0.5 - ny_ / 2.0;
  return x * x + y * y > tube_radius_ * tube_radius_;
}

}  // namespace hemowalk::resolved
