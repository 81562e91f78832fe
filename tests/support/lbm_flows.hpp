#pragma once
/// \file Small helpers of the fluid tests: fields, random forces, sums.

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "resolved/lbm/fluid.hpp"

namespace hemowalk::test {

template <class Real>
using Field = Array<Node4<Real>>;

template <class Body>
void for_nodes(const Block& b, Body&& body) {
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i) body(i, j, k);
}

/// Uniform random forces in [-amplitude, amplitude]; halo and companion hold rubbish on purpose.
template <class Real>
class RandomForce {
 public:
  RandomForce(const Block& block, double amplitude, unsigned seed = 1)
      : field(block.size()), block_(block), amplitude_(amplitude), generator_(seed) {
    for (auto& node : field) node = {Real(NAN), Real(NAN), Real(NAN), Real(NAN)};
  }
  void next() {
    std::uniform_real_distribution<double> uniform(-amplitude_, amplitude_);
    for_nodes(block_, [&](int i, int j, int k) {
      const double x = uniform(generator_), y = uniform(generator_), z = uniform(generator_);
      field[block_.at(i, j, k)] = {Real(x), Real(y), Real(z), Real(NAN)};
    });
  }
  View<const Node4<Real>> view() const { return field.view(); }
  Field<Real> field;

 private:
  Block block_;
  double amplitude_;
  std::mt19937 generator_;
};

/// Largest difference of two interior fields, any component.
template <class A, class B>
double largest_difference(const Block& b, const Field<A>& a, const Field<B>& c) {
  double worst = 0;
  const auto grow = [&](double d) {
    if (!(std::fabs(d) <= worst)) worst = std::fabs(d);  // lets NaN through
  };
  for_nodes(b, [&](int i, int j, int k) {
    const auto& p = a[b.at(i, j, k)];
    const auto& q = c[b.at(i, j, k)];
    grow(double(p.x) - double(q.x));
    grow(double(p.y) - double(q.y));
    grow(double(p.z) - double(q.z));
    grow(double(p.w) - double(q.w));
  });
  return worst;
}

template <class Real>
bool bitwise_equal(const Block& b, const Field<Real>& a, const Field<Real>& c) {
  bool equal = true;
  for_nodes(b, [&](int i, int j, int k) {
    const auto& p = a[b.at(i, j, k)];
    const auto& q = c[b.at(i, j, k)];
    equal = equal && p.x == q.x && p.y == q.y && p.z == q.z && p.w == q.w;
  });
  return equal;
}

inline double round_off(float) { return 0x1p-24; }
inline double round_off(double) { return 0x1p-53; }

}  // namespace hemowalk::test
