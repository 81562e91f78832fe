// Everything of Fluid that is not in a step: set-up, sums, profiles, checkpoints.

#include <cstring>

#include "core/check.hpp"
#include "core/simd.hpp"
#include "resolved/lbm/fluid.hpp"
#include "resolved/lbm/state.hpp"

namespace hemowalk::lbm {

template <class Real>
void Fluid<Real>::set_solid(const std::function<bool(int, int, int)>& solid) {
  const int nx = block_.nx, ny = block_.ny, nz = block_.nz;
  constexpr int halo = Block::halo;
  solid_.assign(block_.size(), 0);
  for (int k = -halo; k < nz + halo; ++k)
    for (int j = -halo; j < ny + halo; ++j) {
      if (below(j) || above(j)) continue;
      for (int i = -halo; i < nx + halo; ++i)
        solid_[block_.at(i, j, k)] = solid((i + halo * nx) % nx, (j + halo * ny) % ny,
                                           parameters_.divided_z ? k : (k + halo * nz) % nz);
    }
  kind_.assign(block_.interior(), bulk_node);
  mixed_.assign(static_cast<std::size_t>(ny) * nz, 0);
  solid_sum_.assign(mixed_.size(), Vec3{});
  fluid_nodes_ = 0;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const std::size_t r = static_cast<std::size_t>(k) * ny + j;
        std::uint8_t& kind = kind_[r * nx + i];
        for (int d = 1; d < directions; ++d)
          if (is_solid(i + c[d][0], j + c[d][1], k + c[d][2])) kind = border_node;
        if (is_solid(i, j, k)) kind = solid_node;
        fluid_nodes_ += kind != solid_node;
        if (kind != bulk_node) mixed_[r] = 1;
      }
}

/// Equilibrium and first-order non-equilibrium, g_neq = 4.5 w (c_a c_b - delta_ab/3) Pi_ab with
/// Pi = -(2/3) rho tau S, S the strain rate.
template <class Real>
void Fluid<Real>::set_populations(int i, int j, int k,
                                  const std::function<FlowPoint(double, double, double)>& flow) {
  Real* own = f_.data() + row(j, k) + i;
  if (is_solid(i, j, k)) {
    for (int d = 0; d < directions; ++d) own[d * stride_] = 0;
    return;
  }
  const double at[3] = {i + 0.5, j + 0.5, k + 0.5};
  const FlowPoint here = flow(at[0], at[1], at[2]);
  double gradient[3][3];  // d u_b / d x_a
  for (int a = 0; a < 3; ++a) {
    const double h[3] = {a == 0 ? 0.5 : 0, a == 1 ? 0.5 : 0, a == 2 ? 0.5 : 0};
    const Vec3 ahead = flow(at[0] + h[0], at[1] + h[1], at[2] + h[2]).velocity;
    const Vec3 behind = flow(at[0] - h[0], at[1] - h[1], at[2] - h[2]).velocity;
    for (int b = 0; b < 3; ++b) gradient[a][b] = ahead[b] - behind[b];
  }
  double u[3];
  for (int a = 0; a < 3; ++a) u[a] = here.velocity[a] - 0.5 * parameters_.body_force[a] / here.density;
  for (int d = 0; d < directions; ++d) {
    double strain = 0;  // (c_a c_b - delta_ab/3) S_ab
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) strain += (c[d][a] * c[d][b] - (a == b ? 1.0 / 3 : 0)) * gradient[a][b];
    own[d * stride_] = static_cast<Real>(equilibrium(d, here.density, u) -
                                         3 * weight(d) * here.density * parameters_.tau * strain);
  }
}

template <class Real>
void Fluid<Real>::initialise(const std::function<FlowPoint(double, double, double)>& flow) {
  swapped_ = false;
  steps_ = 0;
  for (Vec3& sum : wall_sum_) sum = {};
  for (Vec3& sum : solid_sum_) sum = {};
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (int i = 0; i < block_.nx; ++i) set_populations(i, j, k, flow);
}

template <class Real>
void Fluid<Real>::initialise(const std::function<double(double)>& velocity_z) {
  initialise([&](double, double y, double) { return FlowPoint{1, {0, 0, velocity_z(y)}}; });
}

/// Deviations f_i - w_i of a fluid node after streaming, whatever the parity of the step.
template <class Real>
void Fluid<Real>::populations(int i, int j, int k, double (&f)[directions]) const {
  Real* p[directions];
  Real wall_term[directions];
  locate_node(i, j, k, swapped_, p, wall_term);
  for (int d = 0; d < directions; ++d) f[d] = static_cast<double>(*p[d] + wall_term[d]);
}

