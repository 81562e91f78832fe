#include "resolved/rigid/rigid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/rigid/motion.hpp"
#include "resolved/rigid/shape.hpp"

namespace hemowalk::rigid {

using mesh::cross;
using mesh::Matrix3;
using mesh::Quaternion;
using mesh::Vec3;

namespace {

Matrix3 inverse(const Matrix3& m) {
  const Vec3 a{m[0], m[1], m[2]}, b{m[3], m[4], m[5]}, c{m[6], m[7], m[8]};
  const double det = mesh::dot(a, cross(b, c));
  const auto x = cross(b, c), y = cross(c, a), z = cross(a, b);
  return {x[0] / det, y[0] / det, z[0] / det, x[1] / det, y[1] / det,
          z[1] / det, x[2] / det, y[2] / det, z[2] / det};
}

}  // namespace

Shape::Shape(const BodyType& type)
    : arm(type.rest.vertices),
      held(type.held.empty() ? type.rest.vertices : type.held),
      normal(mesh::vertex_normals(type.rest)),
      area(mesh::vertex_areas(type.rest)),
      bounding_radius(mesh::bounding_radius(type.rest)),
      volume(mesh::volume(type.rest)),
      marker(mesh::marker_vertex(type.rest)) {
  require(type.metric.size() == arm.size(),
          "metric needs one mass per vertex (" + std::to_string(arm.size()) + " vertices, " +
              std::to_string(type.metric.size()) + " masses) pass m_k + k a_k for every vertex");
  require(held.size() == arm.size(), "held needs one point per vertex (" + std::to_string(arm.size()) +
                                         " vertices, " + std::to_string(held.size()) +
                                         " points) leave it empty to hold the vertices");
  require(type.h > 0, "solid time step must be positive (a step moves by h v) give h > 0");
  for (std::size_t k = 0; k < arm.size(); ++k) {
    require(type.metric[k] > 0, "metric must be positive (m_k + k a_k) give the vertices mass or coupling");
    gyration.mass += type.metric[k];
    mesh::accumulate(centre, type.metric[k], held[k]);
  }
  centre = mesh::scale(1 / gyration.mass, centre);
  for (std::size_t k = 0; k < arm.size(); ++k) {
    arm[k] = mesh::subtract(arm[k], centre), held[k] = mesh::subtract(held[k], centre);
    const auto& r = held[k];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        gyration.inertia[3 * i + j] += type.metric[k] * ((i == j ? mesh::dot(r, r) : 0) - r[i] * r[j]);
  }
  gyration.inverse_inertia = inverse(gyration.inertia);
  gyration.h = type.h;
}

template <class Real>
struct RigidBodies<Real>::Impl {
  explicit Impl(BodyType t) : type(std::move(t)), shape(type), vertices(type.rest.vertex_count()) {}

  BodyType type;
  Shape shape;
  int vertices;
  int capacity = 0;  ///< batches
  std::vector<std::int64_t> ids;
  std::vector<BodyMotion> motion;
  std::vector<Vec3> couple;
  Array<double> anchor;
  Array<Real> offset, held, velocity, normal, predicted;

  mesh::Layout<Real> layout() const { return {vertices}; }

  template <class T>
  static void grow(Array<T>& array, std::size_t size) {
    Array<T> larger(size);
    if (array.size()) std::memcpy(larger.data(), array.data(), array.size() * sizeof(T));
    array = std::move(larger);
  }

  void reserve(int cells) {
    const int batches = (cells + lanes - 1) / lanes;
    if (batches <= capacity) return;
    const std::size_t fields = static_cast<std::size_t>(batches) * vertices * 3 * lanes;
    for (auto* field : {&offset, &held, &velocity, &normal, &predicted}) grow(*field, fields);
    grow(anchor, static_cast<std::size_t>(batches) * 3 * lanes);
    const std::size_t cells_now = static_cast<std::size_t>(batches) * lanes;
    ids.reserve(cells_now);
    motion.resize(cells_now, {mesh::identity_rotation, {}, {}});
    couple.resize(cells_now, Vec3{});
    for (int c = capacity * lanes; c < batches * lanes; ++c) place(c);
    capacity = batches;
  }

