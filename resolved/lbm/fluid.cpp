#include "resolved/lbm/fluid.hpp"

#include <omp.h>

#include <algorithm>
#include <string>

#include "core/check.hpp"
#include "resolved/lbm/rows.hpp"

namespace hemowalk::lbm {

namespace {

constexpr std::size_t round_up(std::size_t n, std::size_t to) { return (n + to - 1) / to * to; }

double force_shift(const Parameters& p) {
  return p.forcing == Forcing::guo ? 0.5 - 1 / (8 * p.tau) : p.tau / 2;
}

}  // namespace

template <class Real>
Fluid<Real>::Fluid(const Block& block, const Parameters& parameters)
    : block_(block), parameters_(parameters) {
  require(block.nx > 0 && block.ny > 0 && block.nz > 0,
          "empty fluid block (a size is zero or negative) give every axis at least one node");
  require(parameters.tau > 0.5, "tau = " + std::to_string(parameters.tau) +
                                    " (the viscosity (tau - 1/2)/3 must be positive) choose tau > 0.5");
  require(parameters.collision == Collision::bgk || parameters.magic > 0,
          "magic = " + std::to_string(parameters.magic) + " (TRT needs Lambda > 0) use 0.1875");
  require(!parameters.walls_y || block.ny >= 2,
          "one node between the walls (a row cannot touch both) give y at least two nodes");
  rate_ = Relaxation<Real>::make(1 / parameters.tau, odd_rate(parameters), force_shift(parameters));
  fluid_nodes_ = block.interior();
  pitch_ = round_up(static_cast<std::size_t>(block.nx) + 2, 16);
  const auto ny = static_cast<std::size_t>(block.ny), nz = static_cast<std::size_t>(block.nz);
  // The 19 streams of a sweep are one stride apart: keep them off the same few sets of the cache.
  constexpr std::size_t line = 64 / sizeof(Real);
  stride_ = round_up(ny * pitch_, line);
  if (stride_ / line % 8 == 0) stride_ += line;
  rows_.resize((ny + 2) * (nz + 2));
  for (std::size_t k = 0; k < nz + 2; ++k)
    for (std::size_t j = 0; j < ny + 2; ++j) {
      const bool foreign = parameters.divided_z && (k == 0 || k == nz + 1);
      const std::size_t plane = foreign ? nz + k / (nz + 1) : (k + nz - 1) % nz;
      rows_[k * (ny + 2) + j] = plane * directions * stride_ + (j + ny - 1) % ny * pitch_;
    }
  f_ = Array<Real>((parameters.divided_z ? nz + 2 : nz) * directions * stride_);
  wall_sum_.resize(2 * nz);
  set_wall_terms();
}

template <class Real>
void Fluid<Real>::set_wall_terms() {
  const Vec3 u[2] = {parameters_.lower_wall_velocity, parameters_.upper_wall_velocity};
  for (int w = 0; w < 2; ++w) {
    require(u[w][1] == 0, "a wall moves along y (it would compress the fluid) set the y component to 0");
    wall_term_[w].fill(0);
    wall_impulse_per_node_[w] = {};
    for (int i = 0; i < directions; ++i) {
      if (!leaves(w == 0 ? Wall::lower : Wall::upper, i)) continue;
      const Real term = wall_kick<Real>(i, u[w]);
      wall_term_[w][i] = term;
      for (int a = 0; a < 3; ++a) wall_impulse_per_node_[w][a] -= c[i][a] * static_cast<double>(term);
    }
  }
}

template <class Real>
void Fluid<Real>::set_wall_velocity(const Vec3& lower, const Vec3& upper) {
  parameters_.lower_wall_velocity = lower;
  parameters_.upper_wall_velocity = upper;
  set_wall_terms();
}

template <class Real>
void Fluid<Real>::set_body_force(const Vec3& force) {
  parameters_.body_force = force;
}

/// A slab has at least one plane, and enough nodes to be worth a fork.
template <class Real>
int Fluid<Real>::threads() const {
  constexpr std::size_t worthwhile = 1024;
  const auto slabs =
      std::min<std::size_t>(block_.nz, std::max<std::size_t>(1, block_.interior() / worthwhile));
  return std::min(omp_get_max_threads(), static_cast<int>(slabs));
}

template <class Real>
typename Fluid<Real>::Slab Fluid<Real>::slab() const {
  const long threads = omp_get_num_threads(), t = omp_get_thread_num();
  return {static_cast<int>(block_.nz * t / threads), static_cast<int>(block_.nz * (t + 1) / threads)};
}

// ---- where populations are stored

template <class Real>
RowPointers<Real> Fluid<Real>::locate(int j, int k, bool swapped) const {
  auto* f = const_cast<Real*>(f_.data());
  RowPointers<Real> result;
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    const bool low = below(j - c[i][1]), high = above(j - c[i][1]);
    result.wall_term[i] = 0;
    if (!swapped) {
      result.p[i] = f + row(j, k) + i * stride_;
    } else if (low || high) {  // came back from the wall: it waits in the node's own slot
      result.p[i] = f + row(j, k) + i * stride_;
      result.wall_term[i] = wall_term_[high][i];
    } else {
      result.p[i] = f + row(j - c[i][1], k - c[i][2]) + opposite(i) * stride_ - c[i][0];
    }
  });
  return result;
}