template <class Real>
WallImpulse Fluid<Real>::wall_impulse() const {
  WallImpulse sum;
  const auto nz = static_cast<std::size_t>(block_.nz);
  for (std::size_t k = 0; k < nz; ++k)
    for (int a = 0; a < 3; ++a) {
      sum.lower[a] += wall_sum_[k][a];
      sum.upper[a] += wall_sum_[nz + k][a];
    }
  for (const Vec3& row : solid_sum_)
    for (int a = 0; a < 3; ++a) sum.solid[a] += row[a];
  return sum;
}

namespace {

inline double sum_of(double v) { return v; }
template <class N>
double sum_of(const N& v) {
  return stdx::reduce(v);
}

}  // namespace

/// body(f, j, i) for the fluid nodes of plane k: f the deviations after streaming, of node i alone (double)
/// or of as many nodes from i on as a pack of double holds.
template <class Real>
template <class Body>
void Fluid<Real>::visit_plane(int k, const Body& body) const {
  constexpr int W = 8;
  using N = Pack<double, W>;
  for (int j = 0; j < block_.ny; ++j) {
    const bool plain = mixed_.empty() || !mixed_[static_cast<std::size_t>(k) * block_.ny + j];
    const RowPointers<Real> row = locate(j, k, swapped_);
    int i = 0;
    for (; plain && i + W <= block_.nx; i += W) {
      N f[directions];
      for (int d = 0; d < directions; ++d) {
        alignas(64) double lane[W];
        for (int l = 0; l < W; ++l) lane[l] = static_cast<double>(row.p[d][i + l] + row.wall_term[d]);
        f[d] = N(lane, stdx::element_aligned);
      }
      body(f, j, i);
    }
    for (; i < block_.nx; ++i) {
      if (is_solid(i, j, k)) continue;
      double f[directions];
      populations(i, j, k, f);
      body(f, j, i);
    }
  }
}

template <class Real>
Totals Fluid<Real>::totals() const {
  std::vector<Totals> plane(block_.nz);
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int k = 0; k < block_.nz; ++k) {
    Totals& sum = plane[k];
    visit_plane(k, [&](auto& f, int, int) {
      split_parities(f);
      const auto m = moments_of_parities(f);
      sum.mass += sum_of(m.density);
      sum.momentum[0] += sum_of(m.x), sum.momentum[1] += sum_of(m.y), sum.momentum[2] += sum_of(m.z);
    });
  }
  Totals total;
  for (const Totals& p : plane) {
    total.mass += p.mass;
    for (int a = 0; a < 3; ++a) total.momentum[a] += p.momentum[a];
  }
  return total;
}

namespace {

/// Energy and losses of nodes in their coming collision, added to \p sum. \p f: deviations; even and odd
/// parts separate because the norm does.
template <class N>
HEMO_INLINE void add_energy(N (&f)[directions], const N (&F)[3], const Vec3& g, double even_loss,
                            double odd_loss, EnergyFlows& sum) {
  N held(0), even(0), odd(0);
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    held += f[i] * f[i] * (1 / (6 * weight(i)));
  });
  split_parities(f);
  const Moments<N> m = moments_of_parities(f);
  const N inverse = 1 / (1 + m.density), jj = (m.x * m.x + m.y * m.y + m.z * m.z) * inverse;
  const N isotropic = m.density - 1.5 * jj, rest = f[0] - isotropic * (1.0 / 3);
  N xx(0), yy(0), zz(0), xy(0), xz(0), yz(0);
  unroll<9>([&](auto pair) HEMO_INLINE_LAMBDA {
    constexpr int i = 2 * decltype(pair)::value + 1, x = c[i][0], y = c[i][1], z = c[i][2];
    constexpr double w = weight(i);
    const N cj = along<i>(m.x, m.y, m.z);
    const N s = f[i] - 2 * w * (isotropic + 4.5 * cj * cj * inverse), a = f[i + 1] - 6 * w * cj;
    even += s * s * (0.5 / w), odd += a * a * (0.5 / w);  // two directions, half of the sum in each
    if constexpr (x != 0) xx += s;
    if constexpr (y != 0) yy += s;
    if constexpr (z != 0) zz += s;
    if constexpr (x * y != 0) xy += x * y * s;
    if constexpr (x * z != 0) xz += x * z * s;
    if constexpr (y * z != 0) yz += y * z * s;
  });
  const N viscous = 4.5 * even_loss * (xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
  const N ux = m.x + 0.5 * (F[0] + g[0]), uy = m.y + 0.5 * (F[1] + g[1]), uz = m.z + 0.5 * (F[2] + g[2]);
  sum.held += sum_of(held), sum.viscous += sum_of(viscous);
  sum.stressless += sum_of(N(even_loss * (even + 3 * rest * rest) + odd_loss * odd - viscous));
  sum.force += sum_of(N(F[0] * ux + F[1] * uy + F[2] * uz));
  sum.body_force += sum_of(N(g[0] * ux + g[1] * uy + g[2] * uz));
}

}  // namespace

