#include "resolved/copies.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/check.hpp"
#include "core/text.hpp"
#include "resolved/bytes.hpp"

namespace hemowalk::resolved {

namespace {

constexpr std::size_t aligned(std::size_t bytes) { return (bytes + 15) / 16 * 16; }
constexpr int straying = 1;  ///< nodes: the slack of the markers' sort

/// Lattice node left of a coordinate, as Markers sees it; nodes sit at i + 1/2.
template <class Real>
int node_of(std::int32_t origin, Real z) {
  return origin + static_cast<int>(std::floor(z - Real(0.5)));
}

}  // namespace

template <class Real>
Copies<Real>::Copies(const Decomposition& decomposition, double contact_range, std::vector<int> vertices,
                     MarkersOfCopies markers)
    : decomposition_(decomposition),
      block_(decomposition.block()),
      range_(contact_range),
      shared_(markers == MarkersOfCopies::shared),
      vertices_(std::move(vertices)),
      ring_(decomposition, Topic::copies),
      readings_(decomposition, Topic::readings),
      impulses_(decomposition, Topic::impulses) {}

template <class Real>
void Copies<Real>::set_bodies(std::vector<contact::Body> own, std::size_t slots) {
  bodies_ = std::move(own);
  own_ = bodies_.size(), own_slots_ = slots;
  own_body_of_.assign(slots, -1);
  for (std::size_t b = 0; b < own_; ++b)
    for (int k = 0; k < vertices_[bodies_[b].shape]; ++k)
      own_body_of_[bodies_[b].first + k * bodies_[b].stride] = static_cast<std::int32_t>(b);
  for (Neighbour& n : sides_) n.listed.clear(), n.away.clear();
  for (auto& listed : on_list_) listed.assign(own_, 0);
  anew_ = true;
  arrange();
}

/// The own markers that lie with the neighbours are theirs; the copies' markers that lie here are ours.
template <class Real>
void Copies<Real>::arrange() {
  body_of_.assign(own_body_of_.begin(), own_body_of_.end());
  for (Neighbour& n : sides_) {
    index(n);
    const std::uint8_t* away = n.away.data();
    for (const std::uint32_t b : n.listed)
      for (int k = 0; k < vertices_[bodies_[b].shape]; ++k)
        if (*away++ && !shared_) body_of_[bodies_[b].first + k * bodies_[b].stride] = -1;
  }
  bodies_.resize(own_);
  for (Neighbour& n : sides_) {
    n.first_body = bodies_.size(), n.first_slot = body_of_.size();
    const std::uint8_t* here = n.here.data();
    for (const std::uint16_t shape : n.shapes) {
      const auto body = static_cast<std::int32_t>(bodies_.size());
      bodies_.push_back({static_cast<std::uint32_t>(body_of_.size()), 1, shape, false});
      for (int k = 0; k < vertices_[shape]; ++k) body_of_.push_back(*here++ ? body : -1);
    }
  }
}

/// Own bodies at least this near to the border must be known beyond it: they may touch somebody there within
/// the next step (nobody moves by half a node), or have a marker there.
template <class Real>
double Copies<Real>::need(const Neighbour& n) const {
  const double markers = shared_ ? kernel_reach : 1;
  return range_ < 0 ? markers : std::max(markers, n.reach + range_ + 1);
}

template <class Real>
bool Copies<Real>::unlisted(Side side, View<const Extent> extents) const {
  const double limit = need(sides_[index_of(side)]);
  for (std::size_t b = 0; b < own_; ++b)
    if (!on_list_[index_of(side)][b] && depth(side, extents[b]) < limit) return true;
  return false;
}

template <class Real>
bool Copies<Real>::lists_anew(View<const Extent> extents) const {
  return anew_ || unlisted(Side::low, extents) || unlisted(Side::high, extents);
}

/// Whether a marker of a listed body is more than a node outside the block it was counted to.
template <class Real>
bool Copies<Real>::strayed(Side side, View<const ibm::Origin> origin, View<const Node4<Real>> sites) const {
  const Neighbour& n = sides_[index_of(side)];
  bool any = false;
#pragma omp parallel for schedule(static) reduction(|| : any)
  for (std::size_t i = 0; i < n.listed.size(); ++i) {
    const std::uint32_t b = n.listed[i];
    const contact::Body& body = bodies_[b];
    const std::uint8_t* away = n.away.data() + n.own.vertex[i];
    const int vertices = vertices_[body.shape], z = origin[b][2];
    int stray = 0;
    for (int k = 0; k < vertices; ++k) {
      const int node = node_of(z, sites[body.first + k * body.stride].z);
      const int inside = side == Side::low ? node : block_.nz - 1 - node;  // negative: beyond the border
      stray |= away[k] ? inside > straying - 1 : inside < -straying;
    }
    any = any || stray;
  }
  return any;
}

/// Decides what the neighbour gets. \returns as Head::lists.
template <class Real>
int Copies<Real>::choose(Side side, View<const Extent> extents, View<const ibm::Origin> origin,
                         View<const Node4<Real>> sites) {
  Neighbour& n = sides_[index_of(side)];
  std::vector<std::uint8_t>& on_list = on_list_[index_of(side)];
  const double limit = need(n);
  n.leaving = false;
  for (std::size_t b = 0; b < own_; ++b) {
    const int z = origin[b][2];
    n.leaving = n.leaving || (side == Side::low ? z < -1 : z > block_.nz);
  }
  const bool anew = anew_ || unlisted(side, extents);
  if (!anew && (shared_ || !strayed(side, origin, sites))) return 0;
  if (anew) {
    n.listed.clear();
    for (std::size_t b = 0; b < own_; ++b) {
      on_list[b] = depth(side, extents[b]) < limit + margin;
      if (on_list[b]) n.listed.push_back(static_cast<std::uint32_t>(b));
    }
  }
  n.away.clear();
  for (const std::uint32_t b : n.listed) {
    const contact::Body& body = bodies_[b];
    for (int k = 0; k < vertices_[body.shape]; ++k)
      n.away.push_back(shared_ ||
                       is_away(side, node_of(origin[b][2], sites[body.first + k * body.stride].z)));
  }
  index(n);
  return anew ? 2 : 1;
}

template <class Real>
void Copies<Real>::pack(Side side, int lists, View<const Extent> extents, View<const ibm::Origin> origin,
                        View<const Node4<Real>> vertices, View<const Node4<Real>> sites) {
  Neighbour& n = sides_[index_of(side)];
  Head head{lists,     static_cast<std::int32_t>(n.listed.size()), static_cast<std::int32_t>(n.away.size()),
            n.leaving, -std::numeric_limits<double>::infinity(),   0};
  for (std::size_t b = 0; b < own_; ++b) head.reach = std::max(head.reach, -depth(side, extents[b]));
  const std::size_t away = n.own.beyond.back();
  const std::size_t shapes = lists ? aligned(2 * n.listed.size()) + aligned(n.away.size()) : 0,
                    origins = aligned(n.listed.size() * sizeof(ibm::Origin)),
                    reals = 3 * ((range_ < 0 ? 0 : n.away.size()) + away);
  n.outgoing.resize(sizeof(Head) + shapes + origins + reals * sizeof(Real));
  std::byte* out = n.outgoing.data();
  std::memcpy(out, &head, sizeof head);
  out += sizeof head;
  if (lists) {
    for (std::size_t i = 0; i < n.listed.size(); ++i)
      std::memcpy(out + 2 * i, &bodies_[n.listed[i]].shape, 2);
    out += aligned(2 * n.listed.size());
    if (!n.away.empty()) std::memcpy(out, n.away.data(), n.away.size());
    out += aligned(n.away.size());
  }
  const std::int32_t shift = decomposition_.shift_to(side);
  for (std::size_t i = 0; i < n.listed.size(); ++i) {
    ibm::Origin o = origin[n.listed[i]];
    o[2] += shift;
    std::memcpy(out + i * sizeof o, &o, sizeof o);
  }
  auto* real = reinterpret_cast<Real*>(out + origins);
  const auto put = [](Real* to, const Node4<Real>& v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; };
  if (range_ >= 0) {
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < n.listed.size(); ++i) {
      const contact::Body& body = bodies_[n.listed[i]];
      for (int k = 0; k < vertices_[body.shape]; ++k)
        put(real + 3 * (n.own.vertex[i] + k), vertices[body.first + k * body.stride]);
    }
    real += 3 * n.away.size();
  }
  for_own(n, [&](std::size_t slot, std::size_t at) { put(real + 3 * at, sites[slot]); });
}

