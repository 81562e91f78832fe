#include "resolved/even_solid.hpp"

#include <omp.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/check.hpp"
#include "resolved/bytes.hpp"
#include "resolved/rigid/motion.hpp"

namespace hemowalk::resolved {

namespace {

// What a message holds of a cell: bytes(g), save(g, c, out), restore(g, c, in), g a group's cells.

/// The fields that Parts names, number by number.
template <class Parts>
struct Fields {
  template <class Cells>
  static std::size_t bytes(Cells& g) {
    std::size_t n = 0;
    Parts::of(g.host_fields(), 0,
              [&](auto* first, std::size_t count, std::size_t) { n += count * sizeof(*first); });
    return n;
  }
  template <class Cells>
  static void save(Cells& g, int c, std::byte* out) {
    Parts::of(g.host_fields(), c, [&](const auto* x, std::size_t count, std::size_t apart) {
      for (std::size_t i = 0; i < count; ++i, out += sizeof(*x)) std::memcpy(out, x + i * apart, sizeof(*x));
    });
  }
  template <class Cells>
  static void restore(Cells& g, int c, const std::byte* in) {
    Parts::of(g.host_fields(), c, [&](auto* x, std::size_t count, std::size_t apart) {
      for (std::size_t i = 0; i < count; ++i, in += sizeof(*x)) std::memcpy(x + i * apart, in, sizeof(*x));
    });
  }
};

/// Calls \p each(first, count, apart) with the numbers of cell \p c in a field [batch][rows][lane].
template <class Real, class T, class Each>
void rows_of(T* field, int rows, int c, const Each& each) {
  constexpr int lanes = mesh::lanes_of<Real>;
  each(field + static_cast<std::size_t>(c / lanes) * rows * lanes + c % lanes, rows, lanes);
}

/// What a solid step starts from.
struct Needs {
  template <class Real, class Each>
  static void of(const mesh::HostFields<Real>& f, int c, const Each& each) {
    rows_of<Real>(f.predicted, 3 * f.vertices, c, each);
    if (f.couple) each(f.couple + 3 * c, 3, 1);
  }
};

/// What it leaves in the host's fields.
struct Gives {
  template <class Real, class Each>
  static void of(const mesh::HostFields<Real>& f, int c, const Each& each) {
    for (Real* field : {f.offset, f.velocity, f.normal, f.held})
      if (field) rows_of<Real>(field, 3 * f.vertices, c, each);
    rows_of<Real>(f.anchor, 3, c, each);
    if (f.motion) each(f.motion + c, 1, 1);
  }
};

/// All of a cell.
struct State {
  template <class Cells>
  static std::size_t bytes(Cells& g) {
    return g.state_bytes();
  }
  template <class Cells>
  static void save(Cells& g, int c, std::byte* out) {
    g.save(c, out);
  }
  template <class Cells>
  static void restore(Cells& g, int c, const std::byte* in) {
    g.restore(c, in);
  }
};

/// \p action(cells of the group, index, place) for each of \p cells, their records of \p Record one after
/// another from place \p begin on; before it \p room(their end).
template <class Record, class Real, class Cells, class Room, class Action>
void for_records(std::vector<Group<Real>>& groups, const Cells& cells, std::size_t begin, const Room& room,
                 const Action& action) {
  std::vector<std::size_t> length, at{begin};
  for (auto& group : groups)
    length.push_back(std::visit([](auto& g) { return Record::bytes(g); }, group.cells));
  for (const auto& cell : cells) at.push_back(at.back() + length[cell.group]);
  room(at.back());
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < cells.size(); ++i)
    std::visit([&](auto& g) { action(g, cells[i].index, at[i]); }, groups[cells[i].group].cells);
}

template <class Record, class Real, class Cells>
void write(std::vector<Group<Real>>& groups, const Cells& cells, std::vector<std::byte>& out) {
  for_records<Record>(
      groups, cells, out.size(), [&](std::size_t end) { out.resize(end); },
      [&](auto& g, int c, std::size_t at) { Record::save(g, c, out.data() + at); });
}

template <class Record, class Real, class Cells>
void read(std::vector<Group<Real>>& groups, const Cells& cells, const std::vector<std::byte>& in,
          std::size_t begin) {
  for_records<Record>(
      groups, cells, begin,
      [&](std::size_t end) { contract(end == in.size(), "a message holds other cells than it names"); },
      [&](auto& g, int c, std::size_t at) { Record::restore(g, c, in.data() + at); });
}

template <class Real>
std::int64_t id_of(const Group<Real>& group, int c) {
  return std::visit([&](const auto& g) { return g.id(c); }, group.cells);
}

template <class Real>
std::vector<Group<Real>> without_cells(const std::vector<Group<Real>>& groups) {
  std::vector<Group<Real>> none;
  for (const auto& group : groups)
    std::visit(
        [&](const auto& g) {
          none.push_back({g.empty(), group.kind, 0, 0, group.mass, group.weight});
        },
        group.cells);
  return none;
}

}  // namespace