template <class Real>
EnergyFlows Fluid<Real>::energy(View<const Node4<Real>> force) const {
  std::vector<EnergyFlows> plane(block_.nz);
  const auto loss = [](double omega) { return omega * (2 - omega) / 6; };
  const double even = loss(1 / parameters_.tau), odd = loss(odd_rate(parameters_));
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int k = 0; k < block_.nz; ++k)
    visit_plane(k, [&](auto& f, int j, int i) {
      using N = std::remove_reference_t<decltype(f[0])>;
      N F[3] = {N(0), N(0), N(0)};
      if (force.data) {
        const Node4<Real>* at = force.data + block_.at(i, j, k);
        if constexpr (std::is_same_v<N, double>) {
          F[0] = at->x, F[1] = at->y, F[2] = at->z;
        } else {
          F[0] = N([&](auto l) { return static_cast<double>(at[l].x); });
          F[1] = N([&](auto l) { return static_cast<double>(at[l].y); });
          F[2] = N([&](auto l) { return static_cast<double>(at[l].z); });
        }
      }
      add_energy(f, F, parameters_.body_force, even, odd, plane[k]);
    });
  EnergyFlows total;
  for (const EnergyFlows& p : plane) {
    total.held += p.held, total.viscous += p.viscous, total.stressless += p.stressless;
    total.force += p.force, total.body_force += p.body_force;
  }
  return total;
}

/// The stress follows from the populations before collision: with the force, Chapman-Enskog gives
/// sigma = -(1 - omega_plus/2) [Pi - rho u* u* + F F/(4 rho)] off the diagonal, Pi = sum c c f.
template <class Real>
PlanarProfiles Fluid<Real>::profiles(View<const Node4<Real>> force) const {
  const int ny = block_.ny;
  PlanarProfiles result{std::vector<Vec3>(ny), std::vector<double>(ny), std::vector<double>(ny),
                        std::vector<double>(ny)};
  const double factor = -(1 - 0.5 / parameters_.tau);
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int j = 0; j < ny; ++j) {
    double n = 0, density = 0, xy = 0, yz = 0;
    Vec3 velocity{};
    for (int k = 0; k < block_.nz; ++k)
      for (int i = 0; i < block_.nx; ++i) {
        if (is_solid(i, j, k)) continue;
        double f[directions];
        populations(i, j, k, f);
        split_parities(f);
        const Moments<double> m = moments_of_parities(f);
        const double rho = 1 + m.density;
        Vec3 F = parameters_.body_force;
        if (force.data) {
          const Node4<Real>& node = force[block_.at(i, j, k)];
          F = {F[0] + node.x, F[1] + node.y, F[2] + node.z};
        }
        n += 1;
        density += m.density;
        velocity = {velocity[0] + (m.x + 0.5 * F[0]) / rho, velocity[1] + (m.y + 0.5 * F[1]) / rho,
                    velocity[2] + (m.z + 0.5 * F[2]) / rho};
        xy += (f[7] - f[9]) + (0.25 * F[0] * F[1] - m.x * m.y) / rho;
        yz += (f[15] - f[17]) + (0.25 * F[1] * F[2] - m.y * m.z) / rho;
      }
    if (n == 0) n = 1;  // a plane of solid: zeros
    for (int a = 0; a < 3; ++a) result.velocity[j][a] = velocity[a] / n;
    result.density[j] = 1 + density / n;
    result.shear_xy[j] = factor * xy / n;
    result.shear_yz[j] = factor * yz / n;
  }
  return result;
}

template <class Real>
NodeStress Fluid<Real>::stress(int i, int j, int k) const {
  double f[directions], density = 0, flux[3] = {}, second[6] = {};
  populations(i, j, k, f);
  constexpr int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (int d = 0; d < directions; ++d) {
    density += f[d];
    for (int a = 0; a < 3; ++a) flux[a] += c[d][a] * f[d];
    for (int p = 0; p < 6; ++p) second[p] += c[d][pair[p][0]] * c[d][pair[p][1]] * f[d];
  }
  NodeStress result{density / 3, {}};
  for (int p = 0; p < 6; ++p)
    result.viscous[p] = -(1 - 0.5 / parameters_.tau) * (second[p] - (p < 3 ? density / 3 : 0) -
                                                        flux[pair[p][0]] * flux[pair[p][1]] / (1 + density));
  return result;
}

template <class Real>
std::vector<std::byte> Fluid<Real>::save() const {
  StateHeader header;
  header.real_size = sizeof(Real);
  header.swapped = swapped_;
  header.nx = block_.nx, header.ny = block_.ny, header.nz = block_.nz;
  header.steps = steps_;
  const std::size_t line = block_.nx * sizeof(Real);
  std::vector<std::byte> state(sizeof header + block_.interior() * directions * sizeof(Real));
  std::memcpy(state.data(), &header, sizeof header);
  std::byte* out = state.data() + sizeof header;
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (int d = 0; d < directions; ++d, out += line)
        std::memcpy(out, f_.data() + row(j, k) + d * stride_, line);
  return state;
}

