#include "resolved/ibm/markers.hpp"

#include <cmath>
#include <cstring>
#include <string>

#include "core/check.hpp"
#include "core/simd.hpp"
#include "resolved/ibm/site.hpp"

namespace hemowalk::ibm {

namespace {

constexpr int ahead = 8;  ///< markers between asking for nodes and using them

constexpr int lanes = 16;

/// The four weights of up to 16 markers, structure of arrays.
template <class Real>
struct WeightBlock {
  alignas(64) Real w[4][lanes];
};
template <Kernel kernel, class Real>
HEMO_INLINE void weigh(const Real* fraction, WeightBlock<Real>& out) {
  using P = Pack<Real, std::is_same_v<Real, float> ? 16 : 8>;
  for (int l = 0; l < lanes; l += static_cast<int>(P::size())) {
    const P f(fraction + l, stdx::element_aligned);
    const auto w = kernel == Kernel::phi4 ? phi4(f) : kernel == Kernel::phi3 ? phi3(f) : phi2(f);
    w.w0.copy_to(out.w[0] + l, stdx::element_aligned);
    w.w1.copy_to(out.w[1] + l, stdx::element_aligned);
    w.w2.copy_to(out.w[2] + l, stdx::element_aligned);
    w.w3.copy_to(out.w[3] + l, stdx::element_aligned);
  }
}

/// Rows of nodes along y or z whose weights are not zero by construction, and the first of the four.
template <Kernel kernel>
constexpr int rows = kernel == Kernel::phi4   ? 4
                     : kernel == Kernel::phi3 ? 3
                                              : 2;
template <Kernel kernel, class Real>
HEMO_INLINE int first_row(Real fraction) {
  if constexpr (kernel == Kernel::phi3) return static_cast<int>(nearest_node(fraction));
  return kernel == Kernel::phi4 ? 0 : 1;
}

/// One node: four numbers in a register. A kernel row is four of them, one cache line in single precision.
template <class Real>
using Quad = Pack<Real, 4>;

template <class Real>
HEMO_INLINE Quad<Real> load_node(const Node4<Real>* node) {
  return Quad<Real>(&node->x, stdx::element_aligned);
}
template <class Real>
HEMO_INLINE void store_node(const Quad<Real>& value, Node4<Real>* node) {
  value.copy_to(&node->x, stdx::element_aligned);
}

/// Row registers. Single precision: the whole row in one pack of 16; double precision: two packs of 8.
template <class Real>
struct Row {
  static constexpr int width = std::is_same_v<Real, float> ? 16 : 8, packs = 16 / width;
  using P = Pack<Real, width>;
  P part[packs];
  HEMO_INLINE static Row load(const Node4<Real>* first) {
    Row r;
    for (int p = 0; p < packs; ++p) r.part[p] = P(&first->x + p * width, stdx::element_aligned);
    return r;
  }
  HEMO_INLINE static Row join(const Quad<Real>& a, const Quad<Real>& b, const Quad<Real>& c,
                              const Quad<Real>& d) {
    Row r;
    if constexpr (packs == 1) {
      r.part[0] = stdx::concat(a, b, c, d);
    } else {
      r.part[0] = stdx::concat(a, b), r.part[1] = stdx::concat(c, d);
    }
    return r;
  }
  HEMO_INLINE void store(Node4<Real>* first) const {
    for (int p = 0; p < packs; ++p) part[p].copy_to(&first->x + p * width, stdx::element_aligned);
  }
  HEMO_INLINE static Row zero() {
    Row r;
    for (int p = 0; p < packs; ++p) r.part[p] = Real(0);
    return r;
  }
  HEMO_INLINE void add(const Row& o, Real weight) {
    for (int p = 0; p < packs; ++p) part[p] += o.part[p] * weight;
  }
  HEMO_INLINE void add(const Row& o) {
    for (int p = 0; p < packs; ++p) part[p] += o.part[p];
  }
};

}  // namespace

template <class Real>
Markers<Real>::Markers(const Block& block, const Faces& faces, Kernel kernel,
                       const std::vector<std::int32_t>& body_of)
    : block_(block),
      faces_(faces),
      kernel_(kernel),
      slabs_((block.nz + slab_planes - 1) / slab_planes),
      strips_((block.ny + 2 + strip_rows - 1) / strip_rows) {
  require(block.size() < (std::size_t(1) << 32),
          "the block has more than 2^32 nodes (base nodes are 32-bit) split it over more ranks");
  counts_.resize(static_cast<std::size_t>(slabs_) * strips_ * sort_chunks + 1);
  slab_begin_.resize(slabs_ + 1);
  assign(body_of);
}

template <class Real>
void Markers<Real>::assign(const std::vector<std::int32_t>& body_of) {
  body_.assign(body_of.begin(), body_of.end());
  count_ = body_.size(), active_ = 0;
  for (const auto b : body_) active_ += b >= 0;
  // The first size fits exactly; a set that changes gets room for the next changes.
  const auto fit = [](auto& array, std::size_t n) {
    if (n > array.size()) array = std::remove_reference_t<decltype(array)>(array.size() == 0 ? n : n + n / 4);
  };
  fit(sites_, active_ + lanes), fit(marker_, active_);
  fit(slot_, count_), fit(home_, count_), fit(tile_, count_);
  // Unused slots are saved too: the same whatever was there before.
  std::fill(slot_.begin(), slot_.end(), 0u);
  std::fill(home_.begin(), home_.end(), Home{});
  sorted_ = false;
}

template <class Real>
void Markers<Real>::locate(View<const Origin> origin, View<const Node4<Real>> local) {
  if (!sorted_ || !place(origin, local)) {
    sort(origin, local);
    if (!place(origin, local)) throw std::logic_error("marker sort left a marker outside its tile");
  }
}

/// Fills the sites at the slots of the last sort. \returns false when a marker left its neighbourhood.
template <class Real>
bool Markers<Real>::place(View<const Origin> origin, View<const Node4<Real>> local) {
  const std::array<int, 3> n{block_.nx, block_.ny, block_.nz};
  bool settled = true;
#pragma omp parallel for schedule(static) reduction(&& : settled)
  for (std::ptrdiff_t m = 0; m < static_cast<std::ptrdiff_t>(count_); ++m) {
    if (body_[m] < 0) continue;
    const Origin& o = origin[body_[m]];
    const Home& home = home_[m];
    const auto x = split(o[0] - home.wraps[0] * n[0], local[m].x);
    const auto y = split(o[1] - home.wraps[1] * n[1], local[m].y);
    const auto z = split(o[2] - home.wraps[2] * n[2], local[m].z);
    const int first = home.slab * slab_planes,
              last = home.slab + 1 == slabs_ ? n[2] - 1 : first + slab_planes - 1;
    const bool inside = x.node >= -1 && x.node <= n[0] && y.node >= -1 &&
                        y.node <= n[1] - (faces_.periodic_y ? 0 : 1) && z.node >= first - 1 &&
                        z.node <= last + 1 && x.fraction <= 1 && y.fraction <= 1 && z.fraction <= 1;
    if (!inside) {
      settled = false;
      continue;
    }
    sites_[slot_[m]] = {static_cast<std::uint32_t>(block_.at(x.node - 1, y.node - 1, z.node - 1)), x.fraction,
                        y.fraction, z.fraction};
  }
  return settled;
}

template <class Real>
void Markers<Real>::sort(View<const Origin> origin, View<const Node4<Real>> local) {
  const std::array<int, 3> n{block_.nx, block_.ny, block_.nz};
  const std::array<bool, 3> periodic{faces_.periodic_x, faces_.periodic_y, faces_.periodic_z};
  const std::size_t tiles = static_cast<std::size_t>(slabs_) * strips_;
  const std::ptrdiff_t chunk = (static_cast<std::ptrdiff_t>(count_) + sort_chunks - 1) / sort_chunks;
  std::fill(counts_.begin(), counts_.end(), 0u);
  std::ptrdiff_t bad = static_cast<std::ptrdiff_t>(count_);
  const auto last = [&](int c) { return std::min<std::ptrdiff_t>((c + 1) * chunk, count_); };

#pragma omp parallel for schedule(static) reduction(min : bad)
  for (int c = 0; c < sort_chunks; ++c)
    for (std::ptrdiff_t m = c * chunk; m < last(c); ++m) {
      if (body_[m] < 0) continue;
      const Real coordinate[3] = {local[m].x, local[m].y, local[m].z};
      std::array<int, 3> node{};
      bool good = true;
      for (int d = 0; d < 3; ++d) {
        good = good && std::isfinite(coordinate[d]) && std::abs(coordinate[d]) < Real(1e6);
        if (!good) break;
        node[d] = split(origin[body_[m]][d], coordinate[d]).node;
        int wraps = 0;
        if (periodic[d]) {
          wraps = node[d] >= 0 ? node[d] / n[d] : -((n[d] - 1 - node[d]) / n[d]);
          good = good && std::abs(wraps) < 127;
        } else {
          good = good && node[d] >= -1 && node[d] < n[d] + (d == 2);
        }
        node[d] -= wraps * n[d];
        home_[m].wraps[d] = static_cast<std::int8_t>(wraps);
      }
      if (!good) {
        bad = std::min(bad, m);
        continue;
      }
      const int slab = std::min(node[2] / slab_planes, slabs_ - 1);
      home_[m].slab = static_cast<std::int16_t>(slab);
      tile_[m] = static_cast<std::uint32_t>(slab * strips_ + (node[1] + 1) / strip_rows);
      ++counts_[tile_[m] * sort_chunks + c];
    }
  if (bad < static_cast<std::ptrdiff_t>(count_))
    throw PhysicsError(
        "marker " + std::to_string(bad) + " of body " + std::to_string(body_[bad]) +
        " is not finite or outside the walls (blow-up) lower the acceleration or the stiffness");

  std::uint32_t total = 0;
  for (std::size_t t = 0; t < tiles; ++t) {
    if (t % strips_ == 0) slab_begin_[t / strips_] = total;
    for (int c = 0; c < sort_chunks; ++c) {
      const std::uint32_t here = counts_[t * sort_chunks + c];
      counts_[t * sort_chunks + c] = total;
      total += here;
    }
  }
  slab_begin_[slabs_] = total;

#pragma omp parallel for schedule(static)
  for (int c = 0; c < sort_chunks; ++c)
    for (std::ptrdiff_t m = c * chunk; m < last(c); ++m) {
      if (body_[m] < 0) continue;
      const std::uint32_t slot = counts_[tile_[m] * sort_chunks + c]++;
      slot_[m] = slot;
      marker_[slot] = static_cast<std::uint32_t>(m);
    }
  sorted_ = true;
  ++sorts_;
}

/// Asks for the rows of nodes under a kernel.
template <Kernel kernel, int write, class Real>
HEMO_INLINE void prefetch_rows(const Node4<Real>* base, std::size_t row, std::size_t plane) {
  for (int c = 0; c < rows<kernel>; ++c)
    for (int b = 0; b < rows<kernel>; ++b) {
      const auto* p = reinterpret_cast<const char*>(base + c * plane + b * row);
      __builtin_prefetch(p, write, 3);
      __builtin_prefetch(p + 4 * sizeof(Node4<Real>) - 1, write, 3);
    }
}

/// The first node under the kernel of the marker at a slot, or of the last one.
template <class Real>
template <Kernel kernel>
HEMO_INLINE const Node4<Real>* Markers<Real>::under_kernel(const Node4<Real>* field, std::size_t slot) const {
  const Site& s = sites_[std::min<std::size_t>(slot, active_ - 1)];
  return field + s.base + first_row<kernel>(s.fz) * block_.plane() + first_row<kernel>(s.fy) * block_.row();
}

template <class Real>
template <Kernel kernel>
void Markers<Real>::interpolate_with(View<const Node4<Real>> field, View<Node4<Real>> out) const {
  const std::size_t row = block_.row(), plane = block_.plane();
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t first = 0; first < static_cast<std::ptrdiff_t>(active_); first += lanes) {
    const int group = static_cast<int>(std::min<std::ptrdiff_t>(lanes, active_ - first));
    alignas(64) Real fx[lanes], fy[lanes], fz[lanes];
    for (int l = 0; l < lanes; ++l) {
      const Site& s = sites_[first + l];  // sites_ is padded by one group
      fx[l] = s.fx, fy[l] = s.fy, fz[l] = s.fz;
    }
    WeightBlock<Real> wx, wy, wz;
    weigh<kernel>(fx, wx), weigh<kernel>(fy, wy), weigh<kernel>(fz, wz);
    for (int l = 0; l < group; ++l) {
      const int b0 = first_row<kernel>(fy[l]), c0 = first_row<kernel>(fz[l]);
      const Node4<Real>* base = field.data + sites_[first + l].base + c0 * plane + b0 * row;
      prefetch_rows<kernel, 0>(under_kernel<kernel>(field.data, first + l + ahead), row, plane);
      Row<Real> sum[2] = {Row<Real>::zero(), Row<Real>::zero()};
      for (int c = 0; c < rows<kernel>; ++c)
        for (int b = 0; b < rows<kernel>; ++b)
          sum[b & 1].add(Row<Real>::load(base + c * plane + b * row), wy.w[b0 + b][l] * wz.w[c0 + c][l]);
      sum[0].add(sum[1]);
      alignas(64) Node4<Real> nodes[4];
      sum[0].store(nodes);
      Quad<Real> value = load_node(nodes) * wx.w[0][l];
      for (int a = 1; a < 4; ++a) value += load_node(nodes + a) * wx.w[a][l];
      store_node(value, out.data + marker_[first + l]);
    }
  }
}

