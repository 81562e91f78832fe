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
DeviceSimulation<Real>::DeviceSimulation(Queue& queue, Simulation<Real>& host)
    : queue_(queue),
      host_(host),
      scene_(host.scene()),
      block_(host.block()),
      h_(scene_.coupling.solid_every),
      share_(static_cast<Real>(0.5 * scene_.coupling.theta_n)),
      any_cells_(host.any_cells_),
      fluid_(queue, host.fluid()),
      velocity_(host.velocity_.size(), queue.place()),
      force_(place_copy(queue.place(), host.force_)),
      fluid_steps_(host.fluid_steps()),
      first_step_(host.fluid_steps()),
      loads_since_(host.fluid_steps()),
      taken_before_(host.taken_) {
  require(host.one_theta_,
          "coupling.theta has two values (the device reads velocity and correction as one field) give both "
          "the same "
          "value, or use place: host");
  graphs_.resize(2 * (first_fluid_segment + 2 * static_cast<std::size_t>(scene_.coupling.solid_every)));
  if (any_cells_) build_groups(host);
  if (host.decomposition().divided()) {
    if (!border_)
      border_ = std::make_unique<DeviceBorder<Real>>(queue_, host.decomposition(), -1, std::vector<int>{},
                                                     fluid_.border_size());
    if (fluid_.odd()) {
      fluid_.send_borders(border_->outgoing());
      border_->exchange_populations();
      fluid_.receive_borders(border_->incoming());
    }
  }
  // Not the host's velocity: a step leaves what this kernel makes of the populations, to the last bit.
  fluid_.moments(force(), velocity_.data(), share_);
  queue_.wait();
}

namespace {

/// Shared memory of a CoupledStep's block.
template <class Real, class Cells>
std::size_t coupled_bytes(const Cells& cells) {
  return std::max(cells.shared_bytes(), CellCoupling<Real>::shared_bytes(cells.vertices()));
}

}  // namespace

/// What does not change when cells come and go.
template <class Real>
void DeviceSimulation<Real>::build_groups(const Simulation<Real>& host) {
  const Place place = queue_.place();
  std::vector<contact::Shape> shapes;
  std::vector<int> vertices;
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
    if (!group.surface.mirror.empty()) {
      const auto& kind = scene_.cells.kinds[static_cast<std::size_t>(group.kind)];
      const auto rest = make_mesh(kind, host.units().dx);
      const auto at_rest = coupling_points(kind, rest, scene_.coupling);
      for (std::size_t k = 0; k < at_rest.size(); ++k)  // half as much again for what deforms
        depth_ = std::max(depth_, 1.5 * mesh::norm(mesh::subtract(rest.vertices[k], at_rest[k])));
    }
    const mesh::TriangleMesh& rest =
        std::visit([](const auto& g) -> const mesh::TriangleMesh& { return g.rest(); }, group.cells);
    contact::Shape shape;
    std::vector<Corners> triangle;
    std::vector<std::vector<int>> rings(rest.vertices.size());
    for (const auto& t : rest.triangles) {
      for (int c = 0; c < 3; ++c) {
        rings[static_cast<std::size_t>(t[c])].push_back(4 * static_cast<int>(triangle.size()) + c);
        shape.triangles.push_back(static_cast<std::uint32_t>(t[c]));
      }
      triangle.push_back({{t[0], t[1], t[2]}});
    }
    shape.area = std::visit([](const auto& g) { return g.vertex_areas(); }, group.cells);
    shapes.push_back(std::move(shape));
    vertices.push_back(static_cast<int>(rest.vertices.size()));
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
    groups_.push_back({make(),
                       make_array(place, ring_begin),
                       make_array(place, ring),
                       make_array(place, group.surface.mirror),
                       make_array(place, triangle),
                       make_array(place, mass),
                       make_array(place, weight),
                       make_array(place, inverse_metric),
                       group.surface,
                       CellCoupling<Real>{},
                       {}});
    std::visit([&](const auto& cells) { queue_.require_shared_memory(coupled_bytes<Real>(cells)); },
               groups_.back().cells);
  }
  const contact::Law law = make_contact(scene_, host.units());
  contact::Domain domain = make_domain(scene_, block_);
  if (host.decomposition().divided()) {
    domain.period[2] = 0;  // periodic images come as copies
    border_ = std::make_unique<DeviceBorder<Real>>(
        queue_, host.decomposition(), law.stiffness > 0 ? law.range : -1, vertices, fluid_.border_size());
  }
  markers_ = std::make_unique<ibm::DeviceMarkers<Real>>(
      queue_, block_, host.faces_, make_kernel(scene_.coupling.kernel), std::vector<std::int32_t>{});
  contact_ = std::make_unique<contact::DeviceContact<Real>>(queue_, law, domain, shapes,
                                                            std::vector<std::uint16_t>{});
  take_cells(host);
}

