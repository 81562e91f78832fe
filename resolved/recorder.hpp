#pragma once
/// \file Recorder: samples a running simulation into a data::Trajectories, in physical units. All ranks call
/// it, the root's record is complete: cells in the order of their ids. Elsewhere it holds no cells.

#include <vector>

#include "core/data/trajectories.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

template <class Real>
class Recorder {
 public:
  /// Head of the record: conditions, walls, Ca and Re (r = 3.91 um, the red cell's radius; G_s of the first
  /// membrane).
  explicit Recorder(const Simulation<Real>& simulation);

  /// Positions, orientations and shapes of all cells, and the diagnostics, at the present time. \p budget: of
  /// the last step.
  void sample(Simulation<Real>& simulation, const EnergyBudget& budget = {});
  /// Adds the present planar fields to the running profile averages.
  void accumulate_profile(const Simulation<Real>& simulation);
  /// Closes the averages since the last call into one profile at the present time.
  void close_profile(const Simulation<Real>& simulation);

  const data::Trajectories& trajectories() const { return record_; }
  data::Trajectories& trajectories() { return record_; }
  /// Sums not yet closed and the references of the budgets: part of a checkpoint.
  std::vector<double> save() const;
  void load(const std::vector<double>& state);

 private:
  void sample_cells(const Simulation<Real>& simulation);
  void sample_diagnostics(Simulation<Real>& simulation, const EnergyBudget& budget);

  data::Trajectories record_;
  int planes_ = 0, averaged_ = 0;
  std::vector<double> velocity_sum_, fluid_stress_sum_, force_sum_, hematocrit_sum_;
  std::array<double, 3> momentum_start_{};
  double mass_start_ = 0, wall_force_sum_ = 0;
  bool started_ = false;
};

extern template class Recorder<float>;
extern template class Recorder<double>;

}  // namespace hemowalk::resolved
