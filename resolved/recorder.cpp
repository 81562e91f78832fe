#include "resolved/recorder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "resolved/build.hpp"
#include "resolved/cross_section.hpp"
#include "resolved/gather.hpp"
#include "resolved/region.hpp"

namespace hemowalk::resolved {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double red_cell_radius = 3.91e-6;  ///< m, half the diameter of the paper's red cell

}  // namespace

template <class Real>
Recorder<Real>::Recorder(const Simulation<Real>& simulation) : planes_(simulation.block().ny) {
  const data::Scene& scene = simulation.scene();
  const LatticeUnits& units = simulation.units();
  record_.acceleration = scene.acceleration;
  record_.shear_rate = scene.flow.type == data::Flow::Type::couette ? scene.flow.shear_rate : 0;
  record_.box = scene.domain.size;
  record_.walls_y = {0, scene.domain.size[1]};
  if (scene.domain.geometry == data::Domain::Geometry::tube)
    for (int w = 0; w < 2; ++w)
      record_.walls_y[w] = scene.domain.size[1] / 2 + (w ? 0.5 : -0.5) * scene.domain.tube_diameter;
  record_.seed = scene.seed;
  record_.scene_yaml = scene.source_text;
  record_.input_sha256 = scene.input_sha256;
  record_.t_c = nan;
  record_.kappa_damping = nan;
  record_.Ca = nan;
  record_.Re = record_.shear_rate * red_cell_radius * red_cell_radius / scene.fluid.kinematic_viscosity;
  double red_cell_volume = 0;
  for (const auto& group : simulation.groups()) {
    const data::Kind& kind = scene.cells.kinds[group.kind];
    if (kind.law != data::Kind::Law::rigid && std::isnan(record_.Ca)) {
      const double mu = scene.fluid.density * scene.fluid.kinematic_viscosity;
      const double shear_modulus = kind.law == data::Kind::Law::paper ? kind.B / 4 : kind.Gs;
      record_.kappa_damping = kind.kappa_damping;
      record_.Ca = mu * record_.shear_rate * red_cell_radius / shear_modulus;
    }
    data::Tracks tracks;
    tracks.id = gather_cells(simulation.ranks(), group, 0, [](const auto&, int, double*) {}).id;
    const double volume = std::visit([](const auto& g) { return g.rest_volume(); }, group.cells);
    if (kind.law != data::Kind::Law::rigid)
      red_cell_volume += static_cast<double>(tracks.id.size()) * units.to_volume(volume);
    record_.kinds[kind.name] = std::move(tracks);
  }
  record_.hematocrit_true = red_cell_volume / Region(scene).volume();
  for (int j = 0; j < planes_; ++j) record_.profile.y.push_back((j + 0.5) * scene.fluid.dx);
  velocity_sum_.assign(3 * planes_, 0), fluid_stress_sum_.assign(planes_, 0),
      hematocrit_sum_.assign(planes_, 0);
  force_sum_.assign(planes_ + 1, 0);
}

template <class Real>
void Recorder<Real>::sample(Simulation<Real>& simulation, const EnergyBudget& budget) {
  record_.time.push_back(simulation.time());
  sample_cells(simulation);
  sample_diagnostics(simulation, budget);
}

template <class Real>
void Recorder<Real>::sample_cells(const Simulation<Real>& simulation) {
  static constexpr const char* names[7] = {"taylor_deformation",
                                           "axial_diameter",
                                           "transverse_diameter",
                                           "inclination",
                                           "tank_treading_angle",
                                           "area",
                                           "volume"};
  const LatticeUnits& units = simulation.units();
  for (const auto& group : simulation.groups()) {
    auto& tracks = record_.kinds[simulation.scene().cells.kinds[group.kind].name];
    const auto seen = gather_cells(simulation.ranks(), group, 13, [&](const auto& g, int c, double* out) {
      const mesh::Observables o = g.observe(c);
      for (int d = 0; d < 3; ++d) out[d] = units.to_length(o.centre[d]), out[3 + d] = o.axis[d];
      const double rest[7] = {o.taylor_deformation,
                              units.to_length(o.axial_diameter),
                              units.to_length(o.transverse_diameter),
                              o.inclination,
                              o.tank_treading_angle,
                              units.to_area(o.area),
                              units.to_volume(o.volume)};
      std::copy(rest, rest + 7, out + 6);
    });
    for (std::size_t c = 0; c < seen.id.size(); ++c) {
      const double* of_cell = seen.values.data() + 13 * c;
      tracks.position.insert(tracks.position.end(), of_cell, of_cell + 3);
      tracks.orientation.insert(tracks.orientation.end(), of_cell + 3, of_cell + 6);
      for (int i = 0; i < 7; ++i) tracks.observables[names[i]].push_back(of_cell[6 + i]);
    }
  }
}

