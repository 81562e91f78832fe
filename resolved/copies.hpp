#pragma once
/// \file Copies: what neighbouring ranks must know of each other's cells. A cell lives on the rank that holds
/// its centre; where it comes near a border, the neighbour gets a copy of its vertices (contact reads them)
/// and interpolates and spreads for those of its markers that lie in the neighbour's slab.
///
/// Which cells and which markers is decided by the owner and kept until a cell comes near or a marker strays
/// by more than a node: positions travel in every step, lists seldom.
///
/// Devices share markers instead: both ranks interpolate and spread all markers of a copied cell, each for
/// the nodes of its own block, so that readings are added up and nothing but bodies is listed.

#include <cstdint>
#include <vector>

#include "core/block.hpp"
#include "core/view.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/decomposition.hpp"
#include "resolved/ibm/markers.hpp"

namespace hemowalk::resolved {

/// Lowest and highest z of a body's vertices and coupling points, from the block's corner.
struct Extent {
  double low, high;
};

enum class MarkersOfCopies { divided, shared };

template <class Real>
class Copies {
 public:
  /// \param contact_range dx, negative: no contact. \param vertices of a body of each shape.
  Copies(const Decomposition& decomposition, double contact_range, std::vector<int> vertices,
         MarkersOfCopies markers = MarkersOfCopies::divided);

  /// The bodies of this rank from now on, in \p slots marker slots: cells came or went. Lists are made anew.
  void set_bodies(std::vector<contact::Body> own, std::size_t slots);

  /// Own bodies, then copies (not owned), whose markers follow the own slots.
  const std::vector<contact::Body>& bodies() const { return bodies_; }
  /// [slot] body of the markers that this rank interpolates and spreads, else negative.
  const std::vector<std::int32_t>& body_of() const { return body_of_; }
  std::size_t slots() const { return body_of_.size(); }
  /// Own bodies that the neighbour has copies of.
  const std::vector<std::uint32_t>& listed(Side side) const { return sides_[index_of(side)].listed; }
  /// Will the next exchange() list bodies anew, and so read vertices and sites of any of them?
  bool lists_anew(View<const Extent> extents) const;

  struct Change {
    bool markers = false;  ///< other markers lie here
    bool bodies = false;   ///< other bodies are here
  };
  /// Tells the neighbours where the own bodies are. Afterwards bodies(), body_of() and slots() hold; the
  /// positions of the copies are still to be taken by place(). \param extents [own body].
  /// \throws InputError when cells reach too far for slabs this thin.
  Change exchange(View<const Extent> extents, View<const ibm::Origin> origin,
                  View<const Node4<Real>> vertices, View<const Node4<Real>> sites);
  /// Positions of the copies, behind those of the own bodies: arrays of bodies().size() and slots().
  void place(View<ibm::Origin> origin, View<Node4<Real>> vertices, View<Node4<Real>> sites) const;

  /// What was interpolated for the neighbours' markers goes back to them; shared markers: adds up there.
  void send_readings(View<const Node4<Real>> reading);
  void receive_readings(View<Node4<Real>> reading);
  /// Impulses of the own markers that lie in a neighbour's slab go there.
  void send_impulses(View<const Node4<Real>> impulse);
  void receive_impulses(View<Node4<Real>> impulse);

  /// Whether cells are to be handed over to, or taken over from, a neighbour before the next step: this rank,
  /// or that one, found a centre more than a node outside.
  bool leaving(Side side) const { return sides_[index_of(side)].leaving; }
  bool arriving(Side side) const { return sides_[index_of(side)].arriving; }
  bool passing() const {
    return leaving(Side::low) || leaving(Side::high) || arriving(Side::low) || arriving(Side::high);
  }
  /// An own body is now the neighbour's: its surface may reach back by so much.
  void gave_away(Side side, const Extent& extent);

  /// Lists, exactly: sums depend on who adds them up.
  std::vector<std::byte> save() const;
  void load(View<const std::byte> state);

  /// What this rank sent in the last step: positions, readings, impulses.
  std::size_t bytes_per_step() const;
  std::size_t memory_bytes() const;

 private:
  /// Where each body of a list begins, among the list's vertices and among its markers that lie beyond the
  /// border; one more entry for the end.
  struct Begin {
    std::vector<std::uint32_t> vertex, beyond;
  };
  struct Neighbour {
    std::vector<std::uint32_t> listed;  ///< own bodies it has copies of
    std::vector<std::uint8_t> away;     ///< [their vertices in turn] 1: the marker lies there
    std::vector<std::uint16_t> shapes;  ///< of its bodies that are copied here
    std::vector<std::uint8_t> here;     ///< [their vertices in turn] 1: the marker lies here
    Begin own, copy;                    ///< of `listed` and `shapes`
    double reach = 0;                   ///< how far its surfaces come into this block
    bool leaving = false, arriving = false;
    std::size_t first_body = 0, first_slot = 0;  ///< of the copies
    std::size_t incoming_at = 0;                 ///< positions in `incoming`
    std::vector<std::byte> outgoing, incoming;
    std::vector<Real> there, back;  ///< values under way
  };
  struct Head {
    std::int32_t lists, bodies, markers, leaving;  ///< lists: 0 as before, 1 markers new, 2 bodies new
    double reach;
    double unused;
  };

  double depth(Side side, const Extent& e) const { return side == Side::low ? e.low : block_.nz - e.high; }
  double need(const Neighbour& n) const;
  void exchange_reach(View<const Extent> extents);
  bool is_away(Side side, int node) const { return side == Side::low ? node < 0 : node >= block_.nz; }
  bool unlisted(Side side, View<const Extent> extents) const;
  int choose(Side side, View<const Extent> extents, View<const ibm::Origin> origin,
             View<const Node4<Real>> sites);
  bool strayed(Side side, View<const ibm::Origin> origin, View<const Node4<Real>> sites) const;
  void pack(Side side, int lists, View<const Extent> extents, View<const ibm::Origin> origin,
            View<const Node4<Real>> vertices, View<const Node4<Real>> sites);
  int unpack_lists(Neighbour& n);
  void check_reach() const;
  void arrange();
  void index(Neighbour& n) const;
  template <class Body>
  void for_own(const Neighbour& n, const Body& body) const;
  template <class Body>
  void for_copies(const Neighbour& n, const Body& body) const;

  static constexpr double margin = 2;  ///< dx by which lists look ahead
  /// Nodes between a marker and the farthest node of its kernel, and one to move.
  static constexpr int kernel_reach = 3;

  Decomposition decomposition_;
  Block block_;
  double range_;
  bool shared_;
  std::vector<int> vertices_;
  std::size_t own_ = 0, own_slots_ = 0;
  std::vector<contact::Body> bodies_;
  std::vector<std::int32_t> body_of_, own_body_of_;
  Neighbour sides_[2];
  std::vector<std::uint8_t> on_list_[2];  ///< [own body]
  bool anew_ = true, reach_unknown_ = true;
  Ring ring_, readings_, impulses_;
};

extern template class Copies<float>;
extern template class Copies<double>;

}  // namespace hemowalk::resolved
