#pragma once
/// \file The face of the coarse walk: a case and a transport law in, concentration and absorbed fraction out.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "coarse/case.hpp"
#include "core/data/transport_law.hpp"

namespace hemowalk::coarse {

struct Result {
  std::string method = "walk";            ///< walk | fokker_planck
  std::string reason;                     ///< why this method and step law
  std::vector<double> time;               ///< [T] s
  std::vector<double> absorbed_fraction;  ///< [T] taken for good by absorbing and reacting faces
  std::vector<double> absorbed_sigma;     ///< [T] sampling error of the walkers; 0 for fokker_planck
  std::vector<double>
      absorbed_law_sigma;  ///< [T] from the law's uncertainty (its draws, or D_sigma); NaN = unknown
  std::vector<double> trapped_fraction;  ///< [T] held by traps at that time
  struct Profile {
    std::vector<double> y;  ///< [Y] m, bin centres
    std::vector<double> c;  ///< [T*Y] concentration relative to all walkers spread over the slab
  } profile;
  struct Flow {                              ///< empty unless asked for
    std::vector<double> mean_z, variance_z;  ///< [T] m, m2: way along the flow of all walkers
  } flow;
  std::int64_t walkers = 0;                 ///< 0 for fokker_planck
  double walker_steps_per_s = 0, wall = 0;  ///< 1/s (0 for fokker_planck), s
  std::vector<std::string> warnings;
};

struct RunOptions {
  bool strict = false;                   ///< \throws Refused outside the law's validity
  int law_draws = 16;                    ///< ensemble size for absorbed_law_sigma; 0 = skip
  std::function<void(double)> progress;  ///< fraction done, called now and then
  bool fokker_planck = false;            ///< solve the equation instead of walking
  int bins = 64;                         ///< of the concentration profile
  bool track_flow_direction = false;     ///< fills Result::flow; needs faces that keep every walker
  Place device = Place::device;  ///< where place: device runs; host: its kernels thread by thread, for tests
};

/// Why the case cannot be walked on this machine, or nothing.
std::string place_problem(const Case& the_case);
/// Runs the case. Results depend on the seed only, not on threads, ranks or output times; of place they
/// depend to round-off. Output times are rounded to whole steps (with a warning). \throws InputError for a
/// case that cannot run, Refused (strict).
Result run(const Case& the_case, const data::TransportLaw& law, const RunOptions& options = {});

/// The coarse --json object of docs/reference.md.
std::string to_json(const Result& result, const Case& the_case);
/// DIR/coarse/<name>.h5: /time, /absorbed_fraction, /absorbed_sigma, /absorbed_law_sigma, /trapped_fraction
/// [T], /profile/y [Y], /profile/c [T, Y], /flow/{mean_z, variance_z} [T] where tracked; provenance as
/// attributes.
void write_result(const Result& result, const Case& the_case, const std::string& path);

}  // namespace hemowalk::coarse
