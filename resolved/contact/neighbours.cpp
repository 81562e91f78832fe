#include "resolved/contact/neighbours.hpp"

#include <omp.h>

#include <string>

#include "core/check.hpp"
#include "core/simd.hpp"

namespace hemowalk::contact {

namespace {

/// Half the difference between single and exact coordinates in the largest boxes, dx; added to search radii.
constexpr double slack = 1e-3;
/// Distances in the lists are in single precision; this much is taken off, so that they never exceed the true
/// ones.
constexpr double rounding = 1e-5;

std::uint64_t key_of(std::uint32_t target, const std::array<std::int32_t, 3>& wraps) {
  std::uint64_t key = target;
  for (int k = 0; k < 3; ++k) key = key << 8 | static_cast<std::uint64_t>(wraps[k] + 128);
  return key;
}
std::uint32_t target_of(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 24); }
std::array<std::int32_t, 3> wraps_of(std::uint64_t key) {
  std::array<std::int32_t, 3> wraps;
  for (int k = 0; k < 3; ++k) wraps[k] = static_cast<std::int32_t>(key >> (8 * (2 - k)) & 255) - 128;
  return wraps;
}

}  // namespace

template <class Real>
void Neighbours<Real>::update(const Cloud<Real>& cloud) {
  if (valid_ && holds(cloud)) return;
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
void Neighbours<Real>::search(const Cloud<Real>& cloud) {
  const std::size_t bodies = cloud.bodies.size();
  reference_ = cloud.x;
  reference_origin_ = cloud.origin;
  motions_.assign(bodies, Motion{{0, 0, 0}, 0});
  near_.resize(bodies);
  scratch_.resize(static_cast<std::size_t>(omp_get_max_threads()));
  pair_bodies(cloud);
  sort_triangles(cloud);
#pragma omp parallel for schedule(dynamic, 4)
  for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bodies); ++b)
    look_around(cloud, static_cast<std::uint32_t>(b),
                scratch_[static_cast<std::size_t>(omp_get_thread_num())]);
  collect_incoming(bodies);
}

/// Bounding boxes, and the pairs of bodies that are close enough to be watched.
template <class Real>
void Neighbours<Real>::pair_bodies(const Cloud<Real>& cloud) {
  const std::size_t bodies = cloud.bodies.size();
  centre_.resize(bodies);
  half_.resize(bodies);
  body_slots_.resize(bodies);
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  double largest = 0;
  for (std::size_t b = 0; b < bodies; ++b) {
    Point<Real> lo = cloud.x[cloud.first[b]], hi = lo;
    for (std::uint32_t i = cloud.first[b]; i < cloud.first[b + 1]; ++i) {
      const Point<Real>& d = cloud.x[i];
      lo = {std::min(lo.x, d.x), std::min(lo.y, d.y), std::min(lo.z, d.z)};
      hi = {std::max(hi.x, d.x), std::max(hi.y, d.y), std::max(hi.z, d.z)};
    }
    const std::array<double, 3> l{double(lo.x), double(lo.y), double(lo.z)},
        h{double(hi.x), double(hi.y), double(hi.z)};
    for (int k = 0; k < 3; ++k) {
      centre_[b][k] = cloud.origin[b][k] + (l[k] + h[k]) / 2;
      half_[b][k] = (h[k] - l[k]) / 2;
      largest = std::max(largest, half_[b][k]);
      low[k] = std::min(low[k], centre_[b][k]);
      high[k] = std::max(high[k], centre_[b][k]);
    }
  }
  const double limit = reach_ + skin_ + far_;
  body_grid_.shape(low, high, domain_.period, 2 * largest + limit, 8 * bodies);
  for (std::size_t b = 0; b < bodies; ++b) {
    std::array<double, 3> c = centre_[b];
    body_slots_[b] = body_grid_.locate(c);
  }
  body_grid_.sort(body_slots_, bodies);
  watched_.clear();
  seen_.assign(bodies, ~0u);
  for (std::uint32_t a = 0; a < bodies; ++a)
    body_grid_.around(body_slots_[a].cell, [&](std::uint32_t begin, std::uint32_t end, const auto&) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t b = body_grid_.order()[i];
        if (b <= a || seen_[b] == a) continue;
        double squared = 0;
        for (int k = 0; k < 3; ++k) {
          double d = centre_[a][k] - centre_[b][k];
          if (domain_.period[k] > 0) d -= domain_.period[k] * std::round(d / domain_.period[k]);
          const double gap = std::max(0.0, std::abs(d) - half_[a][k] - half_[b][k]);
          squared += gap * gap;
        }
        if (squared > limit * limit) continue;
        seen_[b] = a;
        watched_.push_back({a, b});
      }
    });
  meets_itself_.assign(bodies, 0);
  for (std::uint32_t a = 0; a < bodies; ++a)
    for (int k = 0; k < 3; ++k)
      if (domain_.period[k] > 0 && domain_.period[k] - 2 * half_[a][k] < limit) {
        watched_.push_back({a, a});
        meets_itself_[a] = true;
        break;
      }
}