template <class Real>
void Fluid<Real>::load(View<const std::byte> state) {
  StateHeader header;
  require(state.size >= sizeof header,
          "fluid state cut short (no room for its header) use an intact checkpoint");
  std::memcpy(&header, state.data, sizeof header);
  require(header.magic == state_magic && header.real_size == sizeof(Real) && header.nx == block_.nx &&
              header.ny == block_.ny && header.nz == block_.nz &&
              state.size == sizeof header + block_.interior() * directions * sizeof(Real),
          "fluid state does not fit (another block size or precision) resume with the scene that wrote it");
  const std::size_t line = block_.nx * sizeof(Real);
  const std::byte* in = state.data + sizeof header;
  swapped_ = header.swapped != 0;
  steps_ = header.steps;
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j) {
      for (int d = 0; d < directions; ++d, in += line)
        std::memcpy(f_.data() + row(j, k) + d * stride_, in, line);
      fill_ghosts(j, k);
    }
}

std::vector<std::byte> join_states(const std::vector<std::vector<std::byte>>& blocks) {
  std::vector<std::byte> whole(sizeof(StateHeader));
  StateHeader sum;
  for (const auto& block : blocks) {
    StateHeader header;
    require(block.size() >= sizeof header,
            "fluid state cut short (no room for its header) use an intact checkpoint");
    std::memcpy(&header, block.data(), sizeof header);
    if (sum.nz == 0) {
      sum = header;
    } else {
      require(header.magic == sum.magic && header.real_size == sum.real_size &&
                  header.swapped == sum.swapped && header.nx == sum.nx && header.ny == sum.ny &&
                  header.steps == sum.steps,
              "fluid states do not fit together (other sizes or other steps) use an intact checkpoint");
      sum.nz += header.nz;
    }
    whole.insert(whole.end(), block.begin() + sizeof header, block.end());
  }
  std::memcpy(whole.data(), &sum, sizeof sum);
  return whole;
}

std::vector<std::byte> cut_state(View<const std::byte> domain, int first, int planes) {
  StateHeader header;
  require(domain.size >= sizeof header,
          "fluid state cut short (no room for its header) use an intact checkpoint");
  std::memcpy(&header, domain.data, sizeof header);
  const std::size_t plane = static_cast<std::size_t>(header.nx) * header.ny * directions * header.real_size;
  require(
      first >= 0 && planes > 0 && first + planes <= header.nz &&
          domain.size == sizeof header + header.nz * plane,
      "fluid state does not hold the planes asked of it (another box) resume with the scene that wrote it");
  header.nz = planes;
  std::vector<std::byte> block(sizeof header + planes * plane);
  std::memcpy(block.data(), &header, sizeof header);
  std::memcpy(block.data() + sizeof header, domain.data + sizeof header + first * plane, planes * plane);
  return block;
}

template <class Real>
std::size_t Fluid<Real>::memory_bytes() const {
  return f_.size() * sizeof(Real) + rows_.size() * sizeof(rows_[0]) + solid_.size() + kind_.size() +
         mixed_.size() + (wall_sum_.size() + solid_sum_.size()) * sizeof(Vec3);
}

#define HEMOWALK_INSTANTIATE(Real)                                                                     \
  template void Fluid<Real>::set_solid(const std::function<bool(int, int, int)>&);                     \
  template void Fluid<Real>::initialise(const std::function<FlowPoint(double, double, double)>&);      \
  template void Fluid<Real>::initialise(const std::function<double(double)>&);                         \
  template void Fluid<Real>::set_populations(int, int, int,                                            \
                                             const std::function<FlowPoint(double, double, double)>&); \
  template void Fluid<Real>::populations(int, int, int, double(&)[directions]) const;                  \
  template WallImpulse Fluid<Real>::wall_impulse() const;                                              \
  template Totals Fluid<Real>::totals() const;                                                         \
  template EnergyFlows Fluid<Real>::energy(View<const Node4<Real>>) const;                             \
  template PlanarProfiles Fluid<Real>::profiles(View<const Node4<Real>>) const;                        \
  template NodeStress Fluid<Real>::stress(int, int, int) const;                                        \
  template std::vector<std::byte> Fluid<Real>::save() const;                                           \
  template void Fluid<Real>::load(View<const std::byte>);                                              \
  template std::size_t Fluid<Real>::memory_bytes() const;
HEMOWALK_INSTANTIATE(float)
HEMOWALK_INSTANTIATE(double)
#undef HEMOWALK_INSTANTIATE

}  // namespace hemowalk::lbm
