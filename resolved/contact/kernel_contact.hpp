#pragma once
/// \file KernelContact: the published collision rule, "particle in kernel" (method 5.1 and 12), for
/// coupling: paper. A vertex with a foreign particle in its kernel, a vertex of another body or a wall within
/// the radius, gets no force from the fluid; a spring pulls it to the point p at a distance outside the
/// nearest of them along that one's normal, f = K (p - x), while it is on the inner side of p. There is a
/// tangential pull, and the neighbour feels nothing of it (it has a neighbour of its own): momentum does not
/// close, and is not meant to.

#include <cstdint>
#include <vector>

#include "resolved/contact/contact.hpp"
#include "resolved/contact/geometry.hpp"
#include "resolved/contact/grid.hpp"

namespace hemowalk::contact {

/// Knobs, lattice units.
struct KernelLaw {
  double radius = 2;     ///< half the support of the kernel
  double distance = 2;   ///< of the point that the spring pulls to, outside the neighbour
  double stiffness = 0;  ///< K, force per length, per vertex
};

/// Walls push back: what they take is in Summary::wall_force. Energy and virial are not computed.
template <class Real>
class KernelContact {
 public:
  /// \param vertices of a body of each shape.
  KernelContact(const KernelLaw& law, const Domain& domain, std::vector<int> vertices);

  void set_bodies(std::vector<Body> bodies);

  /// force[m] of all markers of bodies: x, y, z the force, w = 1 where a foreign particle is in the kernel,
  /// else 0. \p normal: unit, outward. Positions as in Contact::compute. Searches afresh: it has no state.
  /// Gaps are those between vertices, along the neighbour's normal. \throws PhysicsError for a position that
  /// is not finite.
  Summary compute(View<const Origin> origin, View<const Node4<Real>> local, View<const Node4<Real>> normal,
                  View<Node4<Real>> force);

 private:
  void gather(View<const Origin> origin, View<const Node4<Real>> local, View<const Node4<Real>> normal);
  void press(std::size_t body, Summary& share, View<Node4<Real>> force) const;

  KernelLaw law_;
  Domain domain_;
  std::vector<int> vertices_;
  std::vector<Body> bodies_;
  std::vector<std::uint32_t> first_, body_of_;  ///< [bodies + 1] into points, [point]
  std::vector<Point<double>> x_, normal_;       ///< [point], brought into the box
  std::vector<Slot> slots_;
  std::vector<Summary> shares_;  ///< [body]: a fixed order of summation
  Grid grid_;
};

extern template class KernelContact<float>;
extern template class KernelContact<double>;

}  // namespace hemowalk::contact
