#pragma once
/// \file DeviceFluid: the fluid of fluid.hpp on a Queue's place, for whole steps without the host. The host
/// fluid is the definition of right; states go to and fro without loss.

#include "core/device.hpp"
#include "resolved/lbm/device_kernels.hpp"
#include "resolved/lbm/fluid.hpp"

namespace hemowalk::lbm {

/// D3Q19 fluid in place (AA pattern), one thread per node. Bits do not depend on the order of threads.
/// Static solid nodes stay with the host fluid.
template <class Real>
class DeviceFluid {
 public:
  /// Takes over the parameters and the state of \p host. \p planes: the sweep over the lattice is cut into
  /// slabs of so many planes, and a slab's moments follow its collision while its populations are still in
  /// the cache (0: chosen from the size of the block, for 32 MB). \throws InputError for a fluid with solid
  /// nodes.
  DeviceFluid(Queue& queue, const Fluid<Real>& host, int planes = 0);

  // A block divided along z takes a step in three parts (Fluid's, fluid.hpp):
  //     begin_advance(force, velocity, share); send_borders(message);
  //     the neighbours exchange their messages
  //     receive_borders(message); end_advance(force, velocity, share);
  // The velocity's halo planes along z are left alone.
  void begin_advance(const Node4<Real>* force, Node4<Real>* velocity, Real share);
  void end_advance(const Node4<Real>* force, Node4<Real>* velocity, Real share);
  /// Messages lie on the host, [side: low, high][border_size()].
  std::size_t border_size() const { return border_.size() / 2; }
  void send_borders(Real* message);
  void receive_borders(const Real* message);

  /// Enqueues one step: collision with \p force (with halo; null: body force only), streaming, and velocity =
  /// u* + \p share F of the new state, with the periodic halo. Place of both fields: the queue's.
  void advance(const Node4<Real>* force, Node4<Real>* velocity, Real share);
  /// Enqueues velocity = u* + share F of the present state, and the walls' velocities beyond the walls. The
  /// halo along z of a divided block is left alone; before an odd step its neighbours' populations must be
  /// there.
  void moments(const Node4<Real>* force, Node4<Real>* velocity, Real share);
  /// A recorded graph of \p steps calls of advance() was replayed.
  void replayed(int steps);
  /// Which of the two kinds of step comes next: a recorded step may only be replayed at the parity it was
  /// recorded at.
  bool odd() const { return swapped_; }

  void upload(const Fluid<Real>& host);
  /// Waits, then writes the state into \p host.
  void download(Fluid<Real>& host) const;
  /// Momentum given to the walls since construction; waits.
  WallImpulse wall_impulse() const;
  std::int64_t steps() const { return steps_; }
  std::size_t memory_bytes() const;

 private:
  template <bool odd>
  void collide(const Node4<Real>* force, Node4<Real>* velocity, Real share);
  template <bool odd>
  void take_moments(int first_plane, int planes, const Node4<Real>* force, Node4<Real>* velocity, Real share);

  Queue& queue_;
  Block block_;
  Parameters parameters_;
  int planes_;
  bool swapped_ = false;
  std::int64_t steps_ = 0;
  Array<Real> f_, border_;
  Array<Node4<Real>> outgoing_;
  Array<double> wall_total_;
  Lattice<Real> lattice_;
  SumWallImpulse<Real> walls_;
};

extern template class DeviceFluid<float>;
extern template class DeviceFluid<double>;

}  // namespace hemowalk::lbm
