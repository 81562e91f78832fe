#include "resolved/contact/kernel_contact.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/contact/walls.hpp"

namespace hemowalk::contact {

template <class Real>
KernelContact<Real>::KernelContact(const KernelLaw& law, const Domain& domain, std::vector<int> vertices)
    : law_(law), domain_(domain), vertices_(std::move(vertices)) {
  require(law.radius > 0 && law.distance > 0 && law.stiffness >= 0,
          "contact: range must be positive, stiffness not negative (range " + std::to_string(law.distance) +
              " dx, stiffness " + std::to_string(law.stiffness) + ") correct the contact section");
}

template <class Real>
void KernelContact<Real>::set_bodies(std::vector<Body> bodies) {
  bodies_ = std::move(bodies);
  first_.assign(1, 0), body_of_.clear();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const auto n = static_cast<std::uint32_t>(vertices_[bodies_[b].shape]);
    first_.push_back(first_.back() + n);
    body_of_.insert(body_of_.end(), n, static_cast<std::uint32_t>(b));
  }
  x_.resize(body_of_.size()), normal_.resize(x_.size()), slots_.resize(x_.size());
  shares_.resize(bodies_.size());
}

/// All vertices, sorted into cells as wide as the kernel's radius.
template <class Real>
void KernelContact<Real>::gather(View<const Origin> origin, View<const Node4<Real>> local,
                                 View<const Node4<Real>> normal) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::max()), high.fill(std::numeric_limits<double>::lowest());
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    for (std::uint32_t i = first_[b], m = bodies_[b].first; i < first_[b + 1]; ++i, m += bodies_[b].stride) {
      x_[i] = {origin[b][0] + double(local[m].x), origin[b][1] + double(local[m].y),
               origin[b][2] + double(local[m].z)};
      normal_[i] = {double(normal[m].x), double(normal[m].y), double(normal[m].z)};
      if (!std::isfinite(x_[i].x + x_[i].y + x_[i].z))
        throw PhysicsError("contact: body " + std::to_string(b) +
                           " has a position that is not finite (the run blew up) use a smaller acceleration");
      const double at[3] = {x_[i].x, x_[i].y, x_[i].z};
      for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], at[d]), high[d] = std::max(high[d], at[d]);
    }
  grid_.shape(low, high, domain_.period, law_.radius, 8 * x_.size());
  for (std::size_t i = 0; i < x_.size(); ++i) {
    std::array<double, 3> at{x_[i].x, x_[i].y, x_[i].z};
    slots_[i] = grid_.locate(at);
    x_[i] = {at[0], at[1], at[2]};
  }
  grid_.sort(slots_, x_.size());
}

/// Forces on the vertices of one body, each from its nearest foreign particle.
template <class Real>
void KernelContact<Real>::press(std::size_t b, Summary& share, View<Node4<Real>> force) const {
  const auto& order = grid_.order();
  const WallGaps<double> walls(domain_.walls, {0, 0, 0});
  for (std::uint32_t i = first_[b], m = bodies_[b].first; i < first_[b + 1]; ++i, m += bodies_[b].stride) {
    const Point<double> x = x_[i];
    double nearest = law_.radius * law_.radius;
    int wall = -1;
    Point<double> away{}, n{};  // from the neighbour to x, and the neighbour's normal
    bool found = false;
    grid_.around(slots_[i].cell, [&](std::size_t begin, std::size_t end, const auto& wraps) {
      for (std::size_t at = begin; at < end; ++at) {
        const std::uint32_t j = order[at];
        if (body_of_[j] == b) continue;
        const Point<double> shift{wraps[0] * domain_.period[0], wraps[1] * domain_.period[1],
                                  wraps[2] * domain_.period[2]};
        const Point<double> d = x - (x_[j] + shift);
        const double squared = dot(d, d);
        if (squared >= nearest) continue;
        nearest = squared, away = d, n = normal_[j], found = true;
      }
    });
    if (found) share.minimum_gap = std::min(share.minimum_gap, dot(away, n));
    if (domain_.walls.geometry != Walls::Geometry::none) {
      const WallGap<double> gap = walls(x);
      share.minimum_wall_gap = std::min(share.minimum_wall_gap, gap.gap);
      if (gap.gap < 0 || gap.gap * gap.gap < nearest)
        away = gap.gap * gap.normal, n = gap.normal, wall = gap.wall, found = true;
    }
    Node4<Real>& f = force[m];
    f = {0, 0, 0, found ? Real(1) : Real(0)};
    const Point<double> pull = law_.distance * n - away;  // p - x
    if (!found || dot(pull, n) <= 0) continue;
    f.x = Real(law_.stiffness * pull.x), f.y = Real(law_.stiffness * pull.y),
    f.z = Real(law_.stiffness * pull.z);
    ++(wall < 0 ? share.contacts : share.wall_contacts);
    if (wall < 0) continue;
    const Real push[3] = {f.x, f.y, f.z};
    for (int d = 0; d < 3; ++d) share.wall_force[wall][d] -= double(push[d]);
  }
}

template <class Real>
Summary KernelContact<Real>::compute(View<const Origin> origin, View<const Node4<Real>> local,
                                     View<const Node4<Real>> normal, View<Node4<Real>> force) {
  Summary sum;
  if (bodies_.empty()) return sum;
  gather(origin, local, normal);
#pragma omp parallel for schedule(dynamic, 4)
  for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bodies_.size()); ++b) {
    shares_[b] = {};
    press(static_cast<std::size_t>(b), shares_[b], force);
  }
  for (const Summary& s : shares_) {
    sum.minimum_gap = std::min(sum.minimum_gap, s.minimum_gap);
    sum.minimum_wall_gap = std::min(sum.minimum_wall_gap, s.minimum_wall_gap);
    sum.contacts += s.contacts, sum.wall_contacts += s.wall_contacts;
    for (int w = 0; w < 2; ++w)
      for (int d = 0; d < 3; ++d) sum.wall_force[w][d] += s.wall_force[w][d];
  }
  return sum;
}

template class KernelContact<float>;
template class KernelContact<double>;

}  // namespace hemowalk::contact
