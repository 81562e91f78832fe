#include "resolved/contact/device_contact.hpp"

#include <cmath>
#include <string>

#include "core/check.hpp"
#include "resolved/contact/topology.hpp"

namespace hemowalk::contact {

template <class Real>
DeviceContact<Real>::DeviceContact(Queue& queue, const Law& law, const Domain& domain,
                                   const std::vector<Shape>& shapes,
                                   const std::vector<std::uint16_t>& shape_of,
                                   const std::vector<std::array<double, 3>>& load, int capacity)
    : queue_(queue), law_(law), domain_(domain), capacity_(capacity) {
  for (const double period : domain.period)
    require(period == 0 || period >= 16,
            "the box is too small for contact on the device (a period below 16 dx: a vertex could meet two "
            "images of a "
            "triangle) use place: host");
  require(domain.walls.geometry != Walls::Geometry::surface,
          "walls from a surface are not on the device (their distance lies on the host) use place: host");
  const Place place = queue.place();
  std::vector<Triangle3> triangles;
  std::vector<std::uint32_t> ring_begin, ring;
  std::vector<double> area;
  struct Start {
    std::size_t triangle, ring_begin, ring, area;
  };
  std::vector<Start> start;
  std::vector<Topology> topology;
  for (const Shape& shape : shapes) {
    const Topology& t = topology.emplace_back(shape);
    start.push_back({triangles.size(), ring_begin.size(), ring.size(), area.size()});
    for (const Corners& c : t.triangles) triangles.push_back({{c[0], c[1], c[2]}});
    ring_begin.insert(ring_begin.end(), t.ring_begin.begin(), t.ring_begin.end());
    ring.insert(ring.end(), t.ring.begin(), t.ring.end());
    area.insert(area.end(), t.area.begin(), t.area.end());
  }
  triangles_ = make_array(place, triangles), ring_begin_ = make_array(place, ring_begin);
  ring_ = make_array(place, ring), area_ = make_array(place, area);
  std::vector<Surface> surface;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    surface.push_back({triangles_.data() + start[i].triangle, ring_begin_.data() + start[i].ring_begin,
                       ring_.data() + start[i].ring, area_.data() + start[i].area,
                       static_cast<std::uint32_t>(topology[i].vertices()),
                       static_cast<std::uint32_t>(topology[i].triangles.size())});
  surface_ = make_array(place, surface);
  for (const Surface& each : surface) vertices_.push_back(each.vertices);
  stale_ = make_array(place, std::vector<unsigned>{1});
  tally_ = Array<Tally>(1, place);
  assign(shape_of, shape_of.size(), load);
}

template <class Real>
void DeviceContact<Real>::assign(const std::vector<std::uint16_t>& shape_of, std::size_t own,
                                 const std::vector<std::array<double, 3>>& load) {
  std::vector<std::uint32_t> shape, first;
  std::vector<std::int32_t> body;
  for (const std::uint16_t s : shape_of) {
    require(s < vertices_.size(),
            "contact: body of unknown shape (" + std::to_string(s) + ") give a shape for every kind of cell");
    const auto b = static_cast<std::int32_t>(shape.size());
    shape.push_back(s), first.push_back(static_cast<std::uint32_t>(body.size()));
    body.insert(body.end(), vertices_[s], b);
  }
  require(shape.size() < (std::size_t{1} << 26),
          "too many bodies for one device (their number shares a word with the "
          "image) split the domain");
  slots_ = static_cast<std::uint32_t>(body.size());
  own_ = static_cast<std::int32_t>(own);
  loaded_ = !load.empty();
  require(!loaded_ || load.size() == slots_, "loads need one force per vertex");
  std::vector<std::int64_t> grains;
  for (const auto& f : load)
    for (const double component : f) grains.push_back(to_grains(component));
  queue_.fit(shape_, shape.size()), queue_.fit(first_, first.size()), queue_.fit(body_, body.size());
  queue_.fit(count_, slots_), queue_.fit(reference_origin_, slots_), queue_.fit(reference_, slots_);
  queue_.fit(near_, static_cast<std::size_t>(capacity_) * slots_);
  queue_.fit(force_, 3 * static_cast<std::size_t>(slots_)), queue_.fit(load_, grains.size());
  queue_.upload(shape_, shape), queue_.upload(first_, first), queue_.upload(body_, body);
  queue_.upload(load_, grains);
  queue_.upload(stale_, std::vector<unsigned>{1});  // nothing was searched yet
}

template <class Real>
void DeviceContact<Real>::compute(const Origin* origin, const Node4<Real>* local, const BinView& bins) {
  const Crowd<Real> crowd{law_,
                          domain_,
                          slots_,
                          own_,
                          capacity_,
                          surface_.data(),
                          shape_.data(),
                          first_.data(),
                          body_.data(),
                          origin,
                          local,
                          reference_origin_.data(),
                          reference_.data(),
                          stale_.data(),
                          count_.data(),
                          near_.data(),
                          force_.data(),
                          loaded_ ? load_.data() : nullptr,
                          tally_.data()};
  queue_.for_each(slots_, StartForces<Real>{crowd});
  if (law_.stiffness <= 0) return;
  queue_.for_each(slots_, MeasureEdges<Real>{crowd});
  queue_.for_each(slots_, FindNear<Real>{crowd, bins});
  queue_.for_each(slots_, PressVertices<Real>{crowd});
}

template <class Real>
Tally DeviceContact<Real>::tally() const {
  Tally t;
  queue_.copy(&t, tally_.data(), 1);
  queue_.wait();
  return t;
}

template <class Real>
Summary DeviceContact<Real>::summary() const {
  const Tally t = tally();
  if (t.overflow < 0)
    throw PhysicsError("contact: a vertex has " + std::to_string(-t.overflow) +
                       " triangles of other cells in reach (the "
                       "device keeps " +
                       std::to_string(capacity_) +
                       ") cells have collapsed onto each other, or give "
                       "the lists more room");
  if (t.longest_edge_squared() > torn_edge * torn_edge)
    throw PhysicsError("contact: a cell's edge is " + std::to_string(std::sqrt(t.longest_edge_squared())) +
                       " dx long (blow-up) lower the acceleration or raise coupling.iterations");
  Summary s;
  if (slots_ == 0) return s;  // nobody has pressed since: the sums are of an earlier step
  if (unordered(t.gap) < 1e30f) s.minimum_gap = static_cast<double>(unordered(t.gap));
  if (unordered(t.wall_gap) < 1e30f) s.minimum_wall_gap = static_cast<double>(unordered(t.wall_gap));
  s.contacts = t.contacts, s.wall_contacts = t.wall_contacts;
  s.energy = force_grain * static_cast<double>(t.energy);
  for (std::size_t w = 0; w < 2; ++w)
    for (std::size_t d = 0; d < 3; ++d)
      s.wall_force[w][d] = force_grain * static_cast<double>(t.wall_force[w][d]);
  return s;
}

template <class Real>
std::array<std::array<double, 3>, 2> DeviceContact<Real>::wall_impulse() const {
  const Tally t = tally();
  std::array<std::array<double, 3>, 2> sum{};
  for (std::size_t w = 0; w < 2; ++w)
    for (std::size_t d = 0; d < 3; ++d)
      sum[w][d] = t.wall_before[w][d] + force_grain * static_cast<double>(t.wall_force[w][d]);
  return sum;
}

template <class Real>
std::size_t DeviceContact<Real>::memory_bytes() const {
  return near_.size() * sizeof(Near) + force_.size() * sizeof(std::int64_t) +
         reference_.size() * (sizeof(Node4<Real>) + sizeof(Origin));
}

template class DeviceContact<float>;
template class DeviceContact<double>;

}  // namespace hemowalk::contact
