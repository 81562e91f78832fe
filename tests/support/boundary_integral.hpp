#pragma once
/// \file Stokes flow around elastic surfaces in unbounded fluid by a boundary integral: the reference for the
/// coupled solver. It shares with it the membrane's forces and nothing else: no lattice, kernel, coupling,
/// inertia, images or acceleration. Interior and exterior have one viscosity, so that a single layer is
/// exact (Pozrikidis 1992): u(x) = u_inf(x) + 1/(8 pi mu) int (I/r + r r/r^3) f dS, f the force per area on
/// the fluid.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/reference.hpp"

namespace hemowalk::test {

/// Velocities that forces on the vertices of one closed surface give its vertices. Error of order h^2: flat
/// triangles, force per area linear on them, lumped masses.
class BoundaryIntegral {
 public:
  explicit BoundaryIntegral(const mesh::TriangleMesh& surface, double viscosity)
      : triangles_(surface.triangles), viscosity_(viscosity) {}

  /// The matrix that turns forces on the vertices at \p x into their velocities, both as columns().
  Eigen::MatrixXd mobility(const std::vector<mesh::Vec3>& x) const {
    const auto n = static_cast<Eigen::Index>(x.size());
    std::vector<double> area(n, 0);
    for (const auto& t : triangles_)
      for (const int k : t) area[k] += area_of(x, t) / 3;
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(3 * n, 3 * n);
#pragma omp parallel for schedule(static)
    for (Eigen::Index part = 0; part < parts; ++part)
      add_all_triangles(x, n * part / parts, n * (part + 1) / parts, out);
    for (int d = 0; d < 3; ++d)
      for (int e = 0; e < d; ++e) out.block(d * n, e * n, n, n) = out.block(e * n, d * n, n, n);
    for (Eigen::Index k = 0; k < n; ++k)
      for (int d = 0; d < 3; ++d) out.col(d * n + k) /= 8 * M_PI * viscosity_ * area[k];
    return out;
  }

  /// n vectors as one column: all x, all y, all z.
  static Eigen::VectorXd columns(const std::vector<mesh::Vec3>& v) {
    const auto n = static_cast<Eigen::Index>(v.size());
    Eigen::VectorXd out(3 * n);
    for (Eigen::Index k = 0; k < n; ++k)
      for (int d = 0; d < 3; ++d) out[d * n + k] = v[k][d];
    return out;
  }
  static std::vector<mesh::Vec3> vectors(const Eigen::VectorXd& v) {
    const auto n = v.size() / 3;
    std::vector<mesh::Vec3> out(n);
    for (Eigen::Index k = 0; k < n; ++k)
      for (int d = 0; d < 3; ++d) out[k][d] = v[d * n + k];
    return out;
  }

 private:
  using Triangle = std::array<int, 3>;
  using Corners = std::array<double, 3>;  ///< barycentric coordinates
  static constexpr Eigen::Index parts = 8;
  static constexpr double near = 8;  ///< square of the distance from which three points do, triangle areas
  static constexpr std::array<Corners, 3> three_points{
      {{2. / 3, 1. / 6, 1. / 6}, {1. / 6, 2. / 3, 1. / 6}, {1. / 6, 1. / 6, 2. / 3}}};
  static constexpr int entries[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};

  static mesh::Vec3 at(const std::vector<mesh::Vec3>& f, const Triangle& t, const Corners& b) {
    mesh::Vec3 sum{};
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d) sum[d] += b[i] * f[t[i]][d];
    return sum;
  }
  static double area_of(const std::vector<mesh::Vec3>& x, const Triangle& t) {
    return 0.5 * mesh::norm(mesh::cross(mesh::subtract(x[t[1]], x[t[0]]), mesh::subtract(x[t[2]], x[t[0]])));
  }
  /// The upper half of I/r + r r/r^3, in the order of entries.
  static std::array<double, 6> stokeslet(double x, double y, double z) {
    const double inverse = 1 / std::sqrt(x * x + y * y + z * z), cubed = inverse * inverse * inverse;
    return {inverse + cubed * x * x, cubed * x * y, cubed * x * z,
            inverse + cubed * y * y, cubed * y * z, inverse + cubed * z * z};
  }

