#pragma once
/// \file DeviceBorder: what a DeviceSimulation and those of the neighbouring ranks tell each other. Whole
/// bodies are copied where they come near a border (Copies with shared markers), so that no plane of a field
/// travels: each rank interpolates and spreads all markers it knows for the nodes of its own slab. Messages
/// per neighbour and step: positions, readings, impulses, and the populations that cross the border. They
/// pass through pinned memory of the host. Everything called enqueue_* may be recorded in a graph, which is
/// valid as long as the lists are.

#include <memory>
#include <vector>

#include "core/device.hpp"
#include "resolved/copies.hpp"
#include "resolved/decomposition.hpp"

namespace hemowalk::resolved {

/// Where the positions and values of own bodies, then copies, lie: all at the queue's place.
template <class Real>
struct BodyFields {
  ibm::Origin* origin;            ///< [body]
  Node4<Real>*vertex, *site;      ///< [slot]
  Node4<Real>*reading, *impulse;  ///< [slot]
};

template <class Real>
class DeviceBorder {
 public:
  /// \param contact_range, \param vertices as for Copies. \param border_size numbers of a message of
  /// populations.
  DeviceBorder(Queue& queue, const Decomposition& decomposition, double contact_range,
               std::vector<int> vertices, std::size_t border_size);

  /// Own bodies, whose slots follow each other, of these shapes from now on.
  void set_bodies(const std::vector<std::uint16_t>& shapes);
  /// Who leaves and who comes: see Copies.
  Copies<Real>& copies() { return copies_; }
  const Copies<Real>& copies() const { return copies_; }

  /// Positions of own bodies come down.
  void enqueue_positions(const BodyFields<Real>& at);
  /// Waits and exchanges them. \returns whether other copies are here now: then room for bodies() and slots()
  /// of copies() is to be made before copies go up. \p at: as they were enqueued.
  bool exchange_positions(const BodyFields<Real>& at);
  /// How long the own bodies are along z, as last exchanged.
  View<const Extent> extents() const { return {extent_.data(), bodies_}; }
  /// Positions of the copies go up.
  void enqueue_copies(const BodyFields<Real>& at);

  /// What was read for the copies comes down; the sums for own bodies go up.
  void enqueue_readings_down(const BodyFields<Real>& at);
  void send_readings();
  void receive_readings();
  void enqueue_readings_up(const BodyFields<Real>& at);

  /// Impulses of own bodies come down; those of the copies go up.
  void enqueue_impulses_down(const BodyFields<Real>& at);
  void exchange_impulses();
  void enqueue_impulses_up(const BodyFields<Real>& at);

  /// Populations under way: [side][border_size].
  Real* outgoing() { return outgoing_.data(); }
  const Real* incoming() const { return incoming_.data(); }
  void exchange_populations();

 private:
  void list_slots();
  std::size_t copied_slots() const { return copies_.slots() - slots_; }

  Queue& queue_;
  Copies<Real> copies_;
  std::vector<int> vertices_;
  Ring populations_;
  std::size_t bodies_ = 0, slots_ = 0;  ///< own
  // On the host.
  PinnedArray<Real> outgoing_, incoming_;
  PinnedArray<ibm::Origin> origin_;                 ///< [body]
  PinnedArray<Extent> extent_;                      ///< [own body]
  PinnedArray<Node4<Real>> vertex_, site_, value_;  ///< [slot]
  PinnedArray<Node4<Real>> packed_;                 ///< two values per listed slot
  std::vector<std::uint32_t> listed_;               ///< own slots that a neighbour has copies of
  // At the queue's place.
  Array<std::uint32_t> listed_there_, first_there_;  ///< the latter: [own body + 1] first slot
  Array<Extent> extent_there_;
  Array<Node4<Real>> packed_there_;
};

extern template class DeviceBorder<float>;
extern template class DeviceBorder<double>;

}  // namespace hemowalk::resolved
