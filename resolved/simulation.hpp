#pragma once
/// \file Simulation: fluid, membranes, rigid bodies, coupling and contact together, in lattice units.
/// step() is the method, line by line. Nothing here knows about files or SI units.
///
/// On several ranks each holds a slab of the fluid and the cells with their centre in it (decomposition.hpp,
/// copies.hpp). Calls marked (all) must then be made by all ranks.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "core/array.hpp"
#include "core/block.hpp"
#include "core/data/scene.hpp"
#include "core/mpi.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/contact/kernel_contact.hpp"
#include "resolved/copies.hpp"
#include "resolved/decomposition.hpp"
#include "resolved/energy.hpp"
#include "resolved/ibm/markers.hpp"
#include "resolved/lbm/fluid.hpp"
#include "resolved/mirror_surface.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/region.hpp"
#include "resolved/rigid/rigid.hpp"
#include "resolved/surface_traction.hpp"
#include "resolved/units.hpp"

namespace hemowalk::resolved {

/// A cell at the start, lattice units from the block's corner.
struct InitialCell {
  int kind = 0;  ///< index into Scene::cells.kinds
  mesh::Vec3 centre{};
  mesh::Quaternion orientation = mesh::identity_rotation;
  std::vector<mesh::Vec3> vertices;  ///< deformed shape, absolute; empty = rest shape
};

/// All cells of one kind on this rank.
template <class Real>
struct Group {
  std::variant<npfem::Membranes<Real>, rigid::RigidBodies<Real>> cells;
  int kind = 0;                    ///< index into Scene::cells.kinds
  std::int32_t first_body = 0;     ///< body number of its first cell
  std::uint32_t first_marker = 0;  ///< of vertex k of cell c: first_marker + layout().at(c, k)
  std::vector<double> mass;        ///< [V] m_k: excess over the displaced fluid (paper: whole; peskin: none)
  std::vector<double> weight;      ///< [V] a_k = chi rho A_k dx (paper, peskin: A_k)
  MirrorSurface surface = {};      ///< deformable platelets

  int count() const {
    return std::visit([](const auto& g) { return g.count(); }, cells);
  }
  std::uint32_t marker(int c, int k) const {
    return first_marker +
           static_cast<std::uint32_t>(std::visit([&](const auto& g) { return g.layout().at(c, k); }, cells));
  }
};

/// Where the time of a step goes on this rank, seconds since the last reset.
struct Timings {
  double fluid = 0, interpolation = 0, spreading = 0, solid = 0, contact = 0;
  double communication = 0;  ///< packing, sending and waiting for other ranks; 0 on one rank
  double other = 0;
  std::int64_t steps = 0;  ///< fluid steps

  double accounted() const { return fluid + interpolation + spreading + solid + contact + communication; }
};

/// Sums over the whole system for the momentum budget: what the fluid and the cells hold, what walls have
/// taken.
struct Momentum {
  std::array<double, 3> fluid{}, cells{};
  std::array<double, 3> to_lower_wall{}, to_upper_wall{};  ///< since the start: fluid + spread + contact
  std::array<double, 3> to_solid{};                        ///< static solid nodes, likewise
  std::array<double, 3> from_body_force{};                 ///< since the start
  std::array<double, 3> from_loads{};                      ///< since the start

  /// What no step may change.
  std::array<double, 3> total() const;
  /// Sum of the magnitudes of all entries but the cells': what an error of the total is compared with.
  double scale() const;
};

template <class Real>
class DeviceSimulation;

template <class Real>
class Simulation {
 public:
  /// Lattice, cells and steady initial flow. \p cells: all of them, on every rank; their place in the list is
  /// their id. \throws InputError when the scene cannot be simulated, or not on so many ranks (all).
  Simulation(const data::Scene& scene, const std::vector<InitialCell>& cells, mpi::Ranks ranks = {});

  /// One coupling step: `solid_every` fluid steps and one solid step (all). \throws PhysicsError naming cell
  /// and step. With \p budget also where its power goes, which costs some sweeps over fluid and cells.
  void step(EnergyBudget* budget = nullptr);

