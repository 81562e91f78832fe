#pragma once
/// \file DeviceMarkers: interpolation and spreading on a Queue's place, sorted afresh every step,
/// deterministic and without atomics on floating-point numbers. ibm::Markers is the definition of right.

#include "core/device.hpp"
#include "resolved/ibm/device_kernels.hpp"
#include "resolved/ibm/markers.hpp"

namespace hemowalk::ibm {

template <class Real>
class DeviceMarkers {
 public:
  /// \p body_of: the body of each marker, >= 0. On a block divided along z each of its nodes counts once, for
  /// markers within and beyond it: readings and forces of all blocks add up to the whole, where the field's
  /// halo along z is zero.
  DeviceMarkers(Queue& queue, const Block& block, const Faces& faces, Kernel kernel,
                const std::vector<std::int32_t>& body_of);

  /// Another set of markers from now on. Memory only grows; graphs that were recorded before are void.
  void assign(const std::vector<std::int32_t>& body_of);

  // All of these enqueue work; the arrays are at the queue's place.

  /// Takes the positions origin[body] + site[marker]. Faults are kept: see fault().
  void locate(const Origin* origin, const Node4<Real>* site);
  /// out[m] = sum over nodes of phi(x - X_m) field(x), all four components; the field's halo is filled.
  void interpolate(const Node4<Real>* field, Node4<Real>* out);
  /// field(x) = sum over markers of phi(x - X_m) value[m]: the interior of the field is written, not added
  /// to. What falls beyond a wall is booked as that wall's impulse, \p h fluid steps long.
  void spread(const Node4<Real>* value, Node4<Real>* field, double h);

  /// Lowest marker that was not finite or outside the walls since the start, or -1. Waits.
  int fault() const;
  /// Impulse on the lower and the upper wall: of the last spread (per fluid step), and since the start.
  /// Waits.
  std::array<std::array<double, 3>, 2> wall_force() const { return sum(wall_last_); }
  std::array<std::array<double, 3>, 2> wall_impulse() const { return sum(wall_total_); }
  std::size_t count() const { return markers_; }
  std::size_t memory_bytes() const;

  // For kernels that look for neighbours.
  const Bins& bins() const { return bins_; }
  const std::uint32_t* begin() const { return begin_.data(); }
  /// Markers by bin, in no order within one.
  const std::uint32_t* listed() const { return listed_.data(); }

 private:
  std::array<std::array<double, 3>, 2> sum(const Array<double>& planes) const;

  Queue& queue_;
  Bins bins_;
  Kernel kernel_;
  std::size_t markers_ = 0;
  Array<std::int32_t> body_;
  Array<std::uint32_t> count_, begin_, bin_, place_, listed_;
  Array<Placed<Real>> placed_;
  Array<MarkerFault> fault_;
  Array<double> wall_last_, wall_total_;
};

extern template class DeviceMarkers<float>;
extern template class DeviceMarkers<double>;

}  // namespace hemowalk::ibm
