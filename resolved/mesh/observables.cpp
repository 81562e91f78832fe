#include "resolved/mesh/observables.hpp"

#include <algorithm>
#include <cmath>

#include "resolved/mesh/symmetric.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

/// int r r^T dV about \p centre, by tetrahedra from there.
Matrix3 second_moments(const TriangleMesh& mesh, const Vec3& centre) {
  Matrix3 m{};
  for (const auto& t : mesh.triangles) {
    const Vec3 p[3] = {subtract(mesh.vertices[t[0]], centre), subtract(mesh.vertices[t[1]], centre),
                       subtract(mesh.vertices[t[2]], centre)};
    const double v = dot(p[0], cross(p[1], p[2])) / 6;
    const Vec3 s = add(p[0], add(p[1], p[2]));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double sum = s[i] * s[j];
        for (const auto& q : p) sum += q[i] * q[j];
        m[3 * i + j] += v / 20 * sum;
      }
  }
  return m;
}

double extent(const std::vector<Vec3>& x, const Vec3& direction) {
  double low = dot(x[0], direction), high = low;
  for (const auto& p : x) {
    const double s = dot(p, direction);
    low = std::min(low, s), high = std::max(high, s);
  }
  return high - low;
}

/// Deformation and inclination from the y-z block of the second moments (a^2 of the section's ellipse).
void shear_plane(const Matrix3& m, Observables& o) {
  const double yy = m[4], zz = m[8], yz = m[5];
  const double mean = (yy + zz) / 2, radius = std::hypot((zz - yy) / 2, yz);
  const double longer = std::sqrt(mean + radius), shorter = std::sqrt(std::max(0.0, mean - radius));
  o.taylor_deformation = (longer - shorter) / (longer + shorter);
  o.inclination = 0.5 * std::atan2(2 * yz, zz - yy);
}

/// Rotation of the rest shape that fits \p x best (equal weights).
Matrix3 fitted_rotation(const TriangleMesh& rest, const std::vector<Vec3>& x) {
  Vec3 mean{}, rest_mean{};
  const double weight = 1.0 / static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    accumulate(mean, weight, x[k]);
    accumulate(rest_mean, weight, rest.vertices[k]);
  }
  Matrix3 a{};
  for (std::size_t k = 0; k < x.size(); ++k) {
    const auto p = subtract(x[k], mean), r = subtract(rest.vertices[k], rest_mean);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) a[3 * i + j] += p[i] * r[j];
  }
  return nearest_rotation(a);
}

}  // namespace

int marker_vertex(const TriangleMesh& rest) {
  int best = 0;
  for (int k = 1; k < rest.vertex_count(); ++k)
    if (rest.vertices[k][2] > rest.vertices[best][2]) best = k;
  return best;
}

Observables observe(const TriangleMesh& rest, const std::vector<Vec3>& x, int marker) {
  TriangleMesh shape;
  shape.vertices = x;
  shape.triangles = rest.triangles;
  Observables o;
  o.area = area(shape);
  o.volume = volume(shape);
  o.centre = centroid(shape);
  const auto moments = second_moments(shape, o.centre);
  const auto principal = eigen_symmetric(moments);
  for (int i = 0; i < 3; ++i) o.semi_axes[i] = std::sqrt(std::max(0.0, 5 * principal.value[i] / o.volume));
  o.principal = principal.vector;
  shear_plane(moments, o);
  o.axial_diameter = extent(x, o.principal[0]);
  o.transverse_diameter = extent(x, o.principal[1]);
  const auto frame = fitted_rotation(rest, x);
  o.axis = {frame[1], frame[4], frame[7]};
  o.short_axis = o.principal[2];
  if (dot(o.short_axis, o.axis) < 0) o.short_axis = scale(-1, o.short_axis);
  const auto arm = subtract(x[marker], o.centre);
  o.tank_treading_angle = std::atan2(arm[1], arm[2]);
  return o;
}

}  // namespace hemowalk::mesh
