#pragma once
/// \file The face of the coarse walk: a case and a transport law in, concentration and absorbed fraction out.

#include <functional>
#include <string>
#include <vector>

#include "coarse/case.hpp"
#include "core/data/transport_law.hpp"

namespace hemowalk::coarse {

struct Result {
  std::string method = "walk";             ///< walk | fokker_planck
  std::string reason;                      ///< why this method and step law
  std::vector<double> time;                ///< [T] s
  std::vector<double> absorbed_fraction;   ///< [T]
  std::vector<double> absorbed_sigma;      ///< [T] sampling error of the walkers
  std::vector<double> absorbed_law_sigma;  ///< [T] from the law's uncertainty (its draws, or D_sigma)
  struct Profile {
    std::vector<double> y;  ///< [Y] m, bin centres
    std::vector<double> c;  ///< [T*Y] concentration relative to the initial uniform one
  } profile;
  std::int64_t walkers = 0;
  double walker_steps_per_s = 0, wall = 0;  ///< 1/s, s
  std::vector<std::string> warnings;
};

struct RunOptions {
  bool strict = false;                   ///< \throws Refused outside the law's validity
  int law_draws = 16;                    ///< ensemble size for absorbed_law_sigma; 0 = skip
  std::function<void(double)> progress;  ///< fraction done, called now and then
};

/// Runs the walk. Results depend on the seed only, not on threads, ranks or output times.
Result run(const Case& the_case, const data::TransportLaw& law, const RunOptions& options = {});

/// The coarse --json object of docs/reference.md.
std::string to_json(const Result& result, const Case& the_case);
/// DIR/coarse/<name>.h5.
void write_result(const Result& result, const Case& the_case, const std::string& path);

}  // namespace hemowalk::coarse