  /// Offsets and normals from the orientation.
  void place(int c) {
    const auto turn = mesh::matrix(motion[c].orientation);
    for (int k = 0; k < vertices; ++k) {
      const auto r = mesh::transform(turn, shape.arm[k]), n = mesh::transform(turn, shape.normal[k]),
                 s = mesh::transform(turn, shape.held[k]);
      for (int d = 0; d < 3; ++d) {
        offset[layout().at(c, k, d)] = static_cast<Real>(r[d]);
        held[layout().at(c, k, d)] = static_cast<Real>(s[d]);
        normal[layout().at(c, k, d)] = static_cast<Real>(n[d]);
      }
    }
  }

  Vec3 anchor_of(int c) const {
    return {anchor[layout().anchor(c, 0)], anchor[layout().anchor(c, 1)], anchor[layout().anchor(c, 2)]};
  }
  void set_anchor(int c, const Vec3& x) {
    for (int d = 0; d < 3; ++d) anchor[layout().anchor(c, d)] = x[d];
  }

  void step(int c, double velocity_cap) {
    const auto turn = mesh::matrix(motion[c].orientation);
    Vec3 linear{}, angular = mesh::scale(type.h, couple[c]);
    couple[c] = {};
    for (int k = 0; k < vertices; ++k) {
      const auto r = mesh::transform(turn, shape.held[k]);
      Vec3 p;
      for (int d = 0; d < 3; ++d)
        p[d] = type.metric[k] * static_cast<double>(predicted[layout().at(c, k, d)]);
      mesh::accumulate(linear, 1, p);
      mesh::accumulate(angular, 1, cross(r, p));
    }
    motion[c].velocity = mesh::scale(1 / shape.gyration.mass, linear);
    motion[c].spin = shape.gyration.spin_of(angular, turn);
    cap(c, turn, velocity_cap);
    move(c, turn);
  }

  /// Slows the whole motion down until no held point is faster than \p limit.
  void cap(int c, const Matrix3& turn, double limit) {
    if (!std::isfinite(limit)) return;
    double fastest = 0;
    for (int k = 0; k < vertices; ++k)
      fastest = std::max(fastest,
                         mesh::norm(mesh::add(motion[c].velocity,
                                              cross(motion[c].spin, mesh::transform(turn, shape.held[k])))));
    if (fastest <= limit) return;
    motion[c].velocity = mesh::scale(limit / fastest, motion[c].velocity);
    motion[c].spin = mesh::scale(limit / fastest, motion[c].spin);
  }