/// The cells of this rank from now on: their state, and the points where they touch the fluid.
template <class Real>
void DeviceSimulation<Real>::take_cells(const Simulation<Real>& host) {
  bodies_ = static_cast<std::size_t>(host.bodies()), slots_ = 0;
  std::vector<std::uint16_t> shapes;
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    Group& here = groups_[i];
    here.coupling.first_slot = static_cast<std::uint32_t>(slots_);
    here.coupling.first_body = static_cast<std::uint32_t>(shapes.size());
    if (auto* m = std::get_if<npfem::DeviceMembranes<Real>>(&here.cells))
      m->upload(std::get<npfem::Membranes<Real>>(host.groups()[i].cells));
    else
      std::get<rigid::DeviceBodies<Real>>(here.cells)
          .upload(std::get<rigid::RigidBodies<Real>>(host.groups()[i].cells));
    std::visit(
        [&](const auto& g) {
          here.id.clear();
          for (int c = 0; c < g.count(); ++c) here.id.push_back(g.id(c));
          shapes.insert(shapes.end(), here.id.size(), static_cast<std::uint16_t>(i));
          slots_ += here.id.size() * static_cast<std::size_t>(g.vertices());
        },
        host.groups()[i].cells);
  }
  if (border_) border_->set_bodies(shapes);
  assign_bodies(host);
  upload_impulses(host);
  for (auto& group : groups_) queue_.blocks(group.id.size(), 0, PlaceCells<Real>{group.coupling});
  queue_.wait();
}

/// Room for own bodies and the copies that are here now, and who they are.
template <class Real>
void DeviceSimulation<Real>::assign_bodies(const Simulation<Real>& host) {
  std::vector<std::uint16_t> shape_of;
  std::vector<std::int32_t> body_of;
  for (std::size_t i = 0; i < groups_.size(); ++i)
    shape_of.insert(shape_of.end(), groups_[i].id.size(), static_cast<std::uint16_t>(i));
  for (std::size_t b = bodies_; border_ && b < border_->copies().bodies().size(); ++b)
    shape_of.push_back(border_->copies().bodies()[b].shape);
  for (std::size_t b = 0; b < shape_of.size(); ++b) {
    const int vertices = std::visit([](const auto& g) { return g.vertices(); }, groups_[shape_of[b]].cells);
    body_of.insert(body_of.end(), static_cast<std::size_t>(vertices), static_cast<std::int32_t>(b));
  }
  queue_.fit(origin_, shape_of.size());
  for (auto* field : {&reading_, &impulse_, &vertex_, &site_}) queue_.fit(*field, body_of.size());
  std::vector<std::array<double, 3>> load;
  if (!host.loads_.empty()) {
    load.assign(body_of.size(), {0, 0, 0});
    const auto from = host_slots(host);
    for (const auto& l : host.loads_) {
      const auto at = std::find(from.begin(), from.end(), l.slot) - from.begin();
      for (int d = 0; d < 3 && l.slot >= 0; ++d) load[static_cast<std::size_t>(at)][d] += l.force[d];
    }
  }
  markers_->assign(body_of);
  contact_->assign(shape_of, bodies_, load);
  connect();
  // Of the fluid nothing has moved.
  for (std::size_t g = 0; g < 2 * first_fluid_segment; ++g) graphs_[g] = {};
}

