// The energy budget of a step: sums before it, during its fluid steps and after it.

#include "resolved/mesh/vector.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

using mesh::Vec3;

namespace {

/// Sum of value(cell) over \p count cells, in their order whatever the number of threads.
template <class Value>
double sum_over_cells(int count, const Value& value) {
  std::vector<double> of_cell(count);
#pragma omp parallel for schedule(static)
  for (int c = 0; c < count; ++c) of_cell[c] = value(c);
  double sum = 0;
  for (const double v : of_cell) sum += v;
  return sum;
}

/// Velocity of the vertex itself: rigid bodies carry that of its coupling point.
template <class Cells>
Vec3 vertex_velocity(const Cells& g, int c, int k) {
  const auto at = g.layout();
  Vec3 v, arm{};
  for (int d = 0; d < 3; ++d) v[d] = g.velocities()[at.at(c, k, d)];
  if constexpr (requires { g.held(); }) {
    for (int d = 0; d < 3; ++d) arm[d] = g.offsets()[at.at(c, k, d)] - g.held()[at.at(c, k, d)];
    mesh::accumulate(v, 1, mesh::cross(g.angular_velocity(c), arm));
  }
  return v;
}

}  // namespace

/// What moving walls have given since the start.
template <class Real>
double Simulation<Real>::wall_work() const {
  return -mesh::dot(faces_.lower_wall, taken_.to_lower_wall) -
         mesh::dot(faces_.upper_wall, taken_.to_upper_wall);
}

template <class Real>
double Simulation<Real>::kinetic_energy() const {
  double sum = 0;
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto at = g.layout();
          sum += sum_over_cells(g.count(), [&](int c) {
            double twice = 0;
            for (int k = 0; k < g.vertices(); ++k)
              for (int d = 0; d < 3; ++d)
                twice += group.mass[k] * std::pow(static_cast<double>(g.velocities()[at.at(c, k, d)]), 2);
            return twice / 2;
          });
        },
        group.cells);
  return sum;
}

template <class Real>
void Simulation<Real>::open_budget(EnergyBudget& budget) const {
  budget = {};
  budget.walls = -wall_work() / h_;
  budget.inertia = -kinetic_energy() / h_;
}

/// Before a fluid step. The field's work is what the cells' impulses do in the fluid: slip is the rest of
/// their power.
template <class Real>
void Simulation<Real>::count_fluid(EnergyBudget& budget, View<const Node4<Real>> force, bool first) const {
  const lbm::EnergyFlows e = fluid_.energy(force);
  budget.viscous += e.viscous / h_, budget.stressless += e.stressless / h_;
  budget.body_force += e.body_force / h_, budget.slip -= e.force / h_;
  if (first) budget.inertia -= e.held / h_;
}

template <class Real>
void Simulation<Real>::close_budget(EnergyBudget& budget) {
  budget.walls += wall_work() / h_;
  budget.inertia += (kinetic_energy() + fluid_.energy({}).held) / h_;
  for (auto& group : groups_)
    std::visit(
        [&](auto& g) {
          const auto at = g.layout();
          const Real* rate = normal_rate_.data() + 3 * static_cast<std::size_t>(group.first_marker);
          budget.slip += sum_over_cells(g.count(), [&](int c) {
            double power = 0;
            for (int k = 0; k < g.vertices(); ++k) {
              const Node4<Real>& J = impulse_[group.marker(c, k)];
              const double j[3] = {J.x, J.y, J.z};
              for (int d = 0; d < 3; ++d) {
                const auto i = at.at(c, k, d);
                power += j[d] * (static_cast<double>(g.velocities()[i]) - rate[i]);
              }
            }
            return power;
          });
          budget.contact -= sum_over_cells(g.count(), [&](int c) {
            double power = 0;
            for (int k = 0; k < g.vertices(); ++k) {
              const Node4<Real>& F = contact_force_[group.marker(c, k)];
              power += mesh::dot({F.x, F.y, F.z}, vertex_velocity(g, c, k));
            }
            return power;
          });
          if constexpr (requires { g.stored_power(); }) {
            budget.membranes += g.stored_power();
            budget.damping += sum_over_cells(g.count(), [&](int c) { return g.damping_power(c); });
          }
          for (int c = 0; c < g.count(); ++c)
            for (const auto& load : loads_)
              if (g.id(c) == load.cell)
                budget.loads += mesh::dot(load.force, vertex_velocity(g, c, load.vertex));
        },
        group.cells);
  budget.contact += budget.loads;  // the array of contact forces holds the loads too
  // Impulses that reach through a wall work on the wall, not in the fluid.
  budget.slip -=
      mesh::dot(faces_.lower_wall, force_on_walls_[0]) + mesh::dot(faces_.upper_wall, force_on_walls_[1]);
  ranks().sum({&budget.walls, sizeof budget / sizeof(double)});
}

#define HEMOWALK_INSTANTIATE(Real)                                                                 \
  template double Simulation<Real>::wall_work() const;                                             \
  template double Simulation<Real>::kinetic_energy() const;                                        \
  template void Simulation<Real>::open_budget(EnergyBudget&) const;                                \
  template void Simulation<Real>::count_fluid(EnergyBudget&, View<const Node4<Real>>, bool) const; \
  template void Simulation<Real>::close_budget(EnergyBudget&);
HEMOWALK_INSTANTIATE(float)
HEMOWALK_INSTANTIATE(double)
#undef HEMOWALK_INSTANTIATE

}  // namespace hemowalk::resolved