template <class Real>
EvenSolid<Real>::EvenSolid(Place place, std::vector<Group<Real>>& owned, mpi::Ranks ranks, Timings& timings)
    : owned_(owned),
      ranks_(ranks),
      timings_(timings),
      solved_(without_cells(owned)),
      device_(place, solved_),
      asked_(ranks.count()),
      answers_(ranks.count()),
      outgoing_(ranks.count()),
      incoming_(ranks.count()),
      messages_(ranks) {
  take_over();
}

/// What is outgoing for each rank goes there, what is for this one comes in.
template <class Real>
void EvenSolid<Real>::exchange() {
  constexpr int tag = 2 * static_cast<int>(Topic::solid);
  const double start = omp_get_wtime();
  const int me = ranks_.rank();
  for (int r = 0; r < ranks_.count(); ++r)
    if (r != me) messages_.send(r, tag, {outgoing_[r].data(), outgoing_[r].size()});
  std::swap(incoming_[me], outgoing_[me]);
  for (int r = 0; r < ranks_.count(); ++r)
    if (r != me) messages_.receive(r, tag, incoming_[r]);
  messages_.wait();
  for (Bytes& out : outgoing_) out.clear();
  exchanging_ += omp_get_wtime() - start;
}

template <class Real>
void EvenSolid<Real>::deal() {
  std::vector<std::vector<std::int64_t>> ids(owned_.size());
  for (Bytes& out : outgoing_)
    for (const auto& group : owned_) {
      std::vector<std::int64_t> mine(group.count());
      for (int c = 0; c < group.count(); ++c) mine[c] = id_of(group, c);
      put(out, mine.data(), mine.size());
    }
  exchange();
  for (const Bytes& in : incoming_) {
    Reader reader({in.data(), in.size()});
    for (auto& of_group : ids) {
      const auto some = reader.take<std::int64_t>();
      of_group.insert(of_group.end(), some.begin(), some.end());
    }
  }
  int dealt = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    std::sort(ids[i].begin(), ids[i].end());
    for (const std::int64_t id : ids[i]) {
      const auto n = static_cast<std::size_t>(id);
      if (n >= solver_.size()) solver_.resize(n + 1), place_.resize(n + 1);
      solver_[n] = dealt++ % ranks_.count();
      if (solver_[n] != ranks_.rank()) continue;
      const int index = std::visit(
          [&](auto& g) {
            return g.add(id, {0, 0, 0}, mesh::identity_rotation);
          },
          solved_[i].cells);
      place_[n] = {static_cast<std::int32_t>(i), index};
    }
  }
}

/// Records of all own cells to their solvers.
template <class Real>
template <class Record>
void EvenSolid<Real>::ask() {
  for (auto& cells : asked_) cells.clear();
  std::vector<std::vector<std::int64_t>> ids(asked_.size());
  for (std::size_t i = 0; i < owned_.size(); ++i)
    for (int c = 0; c < owned_[i].count(); ++c) {
      const std::int64_t id = id_of(owned_[i], c);
      const std::int32_t solver = solver_[static_cast<std::size_t>(id)];
      asked_[solver].push_back({static_cast<std::int32_t>(i), c}), ids[solver].push_back(id);
    }
  for (std::size_t r = 0; r < asked_.size(); ++r) {
    put(outgoing_[r], ids[r].data(), ids[r].size());
    write<Record>(owned_, asked_[r], outgoing_[r]);
  }
  exchange();
  for (std::size_t r = 0; r < answers_.size(); ++r) {
    answers_[r].clear();
    for (const std::int64_t id : Reader({incoming_[r].data(), incoming_[r].size()}).take<std::int64_t>())
      answers_[r].push_back(place_[static_cast<std::size_t>(id)]);
    read<Record>(solved_, answers_[r], incoming_[r],
                 sizeof(std::uint64_t) + answers_[r].size() * sizeof(std::int64_t));
  }
}

/// Records back to who asked.
template <class Real>
template <class Record>
void EvenSolid<Real>::answer() {
  for (std::size_t r = 0; r < answers_.size(); ++r) write<Record>(solved_, answers_[r], outgoing_[r]);
  exchange();
  for (std::size_t r = 0; r < asked_.size(); ++r) read<Record>(owned_, asked_[r], incoming_[r], 0);
}

template <class Real>
std::vector<mesh::StepReport> EvenSolid<Real>::step(const mesh::StepOptions& options) {
  exchanging_ = 0;
  ask<Fields<Needs>>();
  for (auto& group : owned_) {
    const auto host = std::visit([](auto& g) { return g.host_fields(); }, group.cells);
    if (host.couple) std::fill(host.couple, host.couple + 3 * group.count(), 0.0);
  }
  const auto reports = device_.step(options);
  answer<Fields<Gives>>();
  timings_.communication += exchanging_, timings_.solid -= exchanging_;
  return reports;
}

template <class Real>
void EvenSolid<Real>::download() {
  device_.download();
  answer<State>();
}

template <class Real>
void EvenSolid<Real>::take_over() {
  device_.give_back();
  for (auto& group : solved_)
    std::visit(
        [](auto& g) {
          for (int c = g.count() - 1; c >= 0; --c) g.remove(c);
        },
        group.cells);
  deal();
  ask<State>();
  device_.take_over();
}

template class EvenSolid<float>;
template class EvenSolid<double>;

}  // namespace hemowalk::resolved
