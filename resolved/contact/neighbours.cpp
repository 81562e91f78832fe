#include "resolved/contact/neighbours.hpp"

#include "core/check.hpp"

#include <omp.h>

#include "core/simd.hpp"

namespace hemowalk::contact {

namespace {

/// Lists are kept in single precision; this much is taken off distances, so that they never exceed the true
/// ones.
constexpr double rounding = 1e-5;

using Floats = Pack<float, 16>;
constexpr std::size_t width = 16;

}  // namespace

/// A body that left the box and came back on the other side has not moved: lists only know differences, so
/// its origin stays in the image it had at the search. \p place(from, period) -> the image's origin.
template <class Real>
template <class Place>
void Neighbours<Real>::choose_images(Cloud<Real>& cloud, const Place& place) const {
  const auto bodies = static_cast<std::ptrdiff_t>(cloud.bodies.size());
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < bodies; ++b)
    for (int k = 0; k < 3; ++k)
      if (const double period = domain_.period[k]; period > 0 && period == std::floor(period))
        cloud.origin[b][k] += static_cast<std::int32_t>(
            period * place((valid_ ? reference_origin_[b][k] : 0) / period, cloud.origin[b][k] / period));
}

template <class Real>
void Neighbours<Real>::update(Cloud<Real>& cloud) {
  if (valid_) {
    choose_images(cloud, [](double then, double now) { return std::round(then - now); });
    if (holds(cloud)) return;
  }
  choose_images(cloud, [](double, double now) { return -std::floor(now); });
  search(cloud);
  valid_ = true;
  ++searches_;
}

template <class Real>
bool Neighbours<Real>::holds(const Cloud<Real>& cloud) {
  const auto bodies = static_cast<std::ptrdiff_t>(cloud.bodies.size());
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  double spread = 0;
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < bodies; ++b) {
    Point<Real> lo{1e30f, 1e30f, 1e30f}, hi{-1e30f, -1e30f, -1e30f};
    for (std::uint32_t i = cloud.first[b]; i < cloud.first[b + 1]; ++i) {
      const Point<Real> d = cloud.x[i] - reference_[i];
      lo = {std::min(lo.x, d.x), std::min(lo.y, d.y), std::min(lo.z, d.z)};
      hi = {std::max(hi.x, d.x), std::max(hi.y, d.y), std::max(hi.z, d.z)};
    }
    const Point<Real> half = Real(0.5) * (hi - lo), middle = Real(0.5) * (hi + lo);
    Motion& m = motions_[b];
    m.mean = {double(middle.x), double(middle.y), double(middle.z)};
    for (int k = 0; k < 3; ++k) m.mean[k] += cloud.origin[b][k] - reference_origin_[b][k];
    m.spread = std::sqrt(double(dot(half, half)));
  }
  for (const Motion& m : motions_) {
    spread = std::max(spread, m.spread);
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], m.mean[k]), high[k] = std::max(high[k], m.mean[k]);
  }
  double across = 0;
  for (int k = 0; k < 3; ++k) across += (high[k] - low[k]) * (high[k] - low[k]);
  if (std::sqrt(across) + 2 * spread > skin_ + far_) return false;
  bool close = false;
  const auto pairs = static_cast<std::ptrdiff_t>(watched_.size());
#pragma omp parallel for schedule(static) reduction(|| : close)
  for (std::ptrdiff_t p = 0; p < pairs; ++p)
    close = close || approach(motions_[watched_[p][0]], motions_[watched_[p][1]]) > skin_;
  return !close;
}

template <class Real>
void Neighbours<Real>::Stretch::start(std::size_t most) {
  count = 0;
  if (x.size() >= most + width) return;
  for (auto* a : {&x, &y, &z, &r}) a->resize(most + width);
  number.resize(most + width);
}
template <class Real>
void Neighbours<Real>::Stretch::pad() {
  for (std::size_t i = count; i < count + width; ++i) x[i] = y[i] = z[i] = 1e15f, r[i] = 0;
}