template <class Real>
void Copies<Real>::index(Neighbour& n) const {
  const auto count = [](Begin& begin, std::size_t bodies, const std::uint8_t* beyond,
                        const auto& vertices_of) {
    begin.vertex.assign(1, 0), begin.beyond.assign(1, 0);
    for (std::size_t i = 0; i < bodies; ++i) {
      const int vertices = vertices_of(i);
      std::uint32_t sum = 0;
      for (int k = 0; k < vertices; ++k) sum += *beyond++;
      begin.vertex.push_back(begin.vertex.back() + vertices);
      begin.beyond.push_back(begin.beyond.back() + sum);
    }
  };
  count(n.own, n.listed.size(), n.away.data(),
        [&](std::size_t i) { return vertices_[bodies_[n.listed[i]].shape]; });
  count(n.copy, n.shapes.size(), n.here.data(), [&](std::size_t i) { return vertices_[n.shapes[i]]; });
}

/// body(slot, i) for every own marker that lies with the neighbour, the i-th in the order in which both know
/// them.
template <class Real>
template <class Body>
void Copies<Real>::for_own(const Neighbour& n, const Body& body) const {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n.listed.size(); ++i) {
    const contact::Body& own = bodies_[n.listed[i]];
    const std::uint8_t* away = n.away.data() + n.own.vertex[i];
    std::size_t at = n.own.beyond[i];
    if (at == n.own.beyond[i + 1]) continue;
    for (int k = 0; k < vertices_[own.shape]; ++k)
      if (away[k]) body(own.first + k * own.stride, at++);
  }
}

