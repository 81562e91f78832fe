#pragma once
/// \file DeviceSimulation: the step of simulation.hpp on a Queue's place, everything resident, one recorded
/// graph per step and no copy to the host inside it. Simulation is the definition of right, builds scenes and
/// reads results: states go to and fro.
///
/// On several ranks each has a device for its slab and its cells. A step is then a graph between any two
/// exchanges with the neighbours (device_border.hpp); cells pass from rank to rank through the host. Calls
/// marked (all) must be made by all ranks.

#include <array>
#include <memory>
#include <variant>
#include <vector>

#include "core/device.hpp"
#include "resolved/contact/device_contact.hpp"
#include "resolved/device_border.hpp"
#include "resolved/device_cells.hpp"
#include "resolved/ibm/device_markers.hpp"
#include "resolved/lbm/device_fluid.hpp"
#include "resolved/npfem/device_membranes.hpp"
#include "resolved/rigid/device_bodies.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

/// Seconds of each part of a step, averaged over the steps measured.
struct PartTimes {
  double locate = 0, interpolation = 0, contact = 0, solid = 0, spreading = 0, fluid = 0;
  double sum() const { return locate + interpolation + contact + solid + spreading + fluid; }
};

template <class Real>
class DeviceSimulation {
 public:
  /// Takes over scene and state of \p host (all), which stays as it is until download(), or until cells pass
  /// to other ranks; on several ranks it must outlive this. \throws InputError for what the device does not
  /// have: theta normal and tangential that differ, Helfrich bending, boxes below 16 dx, static solid nodes.
  DeviceSimulation(Queue& queue, Simulation<Real>& host);

  /// Enqueues one coupling step (all). Every check_interval steps it waits and looks for trouble. \throws
  /// PhysicsError naming cell and step.
  void step();
  /// Waits and looks for trouble now.
  void check() const;
  /// Waits and writes the state into \p host: fluid, cells, fields, momentum budget, summaries (all; on
  /// several ranks the host that was taken over).
  void download(Simulation<Real>& host) const;

  /// \p steps steps, each part timed on its own: launches one by one, without the graph.
  PartTimes time_parts(int steps);
  /// Kernels in one step's graph, on one rank.
  std::size_t kernels() const { return graphs_[0].empty() ? graphs_[1].size() : graphs_[0].size(); }
  std::int64_t fluid_steps() const { return fluid_steps_; }
  std::size_t memory_bytes() const;

  static constexpr int check_interval = 256;

 private:
  static constexpr std::size_t first_fluid_segment = 5;  ///< two per fluid step
  struct Group {
    std::variant<npfem::DeviceMembranes<Real>, rigid::DeviceBodies<Real>> cells;
    Array<int> ring_begin, ring, mirror;
    Array<Corners> triangle;
    Array<Real> mass, weight, inverse_metric;
    MirrorSurface surface;
    CellCoupling<Real> coupling;
    std::vector<std::int64_t> id;  ///< [cell]
  };
  void build_groups(const Simulation<Real>& host);
  void take_cells(const Simulation<Real>& host);
  void connect();
  void assign_bodies(const Simulation<Real>& host);
  void upload_impulses(const Simulation<Real>& host);
  void download_cells(Simulation<Real>& host) const;
  void hand_over();
  void book_loads(Momentum& taken) const;
  /// Slot on the host of each own slot here.
  std::vector<std::uint32_t> host_slots(const Simulation<Real>& host) const;
  BodyFields<Real> body_fields() {
    return {origin_.data(), vertex_.data(), site_.data(), reading_.data(), impulse_.data()};
  }

  // The parts of a step.
  void press();
  void move_cells();
  const Node4<Real>* force() const { return any_cells_ ? force_.data() : nullptr; }
  Real share_in(int fluid_step) const {
    return fluid_step + 1 == scene_.coupling.solid_every ? share_ : Real(0);
  }
  /// The step on one rank, part by part; \p after(part) is called after each.
  template <class After>
  void enqueue(const After& after);
  void step_divided();
  template <class Work>
  void run(std::size_t segment, int fluid_steps, const Work& work);

  Queue& queue_;
  Simulation<Real>& host_;
  data::Scene scene_;
  Block block_;
  double h_;
  Real share_;                          ///< of F in what interpolation reads
  bool any_cells_;                      ///< on any rank
  std::size_t bodies_ = 0, slots_ = 0;  ///< own; arrays hold copies of the neighbours' behind them
  double depth_ = 0;                    ///< largest distance between a vertex and its coupling point, dx
  lbm::DeviceFluid<Real> fluid_;
  std::unique_ptr<ibm::DeviceMarkers<Real>> markers_;
  std::unique_ptr<contact::DeviceContact<Real>> contact_;
  std::unique_ptr<DeviceBorder<Real>> border_;  ///< on several ranks
  std::vector<Group> groups_;
  Array<Node4<Real>> velocity_, force_;
  Array<Node4<Real>> reading_, impulse_, vertex_, site_;
  Array<ibm::Origin> origin_;
  std::vector<Graph> graphs_;  ///< [segment][parity of the fluid]
  std::int64_t fluid_steps_, first_step_, steps_ = 0;
  std::int64_t loads_since_;  ///< fluid step from which point loads are not in taken_before_ yet
  Momentum taken_before_;
};

extern template class DeviceSimulation<float>;
extern template class DeviceSimulation<double>;

}  // namespace hemowalk::resolved
