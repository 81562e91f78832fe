// What would populations in 16 bits cost? One column of nodes across the gap, collided by the solver's own
// collision in single precision; after every step each population f - w, times a power of two, is rounded to
// a 16-bit number, as half-precision storage would. Prints flow errors; the decision is in
// docs/evidence/gpu.md.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "resolved/lbm/collision.hpp"

namespace hemowalk::lbm {
namespace {

/// A floating-point format for |f - w| < 1 (Lehmann et al. 2022, Phys. Rev. E 106, 015308).
struct Storage {
  const char* name;
  int bits;      ///< of the fraction; 0: single precision
  int smallest;  ///< exponent below which the spacing no longer falls

  float operator()(float f) const {
    if (bits == 0 || f == 0) return f;
    int exponent = 0;
    (void)std::frexp(f, &exponent);  // |f| in [2^(exponent - 1), 2^exponent)
    const int grain = std::max(exponent - 1, smallest) - bits;
    return std::ldexp(std::nearbyint(std::ldexp(f, -grain)), grain);
  }
};
constexpr Storage storages[] = {{"single", 0, 0},
                                {"half: 5 bits exponent, 10 fraction", 10, -29},
                                {"half: 4 bits exponent, 11 fraction", 11, -14}};

/// Flow along z that depends on y alone: n nodes between walls at rest and at speed U, or a period of n.
class Column {
 public:
  Column(int n, bool walls, double U, double force, const Storage& storage)
      : n_(n), walls_(walls), U_(U), force_(force), storage_(storage), f_(n), next_(n) {}

  template <class Velocity>
  void start(const Velocity& velocity) {
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < directions; ++i)
        f_[j][i] = storage_(static_cast<float>(equilibrium(i, 1, {0, 0, velocity(j + 0.5) - force_ / 2})));
  }
  void run(int steps) {
    for (int s = 0; s < steps; ++s) step();
  }
  /// Physical velocity along z.
  double velocity(int j) const {
    double density = 1, momentum = 0;
    for (int i = 0; i < directions; ++i) density += f_[j][i], momentum += c[i][2] * f_[j][i];
    return (momentum + force_ / 2) / density;
  }

 private:
  struct Node {
    float f[directions];
    float& operator[](int i) { return f[i]; }
    float operator[](int i) const { return f[i]; }
  };
  void step() {
    for (Node& node : f_) collide(node.f, 0.0f, 0.0f, static_cast<float>(force_), rate_);
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < directions; ++i) {
        const int to = j + c[i][1];
        const float f = storage_(f_[j][i]);
        if (!walls_ || (to >= 0 && to < n_))
          next_[(to + n_) % n_][i] = f;
        else
          next_[j][opposite(i)] = f - static_cast<float>(to < 0 ? 0 : 6 * weight(i) * c[i][2] * U_);
      }
    f_.swap(next_);
  }

  int n_;
  bool walls_;
  double U_, force_;
  const Storage& storage_;
  std::vector<Node> f_, next_;
  Relaxation<float> rate_ = Relaxation<float>::make(1 / 2.0, 1 / (0.5 + 0.1875 / 1.5), 0.5 - 1 / 16.0);
};

constexpr double viscosity = 0.5;  // tau 2

/// Largest error of a profile, relative to \p scale.
template <class Exact>
double profile_error(const Column& column, int n, double scale, const Exact& exact) {
  double worst = 0;
  for (int j = 0; j < n; ++j) worst = std::max(worst, std::abs(column.velocity(j) - exact(j + 0.5)));
  return worst / scale;
}

void couette(const Storage& storage, double U, int n) {
  Column column(n, true, U, 0, storage);
  column.start([](double) { return 0.0; });
  column.run(10 * n * n);  // five times n^2/nu: exp(-49) of the start is left
  const double rate = U / n, core = (column.velocity(3 * n / 4) - column.velocity(n / 4)) / (n / 2) / rate;
  std::printf(
      "  Couette from rest, U %-8g %3d nodes: profile error %.1e U, core shear %.4f, wall shear %.4f\n", U, n,
      profile_error(column, n, U, [&](double y) { return rate * y; }), core,
      column.velocity(0) / (0.5 * rate));
}

void poiseuille(const Storage& storage, double U, int n) {
  const auto exact = [&](double y) { return 4 * U * y / n * (1 - y / n); };
  double error[2];
  for (const bool rest : {false, true}) {
    Column column(n, true, 0, 8 * viscosity * U / n / n, storage);
    column.start([&](double y) { return rest ? 0 : exact(y); });
    column.run(10 * n * n);
    error[rest] = profile_error(column, n, U, exact);
  }
  std::printf(
      "  Poiseuille, largest u %-8g %3d nodes: profile error %.1e u from the solution, %.1e from rest\n", U,
      n, error[0], error[1]);
}

void shear_wave(const Storage& storage, double U, int n) {
  Column column(n, false, 0, 0, storage);
  const double k = 2 * M_PI / n;
  column.start([&](double y) { return U * std::sin(k * y); });
  const auto amplitude = [&] {
    double sum = 0;
    for (int j = 0; j < n; ++j) sum += 2 * column.velocity(j) * std::sin(k * (j + 0.5)) / n;
    return sum;
  };
  const int steps = static_cast<int>(1 / (viscosity * k * k));  // to 1/e
  double seen[5] = {amplitude()};
  for (int i = 1; i < 5; ++i) {
    column.run(steps);
    seen[i] = amplitude();
  }
  const auto relative = [&](int i) { return std::log(seen[i] / seen[i + 1]) / steps / k / k / viscosity; };
  std::printf(
      "  shear wave, U %-8g %3d nodes: viscosity %.4f of its value at first, %.4f from e^-3 to e^-4\n", U, n,
      relative(0), relative(3));
}

}  // namespace
}  // namespace hemowalk::lbm

int main() {
  using namespace hemowalk::lbm;
  for (const Storage& storage : storages) {
    std::printf("%s\n", storage.name);
    for (const double U : {0.02, 1.25e-3, 1.25e-4}) {
      for (const int n : {32, 64, 100}) couette(storage, U, n);
      for (const int n : {32, 64, 100}) poiseuille(storage, U, n);
      shear_wave(storage, U, 64);
    }
  }
}
