#include "resolved/npfem/device_membranes.hpp"

#include <cmath>
#include <cstring>

#include "core/check.hpp"

namespace hemowalk::npfem {

namespace {

/// N^{-1}, dense, from the sparse factor: one solve per column.
std::vector<double> dense_inverse(const SparseFactor& f) {
  const int n = static_cast<int>(f.order.size());
  std::vector<double> inverse(static_cast<std::size_t>(n) * n);
#pragma omp parallel for schedule(static)
  for (int c = 0; c < n; ++c) {
    double* x =
        inverse.data() + static_cast<std::size_t>(c) * n;  // the matrix is symmetric: columns are rows
    x[c] = 1;
    for (int p = 0; p < n; ++p)
      for (int i = f.row_begin[p]; i < f.row_begin[p + 1]; ++i)
        x[f.order[p]] -= f.row_value[i] * x[f.row_index[i]];
    for (int p = n - 1; p >= 0; --p) {
      x[f.order[p]] *= f.inverse_diagonal[p];
      for (int i = f.column_begin[p]; i < f.column_begin[p + 1]; ++i)
        x[f.order[p]] -= f.column_value[i] * x[f.column_index[i]];
    }
  }
  return inverse;
}

/// Lists of what touches each vertex, flat: begin and items.
template <class Item>
struct Lists {
  explicit Lists(int n) : of(n) {}
  void flatten() {
    begin.assign(1, 0);
    for (const auto& list : of) {
      items.insert(items.end(), list.begin(), list.end());
      begin.push_back(static_cast<int>(items.size()));
    }
  }
  std::vector<std::vector<Item>> of;
  std::vector<int> begin;
  std::vector<Item> items;
};

}  // namespace

template <class Real>
DeviceMembranes<Real>::DeviceMembranes(Queue& queue, const Membranes<Real>& host) : queue_(queue) {
  make_tables(host.type());
  queue.require_shared_memory(shared_bytes());
  upload(host);
}

template <class Real>
void DeviceMembranes<Real>::fit(int count) {
  count_ = count;
  const std::size_t n = static_cast<std::size_t>(count_), pitch = static_cast<std::size_t>(tables_.pitch);
  const Place place = queue_.place();
  anchor_ = Array<double>(3 * n, place);
  for (auto* field : {&offset_, &residual_, &velocity_, &normal_, &predicted_})
    *field = Array<Real>(3 * n * pitch, place);
  report_ = Array<CellReport<Real>>(n, place);
  fields_ = {tables_.vertices, tables_.pitch,  anchor_.data(),   offset_.data(),
             velocity_.data(), normal_.data(), predicted_.data()};
}

template <class Real>
void DeviceMembranes<Real>::make_tables(const CellType& type) {
  const Tables<Real> from(type);
  const Material& m = from.material;
  require(m.bending != Bending::helfrich && m.volume_force == VolumeForce::gradient,
          "this membrane law is not on the device (Helfrich bending and the paper's volume force as printed "
          "are on the "
          "host alone) use place.solid: host, or bending: paper");
  const auto real = [](double x) { return static_cast<Real>(x); };
  const int n = from.vertices, pitch = mesh::CellFields<Real>::padded(n);
  const Place place = queue_.place();
  triangle_ = make_array(place, from.triangles);
  edge_ = make_array(place, from.edges);
  Lists<int> ring(n);
  for (std::size_t i = 0; i < from.triangles.size(); ++i) {
    const int corner[3] = {from.triangles[i].v0, from.triangles[i].v1, from.triangles[i].v2};
    for (int c = 0; c < 3; ++c) ring.of[corner[c]].push_back(4 * static_cast<int>(i) + c);
  }
  Lists<Hinge<Real>> hinge(n);
  for (std::size_t i = 0; i < from.edges.size(); ++i) {
    const auto& e = from.edges[i];
    const int index = static_cast<int>(i);
    hinge.of[e.v0].push_back({index, -(e.rest.w1 + e.rest.w2 + e.rest.w3)});
    hinge.of[e.v1].push_back({index, e.rest.w1});
    hinge.of[e.v2].push_back({index, e.rest.w2});
    hinge.of[e.v3].push_back({index, e.rest.w3});
  }
  ring.flatten(), hinge.flatten();
  ring_begin_ = make_array(place, ring.begin), ring_ = make_array(place, ring.items);
  hinge_begin_ = make_array(place, hinge.begin), hinge_ = make_array(place, hinge.items);
  metric_ = make_array(place, from.metric), mass_rate_ = make_array(place, from.mass_rate);
  kappa_ = make_array(place, from.kappa);
  const auto inverse = dense_inverse(type.factor());
  std::vector<Real> padded(static_cast<std::size_t>(n) * pitch);
  for (int j = 0; j < n; ++j)
    for (int k = 0; k < n; ++k)
      padded[static_cast<std::size_t>(j) * pitch + k] = real(inverse[static_cast<std::size_t>(j) * n + k]);
  inverse_ = make_array(place, padded);
  lap_begin_ = make_array(place, from.lap_begin), lap_index_ = make_array(place, from.lap_index);
  lap_value_ = make_array(place, from.lap_value);
  tables_ = {n,
             static_cast<int>(from.triangles.size()),
             static_cast<int>(from.edges.size()),
             pitch,
             triangle_.data(),
             edge_.data(),
             ring_begin_.data(),
             ring_.data(),
             hinge_begin_.data(),
             hinge_.data(),
             metric_.data(),
             mass_rate_.data(),
             kappa_.data(),
             inverse_.data(),
             lap_begin_.data(),
             lap_index_.data(),
             lap_value_.data(),
             m.law,
             m.bending == Bending::paper,
             from.damped,
             from.stiff_volume,
             {{real(m.B), real(m.D)}, {real(m.C)}},
             {real(m.Gs)},
             {real(m.Gs), real(m.skalak_C)},
             from.h,
             from.inverse_h,
             from.rest_volume,
             from.rest_gradient_square,
             real(m.volume_modulus),
             from.epsilon2,
             from.total_metric,
             real(m.rayleigh_beta)};
}

template <class Real>
typename DeviceMembranes<Real>::Step DeviceMembranes<Real>::body(const StepOptions& options) const {
  // The kernel writes through these pointers: that is what they are for.
  auto* self = const_cast<DeviceMembranes*>(this);
  return {tables_,        fields_, self->residual_.data(), self->report_.data(), options.iterations,
          options.damping};
}

template <class Real>
void DeviceMembranes<Real>::step(const StepOptions& options) {
  queue_.blocks(static_cast<std::size_t>(count_), shared_bytes(), body(options));
}

// A cell's state as Membranes::save writes it: number, anchor, then offset, residual, velocity and normal,
// each [vertex][3].
template <class Real>
void DeviceMembranes<Real>::upload(const Membranes<Real>& host) {
  if (host.count() != count_ || !fields_.pitch) fit(host.count());
  Array<double> anchor(anchor_.size());
  std::array<Array<Real>, 4> field;
  for (auto& f : field) f = Array<Real>(offset_.size());
  std::vector<std::byte> state(host.state_bytes());
  for (int c = 0; c < count_; ++c) {
    host.save(c, state.data());
    const std::byte* in = state.data() + sizeof(std::int64_t);
    std::memcpy(anchor.data() + 3 * static_cast<std::size_t>(c), in, 3 * sizeof(double));
    in += 3 * sizeof(double);
    for (auto& f : field)
      for (int k = 0; k < vertices(); ++k)
        for (int d = 0; d < 3; ++d, in += sizeof(Real))
          std::memcpy(&f[fields_.at(c, d, k)], in, sizeof(Real));
  }
  queue_.copy(anchor_.data(), anchor.data(), anchor.size());
  Array<Real>* to[4] = {&offset_, &residual_, &velocity_, &normal_};
  for (int i = 0; i < 4; ++i) queue_.copy(to[i]->data(), field[i].data(), field[i].size());
  queue_.wait();
}

template <class Real>
void DeviceMembranes<Real>::download(Membranes<Real>& host) const {
  Array<double> anchor(anchor_.size());
  queue_.copy(anchor.data(), anchor_.data(), anchor.size());
  const Array<Real>* from[4] = {&offset_, &residual_, &velocity_, &normal_};
  std::array<Array<Real>, 4> field;
  for (int i = 0; i < 4; ++i) {
    field[i] = Array<Real>(offset_.size());
    queue_.copy(field[i].data(), from[i]->data(), field[i].size());
  }
  queue_.wait();
  std::vector<std::byte> state(host.state_bytes());
  for (int c = 0; c < count_; ++c) {
    const std::int64_t id = host.id(c);
    std::byte* out = state.data();
    std::memcpy(out, &id, sizeof id);
    out += sizeof id;
    std::memcpy(out, anchor.data() + 3 * static_cast<std::size_t>(c), 3 * sizeof(double));
    out += 3 * sizeof(double);
    for (const auto& f : field)
      for (int k = 0; k < vertices(); ++k)
        for (int d = 0; d < 3; ++d, out += sizeof(Real))
          std::memcpy(out, &f[fields_.at(c, d, k)], sizeof(Real));
    host.restore(c, state.data());
  }
}

template <class Real>
StepReport DeviceMembranes<Real>::report() const {
  std::vector<CellReport<Real>> cells(static_cast<std::size_t>(count_));
  queue_.copy(cells.data(), report_.data(), cells.size());
  queue_.wait();
  StepReport total;
  for (int c = 0; c < count_; ++c) {
    if (!std::isfinite(cells[c].probe) && total.bad_cell < 0) total.bad_cell = c;
    const double increment = std::sqrt(static_cast<double>(cells[c].increment));
    if (increment > total.increment) total.increment = increment, total.worst_cell = c;
  }
  return total;
}

template <class Real>
std::size_t DeviceMembranes<Real>::memory_bytes() const {
  return (inverse_.size() + 5 * offset_.size()) * sizeof(Real) + anchor_.size() * sizeof(double);
}

template class DeviceMembranes<float>;
template class DeviceMembranes<double>;

}  // namespace hemowalk::npfem