template <class Real>
void Neighbours<Real>::search(const Cloud<Real>& cloud) {
  const std::size_t bodies = cloud.bodies.size();
  reference_ = cloud.x;
  reference_origin_ = cloud.origin;
  motions_.assign(bodies, Motion{{0, 0, 0}, 0});
  near_.resize(bodies);
  boxes_.resize(bodies);
  scratch_.resize(static_cast<std::size_t>(omp_get_max_threads()));
  spheres_begin_.assign(1, 0);
  for (const Body& b : cloud.bodies)
    spheres_begin_.push_back(spheres_begin_.back() +
                             static_cast<std::uint32_t>(shapes_[b.shape].triangles.size()));
  for (auto* a : {&gx_, &gy_, &gz_, &gr_}) a->resize(spheres_begin_.back() + width);
  const auto count = static_cast<std::ptrdiff_t>(bodies);
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < count; ++b) bound(cloud, static_cast<std::size_t>(b));
  pair_bodies(cloud);
#pragma omp parallel for schedule(dynamic, 4)
  for (std::ptrdiff_t b = 0; b < count; ++b)
    look_around(cloud, static_cast<std::uint32_t>(b),
                scratch_[static_cast<std::size_t>(omp_get_thread_num())]);
  collect_incoming(bodies);
}

/// Bounding box of a body and spheres around its triangles.
template <class Real>
void Neighbours<Real>::bound(const Cloud<Real>& cloud, std::size_t b) {
  const Point<Real>* x = cloud.x.data() + cloud.first[b];
  Point<Real> lo = x[0], hi = lo;
  for (std::size_t i = 0; i < cloud.vertices(b); ++i) {
    lo = {std::min(lo.x, x[i].x), std::min(lo.y, x[i].y), std::min(lo.z, x[i].z)};
    hi = {std::max(hi.x, x[i].x), std::max(hi.y, x[i].y), std::max(hi.z, x[i].z)};
  }
  const double l[3] = {double(lo.x), double(lo.y), double(lo.z)},
               h[3] = {double(hi.x), double(hi.y), double(hi.z)};
  for (int k = 0; k < 3; ++k)
    boxes_[b].low[k] = cloud.origin[b][k] + l[k], boxes_[b].high[k] = cloud.origin[b][k] + h[k];
  std::uint32_t i = spheres_begin_[b];
  for (const Corners& c : shapes_[cloud.bodies[b].shape].triangles) {
    const Point<Real> g = Real(1.0 / 3) * (x[c[0]] + x[c[1]] + x[c[2]]);
    Real squared = 0;
    for (const std::uint32_t v : c) squared = std::max(squared, dot(x[v] - g, x[v] - g));
    gx_[i] = static_cast<float>(g.x), gy_[i] = static_cast<float>(g.y), gz_[i] = static_cast<float>(g.z);
    gr_[i++] = static_cast<float>(std::sqrt(double(squared)) + reach_ + skin_ + rounding);
  }
}

/// Pairs of bodies with bounding boxes, in any image, less than the watched distance apart; each body with
/// itself where its own image may be that near.
template <class Real>
void Neighbours<Real>::pair_bodies(const Cloud<Real>& cloud) {
  const std::size_t bodies = cloud.bodies.size();
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  double largest = 0;
  const auto centre = [&](std::size_t b) {
    std::array<double, 3> c;
    for (int k = 0; k < 3; ++k) c[k] = (boxes_[b].low[k] + boxes_[b].high[k]) / 2;
    return c;
  };
  for (std::size_t b = 0; b < bodies; ++b)
    for (int k = 0; k < 3; ++k) {
      largest = std::max(largest, boxes_[b].high[k] - boxes_[b].low[k]);
      low[k] = std::min(low[k], boxes_[b].low[k]);
      high[k] = std::max(high[k], boxes_[b].high[k]);
    }
  const double limit = reach_ + skin_ + far_;
  grid_.shape(low, high, domain_.period, largest + limit, 8 * bodies);
  slots_.resize(bodies);
  for (std::size_t b = 0; b < bodies; ++b) {
    auto c = centre(b);
    slots_[b] = grid_.locate(c);
  }
  grid_.sort(slots_, bodies);
  watched_.clear();
  targets_.clear();
  targets_begin_.assign(1, 0);
  seen_.assign(bodies, ~0u);
  for (std::uint32_t a = 0; a < bodies; ++a) {
    grid_.around(slots_[a].cell, [&](std::uint32_t begin, std::uint32_t end, const auto&) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t b = grid_.order()[i];
        if (seen_[b] == a) continue;
        seen_[b] = a;
        double squared = 0, own = limit;  // own: distance to the next image of a itself
        for (int k = 0; k < 3; ++k) {
          const double period = domain_.period[k],
                       widths =
                           (boxes_[a].high[k] - boxes_[a].low[k] + boxes_[b].high[k] - boxes_[b].low[k]) / 2;
          double d = centre(a)[k] - centre(b)[k];
          if (period > 0) d -= period * std::round(d / period), own = std::min(own, period - widths);
          const double gap = std::max(0.0, std::abs(d) - widths);
          squared += gap * gap;
        }
        if (a == b ? own >= limit : squared >= limit * limit) continue;
        if (b >= a) watched_.push_back({a, b});
        targets_.push_back(b);
      }
    });
    std::sort(targets_.begin() + targets_begin_.back(), targets_.end());
    targets_begin_.push_back(static_cast<std::uint32_t>(targets_.size()));
  }
}

