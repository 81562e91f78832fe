#include "resolved/rigid/device_bodies.hpp"

#include <cmath>
#include <cstring>

#include "core/check.hpp"
#include "resolved/rigid/shape.hpp"

namespace hemowalk::rigid {

template <class Real>
DeviceBodies<Real>::DeviceBodies(Queue& queue, const RigidBodies<Real>& host)
    : queue_(queue),
      gyration_(host.shape().gyration),
      arm_(make_array(queue.place(), host.shape().arm)),
      held_(make_array(queue.place(), host.shape().held)),
      shape_normal_(make_array(queue.place(), host.shape().normal)),
      metric_(make_array(queue.place(), host.type().metric)) {
  upload(host);
}

template <class Real>
void DeviceBodies<Real>::fit(int count, int vertices) {
  count_ = count;
  const int pitch = mesh::CellFields<Real>::padded(vertices);
  const std::size_t n = static_cast<std::size_t>(count);
  const Place place = queue_.place();
  anchor_ = Array<double>(3 * n, place);
  motion_ = Array<BodyMotion>(n, place);
  couple_ = Array<Vec3>(n, place);
  for (auto* field : {&offset_, &held_now_, &velocity_, &normal_, &predicted_})
    *field = Array<Real>(3 * n * static_cast<std::size_t>(pitch), place);
  fields_ = {vertices,         pitch,          anchor_.data(),    offset_.data(),
             velocity_.data(), normal_.data(), predicted_.data(), held_now_.data()};
}

template <class Real>
typename DeviceBodies<Real>::Step DeviceBodies<Real>::body(const StepOptions&) const {
  auto* self = const_cast<DeviceBodies*>(this);  // the kernel writes through these pointers
  return {fields_,
          gyration_,
          arm_.data(),
          held_.data(),
          shape_normal_.data(),
          metric_.data(),
          self->motion_.data(),
          self->couple_.data()};
}

template <class Real>
void DeviceBodies<Real>::step(const StepOptions& options) {
  queue_.blocks(static_cast<std::size_t>(count_), shared_bytes(), body(options));
}

// A body's state as RigidBodies::save writes it: number, anchor, orientation, velocity, spin, then velocities
// [vertex][3]; offsets and normals follow from the orientation, to the same bits here and in a step
// (rotation.hpp).
template <class Real>
void DeviceBodies<Real>::upload(const RigidBodies<Real>& host) {
  if (host.count() != count_ || !fields_.pitch) fit(host.count(), host.vertices());
  Array<double> anchor(anchor_.size());
  std::vector<BodyMotion> motion(static_cast<std::size_t>(count_));
  Array<Real> offset(offset_.size()), held(offset_.size()), velocity(offset_.size()), normal(offset_.size());
  std::vector<std::byte> state(host.state_bytes());
  const auto at = host.layout();
  for (int c = 0; c < count_; ++c) {
    host.save(c, state.data());
    const std::byte* in = state.data() + sizeof(std::int64_t);
    std::memcpy(anchor.data() + 3 * static_cast<std::size_t>(c), in, 3 * sizeof(double));
    std::memcpy(&motion[c], in + 3 * sizeof(double), sizeof(BodyMotion));
    for (int k = 0; k < vertices(); ++k)
      for (int d = 0; d < 3; ++d) {
        const std::size_t i = fields_.at(c, d, k), h = at.at(c, k, d);
        offset[i] = host.offsets()[h], held[i] = host.held()[h], velocity[i] = host.velocities()[h],
        normal[i] = host.normals()[h];
      }
  }
  queue_.copy(anchor_.data(), anchor.data(), anchor.size());
  queue_.copy(motion_.data(), motion.data(), motion.size());
  queue_.copy(offset_.data(), offset.data(), offset.size());
  queue_.copy(held_now_.data(), held.data(), held.size());
  queue_.copy(velocity_.data(), velocity.data(), velocity.size());
  queue_.copy(normal_.data(), normal.data(), normal.size());
  queue_.wait();
}

template <class Real>
void DeviceBodies<Real>::download(RigidBodies<Real>& host) const {
  Array<double> anchor(anchor_.size());
  std::vector<BodyMotion> motion(static_cast<std::size_t>(count_));
  Array<Real> velocity(velocity_.size());
  queue_.copy(anchor.data(), anchor_.data(), anchor.size());
  queue_.copy(motion.data(), motion_.data(), motion.size());
  queue_.copy(velocity.data(), velocity_.data(), velocity.size());
  queue_.wait();
  std::vector<std::byte> state(host.state_bytes());
  for (int c = 0; c < count_; ++c) {
    const std::int64_t id = host.id(c);
    std::byte* out = state.data();
    const auto write = [&out](const void* from, std::size_t bytes) {
      std::memcpy(out, from, bytes);
      out += bytes;
    };
    write(&id, sizeof id);
    write(anchor.data() + 3 * static_cast<std::size_t>(c), 3 * sizeof(double));
    write(&motion[c], sizeof(BodyMotion));
    for (int k = 0; k < vertices(); ++k)
      for (int d = 0; d < 3; ++d) write(&velocity[fields_.at(c, d, k)], sizeof(Real));
    host.restore(c, state.data());
  }
}

template <class Real>
StepReport DeviceBodies<Real>::report() const {
  std::vector<BodyMotion> motion(static_cast<std::size_t>(count_));
  queue_.copy(motion.data(), motion_.data(), motion.size());
  queue_.wait();
  StepReport report;
  for (int c = 0; c < count_ && report.bad_cell < 0; ++c)
    if (!std::isfinite(mesh::norm(motion[c].velocity) + mesh::norm(motion[c].spin))) report.bad_cell = c;
  return report;
}

template <class Real>
std::size_t DeviceBodies<Real>::memory_bytes() const {
  return 5 * offset_.size() * sizeof(Real) + motion_.size() * sizeof(BodyMotion);
}

static_assert(sizeof(BodyMotion) == 10 * sizeof(double), "as RigidBodies::save lays it out");

template class DeviceBodies<float>;
template class DeviceBodies<double>;

}  // namespace hemowalk::rigid
