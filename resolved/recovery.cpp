#include "resolved/recovery.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "resolved/build.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

double recovery_time(const data::Scene& scene, double acceleration, double limit) {
  constexpr double stretch = 1.08, nan = std::numeric_limits<double>::quiet_NaN();
  const auto deformable = std::find_if(scene.cells.kinds.begin(), scene.cells.kinds.end(),
                                       [](const auto& k) { return k.law != data::Kind::Law::rigid; });
  if (deformable == scene.cells.kinds.end()) return nan;
  const mesh::TriangleMesh rest = make_mesh(*deformable, scene.fluid.dx);

  data::Scene one;
  one.acceleration = acceleration;
  one.fluid = scene.fluid;
  if (scene.coupling.scheme == data::Coupling::Scheme::conservative) one.coupling = scene.coupling;
  one.flow.type = data::Flow::Type::rest;
  one.domain.geometry = data::Domain::Geometry::periodic;
  one.contact.model = data::Contact::Model::none;
  one.cells.kinds = {*deformable};
  const double margin = 3e-6 / scene.fluid.dx;  // the nearest image is 6 um away
  const double nodes = std::ceil(2 * (stretch * mesh::bounding_radius(rest) + margin));
  one.domain.size.fill(nodes * scene.fluid.dx);
  InitialCell cell{0, {nodes / 2, nodes / 2, nodes / 2}, mesh::identity_rotation, {}};
  for (const auto& v : rest.vertices)
    cell.vertices.push_back({nodes / 2 + v[0] / stretch, nodes / 2 + v[1], nodes / 2 + v[2] * stretch});
  Simulation<float> sim(one, {cell});

  const auto extra_length = [&](const std::vector<mesh::Vec3>& x) {
    const auto extent = [&](int d) {
      const auto [low, high] = std::minmax_element(
          x.begin(), x.end(), [&](const mesh::Vec3& a, const mesh::Vec3& b) { return a[d] < b[d]; });
      return (*high)[d] - (*low)[d];
    };
    return extent(2) - extent(0);
  };
  const auto now = [&] {
    return extra_length(std::get<npfem::Membranes<float>>(sim.groups().front().cells).positions(0));
  };
  const double at_rest = extra_length(rest.vertices), target = (now() - at_rest) / std::exp(1.0);
  constexpr int every = 10;
  for (double before = now() - at_rest, time = 0; time < limit;) {
    for (int i = 0; i < every; ++i) sim.step();
    const double after = now() - at_rest;
    if (after < target) return time + (before - target) / (before - after) * (sim.time() - time);
    before = after, time = sim.time();
  }
  return nan;
}

}  // namespace hemowalk::resolved
