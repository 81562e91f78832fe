#pragma once
/// \file Trajectories: where cells were, when. SI, float64; layout of trajectories.h5 in docs/reference.md.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hemowalk::data {

/// The tracks of one kind of cell. Arrays are [time][cell] row-major; scalars may be empty if not recorded.
struct Tracks {
  std::vector<std::int64_t> id;     ///< [N]
  std::vector<double> position;     ///< [T*N*3] m, periodic axes unwrapped
  std::vector<double> orientation;  ///< [T*N*3] unit symmetry axis; may be empty
  /// Per-cell observables [T*N]: taylor_deformation, axial_diameter, transverse_diameter, inclination,
  /// tank_treading_angle, area, volume (m, rad, m2, m3).
  std::map<std::string, std::vector<double>> observables;

  std::size_t cells() const { return id.size(); }
  /// Coordinate \p axis of cell \p n at time index \p t, m.
  double at(std::size_t t, std::size_t n, int axis) const { return position[(t * id.size() + n) * 3 + axis]; }
};

/// Wall-normal profiles, averaged over x, z and the interval that ends at each time.
struct Profiles {
  std::vector<double> time;          ///< [P] s
  std::vector<double> y;             ///< [Y] m
  std::vector<double> velocity;      ///< [P*Y*3] m/s
  std::vector<double> hematocrit;    ///< [P*Y]
  std::vector<double> shear_stress;  ///< [P*Y] Pa, total (fluid + cells)
};

struct Diagnostics {
  std::vector<double> time;               ///< [K] s
  std::vector<double> momentum_residual;  ///< [K*3] relative
  std::vector<double> energy_residual, mass_error, volume_error_max, max_speed_ratio, overlap_max,
      slip_rms;  ///< [K]
  /// [K] W: fed in by walls, body force and loads; lost to viscosity, membrane damping, slip and lattice
  /// modes without stress (both numerical); stored in membranes, contact and inertia.
  std::vector<double> power_in, power_viscous, power_damping, power_slip, power_stressless, power_membranes,
      power_contact, power_inertia;
};

/// What the resolved solver hands to calibration; also what published data are imported into.
struct Trajectories {
  std::string version;              ///< of the program that wrote it
  double acceleration = 1;          ///< s; for the record, all values are physical already
  double shear_rate = 0;            ///< 1/s
  std::array<double, 3> box{};      ///< m
  std::array<double, 2> walls_y{};  ///< m, lower and upper wall
  double hematocrit_true = 0;
  double kappa_damping = 0;  ///< NaN = not stated
  double t_c = 0;            ///< s, shape-recovery time; NaN = not measured
  double Ca = 0, Re = 0;     ///< NaN = not known
  std::uint64_t seed = 0;
  std::string scene_yaml;
  std::string input_sha256;

  std::vector<double> time;             ///< [T] s, strictly increasing, intervals may differ
  std::map<std::string, Tracks> kinds;  ///< "platelet", "rbc", ...
  Profiles profile;
  Diagnostics diagnostics;
};

/// Writes \p path (tmp + fsync + rename). \throws IoError.
void write_trajectories(const Trajectories& data, const std::string& path);
/// Reads \p path. \throws InputError for a wrong format or inconsistent shapes, IoError if unreadable.
Trajectories read_trajectories(const std::string& path);

}  // namespace hemowalk::data
