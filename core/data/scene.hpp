#pragma once
/// \file Scene: what is simulated. SI units throughout; file format in docs/reference.md (scene.yaml).

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/portability.hpp"

namespace hemowalk::data {

using Vec3 = std::array<double, 3>;  ///< x, y, z

struct Domain {
  Vec3 size{50e-6, 50e-6, 50e-6};  ///< m; y wall to wall
  enum class Geometry { slab, periodic, tube, stl } geometry = Geometry::slab;
  double tube_diameter = 0;  ///< m; tube along z, centred in x and y
  std::string stl_file;      ///< static solid, surface of the flow region
  double stl_unit = 1;       ///< m per file unit
};

struct Flow {
  enum class Type { couette, poiseuille, rest } type = Type::couette;
  double shear_rate = 100;  ///< 1/s
  enum class Walls { top, both } walls = Walls::top;
  std::optional<double> mean_velocity;      ///< m/s (poiseuille, along z)
  std::optional<double> pressure_gradient;  ///< Pa/m (poiseuille, along z; positive drives +z)
};

struct Fluid {
  double density = 1025;              ///< kg/m3
  double kinematic_viscosity = 1e-6;  ///< m2/s
  double dx = 0.5e-6;                 ///< m
  double tau = 2;                     ///< relaxation time, lattice units
  enum class Collision { trt, bgk } collision = Collision::trt;
  double magic = 0.1875;  ///< TRT Lambda
  enum class Forcing { guo, shan_chen } forcing = Forcing::guo;
  enum class Precision { single_, double_ } precision = Precision::single_;

  /// Time step of one fluid step, s: (tau - 1/2)/3 dx^2/nu.
  double time_step() const { return (tau - 0.5) / 3 * dx * dx / kinematic_viscosity; }
};

struct Coupling {
  enum class Scheme { conservative, paper, peskin } scheme = Scheme::conservative;
  enum class Kernel { phi2, phi3, phi4 } kernel = Kernel::phi3;
  int cycles = 1;
  int solid_every = 1;                    ///< fluid steps per solid step
  double retraction = 0.35;               ///< delta, in dx (method: thickness of a smeared sheet)
  double theta_n = 0.97, theta_t = 0.97;  ///< slip correction, normal and tangential
  double chi = 2;
  std::optional<double> velocity_cap;  ///< lattice units
  std::optional<double> force_cap;     ///< N, peskin
  bool median_filter = false;
  int iterations = 1;  ///< solid iterations per coupling step (conservative)
  enum class Integrator { implicit, runge_kutta } integrator = Integrator::implicit;  ///< of the membranes

  /// What belongs to a kernel: the retraction that gives two sliding sheets their friction, and chi, half the
  /// inverse of its response summed over a sheet (docs/evidence/validation.md, section 1).
  static Coupling with(Kernel kernel) {
    Coupling c;
    c.kernel = kernel;
    if (kernel == Kernel::phi4) c.retraction = 0.6, c.chi = 8.0 / 3.0;
    if (kernel == Kernel::phi2) c.retraction = 0.2, c.chi = 0.75;  // its response varies: 3/2 is unstable
    return c;
  }
};

struct Contact {
  enum class Model { pairwise, particle_in_kernel, none } model = Model::pairwise;
  double range = 0.5e-6;     ///< m; particle_in_kernel: of the point pulled to, from the neighbour
  double stiffness = 20e-6;  ///< N/m, per vertex (pairwise: at zero gap)
};

struct Shape {
  enum class Type { rbc, platelet, sphere, ellipsoid, mesh } type = Type::rbc;
  Vec3 radii{0, 0, 0};  ///< m (sphere: all equal; ellipsoid)
  std::string file;     ///< mesh: OFF, OBJ or STL
  double unit = 1;      ///< m per file unit
};

struct Bending {
  enum class Model { paper, helfrich, none } model = Model::paper;
  double modulus = 1e-18;          ///< N m
  double reference_curvature = 0;  ///< 1/m (helfrich)
};

/// A kind of cell: geometry, density and membrane law.
struct Kind {
  std::string name;
  Shape shape;
  int subdivision = 8;    ///< n of the subdivided octahedron: 4 n^2 + 2 vertices
  double density = 1125;  ///< kg/m3
  enum class Law { paper, neo_hookean, skalak, rigid } law = Law::paper;
  double B = 5e-6, C = 5000e-6, D = 35e-6;  ///< N/m, law: paper
  double Gs = 5e-6;                         ///< N/m, neo_hookean and skalak
  double skalak_C = 1;                      ///< dimensionless area ratio C of Skalak's law
  Bending bending;
  double volume_modulus = 250e-6;  ///< k_v (the paper's 250 pN/um), N/m
  double kappa_damping = 0.9;      ///< at h_ref = 0.25 us, m_ref = 400.3 fg (method 3)
  double rayleigh_beta = 0;        ///< s
};

struct Placement {
  std::string kind;
  Vec3 position{};     ///< m, centre
  Vec3 axis{0, 1, 0};  ///< rotation axis
  double angle = 0;    ///< rad
};

/// A force on the fraction of a cell's vertices that lies farthest towards one end.
struct Load {
  int cell = 0;
  std::string end;  ///< +x -x +y -y +z -z
  double fraction = 0.02;
  Vec3 force{};  ///< N, in all
};

struct Cells {
  std::optional<double> hematocrit;  ///< or explicit placements, never both
  double platelets_per_rbc = 0;
  std::vector<Kind> kinds;
  std::vector<Placement> placements;  ///< yaml key: explicit
  std::vector<Load> loads;
};

struct Time {
  double end = 1;                          ///< s
  double sample = 1e-3;                    ///< s, trajectories
  double profile = 10e-3;                  ///< s
  double surface = 0;                      ///< s; 0 = never
  double checkpoint_wall = 600;            ///< s of wall time; 0 = never
  std::optional<double> checkpoint_every;  ///< s, simulated
};

struct Places {
  Place fluid = Place::host, coupling = Place::host, solid = Place::host;
  enum class Distribution { with_fluid, even } distribution = Distribution::with_fluid;
};

/// Everything the resolved solver needs to know; all values physical (not scaled by acceleration).
struct Scene {
  double acceleration = 1;  ///< s of method 6
  Domain domain;
  Flow flow;
  Fluid fluid;
  Coupling coupling;
  Contact contact;
  Cells cells;
  Time time;
  std::uint64_t seed = 1;
  Places place;

  std::string source_text;   ///< canonical YAML of this scene (comments and white space gone)
  std::string input_sha256;  ///< of what decides the results: equal physics, equal hash (checkpoint intervals
                             ///< and file names do not count, file contents do)
  std::vector<std::string>
      warnings;  ///< keys that have no effect, as file:line:col: problem (why) suggestion

  const Kind* find_kind(const std::string& name) const {
    for (const auto& k : cells.kinds)
      if (k.name == name) return &k;
    return nullptr;
  }
};

/// Reads scene.yaml. \throws InputError listing all problems as file:line:col: problem (why) suggestion.
/// \p overrides are "dotted.key=value" texts applied before validation.
Scene read_scene(const std::string& path, const std::vector<std::string>& overrides = {});
/// The same from text; \p name stands for the file in messages.
Scene parse_scene(const std::string& text, const std::string& name,
                  const std::vector<std::string>& overrides = {});
/// Canonical YAML of \p scene: sorted keys, SI values, all defaults; parse_scene reads the same scene back.
/// \throws InputError if it is not a valid scene.
std::string write_scene(const Scene& scene);

}  // namespace hemowalk::data
