// Checkpoints of a simulation: what every rank saves, and how its parts are cut for another number of ranks.

#include <cstring>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/bytes.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

namespace {

/// What the parts of one state agree on, and which part this is.
struct PartHead {
  std::int32_t ranks = 1, rank = 0, planes = 0, groups = 0;
  std::int64_t fluid_steps = 0;
};

/// The cells of one group: equally long records, state (which starts with id and anchor) and last impulses.
struct Records {
  std::uint64_t length = 0;  ///< bytes of one
  std::vector<std::byte> bytes;
};

/// A part, taken to pieces.
template <class Real>
struct Part {
  PartHead head;
  Momentum taken;
  std::vector<std::byte> fluid;
  std::vector<Node4<Real>> force;  ///< [plane][ny][nx]
  std::vector<Records> cells;      ///< [group]
  /// What sums depend on in their last bit; empty after redistribution.
  std::vector<std::byte> copies, sort, contacts;

  std::vector<std::byte> pack() const {
    std::vector<std::byte> out;
    put(out, &head, 1), put(out, &taken, 1);
    put(out, fluid.data(), fluid.size()), put(out, force.data(), force.size());
    for (const Records& r : cells) put(out, &r.length, 1), put(out, r.bytes.data(), r.bytes.size());
    for (const auto* extra : {&copies, &sort, &contacts}) put(out, extra->data(), extra->size());
    return out;
  }
  static Part unpack(View<const std::byte> state) {
    Part p;
    Reader in(state);
    in.into(&p.head, 1), in.into(&p.taken, 1);
    p.fluid = in.take<std::byte>();
    p.force = in.take<Node4<Real>>();
    require(p.head.groups >= 0 && p.head.groups < 1000 && p.head.planes > 0,
            "the checkpoint is damaged (its head makes no sense) start from an older one");
    for (int g = 0; g < p.head.groups; ++g) {
      Records r;
      in.into(&r.length, 1);
      r.bytes = in.take<std::byte>();
      require(r.length > 0 && r.bytes.size() % r.length == 0,
              "the checkpoint is damaged (cut cells) start from an older one");
      p.cells.push_back(std::move(r));
    }
    for (auto* extra : {&p.copies, &p.sort, &p.contacts}) *extra = in.take<std::byte>();
    return p;
  }
};

/// z of the anchor in a cell's state, which starts with the id and the anchor.
double anchor_z(const std::byte* state) {
  double z;
  std::memcpy(&z, state + sizeof(std::int64_t) + 2 * sizeof(double), sizeof z);
  return z;
}

}  // namespace

template <class Real>
std::vector<std::byte> Simulation<Real>::save() const {
  Part<Real> part;
  part.head = {ranks().count(), ranks().rank(), block_.nz, static_cast<std::int32_t>(groups_.size()),
               fluid_steps_};
  part.taken = taken_;
  part.fluid = fluid_.save();
  if (any_cells_) {
    part.force.resize(block_.interior());
    for (int k = 0; k < block_.nz; ++k)
      for (int j = 0; j < block_.ny; ++j)
        std::memcpy(
            static_cast<void*>(&part.force[(static_cast<std::size_t>(k) * block_.ny + j) * block_.nx]),
            &force_[block_.at(0, j, k)], block_.nx * sizeof(Node4<Real>));
  }
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          Records r{g.state_bytes() + 3 * sizeof(Real) * g.vertices(), {}};
          r.bytes.resize(r.length * g.count());
          for (int c = 0; c < g.count(); ++c) {
            std::byte* out = r.bytes.data() + c * r.length;
            g.save(c, out);
            out += g.state_bytes();
            for (int k = 0; k < g.vertices(); ++k, out += 3 * sizeof(Real))
              std::memcpy(out, &impulse_[group.marker(c, k)], 3 * sizeof(Real));
          }
          part.cells.push_back(std::move(r));
        },
        group.cells);
  part.copies = copies_->save();
  part.sort = markers_->save();
  if (contact_) part.contacts = contact_->save();
  return part.pack();
}

