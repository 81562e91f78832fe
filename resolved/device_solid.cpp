#include "resolved/device_solid.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace hemowalk::resolved {

namespace {

/// From [batch][vertex][3][lane] to [cell][3][vertex], one thread per number of the former.
template <class Real>
struct FromLanes {
  int vertices, count;  ///< count: cells
  const Real* lanes;
  Real* field;
  mesh::CellFields<Real> cells;
  HEMO_HD void operator()(std::size_t i) const {
    constexpr std::size_t width = mesh::lanes_of<Real>;
    const std::size_t lane = i % width, d = i / width % 3, row = i / width / 3;
    const std::size_t cell = row / static_cast<std::size_t>(vertices) * width + lane;
    if (cell >= static_cast<std::size_t>(count)) return;
    field[cells.at(cell, static_cast<int>(d), static_cast<int>(row % static_cast<std::size_t>(vertices)))] =
        lanes[i];
  }
};

/// The other way, three fields and the anchors.
template <class Real>
struct ToLanes {
  int vertices, count;
  mesh::CellFields<Real> cells;
  double* anchor;
  Real *offset, *velocity, *normal, *held;
  HEMO_HD void operator()(std::size_t i) const {
    constexpr std::size_t width = mesh::lanes_of<Real>;
    const std::size_t lane = i % width, d = i / width % 3, row = i / width / 3;
    const std::size_t batch = row / static_cast<std::size_t>(vertices), cell = batch * width + lane;
    if (cell >= static_cast<std::size_t>(count)) return;
    const std::size_t k = row % static_cast<std::size_t>(vertices),
                      from = cells.at(cell, static_cast<int>(d), static_cast<int>(k));
    offset[i] = cells.offset[from], velocity[i] = cells.velocity[from], normal[i] = cells.normal[from];
    if (cells.held) held[i] = cells.held[from];
    if (k == 0) anchor[(batch * 3 + d) * width + lane] = cells.anchor[3 * cell + d];
  }
};

}  // namespace

/// Some batches of a group.
template <class Real>
struct DeviceSolid<Real>::Part {
  Part(Place place, int first_batch, int batches, std::size_t batch_size)
      : queue(place),
        first(first_batch),
        count(batches),
        predicted(batches * batch_size, place),
        offset(batches * batch_size, place),
        velocity(batches * batch_size, place),
        normal(batches * batch_size, place),
        held(batches * batch_size, place),
        anchor(static_cast<std::size_t>(batches) * 3 * mesh::lanes_of<Real>, place) {}
  Queue queue;
  int first, count;  ///< batches
  Array<Real> predicted, offset, velocity, normal, held;
  Array<double> anchor;
};

/// A group.
template <class Real>
struct DeviceSolid<Real>::Share {
  Share(Place place, Group<Real>& g) : group(g), queue(place), cells(make(g)) {}
  std::variant<npfem::DeviceMembranes<Real>, rigid::DeviceBodies<Real>> make(Group<Real>& g) {
    if (auto* m = std::get_if<npfem::Membranes<Real>>(&g.cells))
      return npfem::DeviceMembranes<Real>(queue, *m);
    return rigid::DeviceBodies<Real>(queue, std::get<rigid::RigidBodies<Real>>(g.cells));
  }
  mesh::HostFields<Real> host() {
    return std::visit([](auto& g) { return g.host_fields(); }, group.cells);
  }
  void cut(int number);
  void enqueue(Part& part, const mesh::StepOptions& options);

  Group<Real>& group;
  Queue queue;
  std::variant<npfem::DeviceMembranes<Real>, rigid::DeviceBodies<Real>> cells;
  std::vector<std::unique_ptr<Part>> parts;
  std::vector<Pinned> pinned;
};

template <class Real>
DeviceSolid<Real>::DeviceSolid(Place place, std::vector<Group<Real>>& groups, int parts) : parts_(parts) {
  for (auto& group : groups) shares_.emplace_back(std::make_unique<Share>(place, group))->cut(parts_);
}

