#pragma once
/// \file Trajectories with a known answer: reflected diffusion in a slab, D(y), velocity memory, jumps.

#include <cstdint>

#include "core/data/trajectories.hpp"

namespace hemowalk::calibration {

struct Synthetic {
  int platelets = 95;
  double duration = 1, sample = 1e-3;  ///< s
  double gap = 50e-6;                  ///< m, walls at 0 and gap, reflecting
  double D = 1e-10;                    ///< m2/s, mean over the gap
  double D_contrast = 0;  ///< D(y) = D (1 + contrast cos(2 pi y/gap)); |contrast| < 1; 0 = constant
  double memory = 0;      ///< s; 0 = Brownian, else Ornstein-Uhlenbeck velocity
  double jump_fraction = 0,
         jump_size = 0;      ///< share of samples hit by a lasting Gaussian jump of rms size, m
  double shear_rate = 100;   ///< 1/s, advects z
  double hematocrit = 0.35;  ///< a label, carried along
  std::uint64_t seed = 1;
};

/// The true D at height y, m2/s (without jumps).
double true_D(const Synthetic& truth, double y);
/// Mean of the true D over [low, high], m2/s: what an estimator of that layer should find without jumps.
double true_layer_D(const Synthetic& truth, double low, double high);
/// What the jumps add to the long-time D: fraction size^2/(2 sample), m2/s.
double jump_D(const Synthetic& truth);

/// Platelets spread uniformly over the gap, walking with the zero-flux drift (Ito drift D'), so that uniform
/// stays uniform. Constant D, with or without memory, is exact at the samples: the free walk is folded at the
/// walls. D(y) is walked in 8 substeps per sample by Milstein's scheme; with memory the velocity is that of
/// an Ornstein-Uhlenbeck process times sqrt(D(y)/D), plus the drift D'/2 that its white-noise limit needs.
/// Counter-based: platelet n is the same whatever the number of platelets or threads.
data::Trajectories generate(const Synthetic& truth);

}  // namespace hemowalk::calibration
