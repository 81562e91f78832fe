#include "resolved/npfem/membranes.hpp"

#include <omp.h>

#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/npfem/batch.hpp"
#include "resolved/npfem/reference.hpp"

namespace hemowalk::npfem {

using mesh::Vec3;

template <class Real>
struct Membranes<Real>::Impl {
  explicit Impl(std::shared_ptr<const CellType> t)
      : type(std::move(t)), tables(*type), vertices(tables.vertices) {
    add_scratch();
  }

  std::shared_ptr<const CellType> type;
  Tables<Real> tables;
  int vertices;
  int capacity = 0;  ///< batches
  std::vector<std::int64_t> ids;
  Array<double> anchor;
  Array<Real> offset, residual, velocity, normal, predicted;
  std::vector<Scratch<Real>> scratch;  ///< one per thread
  std::vector<typename BatchKernel<Real>::Report> reports;

  /// The fields that make up a cell's state besides id and anchor.
  std::array<Array<Real>*, 4> state() { return {&offset, &residual, &velocity, &normal}; }
  std::size_t batch_size() const { return Scratch<Real>::size(vertices) * 3; }
  mesh::Layout<Real> layout() const { return {vertices}; }

  void add_scratch() {
    while (static_cast<int>(scratch.size()) < omp_get_max_threads()) scratch.emplace_back(vertices);
  }

  template <class T>
  static void grow(Array<T>& array, std::size_t size) {
    Array<T> larger(size);
    if (array.size()) std::memcpy(larger.data(), array.data(), array.size() * sizeof(T));
    array = std::move(larger);
  }

  void reserve(int cells) {
    const int batches = (cells + lanes - 1) / lanes;
    if (batches <= capacity) return;
    grow(anchor, static_cast<std::size_t>(batches) * 3 * lanes);
    for (auto* field : state()) grow(*field, batches * batch_size());
    grow(predicted, batches * batch_size());
    ids.reserve(static_cast<std::size_t>(batches) * lanes);
    reports.resize(batches);
    const int first = capacity * lanes;
    capacity = batches;
    for (int c = first; c < batches * lanes; ++c) clear(c);
  }

  /// An empty lane holds an undeformed cell at rest: harmless work.
  void clear(int c) {
    set_positions(c, type->rest().vertices);
    for (int k = 0; k < vertices; ++k)
      for (int d = 0; d < 3; ++d) velocity[layout().at(c, k, d)] = predicted[layout().at(c, k, d)] = 0;
  }

  void set_positions(int c, const std::vector<Vec3>& x) {
    Vec3 mean{};
    for (const auto& p : x) mesh::accumulate(mean, 1.0 / vertices, p);
    for (int d = 0; d < 3; ++d) anchor[layout().anchor(c, d)] = mean[d];
    mesh::TriangleMesh shape{x, type->rest().triangles};
    const auto normals = mesh::vertex_normals(shape);
    for (int k = 0; k < vertices; ++k)
      for (int d = 0; d < 3; ++d) {
        const auto at = layout().at(c, k, d);
        const double arm = x[k][d] - mean[d];
        offset[at] = static_cast<Real>(arm);
        residual[at] = static_cast<Real>(arm - static_cast<double>(offset[at]));
        normal[at] = static_cast<Real>(normals[k][d]);
      }
  }

  BatchFields<Real> batch(int b) {
    const std::size_t at = b * batch_size();
    return {anchor.data() + static_cast<std::size_t>(b) * 3 * lanes,
            offset.data() + at,
            residual.data() + at,
            velocity.data() + at,
            normal.data() + at,
            predicted.data() + at};
  }

  /// body(kernel, b) for every batch, with a thread's own scratch.
  template <class Body>
  void for_batches(int n, const Body& body) {
    add_scratch();  // nothing to do unless there are more threads than before
#pragma omp parallel for schedule(static)
    for (int b = 0; b < n; ++b) {
      BatchKernel<Real> kernel(tables, scratch[omp_get_thread_num()]);
      body(kernel, b);
    }
  }

  std::vector<Vec3> forces(int c) {
    BatchKernel<Real> kernel(tables, scratch[0]);
    kernel.forces(batch(c / lanes));
    std::vector<Vec3> f(vertices);
    for (int k = 0; k < vertices; ++k)
      for (int d = 0; d < 3; ++d) f[k][d] = scratch[0].force[layout().at(c % lanes, k, d)];
    return f;
  }