/// The same for one node beside static solid, whose links may end there.
template <class Real>
void Fluid<Real>::locate_node(int i, int j, int k, bool swapped, Real* (&p)[directions],
                              Real (&wall_term)[directions]) const {
  auto* f = const_cast<Real*>(f_.data());
  for (int d = 0; d < directions; ++d) {
    const int x = i - c[d][0], y = j - c[d][1], z = k - c[d][2];
    const bool low = below(y), high = above(y);
    wall_term[d] = 0;
    if (!swapped || low || high || is_solid(x, y, z)) {
      p[d] = f + row(j, k) + d * stride_ + i;
      if (swapped && (low || high)) wall_term[d] = wall_term_[high][d];
    } else {
      p[d] = f + row(y, z) + opposite(d) * stride_ + (x + block_.nx) % block_.nx;
    }
  }
}

/// Slots of the columns x = -1 and x = nx that the coming odd step reads in this row.
template <class Real>
void Fluid<Real>::fill_ghosts(int j, int k) {
  Real* own = f_.data() + row(j, k);
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    Real* slot = own + i * stride_;
    if constexpr (c[i][0] == -1) slot[-1] = slot[block_.nx - 1];
    if constexpr (c[i][0] == 1) slot[block_.nx] = slot[0];
  });
}

/// After an odd step of row (j, k): what it wrote to columns x = -1 and x = nx goes to their periodic images.
template <class Real>
void Fluid<Real>::return_ghosts(int j, int k, const RowPointers<Real>& row) {
  const int n = block_.nx;
  const std::size_t first = (static_cast<std::size_t>(k) * block_.ny + j) * n;
  const bool left = kind_.empty() || kind_[first] == bulk_node,
             right = kind_.empty() || kind_[first + n - 1] == bulk_node;
  unroll<directions>([&](auto direction) HEMO_INLINE_LAMBDA {
    constexpr int i = decltype(direction)::value;
    if (below(j - c[i][1]) || above(j - c[i][1])) return;
    if constexpr (c[i][0] == 1) {
      if (left) row.p[i][n] = row.p[i][0];
    }
    if constexpr (c[i][0] == -1) {
      if (right) row.p[i][-1] = row.p[i][n - 1];
    }
  });
}

// ---- one row