  /// Rows of the vertices \p from to \p to (each thread its own: sums do not depend on the number of threads)
  /// of the blocks on and above the diagonal, for unit force per area at the columns' vertices.
  void add_all_triangles(const std::vector<mesh::Vec3>& x, Eigen::Index from, Eigen::Index to,
                         Eigen::MatrixXd& out) const {
    const auto n = static_cast<Eigen::Index>(x.size());
    for (const auto& t : triangles_) {
      const double size = area_of(x, t);
      std::array<mesh::Vec3, 3> points;
      for (int p = 0; p < 3; ++p) points[p] = at(x, t, three_points[p]);
      const mesh::Vec3 centre = at(x, t, {1. / 3, 1. / 3, 1. / 3});
      for (Eigen::Index k = from; k < to; ++k) {
        double sum[3][6] = {};
        const auto add = [&](const Corners& b, const mesh::Vec3& from_here, double weight) {
          const auto g = stokeslet(x[k][0] - from_here[0], x[k][1] - from_here[1], x[k][2] - from_here[2]);
          for (int i = 0; i < 3; ++i)
            for (int e = 0; e < 6; ++e) sum[i][e] += weight * b[i] * g[e];
        };
        const mesh::Vec3 away = mesh::subtract(x[k], centre);
        if (mesh::dot(away, away) > near * size)
          for (int p = 0; p < 3; ++p) add(three_points[p], points[p], size / 3);
        else
          each_near_point(t, static_cast<int>(k),
                          [&](const Corners& b, double weight) { add(b, at(x, t, b), size * weight); });
        for (int i = 0; i < 3; ++i)
          for (int e = 0; e < 6; ++e) out(entries[e][0] * n + k, entries[e][1] * n + t[i]) += sum[i][e];
      }
    }
  }

  /// Points and weights (which sum to one) on a triangle near or at vertex \p k.
  template <class Add>
  static void each_near_point(const Triangle& t, int k, const Add& add) {
    int corner = -1;
    for (int i = 0; i < 3; ++i)
      if (t[i] == k) corner = i;
    if (corner >= 0) {
      // Duffy: points (1 - s) x_k + s ((1 - q) x_1 + q x_2) have area element 2 s, and 1/r takes the s.
      constexpr double node[] = {0.0337652428984240, 0.1693953067668678, 0.3806904069584016,
                                 0.6193095930415985, 0.8306046932331322, 0.9662347571015760},
                       weight[] = {0.0856622461895852, 0.1803807865240693, 0.2339569672863455,
                                   0.2339569672863455, 0.1803807865240693, 0.0856622461895852};
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
          Corners b{};
          b[corner] = 1 - node[i];
          b[(corner + 1) % 3] = node[i] * (1 - node[j]), b[(corner + 2) % 3] = node[i] * node[j];
          add(b, 2 * node[i] * weight[i] * weight[j]);
        }
    } else {
      // Sixteen triangles, three points each.
      constexpr int cuts = 4;
      for (int i = 0; i < cuts; ++i)
        for (int j = 0; j + i < cuts; ++j)
          for (int down = 0; down < (i + j + 1 < cuts ? 2 : 1); ++down)
            for (const auto& p : three_points) {
              const double u = (i + (down ? 1 - p[0] : p[0])) / cuts,
                           v = (j + (down ? 1 - p[1] : p[1])) / cuts;
              add({u, v, 1 - u - v}, 1. / (3 * cuts * cuts));
            }
    }
  }

  std::vector<Triangle> triangles_;
  double viscosity_;
};

/// A membrane in unbounded flow without inertia: dx/dt = u_inf(x) + mobility x forces. Each step takes the
/// mobility of the shape half a step ahead (by what it did in the last one) and as many stages of a
/// Runge-Kutta-Chebyshev formula of second order (Sommeijer, Shampine, Verwer 1998) as the stiffest of the
/// membrane's modes asks for, which decay without oscillation: stages stabilise a step as their square. Their
/// estimate of the error of a step keeps advance() from taking one that is too long.
class MembraneInStokesFlow {
 public:
  using Flow = std::function<mesh::Vec3(const mesh::Vec3&)>;

  MembraneInStokesFlow(const npfem::CellType& type, const mesh::TriangleMesh& surface, double viscosity,
                       Flow far, const std::vector<mesh::Vec3>& start)
      : type_(type),
        fluid_(surface, viscosity),
        far_(std::move(far)),
        x_(BoundaryIntegral::columns(start)),
        before_(x_),
        stiffest_(Eigen::VectorXd::Random(x_.size())) {}

  std::vector<mesh::Vec3> vertices() const { return BoundaryIntegral::vectors(x_); }

