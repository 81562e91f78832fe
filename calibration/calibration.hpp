#pragma once
/// \file The face of calibration: trajectories in, D with its uncertainty and a transport law out.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/data/trajectories.hpp"
#include "core/data/transport_law.hpp"

namespace hemowalk::calibration {

/// A walk to be tested on unseen cells. With \p law between reflecting \p walls (m): for each of \p lags (s)
/// the matrix P(i, j), row by row: the share of the walkers spread evenly over bin i at the start that are in
/// bin j then; \p bins equal bins between the walls.
using Walk = std::function<std::vector<std::vector<double>>(const data::TransportLaw& law,
                                                            const std::array<double, 2>& walls, int bins,
                                                            const std::vector<double>& lags)>;

struct Options {
  std::string kind = "platelet";
  double t0 = 0.3;  ///< s, start of the window
  std::optional<std::array<double, 2>>
      core;                   ///< m, layer of the `plateau` estimator; default: from the walls
  std::optional<double> lag;  ///< s; default: automatic plateau lag
  int bootstrap = 1000;
  std::uint64_t seed = 1;
  Walk walk;  ///< the coarse walk, tested beside the fitted propagator; none = not tested
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
  std::vector<Estimate> estimators;  ///< paper, paper_all, plateau, gls, green_kubo, confined, without_jumps
  std::string core_estimator, core_reason;  ///< which of them went into law.core, and why
  std::vector<MsdCurve> msd;
  struct Profile {
    std::vector<double> y, D, sigma, v, v_sigma, density;  ///< m, m2/s, m2/s, m/s (without D'), 1/m
  } profile;                                               ///< Kramers-Moyal at the plateau lag
  Profile smooth;  ///< maximum-likelihood fit through the walker's propagator; density = its equilibrium
  struct Kurtosis {
    std::vector<double> lag, excess;
  } kurtosis;
  /// The law of one half of the cells, against the other half.
  struct Holdout {
    std::vector<double> lag, msd_ratio, msd_sigma;  ///< s; observed/predicted MSD of the core and its error
    std::vector<double> histogram_p;        ///< p-value of the displacements' histogram (PIT, 10 bins)
    double profile_lag = 0, profile_p = 0;  ///< s; p-value of the profile after the whole window
  };
  Holdout holdout;       ///< the law's own propagator
  Holdout holdout_walk;  ///< Options::walk, fed with the law as it is handed on; empty without one
  /// Hold-out log-likelihood of the step laws at one lag, nats per step relative to the Gaussian.
  struct StepChoice {
    double lag = 0;  ///< s
    double persistent_gain = 0, persistent_sigma = 0;
    double heavy_tail_gain = 0, heavy_tail_sigma = 0;
    double correlation = 0, tail_exponent = 0;  ///< of successive steps; Student's degrees of freedom
    std::string best;
  };
  std::vector<StepChoice> step_choices;
  std::string step_reason;  ///< why law.step_law is what it is
  /// Cells near the walls. They leave when they reach the core layer.
  struct Residence {
    double zone = 0;                     ///< m, thickness of the near-wall zones
    int near_at_t0 = 0, left_of_t0 = 0;  ///< cells in a zone at t0, and how many of them leave
    int visits = 0, left = 0;            ///< all stays after t0
    double mean_time = 0,
           mean_time_sigma = 0;  ///< s, time in the zone per departure (stays cut off are counted in)
    int arrivals = 0;            ///< stays that began after t0
    double mean_time_out = 0, mean_time_out_sigma = 0;  ///< s, time outside per arrival
  } residence;
  std::string shear_note;  ///< where law.scaling comes from
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

/// One condition's effect on ln D.
struct Trend {
  std::string name;                   ///< "ln shear rate", "hematocrit", "ln kappa/(1-kappa)", ...
  double coefficient = 0, sigma = 0;  ///< change of ln D per unit of it
  double centre = 0;                  ///< mean over the calibrations
  std::array<double, 2> range{};      ///< what the calibrations span
  bool claimed = false;               ///< beyond two standard errors
  std::string statement;              ///< in words: the effect, or "not distinguishable"
};
/// A claim that was stated, with its sign, before the data (docs/calibration.md), and what the data say.
struct Hypothesis {
  std::string claim;    ///< in words
  std::string about;    ///< the trend it predicts the sign of
  int sign = 0;         ///< of that trend's coefficient
  std::string outcome;  ///< "supported" | "contradicted" | "not distinguishable" | "not tested"
  std::string statement;
};
/// The law over conditions: ln D linear in what varies between the calibrations, weighted by their errors.
struct ConditionFit {
  double D_centre = 0;  ///< m2/s, at the mean conditions
  std::vector<Trend> trends;
  /// Of (ln D_centre, coefficients), row-major; its first row and column belong to ln D_centre.
  std::vector<std::vector<double>> covariance;
  double scatter = 0;                  ///< of ln D between calibrations beyond their stated errors
  double shear_exponent = 1;           ///< D ~ shear rate^n: the fitted one where the shear rate varies
  double shear_exponent_sigma = 0;     ///< else the weighted mean of what the runs say
  std::vector<Hypothesis> hypotheses;  ///< all that are stated, tested or not
  std::vector<std::string> left_out;   ///< what could not be told apart, and why
  std::vector<std::string> warnings;   ///< what a reader of the law must know
  std::vector<std::array<double, 2>> scaled;  ///< D/(gamma r^2) and its error per calibration, r = 4 um
  double chi_squared = 0;
  int degrees_of_freedom = 0;
  data::TransportLaw::Valid valid;  ///< range that the calibrations span
};
/// A trend is claimed only beyond two standard errors; scatter beyond the stated errors widens them.
/// \throws InputError for fewer than two calibrations or one without an error.
ConditionFit fit_conditions(const std::vector<data::TransportLaw>& laws);

/// Transport law at other conditions (NaN = the mean of the calibrations where they vary): D from the
/// regression with its error, the profile of the nearest calibration with every distance to the nearer wall
/// kept. What does not vary between the calibrations stays; shear rate within their ranges goes with the
/// fitted exponent. \throws Refused outside what the calibrations span.
data::TransportLaw law_at(const ConditionFit& fit, const std::vector<data::TransportLaw>& laws,
                          const data::TransportLaw::Conditions& at);

/// The file `law_over_conditions.json` as text: SI, every digit that matters, validity ranges inside.
std::string conditions_json(const ConditionFit& fit, const std::vector<data::TransportLaw>& laws);

/// What a planned error costs.
struct PlanInput {
  double shear_rate = 100;                       ///< 1/s
  double lag = 0;                                ///< s; 0 = 2/shear rate
  double share_in_layer = 0.6;                   ///< of the platelets that start in the core
  double run_time = 1, t0 = 0.3;                 ///< s
  int platelets = 95;                            ///< per run
  const data::TransportLaw* measured = nullptr;  ///< an earlier calibration, with the data it had:
  double platelet_seconds = 0;                   ///< s
};
struct Plan {
  double relative_error = 0;
  double platelet_seconds = 0;      ///< s after t0, all runs together
  int runs = 3;                     ///< never below 3: platelets of one box share its flow
  int platelets_single_origin = 0;  ///< what the single-origin line needs instead, whatever the run length
  std::string note;
};
/// \throws InputError for an error outside (0, 1) or no time scale.
Plan plan_for(double relative_error, const PlanInput& input);

/// The calibrate --json object of docs/reference.md as text.
std::string to_json(const Calibration& result);

}  // namespace hemowalk::calibration