template <class Real>
void Recorder<Real>::sample_diagnostics(Simulation<Real>& simulation, const EnergyBudget& budget) {
  const LatticeUnits& units = simulation.units();
  const data::Scene& scene = simulation.scene();
  const Momentum m = simulation.momentum();
  const lbm::Totals totals = simulation.totals();
  const std::array<double, 3> total = m.total();
  const double scale = m.scale();
  if (!started_) {
    momentum_start_ = total, mass_start_ = totals.mass, started_ = true;
  }
  auto& out = record_.diagnostics;
  out.time.push_back(simulation.time());
  for (int d = 0; d < 3; ++d)
    out.momentum_residual.push_back(scale > 0 ? (total[d] - momentum_start_[d]) / scale : 0);
  double nodes = static_cast<double>(simulation.fluid().fluid_nodes());
  simulation.ranks().sum({&nodes, 1});
  out.mass_error.push_back((totals.mass - mass_start_) / nodes);
  double volume_error = 0;
  for (const auto& group : simulation.groups()) {
    const auto& tracks = record_.kinds[scene.cells.kinds[group.kind].name];
    if (tracks.cells() == 0) continue;
    const auto& volume = tracks.observables.at("volume");
    const double rest = std::visit([](const auto& g) { return g.rest_volume(); }, group.cells);
    for (std::size_t c = volume.size() - tracks.cells(); c < volume.size(); ++c)
      volume_error = std::max(volume_error, std::abs(units.volume(volume[c]) / rest - 1));
  }
  out.volume_error_max.push_back(volume_error);
  // Largest displacement since the last sample against what the faster wall moves in that time.
  const std::size_t T = record_.time.size();
  double ratio = 0;
  const ibm::Faces faces = make_faces(scene, units);
  const double speed =
      units.to_velocity(std::max(std::abs(faces.lower_wall[2]), std::abs(faces.upper_wall[2])));
  if (T > 1 && speed > 0)
    for (const auto& [name, tracks] : record_.kinds)
      for (std::size_t c = 0; c < tracks.cells(); ++c) {
        double square = 0;
        for (int d = 0; d < 3; ++d) square += std::pow(tracks.at(T - 1, c, d) - tracks.at(T - 2, c, d), 2);
        ratio = std::max(ratio, std::sqrt(square) / (speed * (record_.time[T - 1] - record_.time[T - 2])));
      }
  out.max_speed_ratio.push_back(ratio);
  const auto& contact = simulation.contact_summary();
  double overlap = std::max(0.0, -std::min(contact.minimum_gap, contact.minimum_wall_gap));
  simulation.ranks().max({&overlap, 1});
  out.overlap_max.push_back(units.to_length(overlap));
  out.slip_rms.push_back(units.to_velocity(simulation.slip_rms()));
  out.energy_residual.push_back(budget.residual());
  const auto put = [&](std::vector<double>& column, double power) {
    column.push_back(budget.fed() != 0 ? units.to_power(power) : nan);
  };
  put(out.power_in, budget.fed()), put(out.power_viscous, budget.viscous);
  put(out.power_damping, budget.damping), put(out.power_slip, budget.slip);
  put(out.power_stressless, budget.stressless), put(out.power_membranes, budget.membranes);
  put(out.power_contact, budget.contact), put(out.power_inertia, budget.inertia);
}

