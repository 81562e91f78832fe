#pragma once
/// \file Simulation: fluid, membranes, rigid bodies, coupling and contact together, in lattice units.
/// step() is the method, line by line (coupling: conservative). Nothing here knows about files or SI units.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "core/array.hpp"
#include "core/block.hpp"
#include "core/data/scene.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/ibm/markers.hpp"
#include "resolved/lbm/fluid.hpp"
#include "resolved/npfem/membranes.hpp"
#include "resolved/rigid/rigid.hpp"
#include "resolved/units.hpp"

namespace hemowalk::resolved {

/// A cell at the start, lattice units from the block's corner.
struct InitialCell {
  int kind = 0;  ///< index into Scene::cells.kinds
  mesh::Vec3 centre{};
  mesh::Quaternion orientation = mesh::identity_rotation;
  std::vector<mesh::Vec3> vertices;  ///< deformed shape, absolute; empty = rest shape
};

/// All cells of one kind.
template <class Real>
struct Group {
  std::variant<npfem::Membranes<Real>, rigid::RigidBodies<Real>> cells;
  int kind = 0;                    ///< index into Scene::cells.kinds
  std::int32_t first_body = 0;     ///< global number of its first cell
  std::uint32_t first_marker = 0;  ///< of vertex k of cell c: first_marker + layout().at(c, k)
  std::vector<double> mass;        ///< [V] m_k: excess over the displaced fluid
  std::vector<double> weight;      ///< [V] a_k = chi rho A_k dx

  int count() const {
    return std::visit([](const auto& g) { return g.count(); }, cells);
  }
  std::uint32_t marker(int c, int k) const {
    return first_marker +
           static_cast<std::uint32_t>(std::visit([&](const auto& g) { return g.layout().at(c, k); }, cells));
  }
};

/// Where the time of a step goes, seconds since the last reset.
struct Timings {
  double fluid = 0, interpolation = 0, spreading = 0, solid = 0, contact = 0, other = 0;
  std::int64_t steps = 0;  ///< fluid steps
};

/// Sums over the whole system for the momentum budget: what the fluid and the cells hold, what walls have
/// taken.
struct Momentum {
  std::array<double, 3> fluid{}, cells{};
  std::array<double, 3> to_lower_wall{}, to_upper_wall{};  ///< since the start: fluid + spread + contact
  std::array<double, 3> from_body_force{};                 ///< since the start
  std::array<double, 3> from_loads{};                      ///< since the start
};

template <class Real>
class DeviceSimulation;

template <class Real>
class Simulation {
 public:
  /// Lattice, cells and steady initial flow. \throws InputError when the scene cannot be simulated.
  Simulation(const data::Scene& scene, const std::vector<InitialCell>& cells);

  /// One coupling step: `solid_every` fluid steps and one solid step. \throws PhysicsError naming cell and
  /// step.
  void step();

  const data::Scene& scene() const { return scene_; }
  const LatticeUnits& units() const { return units_; }
  const Block& block() const { return block_; }
  const lbm::Fluid<Real>& fluid() const { return fluid_; }
  const std::vector<Group<Real>>& groups() const { return groups_; }
  std::vector<Group<Real>>& groups() { return groups_; }
  int bodies() const { return static_cast<int>(bodies_); }
  std::int64_t fluid_steps() const { return fluid_steps_; }
  /// Physical time, s.
  double time() const { return units_.to_time(static_cast<double>(fluid_steps_)); }

  /// Force density of the last step (momentum per node and fluid step), interior.
  View<const Node4<Real>> force() const { return force_.view(); }
  /// What interpolation reads: u* + theta/2 F_prev with halo.
  View<const Node4<Real>> velocity() const { return velocity_.view(); }
  /// Who moves the cells instead of the groups themselves: from predicted() to positions, velocities and
  /// normals, a report per group (place.solid: device). Empty: the groups.
  using SolidStep = std::function<std::vector<mesh::StepReport>(const mesh::StepOptions&)>;
  void set_solid_step(SolidStep step) { solid_step_ = std::move(step); }
  const contact::Summary& contact_summary() const { return contact_summary_; }
  /// Force of the cells on the lower and the upper wall in the last step, through kernels and by contact.
  const std::array<std::array<double, 3>, 2>& force_on_walls() const { return force_on_walls_; }
  Momentum momentum() const;
  /// Root mean square over membrane markers of |v - I[u]|, u = u* + F/2 after the step; costs an
  /// interpolation.
  double slip_rms();
  const mesh::StepReport& solid_report() const { return solid_report_; }
  Timings& timings() { return timings_; }
  std::size_t memory_bytes() const;
  std::size_t markers() const { return markers_->active(); }

  /// Complete state, exact: a restart on the same block continues bit for bit.
  std::vector<std::byte> save() const;
  void load(View<const std::byte> state);

 private:
  friend class DeviceSimulation<Real>;  // takes over the state and gives it back
  void build_groups(const std::vector<InitialCell>& cells);
  void build_coupling();
  void start_flow();
  void read_positions();
  void retract();
  void predict();
  void move_cells();
  void impulses();
  void complete_velocity();
  void add_loads();
  lbm::Vec3 half_body_force() const;

  data::Scene scene_;
  LatticeUnits units_;
  Block block_;
  ibm::Faces faces_;
  lbm::Fluid<Real> fluid_;
  std::vector<Group<Real>> groups_;
  std::size_t bodies_ = 0, slots_ = 0;
  double h_ = 1;           ///< solid time step in fluid steps
  bool one_theta_ = true;  ///< theta_n == theta_t: one field carries velocity and correction

  std::unique_ptr<ibm::Markers<Real>> markers_;
  std::unique_ptr<contact::Contact<Real>> contact_;
  Array<Node4<Real>> velocity_, force_;         ///< fields with halo
  Array<ibm::Origin> origin_;                   ///< [body]
  Array<Node4<Real>> vertices_, sites_;         ///< [slot] relative to origin: membrane, retracted
  Array<Node4<Real>> reading_, force_reading_;  ///< [slot] I[.]; after predict(): w
  Array<Node4<Real>> impulse_, contact_force_;  ///< [slot]
  Array<Real> normal_rate_, couple_force_;  ///< [slot / lanes][3][lane]: delta dn/dt, forces of the couples
  Array<Real> scratch_;                     ///< [thread][scratch_stride_]
  std::size_t scratch_stride_ = 0;
  struct PointLoad {
    std::uint32_t slot;
    std::array<double, 3> force;
  };
  std::vector<PointLoad> loads_;

  SolidStep solid_step_;
  contact::Summary contact_summary_;
  std::array<std::array<double, 3>, 2> force_on_walls_{};
  mesh::StepReport solid_report_;
  std::int64_t fluid_steps_ = 0;
  Momentum taken_;  ///< accumulated parts of the budget
  Timings timings_;
};

extern template class Simulation<float>;
extern template class Simulation<double>;

}  // namespace hemowalk::resolved