template <class Real>
void Neighbours<Real>::sort_triangles(const Cloud<Real>& cloud) {
  const std::size_t bodies = cloud.bodies.size();
  triangles_begin_.resize(bodies + 1);
  for (std::size_t b = 0; b < bodies; ++b)
    triangles_begin_[b + 1] =
        triangles_begin_[b] + static_cast<std::uint32_t>(shapes_[cloud.bodies[b].shape].triangles.size());
  const std::size_t count = triangles_begin_[bodies];
  slots_.resize(count);
  radius_.resize(count);
  constexpr std::size_t pad = 16;  // lets packs read past the end
  for (auto* a : {&cx_, &cy_, &cz_, &cr_, &cmark_}) a->resize(count + pad);
  cbody_.resize(count + pad);
  ctriangle_.resize(count + pad);
  cwraps_.resize(count + pad);

  // Radii first: the largest sets the cells.
  float largest = 0;
#pragma omp parallel for schedule(static) reduction(max : largest)
  for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bodies); ++b) {
    const Point<Real>* x = cloud.x.data() + cloud.first[b];
    std::uint32_t i = triangles_begin_[b];
    for (const Corners& c : shapes_[cloud.bodies[b].shape].triangles) {
      const Point<Real> g = Real(1.0 / 3) * (x[c[0]] + x[c[1]] + x[c[2]]);
      Real squared = 0;
      for (const std::uint32_t v : c) squared = std::max(squared, dot(x[v] - g, x[v] - g));
      radius_[i] = static_cast<float>(std::sqrt(squared) + reach_ + skin_ + slack);
      largest = std::max(largest, radius_[i++]);
    }
  }
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  for (std::size_t b = 0; b < bodies; ++b)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centre_[b][k] - half_[b][k]);
      high[k] = std::max(high[k], centre_[b][k] + half_[b][k]);
    }
  for (int k = 0; k < 3; ++k)
    require(domain_.period[k] <= 0 || domain_.period[k] >= largest, [&] {
      return "contact: period " + std::to_string(domain_.period[k]) + " dx is below the search radius " +
             std::to_string(largest) +
             " dx (a body would meet itself twice) use a larger box or finer meshes";
    });
  grid_.shape(low, high, domain_.period, largest, count);
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bodies); ++b) {
    const Point<Real>* x = cloud.x.data() + cloud.first[b];
    std::uint32_t i = triangles_begin_[b];
    for (const Corners& c : shapes_[cloud.bodies[b].shape].triangles) {
      const Point<Real> g = Real(1.0 / 3) * (x[c[0]] + x[c[1]] + x[c[2]]);
      std::array<double, 3> at{cloud.origin[b][0] + double(g.x), cloud.origin[b][1] + double(g.y),
                               cloud.origin[b][2] + double(g.z)};
      slots_[i++] = grid_.locate(at);
    }
  }
  grid_.sort(slots_, count);
  // In cell order, with coordinates in the box.
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bodies); ++b)
    for (std::uint32_t i = triangles_begin_[b]; i < triangles_begin_[b + 1]; ++i)
      slots_[i].cell = static_cast<std::uint32_t>(b);
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t s = 0; s < static_cast<std::ptrdiff_t>(count); ++s) {
    const std::uint32_t i = grid_.order()[s], b = slots_[i].cell, t = i - triangles_begin_[b];
    const Point<Real>* x = cloud.x.data() + cloud.first[b];
    const Corners& c = shapes_[cloud.bodies[b].shape].triangles[t];
    const Point<Real> g = Real(1.0 / 3) * (x[c[0]] + x[c[1]] + x[c[2]]);
    const double at[3] = {double(g.x), double(g.y), double(g.z)};
    float boxed[3];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t wraps = slots_[i].wraps[k];
      boxed[k] = static_cast<float>(cloud.origin[b][k] + at[k] - wraps * domain_.period[k]);
      cwraps_[s][k] = static_cast<std::int8_t>(wraps - body_slots_[b].wraps[k]);
    }
    cx_[s] = boxed[0], cy_[s] = boxed[1], cz_[s] = boxed[2];
    cr_[s] = radius_[i];
    cbody_[s] = b;
    cmark_[s] = static_cast<float>(b);
    ctriangle_[s] = t;
  }
}