  const data::Scene& scene() const { return scene_; }
  const LatticeUnits& units() const { return units_; }
  const mpi::Ranks& ranks() const { return decomposition_.ranks(); }
  const Decomposition& decomposition() const { return decomposition_; }
  /// This rank's slab; the domain is decomposition().whole().
  const Block& block() const { return block_; }
  const lbm::Fluid<Real>& fluid() const { return fluid_; }
  /// One group per kind that occurs, on every rank; its cells are those of this rank.
  const std::vector<Group<Real>>& groups() const { return groups_; }
  std::vector<Group<Real>>& groups() { return groups_; }
  /// Cells on this rank.
  int bodies() const { return static_cast<int>(bodies_); }
  std::int64_t fluid_steps() const { return fluid_steps_; }
  /// Physical time, s.
  double time() const { return units_.to_time(static_cast<double>(fluid_steps_)); }

  /// Force density of the last step (momentum per node and fluid step), interior of this rank's slab.
  View<const Node4<Real>> force() const { return force_.view(); }
  /// What interpolation reads: u* + theta/2 F_prev with halo.
  View<const Node4<Real>> velocity() const { return velocity_.view(); }
  /// Who moves the cells instead of the groups themselves (place.solid: device).
  struct SolidElsewhere {
    /// From predicted() to positions, velocities and normals; a report per group of `moved` (all). Empty: the
    /// groups do it.
    std::function<std::vector<mesh::StepReport>(const mesh::StepOptions&)> step;
    const std::vector<Group<Real>>* moved = nullptr;  ///< the cells that are moved on this rank
    /// Before cells come or go: all of their state into the groups; after it.
    std::function<void()> give_back, take_over;
    std::function<void()> restart;  ///< a state was loaded (all)
  };
  void set_solid(SolidElsewhere solid) { solid_ = std::move(solid); }
  bool solid_is_elsewhere() const { return static_cast<bool>(solid_.step); }
  /// The cells whose solid step this rank takes.
  const std::vector<Group<Real>>& moved() const { return solid_.moved ? *solid_.moved : groups_; }
  /// Who advances the fluid instead of the lattice Boltzmann fluid: writes the velocity that markers read,
  /// with the given share of the force (all nodes, halo excepted). Empty: the fluid.
  using FluidStep =
      std::function<void(View<const Node4<Real>> force, View<Node4<Real>> velocity, Real share)>;
  void set_fluid_step(FluidStep step) { fluid_step_ = std::move(step); }
  /// Of this rank's cells.
  const contact::Summary& contact_summary() const { return contact_summary_; }
  /// Force of the cells on this rank's part of the lower and the upper wall in the last step, through kernels
  /// and by contact.
  const std::array<std::array<double, 3>, 2>& force_on_walls() const { return force_on_walls_; }
  /// Of the whole system (all).
  Momentum momentum() const;
  /// Of the whole fluid (all).
  lbm::Totals totals() const;
  /// Root mean square over all membrane markers of |v - I[u]|, u = u* + F/2 after the step; costs an
  /// interpolation (all). NaN where the whole step is on a device.
  double slip_rms();
  const mesh::StepReport& solid_report() const { return solid_report_; }
  Timings& timings() { return timings_; }
  std::size_t memory_bytes() const;
  /// Markers that this rank interpolates and spreads.
  std::size_t markers() const { return markers_->active(); }
  /// What this rank sends to its neighbours in a step.
  std::size_t bytes_per_step() const;
  /// Cells that came to this rank from another since the start.
  std::int64_t arrivals() const { return arrivals_; }

  /// This rank's part of the state, exact: a restart on as many ranks continues bit for bit.
  std::vector<std::byte> save() const;
  /// Takes back a part saved by the same rank of as many, or made by redistribute() (all).
  void load(View<const std::byte> state);

