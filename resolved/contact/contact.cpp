#include "resolved/contact/contact.hpp"

#include <string>

#include "core/check.hpp"
#include "core/simd.hpp"
#include "resolved/contact/geometry.hpp"
#include "resolved/contact/law.hpp"
#include "resolved/contact/neighbours.hpp"
#include "resolved/contact/topology.hpp"
#include "resolved/contact/walls.hpp"

namespace hemowalk::contact {

namespace {

void check(const Law& law, const Domain& domain) {
  require(law.range > 0 && law.stiffness >= 0 && law.depth >= 0 && law.skin > 0,
          "contact: range and skin must be positive, stiffness and depth not negative (range " +
              std::to_string(law.range) + " dx, stiffness " + std::to_string(law.stiffness) +
              ") correct the contact section");
  for (const double period : domain.period)
    require(period >= 0, "contact: period " + std::to_string(period) +
                             " dx (it must be positive, or 0 for none) correct it");
}

std::vector<Topology> topologies(const std::vector<Shape>& shapes) {
  std::vector<Topology> result;
  for (const Shape& shape : shapes) result.emplace_back(shape);
  return result;
}

/// What one body adds to the sums; kept per body so that the order of summation is fixed.
struct Share {
  double minimum_gap, minimum_wall_gap, energy;
  std::int64_t contacts, wall_contacts;
  std::array<double, 6> virial;
  std::array<std::array<double, 3>, 2> wall_force;
};
constexpr Share nothing{
    std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 0, 0, 0, {}, {}};

void add(Summary& sum, const Share& share) {
  sum.minimum_gap = std::min(sum.minimum_gap, share.minimum_gap);
  sum.minimum_wall_gap = std::min(sum.minimum_wall_gap, share.minimum_wall_gap);
  sum.energy += share.energy;
  sum.contacts += share.contacts;
  sum.wall_contacts += share.wall_contacts;
  for (int k = 0; k < 6; ++k) sum.virial[k] += share.virial[k];
  for (int w = 0; w < 2; ++w)
    for (int k = 0; k < 3; ++k) sum.wall_force[w][k] += share.wall_force[w][k];
}

}  // namespace

template <class Real>
struct Contact<Real>::State {
  Law law;
  Domain domain;
  std::vector<Topology> shapes;
  Cloud<Real> cloud;
  std::vector<Point<Real>> force;  ///< in the order of cloud.x
  std::vector<Share> share;
  Neighbours<Real> neighbours;

  State(const Law& law_, const Domain& domain_, const std::vector<Shape>& shapes_)
      : law(law_), domain(domain_), shapes(topologies(shapes_)), neighbours(law, domain, shapes) {}

