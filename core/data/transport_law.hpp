#pragma once
/// \file TransportLaw: what calibration learned and the coarse walk needs. SI units.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hemowalk::data {

/// One artefact-gate finding: the measured value against its limit.
struct Finding {
  std::string name;
  double value = 0, limit = 0;
  bool passed = true;
  std::string note;
};

struct TransportLaw {
  struct Conditions {
    double shear_rate = 100;  ///< 1/s
    double hematocrit = 0.35, gap = 0 /*m*/, kappa_damping = 0, t_c = 0 /*s*/, Ca = 0,
           Re = 0;  ///< NaN = unknown
  } conditions;
  struct Core {
    double D = 0, D_sigma = 0;        ///< m2/s
    double lag = 0;                   ///< s
    std::array<double, 2> y_range{};  ///< m
  } core;
  /// D(y) and the drift v(y) WITHOUT D': J = v c - D c'; the Ito drift is v + D'. Empty = homogeneous.
  struct Profile {
    std::vector<double> y, D, v;                        ///< m, m2/s, m/s
    std::vector<std::vector<double>> D_draws, v_draws;  ///< posterior draws, each as long as y; may be empty
  } profile;
  double memory = 0;  ///< s, velocity memory time
  struct StepLaw {
    std::string kind = "gaussian";                ///< gaussian | persistent | heavy_tail
    double memory = 0;                            ///< s, persistent
    double tail_exponent = 0, tail_fraction = 0;  ///< heavy_tail
  } step_law;
  double cell_free_layer = 0;  ///< m; NaN = unknown
  struct Scaling {
    double shear_exponent = 1, sigma = 0;
  } scaling;
  struct Valid {
    std::array<double, 2> shear_rate{0, 1e9}, hematocrit{0, 1};
    double dt_min = 0;  ///< s
  } valid;
  struct Gate {
    bool passed = true;
    std::vector<Finding> findings;
  } gate;
  struct Provenance {
    std::vector<std::string> inputs_sha256;
    std::string version;
    std::uint64_t seed = 0;
  } provenance;

  /// A law with one constant D (coarse.yaml: `law: {D: 1e-10 m2/s}`).
  static TransportLaw constant(double D);
};

/// Lossless round trip (17 significant digits). \throws InputError / IoError.
TransportLaw read_transport_law(const std::string& path);
/// The same from text; \p name stands for the file in messages.
TransportLaw parse_transport_law(const std::string& text, const std::string& name);
void write_transport_law(const TransportLaw& law, const std::string& path);

}  // namespace hemowalk::data
