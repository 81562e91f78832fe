// What blocks of a domain divided along z tell each other.
//
// Populations with c_z = -1 of the plane k = -1 (the low neighbour's last) and with c_z = +1 of the plane k =
// nz are read and written by the collisions of an odd step. So after an even step each block sends its border
// planes out to where the neighbour will collide them, and after the odd step it gets them back, collided and
// streamed.

#include <cstring>

#include "core/check.hpp"
#include "resolved/lbm/fluid.hpp"

namespace hemowalk::lbm {

namespace {

constexpr int upward[5] = {5, 11, 14, 15, 18}, downward[5] = {6, 12, 13, 16, 17};

constexpr bool all_move_along_z() {
  for (int n = 0; n < 5; ++n)
    if (c[upward[n]][2] != 1 || c[downward[n]][2] != -1) return false;
  return true;
}
static_assert(all_move_along_z());

}  // namespace

template <class Real>
void Fluid<Real>::send_border(Side side, View<Real> message) const {
  require(message.size == border_size(),
          "wrong length of a border message (not border_size()) ask the block");
  // Out: own border plane, as the neighbour's collisions will need it. Back: the neighbour's plane, collided
  // here.
  const int outer = side == Side::low ? -1 : block_.nz, inner = side == Side::low ? 0 : block_.nz - 1;
  const auto& slots = (side == Side::low) == swapped_ ? upward : downward;
  const Real* plane = f_.data() + row(0, swapped_ ? inner : outer);
  Real* out = message.data;
  for (const int i : slots)
    for (int j = 0; j < block_.ny; ++j, out += block_.nx)
      std::memcpy(out, plane + i * stride_ + j * pitch_, block_.nx * sizeof(Real));
}

template <class Real>
void Fluid<Real>::receive_border(Side side, View<const Real> message) {
  require(message.size == border_size(),
          "wrong length of a border message (not border_size()) ask the block");
  const int outer = side == Side::low ? -1 : block_.nz, inner = side == Side::low ? 0 : block_.nz - 1;
  const auto& slots = (side == Side::low) == swapped_ ? downward : upward;
  const int k = swapped_ ? outer : inner;
  Real* plane = f_.data() + row(0, k);
  const Real* in = message.data;
  for (const int i : slots)
    for (int j = 0; j < block_.ny; ++j, in += block_.nx) {
      Real* out = plane + i * stride_ + j * pitch_;
      if (swapped_ || solid_.empty()) {
        // What bounced off a y wall stayed with the node it left: nothing came back for it.
        if (swapped_ || !(below(j - c[i][1]) || above(j - c[i][1])))
          std::memcpy(out, in, block_.nx * sizeof(Real));
        continue;
      }
      for (int x = 0; x < block_.nx; ++x)
        if (!below(j - c[i][1]) && !above(j - c[i][1]) && !is_solid(x - c[i][0], j - c[i][1], k - c[i][2]))
          out[x] = in[x];
    }
  if (swapped_)
    for (int j = 0; j < block_.ny; ++j) fill_ghosts(j, k);
}

template void Fluid<float>::send_border(Side, View<float>) const;
template void Fluid<float>::receive_border(Side, View<const float>);
template void Fluid<double>::send_border(Side, View<double>) const;
template void Fluid<double>::receive_border(Side, View<const double>);

}  // namespace hemowalk::lbm
