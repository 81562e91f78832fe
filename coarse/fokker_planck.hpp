#pragma once
/// \file The Fokker-Planck equation of the Gaussian walk, dc/dt = -d/dy (v c - D c'), by finite volumes: no
/// noise, milliseconds instead of seconds. Cross-check of the walk, and the solver of the law's ensemble.

#include <array>
#include <vector>

#include "coarse/case.hpp"
#include "coarse/slab_law.hpp"

namespace hemowalk::coarse {

/// Uniform cells; exponentially fitted fluxes (Scharfetter-Gummel: exact for steady states with constant v
/// and D per face, never negative), second order in the cell size. Time: two-stage singly diagonally implicit
/// Runge-Kutta, L-stable, second order; both stages share one factorised tridiagonal matrix. What the faces
/// took is part of the unknowns, so mass is conserved to round-off.
class FokkerPlanck {
 public:
  /// c = 1 everywhere, traps empty. \p cells >= 8. \throws InputError for a trap without a layer.
  FokkerPlanck(const SlabLaw& law, const Face& bottom, const Face& top, int cells,
               double cell_free_layer = 0);

  /// Gathers all walkers in the layer [low, high], m, evenly; the mean over the slab stays 1.
  void release(double low, double high);

  /// Integrates over \p duration, s, in \p steps equal steps. Cost: about 20 ns per cell and step.
  void advance(double duration, int steps);

  /// Fraction of all walkers that the faces took for good, and that traps hold (bottom, top).
  double absorbed() const { return taken(false); }
  double trapped() const { return taken(true); }
  /// [cells] concentration relative to walkers spread over the whole slab.
  std::vector<double> concentration() const { return {unknown_.begin() + 1, unknown_.end() - 1}; }
  /// Mean over equal bins; \p bins divides the number of cells.
  std::vector<double> profile(int bins) const;
  int cells() const { return static_cast<int>(unknown_.size()) - 2; }

 private:
  void add_interior(const SlabLaw& law);
  void add_face(const SlabLaw& law, const Face& face, int side, double cell_free_layer);
  double taken(bool by_traps) const;
  void factorise(double step);
  void solve(std::vector<double>& right) const;
  void rate(const std::vector<double>& u, std::vector<double>& result) const;

  bool periodic_ = false;
  std::array<bool, 2> trap_{};
  double cell_ = 0, height_ = 0, factorised_for_ = -1;
  /// Unknowns: amount at the bottom face (in cells), c of the cells, amount at the top face.
  std::vector<double> unknown_;
  std::vector<double> lower_, middle_, upper_;  ///< du/dt = tridiagonal * u (+ corners when periodic)
  double corner_top_ = 0, corner_bottom_ = 0;   ///< first cell from last cell, last cell from first cell
  std::vector<double> factor_lower_, factor_middle_, factor_upper_, correction_;
  double correction_scale_ = 0, weight_last_ = 0;
  std::vector<double> stage_one_, stage_two_;
};

}  // namespace hemowalk::coarse
