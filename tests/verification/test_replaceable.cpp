// Each component can be replaced behind the face the others see: a membrane of springs in place of npfem, a
// prescribed flow in place of the lattice Boltzmann fluid. Each sees the fields that fluid and cells meet in
// and nothing else of the solver; the springs take their rest shape from the cell's type.
#include <gtest/gtest.h>

#include <cmath>

#include "resolved/mesh/vector.hpp"
#include "support/red_cells.hpp"
#include "support/single_body.hpp"

namespace hemowalk::resolved {
namespace {

/// Springs along the edges of the rest mesh, each pair of ends in balance with its inertia: one explicit pass
/// of v = v_pred + h/m F, equal and opposite, so momentum is that of v_pred.
class SpringMembrane {
 public:
  SpringMembrane(const npfem::CellType& type, double stiffness)
      : type_(type), stiffness_(stiffness), edges_(mesh::edges(type.rest())) {
    for (const auto& e : edges_) length_.push_back(distance(type.rest().vertices, e));
  }

  template <class Real>
  mesh::StepReport step(npfem::Membranes<Real>& cells) const {
    mesh::HostFields<Real> f = cells.host_fields();
    const auto at = cells.layout();
    for (int c = 0; c < cells.count(); ++c) {
      auto x = cells.positions(c);
      std::vector<mesh::Vec3> impulse(x.size(), mesh::Vec3{});
      for (std::size_t i = 0; i < edges_.size(); ++i) {
        const auto& e = edges_[i];
        const double pull = type_.h() * stiffness_ * (1 - length_[i] / distance(x, e));
        const auto along = mesh::subtract(x[e.v1], x[e.v0]);
        mesh::accumulate(impulse[e.v0], pull, along), mesh::accumulate(impulse[e.v1], -pull, along);
      }
      for (int k = 0; k < cells.vertices(); ++k)
        for (int d = 0; d < 3; ++d) {
          const auto i = at.at(c, k, d);
          const double v = f.predicted[i] + impulse[k][d] / type_.metric()[k];
          f.velocity[i] = static_cast<Real>(v), f.offset[i] += static_cast<Real>(type_.h() * v);
          x[k][d] += type_.h() * v;
        }
      const auto normals = mesh::vertex_normals({x, type_.rest().triangles});
      for (int k = 0; k < cells.vertices(); ++k)
        for (int d = 0; d < 3; ++d) f.normal[at.at(c, k, d)] = static_cast<Real>(normals[k][d]);
    }
    return {};
  }

 private:
  static double distance(const std::vector<mesh::Vec3>& x, const mesh::Edge& e) {
    return mesh::norm(mesh::subtract(x[e.v1], x[e.v0]));
  }
  const npfem::CellType& type_;
  double stiffness_;
  std::vector<mesh::Edge> edges_;
  std::vector<double> length_;
};

/// u(y) along z, whatever the cells do.
auto prescribed(const Simulation<double>& sim, double rate) {
  return [&sim, rate](View<const Node4<double>>, View<Node4<double>> u, double) {
    const Block& b = sim.block();
    for (int k = 0; k < b.nz; ++k)
      for (int j = 0; j < b.ny; ++j)
        for (int i = 0; i < b.nx; ++i) u[b.at(i, j, k)] = {0, 0, rate * (j + 0.5 - b.ny / 2.0), 0};
  };
}

data::Scene soft_scene() {
  data::Kind kind;
  kind.name = "capsule", kind.shape = test::sphere_shape(2.5), kind.subdivision = 6;
  kind.law = data::Kind::Law::neo_hookean, kind.bending.model = data::Bending::Model::none,
  kind.density = 1025;
  return test::shear_scene({12, 12, 12}, 20, {kind});
}

template <class Sim>
void use_springs(Sim& sim, double stiffness) {
  auto& cells = std::get<npfem::Membranes<double>>(sim.groups()[0].cells);
  typename Sim::SolidElsewhere solid;
  solid.step = [&cells, springs = SpringMembrane(cells.type(), stiffness)](const mesh::StepOptions&) {
    return std::vector<mesh::StepReport>{springs.step(cells)};
  };
  sim.set_solid(std::move(solid));
}

// With the lattice's plasma: momentum closes to round-off, and softer springs give way more. Above the
// middle, where the membrane has a momentum to lose.
TEST(Replaceable, AMembraneOfSpringsInTheFluid) {
  double deformation[2];
  for (const int stiff : {0, 1}) {
    Simulation<double> sim(soft_scene(), {{0, {12, 15, 12}, mesh::identity_rotation, {}}});
    use_springs(sim, stiff ? 0.2 : 0.02);
    const auto start = sim.momentum();
    for (int i = 0; i < 1000; ++i) sim.step();
    const auto end = sim.momentum();
    for (int d = 0; d < 3; ++d) EXPECT_LT(std::abs(end.total()[d] - start.total()[d]), 1e-12 * end.scale());
    deformation[stiff] =
        std::get<npfem::Membranes<double>>(sim.groups()[0].cells).observe(0).taylor_deformation;
  }
  EXPECT_GT(deformation[1], 0.002);
  EXPECT_GT(deformation[0], 2 * deformation[1]);
}

// A soft membrane in a prescribed shear flow is carried along with the flow, every vertex by rate y t: the
// kernel reads a linear flow exactly. What is left is the membrane's pull (1e-12 N/m: 1.4e-9 dx are seen);
// the springs have none.
TEST(Replaceable, APrescribedFlowCarriesTheMembrane) {
  for (const bool springs : {false, true}) {
    auto scene = soft_scene();
    scene.cells.kinds[0].Gs = 1e-12, scene.cells.kinds[0].kappa_damping = 0,
    scene.cells.kinds[0].volume_modulus = 0;
    scene.coupling.retraction = 0;
    Simulation<double> sim(scene, {{0, {12, 12, 12}, mesh::identity_rotation, {}}});
    if (springs) use_springs(sim, 0);
    const double rate = 1e-3;
    sim.set_fluid_step(prescribed(sim, rate));
    sim.step();  // the first step still reads the lattice's flow
    const auto& cells = std::get<npfem::Membranes<double>>(sim.groups()[0].cells);
    const auto start = cells.positions(0);
    constexpr int steps = 200;
    for (int i = 0; i < steps; ++i) sim.step();
    const auto end = cells.positions(0);
    for (std::size_t k = 0; k < start.size(); ++k)
      EXPECT_NEAR(end[k][2] - start[k][2], rate * (start[k][1] - 12) * steps, springs ? 1e-12 : 1e-8)
          << "vertex " << k;
  }
}

}  // namespace
}  // namespace hemowalk::resolved
