#pragma once
/// \file Contact: normal, pairwise, equal and opposite forces between the surfaces of different bodies, and
/// between bodies and walls (method: "Contact by vertex against the nearest surface point of the other
/// body").
///
/// Every vertex within reach of another body's surface feels, along the line to the nearest surface point q,
///   f = A_v/2 K (rc - g)^2/rc    for g < rc,   energy A_v/2 K (rc - g)^3/(3 rc),
/// g the signed gap (negative inside the other body), A_v the vertex's rest area. Both bodies' vertices look
/// at the other body, hence the 1/2: the pressure between two parallel sheets is K (rc - g)^2/rc. Walls are
/// rigid and look at nobody, so vertices push them with the full A_v. The reaction acts at q: it is shared by
/// the three vertices of the triangle there with q's barycentric weights. The force is the exact gradient of
/// the energy, has no tangential part, and closes linear and angular momentum pair by pair to round-off.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "core/block.hpp"
#include "core/view.hpp"

namespace hemowalk::contact {

/// Integer lattice node near a body; positions are given relative to it (the convention of the markers).
using Origin = std::array<std::int32_t, 3>;

/// Knobs, lattice units.
struct Law {
  double range = 1;      ///< rc: gap at which the potential starts, dx
  double stiffness = 0;  ///< K: pressure per length
  double depth = 1;      ///< penetration that is still seen, dx; packing from overlapping states wants more
  double skin = 0.35;    ///< bodies may approach by this much before neighbours are searched again, dx
};

/// Rigid surfaces that enclose the fluid.
struct Walls {
  enum class Geometry { none, slab, tube, surface } geometry = Geometry::none;
  double lower = 0, upper = 0;  ///< slab: planes y = lower and y = upper
  double x = 0, y = 0;          ///< tube: axis, along z
  double radius = 0;            ///< tube
  /// surface, host only: signed distance, positive in the fluid, at the nodes (i + 1/2, j + 1/2, k + 1/2) of
  /// a periodic lattice, [k][j][i]. Bodies see its trilinear interpolation and are pushed along that one's
  /// gradient, so the force has a potential. Must outlive the contact.
  const float* distance = nullptr;
  std::array<int, 3> nodes{};
  int first_plane = 0;  ///< of the block, in that lattice
  double scale = 1;     ///< the lattice's spacings per length: below 1 the surface is that much larger
};

struct Domain {
  std::array<double, 3> period{0, 0, 0};  ///< dx; 0 = not periodic along this axis
  Walls walls;
};

/// What bodies of one type share.
struct Shape {
  std::vector<std::uint32_t> triangles;  ///< [3 T] vertex numbers, counter-clockwise seen from outside
  std::vector<double> area;              ///< [V] rest area of each vertex (a third of its triangles), dx^2
};

/// Where a body's vertices are in the marker arrays: vertex v is marker first + v stride.
struct Body {
  std::uint32_t first = 0;
  std::uint32_t stride = 1;
  std::uint16_t shape = 0;
  bool owned =
      true;  ///< false: a neighbour's copy; its forces are partial and two such bodies ignore each other
};

/// Sums over all contacts that involve an owned body. Deterministic for any number of threads.
struct Summary {
  double minimum_gap = std::numeric_limits<double>::infinity();       ///< dx; exact when below the range
  double minimum_wall_gap = std::numeric_limits<double>::infinity();  ///< dx; likewise
  std::int64_t contacts = 0;       ///< vertices pressed by another body's surface
  std::int64_t wall_contacts = 0;  ///< vertices pressed by a wall
  double energy = 0;               ///< of both
  /// Sum of (x_v - q)_i f_j over body-body contacts: xx, yy, zz, xy, xz, yz. Minus this over the volume is
  /// the contacts' share of the mean stress. Symmetric because forces are central.
  std::array<double, 6> virial{};
  /// Force of the bodies on the lower and the upper wall (tube: all in the first); one step's impulse.
  std::array<std::array<double, 3>, 2> wall_force{};
};

/// Contact forces of one block. Linear in the number of bodies: neighbours come from a uniform grid and are
/// searched again only when two bodies approached each other by more than the skin.
template <class Real>
class Contact {
 public:
  Contact(const Law& law, const Domain& domain, std::vector<Shape> shapes);
  ~Contact();
  Contact(Contact&&) noexcept;
  Contact& operator=(Contact&&) noexcept;

  /// The bodies from now on; body b of the arrays below. Also after bodies moved in memory.
  void set_bodies(std::vector<Body> bodies);

  /// Changes the box, for packing. Walls and images move at once.
  void set_domain(const Domain& domain);

  /// force[m] = contact force on marker m for all markers of bodies (others are left alone). Position of a
  /// marker: origin[body] + local[marker].xyz, each body in one piece; any periodic image will do. Allocates
  /// nothing once the neighbour lists have reached their size. \throws PhysicsError for a position that is
  /// not finite.
  Summary compute(View<const Origin> origin, View<const Node4<Real>> local, View<Node4<Real>> force);

  /// State that the next forces depend on in their last bit (positions of the last search), for exact
  /// restarts.
  std::vector<std::byte> save() const;
  /// Call after set_bodies(). \throws InputError if \p state belongs to other bodies.
  void load(View<const std::byte> state);

  /// Neighbour searches so far; for benchmarks and tests.
  std::int64_t searches() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

extern template class Contact<float>;
extern template class Contact<double>;

/// How far bodies overlap, from scratch and without limit of depth: for output and packing, not for every
/// step.
struct Overlap {
  double minimum_gap =
      std::numeric_limits<double>::infinity();  ///< dx; smallest signed gap found within `within`
  std::int64_t inside = 0;         ///< vertices inside another body (by winding number, however deep)
  std::int64_t outside_walls = 0;  ///< vertices beyond a wall
  double minimum_wall_gap = std::numeric_limits<double>::infinity();
  std::int32_t first = -1, second = -1;  ///< bodies of the smallest gap
};

/// Measures all pairs of bodies. Gaps larger than \p within are not looked for.
template <class Real>
Overlap measure_overlap(const Domain& domain, const std::vector<Shape>& shapes,
                        const std::vector<Body>& bodies, View<const Origin> origin,
                        View<const Node4<Real>> local, double within);

}  // namespace hemowalk::contact
