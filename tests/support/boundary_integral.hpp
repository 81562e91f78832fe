#pragma once
/// \file Stokes flow around elastic surfaces in unbounded fluid by a boundary integral: the reference for the
/// coupled solver. It shares with it the membrane's forces and nothing else: no lattice, kernel, coupling,
/// inertia, images or acceleration. Interior and exterior have one viscosity, so that a single layer is
/// exact (Pozrikidis 1992): u(x) = u_inf(x) + 1/(8 pi mu) int (I/r + r r/r^3) f dS, f the force per area on
/// the fluid.

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/reference.hpp"

namespace hemowalk::test {

/// Velocities that forces on the vertices of one closed surface give its vertices. Error of order h^2: flat
/// triangles, force per area linear on them, lumped masses. O(n^2) in the vertices.
class BoundaryIntegral {
 public:
  explicit BoundaryIntegral(const mesh::TriangleMesh& surface, double viscosity)
      : triangles_(surface.triangles), viscosity_(viscosity) {}

  std::vector<mesh::Vec3> velocities(const std::vector<mesh::Vec3>& x,
                                     const std::vector<mesh::Vec3>& force) const {
    const std::size_t n = x.size();
    std::vector<double> area(n, 0);
    for (const auto& t : triangles_)
      for (const int k : t) area[k] += area_of(x, t) / 3;
    std::vector<mesh::Vec3> density(n), out(n);
    for (std::size_t k = 0; k < n; ++k) density[k] = mesh::scale(1 / area[k], force[k]);
    std::vector<double> px(n), py(n), pz(n);
    for (std::size_t k = 0; k < n; ++k) px[k] = x[k][0], py[k] = x[k][1], pz[k] = x[k][2];
    std::vector<double> ux(n, 0), uy(n, 0), uz(n, 0);
#pragma omp parallel
    {
      // Each thread adds all sources to its own targets: sums do not depend on the number of threads.
#pragma omp for schedule(static)
      for (int part = 0; part < parts; ++part) {
        const std::size_t from = n * part / parts, to = n * (part + 1) / parts;
        for (const auto& t : triangles_) {
          const double size = area_of(x, t);
          for (const auto& b : three_points)
            add_source(at(x, t, b), mesh::scale(size / 3, at(density, t, b)), px, py, pz, from, to, ux, uy,
                       uz);
        }
        for (const auto& t : triangles_) {
          const mesh::Vec3 centre = at(x, t, {1. / 3, 1. / 3, 1. / 3});
          const double size = area_of(x, t);
          for (std::size_t k = from; k < to; ++k) {
            const mesh::Vec3 away = mesh::subtract(x[k], centre);
            if (mesh::dot(away, away) > near * size) continue;
            const mesh::Vec3 extra = correction(x, density, t, k);
            ux[k] += extra[0], uy[k] += extra[1], uz[k] += extra[2];
          }
        }
      }
    }
    for (std::size_t k = 0; k < n; ++k)
      out[k] = mesh::scale(1 / (8 * M_PI * viscosity_), {ux[k], uy[k], uz[k]});
    return out;
  }

 private:
  using Triangle = std::array<int, 3>;
  static constexpr int parts = 16;
  static constexpr double near = 8;  ///< square of the distance from which three points do, triangle areas
  static constexpr std::array<std::array<double, 3>, 3> three_points{
      {{2. / 3, 1. / 6, 1. / 6}, {1. / 6, 2. / 3, 1. / 6}, {1. / 6, 1. / 6, 2. / 3}}};

