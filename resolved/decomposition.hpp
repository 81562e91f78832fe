#pragma once
/// \file Decomposition: the domain cut into slabs along z, one per rank, and what fields of neighbouring
/// slabs tell each other. Along z because planes are contiguous in memory: halo planes are sent from where
/// they lie. Why markers stay with the fluid: docs/adr/0009-decomposition.md.

#include <vector>

#include "core/array.hpp"
#include "core/block.hpp"
#include "core/mpi.hpp"
#include "resolved/lbm/fluid.hpp"

namespace hemowalk::resolved {

using lbm::Side;

inline constexpr Side both_sides[2] = {Side::low, Side::high};
constexpr int index_of(Side side) { return side == Side::low ? 0 : 1; }

/// Which part of the domain is this rank's.
class Decomposition {
 public:
  /// \param thickest planes that the slab of every rank needs at least (cells reach one neighbour only).
  /// \throws InputError when there are too many ranks for the box.
  Decomposition(const Block& whole, mpi::Ranks ranks, double thickest);

  bool divided() const { return ranks_.count() > 1; }
  const mpi::Ranks& ranks() const { return ranks_; }
  const Block& whole() const { return whole_; }
  const Block& block() const { return block_; }
  /// Number of this block's plane k = 0 in the domain.
  int first_plane() const { return first_of(ranks_.rank()); }
  int first_of(int rank) const {
    return static_cast<int>(static_cast<long>(whole_.nz) * rank / ranks_.count());
  }
  /// z in the neighbour's block less z in this one.
  int shift_to(Side side) const;
  int neighbour(Side side) const {
    return (ranks_.rank() + (side == Side::low ? ranks_.count() - 1 : 1)) % ranks_.count();
  }
  /// First plane, counted from this block's, of the domain's periodic image that has the block in its middle.
  double lowest_seen() const { return divided() ? (block_.nz - whole_.nz) / 2 : 0; }
  /// Plane \p k of the domain (any periodic image), as seen from this block: in the image nearest to it.
  double localise(double k) const;

 private:
  Block whole_, block_;
  mpi::Ranks ranks_;
};

/// What a message is about.
enum class Topic { velocity, force, populations, reach, copies, readings, impulses, cells, solid };

/// Messages of one topic to and from both neighbours. Two ranks are each other's neighbour on both sides:
/// what travels up and what travels down is told apart.
class Ring {
 public:
  Ring(const Decomposition& decomposition, Topic topic)
      : low_(decomposition.neighbour(Side::low)),
        high_(decomposition.neighbour(Side::high)),
        tag_(2 * static_cast<int>(topic)),
        messages_(decomposition.ranks()) {}

  template <class T>
  void send(Side to, const T* data, std::size_t n) {
    messages_.send(to == Side::low ? low_ : high_, tag_ + index_of(to),
                   {reinterpret_cast<const std::byte*>(data), n * sizeof(T)});
  }
  template <class T>
  void receive(Side from, T* data, std::size_t n) {
    messages_.receive(from == Side::low ? low_ : high_, tag_ + 1 - index_of(from),
                      {reinterpret_cast<std::byte*>(data), n * sizeof(T)});
  }
  /// Of any length: waits for it.
  void receive(Side from, std::vector<std::byte>& data) {
    messages_.receive(from == Side::low ? low_ : high_, tag_ + 1 - index_of(from), data);
  }
  void wait() { messages_.wait(); }

 private:
  int low_, high_, tag_;
  mpi::Messages messages_;
};

/// Exchange of the fields' border planes. On one rank nothing happens: the fields are periodic by themselves.
template <class Real>
class FieldExchange {
 public:
  FieldExchange(const Decomposition& decomposition, std::size_t border_size);

  /// Halo planes along z of a field whose interior planes are complete (their halo along x and y included).
  void fill(View<Node4<Real>> field);
  /// Adds what was spread into halo planes along z to the planes they stand for.
  void fold(View<Node4<Real>> force);
  /// Populations that cross the borders, between begin_advance() and end_advance().
  void stream(lbm::Fluid<Real>& fluid);

  /// Planes that fill() sends, and fold().
  static constexpr int planes_sent = 5;

 private:
  // A marker may be one node outside; its kernel reaches from one node below its own to two above.
  static constexpr int below = 2, above = 3;
  static_assert(below + above == planes_sent);
  View<Node4<Real>> planes(View<Node4<Real>> field, int first, int count) const;

  bool divided_;
  Block block_;
  Ring velocity_, force_, populations_;
  Array<Node4<Real>> folded_[2];           ///< from either side
  Array<Real> outgoing_[2], incoming_[2];  ///< populations
};

extern template class FieldExchange<float>;
extern template class FieldExchange<double>;

}  // namespace hemowalk::resolved
