#pragma once
/// \file Our D beside published ones: with which source, under which conditions, by how many standard errors.

#include <optional>
#include <string>
#include <vector>

#include "calibration/calibration.hpp"

namespace hemowalk::calibration {

/// literature.yaml as compiled in.
extern const char* const literature_text;

/// D = prefactor a^2 gamma phi^phi_power (1 - phi)^exponent. Zydney and Colton 1988: 0.15, phi_power 1, 0.8;
/// Leighton and Acrivos 1987, dilute limit: 0.5, phi_power 2, 0.
struct Formula {
  double prefactor = 0, exponent = 0, phi_power = 1;
  std::vector<double> radii;  ///< m
  /// m2/s for one radius (m), shear rate (1/s) and hematocrit.
  double operator()(double radius, double shear_rate, double hematocrit) const;
};

/// One entry of literature.yaml.
struct Source {
  std::string id, citation, particle, kind, direction, method, checked, note;
  std::vector<double> shear_rate, hematocrit;  ///< ranges; empty = not stated
  std::optional<double> D, low, high;          ///< m2/s
  std::optional<Formula> formula;
  bool same_tracks = false;
};
/// \throws InputError for a broken file.
std::vector<Source> read_literature(const std::string& text);

/// A value of ours to compare.
struct Ours {
  std::string particle = "platelet";
  double D = 0, sigma = 0;                ///< m2/s
  double shear_rate = 0, hematocrit = 0;  ///< 1/s; NaN = unknown
  bool gate_passed = true;
  bool imported = false;  ///< from the published trajectories themselves
};

/// Platelets are compared with platelets and particles of their size, red cells with red cells and the
/// formulas. Conditions match when shear rate (within 25 %), hematocrit (within 0.05) and direction are the
/// same. Formulas are evaluated at our conditions. Where a source states no error, z is NaN and the
/// sentence says so.
std::vector<Verdict> compare_with_literature(const Ours& ours, const std::vector<Source>& sources);

}  // namespace hemowalk::calibration
