// Everything of Fluid that is not in a step: set-up, sums, profiles, checkpoints.

#include <cstring>

#include "core/check.hpp"
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

template <class Real>
Totals Fluid<Real>::totals() const {
  std::vector<Totals> plane(block_.nz);
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int k = 0; k < block_.nz; ++k) {
    Totals sum;
    for (int j = 0; j < block_.ny; ++j)
      for (int i = 0; i < block_.nx; ++i) {
        if (is_solid(i, j, k)) continue;
        double f[directions];
        populations(i, j, k, f);
        split_parities(f);
        const Moments<double> m = moments_of_parities(f);
        sum.mass += m.density;
        sum.momentum = {sum.momentum[0] + m.x, sum.momentum[1] + m.y, sum.momentum[2] + m.z};
      }
    plane[k] = sum;
  }
  Totals total;
  for (const Totals& p : plane) {
    total.mass += p.mass;
    for (int a = 0; a < 3; ++a) total.momentum[a] += p.momentum[a];
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
  template PlanarProfiles Fluid<Real>::profiles(View<const Node4<Real>>) const;                        \
  template NodeStress Fluid<Real>::stress(int, int, int) const;                                        \
  template std::vector<std::byte> Fluid<Real>::save() const;                                           \
  template void Fluid<Real>::load(View<const std::byte>);                                              \
  template std::size_t Fluid<Real>::memory_bytes() const;
HEMOWALK_INSTANTIATE(float)
HEMOWALK_INSTANTIATE(double)
#undef HEMOWALK_INSTANTIATE

}  // namespace hemowalk::lbm