  /// In equal steps, or halves, quarters... where one would add more than \p tolerance of the membrane's size
  /// (root mean square over the vertices) to the error.
  void advance(double time, double tolerance = 1e-4) {
    for (double left = time; left > 1e-9 * time;) {
      const double dt = std::min(longest_, left);
      auto [next, error] = after(dt);
      if (error < tolerance * x_.norm()) {
        left -= dt;
        longest_ = error < tolerance * x_.norm() / 10 ? 2 * dt : dt;
        take(dt, std::move(next));
      } else if (dt > 1e-4 * time) {  // also where it blew up and no number compares
        longest_ = dt / 2;
      } else {
        throw std::runtime_error("the membrane in Stokes flow blew up");
      }
    }
  }
  /// One step, however large its error.
  void step(double dt) { take(dt, after(dt).first); }

 private:
  /// Where the vertices are after one step, and the norm of what that step adds to their error.
  std::pair<Eigen::VectorXd, double> after(double dt) {
    mobility_ = fluid_.mobility(BoundaryIntegral::vectors(x_ + 0.5 * dt / last_ * (x_ - before_)));
    const Eigen::VectorXd f0 = rate(x_);
    const int stages = std::max(2, static_cast<int>(std::ceil(std::sqrt(1 + 1.7 * dt * decay_rate(f0)))));
    // Chebyshev polynomials T, their first and second derivatives at w0.
    constexpr double damping = 2. / 13;
    const double w0 = 1 + damping / (stages * stages);
    std::vector<double> T{1, w0}, T1{0, 1}, T2{0, 0};
    for (int j = 2; j <= stages; ++j) {
      T.push_back(2 * w0 * T[j - 1] - T[j - 2]);
      T1.push_back(2 * T[j - 1] + 2 * w0 * T1[j - 1] - T1[j - 2]);
      T2.push_back(4 * T1[j - 1] + 2 * w0 * T2[j - 1] - T2[j - 2]);
    }
    const double w1 = T1[stages] / T2[stages];
    const auto b = [&](int j) { return T2[std::max(j, 2)] / std::pow(T1[std::max(j, 2)], 2); };
    Eigen::VectorXd older = x_, y = x_ + b(1) * w1 * dt * f0;
    for (int j = 2; j <= stages; ++j) {
      const double mu = 2 * b(j) * w0 / b(j - 1), nu = -b(j) / b(j - 2), slope = 2 * b(j) * w1 / b(j - 1);
      Eigen::VectorXd next =
          (1 - mu - nu) * x_ + mu * y + nu * older + slope * dt * (rate(y) - (1 - b(j - 1) * T[j - 1]) * f0);
      older = std::exchange(y, std::move(next));
    }
    const double error = (0.8 * (x_ - y) + 0.4 * dt * (f0 + rate(y))).norm();
    return {std::move(y), error};
  }
  void take(double dt, Eigen::VectorXd next) {
    before_ = std::exchange(x_, std::move(next));
    last_ = dt;
  }
  Eigen::VectorXd rate(const Eigen::VectorXd& at) const {
    const auto x = BoundaryIntegral::vectors(at);
    Eigen::VectorXd v = mobility_ * BoundaryIntegral::columns(npfem::forces(type_, x));
    const auto n = static_cast<Eigen::Index>(x.size());
    for (Eigen::Index k = 0; k < n; ++k) {
      const mesh::Vec3 u = far_(x[k]);
      for (int d = 0; d < 3; ++d) v[d * n + k] += u[d];
    }
    return v;
  }
  /// Of the stiffest mode, from above: a power iteration that goes on from the last step's.
  double decay_rate(const Eigen::VectorXd& f0) {
    double found = 0;
    for (int i = 0, most = before_ == x_ ? 50 : 4; i < most; ++i) {
      const double small = 1e-6 * x_.norm() / stiffest_.norm();
      stiffest_ = (rate(x_ + small * stiffest_) - f0) / (small * stiffest_.norm());
      found = stiffest_.norm();
    }
    return 1.2 * found;
  }

  const npfem::CellType& type_;
  BoundaryIntegral fluid_;
  Flow far_;
  Eigen::VectorXd x_, before_;  ///< vertices now and a step ago
  double last_ = 1;             ///< how long that step was
  double longest_ = std::numeric_limits<double>::infinity();
  Eigen::VectorXd stiffest_;  ///< the mode that decays fastest
  Eigen::MatrixXd mobility_;
};

}  // namespace hemowalk::test
