#pragma once
/// \file Fluid: plasma on one Block, D3Q19 lattice Boltzmann (method 4). Everything in lattice units: dx = dt
/// = 1, reference density 1, kinematic viscosity (tau - 1/2)/3, pressure (rho - 1)/3. Node (i, j, k) lies at
/// (i + 1/2, j + 1/2, k + 1/2); x and z are periodic; y is periodic or bounded by two half-way bounce-back
/// walls at y = 0 and y = ny, which may slide.
///
/// A step of a coupled run:
///     fluid.moments(velocity);                  // once, at the start
///     loop: ... interpolate velocity, move the solid, spread force ...
///           fluid.advance(force, velocity);     // collide, stream, and the velocities of the new state

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/array.hpp"
#include "core/block.hpp"
#include "core/view.hpp"
#include "resolved/lbm/collision.hpp"
#include "resolved/lbm/pointers.hpp"

namespace hemowalk::lbm {

using Vec3 = std::array<double, 3>;  ///< x, y, z

enum class Collision { trt, bgk };
enum class Forcing { guo, shan_chen };

struct Parameters {
  double tau = 2;  ///< relaxation time of the stress, > 1/2
  Collision collision = Collision::trt;
  double magic = 3.0 / 16.0;  ///< Lambda = (tau - 1/2)(tau_minus - 1/2), trt only
  Forcing forcing = Forcing::guo;
  bool walls_y = true;  ///< bounce-back walls at y = 0 and y = ny, else periodic y
  Vec3 lower_wall_velocity{}, upper_wall_velocity{};  ///< the y component must be 0
  Vec3 body_force{};                                  ///< per node and step, in addition to the force field
  /// The planes k = -1 and nz belong to other blocks (see begin_advance), else periodic z.
  bool divided_z = false;
};

/// Relaxation rate of the odd populations, omega_minus.
inline double odd_rate(const Parameters& p) {
  return p.collision == Collision::bgk ? 1 / p.tau : 1 / (0.5 + p.magic / (p.tau - 0.5));
}

/// The two ends of a block along z.
enum class Side { low, high };

/// Density and velocity asked of a point (lattice coordinates) when a flow is initialised.
struct FlowPoint {
  double density = 1;
  Vec3 velocity{};
};

/// Momentum the fluid gave away in the last step, by momentum exchange. The uniform pressure of the reference
/// density is left out (it would push both walls apart with 1/3 per node).
struct WallImpulse {
  Vec3 lower{}, upper{};  ///< to the walls y = 0 and y = ny
  Vec3 solid{};           ///< to the static solid nodes
};

/// Sums over all fluid nodes, in double.
struct Totals {
  double mass = 0;  ///< sum of rho - 1
  Vec3 momentum{};  ///< sum of c_i f_i, i.e. before the coming step's force
};

/// Energy of the fluid and what the coming collision does to it, sums over all fluid nodes, in double
/// (lattice units). In the square norm of the populations, (1/6) sum g_i^2/w_i, streaming changes nothing, a
/// wall adds its velocity times the momentum it gives, a force F adds F.(j + F/2), and collision removes
/// omega (2 - omega)/6 sum m_i^2/w_i of each parity m of the non-equilibrium part. So over a step
///     held(after) - held(before) = force + body_force - viscous - stressless - velocity.impulse of the walls
/// up to terms cubic in the velocity (the square norm is that of the linear equilibrium).
struct EnergyFlows {
  double held = 0;        ///< 1/2 j^2 + (rho - 1)^2/6 + the non-equilibrium part
  double viscous = 0;     ///< 3/2 omega (2 - omega)/2 Pi_neq:Pi_neq = 2 mu S:S, per step
  double stressless = 0;  ///< what moments beyond the stress lose: of the lattice, no physics
  double force = 0;       ///< work of the force field
  double body_force = 0;  ///< work of the body force
};

/// State of stress of one node: sigma = -pressure + viscous.
struct NodeStress {
  double pressure = 0;              ///< (rho - 1)/3
  std::array<double, 6> viscous{};  ///< xx, yy, zz, xy, xz, yz
};

/// Averages over the fluid nodes of each plane y = j + 1/2.
struct PlanarProfiles {
  std::vector<Vec3> velocity;              ///< physical: u* + F/(2 rho)
  std::vector<double> density;             ///< rho
  std::vector<double> shear_xy, shear_yz;  ///< viscous stress of the fluid, mu (du_a/dy + du_y/da)
};

/// D3Q19 fluid, one population set updated in place (AA pattern), SIMD along x, one z-slab per OpenMP thread.
/// Results do not depend, bit for bit, on the number of threads. Steps, moments() and wall_impulse() do not
/// allocate.
/// \tparam Real float or double: the type of populations (stored as f_i - w_i) and arithmetic.
template <class Real>
class Fluid {
 public:
  /// Fluid at rest with density 1. \throws InputError for tau <= 1/2, a wall moving along y, an empty block.
  Fluid(const Block& block, const Parameters& parameters);

