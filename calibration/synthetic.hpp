#pragma once
/// \file Trajectories with a known answer: reflected diffusion in a slab, D(y), velocity memory, jumps.

#include <cstdint>

#include "core/data/trajectories.hpp"

namespace hemowalk::calibration {

struct Synthetic {
  int platelets = 95;
  double duration = 1, sample = 1e-3;       ///< s
  double gap = 50e-6;                       ///< m, walls at 0 and gap, reflecting
  double D = 1e-10;                         ///< m2/s, at the centre
  double D_contrast = 0;                    ///< D(y) = D (1 + contrast cos(2 pi y/gap)) ... 0 = constant
  double memory = 0;                        ///< s; 0 = Brownian, else Ornstein-Uhlenbeck velocity
  double jump_fraction = 0, jump_size = 0;  ///< share of samples hit by a jump of rms size, m
  double shear_rate = 100;                  ///< 1/s, advects z
  std::uint64_t seed = 1;
};

/// The true D at height y, m2/s.
double true_D(const Synthetic& truth, double y);
data::Trajectories generate(const Synthetic& truth);

}  // namespace hemowalk::calibration
