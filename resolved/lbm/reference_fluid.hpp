#pragma once
/// \file ReferenceFluid: the same face as Fluid<double>, written to be read. Two lattices, pull streaming,
/// forcing in its textbook form. It defines what is right; the fast fluid is tested against it. Some 50 times
/// slower.

#include <array>
#include <vector>

#include "resolved/lbm/fluid.hpp"

namespace hemowalk::lbm {

class ReferenceFluid {
 public:
  ReferenceFluid(const Block& block, const Parameters& parameters)
      : block_(block),
        parameters_(parameters),
        solid_(block.interior(), false),
        f_(block.interior()),
        post_(f_.size()) {
    initialise([](double, double, double) { return FlowPoint{}; });
  }

  void set_solid(const std::function<bool(int, int, int)>& solid) {
    for (std::size_t n = 0; n < f_.size(); ++n) solid_[n] = solid(x(n), y(n), z(n));
  }

  /// Equilibrium plus -w tau rho 3 (c_a c_b - delta_ab/3) du_b/dx_a.
  void initialise(const std::function<FlowPoint(double, double, double)>& flow) {
    for (std::size_t n = 0; n < f_.size(); ++n) {
      const double at[3] = {x(n) + 0.5, y(n) + 0.5, z(n) + 0.5};
      const FlowPoint here = flow(at[0], at[1], at[2]);
      double u[3];
      for (int a = 0; a < 3; ++a) u[a] = here.velocity[a] - 0.5 * parameters_.body_force[a] / here.density;
      for (int i = 0; i < directions; ++i) {
        f_[n][i] = solid_[n] ? weight(i) : full_equilibrium(i, here.density, u);
        for (int a = 0; a < 3 && !solid_[n]; ++a) {
          double up[3] = {at[0], at[1], at[2]}, down[3] = {at[0], at[1], at[2]};
          up[a] += 0.5, down[a] -= 0.5;
          const Vec3 plus = flow(up[0], up[1], up[2]).velocity,
                     minus = flow(down[0], down[1], down[2]).velocity;
          for (int b = 0; b < 3; ++b)
            f_[n][i] -= 3 * weight(i) * here.density * parameters_.tau *
                        (c[i][a] * c[i][b] - (a == b) / 3.0) * (plus[b] - minus[b]);
        }
      }
    }
  }

  void moments(View<Node4<double>> velocity) const {
    for (std::size_t n = 0; n < f_.size(); ++n) {
      const auto [rho, jx, jy, jz] = moments_of(f_[n]);
      velocity[block_.at(x(n), y(n), z(n))] =
          solid_[n] ? Node4<double>{} : Node4<double>{jx / rho, jy / rho, jz / rho, rho - 1};
    }
  }

  void collide_and_stream(View<const Node4<double>> force) {
    for (std::size_t n = 0; n < f_.size(); ++n)
      if (!solid_[n]) post_[n] = collided(f_[n], force_on(n, force));
    impulse_ = {};
    for (std::size_t n = 0; n < f_.size(); ++n)
      for (int i = 0; i < directions && !solid_[n]; ++i) f_[n][i] = pulled(n, i);
  }

  void advance(View<const Node4<double>> force, View<Node4<double>> velocity) {
    collide_and_stream(force);
    moments(velocity);
  }

  WallImpulse wall_impulse() const { return impulse_; }

  Totals totals() const {
    Totals t;
    for (std::size_t n = 0; n < f_.size(); ++n) {
      if (solid_[n]) continue;
      const auto [rho, jx, jy, jz] = moments_of(f_[n]);
      t.mass += rho - 1;
      t.momentum = {t.momentum[0] + jx, t.momentum[1] + jy, t.momentum[2] + jz};
    }
    return t;
  }

 private:
  using Populations = std::array<double, directions>;

  int x(std::size_t n) const { return static_cast<int>(n % block_.nx); }
  int y(std::size_t n) const { return static_cast<int>(n / block_.nx % block_.ny); }
  int z(std::size_t n) const { return static_cast<int>(n / block_.nx / block_.ny); }
  std::size_t node(int i, int j, int k) const {
    const auto wrap = [](int a, int n) { return (a + n) % n; };
    return (static_cast<std::size_t>(wrap(k, block_.nz)) * block_.ny + wrap(j, block_.ny)) * block_.nx +
           wrap(i, block_.nx);
  }