template <class Real>
Point<Real> Neighbours<Real>::shift(const Cloud<Real>& cloud, std::uint32_t from, std::uint32_t to,
                                    const std::array<std::int32_t, 3>& wraps) const {
  Real s[3];
  for (int k = 0; k < 3; ++k)
    s[k] = static_cast<Real>(cloud.origin[to][k] - cloud.origin[from][k] + wraps[k] * domain_.period[k]);
  return {s[0], s[1], s[2]};
}

/// Keys name images relative to where the bodies' centres fell in the box; this is what the caller's
/// coordinates need.
template <class Real>
std::array<std::int32_t, 3> Neighbours<Real>::absolute(std::uint32_t from, std::uint64_t key) const {
  std::array<std::int32_t, 3> wraps = wraps_of(key);
  for (int k = 0; k < 3; ++k) wraps[k] += body_slots_[from].wraps[k] - body_slots_[target_of(key)].wraps[k];
  return wraps;
}

template <class Real>
void Neighbours<Real>::look_around(const Cloud<Real>& cloud, std::uint32_t body, Scratch& scratch) {
  Neighbourhood<Real>& near = near_[body];
  near.links.clear();
  near.entries.clear();
  near.candidates.clear();
  near.presses.clear();
  scratch.found.clear();
  scratch.candidates.clear();
  for (std::uint32_t v = 0; v < cloud.vertices(body); ++v) {
    find_triangles(cloud, body, v, scratch);
    if (!scratch.hits.empty()) take_entries(cloud, body, v, scratch);
  }
  link_up(body, scratch);
}

/// All triangles of other bodies, or of other images of this one, within reach + skin of a vertex.
template <class Real>
void Neighbours<Real>::find_triangles(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t vertex,
                                      Scratch& scratch) {
  scratch.hits.clear();
  for (auto& c : scratch.corner) c.clear();
  const Point<Real> p = cloud.x[cloud.first[body] + vertex];
  std::array<double, 3> at{cloud.origin[body][0] + double(p.x), cloud.origin[body][1] + double(p.y),
                           cloud.origin[body][2] + double(p.z)};
  const Slot slot = grid_.locate(at);
  const bool owned = cloud.bodies[body].owned;
  const float mine = meets_itself_[body] ? -1.0f : static_cast<float>(body);
  using P = Pack<float, 16>;
  grid_.around(slot.cell, [&](std::uint32_t begin, std::uint32_t end,
                              const std::array<std::int32_t, 3>& wraps) {
    float o[3];
    for (int k = 0; k < 3; ++k) o[k] = static_cast<float>(at[k] - wraps[k] * domain_.period[k]);
    for (std::uint32_t i = begin; i < end; i += 16) {
      const P dx = load<float, 16>(&cx_[i]) - o[0], dy = load<float, 16>(&cy_[i]) - o[1],
              dz = load<float, 16>(&cz_[i]) - o[2], r = load<float, 16>(&cr_[i]);
      auto close = dx * dx + dy * dy + dz * dz < r * r && load<float, 16>(&cmark_[i]) != mine;
      while (stdx::any_of(close)) {
        const auto lane = static_cast<std::uint32_t>(stdx::find_first_set(close));
        close[lane] = false;
        const std::uint32_t j = i + lane;
        if (j >= end) break;
        const std::uint32_t other = cbody_[j];
        std::array<std::int32_t, 3> image;  // of the other body, seen from this one
        bool same = other == body;
        for (int k = 0; k < 3; ++k) {
          // Stands at boxed + wraps L; the vertex itself at boxed + slot.wraps L.
          const std::int32_t boxes = wraps[k] - cwraps_[j][k] + slot.wraps[k] - body_slots_[body].wraps[k];
          image[k] = boxes;
          same = same && boxes == 0;
        }
        if (same || (!owned && !cloud.bodies[other].owned)) continue;
        const std::uint64_t key = key_of(other, image);
        const Point<Real> q = p - shift(cloud, body, other, absolute(body, key));
        const Point<Real>* x = cloud.x.data() + cloud.first[other];
        const Corners& c = shapes_[cloud.bodies[other].shape].triangles[ctriangle_[j]];
        scratch.hits.push_back({key, ctriangle_[j], 0});
        for (int k = 0; k < 3; ++k) {
          const Point<Real> r = x[c[k]] - q;
          scratch.corner[3 * k].push_back(static_cast<float>(r.x));
          scratch.corner[3 * k + 1].push_back(static_cast<float>(r.y));
          scratch.corner[3 * k + 2].push_back(static_cast<float>(r.z));
        }
      }
    }
  });
  measure_hits(scratch);
}

