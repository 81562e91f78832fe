#include "resolved/device_simulation.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/rigid/shape.hpp"

namespace hemowalk::resolved {

template <class Real>
DeviceSimulation<Real>::DeviceSimulation(Queue& queue, const Simulation<Real>& host)
    : queue_(queue),
      scene_(host.scene()),
      block_(host.block()),
      h_(scene_.coupling.solid_every),
      share_(static_cast<Real>(0.5 * scene_.coupling.theta_n)),
      fluid_(queue, host.fluid()),
      velocity_(place_copy(queue.place(), host.velocity_)),
      force_(place_copy(queue.place(), host.force_)),
      fluid_steps_(host.fluid_steps()),
      first_step_(host.fluid_steps()),
      taken_before_(host.taken_) {
  require(host.one_theta_,
          "coupling.theta has two values (the device reads velocity and correction as one field) give both "
          "the same "
          "value, or use place: host");
  build_groups(host);
}

template <class Real>
void DeviceSimulation<Real>::build_groups(const Simulation<Real>& host) {
  bodies_ = static_cast<std::size_t>(host.bodies());
  if (bodies_ == 0) return;
  const Place place = queue_.place();
  std::vector<std::int32_t> body_of;
  std::vector<contact::Shape> shapes;
  std::vector<std::uint16_t> shape_of;
  for (const auto& group : host.groups())
    std::visit(
        [&](const auto& g) {
          contact::Shape shape;
          for (const auto& t : g.rest().triangles)
            for (const int v : t) shape.triangles.push_back(static_cast<std::uint32_t>(v));
          shape.area = g.vertex_areas();
          shapes.push_back(std::move(shape));
          for (int c = 0; c < g.count(); ++c) {
            body_of.insert(body_of.end(), static_cast<std::size_t>(g.vertices()),
                           static_cast<std::int32_t>(shape_of.size()));
            shape_of.push_back(static_cast<std::uint16_t>(shapes.size() - 1));
          }
        },
        group.cells);
  slots_ = body_of.size();
  reading_ = Array<Node4<Real>>(slots_, place), impulse_ = Array<Node4<Real>>(slots_, place);
  vertex_ = Array<Node4<Real>>(slots_, place), site_ = Array<Node4<Real>>(slots_, place);
  origin_ = Array<ibm::Origin>(bodies_, place);
  upload_impulses(host);
  markers_ = std::make_unique<ibm::DeviceMarkers<Real>>(queue_, block_, host.faces_,
                                                        make_kernel(scene_.coupling.kernel), body_of);
  std::vector<std::array<double, 3>> load;
  if (!host.loads_.empty()) {
    load.assign(slots_, {0, 0, 0});
    const auto from = host_slots(host);
    for (const auto& l : host.loads_) {
      const auto at = std::find(from.begin(), from.end(), l.slot) - from.begin();
      for (int d = 0; d < 3; ++d) load[static_cast<std::size_t>(at)][d] += l.force[d];
    }
  }
  contact_ = std::make_unique<contact::DeviceContact<Real>>(
      queue_, make_contact(scene_, host.units()), make_domain(scene_, block_), shapes, shape_of, load);
  std::uint32_t first_slot = 0, first_body = 0;
  const auto gravity = host.half_body_force();
  const std::vector<Real> none;
  for (const auto& group : host.groups()) {
    auto make = [&]() -> std::variant<npfem::DeviceMembranes<Real>, rigid::DeviceBodies<Real>> {
      if (const auto* m = std::get_if<npfem::Membranes<Real>>(&group.cells))
        return npfem::DeviceMembranes<Real>(queue_, *m);
      return rigid::DeviceBodies<Real>(queue_, std::get<rigid::RigidBodies<Real>>(group.cells));
    };
    depth_ = std::max(depth_, scene_.coupling.retraction);
    if (const auto* bodies = std::get_if<rigid::RigidBodies<Real>>(&group.cells))
      for (std::size_t k = 0; k < bodies->shape().arm.size(); ++k)
        depth_ =
            std::max(depth_, mesh::norm(mesh::subtract(bodies->shape().arm[k], bodies->shape().held[k])));
    const mesh::TriangleMesh& rest =
        std::visit([](const auto& g) -> const mesh::TriangleMesh& { return g.rest(); }, group.cells);
    std::vector<Corners> triangle;
    std::vector<std::vector<int>> rings(rest.vertices.size());
    for (const auto& t : rest.triangles) {
      for (int c = 0; c < 3; ++c)
        rings[static_cast<std::size_t>(t[c])].push_back(4 * static_cast<int>(triangle.size()) + c);
      triangle.push_back({{t[0], t[1], t[2]}});
    }
    std::vector<int> ring_begin(1, 0), ring;
    for (const auto& r : rings) {
      ring.insert(ring.end(), r.begin(), r.end());
      ring_begin.push_back(static_cast<int>(ring.size()));
    }
    std::vector<Real> mass, weight, inverse_metric;
    for (std::size_t k = 0; k < group.mass.size(); ++k) {
      mass.push_back(static_cast<Real>(group.mass[k]));
      weight.push_back(static_cast<Real>(group.weight[k]));
      inverse_metric.push_back(static_cast<Real>(1 / (group.mass[k] + h_ * group.weight[k])));
    }
    groups_.push_back({make(), make_array(place, ring_begin), make_array(place, ring),
                       make_array(place, triangle), make_array(place, mass), make_array(place, weight),
                       make_array(place, inverse_metric), CellCoupling<Real>{}});
    Group& here = groups_.back();
    here.coupling = {
        std::visit([](const auto& g) { return g.fields(); }, here.cells),
        here.ring_begin.data(),
        here.ring.data(),
        here.triangle.data(),
        here.mass.data(),
        here.weight.data(),
        here.inverse_metric.data(),
        {static_cast<Real>(scene_.coupling.theta_n), static_cast<Real>(scene_.coupling.theta_t)},
        {static_cast<Real>(gravity[0]), static_cast<Real>(gravity[1]), static_cast<Real>(gravity[2])},
        static_cast<Real>(h_),
        static_cast<Real>(scene_.coupling.retraction),
        static_cast<Real>(contact::force_grain),
        first_slot,
        first_body,
        {block_.nx, host.faces_.periodic_y ? block_.ny : 0, block_.nz},
        reading_.data(),
        impulse_.data(),
        contact_->forces(),
        vertex_.data(),
        site_.data(),
        reinterpret_cast<std::int32_t*>(origin_.data()),
        nullptr};
    if (auto* bodies = std::get_if<rigid::DeviceBodies<Real>>(&here.cells))
      here.coupling.couple = bodies->couples();
    const auto count = static_cast<std::uint32_t>(group.count());
    first_slot += count * static_cast<std::uint32_t>(rest.vertices.size());
    first_body += count;
    queue_.blocks(count, 0, PlaceCells<Real>{here.coupling});
  }
  queue_.wait();
}

template <class Real>
std::vector<std::uint32_t> DeviceSimulation<Real>::host_slots(const Simulation<Real>& host) const {
  std::vector<std::uint32_t> slots;
  for (const auto& group : host.groups()) {
    const int vertices = std::visit([](const auto& g) { return g.vertices(); }, group.cells);
    for (int c = 0; c < group.count(); ++c)
      for (int k = 0; k < vertices; ++k) slots.push_back(group.marker(c, k));
  }
  return slots;
}

template <class Real>
void DeviceSimulation<Real>::upload_impulses(const Simulation<Real>& host) {
  Array<Node4<Real>> impulse(slots_);
  const auto from = host_slots(host);
  for (std::size_t s = 0; s < slots_; ++s) impulse[s] = host.impulse_[from[s]];
  queue_.copy(impulse_.data(), impulse.data(), slots_);
  queue_.wait();
}

template <class Real>
template <class After>
void DeviceSimulation<Real>::enqueue(const After& after) {
  const Node4<Real>* force = nullptr;
  if (bodies_ > 0) {
    markers_->locate(origin_.data(), site_.data());
    after(&PartTimes::locate);
    markers_->interpolate(velocity_.data(), reading_.data());
    after(&PartTimes::interpolation);
    const ibm::Bins& bins = markers_->bins();
    contact_->compute(origin_.data(), vertex_.data(),
                      {block_, bins.walls_y, ibm::bin_edge, bins.x, bins.y, bins.z, markers_->begin(),
                       markers_->listed(), depth_ + 1e-3});
    after(&PartTimes::contact);
    mesh::StepOptions options;
    options.iterations = scene_.coupling.iterations;
    for (auto& group : groups_)
      std::visit(
          [&](const auto& cells) {
            using Solid = typename std::decay_t<decltype(cells)>::Step;
            const std::size_t shared =
                std::max(cells.shared_bytes(), CellCoupling<Real>::shared_bytes(cells.vertices()));
            queue_.blocks(static_cast<std::size_t>(cells.count()), shared,
                          CoupledStep<Real, Solid>{group.coupling, cells.body(options)});
          },
          group.cells);
    after(&PartTimes::solid);
    markers_->spread(impulse_.data(), force_.data(), h_);
    after(&PartTimes::spreading);
    force = force_.data();
  }
  for (int k = 0; k < scene_.coupling.solid_every; ++k)
    fluid_.advance(force, velocity_.data(), k + 1 == scene_.coupling.solid_every ? share_ : Real(0));
  after(&PartTimes::fluid);
}

/// Even and odd steps of the fluid are different kernels: two graphs, unless a coupling step has an even
/// number.
template <class Real>
void DeviceSimulation<Real>::step() {
  Graph& graph = graph_[fluid_.odd()];
  if (graph.empty()) {
    queue_.begin_recording();
    enqueue([](auto) {});
    graph = queue_.end_recording();
  } else {
    fluid_.replayed(scene_.coupling.solid_every);
  }
  queue_.replay(graph);
  fluid_steps_ += scene_.coupling.solid_every;
  if (++steps_ % check_interval == 0) check();
}

template <class Real>
PartTimes DeviceSimulation<Real>::time_parts(int steps) {
  PartTimes total;
  using Part = double PartTimes::*;
  for (int i = 0; i < steps; ++i) {
    std::vector<std::pair<Part, Queue::Moment>> marks;
    const auto start = queue_.now();
    enqueue([&](Part part) { marks.emplace_back(part, queue_.now()); });
    fluid_steps_ += scene_.coupling.solid_every;
    ++steps_;
    queue_.wait();
    for (std::size_t m = 0; m < marks.size(); ++m)
      total.*marks[m].first += marks[m].second.seconds_since(m == 0 ? start : marks[m - 1].second) / steps;
  }
  check();
  return total;
}

template <class Real>
void DeviceSimulation<Real>::check() const {
  if (bodies_ == 0) return queue_.wait();
  const std::string blow_up = " (blow-up) lower the acceleration or raise coupling.iterations";
  const int marker = markers_->fault();
  std::size_t first = 0;
  for (const auto& group : groups_) {
    const auto report = std::visit([](const auto& g) { return g.report(); }, group.cells);
    if (report.bad_cell >= 0)
      throw PhysicsError("cell " + std::to_string(first + static_cast<std::size_t>(report.bad_cell)) +
                         " is no longer finite at or before step " + std::to_string(fluid_steps_) + blow_up);
    first += static_cast<std::size_t>(std::visit([](const auto& g) { return g.count(); }, group.cells));
  }
  if (marker >= 0)
    throw PhysicsError("marker " + std::to_string(marker) +
                       " is not finite or outside the walls at or before step " +
                       std::to_string(fluid_steps_) + blow_up);
  (void)contact_->summary();
}

template <class Real>
void DeviceSimulation<Real>::download(Simulation<Real>& host) const {
  check();
  fluid_.download(host.fluid_);
  queue_.copy(host.velocity_.data(), velocity_.data(), velocity_.size());
  queue_.copy(host.force_.data(), force_.data(), force_.size());
  queue_.wait();
  host.fluid_steps_ = fluid_steps_;
  host.taken_ = taken_before_;
  const auto add = [](std::array<double, 3>& to, const std::array<double, 3>& more, double times) {
    for (int d = 0; d < 3; ++d) to[d] += times * more[d];
  };
  const auto impulse = fluid_.wall_impulse();
  const double steps = static_cast<double>(fluid_steps_ - first_step_);
  add(host.taken_.to_lower_wall, impulse.lower, 1), add(host.taken_.to_upper_wall, impulse.upper, 1);
  add(host.taken_.from_body_force, host.fluid_.parameters().body_force,
      steps * static_cast<double>(host.fluid_.fluid_nodes()));
  if (bodies_ == 0) return;
  for (const auto& load : host.loads_) add(host.taken_.from_loads, load.force, steps);
  const auto spread = markers_->wall_impulse(), pressed = contact_->wall_impulse(),
             force = markers_->wall_force();
  add(host.taken_.to_lower_wall, spread[0], 1), add(host.taken_.to_upper_wall, spread[1], 1);
  add(host.taken_.to_lower_wall, pressed[0], h_), add(host.taken_.to_upper_wall, pressed[1], h_);
  host.contact_summary_ = contact_->summary();
  for (int w = 0; w < 2; ++w) {
    host.force_on_walls_[w] = force[w];
    add(host.force_on_walls_[w], host.contact_summary_.wall_force[w], 1);
  }
  Array<Node4<Real>> J(slots_);
  queue_.copy(J.data(), impulse_.data(), slots_);
  queue_.wait();
  const auto to = host_slots(host);
  for (std::size_t s = 0; s < slots_; ++s) host.impulse_[to[s]] = J[s];
  host.solid_report_ = {};
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (const auto* m = std::get_if<npfem::DeviceMembranes<Real>>(&groups_[g].cells)) {
      m->download(std::get<npfem::Membranes<Real>>(host.groups_[g].cells));
      host.solid_report_.increment = std::max(host.solid_report_.increment, m->report().increment);
    } else {
      std::get<rigid::DeviceBodies<Real>>(groups_[g].cells)
          .download(std::get<rigid::RigidBodies<Real>>(host.groups_[g].cells));
    }
  }
}

template <class Real>
std::size_t DeviceSimulation<Real>::memory_bytes() const {
  std::size_t bytes =
      fluid_.memory_bytes() + (velocity_.size() + force_.size() + 4 * slots_) * sizeof(Node4<Real>);
  if (markers_) bytes += markers_->memory_bytes() + contact_->memory_bytes();
  for (const auto& group : groups_)
    bytes += std::visit([](const auto& g) { return g.memory_bytes(); }, group.cells);
  return bytes;
}

template class DeviceSimulation<float>;
template class DeviceSimulation<double>;

}  // namespace hemowalk::resolved