  const Block& block() const { return block_; }
  const Parameters& parameters() const { return parameters_; }
  const Relaxation<Real>& relaxation() const { return rate_; }
  double viscosity() const { return (parameters_.tau - 0.5) / 3; }
  std::int64_t steps() const { return steps_; }

  /// Changes wall velocities or the body force between steps (start-up ramps).
  void set_wall_velocity(const Vec3& lower, const Vec3& upper);
  void set_body_force(const Vec3& force);

  /// Declares the nodes where \p solid(i, j, k) is true static solid: half-way bounce-back on every link that
  /// enters them, zero velocity and no force inside. Call before initialise(). Packs of nodes that touch the
  /// solid run without SIMD. Periodic images are asked by their interior indices; a divided block also asks
  /// for the halo planes k < 0 and k >= nz of its neighbours.
  void set_solid(const std::function<bool(int, int, int)>& solid);
  bool is_solid(int i, int j, int k) const { return !solid_.empty() && solid_[block_.at(i, j, k)]; }
  std::size_t fluid_nodes() const { return fluid_nodes_; }

  /// Populations = equilibrium + the viscous non-equilibrium part of the given flow, whose gradients are
  /// taken by central differences over one spacing (exact for a linear profile: a steady Couette flow is
  /// steady from step 0). \p flow gives the physical velocity; half the body force is taken off. Sets steps()
  /// to 0.
  void initialise(const std::function<FlowPoint(double x, double y, double z)>& flow);
  /// Flow along z with the profile \p velocity_z(y).
  void initialise(const std::function<double(double y)>& velocity_z);

  /// Velocity WITHOUT force, u* = sum c_i f_i / rho (method 5.2, step 1), into the interior of a halo field
  /// (length block().size()); w = rho - 1. Solid nodes get zeros. 76 + 16 bytes per node (float).
  /// With \p force its share is added, as in advance().
  void moments(View<Node4<Real>> velocity, View<const Node4<Real>> force = {}, Real force_share = 0) const;

  /// One step: collision with \p force (halo field, interior read; momentum per node and step; w ignored)
  /// plus the body force, then streaming. Each node gains exactly its force. An empty view means body force
  /// only.
  void collide_and_stream(View<const Node4<Real>> force);

  /// collide_and_stream(force), then moments(velocity) and velocity += \p force_share force, in one sweep
  /// over memory: what a coupling reads is u* + theta/2 F (method 5.2, step 2).
  void advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share = 0);