template <class Real>
void Fluid<Real>::collide_node(int i, int j, int k, const Node4<Real>* force, double (&outgoing)[3],
                               double (&to_solid)[3]) {
  Real* p[directions];
  Real wall_term[directions], f[directions];
  locate_node(i, j, k, swapped_, p, wall_term);
  for (int d = 0; d < directions; ++d) f[d] = *p[d] + wall_term[d];
  Node4<Real> F{Real(parameters_.body_force[0]), Real(parameters_.body_force[1]),
                Real(parameters_.body_force[2]), 0};
  if (force) F = {F.x + force->x, F.y + force->y, F.z + force->z, 0};
  collide(f, F.x, F.y, F.z, rate_);
  for (int d = 0; d < directions; ++d) {
    const int x = i + c[d][0], y = j + c[d][1], z = k + c[d][2];
    const bool wall = below(y) || above(y);
    if (wall || is_solid(x, y, z))
      for (int a = 0; a < 3; ++a) (wall ? outgoing : to_solid)[a] += c[d][a] * static_cast<double>(f[d]);
    *p[opposite(d)] = f[d] + wall_term[opposite(d)];
  }
}

template <class Real>
void Fluid<Real>::collide_row(int j, int k, View<const Node4<Real>> force) {
  const RowPointers<Real> pointers = locate(j, k, swapped_);
  const Node4<Real>* F = force.data ? force.data + block_.at(0, j, k) : nullptr;
  const Force3<Real> body{Real(parameters_.body_force[0]), Real(parameters_.body_force[1]),
                          Real(parameters_.body_force[2])};
  const Wall wall = below(j - 1) ? Wall::lower : above(j + 1) ? Wall::upper : Wall::none;
  double outgoing[3] = {}, to_solid[3] = {};
  const auto run = [&](int begin, int end) {
    if (wall == Wall::lower) {
      collide_run<Wall::lower>(pointers, begin, end, F, body, rate_, outgoing);
    } else if (wall == Wall::upper) {
      collide_run<Wall::upper>(pointers, begin, end, F, body, rate_, outgoing);
    } else {
      collide_run<Wall::none>(pointers, begin, end, F, body, rate_, outgoing);
    }
  };
  const std::size_t r = static_cast<std::size_t>(k) * block_.ny + j;
  int fluid = block_.nx;
  if (mixed_.empty() || !mixed_[r]) {
    run(0, block_.nx);
  } else {
    fluid = 0;
    const std::uint8_t* kind = kind_.data() + r * block_.nx;
    for (int x = 0; x < block_.nx;) {
      int end = x + 1;
      if (kind[x] == bulk_node) {
        while (end < block_.nx && kind[end] == bulk_node) ++end;
        run(x, end);
      } else if (kind[x] == border_node) {
        collide_node(x, j, k, F ? F + x : nullptr, outgoing, to_solid);
      }
      if (kind[x] != solid_node) fluid += end - x;
      x = end;
    }
    for (int a = 0; a < 3; ++a) solid_sum_[r][a] = 2 * to_solid[a];
  }
  if (swapped_) {
    return_ghosts(j, k, pointers);
  } else {
    fill_ghosts(j, k);
  }
  if (wall != Wall::none) {
    const int w = wall == Wall::upper;
    for (int a = 0; a < 3; ++a)
      wall_sum_[w * static_cast<std::size_t>(block_.nz) + k][a] =
          2 * outgoing[a] + fluid * wall_impulse_per_node_[w][a];
  }
}

template <class Real>
void Fluid<Real>::moments_row(int j, int k, bool swapped, View<Node4<Real>> velocity) const {
  const RowPointers<Real> pointers = locate(j, k, swapped);
  Node4<Real>* out = velocity.data + block_.at(0, j, k);
  const Wall wall = below(j - 1) ? Wall::lower : above(j + 1) ? Wall::upper : Wall::none;
  const auto run = [&](int begin, int end) {
    if (wall == Wall::lower) {
      moments_run<Wall::lower>(pointers, begin, end, out);
    } else if (wall == Wall::upper) {
      moments_run<Wall::upper>(pointers, begin, end, out);
    } else {
      moments_run<Wall::none>(pointers, begin, end, out);
    }
  };
  const std::size_t r = static_cast<std::size_t>(k) * block_.ny + j;
  if (mixed_.empty() || !mixed_[r]) return run(0, block_.nx);
  const std::uint8_t* kind = kind_.data() + r * block_.nx;
  for (int x = 0; x < block_.nx;) {
    int end = x + 1;
    if (kind[x] == bulk_node) {
      while (end < block_.nx && kind[end] == bulk_node) ++end;
      run(x, end);
    } else if (kind[x] == border_node) {
      Real* p[directions];
      Real wall_term[directions], f[directions];
      locate_node(x, j, k, swapped, p, wall_term);
      for (int d = 0; d < directions; ++d) f[d] = *p[d] + wall_term[d];
      split_parities(f);
      const Moments<Real> m = moments_of_parities(f);
      const Real inverse_density = 1 / (1 + m.density);
      out[x] = {m.x * inverse_density, m.y * inverse_density, m.z * inverse_density, m.density};
    } else {
      out[x] = {0, 0, 0, 0};
    }
    x = end;
  }
}