/// Where everything lies now.
template <class Real>
void DeviceSimulation<Real>::connect() {
  const auto gravity = host_.half_body_force();
  const Decomposition& d = host_.decomposition();
  for (Group& here : groups_) {
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
        here.coupling.first_slot,
        here.coupling.first_body,
        {d.whole().nx, host_.faces_.periodic_y ? d.whole().ny : 0, d.whole().nz},
        {0, 0, static_cast<double>(d.first_plane())},
        {0, 0, d.lowest_seen()},
        reading_.data(),
        impulse_.data(),
        contact_->forces(),
        vertex_.data(),
        site_.data(),
        reinterpret_cast<std::int32_t*>(origin_.data()),
        nullptr,
        here.mirror.size() ? here.mirror.data() : nullptr,
        static_cast<Real>(here.surface.axial / 2),
        static_cast<Real>(here.surface.radial / 2)};
    if (auto* bodies = std::get_if<rigid::DeviceBodies<Real>>(&here.cells))
      here.coupling.couple = bodies->couples();
  }
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
void DeviceSimulation<Real>::press() {
  const ibm::Bins& bins = markers_->bins();
  contact_->compute(origin_.data(), vertex_.data(),
                    {block_, bins.walls_y, bins.beyond, ibm::bin_edge, bins.x, bins.y, bins.z,
                     markers_->begin(), markers_->listed(), depth_ + 1e-3});
}

template <class Real>
void DeviceSimulation<Real>::move_cells() {
  mesh::StepOptions options;
  options.iterations = scene_.coupling.iterations;
  for (auto& group : groups_)
    std::visit(
        [&](const auto& cells) {
          using Solid = typename std::decay_t<decltype(cells)>::Step;
          queue_.blocks(static_cast<std::size_t>(cells.count()), coupled_bytes<Real>(cells),
                        CoupledStep<Real, Solid>{group.coupling, cells.body(options)});
        },
        group.cells);
}

template <class Real>
template <class After>
void DeviceSimulation<Real>::enqueue(const After& after) {
  if (any_cells_) {
    markers_->locate(origin_.data(), site_.data());
    after(&PartTimes::locate);
    markers_->interpolate(velocity_.data(), reading_.data());
    after(&PartTimes::interpolation);
    press();
    after(&PartTimes::contact);
    move_cells();
    after(&PartTimes::solid);
    markers_->spread(impulse_.data(), force_.data(), h_);
    after(&PartTimes::spreading);
  }
  for (int k = 0; k < scene_.coupling.solid_every; ++k)
    fluid_.advance(force(), velocity_.data(), share_in(k));
  after(&PartTimes::fluid);
}

/// \p work as one graph. Even and odd steps of the fluid, of which it holds \p fluid_steps, are different
/// kernels: two graphs, unless a coupling step has an even number.
template <class Real>
template <class Work>
void DeviceSimulation<Real>::run(std::size_t segment, int fluid_steps, const Work& work) {
  Graph& graph = graphs_[2 * segment + fluid_.odd()];
  if (graph.empty()) {
    graph = queue_.record(work);
  } else {
    fluid_.replayed(fluid_steps);
  }
  queue_.replay(graph);
}

/// Contact is at work while readings travel; everything else waits for its messages.
template <class Real>
void DeviceSimulation<Real>::step_divided() {
  if (any_cells_) {
    hand_over();
    const BodyFields<Real> here = body_fields();
    run(0, 0, [&] { border_->enqueue_positions(here); });
    const bool anew = border_->exchange_positions(here);
    host_.check_lengths(border_->extents());
    if (anew) assign_bodies(host_);
    const BodyFields<Real> all = body_fields();
    run(1, 0, [&] {
      border_->enqueue_copies(all);
      markers_->locate(origin_.data(), site_.data());
      markers_->interpolate(velocity_.data(), reading_.data());
      border_->enqueue_readings_down(all);
    });
    border_->send_readings();
    run(2, 0, [&] { press(); });
    border_->receive_readings();
    run(3, 0, [&] {
      border_->enqueue_readings_up(all);
      move_cells();
      border_->enqueue_impulses_down(all);
    });
    border_->exchange_impulses();
    run(4, 0, [&] {
      border_->enqueue_impulses_up(all);
      markers_->spread(impulse_.data(), force_.data(), h_);
    });
  }
  for (int k = 0; k < scene_.coupling.solid_every; ++k) {
    const std::size_t segment = first_fluid_segment + 2 * static_cast<std::size_t>(k);
    run(segment, 1, [&] {
      fluid_.begin_advance(force(), velocity_.data(), share_in(k));
      fluid_.send_borders(border_->outgoing());
    });
    border_->exchange_populations();
    run(segment + 1, 0, [&] {
      fluid_.receive_borders(border_->incoming());
      fluid_.end_advance(force(), velocity_.data(), share_in(k));
    });
  }
}