/// Origin of a body as seen from another's.
template <class Real>
Point<Real> Neighbours<Real>::shift(const Cloud<Real>& cloud, std::uint32_t from, std::uint32_t to,
                                    const std::array<std::int32_t, 3>& wraps) const {
  Real s[3];
  for (int k = 0; k < 3; ++k)
    s[k] = static_cast<Real>(cloud.origin[to][k] - cloud.origin[from][k] + wraps[k] * domain_.period[k]);
  return {s[0], s[1], s[2]};
}

/// All images of all bodies whose boxes come within reach of this one's.
template <class Real>
void Neighbours<Real>::look_around(const Cloud<Real>& cloud, std::uint32_t a, Scratch& scratch) {
  Neighbourhood<Real>& near = near_[a];
  near.links.clear();
  near.entries.clear();
  near.candidates.clear();
  near.presses.clear();
  const double within = reach_ + skin_;
  for (std::uint32_t i = targets_begin_[a]; i < targets_begin_[a + 1]; ++i) {
    const std::uint32_t b = targets_[i];
    if (!cloud.bodies[a].owned && !cloud.bodies[b].owned) continue;
    std::array<std::int32_t, 3> first{}, last{}, w;
    for (int k = 0; k < 3; ++k) {
      const double below = boxes_[a].low[k] - boxes_[b].high[k] - within,
                   above = boxes_[a].high[k] - boxes_[b].low[k] + within;
      const double period = domain_.period[k];
      first[k] = period > 0 ? static_cast<std::int32_t>(std::ceil(below / period)) : below > 0;
      last[k] = period > 0 ? static_cast<std::int32_t>(std::floor(above / period)) : -(above < 0);
    }
    for (w[0] = first[0]; w[0] <= last[0]; ++w[0])
      for (w[1] = first[1]; w[1] <= last[1]; ++w[1])
        for (w[2] = first[2]; w[2] <= last[2]; ++w[2])
          if (a != b || w[0] != 0 || w[1] != 0 || w[2] != 0) look_at(cloud, a, b, w, scratch);
  }
}

/// Entries of a body's vertices for one image of another body.
template <class Real>
void Neighbours<Real>::look_at(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target,
                               const std::array<std::int32_t, 3>& wraps, Scratch& scratch) {
  const Point<Real> s = shift(cloud, body, target, wraps);
  if (!select(cloud, body, target, s, scratch)) return;
  Neighbourhood<Real>& near = near_[body];
  const auto begin = static_cast<std::uint32_t>(near.entries.size());
  for (std::size_t v = 0; v < scratch.vertices.count; ++v) {
    const std::uint32_t vertex = scratch.vertices.number[v];
    const Point<Real> p = cloud.x[cloud.first[body] + vertex] - s;
    find_hits(cloud, target, p, v, scratch);
    if (!scratch.hits.empty()) take_entry(cloud, body, target, p, vertex, scratch);
  }
  const auto end = static_cast<std::uint32_t>(near.entries.size());
  if (end > begin) near.links.push_back({target, wraps, begin, end, 0, 0});
}