template <class Real>
template <Kernel kernel>
void Markers<Real>::spread_with(View<const Node4<Real>> value, View<Node4<Real>> field) const {
  const std::size_t row = block_.row(), plane = block_.plane();
  for (int colour = 0; colour < 2; ++colour)
#pragma omp parallel for schedule(dynamic, 1)
    for (int slab = colour; slab < slabs_; slab += 2)
      for (std::uint32_t first = slab_begin_[slab]; first < slab_begin_[slab + 1]; first += lanes) {
        const int group = static_cast<int>(std::min<std::uint32_t>(lanes, slab_begin_[slab + 1] - first));
        alignas(64) Real fx[lanes], fy[lanes], fz[lanes];
        for (int l = 0; l < lanes; ++l) {
          const Site& s = sites_[first + l];
          fx[l] = s.fx, fy[l] = s.fy, fz[l] = s.fz;
        }
        WeightBlock<Real> wx, wy, wz;
        weigh<kernel>(fx, wx), weigh<kernel>(fy, wy), weigh<kernel>(fz, wz);
        for (int l = 0; l < group; ++l) {
          Quad<Real> v = load_node(value.data + marker_[first + l]);
          v[3] = Real(0);
          const auto share = Row<Real>::join(v * wx.w[0][l], v * wx.w[1][l], v * wx.w[2][l], v * wx.w[3][l]);
          const int b0 = first_row<kernel>(fy[l]), c0 = first_row<kernel>(fz[l]);
          Node4<Real>* base = field.data + sites_[first + l].base + c0 * plane + b0 * row;
          prefetch_rows<kernel, 1>(under_kernel<kernel>(field.data, first + l + ahead), row, plane);
          for (int c = 0; c < rows<kernel>; ++c)
            for (int b = 0; b < rows<kernel>; ++b) {
              auto r = Row<Real>::load(base + c * plane + b * row);
              r.add(share, wy.w[b0 + b][l] * wz.w[c0 + c][l]);
              r.store(base + c * plane + b * row);
            }
        }
      }
}