/// Exact distances for the hits, 16 at a time; those out of reach are dropped.
template <class Real>
void Neighbours<Real>::measure_hits(Scratch& scratch) {
  using P = Pack<float, 16>;
  auto& hits = scratch.hits;
  const std::size_t count = hits.size(), padded = (count + 15) / 16 * 16;
  for (auto& c : scratch.corner) c.resize(padded);
  const auto limit = static_cast<float>(reach_ + skin_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; i += 16) {
    Point<P> x[3];
    for (int k = 0; k < 3; ++k)
      x[k] = {load<float, 16>(&scratch.corner[3 * k][i]), load<float, 16>(&scratch.corner[3 * k + 1][i]),
              load<float, 16>(&scratch.corner[3 * k + 2][i])};
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

/// Turns the hits of one vertex into one entry per body it is near to.
template <class Real>
void Neighbours<Real>::take_entries(const Cloud<Real>& cloud, std::uint32_t body, std::uint32_t vertex,
                                    Scratch& scratch) {
  auto& hits = scratch.hits;
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    if (a.key != b.key) return a.key < b.key;
    return a.distance != b.distance ? a.distance < b.distance : a.triangle < b.triangle;
  });
  for (std::size_t i = 0; i < hits.size();) {
    const Hit& best = hits[i];
    std::size_t end = i + 1;
    while (end < hits.size() && hits[end].key == best.key) ++end;
    const std::uint32_t target = target_of(best.key);
    const Topology& shape = shapes_[cloud.bodies[target].shape];
    const Point<Real>* x = cloud.x.data() + cloud.first[target];
    const Corners& c = shape.triangles[best.triangle];
    const Point<Real> p =
        cloud.x[cloud.first[body] + vertex] - shift(cloud, body, target, absolute(body, best.key));
    const auto q = nearest_on_triangle(p, x[c[0]], x[c[1]], x[c[2]]);
    const bool outside = dot(q.to_point, pseudo_normal(shape, x, best.triangle, q.wb, q.wc)) >= 0;
    if (best.distance <= (outside ? law_.range : law_.depth) + skin_) {
      // A triangle farther by two skins cannot become the nearest before the next search.
      std::size_t last = i;
      while (last < end && hits[last].distance <= best.distance + 2 * skin_) ++last;
      scratch.found.push_back(
          {best.key,
           {vertex, static_cast<std::uint32_t>(scratch.candidates.size()),
            static_cast<std::uint32_t>(last - i), outside ? best.distance : -best.distance}});
      for (std::size_t j = i; j < last; ++j)
        scratch.candidates.push_back({hits[j].triangle, hits[j].distance});
    }
    i = end;
  }
}

/// Orders the entries of a body by the body they look at.
template <class Real>
void Neighbours<Real>::link_up(std::uint32_t body, Scratch& scratch) {
  Neighbourhood<Real>& near = near_[body];
  std::sort(scratch.found.begin(), scratch.found.end(), [](const Found& a, const Found& b) {
    return a.key != b.key ? a.key < b.key : a.entry.vertex < b.entry.vertex;
  });
  for (const Found& f : scratch.found) {
    const auto at = static_cast<std::uint32_t>(near.entries.size());
    if (near.links.empty() || scratch.link_key != f.key) {
      scratch.link_key = f.key;
      near.links.push_back({target_of(f.key), absolute(body, f.key), at, at, 0, 0});
    }
    Entry entry = f.entry;
    entry.candidates = static_cast<std::uint32_t>(near.candidates.size());
    const auto from = scratch.candidates.begin() + f.entry.candidates;
    near.candidates.insert(near.candidates.end(), from, from + entry.count);
    near.entries.push_back(entry);
    near.links.back().entries_end = at + 1;
  }
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

template class Neighbours<float>;
template class Neighbours<double>;

}  // namespace hemowalk::contact
