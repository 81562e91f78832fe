#include "resolved/ibm/halo.hpp"

namespace hemowalk::ibm {

namespace {

template <class Real>
void add(Node4<Real>& to, const Node4<Real>& from) {
  to.x += from.x, to.y += from.y, to.z += from.z;
}

}  // namespace

template <class Real>
void fill_velocity_halo(const Block& b, const Faces& faces, View<Node4<Real>> u) {
  constexpr int h = Block::halo;
  const auto wall = [](const std::array<double, 3>& v) {
    return Node4<Real>{static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2]), Real(0)};
  };
  const Node4<Real> lower = wall(faces.lower_wall), upper = wall(faces.upper_wall);
#pragma omp parallel for schedule(static)
  for (int k = 0; k < b.nz; ++k) {
    for (int j = 0; j < b.ny; ++j)
      for (int a = 0; a < h; ++a) {
        u[b.at(-1 - a, j, k)] = u[b.at(b.nx - 1 - a, j, k)];
        u[b.at(b.nx + a, j, k)] = u[b.at(a, j, k)];
      }
    for (int a = 0; a < h; ++a)
      for (int i = -h; i < b.nx + h; ++i) {
        u[b.at(i, -1 - a, k)] = faces.periodic_y ? u[b.at(i, b.ny - 1 - a, k)] : lower;
        u[b.at(i, b.ny + a, k)] = faces.periodic_y ? u[b.at(i, a, k)] : upper;
      }
  }
  for (int a = 0; a < h && faces.periodic_z; ++a)
#pragma omp parallel for schedule(static)
    for (int j = -h; j < b.ny + h; ++j)
      for (int i = -h; i < b.nx + h; ++i) {
        u[b.at(i, j, -1 - a)] = u[b.at(i, j, b.nz - 1 - a)];
        u[b.at(i, j, b.nz + a)] = u[b.at(i, j, a)];
      }
}

template <class Real>
std::array<std::array<double, 3>, 2> fold_force_halo(const Block& b, const Faces& faces,
                                                     View<Node4<Real>> f) {
  constexpr int h = Block::halo;
  for (int a = 0; a < h && faces.periodic_z; ++a)
#pragma omp parallel for schedule(static)
    for (int j = -h; j < b.ny + h; ++j)
      for (int i = -h; i < b.nx + h; ++i) {
        add(f[b.at(i, j, b.nz - 1 - a)], f[b.at(i, j, -1 - a)]);
        add(f[b.at(i, j, a)], f[b.at(i, j, b.nz + a)]);
      }
  // Per-plane partial sums, added in plane order: the impulse does not depend on the number of threads.
  std::array<std::array<double, 3>, 2> impulse{};
#pragma omp parallel for schedule(static) ordered
  for (int k = 0; k < b.nz; ++k) {
    std::array<std::array<double, 3>, 2> part{};
    for (int a = 0; a < h; ++a)
      for (int i = -h; i < b.nx + h; ++i) {
        const Node4<Real> below = f[b.at(i, -1 - a, k)], above = f[b.at(i, b.ny + a, k)];
        if (faces.periodic_y) {
          add(f[b.at(i, b.ny - 1 - a, k)], below);
          add(f[b.at(i, a, k)], above);
        } else {
          part[0][0] += below.x, part[0][1] += below.y, part[0][2] += below.z;
          part[1][0] += above.x, part[1][1] += above.y, part[1][2] += above.z;
        }
      }
    for (int j = 0; j < b.ny; ++j)
      for (int a = 0; a < h; ++a) {
        add(f[b.at(b.nx - 1 - a, j, k)], f[b.at(-1 - a, j, k)]);
        add(f[b.at(a, j, k)], f[b.at(b.nx + a, j, k)]);
      }
#pragma omp ordered
    for (int w = 0; w < 2; ++w)
      for (int d = 0; d < 3; ++d) impulse[w][d] += part[w][d];
  }
  return impulse;
}

template void fill_velocity_halo(const Block&, const Faces&, View<Node4<float>>);
template void fill_velocity_halo(const Block&, const Faces&, View<Node4<double>>);
template std::array<std::array<double, 3>, 2> fold_force_halo(const Block&, const Faces&, View<Node4<float>>);
template std::array<std::array<double, 3>, 2> fold_force_halo(const Block&, const Faces&,
                                                              View<Node4<double>>);

}  // namespace hemowalk::ibm
