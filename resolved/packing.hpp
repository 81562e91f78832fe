#pragma once
/// \file Packing: where cells are and what shape they have before the fluid starts (method 7), and how many
/// there are.
///
/// Cells start as half-sized bodies, without overlap, at random positions and orientations; equivalently, as
/// full-sized bodies in a box twice as large. The box then shrinks, step by step, while contact keeps the
/// surfaces apart and the membranes give way; no fluid. The deformed shapes are kept. Done when the measured
/// gap between any two surfaces, and to the walls, is positive and no vertex is inside another body: never
/// after a fixed time.

#include <vector>

#include "core/data/scene.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

/// Smallest gap a packing may end with, dx.
inline constexpr double smallest_packed_gap = 0.1;

struct PackingReport {
  int iterations = 0;
  double minimum_gap = 0;       ///< between surfaces, dx (infinite: nobody within reach)
  double minimum_wall_gap = 0;  ///< dx
  double volume_error_max = 0;  ///< of the deformable cells, relative
  double seconds = 0;           ///< wall time
};

/// The cells of \p scene: explicit placements in their order, else as many as census() counts, kind by kind.
/// Centres lie in the box, shapes in one piece. A pure function of the scene: the same bits for any number of
/// threads. \throws InputError when placements overlap or the hematocrit cannot be packed, with the measured
/// overlap.
std::vector<InitialCell> pack(const data::Scene& scene, PackingReport* report = nullptr);

}  // namespace hemowalk::resolved
