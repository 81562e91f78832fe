#pragma once
/// \file EvenSolid: DeviceSolid with the cells dealt out evenly to the devices of all ranks, once and for all
/// (the published program's distribution), whatever rank holds the fluid around a cell: its owner. In every
/// step the owner sends v_pred to the cell's solver and gets positions, velocities and normals back. The
/// solver's state stays where it is when a cell passes to another owner.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mpi.hpp"
#include "resolved/device_solid.hpp"

namespace hemowalk::resolved {

template <class Real>
class EvenSolid {
 public:
  /// Takes over the cells of \p owned, the groups of a simulation, which must outlive this (all).
  /// \p timings: its; step() is timed as solid, and takes messages out of it.
  EvenSolid(Place place, std::vector<Group<Real>>& owned, mpi::Ranks ranks, Timings& timings);

  /// One solid step of all cells, from and to the owners' fields (all). \returns a report per group of
  /// solved().
  std::vector<mesh::StepReport> step(const mesh::StepOptions& options);
  /// As DeviceSolid::download(), after a step or take_over() (all).
  void download();
  /// The owners have other cells, or others' states, by more than cells that passed (all).
  void take_over();
  /// The cells that this rank's device solves. Kind by kind in the order of their ids they are dealt out in
  /// turn: numbers differ by one at most between ranks, in all and of each kind.
  const std::vector<Group<Real>>& solved() const { return solved_; }

 private:
  using Bytes = std::vector<std::byte>;
  struct Cell {
    std::int32_t group, index;
  };
  void deal();
  template <class Record>
  void ask();
  template <class Record>
  void answer();
  void exchange();

  std::vector<Group<Real>>& owned_;
  mpi::Ranks ranks_;
  Timings& timings_;
  std::vector<Group<Real>> solved_;
  DeviceSolid<Real> device_;
  std::vector<std::int32_t> solver_;                ///< [id] rank
  std::vector<Cell> place_;                         ///< [id] in solved_
  std::vector<std::vector<Cell>> asked_, answers_;  ///< [rank] cells of owned_, of solved_
  std::vector<Bytes> outgoing_, incoming_;          ///< [rank]
  mpi::Messages messages_;
  double exchanging_ = 0;  ///< s
};

extern template class EvenSolid<float>;
extern template class EvenSolid<double>;

}  // namespace hemowalk::resolved