/// The body's vertices near the other's bounding box, and the other's triangles near those vertices, both
/// relative to the other's origin. \returns whether there are any.
template <class Real>
bool Neighbours<Real>::select(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target,
                              const Point<Real>& shift, Scratch& scratch) const {
  const double within = reach_ + skin_ + rounding;
  float low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = static_cast<float>(boxes_[target].low[k] - cloud.origin[target][k] - within);
    high[k] = static_cast<float>(boxes_[target].high[k] - cloud.origin[target][k] + within);
  }
  Stretch& vertices = scratch.vertices;
  vertices.start(cloud.vertices(body));
  const Point<Real>* x = cloud.x.data() + cloud.first[body];
  float lo[3] = {1e30f, 1e30f, 1e30f}, hi[3] = {-1e30f, -1e30f, -1e30f};
  for (std::uint32_t v = 0; v < cloud.vertices(body); ++v) {
    const Point<Real> q = x[v] - shift;
    const float p[3] = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
    if (p[0] < low[0] || p[0] > high[0] || p[1] < low[1] || p[1] > high[1] || p[2] < low[2] || p[2] > high[2])
      continue;
    for (int k = 0; k < 3; ++k) lo[k] = std::min(lo[k], p[k]), hi[k] = std::max(hi[k], p[k]);
    vertices.add(p[0], p[1], p[2], 0, v);
  }
  if (vertices.count == 0) return false;
  Stretch& triangles = scratch.triangles;
  const std::uint32_t begin = spheres_begin_[target], count = spheres_begin_[target + 1] - begin;
  triangles.start(count);
  const auto beyond = [](const Floats& c, float l, float h) {
    return stdx::max(stdx::max(l - c, c - h), Floats(0));
  };
  for (std::uint32_t t = 0; t < count; t += width) {
    const std::size_t g = begin + t;
    const Floats dx = beyond(hemowalk::load<float, 16>(&gx_[g]), lo[0], hi[0]),
                 dy = beyond(hemowalk::load<float, 16>(&gy_[g]), lo[1], hi[1]),
                 dz = beyond(hemowalk::load<float, 16>(&gz_[g]), lo[2], hi[2]),
                 r = hemowalk::load<float, 16>(&gr_[g]);
    auto close = dx * dx + dy * dy + dz * dz <= r * r;
    while (stdx::any_of(close)) {
      const auto lane = static_cast<std::uint32_t>(stdx::find_first_set(close));
      close[lane] = false;
      if (t + lane < count)
        triangles.add(gx_[g + lane], gy_[g + lane], gz_[g + lane], gr_[g + lane], t + lane);
    }
  }
  triangles.pad();
  return triangles.count > 0;
}

/// The selected triangles within reach + skin of a vertex at p.
template <class Real>
void Neighbours<Real>::find_hits(const Cloud<Real>& cloud, std::uint32_t target, const Point<Real>& p,
                                 std::size_t vertex, Scratch& scratch) const {
  scratch.hits.clear();
  for (auto& c : scratch.corner) c.clear();
  const Point<Real>* x = cloud.x.data() + cloud.first[target];
  const Topology& shape = shapes_[cloud.bodies[target].shape];
  const float px = scratch.vertices.x[vertex], py = scratch.vertices.y[vertex],
              pz = scratch.vertices.z[vertex];
  const Stretch& s = scratch.triangles;
  for (std::size_t i = 0; i < s.count; i += width) {
    const Floats dx = hemowalk::load<float, 16>(&s.x[i]) - px, dy = hemowalk::load<float, 16>(&s.y[i]) - py,
                 dz = hemowalk::load<float, 16>(&s.z[i]) - pz, r = hemowalk::load<float, 16>(&s.r[i]);
    auto close = dx * dx + dy * dy + dz * dz <= r * r;
    while (stdx::any_of(close)) {
      const auto lane = static_cast<std::size_t>(stdx::find_first_set(close));
      close[lane] = false;
      const std::uint32_t t = s.number[i + lane];
      scratch.hits.push_back({t, 0});
      for (int k = 0; k < 3; ++k) {
        const Point<Real> c = x[shape.triangles[t][k]] - p;
        scratch.corner[3 * k].push_back(static_cast<float>(c.x));
        scratch.corner[3 * k + 1].push_back(static_cast<float>(c.y));
        scratch.corner[3 * k + 2].push_back(static_cast<float>(c.z));
      }
    }
  }
  if (!scratch.hits.empty()) measure_hits(scratch);
}

