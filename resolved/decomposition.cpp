#include "resolved/decomposition.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "core/text.hpp"

namespace hemowalk::resolved {

Decomposition::Decomposition(const Block& whole, mpi::Ranks ranks, double thickest)
    : whole_(whole), block_(whole), ranks_(std::move(ranks)) {
  if (!divided()) return;
  const int thinnest = whole.nz / ranks_.count();
  const int needed = std::max(Block::halo, static_cast<int>(std::ceil(thickest)));
  require(thinnest >= needed, [&] {
    return formatted(
        "%d ranks leave slabs of %d planes (a cell reaches no farther than one neighbour: %d are needed) use "
        "%d or fewer ranks, or a box that is longer along z",
        ranks_.count(), thinnest, needed, std::max(1, whole.nz / needed));
  });
  block_.nz = first_of(ranks_.rank() + 1) - first_plane();
}

int Decomposition::shift_to(Side side) const {
  if (side == Side::high) return -block_.nz;
  const int low = neighbour(Side::low);
  return first_of(low + 1) - first_of(low);
}

double Decomposition::localise(double k) const {
  const double plane = k - first_plane();
  return plane - std::floor((plane - lowest_seen()) / whole_.nz) * whole_.nz;
}

template <class Real>
FieldExchange<Real>::FieldExchange(const Decomposition& decomposition, std::size_t border_size)
    : divided_(decomposition.divided()),
      block_(decomposition.block()),
      velocity_(decomposition, Topic::velocity),
      force_(decomposition, Topic::force),
      populations_(decomposition, Topic::populations) {
  if (!divided_) return;
  folded_[0] = Array<Node4<Real>>(above * block_.plane());
  folded_[1] = Array<Node4<Real>>(below * block_.plane());
  for (int s = 0; s < 2; ++s)
    outgoing_[s] = Array<Real>(border_size), incoming_[s] = Array<Real>(border_size);
}

template <class Real>
View<Node4<Real>> FieldExchange<Real>::planes(View<Node4<Real>> field, int first, int count) const {
  return {field.data + block_.at(-Block::halo, -Block::halo, first), count * block_.plane()};
}

template <class Real>
void FieldExchange<Real>::fill(View<Node4<Real>> field) {
  if (!divided_) return;
  const auto from_low = planes(field, -below, below), from_high = planes(field, block_.nz, above),
             to_low = planes(field, 0, above), to_high = planes(field, block_.nz - below, below);
  velocity_.receive(Side::low, from_low.data, from_low.size);
  velocity_.receive(Side::high, from_high.data, from_high.size);
  velocity_.send(Side::low, to_low.data, to_low.size);
  velocity_.send(Side::high, to_high.data, to_high.size);
  velocity_.wait();
}

template <class Real>
void FieldExchange<Real>::fold(View<Node4<Real>> force) {
  if (!divided_) return;
  const auto to_low = planes(force, -below, below), to_high = planes(force, block_.nz, above);
  force_.receive(Side::low, folded_[0].data(), folded_[0].size());
  force_.receive(Side::high, folded_[1].data(), folded_[1].size());
  force_.send(Side::low, to_low.data, to_low.size);
  force_.send(Side::high, to_high.data, to_high.size);
  force_.wait();
  const View<Node4<Real>> target[2] = {planes(force, 0, above), planes(force, block_.nz - below, below)};
  for (int s = 0; s < 2; ++s) {
    Node4<Real>* to = target[s].data;
    const Node4<Real>* from = folded_[s].data();
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(target[s].size); ++i)
      to[i].x += from[i].x, to[i].y += from[i].y, to[i].z += from[i].z;
  }
}

template <class Real>
void FieldExchange<Real>::stream(lbm::Fluid<Real>& fluid) {
  if (!divided_) return;
  for (const Side side : both_sides) {
    const int s = index_of(side);
    populations_.receive(side, incoming_[s].data(), incoming_[s].size());
    fluid.send_border(side, outgoing_[s].view());
    populations_.send(side, outgoing_[s].data(), outgoing_[s].size());
  }
  populations_.wait();
  for (const Side side : both_sides)
    fluid.receive_border(side, std::as_const(incoming_[index_of(side)]).view());
}

template class FieldExchange<float>;
template class FieldExchange<double>;

}  // namespace hemowalk::resolved
