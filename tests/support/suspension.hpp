#pragma once
/// \file Blood in Couette flow between two walls, measured: stress, profiles, how far red cells stray.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "core/statistics.hpp"
#include "resolved/build.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/symmetric.hpp"
#include "resolved/mesh/vector.hpp"
#include "resolved/packing.hpp"
#include "resolved/recorder.hpp"
#include "support/blood_scene.hpp"
#include "support/power_shares.hpp"
#include "support/single_body.hpp"

namespace hemowalk::test {

/// Red cells alone; the means run over the second half of \p strain.
struct SuspensionCase {
  data::Vec3 box{20, 20, 20};  ///< um
  double hematocrit = 0.35, shear_rate = 100, kappa = 0.5;
  double strain = 20;
  double inertia = 5000;  ///< shear rate times acceleration, 1/s: equal for all shear rates
  double lag = 2;         ///< strain over which displacements are taken
  data::Coupling coupling;
  double dx = 0.5;      ///< um
  int subdivision = 0;  ///< of the membranes; 0: follows dx
};

struct SuspensionResult {
  double viscosity = 0;        ///< stress over that of plasma at the nominal shear rate
  double core_shear = 0;       ///< in the middle 40 % of the gap, over the nominal one
  double core_hematocrit = 0;  ///< there
  double core_viscosity = 0;   ///< stress over that of plasma at the core's shear rate
  double plasma_layer = 0;     ///< um, mean over both walls: hematocrit below half the core's
  double stray = 0;            ///< um2, mean square displacement across the flow of red cells over the lag
  double volume = 1;           ///< the cell's that lost or gained most, at the end over the start
  Shares power;                ///< of the second half
};

inline data::Scene suspension_scene(const SuspensionCase& c, std::uint64_t seed) {
  data::Scene scene = blood_scene(c.box, c.hematocrit, seed);
  scene.cells.platelets_per_rbc = 0;
  scene.cells.kinds.resize(1);
  scene.cells.kinds[0].kappa_damping = c.kappa;
  scene.cells.kinds[0].subdivision = c.subdivision ? c.subdivision : static_cast<int>(std::lround(4 / c.dx));
  scene.flow.walls = data::Flow::Walls::both;
  scene.flow.shear_rate = c.shear_rate;
  scene.acceleration = c.inertia / c.shear_rate;
  scene.coupling = c.coupling;
  scene.fluid.dx = 1e-6 * c.dx;
  return scene;
}

/// The cells of \p coarse (packed with the meshes of \p from) with the meshes of \p to: the displacement from
/// the rest shape is linear over the coarse triangles.
inline std::vector<resolved::InitialCell> refine(const std::vector<resolved::InitialCell>& coarse,
                                                 const data::Scene& from, const data::Scene& to) {
  using mesh::Vec3;
  const double scale = from.fluid.dx / to.fluid.dx;
  const auto rest = resolved::make_mesh(from.cells.kinds[0], from.fluid.dx);
  auto fine = resolved::make_mesh(to.cells.kinds[0], from.fluid.dx);
  // Where each fine vertex lies on the coarse sphere: the triangle whose cone holds it, by the sphere that
  // both meshes are made of.
  const auto parameters = mesh::octahedron_sphere(from.cells.kinds[0].subdivision),
             wanted = mesh::octahedron_sphere(to.cells.kinds[0].subdivision);
  struct Place {
    std::array<int, 3> corner{};
    Vec3 weight{};
  };
  std::vector<Place> places;
  for (const Vec3& p : wanted.vertices) {
    Place best;
    double least = -1e9;
    for (const auto& t : parameters.triangles) {
      const Vec3 &a = parameters.vertices[t[0]], &b = parameters.vertices[t[1]],
                 &c = parameters.vertices[t[2]];
      Vec3 w{mesh::dot(p, mesh::cross(b, c)), mesh::dot(p, mesh::cross(c, a)),
             mesh::dot(p, mesh::cross(a, b))};
      const double sum = w[0] + w[1] + w[2], smallest = std::min({w[0], w[1], w[2]});
      if (sum <= 0 || smallest / sum <= least) continue;
      least = smallest / sum;
      best.corner = t, best.weight = {w[0] / sum, w[1] / sum, w[2] / sum};
    }
    places.push_back(best);
  }
  std::vector<resolved::InitialCell> cells;
  for (const auto& cell : coarse) {
    Vec3 middle{};
    const double n = static_cast<double>(cell.vertices.size());
    for (const Vec3& x : cell.vertices)
      for (int d = 0; d < 3; ++d) middle[d] += x[d] / n;
    mesh::Matrix3 fit{};
    for (std::size_t k = 0; k < cell.vertices.size(); ++k)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) fit[3 * i + j] += (cell.vertices[k][i] - middle[i]) * rest.vertices[k][j];
    const mesh::Matrix3 turn = mesh::nearest_rotation(fit);
    std::vector<Vec3> displacement(rest.vertices.size());
    for (std::size_t k = 0; k < displacement.size(); ++k) {
      const Vec3 r = mesh::transform(turn, rest.vertices[k]);
      for (int d = 0; d < 3; ++d) displacement[k][d] = cell.vertices[k][d] - middle[d] - r[d];
    }
    resolved::InitialCell out = cell;
    for (double& x : out.centre) x *= scale;
    out.vertices.clear();
    for (std::size_t k = 0; k < fine.vertices.size(); ++k) {
      Vec3 x = mesh::transform(turn, fine.vertices[k]);
      for (int d = 0; d < 3; ++d) {
        x[d] += middle[d];
        for (int i = 0; i < 3; ++i) x[d] += places[k].weight[i] * displacement[places[k].corner[i]][d];
        x[d] *= scale;
      }
      out.vertices.push_back(x);
    }
    cells.push_back(std::move(out));
  }
  return cells;
}