/// body(slot, i) for every copied marker that lies here, the i-th likewise.
template <class Real>
template <class Body>
void Copies<Real>::for_copies(const Neighbour& n, const Body& body) const {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n.shapes.size(); ++i) {
    std::size_t at = n.copy.beyond[i];
    if (at == n.copy.beyond[i + 1]) continue;
    for (std::uint32_t m = n.copy.vertex[i]; m < n.copy.vertex[i + 1]; ++m)
      if (n.here[m]) body(n.first_slot + m, at++);
  }
}

template <class Real>
int Copies<Real>::unpack_lists(Neighbour& n) {
  Head head;
  const std::byte* in = n.incoming.data();
  std::memcpy(&head, in, sizeof head);
  in += sizeof head;
  n.reach = head.reach;
  n.arriving = head.leaving != 0;
  if (head.lists) {
    n.shapes.resize(head.bodies);
    if (head.bodies) std::memcpy(n.shapes.data(), in, 2 * n.shapes.size());
    in += aligned(2 * n.shapes.size());
    n.here.resize(head.markers);
    if (head.markers) std::memcpy(n.here.data(), in, n.here.size());
    in += aligned(n.here.size());
  }
  n.incoming_at = static_cast<std::size_t>(in - n.incoming.data());
  return head.lists;
}

template <class Real>
typename Copies<Real>::Change Copies<Real>::exchange(View<const Extent> extents,
                                                     View<const ibm::Origin> origin,
                                                     View<const Node4<Real>> vertices,
                                                     View<const Node4<Real>> sites) {
  Change change{anew_, anew_};
  if (!decomposition_.divided()) {
    anew_ = false;
    return change;
  }
  if (reach_unknown_) exchange_reach(extents);
  int lists[2];
  for (const Side side : both_sides) {
    const int s = index_of(side);
    lists[s] = choose(side, extents, origin, sites);
    pack(side, lists[s], extents, origin, vertices, sites);
    ring_.send(side, sides_[s].outgoing.data(), sides_[s].outgoing.size());
  }
  anew_ = false;
  for (const Side side : both_sides) {
    Neighbour& n = sides_[index_of(side)];
    ring_.receive(side, n.incoming);
    const int theirs = unpack_lists(n);
    change.markers = change.markers || theirs || lists[index_of(side)];
    change.bodies = change.bodies || theirs == 2;
  }
  ring_.wait();
  check_reach();
  if (change.markers) arrange();
  return change;
}