  static double full_equilibrium(int i, double rho, const double (&u)[3]) {
    const double cu = c[i][0] * u[0] + c[i][1] * u[1] + c[i][2] * u[2];
    return weight(i) * rho * (1 + 3 * cu + 4.5 * cu * cu - 1.5 * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
  }

  static std::array<double, 4> moments_of(const Populations& f) {
    std::array<double, 4> m{};
    for (int i = 0; i < directions; ++i) {
      m[0] += f[i];
      for (int a = 0; a < 3; ++a) m[a + 1] += c[i][a] * f[i];
    }
    return m;
  }

  Vec3 force_on(std::size_t n, View<const Node4<double>> force) const {
    Vec3 F = parameters_.body_force;
    if (!force.data) return F;
    const Node4<double>& node = force[block_.at(x(n), y(n), z(n))];
    return {F[0] + node.x, F[1] + node.y, F[2] + node.z};
  }

  /// TRT; BGK is TRT with equal rates. Guo: equilibrium of u* + F/(2 rho) and source (1 - omega/2) S, each
  /// parity with its omega. Shan-Chen: equilibrium of u* + F/(omega rho), each parity with its omega.
  Populations collided(const Populations& f, const Vec3& F) const {
    const bool guo = parameters_.forcing == Forcing::guo;
    const double tau_plus = parameters_.tau;
    const double tau_minus =
        parameters_.collision == Collision::bgk ? tau_plus : 0.5 + parameters_.magic / (tau_plus - 0.5);
    const auto m = moments_of(f);
    double even_u[3], odd_u[3];
    for (int a = 0; a < 3; ++a) {
      even_u[a] = (m[a + 1] + (guo ? 0.5 : tau_plus) * F[a]) / m[0];
      odd_u[a] = (m[a + 1] + (guo ? 0.5 : tau_minus) * F[a]) / m[0];
    }
    Populations even, odd, result;  // changes of the part even (odd) in c, before symmetrising
    for (int i = 0; i < directions; ++i) {
      double cu = 0, cF = 0, uF = 0;
      for (int a = 0; a < 3; ++a) cu += c[i][a] * even_u[a], cF += c[i][a] * F[a], uF += even_u[a] * F[a];
      const double source = guo ? weight(i) * (3 * cF - 3 * uF + 9 * cu * cF) : 0;
      even[i] = (full_equilibrium(i, m[0], even_u) - f[i]) / tau_plus + (1 - 0.5 / tau_plus) * source;
      odd[i] = (full_equilibrium(i, m[0], odd_u) - f[i]) / tau_minus + (1 - 0.5 / tau_minus) * source;
    }
    for (int i = 0; i < directions; ++i) {
      const int o = opposite(i);
      result[i] = f[i] + (even[i] + even[o]) / 2 + (odd[i] - odd[o]) / 2;
    }
    return result;
  }

  /// Population \p i that arrives at node \p n; books the momentum left at a wall on the way.
  double pulled(std::size_t n, int i) {
    const int j = y(n) - c[i][1];
    const bool low = parameters_.walls_y && j < 0, high = parameters_.walls_y && j >= block_.ny;
    const std::size_t from = node(x(n) - c[i][0], j, z(n) - c[i][2]);
    if (!low && !high && !solid_[from]) return post_[from][i];
    const double leaving = post_[n][opposite(i)];
    double arriving = leaving;
    if (low || high) {
      const Vec3& u = low ? parameters_.lower_wall_velocity : parameters_.upper_wall_velocity;
      for (int a = 0; a < 3; ++a) arriving += 6 * weight(i) * c[i][a] * u[a];
    }
    Vec3& impulse = low ? impulse_.lower : high ? impulse_.upper : impulse_.solid;
    for (int a = 0; a < 3; ++a) impulse[a] -= c[i][a] * (leaving + arriving - 2 * weight(i));
    return arriving;
  }

  Block block_;
  Parameters parameters_;
  std::vector<bool> solid_;
  std::vector<Populations> f_, post_;
  WallImpulse impulse_;
};

}  // namespace hemowalk::lbm