 private:
  friend class DeviceSimulation<Real>;  // takes over the state and gives it back
  void build_groups(const std::vector<InitialCell>& cells);
  void find_loads(const std::vector<InitialCell>& cells);
  void build_coupling();
  void arrange();
  void fit_arrays();
  void start_flow();
  void find_cells();
  void read_positions();
  void share_positions();
  void set_contact_bodies();
  void read_field(View<const Node4<Real>> field, View<Node4<Real>> reading);
  void fill_halo(View<Node4<Real>> velocity);
  void press();
  void move_cells();
  void check_finite(const Group<Real>& group, const mesh::StepReport& report) const;
  void spread(double steps);
  void take_force_from_solid(double steps);
  /// Of the markers on the fluid; none without cells.
  View<const Node4<Real>> present_force() const {
    return any_cells_ ? View<const Node4<Real>>(force_.view()) : View<const Node4<Real>>{};
  }
  void stream_and_collide(Real force_share);
  void advance_fluid(Real force_share);
  void hand_over(Copies<Real>& copies);
  void check_lengths(View<const Extent> extents) const;
  // The three couplings, coupling_*.cpp: cells move by h_, the fluid gets force_ (docs/adr/0011).
  void couple_conservative();
  void retract();
  void predict();
  void impulses();
  void open_budget(EnergyBudget& budget) const;
  void count_fluid(EnergyBudget& budget, View<const Node4<Real>> force, bool first) const;
  void close_budget(EnergyBudget& budget);
  double wall_work() const;
  double kinetic_energy() const;
  void couple_paper();
  void read_normals();
  void fluid_forces();
  void drive_fluid(int fluid_step);
  void read_momentum(bool with_force);
  void couple_peskin();
  void membrane_forces();
  void add_half_force();
  void follow_fluid();
  /// Interpolation reads u* + this share of F where one theta serves both directions.
  Real velocity_share() const {
    return scheme_ == Scheme::conservative && one_theta_ ? static_cast<Real>(0.5 * scene_.coupling.theta_n)
                                                         : Real(0);
  }
  lbm::Vec3 half_body_force() const;

  data::Scene scene_;
  LatticeUnits units_;
  Decomposition decomposition_;
  Block block_;
  ibm::Faces faces_;
  Region region_;
  lbm::Fluid<Real> fluid_;
  FieldExchange<Real> fields_;
  std::vector<Group<Real>> groups_;
  bool any_cells_ = false;  ///< on any rank
  std::size_t bodies_ = 0, slots_ = 0;
  double h_ = 1;  ///< solid time step in fluid steps
  using Scheme = data::Coupling::Scheme;
  Scheme scheme_ = Scheme::conservative;
  bool one_theta_ = true;  ///< theta_n == theta_t: one field carries velocity and correction

  std::unique_ptr<ibm::Markers<Real>> markers_;
  std::unique_ptr<contact::Contact<Real>> contact_;
  std::unique_ptr<Copies<Real>> copies_;
  struct Paper {  ///< what coupling: paper keeps beside the rest
    std::unique_ptr<contact::KernelContact<Real>> contact;
    std::vector<OneRings> rings;  ///< [group]
    Array<Node4<Real>> normal;    ///< [slot]
    Array<Node4<Real>> momentum;  ///< field with halo: rho u and rho - 1
  };
  std::unique_ptr<Paper> paper_;
  Array<Node4<Real>> velocity_, force_;  ///< fields with halo
  // Arrays of bodies and slots hold this rank's own, then the neighbours' copies; they never shrink.
  Array<ibm::Origin> origin_;                   ///< [body]
  Array<Extent> extent_;                        ///< [own body], on several ranks
  Array<Node4<Real>> vertices_, sites_;         ///< [slot] relative to origin: membrane, retracted
  Array<Node4<Real>> reading_, force_reading_;  ///< [slot] I[.]; after predict(): w
  Array<Node4<Real>> impulse_, contact_force_;  ///< [slot]
  Array<Real> normal_rate_, couple_force_;  ///< [slot / lanes][3][lane]: delta dn/dt, forces of the couples
  Array<Real> scratch_;                     ///< [thread][scratch_stride_]
  std::size_t scratch_stride_ = 0;
  struct PointLoad {
    std::int64_t cell;
    int vertex;
    std::array<double, 3> force;
    std::int64_t slot = -1;  ///< negative: the cell is on another rank
  };
  std::vector<PointLoad> loads_;
  Ring handing_over_;
  std::int64_t arrivals_ = 0;

  SolidElsewhere solid_;
  FluidStep fluid_step_;
  contact::Summary contact_summary_;
  std::array<std::array<double, 3>, 2> force_on_walls_{};
  mesh::StepReport solid_report_;
  std::vector<std::size_t> solid_nodes_;  ///< static solid, in the fields
  std::int64_t fluid_steps_ = 0;
  Momentum taken_;  ///< accumulated parts of the budget, of this rank
  Timings timings_;
};

/// The state that \p parts (one per rank, in order) saved, cut for \p ranks ranks instead. Sums then differ
/// in their round-off. \throws InputError when a part is damaged.
template <class Real>
std::vector<std::vector<std::byte>> redistribute(const std::vector<std::vector<std::byte>>& parts,
                                                 const Block& whole, int ranks);

extern template class Simulation<float>;
extern template class Simulation<double>;

}  // namespace hemowalk::resolved