template <class Real>
void Copies<Real>::exchange_reach(View<const Extent> extents) {
  double mine[2];
  for (const Side side : both_sides) {
    double& reach = mine[index_of(side)] = -std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < own_; ++b) reach = std::max(reach, -depth(side, extents[b]));
    ring_.receive(side, &sides_[index_of(side)].reach, 1);
    ring_.send(side, &reach, 1);
  }
  ring_.wait();
  reach_unknown_ = false;
}

template <class Real>
void Copies<Real>::check_reach() const {
  const double low = sides_[0].reach, high = sides_[1].reach, most = std::max(low, high);
  const bool meet = range_ >= 0 && low + high + range_ > block_.nz;
  require(!meet && most <= block_.nz - (shared_ ? kernel_reach : 1), [&] {
    return formatted(
        "cells reach %.1f and %.1f planes into a slab of %d (they would touch beyond it, unseen by their "
        "own ranks) use fewer ranks",
        low, high, block_.nz);
  });
}

template <class Real>
void Copies<Real>::place(View<ibm::Origin> origin, View<Node4<Real>> vertices,
                         View<Node4<Real>> sites) const {
  if (!decomposition_.divided()) return;
  for (const Neighbour& n : sides_) {
    const std::byte* in = n.incoming.data() + n.incoming_at;
    if (!n.shapes.empty()) std::memcpy(&origin[n.first_body], in, n.shapes.size() * sizeof(ibm::Origin));
    const auto* real = reinterpret_cast<const Real*>(in + aligned(n.shapes.size() * sizeof(ibm::Origin)));
    if (range_ >= 0) {
#pragma omp parallel for schedule(static)
      for (std::size_t m = 0; m < n.here.size(); ++m)
        vertices[n.first_slot + m] = {real[3 * m], real[3 * m + 1], real[3 * m + 2], Real(0)};
      real += 3 * n.here.size();
    }
    for_copies(n, [&](std::size_t slot, std::size_t at) {
      sites[slot] = {real[3 * at], real[3 * at + 1], real[3 * at + 2], Real(0)};
    });
  }
}

template <class Real>
void Copies<Real>::send_readings(View<const Node4<Real>> reading) {
  if (!decomposition_.divided()) return;
  for (const Side side : both_sides) {
    Neighbour& n = sides_[index_of(side)];
    n.back.resize(3 * n.copy.beyond.back()), n.there.resize(3 * n.own.beyond.back());
    for_copies(n, [&](std::size_t slot, std::size_t at) {
      const Node4<Real>& v = reading[slot];
      n.back[3 * at] = v.x, n.back[3 * at + 1] = v.y, n.back[3 * at + 2] = v.z;
    });
    readings_.receive(side, n.there.data(), n.there.size());
    readings_.send(side, n.back.data(), n.back.size());
  }
}

template <class Real>
void Copies<Real>::receive_readings(View<Node4<Real>> reading) {
  if (!decomposition_.divided()) return;
  readings_.wait();
  for (const Neighbour& n : sides_)
    for_own(n, [&](std::size_t slot, std::size_t at) {
      const Node4<Real> v{n.there[3 * at], n.there[3 * at + 1], n.there[3 * at + 2], Real(0)};
      Node4<Real>& here = reading[slot];
      here = shared_ ? Node4<Real>{here.x + v.x, here.y + v.y, here.z + v.z, Real(0)} : v;
    });
}