/// Parts of equal size, each with a copy of what its batches hold.
template <class Real>
void DeviceSolid<Real>::Share::cut(int number) {
  const auto host = this->host();
  const Place place = queue.place();
  const std::size_t n = host.batches * host.batch_size();
  parts.clear(), pinned.clear();
  const std::array<const Real*, 5> fields{host.predicted, host.offset, host.velocity, host.normal, host.held};
  for (const Real* field : fields)
    if (field) pinned.emplace_back(place, field, n * sizeof(Real));
  pinned.emplace_back(place, host.anchor, 3 * mesh::lanes_of<Real> * host.batches * sizeof(double));
  if (host.motion) pinned.emplace_back(place, host.motion, group.count() * sizeof(rigid::BodyMotion));
  for (int p = 0; p < number; ++p) {
    const int first = host.batches * p / number, last = host.batches * (p + 1) / number;
    if (last > first) parts.push_back(std::make_unique<Part>(place, first, last - first, host.batch_size()));
  }
  // Idle lanes keep what they hold: it comes back with every step.
  for (auto& part : parts) {
    const std::size_t start = part->first * host.batch_size(), size = part->offset.size();
    part->queue.copy(part->offset.data(), host.offset + start, size);
    part->queue.copy(part->velocity.data(), host.velocity + start, size);
    part->queue.copy(part->normal.data(), host.normal + start, size);
    if (host.held) part->queue.copy(part->held.data(), host.held + start, size);
    part->queue.copy(part->anchor.data(), host.anchor + part->first * 3 * mesh::lanes_of<Real>,
                     part->anchor.size());
    part->queue.wait();
  }
}

template <class Real>
DeviceSolid<Real>::~DeviceSolid() = default;

template <class Real>
void DeviceSolid<Real>::Share::enqueue(Part& part, const mesh::StepOptions& options) {
  const auto host = this->host();
  const std::size_t start = part.first * host.batch_size(), n = part.count * host.batch_size();
  const std::size_t anchors = 3 * static_cast<std::size_t>(mesh::lanes_of<Real>);
  const std::size_t first_cell = static_cast<std::size_t>(part.first) * mesh::lanes_of<Real>;
  const int count = std::min(part.count * mesh::lanes_of<Real>, group.count() - static_cast<int>(first_cell));
  part.queue.copy(part.predicted.data(), host.predicted + start, n);
  std::visit(
      [&](auto& cells) {
        if constexpr (requires { cells.couples(); }) {  // copied at once: the host's are forgotten below
          const auto first = 3 * first_cell, size = 3 * static_cast<std::size_t>(count);
          part.queue.copy(cells.couples()->data() + first, host.couple + first, size);
          part.queue.wait();
          std::fill(host.couple + first, host.couple + first + size, 0.0);
        }
        const auto fields = cells.fields().from(first_cell);
        part.queue.for_each(
            n, FromLanes<Real>{host.vertices, count, part.predicted.data(), fields.predicted, fields});
        part.queue.blocks(static_cast<std::size_t>(count), cells.shared_bytes(),
                          cells.body(options).from(first_cell));
        part.queue.for_each(
            n, ToLanes<Real>{host.vertices, count, fields, part.anchor.data(), part.offset.data(),
                             part.velocity.data(), part.normal.data(), part.held.data()});
        if constexpr (requires { cells.motion(); })
          part.queue.copy(host.motion + first_cell, cells.motion() + first_cell,
                          static_cast<std::size_t>(count));
      },
      cells);
  part.queue.copy(host.offset + start, part.offset.data(), n);
  part.queue.copy(host.velocity + start, part.velocity.data(), n);
  part.queue.copy(host.normal + start, part.normal.data(), n);
  if (host.held) part.queue.copy(host.held + start, part.held.data(), n);
  part.queue.copy(host.anchor + part.first * anchors, part.anchor.data(), part.count * anchors);
}

template <class Real>
std::vector<mesh::StepReport> DeviceSolid<Real>::step(const mesh::StepOptions& options) {
  for (auto& share : shares_)
    for (auto& part : share->parts) share->enqueue(*part, options);
  std::vector<mesh::StepReport> reports;
  for (auto& share : shares_) {
    for (auto& part : share->parts) part->queue.wait();
    reports.push_back(std::visit([](const auto& cells) { return cells.report(); }, share->cells));
  }
  return reports;
}

template <class Real>
template <class Exchange>
void DeviceSolid<Real>::for_groups(const Exchange& exchange) {
  for (auto& share : shares_)
    if (auto* m = std::get_if<npfem::DeviceMembranes<Real>>(&share->cells))
      exchange(*m, std::get<npfem::Membranes<Real>>(share->group.cells));
    else
      exchange(std::get<rigid::DeviceBodies<Real>>(share->cells),
               std::get<rigid::RigidBodies<Real>>(share->group.cells));
}

template <class Real>
void DeviceSolid<Real>::download() {
  for_groups([](const auto& device, auto& host) { device.download(host); });
}

template <class Real>
void DeviceSolid<Real>::give_back() {
  download();
  for (auto& share : shares_) share->pinned.clear();
}

template <class Real>
void DeviceSolid<Real>::take_over() {
  for_groups([](auto& device, const auto& host) { device.upload(host); });
  for (auto& share : shares_) share->cut(parts_);
}

template class DeviceSolid<float>;
template class DeviceSolid<double>;

}  // namespace hemowalk::resolved