template <class Real>
void Markers<Real>::interpolate(View<const Node4<Real>> field, View<Node4<Real>> out) const {
  switch (kernel_) {
    case Kernel::phi2:
      return interpolate_with<Kernel::phi2>(field, out);
    case Kernel::phi3:
      return interpolate_with<Kernel::phi3>(field, out);
    case Kernel::phi4:
      return interpolate_with<Kernel::phi4>(field, out);
  }
}

template <class Real>
void Markers<Real>::spread(View<const Node4<Real>> value, View<Node4<Real>> field) const {
  switch (kernel_) {
    case Kernel::phi2:
      return spread_with<Kernel::phi2>(value, field);
    case Kernel::phi3:
      return spread_with<Kernel::phi3>(value, field);
    case Kernel::phi4:
      return spread_with<Kernel::phi4>(value, field);
  }
}

template <class Real>
std::vector<std::byte> Markers<Real>::save() const {
  std::vector<std::byte> out;
  if (!sorted_) return out;
  const auto put = [&](const void* data, std::size_t bytes) {
    const auto* raw = static_cast<const std::byte*>(data);
    out.insert(out.end(), raw, raw + bytes);
  };
  put(marker_.data(), active_ * sizeof(std::uint32_t));
  put(slot_.data(), count_ * sizeof(std::uint32_t));
  put(home_.data(), count_ * sizeof(Home));
  put(slab_begin_.data(), slab_begin_.size() * sizeof(std::uint32_t));
  return out;
}

template <class Real>
void Markers<Real>::load(View<const std::byte> state) {
  sorted_ = state.size > 0;
  if (!sorted_) return;
  const std::size_t bytes =
      (active_ + count_ + slab_begin_.size()) * sizeof(std::uint32_t) + count_ * sizeof(Home);
  require(state.size == bytes,
          "the saved marker order does not fit (another number of markers or another block) use the scene it "
          "was made with");
  const std::byte* at = state.data;
  const auto take = [&](void* data, std::size_t n) {
    if (n) std::memcpy(data, at, n);
    at += n;
  };
  take(marker_.data(), active_ * sizeof(std::uint32_t));
  take(slot_.data(), count_ * sizeof(std::uint32_t));
  take(home_.data(), count_ * sizeof(Home));
  take(slab_begin_.data(), slab_begin_.size() * sizeof(std::uint32_t));
}

template class Markers<float>;
template class Markers<double>;

}  // namespace hemowalk::ibm