  StepReport summary(int cells) const {
    StepReport total;
    for (int c = 0; c < cells; ++c) {
      const auto& r = reports[c / lanes];
      const int lane = c % lanes;
      if (!std::isfinite(Real(r.probe[lane])) && total.bad_cell < 0) total.bad_cell = c;
      total.residual = std::max(total.residual, std::sqrt(double(Real(r.residual[lane]))));
      const double increment = std::sqrt(double(Real(r.increment[lane])));
      if (increment > total.increment) total.increment = increment, total.worst_cell = c;
    }
    return total;
  }
};

template <class Real>
Membranes<Real>::Membranes(std::shared_ptr<const CellType> type)
    : impl_(std::make_unique<Impl>(std::move(type))) {}
template <class Real>
Membranes<Real>::~Membranes() = default;
template <class Real>
Membranes<Real>::Membranes(Membranes&&) noexcept = default;
template <class Real>
Membranes<Real>& Membranes<Real>::operator=(Membranes&&) noexcept = default;

template <class Real>
int Membranes<Real>::count() const {
  return static_cast<int>(impl_->ids.size());
}
template <class Real>
int Membranes<Real>::vertices() const {
  return impl_->vertices;
}
template <class Real>
const mesh::TriangleMesh& Membranes<Real>::rest() const {
  return impl_->type->rest();
}
template <class Real>
const std::vector<double>& Membranes<Real>::vertex_areas() const {
  return impl_->type->vertex_areas();
}
template <class Real>
double Membranes<Real>::bounding_radius() const {
  return impl_->type->bounding_radius();
}
template <class Real>
double Membranes<Real>::rest_volume() const {
  return impl_->type->rest_volume();
}
template <class Real>
double Membranes<Real>::h() const {
  return impl_->type->h();
}
template <class Real>
const CellType& Membranes<Real>::type() const {
  return *impl_->type;
}

template <class Real>
Membranes<Real> Membranes<Real>::empty() const {
  return Membranes(impl_->type);
}

template <class Real>
void Membranes<Real>::reserve(int cells) {
  impl_->reserve(cells);
}

template <class Real>
int Membranes<Real>::add(std::int64_t id, const Vec3& centre, const mesh::Quaternion& q) {
  const int c = count();
  if (c >= impl_->capacity * lanes) impl_->reserve(std::max(c + 1, 2 * c));
  auto x = rest().vertices;
  const auto turn = mesh::matrix(q);
  for (auto& p : x) p = mesh::add(centre, mesh::transform(turn, p));
  impl_->ids.push_back(id);
  impl_->clear(c);
  impl_->set_positions(c, x);
  return c;
}

template <class Real>
void Membranes<Real>::remove(int c) {
  const int last = count() - 1;
  const auto at = layout();
  if (c != last) {
    for (int d = 0; d < 3; ++d) impl_->anchor[at.anchor(c, d)] = impl_->anchor[at.anchor(last, d)];
    for (auto* field :
         {&impl_->offset, &impl_->residual, &impl_->velocity, &impl_->normal, &impl_->predicted})
      for (int k = 0; k < vertices(); ++k)
        for (int d = 0; d < 3; ++d) (*field)[at.at(c, k, d)] = (*field)[at.at(last, k, d)];
    impl_->ids[c] = impl_->ids[last];
  }
  impl_->ids.pop_back();
  impl_->clear(last);
}

template <class Real>
std::int64_t Membranes<Real>::id(int c) const {
  return impl_->ids[c];
}
template <class Real>
View<const double> Membranes<Real>::anchors() const {
  return std::as_const(impl_->anchor).view();
}
template <class Real>
View<const Real> Membranes<Real>::offsets() const {
  return std::as_const(impl_->offset).view();
}
template <class Real>
View<const Real> Membranes<Real>::velocities() const {
  return std::as_const(impl_->velocity).view();
}
template <class Real>
View<const Real> Membranes<Real>::normals() const {
  return std::as_const(impl_->normal).view();
}
template <class Real>
View<Real> Membranes<Real>::predicted() {
  return impl_->predicted.view();
}

template <class Real>
StepReport Membranes<Real>::step(const StepOptions& options) {
  impl_->for_batches(batches(),
                     [&](auto& kernel, int b) { impl_->reports[b] = kernel.step(impl_->batch(b), options); });
  return impl_->summary(count());
}

template <class Real>
StepReport Membranes<Real>::drift() {
  impl_->for_batches(batches(),
                     [&](auto& kernel, int b) { impl_->reports[b] = kernel.drift(impl_->batch(b)); });
  return impl_->summary(count());
}

template <class Real>
void Membranes<Real>::internal_forces(View<Real> out) {
  const std::size_t size = impl_->batch_size();
  impl_->for_batches(batches(), [&](auto& kernel, int b) {
    kernel.forces(impl_->batch(b));
    std::memcpy(out.data + b * size, impl_->scratch[omp_get_thread_num()].force.data(), size * sizeof(Real));
  });
}

template <class Real>
Vec3 Membranes<Real>::anchor(int c) const {
  return {impl_->anchor[layout().anchor(c, 0)], impl_->anchor[layout().anchor(c, 1)],
          impl_->anchor[layout().anchor(c, 2)]};
}

template <class Real>
Vec3 Membranes<Real>::position(int c, int k) const {
  auto x = anchor(c);
  for (int d = 0; d < 3; ++d) {
    const auto at = layout().at(c, k, d);
    x[d] += static_cast<double>(impl_->offset[at]) + static_cast<double>(impl_->residual[at]);
  }
  return x;
}

template <class Real>
std::vector<Vec3> Membranes<Real>::positions(int c) const {
  std::vector<Vec3> x(vertices());
  for (int k = 0; k < vertices(); ++k) x[k] = position(c, k);
  return x;
}

template <class Real>
void Membranes<Real>::translate(int c, const Vec3& shift) {
  for (int d = 0; d < 3; ++d) impl_->anchor[layout().anchor(c, d)] += shift[d];
}

template <class Real>
mesh::Observables Membranes<Real>::observe(int c) const {
  return mesh::observe(rest(), positions(c), impl_->type->marker());
}

template <class Real>
std::size_t Membranes<Real>::state_bytes() const {
  return sizeof(std::int64_t) + 3 * sizeof(double) + impl_->state().size() * 3 * vertices() * sizeof(Real);
}

template <class Real>
void Membranes<Real>::save(int c, std::byte* out) const {
  const auto write = [&out](const auto& value) {
    std::memcpy(out, &value, sizeof value);
    out += sizeof value;
  };
  write(id(c));
  write(anchor(c));
  for (const auto* field : impl_->state())
    for (int k = 0; k < vertices(); ++k)
      for (int d = 0; d < 3; ++d) write((*field)[layout().at(c, k, d)]);
}

template <class Real>
int Membranes<Real>::load(const std::byte* in) {
  const int c = add(0, {0, 0, 0}, mesh::identity_rotation);
  restore(c, in);
  return c;
}

template <class Real>
mesh::HostFields<Real> Membranes<Real>::host_fields() {
  return {impl_->vertices,        batches(),
          impl_->anchor.data(),   impl_->offset.data(),
          impl_->velocity.data(), impl_->normal.data(),
          impl_->predicted.data()};
}

template <class Real>
void Membranes<Real>::restore(int c, const std::byte* in) {
  const auto read = [&in](auto& value) {
    std::memcpy(&value, in, sizeof value);
    in += sizeof value;
  };
  Vec3 anchor;
  read(impl_->ids[c]);
  read(anchor);
  for (int d = 0; d < 3; ++d) impl_->anchor[layout().anchor(c, d)] = anchor[d];
  for (auto* field : impl_->state())
    for (int k = 0; k < vertices(); ++k)
      for (int d = 0; d < 3; ++d) read((*field)[layout().at(c, k, d)]);
}

template <class Real>
void Membranes<Real>::set_positions(int c, const std::vector<Vec3>& x) {
  require(static_cast<int>(x.size()) == vertices(), "wrong number of vertices for this cell type (" +
                                                        std::to_string(x.size()) + ") pass " +
                                                        std::to_string(vertices()));
  impl_->set_positions(c, x);
}

template <class Real>
void Membranes<Real>::set_velocities(int c, const std::vector<Vec3>& v) {
  for (int k = 0; k < vertices(); ++k)
    for (int d = 0; d < 3; ++d) {
      impl_->velocity[layout().at(c, k, d)] = static_cast<Real>(v[k][d]);
    }
}

template <class Real>
std::vector<Vec3> Membranes<Real>::forces(int c) const {
  return impl_->forces(c);
}
template <class Real>
double Membranes<Real>::volume(int c) const {
  return mesh::volume({positions(c), rest().triangles});
}
template <class Real>
double Membranes<Real>::area(int c) const {
  return mesh::area({positions(c), rest().triangles});
}
template <class Real>
double Membranes<Real>::energy(int c) const {
  return npfem::energy(*impl_->type, positions(c)).total();
}
template <class Real>
double Membranes<Real>::stored_power() {
  impl_->add_scratch();
  const int n = batches();
  std::vector<double> of_cell(static_cast<std::size_t>(n) * lanes);
#pragma omp parallel for schedule(static)
  for (int b = 0; b < n; ++b) {
    const auto power =
        BatchKernel<Real>(impl_->tables, impl_->scratch[omp_get_thread_num()]).stored_power(impl_->batch(b));
    for (int lane = 0; lane < lanes; ++lane) of_cell[b * lanes + lane] = Real(power[lane]);
  }
  double sum = 0;
  for (int c = 0; c < count(); ++c) sum += of_cell[c];
  return sum;
}

template <class Real>
double Membranes<Real>::damping_power(int c) const {
  auto x = positions(c);
  std::vector<Vec3> v(x.size());
  for (int k = 0; k < vertices(); ++k) {
    for (int d = 0; d < 3; ++d) v[k][d] = impl_->velocity[layout().at(c, k, d)];
    mesh::accumulate(x[k], -h(), v[k]);
  }
  return npfem::damping_power(*impl_->type, x, v);
}

template class Membranes<float>;
template class Membranes<double>;

}  // namespace hemowalk::npfem