/// velocity += share force on one row, which both are still in cache.
template <class Real>
void Fluid<Real>::add_force(int j, int k, View<const Node4<Real>> force, Real share,
                            View<Node4<Real>> velocity) const {
  if (share == 0 || force.size == 0) return;
  const std::size_t row = block_.at(0, j, k);
  add_share(force.data + row, share, block_.nx, velocity.data + row);
}

// ---- the sweeps

template <class Real>
void Fluid<Real>::moments(View<Node4<Real>> velocity, View<const Node4<Real>> force, Real force_share) const {
#pragma omp parallel num_threads(threads())
  {
    const Slab my = slab();
    for (int k = my.begin; k < my.end; ++k)
      for (int j = 0; j < block_.ny; ++j) {
        moments_row(j, k, swapped_, velocity);
        add_force(j, k, force, force_share, velocity);
      }
  }
}

/// With moments, plane k - 1 follows plane k: the planes it gathers from are then collided and still in
/// cache. (Row by row, or in strips of rows that fit the second-level cache, is slower: it breaks the
/// streams.) The first and last plane of a slab wait for the neighbour threads.
template <class Real>
template <bool with_moments>
void Fluid<Real>::step(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share) {
  const int ny = block_.ny;
  const auto moments_plane = [&](int k) {
    for (int j = 0; j < ny; ++j) {
      moments_row(j, k, !swapped_, velocity);
      add_force(j, k, force, force_share, velocity);
    }
  };
#pragma omp parallel num_threads(threads())
  {
    const Slab my = slab();
    for (int k = my.begin; k < my.end; ++k) {
      for (int j = 0; j < ny; ++j) collide_row(j, k, force);
      if (with_moments && k >= my.begin + 2) moments_plane(k - 1);
    }
    if constexpr (with_moments) {
#pragma omp barrier
      for (int k = my.begin; k < my.end; k += std::max(1, my.end - 1 - my.begin))
        if (!border_plane(k)) moments_plane(k);
    }
  }
  swapped_ = !swapped_;
  ++steps_;
}

template <class Real>
void Fluid<Real>::collide_and_stream(View<const Node4<Real>> force) {
  contract(!parameters_.divided_z, "a divided fluid takes its steps by begin_advance and end_advance");
  step<false>(force, {}, 0);
}

template <class Real>
void Fluid<Real>::advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share) {
  contract(!parameters_.divided_z, "a divided fluid takes its steps by begin_advance and end_advance");
  step<true>(force, velocity, force_share);
}

template <class Real>
void Fluid<Real>::begin_advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share) {
  step<true>(force, velocity, force_share);
}

template <class Real>
void Fluid<Real>::end_advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share) {
  if (!parameters_.divided_z) return;
#pragma omp parallel for schedule(static) num_threads(threads())
  for (int j = 0; j < block_.ny; ++j) {
    for (int k = 0; k < block_.nz; k += std::max(1, block_.nz - 1)) {
      moments_row(j, k, swapped_, velocity);
      add_force(j, k, force, force_share, velocity);
    }
  }
}

template class Fluid<float>;
template class Fluid<double>;

}  // namespace hemowalk::lbm
