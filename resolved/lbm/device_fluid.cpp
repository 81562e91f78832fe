#include "resolved/lbm/device_fluid.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "core/check.hpp"
#include "resolved/lbm/state.hpp"

namespace hemowalk::lbm {

namespace {

/// Populations of a slab should still be in the second-level cache when its moments are taken.
constexpr std::size_t cache_bytes = std::size_t{32} << 20;

std::size_t plane_nodes(const Block& b) {
  return static_cast<std::size_t>(b.nx) * static_cast<std::size_t>(b.ny);
}

int choose_planes(int asked, const Block& b, std::size_t real_size) {
  if (asked > 0) return std::min(asked, b.nz);
  const std::size_t plane = plane_nodes(b) * directions * real_size;
  const std::size_t fit = std::max<std::size_t>(cache_bytes / plane, 2);
  const std::size_t slabs = (static_cast<std::size_t>(b.nz) + fit - 1) / fit;
  return static_cast<int>((static_cast<std::size_t>(b.nz) + slabs - 1) / slabs);
}

}  // namespace

template <class Real>
DeviceFluid<Real>::DeviceFluid(Queue& queue, const Fluid<Real>& host, int planes)
    : queue_(queue),
      block_(host.block()),
      parameters_(host.parameters()),
      planes_(choose_planes(planes, host.block(), sizeof(Real))),
      f_((host.block().interior() + (parameters_.divided_z ? 2 : 0) * plane_nodes(host.block())) * directions,
         queue.place()),
      border_(parameters_.divided_z ? 2 * host.border_size() : 0, queue.place()),
      outgoing_(2 * static_cast<std::size_t>(host.block().nz) * static_cast<std::size_t>(host.block().nx),
                queue.place()),
      wall_total_(2 * static_cast<std::size_t>(host.block().nz) * 3, queue.place()) {
  require(host.fluid_nodes() == block_.interior(),
          "this fluid cannot go to the device (it has solid nodes) use place: host");
  require(f_.size() <= std::numeric_limits<std::uint32_t>::max(),
          "the block has too many nodes for one device (slots are counted in 32 bits) split it");
  lattice_.block = block_;
  lattice_.walls_y = parameters_.walls_y;
  lattice_.beyond = parameters_.divided_z ? 1 : 0;
  lattice_.f = f_.data();
  lattice_.stride = static_cast<std::uint32_t>(f_.size() / directions);
  lattice_.rate = host.relaxation();
  walls_.nx = block_.nx, walls_.nz = block_.nz;
  walls_.outgoing = outgoing_.data();
  walls_.total = wall_total_.data();
  const Vec3 u[2] = {parameters_.lower_wall_velocity, parameters_.upper_wall_velocity};
  for (int a = 0; a < 3; ++a) lattice_.body[a] = static_cast<Real>(parameters_.body_force[a]);
  for (int w = 0; w < 2; ++w) {
    for (int a = 0; a < 3; ++a) walls_.per_node[w][a] = 0;
    for (int i = 0; i < directions; ++i) {
      const bool leaving = leaves(w == 0 ? Wall::lower : Wall::upper, i);
      const Real term = leaving ? wall_kick<Real>(i, u[w]) : Real(0);
      lattice_.wall_term[w][i] = term;
      for (int a = 0; a < 3; ++a) walls_.per_node[w][a] -= c[i][a] * static_cast<double>(term);
    }
  }
  upload(host);
}

template <class Real>
void DeviceFluid<Real>::upload(const Fluid<Real>& host) {
  const auto state = host.save();
  StateHeader header;
  std::memcpy(&header, state.data(), sizeof header);
  swapped_ = header.swapped != 0;
  steps_ = header.steps;
  Array<Real> f(f_.size());
  const std::size_t line = static_cast<std::size_t>(block_.nx) * sizeof(Real);
  const std::byte* in = state.data() + sizeof header;
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (int d = 0; d < directions; ++d, in += line)
        std::memcpy(f.data() + static_cast<std::size_t>(d) * lattice_.stride + lattice_.at(0, j, k), in,
                    line);
  queue_.copy(f_.data(), f.data(), f.size());
  queue_.wait();
}

template <class Real>
void DeviceFluid<Real>::download(Fluid<Real>& host) const {
  Array<Real> f(f_.size());
  queue_.copy(f.data(), f_.data(), f.size());
  queue_.wait();
  StateHeader header;
  header.real_size = sizeof(Real);
  header.swapped = swapped_;
  header.nx = block_.nx, header.ny = block_.ny, header.nz = block_.nz;
  header.steps = steps_;
  const std::size_t line = static_cast<std::size_t>(block_.nx) * sizeof(Real);
  std::vector<std::byte> state(sizeof header + block_.interior() * directions * sizeof(Real));
  std::memcpy(state.data(), &header, sizeof header);
  std::byte* out = state.data() + sizeof header;
  for (int k = 0; k < block_.nz; ++k)
    for (int j = 0; j < block_.ny; ++j)
      for (int d = 0; d < directions; ++d, out += line)
        std::memcpy(out, f.data() + static_cast<std::size_t>(d) * lattice_.stride + lattice_.at(0, j, k),
                    line);
  host.load({state.data(), state.size()});
}

template <class Real>
WallImpulse DeviceFluid<Real>::wall_impulse() const {
  Array<double> total(wall_total_.size());
  queue_.copy(total.data(), wall_total_.data(), total.size());
  queue_.wait();
  WallImpulse sum;
  for (std::size_t k = 0; k < static_cast<std::size_t>(block_.nz); ++k)
    for (std::size_t a = 0; a < 3; ++a) {
      sum.lower[a] += total[3 * k + a];
      sum.upper[a] += total[3 * (static_cast<std::size_t>(block_.nz) + k) + a];
    }
  return sum;
}

template <class Real>
template <bool odd>
void DeviceFluid<Real>::take_moments(int first_plane, int planes, const Node4<Real>* force,
                                     Node4<Real>* velocity, Real share) {
  if (planes <= 0) return;
  queue_.for_each(static_cast<std::size_t>(planes) * plane_nodes(block_),
                  TakeMoments<Real, odd>{lattice_, force, share, velocity, lattice_.at(0, 0, first_plane)});
}

/// A plane's moments need the planes beside it collided: they follow one plane behind, and the first and last
/// plane, which see each other through the period or other blocks, wait for end_advance().
template <class Real>
template <bool odd>
void DeviceFluid<Real>::collide(const Node4<Real>* force, Node4<Real>* velocity, Real share) {
  int taken = 1;
  for (int first = 0; first < block_.nz; first += planes_) {
    const int end = std::min(first + planes_, block_.nz);
    queue_.for_each(static_cast<std::size_t>(end - first) * plane_nodes(block_),
                    CollideNodes<Real, odd>{lattice_, force, outgoing_.data(), lattice_.at(0, 0, first)});
    take_moments<!odd>(taken, end - 1 - taken, force, velocity, share);
    taken = std::max(taken, end - 1);
  }
  if (parameters_.walls_y)
    queue_.blocks(2 * static_cast<std::size_t>(block_.nz), 3 * walls_.threads * sizeof(double), walls_);
}

template <class Real>
void DeviceFluid<Real>::begin_advance(const Node4<Real>* force, Node4<Real>* velocity, Real share) {
  swapped_ ? collide<true>(force, velocity, share) : collide<false>(force, velocity, share);
  replayed(1);
}

template <class Real>
void DeviceFluid<Real>::end_advance(const Node4<Real>* force, Node4<Real>* velocity, Real share) {
  const int last = std::max(1, block_.nz - 1);
  for (const auto& [first, planes] : {std::pair{0, 1}, {last, block_.nz - last}})
    swapped_ ? take_moments<true>(first, planes, force, velocity, share)
             : take_moments<false>(first, planes, force, velocity, share);
}

template <class Real>
void DeviceFluid<Real>::advance(const Node4<Real>* force, Node4<Real>* velocity, Real share) {
  begin_advance(force, velocity, share);
  end_advance(force, velocity, share);
}

template <class Real>
void DeviceFluid<Real>::send_borders(Real* message) {
  queue_.for_each(CrossBorder<Real, true>::count(block_),
                  CrossBorder<Real, true>{lattice_, swapped_, border_.data()});
  queue_.copy(message, border_.data(), border_.size());
}

template <class Real>
void DeviceFluid<Real>::receive_borders(const Real* message) {
  queue_.copy(border_.data(), message, border_.size());
  queue_.for_each(CrossBorder<Real, false>::count(block_),
                  CrossBorder<Real, false>{lattice_, swapped_, border_.data()});
}

template <class Real>
void DeviceFluid<Real>::replayed(int steps) {
  steps_ += steps;
  if (steps % 2 != 0) swapped_ = !swapped_;
}

template <class Real>
void DeviceFluid<Real>::moments(const Node4<Real>* force, Node4<Real>* velocity, Real share) {
  swapped_ ? take_moments<true>(0, block_.nz, force, velocity, share)
           : take_moments<false>(0, block_.nz, force, velocity, share);
  if (!parameters_.walls_y) return;
  const auto wall = [](const Vec3& u) {
    return Node4<Real>{static_cast<Real>(u[0]), static_cast<Real>(u[1]), static_cast<Real>(u[2]), Real(0)};
  };
  queue_.for_each(FillWallHalo<Real>::count(block_),
                  FillWallHalo<Real>{block_, parameters_.divided_z, wall(parameters_.lower_wall_velocity),
                                     wall(parameters_.upper_wall_velocity), velocity});
}

template <class Real>
std::size_t DeviceFluid<Real>::memory_bytes() const {
  return (f_.size() + border_.size()) * sizeof(Real) + outgoing_.size() * sizeof(Node4<Real>) +
         wall_total_.size() * sizeof(double);
}

template class DeviceFluid<float>;
template class DeviceFluid<double>;

}  // namespace hemowalk::lbm
