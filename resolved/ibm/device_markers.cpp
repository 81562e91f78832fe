#include "resolved/ibm/device_markers.hpp"

#include <limits>

#include "core/check.hpp"

namespace hemowalk::ibm {

template <class Real>
DeviceMarkers<Real>::DeviceMarkers(Queue& queue, const Block& block, const Faces& faces, Kernel kernel,
                                   const std::vector<std::int32_t>& body_of)
    : queue_(queue),
      bins_(Bins::make(block, !faces.periodic_y, !faces.periodic_z)),
      kernel_(kernel),
      count_(bins_.count(), queue.place()),
      begin_(bins_.count() + 1, queue.place()),
      fault_(make_array(queue.place(), std::vector<MarkerFault>{{no_fault}})),
      wall_last_(2 * static_cast<std::size_t>(block.nz) * 3, queue.place()),
      wall_total_(2 * static_cast<std::size_t>(block.nz) * 3, queue.place()) {
  require(faces.periodic_x, "the device's markers need periodic x (their tiles wrap)");
  constexpr int most = std::numeric_limits<std::int16_t>::max() - 40;
  require(block.nx < most && block.ny < most && block.nz < most,
          "a block of more than 32 727 nodes along an axis (a marker's node is 16 bits) split it");
  assign(body_of);
}

template <class Real>
void DeviceMarkers<Real>::assign(const std::vector<std::int32_t>& body_of) {
  for (const auto b : body_of) require(b >= 0, "the device's markers have no idle slots");
  markers_ = body_of.size();
  queue_.fit(body_, markers_);
  for (auto* array : {&bin_, &place_, &listed_}) queue_.fit(*array, markers_);
  queue_.fit(placed_, markers_);
  queue_.upload(body_, body_of);
}

template <class Real>
void DeviceMarkers<Real>::locate(const Origin* origin, const Node4<Real>* site) {
  const std::size_t n = markers_;
  queue_.for_each(n, CountMarkers<Real>{bins_, body_.data(), origin, site, count_.data(), bin_.data(),
                                        place_.data(), fault_.data()});
  queue_.blocks(1, ScanBins::shared_bytes(),
                ScanBins{static_cast<std::uint32_t>(bins_.count()), count_.data(), begin_.data()});
  queue_.for_each(n, ListMarkers{bin_.data(), place_.data(), begin_.data(), listed_.data()});
  queue_.for_each(n, PlaceMarkers<Real>{bins_, kernel_, body_.data(), origin, site, bin_.data(),
                                        begin_.data(), listed_.data(), placed_.data()});
}

template <class Real>
void DeviceMarkers<Real>::interpolate(const Node4<Real>* field, Node4<Real>* out) {
  const std::size_t n = markers_;
  queue_.blocks((4 * n + Interpolate<Real>::threads - 1) / Interpolate<Real>::threads,
                Interpolate<Real>::shared_bytes(),
                Interpolate<Real>{bins_.block, static_cast<std::uint32_t>(n), placed_.data(), field, out});
}

template <class Real>
void DeviceMarkers<Real>::spread(const Node4<Real>* value, Node4<Real>* field, double h) {
  queue_.blocks(bins_.tiles(), Spread<Real>::shared_bytes(),
                Spread<Real>{bins_, begin_.data(), placed_.data(), value, field});
  if (bins_.walls_y)
    queue_.blocks(2 * static_cast<std::size_t>(bins_.block.nz), SumWallShare<Real>::shared_bytes(),
                  SumWallShare<Real>{bins_.block, h, field, wall_total_.data(), wall_last_.data()});
}

template <class Real>
int DeviceMarkers<Real>::fault() const {
  MarkerFault seen{};
  queue_.copy(&seen, fault_.data(), 1);
  queue_.wait();
  return seen.marker == no_fault ? -1 : seen.marker;
}

template <class Real>
std::array<std::array<double, 3>, 2> DeviceMarkers<Real>::sum(const Array<double>& planes) const {
  Array<double> values(planes.size());
  queue_.copy(values.data(), planes.data(), planes.size());
  queue_.wait();
  std::array<std::array<double, 3>, 2> total{};
  for (std::size_t i = 0; i < values.size(); ++i) total[2 * i / values.size()][i % 3] += values[i];
  return total;
}

template <class Real>
std::size_t DeviceMarkers<Real>::memory_bytes() const {
  return body_.size() * (4 * sizeof(std::uint32_t) + sizeof(Placed<Real>)) +
         2 * begin_.size() * sizeof(std::uint32_t);
}

template class DeviceMarkers<float>;
template class DeviceMarkers<double>;

}  // namespace hemowalk::ibm
