#pragma once
/// \file DeviceContact: contact forces on a Queue's place; neighbours are searched on the device when bodies
/// have moved by half the skin, without the host. contact::Contact is the definition of right.

#include "core/device.hpp"
#include "resolved/contact/device_kernels.hpp"

namespace hemowalk::contact {

template <class Real>
class DeviceContact {
 public:
  /// Bodies in order; the vertices of body b are slots first[b] .. and follow each other.
  /// \p load: [slot][3] constant forces that are added, or empty. \p capacity: triangles a vertex's list
  /// holds. \throws InputError for a period below 16 dx and for walls from a surface.
  DeviceContact(Queue& queue, const Law& law, const Domain& domain, const std::vector<Shape>& shapes,
                const std::vector<std::uint16_t>& shape_of,
                const std::vector<std::array<double, 3>>& load = {}, int capacity = 48);

  /// Other bodies from now on, the first \p own of them owned, the others neighbours' copies. Lists are
  /// searched anew. Memory only grows; graphs that were recorded before are void.
  void assign(const std::vector<std::uint16_t>& shape_of, std::size_t own,
              const std::vector<std::array<double, 3>>& load);

  /// Enqueues: forces()[slot] = contact force + load. \p bins: the slots by bin, of positions at most
  /// bins.slack away from these.
  void compute(const Origin* origin, const Node4<Real>* local, const BinView& bins);
  /// [slot][3], multiples of force_grain.
  const std::int64_t* forces() const { return force_.data(); }
  std::uint32_t slots() const { return slots_; }

  /// Of the last compute(); waits. \throws PhysicsError if a list was too short or a cell is torn: forces
  /// were left out.
  Summary summary() const;
  /// Impulse on the walls since the start, for one step per compute(); waits.
  std::array<std::array<double, 3>, 2> wall_impulse() const;
  std::int64_t searches() const { return tally().searches; }
  std::size_t memory_bytes() const;

 private:
  Tally tally() const;

  Queue& queue_;
  Law law_;
  Domain domain_;
  int capacity_;
  std::uint32_t slots_ = 0;
  std::int32_t own_ = 0;
  bool loaded_ = false;
  std::vector<std::uint32_t> vertices_;  ///< [shape]
  Array<Triangle3> triangles_;
  Array<std::uint32_t> ring_begin_, ring_, shape_, first_, count_;
  Array<double> area_;
  Array<Surface> surface_;
  Array<std::int32_t> body_;
  Array<Origin> reference_origin_;
  Array<Node4<Real>> reference_;
  Array<unsigned> stale_;
  Array<Near> near_;
  Array<std::int64_t> force_, load_;
  Array<Tally> tally_;
};

extern template class DeviceContact<float>;
extern template class DeviceContact<double>;

}  // namespace hemowalk::contact