/// Cells that pass to or from a neighbour do so on the host, and with them the state of all cells of this
/// rank.
template <class Real>
void DeviceSimulation<Real>::hand_over() {
  if (!border_->copies().passing()) return;
  check();
  download_cells(host_);
  book_loads(taken_before_);
  loads_since_ = fluid_steps_;
  host_.hand_over(border_->copies());
  host_.markers_->assign(host_.copies_->body_of());
  take_cells(host_);
}

template <class Real>
void DeviceSimulation<Real>::step() {
  border_ ? step_divided() : run(0, scene_.coupling.solid_every, [&] { enqueue([](auto) {}); });
  fluid_steps_ += scene_.coupling.solid_every;
  if (++steps_ % check_interval == 0) check();
}

template <class Real>
PartTimes DeviceSimulation<Real>::time_parts(int steps) {
  require(!border_, "parts are timed on one rank (messages wait for others) measure whole steps");
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
  if (!any_cells_) return queue_.wait();
  const std::string blow_up = " (blow-up) lower the acceleration or raise coupling.iterations";
  const int marker = markers_->fault();
  for (const auto& group : groups_) {
    const auto report = std::visit([](const auto& g) { return g.report(); }, group.cells);
    if (report.bad_cell >= 0)
      throw PhysicsError("cell " + std::to_string(group.id[static_cast<std::size_t>(report.bad_cell)]) +
                         " is no longer finite at or before step " + std::to_string(fluid_steps_) + blow_up);
  }
  if (marker >= 0)
    throw PhysicsError("marker " + std::to_string(marker) +
                       " is not finite or outside the walls at or before step " +
                       std::to_string(fluid_steps_) + blow_up);
  (void)contact_->summary();
}

namespace {

void add(std::array<double, 3>& to, const std::array<double, 3>& more, double times = 1) {
  for (int d = 0; d < 3; ++d) to[d] += times * more[d];
}

}  // namespace

/// Momentum from the point loads on this rank's cells since loads_since_.
template <class Real>
void DeviceSimulation<Real>::book_loads(Momentum& taken) const {
  for (const auto& load : host_.loads_)
    if (load.slot >= 0) add(taken.from_loads, load.force, static_cast<double>(fluid_steps_ - loads_since_));
}

template <class Real>
void DeviceSimulation<Real>::download(Simulation<Real>& host) const {
  require(!border_ || &host == &host_, "a divided simulation goes back to the host that it came from");
  check();
  fluid_.download(host.fluid_);
  queue_.copy(host.velocity_.data(), velocity_.data(), velocity_.size());
  queue_.copy(host.force_.data(), force_.data(), force_.size());
  queue_.wait();
  if (border_) {
    if (host.fluid_.border_missing()) host.fields_.stream(host.fluid_);
    host.fill_halo(host.velocity_.view());
  }
  host.fluid_steps_ = fluid_steps_;
  host.taken_ = taken_before_;
  const auto impulse = fluid_.wall_impulse();
  add(host.taken_.to_lower_wall, impulse.lower), add(host.taken_.to_upper_wall, impulse.upper);
  add(host.taken_.from_body_force, host.fluid_.parameters().body_force,
      static_cast<double>(fluid_steps_ - first_step_) * static_cast<double>(host.fluid_.fluid_nodes()));
  if (!any_cells_) return;
  book_loads(host.taken_);
  const auto spread = markers_->wall_impulse(), pressed = contact_->wall_impulse(),
             force = markers_->wall_force();
  add(host.taken_.to_lower_wall, spread[0]), add(host.taken_.to_upper_wall, spread[1]);
  add(host.taken_.to_lower_wall, pressed[0], h_), add(host.taken_.to_upper_wall, pressed[1], h_);
  host.contact_summary_ = contact_->summary();
  for (int w = 0; w < 2; ++w) {
    host.force_on_walls_[w] = force[w];
    add(host.force_on_walls_[w], host.contact_summary_.wall_force[w]);
  }
  download_cells(host);
}

template <class Real>
void DeviceSimulation<Real>::download_cells(Simulation<Real>& host) const {
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