  // A domain divided along z into blocks (divided_z), of one process or many, takes a step in three parts:
  //     begin_advance(force, velocity, force_share);
  //     send_border(side, buffer) -> the neighbour's receive_border(its other side, buffer), both sides
  //     end_advance(force, velocity, force_share);
  // and gives, bit for bit, what the undivided block gives. Five of 19 populations cross a border.
  /// Collides all planes and takes the moments of all but the first and the last.
  void begin_advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share = 0);
  /// Numbers of one message.
  std::size_t border_size() const { return 5 * static_cast<std::size_t>(block_.ny) * block_.nx; }
  void send_border(Side side, View<Real> message) const;
  void receive_border(Side side, View<const Real> message);
  /// After load() of a divided block: exchange borders once before moments() and the first step?
  bool border_missing() const { return parameters_.divided_z && swapped_; }
  /// Moments of the first and last plane.
  void end_advance(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share = 0);

  WallImpulse wall_impulse() const;
  Totals totals() const;
  /// Energy now, and its flows in a step that begins with \p force (empty: body force only). Costs a sweep.
  EnergyFlows energy(View<const Node4<Real>> force) const;
  /// Profiles of the current state; \p force is the field that acts (or acted last), empty = body force only.
  PlanarProfiles profiles(View<const Node4<Real>> force) const;

  /// Stress at a fluid node of the interior, from its populations: viscous = -(1 - 1/(2 tau)) Pi_neq, up to
  /// O(F^2). A random access: some 0.1 us.
  NodeStress stress(int i, int j, int k) const;

  /// Complete state, exact, independent of thread count and padding: a header, then the planes in order, so
  /// that the states of blocks divided along z can be cut and joined. load() wants the same block and Real.
  std::vector<std::byte> save() const;
  /// \throws InputError if \p state was not saved by a fluid of the same size and type.
  void load(View<const std::byte> state);

  /// Bytes that one advance() must move to and from memory per node: populations read and written, force
  /// read, velocity written (and its line fetched first): the figure for a roofline.
  static constexpr double bytes_per_node_advance() { return (2 * 19 + 4 + 2 * 4) * sizeof(Real); }
  /// The same of collide_and_stream() alone.
  static constexpr double bytes_per_node_collide() { return (2 * 19 + 4) * sizeof(Real); }
  /// The same of moments() alone.
  static constexpr double bytes_per_node_moments() { return (19 + 2 * 4) * sizeof(Real); }
  std::size_t memory_bytes() const;

 private:
  struct Slab {
    int begin, end;  ///< planes of one thread
  };
  int threads() const;
  Slab slab() const;
  std::size_t row(int j, int k) const { return rows_[(k + 1) * (std::size_t(block_.ny) + 2) + (j + 1)]; }
  bool below(int j) const { return parameters_.walls_y && j < 0; }
  bool above(int j) const { return parameters_.walls_y && j >= block_.ny; }
  void set_wall_terms();
  RowPointers<Real> locate(int j, int k, bool swapped) const;
  void locate_node(int i, int j, int k, bool swapped, Real* (&p)[directions],
                   Real (&wall_term)[directions]) const;
  void populations(int i, int j, int k, double (&f)[directions]) const;
  template <class Body>
  void visit_plane(int k, const Body& body) const;
  void set_populations(int i, int j, int k, const std::function<FlowPoint(double, double, double)>& flow);
  void collide_row(int j, int k, View<const Node4<Real>> force);
  void collide_node(int i, int j, int k, const Node4<Real>* force, double (&outgoing)[3],
                    double (&to_solid)[3]);
  void moments_row(int j, int k, bool swapped, View<Node4<Real>> velocity) const;
  void add_force(int j, int k, View<const Node4<Real>> force, Real share, View<Node4<Real>> velocity) const;
  void fill_ghosts(int j, int k);
  void return_ghosts(int j, int k, const RowPointers<Real>& pointers);
  bool border_plane(int k) const { return parameters_.divided_z && (k == 0 || k == block_.nz - 1); }
  template <bool with_moments>
  void step(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real force_share);

  Block block_;
  Parameters parameters_;
  Relaxation<Real> rate_;
  std::int64_t steps_ = 0;
  std::size_t fluid_nodes_ = 0;

  // Plane k is [direction][j][x]: 19 long streams, which the hardware prefetchers follow (19 short ones, rows
  // of [direction][x], ran at half the speed). Rows are padded to a multiple of 16 with room for x = nx and,
  // at the end of the row before, x = -1. rows_ maps j in [-1, ny], k in [-1, nz] to the row's first element
  // in direction 0: periodic images, or planes of their own for other blocks' borders.
  std::size_t pitch_ = 0, stride_ = 0;  ///< elements from row to row, from direction to direction
  std::vector<std::size_t> rows_;
  Array<Real> f_;
  bool swapped_ =
      false;  ///< after an odd number of steps: collided populations wait in their opposite's slot

  std::array<std::array<Real, directions>, 2> wall_term_{};  ///< 6 w_i c_i . u_wall where i leaves the wall
  std::array<Vec3, 2> wall_impulse_per_node_{};              ///< the part of the impulse due to wall_term_
  std::vector<Vec3> wall_sum_;                               ///< [2][nz] impulse of the last step
  std::vector<Vec3> solid_sum_;                              ///< [nz][ny], empty without solid

  enum Kind : std::uint8_t { solid_node, bulk_node, border_node };  ///< border: a neighbour is solid
  std::vector<std::uint8_t> solid_;                                 ///< with halo (periodic images)
  std::vector<std::uint8_t> kind_;                                  ///< interior nodes
  std::vector<std::uint8_t> mixed_;  ///< [nz][ny]: the row has nodes that are not bulk
};

/// State of a domain from the states of its blocks, in order along z. \throws InputError if they do not fit.
std::vector<std::byte> join_states(const std::vector<std::vector<std::byte>>& blocks);
/// State of the block that holds planes [first, first + planes) of a domain.
std::vector<std::byte> cut_state(View<const std::byte> domain, int first, int planes);

extern template class Fluid<float>;
extern template class Fluid<double>;

}  // namespace hemowalk::lbm
