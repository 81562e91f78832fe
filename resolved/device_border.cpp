#include "resolved/device_border.hpp"

#include <utility>

namespace hemowalk::resolved {

namespace {

/// packed[i] = field[slot[i]].
template <class Real>
struct Gather {
  const std::uint32_t* slot;
  const Node4<Real>* field;
  Node4<Real>* packed;
  HEMO_HD void operator()(std::size_t i) const { packed[i] = field[slot[i]]; }
};

/// field[slot[i]] += packed[i]; no slot comes twice.
template <class Real>
struct AddTo {
  const std::uint32_t* slot;
  const Node4<Real>* packed;
  Node4<Real>* field;
  HEMO_HD void operator()(std::size_t i) const {
    Node4<Real>& to = field[slot[i]];
    to = {to.x + packed[i].x, to.y + packed[i].y, to.z + packed[i].z, to.w};
  }
};

/// Lowest and highest z of each body's vertices and coupling points: one block per body.
template <class Real>
struct MeasureExtents {
  static constexpr int threads = 64;
  const std::uint32_t* first;  ///< [body + 1]
  const ibm::Origin* origin;
  const Node4<Real>*vertex, *site;
  Extent* extent;

  static constexpr std::size_t shared_bytes() { return 2 * threads * sizeof(Real); }
  HEMO_HD int phases() const { return 2; }
  HEMO_HD static Real lower(Real a, Real b) { return b < a ? b : a; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    auto* low = reinterpret_cast<Real*>(shared);
    Real* minus_high = low + threads;  // of minus: the highest
    if (phase == 0) {
      const std::uint32_t start = first[at.block];
      Real least = vertex[start].z, most = -least;
      for (std::uint32_t s = start + at.thread; s < first[at.block + 1]; s += threads) {
        least = lower(least, lower(vertex[s].z, site[s].z));
        most = lower(most, lower(-vertex[s].z, -site[s].z));
      }
      low[at.thread] = least, minus_high[at.thread] = most;
    } else if (at.thread == 0) {
      Real least = low[0], most = minus_high[0];
      for (int t = 1; t < threads; ++t) least = lower(least, low[t]), most = lower(most, minus_high[t]);
      const double z = reinterpret_cast<const std::int32_t*>(origin + at.block)[2];
      extent[at.block] = {z + static_cast<double>(least), z - static_cast<double>(most)};
    }
  }
};

}  // namespace

template <class Real>
DeviceBorder<Real>::DeviceBorder(Queue& queue, const Decomposition& decomposition, double contact_range,
                                 std::vector<int> vertices, std::size_t border_size)
    : queue_(queue),
      copies_(decomposition, contact_range, vertices, MarkersOfCopies::shared),
      vertices_(std::move(vertices)),
      populations_(decomposition, Topic::populations),
      outgoing_(queue.place(), 2 * border_size),
      incoming_(queue.place(), 2 * border_size),
      origin_(queue.place()),
      extent_(queue.place()),
      vertex_(queue.place()),
      site_(queue.place()),
      value_(queue.place()),
      packed_(queue.place()) {}

template <class Real>
void DeviceBorder<Real>::set_bodies(const std::vector<std::uint16_t>& shapes) {
  std::vector<contact::Body> bodies;
  std::vector<std::uint32_t> first{0};
  for (const std::uint16_t shape : shapes) {
    bodies.push_back({first.back(), 1, shape, true});
    first.push_back(first.back() + static_cast<std::uint32_t>(vertices_[shape]));
  }
  bodies_ = bodies.size(), slots_ = first.back();
  queue_.fit(first_there_, first.size());
  queue_.upload(first_there_, first);
  queue_.fit(extent_there_, bodies_);
  copies_.set_bodies(std::move(bodies), slots_);
  list_slots();
}

/// Room for what the lists say, and the slots they mean.
template <class Real>
void DeviceBorder<Real>::list_slots() {
  std::vector<std::uint8_t> on_list(bodies_, 0);
  for (const Side side : both_sides)
    for (const std::uint32_t b : copies_.listed(side)) on_list[b] = 1;
  listed_.clear();
  for (std::size_t b = 0; b < bodies_; ++b) {
    const contact::Body& body = copies_.bodies()[b];
    for (int k = 0; k < vertices_[body.shape] && on_list[b]; ++k)
      listed_.push_back(body.first + static_cast<std::uint32_t>(k));
  }
  queue_.fit(listed_there_, listed_.size());
  queue_.upload(listed_there_, listed_);
  queue_.fit(packed_there_, 2 * listed_.size());
  origin_.fit(copies_.bodies().size()), extent_.fit(bodies_);
  for (auto* field : {&vertex_, &site_, &value_}) field->fit(copies_.slots());
  packed_.fit(2 * listed_.size());
}

template <class Real>
void DeviceBorder<Real>::enqueue_positions(const BodyFields<Real>& at) {
  const std::size_t n = listed_.size();
  queue_.blocks(
      bodies_, MeasureExtents<Real>::shared_bytes(),
      MeasureExtents<Real>{first_there_.data(), at.origin, at.vertex, at.site, extent_there_.data()});
  queue_.for_each(n, Gather<Real>{listed_there_.data(), at.vertex, packed_there_.data()});
  queue_.for_each(n, Gather<Real>{listed_there_.data(), at.site, packed_there_.data() + n});
  queue_.copy(extent_.data(), extent_there_.data(), bodies_);
  queue_.copy(origin_.data(), at.origin, bodies_);
  queue_.copy(packed_.data(), packed_there_.data(), 2 * n);
}

template <class Real>
bool DeviceBorder<Real>::exchange_positions(const BodyFields<Real>& at) {
  queue_.wait();
  if (copies_.lists_anew(extents())) {
    queue_.copy(vertex_.data(), at.vertex, slots_);
    queue_.copy(site_.data(), at.site, slots_);
    queue_.wait();
  } else {
    for (std::size_t i = 0; i < listed_.size(); ++i)
      vertex_[listed_[i]] = packed_[i], site_[listed_[i]] = packed_[listed_.size() + i];
  }
  const bool anew = copies_.exchange(extents(), origin_.view(), vertex_.view(), site_.view()).bodies;
  if (anew) list_slots();
  copies_.place(origin_.view(), vertex_.view(), site_.view());
  return anew;
}

template <class Real>
void DeviceBorder<Real>::enqueue_copies(const BodyFields<Real>& at) {
  queue_.copy(at.origin + bodies_, origin_.data() + bodies_, copies_.bodies().size() - bodies_);
  queue_.copy(at.vertex + slots_, vertex_.data() + slots_, copied_slots());
  queue_.copy(at.site + slots_, site_.data() + slots_, copied_slots());
}

template <class Real>
void DeviceBorder<Real>::enqueue_readings_down(const BodyFields<Real>& at) {
  queue_.copy(value_.data() + slots_, at.reading + slots_, copied_slots());
}

template <class Real>
void DeviceBorder<Real>::send_readings() {
  queue_.wait();
  copies_.send_readings(std::as_const(value_).view());
}

template <class Real>
void DeviceBorder<Real>::receive_readings() {
  for (const std::uint32_t slot : listed_) value_[slot] = {Real(0), Real(0), Real(0), Real(0)};
  copies_.receive_readings(value_.view());
  for (std::size_t i = 0; i < listed_.size(); ++i) packed_[i] = value_[listed_[i]];
}

template <class Real>
void DeviceBorder<Real>::enqueue_readings_up(const BodyFields<Real>& at) {
  queue_.copy(packed_there_.data(), packed_.data(), listed_.size());
  queue_.for_each(listed_.size(), AddTo<Real>{listed_there_.data(), packed_there_.data(), at.reading});
}

template <class Real>
void DeviceBorder<Real>::enqueue_impulses_down(const BodyFields<Real>& at) {
  queue_.for_each(listed_.size(), Gather<Real>{listed_there_.data(), at.impulse, packed_there_.data()});
  queue_.copy(packed_.data(), packed_there_.data(), listed_.size());
}

template <class Real>
void DeviceBorder<Real>::exchange_impulses() {
  queue_.wait();
  for (std::size_t i = 0; i < listed_.size(); ++i) value_[listed_[i]] = packed_[i];
  copies_.send_impulses(std::as_const(value_).view());
  copies_.receive_impulses(value_.view());
}

template <class Real>
void DeviceBorder<Real>::enqueue_impulses_up(const BodyFields<Real>& at) {
  queue_.copy(at.impulse + slots_, value_.data() + slots_, copied_slots());
}

template <class Real>
void DeviceBorder<Real>::exchange_populations() {
  queue_.wait();
  const std::size_t n = outgoing_.size() / 2;
  for (const Side side : both_sides) {
    populations_.receive(side, incoming_.data() + index_of(side) * n, n);
    populations_.send(side, outgoing_.data() + index_of(side) * n, n);
  }
  populations_.wait();
}

template class DeviceBorder<float>;
template class DeviceBorder<double>;

}  // namespace hemowalk::resolved