  void move(int c, const Matrix3& turn) {
    const Turn step(mesh::scale(type.h, motion[c].spin));
    for (int k = 0; k < vertices; ++k) {
      const auto chord = step.chord(mesh::transform(turn, shape.held[k]));
      for (int d = 0; d < 3; ++d)
        velocity[layout().at(c, k, d)] = static_cast<Real>(motion[c].velocity[d] + chord[d] / type.h);
    }
    set_anchor(c, mesh::add(anchor_of(c), mesh::scale(type.h, motion[c].velocity)));
    motion[c].orientation = turned(step, motion[c].orientation);
    place(c);
  }
};

template <class Real>
RigidBodies<Real>::RigidBodies(BodyType type) : impl_(std::make_unique<Impl>(std::move(type))) {}
template <class Real>
RigidBodies<Real>::~RigidBodies() = default;
template <class Real>
RigidBodies<Real>::RigidBodies(RigidBodies&&) noexcept = default;
template <class Real>
RigidBodies<Real>& RigidBodies<Real>::operator=(RigidBodies&&) noexcept = default;

template <class Real>
int RigidBodies<Real>::count() const {
  return static_cast<int>(impl_->ids.size());
}
template <class Real>
int RigidBodies<Real>::vertices() const {
  return impl_->vertices;
}
template <class Real>
const mesh::TriangleMesh& RigidBodies<Real>::rest() const {
  return impl_->type.rest;
}
template <class Real>
const std::vector<double>& RigidBodies<Real>::vertex_areas() const {
  return impl_->shape.area;
}
template <class Real>
double RigidBodies<Real>::bounding_radius() const {
  return impl_->shape.bounding_radius;
}
template <class Real>
double RigidBodies<Real>::rest_volume() const {
  return impl_->shape.volume;
}
template <class Real>
double RigidBodies<Real>::h() const {
  return impl_->type.h;
}
template <class Real>
void RigidBodies<Real>::reserve(int cells) {
  impl_->reserve(cells);
}

template <class Real>
int RigidBodies<Real>::add(std::int64_t id, const Vec3& centre, const Quaternion& q) {
  const int c = count();
  if (c >= impl_->capacity * lanes) impl_->reserve(std::max(c + 1, 2 * c));
  impl_->ids.push_back(id);
  impl_->motion[c].orientation = mesh::normalized(q);
  impl_->set_anchor(c, mesh::add(centre, mesh::rotate(impl_->motion[c].orientation, impl_->shape.centre)));
  impl_->place(c);
  set_motion(c, {0, 0, 0}, {0, 0, 0});
  return c;
}

template <class Real>
void RigidBodies<Real>::remove(int c) {
  const int last = count() - 1;
  if (c != last) {
    const auto put = [&](auto& list) { list[c] = list[last]; };
    put(impl_->ids), put(impl_->motion);
    impl_->set_anchor(c, impl_->anchor_of(last));
    for (auto* field : {&impl_->offset, &impl_->held, &impl_->velocity, &impl_->normal, &impl_->predicted})
      for (int k = 0; k < vertices(); ++k)
        for (int d = 0; d < 3; ++d) (*field)[layout().at(c, k, d)] = (*field)[layout().at(last, k, d)];
  }
  impl_->ids.pop_back();
}

template <class Real>
std::int64_t RigidBodies<Real>::id(int c) const {
  return impl_->ids[c];
}
template <class Real>
View<const double> RigidBodies<Real>::anchors() const {
  return std::as_const(impl_->anchor).view();
}
template <class Real>
View<const Real> RigidBodies<Real>::offsets() const {
  return std::as_const(impl_->offset).view();
}
template <class Real>
View<const Real> RigidBodies<Real>::held() const {
  return std::as_const(impl_->held).view();
}
template <class Real>
void RigidBodies<Real>::add_couple(int c, const Vec3& torque) {
  mesh::accumulate(impl_->couple[c], 1, torque);
}
template <class Real>
View<const Real> RigidBodies<Real>::velocities() const {
  return std::as_const(impl_->velocity).view();
}
template <class Real>
View<const Real> RigidBodies<Real>::normals() const {
  return std::as_const(impl_->normal).view();
}
template <class Real>
View<Real> RigidBodies<Real>::predicted() {
  return impl_->predicted.view();
}

template <class Real>
StepReport RigidBodies<Real>::step(const StepOptions& options) {
  const int n = count();
#pragma omp parallel for schedule(static)
  for (int c = 0; c < n; ++c) impl_->step(c, options.velocity_cap);
  StepReport report;
  for (int c = 0; c < n && report.bad_cell < 0; ++c) {
    const auto x = impl_->anchor_of(c);
    if (!std::isfinite(x[0] + x[1] + x[2] + mesh::norm(impl_->motion[c].spin))) report.bad_cell = c;
  }
  return report;
}

template <class Real>
Vec3 RigidBodies<Real>::anchor(int c) const {
  return impl_->anchor_of(c);
}
template <class Real>
Vec3 RigidBodies<Real>::position(int c, int k) const {
  return mesh::add(anchor(c), mesh::rotate(impl_->motion[c].orientation, impl_->shape.arm[k]));
}
template <class Real>
std::vector<Vec3> RigidBodies<Real>::positions(int c) const {
  std::vector<Vec3> x(vertices());
  for (int k = 0; k < vertices(); ++k) x[k] = position(c, k);
  return x;
}
template <class Real>
void RigidBodies<Real>::translate(int c, const Vec3& shift) {
  impl_->set_anchor(c, mesh::add(anchor(c), shift));
}
template <class Real>
mesh::Observables RigidBodies<Real>::observe(int c) const {
  return mesh::observe(rest(), positions(c), impl_->shape.marker);
}

template <class Real>
std::size_t RigidBodies<Real>::state_bytes() const {
  return sizeof(std::int64_t) + 13 * sizeof(double) + static_cast<std::size_t>(3) * vertices() * sizeof(Real);
}

template <class Real>
void RigidBodies<Real>::save(int c, std::byte* out) const {
  const auto write = [&out](const auto& value) {
    std::memcpy(out, &value, sizeof value);
    out += sizeof value;
  };
  write(id(c));
  write(anchor(c));
  write(impl_->motion[c]);
  for (int k = 0; k < vertices(); ++k)
    for (int d = 0; d < 3; ++d) write(impl_->velocity[layout().at(c, k, d)]);
}

template <class Real>
int RigidBodies<Real>::load(const std::byte* in) {
  const int c = add(0, {0, 0, 0}, mesh::identity_rotation);
  restore(c, in);
  return c;
}

template <class Real>
mesh::HostFields<Real> RigidBodies<Real>::host_fields() {
  return {impl_->vertices,
          batches(),
          impl_->anchor.data(),
          impl_->offset.data(),
          impl_->velocity.data(),
          impl_->normal.data(),
          impl_->predicted.data(),
          impl_->held.data(),
          impl_->couple.empty() ? nullptr : impl_->couple.front().data(),
          impl_->motion.data()};
}

template <class Real>
void RigidBodies<Real>::restore(int c, const std::byte* in) {
  const auto read = [&in](auto& value) {
    std::memcpy(&value, in, sizeof value);
    in += sizeof value;
  };
  Vec3 anchor;
  read(impl_->ids[c]);
  read(anchor);
  impl_->set_anchor(c, anchor);
  read(impl_->motion[c]);
  for (int k = 0; k < vertices(); ++k)
    for (int d = 0; d < 3; ++d) read(impl_->velocity[layout().at(c, k, d)]);
  impl_->place(c);
}

template <class Real>
const Shape& RigidBodies<Real>::shape() const {
  return impl_->shape;
}
template <class Real>
const BodyType& RigidBodies<Real>::type() const {
  return impl_->type;
}

template <class Real>
Quaternion RigidBodies<Real>::orientation(int c) const {
  return impl_->motion[c].orientation;
}
template <class Real>
Vec3 RigidBodies<Real>::velocity(int c) const {
  return impl_->motion[c].velocity;
}
template <class Real>
Vec3 RigidBodies<Real>::angular_velocity(int c) const {
  return impl_->motion[c].spin;
}

template <class Real>
void RigidBodies<Real>::set_motion(int c, const Vec3& velocity, const Vec3& angular_velocity) {
  impl_->motion[c].velocity = velocity;
  impl_->motion[c].spin = angular_velocity;
  const auto turn = mesh::matrix(impl_->motion[c].orientation);
  for (int k = 0; k < vertices(); ++k) {
    const auto v = mesh::add(velocity, cross(angular_velocity, mesh::transform(turn, impl_->shape.held[k])));
    for (int d = 0; d < 3; ++d) {
      impl_->velocity[layout().at(c, k, d)] = static_cast<Real>(v[d]);
      impl_->predicted[layout().at(c, k, d)] = 0;
    }
  }
}

template class RigidBodies<float>;
template class RigidBodies<double>;

}  // namespace hemowalk::rigid