template <class Real>
void Simulation<Real>::load(View<const std::byte> state) {
  const auto part = Part<Real>::unpack(state);
  require(
      part.head.ranks == ranks().count() && part.head.rank == ranks().rank() &&
          part.head.groups == static_cast<int>(groups_.size()) &&
          part.force.size() == (any_cells_ ? block_.interior() : 0),
      "the checkpoint does not fit the scene (other ranks, kinds of cells or box) use the scene it was made "
      "with");
  fluid_steps_ = part.head.fluid_steps;
  taken_ = part.taken;
  fluid_.load({part.fluid.data(), part.fluid.size()});
  for (int k = 0; k < block_.nz && any_cells_; ++k)
    for (int j = 0; j < block_.ny; ++j)
      std::memcpy(static_cast<void*>(&force_[block_.at(0, j, k)]),
                  &part.force[(static_cast<std::size_t>(k) * block_.ny + j) * block_.nx],
                  block_.nx * sizeof(Node4<Real>));
  if (solid_.give_back) solid_.give_back();
  for (std::size_t i = 0; i < groups_.size(); ++i)
    std::visit(
        [&](auto& g) {
          const Records& r = part.cells[i];
          require(r.length == g.state_bytes() + 3 * sizeof(Real) * g.vertices(),
                  "the checkpoint does not fit the scene (cells with other meshes) use the scene it was made "
                  "with");
          // Cells come back in the order they were saved in: lanes, and with them all sums, are the same.
          for (int c = g.count() - 1; c >= 0; --c) g.remove(c);
          for (std::size_t at = 0; at < r.bytes.size(); at += r.length) g.load(r.bytes.data() + at);
        },
        groups_[i].cells);
  if (solid_.take_over) solid_.take_over();
  if (solid_.restart) solid_.restart();
  arrange();
  std::memset(static_cast<void*>(impulse_.data()), 0, impulse_.size() * sizeof(Node4<Real>));
  for (std::size_t i = 0; i < groups_.size(); ++i)
    std::visit(
        [&](const auto& g) {
          for (int c = 0; c < g.count(); ++c) {
            const std::byte* in = part.cells[i].bytes.data() + c * part.cells[i].length + g.state_bytes();
            for (int k = 0; k < g.vertices(); ++k, in += 3 * sizeof(Real))
              std::memcpy(static_cast<void*>(&impulse_[groups_[i].marker(c, k)]), in, 3 * sizeof(Real));
          }
        },
        groups_[i].cells);
  if (!part.copies.empty()) copies_->load({part.copies.data(), part.copies.size()});
  fit_arrays();
  markers_->assign(copies_->body_of());
  markers_->load({part.sort.data(), part.sort.size()});
  set_contact_bodies();
  if (contact_) contact_->load({part.contacts.data(), part.contacts.size()});
  if (fluid_.border_missing()) fields_.stream(fluid_);
  fluid_.moments(velocity_.view(), any_cells_ ? force() : View<const Node4<Real>>{}, velocity_share());
  fill_halo(velocity_.view());
}

template <class Real>
std::vector<std::vector<std::byte>> redistribute(const std::vector<std::vector<std::byte>>& parts,
                                                 const Block& whole, int ranks) {
  const std::string damaged =
      "the checkpoint is damaged (its parts do not fit together) start from an older one";
  require(!parts.empty(), damaged);
  Part<Real> all;
  std::vector<std::vector<std::byte>> fluids;
  for (const auto& bytes : parts) {
    Part<Real> part = Part<Real>::unpack({bytes.data(), bytes.size()});
    require(part.head.ranks == static_cast<int>(parts.size()), damaged);
    fluids.push_back(std::move(part.fluid));
    if (fluids.size() == 1) {
      std::swap(all, part);
      continue;
    }
    require(part.head.groups == all.head.groups, damaged);
    all.head.planes += part.head.planes;
    auto* sums = all.taken.fluid.data();
    for (std::size_t i = 0; i < sizeof(Momentum) / sizeof(double); ++i) sums[i] += part.taken.fluid.data()[i];
    all.force.insert(all.force.end(), part.force.begin(), part.force.end());
    for (std::size_t g = 0; g < all.cells.size(); ++g) {
      require(part.cells[g].length == all.cells[g].length, damaged);
      auto& to = all.cells[g].bytes;
      to.insert(to.end(), part.cells[g].bytes.begin(), part.cells[g].bytes.end());
    }
  }
  require(all.head.planes == whole.nz, damaged);
  const auto fluid = lbm::join_states(fluids);
  const std::size_t plane = static_cast<std::size_t>(whole.nx) * whole.ny;
  std::vector<std::vector<std::byte>> result;
  for (int r = 0; r < ranks; ++r) {
    const auto first_of = [&](int rank) {
      return static_cast<int>(static_cast<long>(whole.nz) * rank / ranks);
    };
    const int first = first_of(r), last = first_of(r + 1);
    Part<Real> part;
    part.head = {ranks, r, last - first, all.head.groups, all.head.fluid_steps};
    if (r == 0) part.taken = all.taken;
    part.fluid = lbm::cut_state({fluid.data(), fluid.size()}, first, last - first);
    if (!all.force.empty())
      part.force.assign(all.force.begin() + first * plane, all.force.begin() + last * plane);
    for (const Records& from : all.cells) {
      Records to{from.length, {}};
      for (std::size_t at = 0; at < from.bytes.size(); at += from.length) {
        const double z = std::floor(anchor_z(from.bytes.data() + at)),
                     k = z - std::floor(z / whole.nz) * whole.nz;
        if (k >= first && k < last)
          to.bytes.insert(to.bytes.end(), from.bytes.begin() + at, from.bytes.begin() + at + from.length);
      }
      part.cells.push_back(std::move(to));
    }
    result.push_back(part.pack());
  }
  return result;
}

#define HEMOWALK_INSTANTIATE(Real)                                 \
  template std::vector<std::byte> Simulation<Real>::save() const;  \
  template void Simulation<Real>::load(View<const std::byte>);     \
  template std::vector<std::vector<std::byte>> redistribute<Real>( \
      const std::vector<std::vector<std::byte>>&, const Block&, int);
HEMOWALK_INSTANTIATE(float)
HEMOWALK_INSTANTIATE(double)
#undef HEMOWALK_INSTANTIATE

}  // namespace hemowalk::resolved
