#pragma once
/// \file DeviceMembranes: the cells of a Membranes group on a Queue's place, one block of threads per cell.

#include "core/device.hpp"
#include "resolved/npfem/device_step.hpp"
#include "resolved/npfem/membranes.hpp"

namespace hemowalk::npfem {

template <class Real>
class DeviceMembranes {
 public:
  using Step = MembraneStep<Real>;

  /// Takes over the type and the cells of \p host. \throws InputError for laws the device does not have
  /// (Helfrich bending, the volume force as printed in the paper) and for meshes too large for a block of it.
  DeviceMembranes(Queue& queue, const Membranes<Real>& host);

  int count() const { return count_; }
  int vertices() const { return tables_.vertices; }
  const MembraneTables<Real>& tables() const { return tables_; }
  const mesh::CellFields<Real>& fields() const { return fields_; }
  /// The kernel, for drivers that put more work before and after it in the same launch.
  Step body(const StepOptions& options) const;
  std::size_t shared_bytes() const { return body({}).shared_bytes(); }
  /// Enqueues one solid step of all cells from fields().predicted. Membranes::step defines what it does.
  void step(const StepOptions& options = {});

  /// All cells' states, in order, without loss. Both wait. upload() takes over any number of cells: fields()
  /// and body() are new then.
  void upload(const Membranes<Real>& host);
  void download(Membranes<Real>& host) const;
  /// Of the last step; waits.
  StepReport report() const;
  std::size_t memory_bytes() const;

 private:
  void make_tables(const CellType& type);
  void fit(int count);

  Queue& queue_;
  int count_ = 0;
  MembraneTables<Real> tables_{};
  mesh::CellFields<Real> fields_{};
  Array<typename Tables<Real>::TriangleRow> triangle_;
  Array<typename Tables<Real>::EdgeRow> edge_;
  Array<int> ring_begin_, ring_, hinge_begin_, lap_begin_, lap_index_;
  Array<Hinge<Real>> hinge_;
  Array<Real> metric_, mass_rate_, kappa_, inverse_, lap_value_;
  Array<double> anchor_;
  Array<Real> offset_, residual_, velocity_, normal_, predicted_;
  Array<CellReport<Real>> report_;
};

extern template class DeviceMembranes<float>;
extern template class DeviceMembranes<double>;

}  // namespace hemowalk::npfem