template <class Real>
void Copies<Real>::send_impulses(View<const Node4<Real>> impulse) {
  if (!decomposition_.divided()) return;
  for (const Side side : both_sides) {
    Neighbour& n = sides_[index_of(side)];
    n.there.resize(3 * n.own.beyond.back()), n.back.resize(3 * n.copy.beyond.back());
    for_own(n, [&](std::size_t slot, std::size_t at) {
      const Node4<Real>& v = impulse[slot];
      n.there[3 * at] = v.x, n.there[3 * at + 1] = v.y, n.there[3 * at + 2] = v.z;
    });
    impulses_.receive(side, n.back.data(), n.back.size());
    impulses_.send(side, n.there.data(), n.there.size());
  }
}

template <class Real>
void Copies<Real>::receive_impulses(View<Node4<Real>> impulse) {
  if (!decomposition_.divided()) return;
  impulses_.wait();
  for (const Neighbour& n : sides_)
    for_copies(n, [&](std::size_t slot, std::size_t at) {
      impulse[slot] = {n.back[3 * at], n.back[3 * at + 1], n.back[3 * at + 2], Real(0)};
    });
}

template <class Real>
void Copies<Real>::gave_away(Side side, const Extent& extent) {
  double& reach = sides_[index_of(side)].reach;
  reach = std::max(reach, side == Side::low ? extent.high : block_.nz - extent.low);
}

template <class Real>
std::vector<std::byte> Copies<Real>::save() const {
  std::vector<std::byte> out;
  const std::uint8_t flags[2] = {anew_, reach_unknown_};
  put(out, flags, 2);
  for (const Neighbour& n : sides_) {
    put(out, n.listed.data(), n.listed.size());
    put(out, n.away.data(), n.away.size());
    put(out, n.shapes.data(), n.shapes.size());
    put(out, n.here.data(), n.here.size());
    put(out, &n.reach, 1);
    const std::uint8_t moving[2] = {n.leaving, n.arriving};
    put(out, moving, 2);
  }
  return out;
}

template <class Real>
void Copies<Real>::load(View<const std::byte> state) {
  Reader in(state);
  std::uint8_t flags[2];
  in.into(flags, 2);
  anew_ = flags[0], reach_unknown_ = flags[1];
  for (const Side side : both_sides) {
    Neighbour& n = sides_[index_of(side)];
    n.listed = in.take<std::uint32_t>();
    n.away = in.take<std::uint8_t>();
    n.shapes = in.take<std::uint16_t>();
    n.here = in.take<std::uint8_t>();
    in.into(&n.reach, 1);
    std::uint8_t moving[2];
    in.into(moving, 2);
    n.leaving = moving[0] != 0, n.arriving = moving[1] != 0;
    std::size_t markers = 0, copies = 0;
    for (const std::uint32_t b : n.listed) {
      require(b < own_,
              "the checkpoint is damaged (it lists a cell that is not there) start from an older one");
      markers += vertices_[bodies_[b].shape];
    }
    for (const std::uint16_t shape : n.shapes) {
      require(shape < vertices_.size(),
              "the checkpoint is damaged (a copy has an unknown shape) start from an older one");
      copies += vertices_[shape];
    }
    require(markers == n.away.size() && copies == n.here.size(),
            "the checkpoint is damaged (its lists disagree) start from an older one");
    on_list_[index_of(side)].assign(own_, 0);
    for (const std::uint32_t b : n.listed) on_list_[index_of(side)][b] = 1;
  }
  arrange();
}

template <class Real>
std::size_t Copies<Real>::bytes_per_step() const {
  if (!decomposition_.divided()) return 0;
  std::size_t bytes = 0;
  for (const Neighbour& n : sides_)
    bytes += n.outgoing.size() + (n.own.beyond.back() + n.copy.beyond.back()) * 3 * sizeof(Real);
  return bytes;
}

template <class Real>
std::size_t Copies<Real>::memory_bytes() const {
  std::size_t bytes = body_of_.capacity() * 8 + bodies_.capacity() * sizeof(contact::Body);
  for (const Neighbour& n : sides_)
    bytes += n.outgoing.capacity() + n.incoming.capacity() +
             (n.there.capacity() + n.back.capacity()) * sizeof(Real);
  return bytes;
}

template class Copies<float>;
template class Copies<double>;

}  // namespace hemowalk::resolved
