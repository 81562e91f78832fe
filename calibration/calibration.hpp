#pragma once
/// \file The face of calibration: trajectories in, D with its uncertainty and a transport law out.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/data/trajectories.hpp"
#include "core/data/transport_law.hpp"

namespace hemowalk::calibration {

struct Options {
  std::string kind = "platelet";
  double t0 = 0.3;  ///< s, start of the window
  std::optional<std::array<double, 2>>
      core;                   ///< m, layer of the `plateau` estimator; default: from the walls
  std::optional<double> lag;  ///< s; default: automatic plateau lag
  int bootstrap = 1000;
  std::uint64_t seed = 1;
};

/// One estimate of D. sigma is one standard error; ci68 from the bootstrap.
struct Estimate {
  std::string name;
  double D = 0, sigma = 0;        ///< m2/s
  std::array<double, 2> ci68{};   ///< m2/s
  int n = 0;                      ///< platelets (or pairs) used
  double lag = 0;                 ///< s, where one applies
  double effective_samples = 0;   ///< 2 (D/sigma)^2: independent displacements that would give this error
  double sigma_between_runs = 0;  ///< m2/s, spread of the runs beyond what their cells explain
  std::string note;               ///< empty, or why the value is absent / limited
};

/// A curve for charts: ensemble or time-averaged MSD of one layer.
struct MsdCurve {
  std::string layer, method;                ///< "all" | "core"; "single_origin" | "time_averaged"
  std::vector<double> lag, msd, sigma;      ///< s, m2, m2
  double fit_slope = 0, fit_intercept = 0;  ///< m2/s, m2
  std::array<double, 2> fit_range{};        ///< s
};

/// Comparison with one published value.
struct Verdict {
  std::string source;
  bool matched_conditions = false;
  double D = 0;  ///< m2/s, published
  double D_lo = 0, D_hi = 0;
  double z = 0;  ///< (ours - theirs) / combined standard error; NaN where none can be stated
  std::string statement;
};

struct Calibration {
  std::string kind = "platelet";
  int n_platelets = 0;
  int n_runs = 1;
  double duration = 0;               ///< s
  std::array<double, 2> walls_y{};   ///< m
  std::array<double, 2> core{};      ///< m, layer in which the displacements of `plateau` start
  std::vector<Estimate> estimators;  ///< paper, paper_all, plateau, gls, green_kubo
  std::vector<MsdCurve> msd;
  struct Profile {
    std::vector<double> y, D, sigma, v, v_sigma, density;  ///< m, m2/s, m2/s, m/s (without D'), 1/m
  } profile;  ///< Kramers-Moyal at the plateau lag; the smooth fit is in law.profile
  struct Kurtosis {
    std::vector<double> lag, excess;
  } kurtosis;
  std::vector<Verdict> verdict;
  data::TransportLaw law;  ///< carries the gate's findings
  std::vector<std::string> warnings;
  double wall = 0;       ///< s
  std::string law_file;  ///< where the caller wrote the law; empty = not written

  const Estimate* find(const std::string& name) const {
    for (const auto& e : estimators)
      if (e.name == name) return &e;
    return nullptr;
  }
};

/// Calibrates from one or several independent runs of the same scene (replicas: bootstrap over runs too).
/// \throws InputError on NaN, unsorted times, fewer than two cells, wrapped positions, too short a run.
Calibration calibrate(const std::vector<data::Trajectories>& runs, const Options& options);

/// Reads a folder of `iT, x, y, z` text files (um, one per platelet) as published by Kotsalos et al. 2020.
data::Trajectories import_text_folder(const std::string& folder);

/// The calibrate --json object of docs/reference.md as text.
std::string to_json(const Calibration& result);

}  // namespace hemowalk::calibration
