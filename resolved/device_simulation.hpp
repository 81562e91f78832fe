#pragma once
/// \file DeviceSimulation: the step of simulation.hpp on a Queue's place, everything resident, one recorded
/// graph per step and no copy to the host inside it. Simulation is the definition of right, builds scenes and
/// reads results: states go to and fro.

#include <array>
#include <memory>
#include <variant>
#include <vector>

#include "core/device.hpp"
#include "resolved/contact/device_contact.hpp"
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
  /// Takes over scene and state of \p host, which stays as it is until download(). \throws InputError for
  /// what the device does not have: theta normal and tangential that differ, Helfrich bending, boxes below 16
  /// dx, static solid nodes.
  DeviceSimulation(Queue& queue, const Simulation<Real>& host);

  /// Enqueues one coupling step. Every check_interval steps it waits and looks for trouble. \throws
  /// PhysicsError naming cell and step.
  void step();
  /// Waits and looks for trouble now.
  void check() const;
  /// Waits and writes the state into \p host: fluid, cells, fields, momentum budget, summaries.
  void download(Simulation<Real>& host) const;

  /// \p steps steps, each part timed on its own: launches one by one, without the graph.
  PartTimes time_parts(int steps);
  /// Kernels in one step's graph.
  std::size_t kernels() const { return graph_[0].empty() ? graph_[1].size() : graph_[0].size(); }
  std::int64_t fluid_steps() const { return fluid_steps_; }
  std::size_t memory_bytes() const;

  static constexpr int check_interval = 256;

 private:
  struct Group {
    std::variant<npfem::DeviceMembranes<Real>, rigid::DeviceBodies<Real>> cells;
    Array<int> ring_begin, ring;
    Array<Corners> triangle;
    Array<Real> mass, weight, inverse_metric;
    CellCoupling<Real> coupling;
  };
  void build_groups(const Simulation<Real>& host);
  void upload_impulses(const Simulation<Real>& host);
  /// Slot on the host of each slot here.
  std::vector<std::uint32_t> host_slots(const Simulation<Real>& host) const;
  /// The step, part by part; \p after(part) is called after each.
  template <class After>
  void enqueue(const After& after);

  Queue& queue_;
  data::Scene scene_;
  Block block_;
  double h_;
  Real share_;  ///< of F in what interpolation reads
  std::size_t bodies_ = 0, slots_ = 0;
  double depth_ = 0;  ///< largest distance between a vertex and its coupling point, dx
  lbm::DeviceFluid<Real> fluid_;
  std::unique_ptr<ibm::DeviceMarkers<Real>> markers_;
  std::unique_ptr<contact::DeviceContact<Real>> contact_;
  std::vector<Group> groups_;
  Array<Node4<Real>> velocity_, force_;
  Array<Node4<Real>> reading_, impulse_, vertex_, site_;
  Array<ibm::Origin> origin_;
  Graph graph_[2];
  std::int64_t fluid_steps_, first_step_, steps_ = 0;
  Momentum taken_before_;
};

extern template class DeviceSimulation<float>;
extern template class DeviceSimulation<double>;

}  // namespace hemowalk::resolved