  void gather(View<const Origin> origin, View<const Node4<Real>> local);
  void press_walls(std::size_t body);
  void press_bodies(std::size_t body);
  bool nearest(const Neighbourhood<Real>& near, const Entry& entry, const Link& link, const Point<Real>& p,
               Real approached, Nearest<Real>& best, std::uint32_t& triangle) const;
  void react(std::size_t body);
  void scatter(std::size_t body, View<Node4<Real>> out) const;
};

template <class Real>
void Contact<Real>::State::gather(View<const Origin> origin, View<const Node4<Real>> local) {
  const auto bodies = static_cast<std::ptrdiff_t>(cloud.bodies.size());
  std::ptrdiff_t bad = bodies;
#pragma omp parallel for schedule(static) reduction(min : bad)
  for (std::ptrdiff_t b = 0; b < bodies; ++b) {
    const Body& body = cloud.bodies[b];
    cloud.origin[b] = origin[b];
    std::size_t m = body.first;
    Real sum = 0;
    for (std::uint32_t i = cloud.first[b]; i < cloud.first[b + 1]; ++i, m += body.stride) {
      const Node4<Real>& p = local[m];
      cloud.x[i] = {p.x, p.y, p.z};
      sum += p.x + p.y + p.z;
    }
    if (!std::isfinite(sum)) bad = std::min(bad, b);
  }
  if (bad < bodies)
    throw PhysicsError(
        "contact: body " + std::to_string(bad) +
        " has a position that is not finite (the run blew up) use a smaller acceleration or more "
        "solid iterations");
}

/// Forces of the walls; also what clears the body's forces and share.
template <class Real>
void Contact<Real>::State::press_walls(std::size_t b) {
  Share& s = share[b] = nothing;
  const std::vector<double>& area = shapes[cloud.bodies[b].shape].area;
  const Point<Real>* x = cloud.x.data() + cloud.first[b];
  Point<Real>* f = force.data() + cloud.first[b];
  const std::size_t n = cloud.vertices(b);
  std::fill(f, f + n, Point<Real>{0, 0, 0});
  if (domain.walls.geometry == Walls::Geometry::none || !cloud.bodies[b].owned) return;
  if (domain.walls.geometry == Walls::Geometry::slab &&
      !neighbours.beyond(b, domain.walls.lower + law.range, domain.walls.upper - law.range))
    return;
  const WallGaps<Real> walls(domain.walls, cloud.origin[b]);
  for (std::size_t v = 0; v < n; ++v) {
    const WallGap<Real> nearest = walls(x[v]);
    s.minimum_wall_gap = std::min(s.minimum_wall_gap, double(nearest.gap));
    if (nearest.gap >= Real(law.range)) continue;
    const Potential<Real> potential{Real(law.range), Real(law.stiffness * area[v])};
    f[v] = potential.force(nearest.gap) * nearest.normal;
    s.energy += potential.energy(nearest.gap);
    ++s.wall_contacts;
    const double push[3] = {double(f[v].x), double(f[v].y), double(f[v].z)};
    for (int k = 0; k < 3; ++k) s.wall_force[nearest.wall][k] -= push[k];
  }
}

/// The nearest candidate, if any can press. Candidates come in order of their distance at the search; once
/// that, less what the bodies may have approached since, exceeds the best so far, none of the rest can win.
/// Of equals the lowest number wins: the outcome does not depend on when the list was made, so a restart is
/// exact.
template <class Real>
bool Contact<Real>::State::nearest(const Neighbourhood<Real>& near, const Entry& entry, const Link& link,
                                   const Point<Real>& p, Real approached, Nearest<Real>& best,
                                   std::uint32_t& triangle) const {
  constexpr std::size_t width = 8;
  using P = Pack<Real, width>;
  const Topology& shape = shapes[cloud.bodies[link.target].shape];
  const Point<Real>* x = cloud.x.data() + cloud.first[link.target];
  const Point<P> point{P(p.x), P(p.y), P(p.z)};
  Real limit = Real(std::max(law.range, law.depth));
  best.squared = limit * limit;
  triangle = ~0u;
  const Candidate* c = near.candidates.data() + entry.candidates;
  for (const Candidate* end = c + entry.count; c < end && c->distance - approached <= limit; c += width) {
    alignas(64) Real corner[9][width];
    const std::size_t count = std::min<std::size_t>(width, static_cast<std::size_t>(end - c));
    for (std::size_t l = 0; l < width; ++l) {
      const Corners& corners = shape.triangles[c[std::min(l, count - 1)].triangle];
      for (int k = 0; k < 3; ++k) {
        const Point<Real>& v = x[corners[k]];
        corner[3 * k][l] = v.x, corner[3 * k + 1][l] = v.y, corner[3 * k + 2][l] = v.z;
      }
    }
    Point<P> v[3];
    for (int k = 0; k < 3; ++k)
      v[k] = {hemowalk::load<Real, width>(corner[3 * k]), hemowalk::load<Real, width>(corner[3 * k + 1]),
              hemowalk::load<Real, width>(corner[3 * k + 2])};
    const Nearest<P> n = nearest_on_triangle(point, v[0], v[1], v[2]);
    if (stdx::hmin(n.squared) > best.squared) continue;
    for (std::size_t l = 0; l < count; ++l) {
      const Real squared = n.squared[l];
      if (squared > best.squared || (squared == best.squared && c[l].triangle > triangle)) continue;
      best = {n.wb[l], n.wc[l], {n.to_point.x[l], n.to_point.y[l], n.to_point.z[l]}, squared};
      triangle = c[l].triangle;
    }
    limit = std::sqrt(best.squared);
  }
  return triangle != ~0u;
}

/// Forces on the body's vertices from the surfaces they are near to; the reactions are remembered.
template <class Real>
void Contact<Real>::State::press_bodies(std::size_t b) {
  Neighbourhood<Real>& near = neighbours.of()[b];
  const std::vector<Motion>& motions = neighbours.motions();
  const std::vector<double>& area = shapes[cloud.bodies[b].shape].area;
  const Point<Real>* x = cloud.x.data() + cloud.first[b];
  Point<Real>* f = force.data() + cloud.first[b];
  Share& s = share[b];
  const bool owned = cloud.bodies[b].owned;
  const Real tiny = sizeof(Real) == 4 ? Real(1e-4) : Real(1e-9);
  near.presses.clear();
  for (Link& link : near.links) {
    link.presses_begin = static_cast<std::uint32_t>(near.presses.size());
    const Real pair_approached = Real(approach(motions[b], motions[link.target]) + 1e-5);
    const Motion& away = motions[link.target];
    const Point<Real> shift = neighbours.shift(cloud, static_cast<std::uint32_t>(b), link.target, link.wraps);
    const Topology& shape = shapes[cloud.bodies[link.target].shape];
    const Point<Real>* target = cloud.x.data() + cloud.first[link.target];
    for (std::uint32_t e = link.entries_begin; e < link.entries_end; ++e) {
      const Entry& entry = near.entries[e];
      if (entry.gap - pair_approached >= Real(law.range)) continue;
      const Real approached =
          std::min(pair_approached, Real(neighbours.moved(cloud, b, entry.vertex, away) + 1e-5));
      if (entry.gap - approached >= Real(law.range)) continue;
      Nearest<Real> q;
      std::uint32_t t = 0;
      if (!nearest(near, entry, link, x[entry.vertex] - shift, approached, q, t)) continue;
      const Real distance = std::sqrt(q.squared);
      // The side cannot have changed unless the bodies moved by more than the gap.
      Real side = entry.gap >= 0 ? Real(1) : Real(-1);
      if (std::abs(entry.gap) <= approached || distance < tiny) {
        const Point<Real> n = pseudo_normal(shape, target, t, q.wb, q.wc);
        side = dot(q.to_point, n) >= 0 ? Real(1) : Real(-1);
        if (distance < tiny) q.to_point = (side * distance / std::sqrt(dot(n, n))) * n;
      }
      const Real gap = side * distance;
      if (gap >= Real(law.range) || gap < -Real(law.depth)) continue;
      s.minimum_gap = std::min(s.minimum_gap, double(gap));
      if (owned) ++s.contacts;
      const Potential<Real> potential{Real(law.range), Real(0.5 * law.stiffness * area[entry.vertex])};
      Point<Real> normal = distance > 0 ? (side / distance) * q.to_point : Point<Real>{0, 0, 0};
      if (!(distance > 0)) {
        const Point<Real> n = pseudo_normal(shape, target, t, q.wb, q.wc);
        normal = (Real(1) / std::sqrt(dot(n, n))) * n;
      }
      const Point<Real> push = potential.force(gap) * normal;
      f[entry.vertex] = f[entry.vertex] + push;
      near.presses.push_back({t, q.wb, q.wc, push});
      if (!owned) continue;
      s.energy += potential.energy(gap);
      const Point<Real>& r = q.to_point;
      const Real pairs[6] = {r.x * push.x, r.y * push.y, r.z * push.z,
                             r.x * push.y, r.x * push.z, r.y * push.z};
      for (int k = 0; k < 6; ++k) s.virial[k] += pairs[k];
    }
    link.presses_end = static_cast<std::uint32_t>(near.presses.size());
  }
}

/// Adds the reactions of everybody who presses on this body, in the order of the pressing bodies.
template <class Real>
void Contact<Real>::State::react(std::size_t b) {
  const Topology& shape = shapes[cloud.bodies[b].shape];
  Point<Real>* f = force.data() + cloud.first[b];
  for (std::uint32_t i = neighbours.incoming_begin()[b]; i < neighbours.incoming_begin()[b + 1]; ++i) {
    const Incoming& from = neighbours.incoming()[i];
    const Neighbourhood<Real>& near = neighbours.of()[from.body];
    const Link& link = near.links[from.link];
    for (std::uint32_t p = link.presses_begin; p < link.presses_end; ++p) {
      const Press<Real>& press = near.presses[p];
      const Corners& c = shape.triangles[press.triangle];
      f[c[0]] = f[c[0]] - (Real(1) - press.wb - press.wc) * press.force;
      f[c[1]] = f[c[1]] - press.wb * press.force;
      f[c[2]] = f[c[2]] - press.wc * press.force;
    }
  }
}

template <class Real>
void Contact<Real>::State::scatter(std::size_t b, View<Node4<Real>> out) const {
  const Body& body = cloud.bodies[b];
  std::size_t m = body.first;
  for (std::uint32_t i = cloud.first[b]; i < cloud.first[b + 1]; ++i, m += body.stride)
    out[m] = {force[i].x, force[i].y, force[i].z, Real(0)};
}

template <class Real>
Contact<Real>::Contact(const Law& law, const Domain& domain, std::vector<Shape> shapes) {
  check(law, domain);
  state_ = std::make_unique<State>(law, domain, shapes);
}
template <class Real>
Contact<Real>::~Contact() = default;
template <class Real>
Contact<Real>::Contact(Contact&&) noexcept = default;
template <class Real>
Contact<Real>& Contact<Real>::operator=(Contact&&) noexcept = default;

template <class Real>
void Contact<Real>::set_bodies(std::vector<Body> bodies) {
  State& s = *state_;
  s.cloud.first.assign(1, 0);
  for (const Body& body : bodies) {
    require(body.shape < s.shapes.size(), "contact: body of unknown shape (" + std::to_string(body.shape) +
                                              ") give a shape for every kind of cell");
    s.cloud.first.push_back(s.cloud.first.back() +
                            static_cast<std::uint32_t>(s.shapes[body.shape].vertices()));
  }
  s.cloud.bodies = std::move(bodies);
  s.cloud.origin.resize(s.cloud.bodies.size());
  s.cloud.x.resize(s.cloud.first.back());
  s.force.resize(s.cloud.first.back());
  s.share.resize(s.cloud.bodies.size());
  s.neighbours.reset();
}

template <class Real>
void Contact<Real>::set_domain(const Domain& domain) {
  check(state_->law, domain);
  state_->domain = domain;
  state_->neighbours.set_domain(domain);
}

template <class Real>
Summary Contact<Real>::compute(View<const Origin> origin, View<const Node4<Real>> local,
                               View<Node4<Real>> force) {
  State& s = *state_;
  const auto bodies = static_cast<std::ptrdiff_t>(s.cloud.bodies.size());
  Summary sum;
  if (bodies == 0) return sum;
  s.gather(origin, local);
  s.neighbours.update(s.cloud);
#pragma omp parallel
  {
#pragma omp for schedule(dynamic, 4)
    for (std::ptrdiff_t b = 0; b < bodies; ++b) {
      s.press_walls(static_cast<std::size_t>(b));
      s.press_bodies(static_cast<std::size_t>(b));
    }
#pragma omp for schedule(dynamic, 4)
    for (std::ptrdiff_t b = 0; b < bodies; ++b) {
      s.react(static_cast<std::size_t>(b));
      s.scatter(static_cast<std::size_t>(b), force);
    }
  }
  for (const Share& share : s.share) add(sum, share);
  return sum;
}

template <class Real>
std::vector<std::byte> Contact<Real>::save() const {
  return state_->neighbours.save();
}

template <class Real>
void Contact<Real>::load(View<const std::byte> state) {
  state_->neighbours.restore(state, state_->cloud);
}

template <class Real>
std::int64_t Contact<Real>::searches() const {
  return state_->neighbours.searches();
}

template class Contact<float>;
template class Contact<double>;

}  // namespace hemowalk::contact