inline SuspensionResult shear_suspension(const SuspensionCase& c,
                                         const std::vector<resolved::InitialCell>& cells,
                                         const data::Scene& scene) {
  resolved::Simulation<float> sim(scene, cells);
  resolved::Recorder<float> recorder(sim);
  const double rate = sim.units().rate(c.shear_rate);
  const auto& group = std::get<npfem::Membranes<float>>(sim.groups()[0].cells);
  const auto steps = static_cast<std::int64_t>(c.strain / rate), looks = std::int64_t{40} * 2,
             every = std::max<std::int64_t>(1, steps / looks);
  const int lag = static_cast<int>(std::lround(c.lag / rate / static_cast<double>(every)));
  std::vector<std::vector<double>> height;
  SuspensionResult out;
  for (std::int64_t i = 1; i <= steps; ++i) {
    if (i % every == 0 && 2 * i > steps)
      out.power.sample(sim);
    else
      sim.step();
    if (i % every) continue;
    height.emplace_back();
    for (int k = 0; k < group.count(); ++k) height.back().push_back(group.observe(k).centre[1]);
    if (2 * i > steps) recorder.accumulate_profile(sim);
  }
  recorder.close_profile(sim);
  const data::Profiles& profile = recorder.trajectories().profile;
  const int n = static_cast<int>(profile.y.size()), low = n * 3 / 10, high = n - low;
  const double plasma = scene.fluid.density * scene.fluid.kinematic_viscosity * c.shear_rate;
  for (int j = 0; j < n; ++j) out.viscosity += profile.shear_stress[j] / plasma / n;
  std::vector<double> y, u;
  for (int j = low; j < high; ++j) {
    y.push_back(profile.y[j]), u.push_back(profile.velocity[3 * j + 2]);
    out.core_hematocrit += profile.hematocrit[j] / (high - low);
  }
  out.core_shear = fit_line(y, u).slope / c.shear_rate;
  out.core_viscosity = out.viscosity / out.core_shear;
  // First plane from each wall that holds half of the core's hematocrit, linear between planes.
  for (const int step : {1, -1}) {
    int j = step > 0 ? 0 : n - 1;
    while (profile.hematocrit[j] < out.core_hematocrit / 2) j += step;
    double at = step > 0 ? j + 0.5 : n - j - 0.5;
    const int before = j - step;
    if (before >= 0 && before < n)
      at -= (profile.hematocrit[j] - out.core_hematocrit / 2) /
            (profile.hematocrit[j] - profile.hematocrit[before]);
    out.plasma_layer += at * c.dx / 2;
  }
  double pairs = 0;
  for (int i = static_cast<int>(height.size()) / 2; i + lag < static_cast<int>(height.size()); ++i)
    for (std::size_t k = 0; k < height[i].size(); ++k)
      out.stray += std::pow(c.dx * (height[i + lag][k] - height[i][k]), 2), pairs += 1;
  out.stray /= pairs;
  for (int k = 0; k < group.count(); ++k) {
    const double volume = group.volume(k) / group.rest_volume();
    if (std::abs(volume - 1) > std::abs(out.volume - 1)) out.volume = volume;
  }
  return out;
}

inline SuspensionResult shear_suspension(const SuspensionCase& c, std::uint64_t seed) {
  const data::Scene scene = suspension_scene(c, seed);
  return shear_suspension(c, resolved::pack(scene), scene);
}

/// Mean over packings and its standard error (infinite for one).
struct Mean {
  double value = 0, error = std::numeric_limits<double>::infinity();
};
inline Mean mean_of(const std::vector<SuspensionResult>& runs, double SuspensionResult::*member) {
  std::vector<double> x;
  for (const auto& r : runs) x.push_back(r.*member);
  return {mean(x), x.size() > 1 ? standard_error(x) : std::numeric_limits<double>::infinity()};
}

}  // namespace hemowalk::test