  static mesh::Vec3 at(const std::vector<mesh::Vec3>& f, const Triangle& t, const std::array<double, 3>& b) {
    mesh::Vec3 sum{};
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d) sum[d] += b[i] * f[t[i]][d];
    return sum;
  }
  static double area_of(const std::vector<mesh::Vec3>& x, const Triangle& t) {
    return 0.5 * mesh::norm(mesh::cross(mesh::subtract(x[t[1]], x[t[0]]), mesh::subtract(x[t[2]], x[t[0]])));
  }
  /// G(r) g for r from the source.
  static mesh::Vec3 stokeslet(const mesh::Vec3& r, const mesh::Vec3& g) {
    const double inverse = 1 / mesh::norm(r), along = mesh::dot(r, g) * inverse * inverse;
    return {inverse * (g[0] + along * r[0]), inverse * (g[1] + along * r[1]),
            inverse * (g[2] + along * r[2])};
  }
  static void add_source(const mesh::Vec3& y, const mesh::Vec3& g, const std::vector<double>& px,
                         const std::vector<double>& py, const std::vector<double>& pz, std::size_t from,
                         std::size_t to, std::vector<double>& ux, std::vector<double>& uy,
                         std::vector<double>& uz) {
#pragma omp simd
    for (std::size_t k = from; k < to; ++k) {
      const double rx = px[k] - y[0], ry = py[k] - y[1], rz = pz[k] - y[2];
      const double inverse = 1 / std::sqrt(rx * rx + ry * ry + rz * rz),
                   along = (rx * g[0] + ry * g[1] + rz * g[2]) * inverse * inverse;
      ux[k] += inverse * (g[0] + along * rx), uy[k] += inverse * (g[1] + along * ry),
          uz[k] += inverse * (g[2] + along * rz);
    }
  }

  /// What three points get wrong for a triangle near or at vertex \p k.
  mesh::Vec3 correction(const std::vector<mesh::Vec3>& x, const std::vector<mesh::Vec3>& density,
                        const Triangle& t, std::size_t k) const {
    const double size = area_of(x, t);
    mesh::Vec3 sum{};
    const auto add = [&](const std::array<double, 3>& b, double weight) {
      const auto u = stokeslet(mesh::subtract(x[k], at(x, t, b)), at(density, t, b));
      for (int d = 0; d < 3; ++d) sum[d] += weight * u[d];
    };
    for (const auto& b : three_points) add(b, -size / 3);
    int corner = -1;
    for (int i = 0; i < 3; ++i)
      if (t[i] == static_cast<int>(k)) corner = i;
    if (corner >= 0) {
      // Duffy: points (1 - s) x_k + s ((1 - q) x_1 + q x_2) have area element 2 size s, and 1/r takes the s.
      constexpr double node[] = {0.0337652428984240, 0.1693953067668678, 0.3806904069584016,
                                 0.6193095930415985, 0.8306046932331322, 0.9662347571015760},
                       weight[] = {0.0856622461895852, 0.1803807865240693, 0.2339569672863455,
                                   0.2339569672863455, 0.1803807865240693, 0.0856622461895852};
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
          std::array<double, 3> b{};
          b[corner] = 1 - node[i];
          b[(corner + 1) % 3] = node[i] * (1 - node[j]), b[(corner + 2) % 3] = node[i] * node[j];
          add(b, 2 * size * node[i] * weight[i] * weight[j]);
        }
    } else {
      // Sixteen triangles, three points each.
      constexpr int parts = 4;
      for (int i = 0; i < parts; ++i)
        for (int j = 0; j + i < parts; ++j)
          for (int down = 0; down < (i + j + 1 < parts ? 2 : 1); ++down)
            for (const auto& p : three_points) {
              double u = (i + (down ? 1 - p[0] : p[0])) / parts, v = (j + (down ? 1 - p[1] : p[1])) / parts;
              add({u, v, 1 - u - v}, size / (3 * parts * parts));
            }
    }
    return sum;
  }

  std::vector<Triangle> triangles_;
  double viscosity_;
};

/// A membrane in unbounded flow without inertia: dx/dt = u_inf(x) + what its forces add, by the midpoint
/// rule.
inline void advance_in_stokes_flow(const npfem::CellType& type, const BoundaryIntegral& fluid, double dt,
                                   const std::function<mesh::Vec3(const mesh::Vec3&)>& far,
                                   std::vector<mesh::Vec3>& x) {
  const auto rate = [&](const std::vector<mesh::Vec3>& at) {
    auto v = fluid.velocities(at, npfem::forces(type, at));
    for (std::size_t k = 0; k < v.size(); ++k) v[k] = mesh::add(v[k], far(at[k]));
    return v;
  };
  const auto moved = [&](const std::vector<mesh::Vec3>& v, double t) {
    auto y = x;
    for (std::size_t k = 0; k < y.size(); ++k) y[k] = mesh::add(y[k], mesh::scale(t, v[k]));
    return y;
  };
  x = moved(rate(moved(rate(x), dt / 2)), dt);
}

}  // namespace hemowalk::test