template <class Real>
void Recorder<Real>::accumulate_profile(const Simulation<Real>& simulation) {
  const Block& block = simulation.block();
  const auto planar = simulation.fluid().profiles(simulation.force());
  const auto force = simulation.force();
  const Block& whole = simulation.decomposition().whole();
  const double nodes = static_cast<double>(whole.nx) * whole.nz,
               share = static_cast<double>(block.nz) / whole.nz;
  std::vector<double> area(planes_, 0.0);
  std::vector<double> here(6 * planes_ +
                           1);  // [plane]{velocity, stress, force, hematocrit}, force on the wall
#pragma omp parallel for schedule(static)
  for (int j = 0; j < planes_; ++j) {
    double sum = 0;
    for (int k = 0; k < block.nz; ++k)
      for (int i = 0; i < block.nx; ++i) sum += force[block.at(i, j, k)].z;
    here[6 * j + 4] = sum / nodes;
  }
  for (const auto& group : simulation.groups()) {
    const data::Kind& kind = simulation.scene().cells.kinds[group.kind];
    if (kind.law == data::Kind::Law::rigid) continue;  // hematocrit counts red cells
    std::visit(
        [&](const auto& g) {
          for (int c = 0; c < g.count(); ++c) {
            const auto x = g.positions(c);
            add_cross_sections([&](int k) { return x[k]; }, g.rest().triangles, 1.0, area);
          }
        },
        group.cells);
  }
  for (int j = 0; j < planes_; ++j) {
    for (int d = 0; d < 3; ++d) here[6 * j + d] = share * planar.velocity[j][d];
    here[6 * j + 3] = share * planar.shear_yz[j];
    here[6 * j + 5] = area[j] / nodes;
  }
  here.back() = simulation.force_on_walls()[0][2] / nodes;
  simulation.ranks().sum({here.data(), here.size()});
  for (int j = 0; j < planes_; ++j) {
    for (int d = 0; d < 3; ++d) velocity_sum_[3 * j + d] += here[6 * j + d];
    fluid_stress_sum_[j] += here[6 * j + 3];
    force_sum_[j] += here[6 * j + 4];
    hematocrit_sum_[j] += here[6 * j + 5];
  }
  wall_force_sum_ += here.back();
  ++averaged_;
}

template <class Real>
void Recorder<Real>::close_profile(const Simulation<Real>& simulation) {
  if (averaged_ == 0) return;
  const LatticeUnits& units = simulation.units();
  auto& out = record_.profile;
  out.time.push_back(simulation.time());
  // Momentum balance of the cells, whose inertia is negligible: the traction they carry through the plane y
  // is the force they exert on the fluid and the wall below it. At a node half of its own plane counts.
  double below = wall_force_sum_;
  for (int j = 0; j < planes_; ++j) {
    const double here = force_sum_[j];
    const double carried = below + here / 2;
    below += here;
    for (int d = 0; d < 3; ++d)
      out.velocity.push_back(units.to_velocity(velocity_sum_[3 * j + d] / averaged_));
    out.hematocrit.push_back(hematocrit_sum_[j] / averaged_);
    out.shear_stress.push_back(units.to_stress((fluid_stress_sum_[j] + carried) / averaged_));
  }
  averaged_ = 0, wall_force_sum_ = 0;
  for (auto* sum : {&velocity_sum_, &fluid_stress_sum_, &force_sum_, &hematocrit_sum_})
    std::fill(sum->begin(), sum->end(), 0.0);
}

template <class Real>
std::vector<double> Recorder<Real>::save() const {
  std::vector<double> out{static_cast<double>(averaged_),
                          started_ ? 1.0 : 0.0,
                          mass_start_,
                          momentum_start_[0],
                          momentum_start_[1],
                          momentum_start_[2]};
  for (const auto* sum : {&velocity_sum_, &fluid_stress_sum_, &force_sum_, &hematocrit_sum_})
    out.insert(out.end(), sum->begin(), sum->end());
  out.push_back(wall_force_sum_);
  return out;
}

template <class Real>
void Recorder<Real>::load(const std::vector<double>& state) {
  averaged_ = static_cast<int>(state.at(0)), started_ = state.at(1) != 0, mass_start_ = state.at(2);
  momentum_start_ = {state.at(3), state.at(4), state.at(5)};
  std::size_t at = 6;
  for (auto* sum : {&velocity_sum_, &fluid_stress_sum_, &force_sum_, &hematocrit_sum_})
    for (auto& v : *sum) v = state.at(at++);
  wall_force_sum_ = state.at(at);
}

template class Recorder<float>;
template class Recorder<double>;

}  // namespace hemowalk::resolved