/// Exact distances for the hits, 16 at a time; those out of reach are dropped.
template <class Real>
void Neighbours<Real>::measure_hits(Scratch& scratch) const {
  using P = Pack<float, 16>;
  auto& hits = scratch.hits;
  const std::size_t count = hits.size(), padded = (count + 15) / 16 * 16;
  for (auto& c : scratch.corner) c.resize(padded);
  const auto limit = static_cast<float>(reach_ + skin_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; i += 16) {
    Point<P> x[3];
    for (int k = 0; k < 3; ++k)
      x[k] = {hemowalk::load<float, 16>(&scratch.corner[3 * k][i]),
              hemowalk::load<float, 16>(&scratch.corner[3 * k + 1][i]),
              hemowalk::load<float, 16>(&scratch.corner[3 * k + 2][i])};
    alignas(64) float distance[16];
    const P zero(0);
    store<float, 16>(stdx::sqrt(nearest_on_triangle(Point<P>{zero, zero, zero}, x[0], x[1], x[2]).squared),
                     distance);
    for (std::size_t j = i; j < std::min(i + 16, count); ++j) {
      hits[kept] = hits[j];
      hits[kept].distance = distance[j - i] - static_cast<float>(rounding);
      kept += distance[j - i] <= limit;
    }
  }
  hits.resize(kept);
}

/// Turns the hits of a vertex into an entry.
template <class Real>
void Neighbours<Real>::take_entry(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t target,
                                  const Point<Real>& p, std::uint32_t vertex, Scratch& scratch) {
  auto& hits = scratch.hits;
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.triangle < b.triangle;
  });
  const Hit best = hits.front();
  const Topology& shape = shapes_[cloud.bodies[target].shape];
  const Point<Real>* x = cloud.x.data() + cloud.first[target];
  const Corners& c = shape.triangles[best.triangle];
  const auto q = nearest_on_triangle(p, x[c[0]], x[c[1]], x[c[2]]);
  const bool outside = dot(q.to_point, pseudo_normal(shape, x, best.triangle, q.wb, q.wc)) >= 0;
  if (best.distance > (outside ? law_.range : law_.depth) + skin_) return;
  Neighbourhood<Real>& near = near_[body];
  const auto first = static_cast<std::uint32_t>(near.candidates.size());
  for (const Hit& hit : hits) {
    // A triangle farther by two skins cannot become the nearest before the next search.
    if (hit.distance > best.distance + 2 * skin_) break;
    near.candidates.push_back({hit.triangle, hit.distance});
  }
  near.entries.push_back({vertex, first, static_cast<std::uint32_t>(near.candidates.size()) - first,
                          outside ? best.distance : -best.distance});
}

template <class Real>
void Neighbours<Real>::collect_incoming(std::size_t bodies) {
  incoming_begin_.assign(bodies + 1, 0);
  for (const auto& near : near_)
    for (const Link& link : near.links) ++incoming_begin_[link.target + 1];
  for (std::size_t b = 0; b < bodies; ++b) incoming_begin_[b + 1] += incoming_begin_[b];
  incoming_.resize(incoming_begin_[bodies]);
  for (std::uint32_t b = 0; b < bodies; ++b)
    for (std::uint32_t l = 0; l < near_[b].links.size(); ++l)
      incoming_[incoming_begin_[near_[b].links[l].target]++] = {b, l};
  for (std::size_t b = bodies; b > 0; --b) incoming_begin_[b] = incoming_begin_[b - 1];
  incoming_begin_[0] = 0;
}

template <class Real>
std::vector<std::byte> Neighbours<Real>::save() const {
  std::vector<std::byte> out;
  if (!valid_) return out;
  const std::size_t origins = reference_origin_.size() * sizeof(Origin),
                    points = reference_.size() * sizeof(Point<Real>);
  out.resize(origins + points);
  std::memcpy(out.data(), reference_origin_.data(), origins);
  std::memcpy(out.data() + origins, reference_.data(), points);
  return out;
}

template <class Real>
void Neighbours<Real>::restore(View<const std::byte> state, Cloud<Real>& cloud) {
  valid_ = false;
  if (state.size == 0) return;
  const std::size_t origins = cloud.origin.size() * sizeof(Origin),
                    points = cloud.x.size() * sizeof(Point<Real>);
  require(state.size == origins + points,
          "the saved contact state does not fit (other bodies) use the scene it was made with");
  std::memcpy(static_cast<void*>(cloud.origin.data()), state.data, origins);
  std::memcpy(static_cast<void*>(cloud.x.data()), state.data + origins, points);
  search(cloud);
  valid_ = true;
}

template class Neighbours<float>;
template class Neighbours<double>;

}  // namespace hemowalk::contact
