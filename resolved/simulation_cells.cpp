// The cells of a simulation: which ones are here, where they are in the arrays, and how they pass from rank
// to rank.

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "core/check.hpp"
#include "resolved/build.hpp"
#include "resolved/bytes.hpp"
#include "resolved/simulation.hpp"

namespace hemowalk::resolved {

/// All kinds that occur, and of their cells those with the centre in this rank's slab.
template <class Real>
void Simulation<Real>::build_groups(const std::vector<InitialCell>& cells) {
  const double steps = h_;
  for (int kind = 0; kind < static_cast<int>(scene_.cells.kinds.size()); ++kind) {
    if (std::none_of(cells.begin(), cells.end(), [&](const InitialCell& c) { return c.kind == kind; }))
      continue;
    const data::Kind& k = scene_.cells.kinds[kind];
    mesh::TriangleMesh rest = make_mesh(k, units_.dx);
    const bool is_rigid = k.law == data::Kind::Law::rigid;
    mesh::TriangleMesh held = rest;
    MirrorSurface surface = mirror_surface(k, rest, scene_.coupling);
    if (is_rigid || !surface.mirror.empty()) held.vertices = coupling_points(k, rest, scene_.coupling);
    const std::vector<double> area = mesh::vertex_areas(held);
    const double density = k.density / units_.density,
                 displaced =
                     mesh::volume(rest) / rest.vertex_count();  // mass of the plasma in a cell, per vertex
    std::vector<double> mass(area.size(), (density - 1) * displaced), weight = area, metric(area.size());
    for (std::size_t v = 0; v < area.size(); ++v) {
      switch (scheme_) {
        case Scheme::conservative:
          weight[v] = scene_.coupling.chi * area[v];
          metric[v] = mass[v] + steps * weight[v];
          break;
        case Scheme::paper:
          metric[v] = mass[v] = density * displaced;
          break;
        case Scheme::peskin:
          mass[v] = 0, metric[v] = displaced;  // the metric of a step that is never taken
          break;
      }
      require(
          metric[v] > 0,
          "cells.kinds." + k.name +
              ".density is too low (the implicit mass of a vertex is not positive) raise it or coupling.chi");
    }
    npfem::Material material = make_material(k, units_);
    material.damp_after = scheme_ == Scheme::paper;
    auto make = [&]() -> std::variant<npfem::Membranes<Real>, rigid::RigidBodies<Real>> {
      if (is_rigid) return rigid::RigidBodies<Real>(rigid::BodyType{rest, mass, metric, h_, held.vertices});
      return npfem::Membranes<Real>(std::make_shared<npfem::CellType>(rest, material, metric, h_));
    };
    Group<Real> group{make(), kind, 0, 0, mass, weight, std::move(surface)};
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (cells[c].kind != kind) continue;
      const double plane = decomposition_.localise(std::floor(cells[c].centre[2]));
      if (plane < 0 || plane >= block_.nz) continue;
      std::visit(
          [&](auto& g) {
            const int index = g.add(static_cast<std::int64_t>(c), cells[c].centre, cells[c].orientation);
            if constexpr (requires { g.set_positions(index, cells[c].vertices); })
              if (!cells[c].vertices.empty()) g.set_positions(index, cells[c].vertices);
          },
          group.cells);
    }
    groups_.push_back(std::move(group));
  }
}

/// Point loads act on the given fraction of a cell's vertices, those farthest towards one end of its shape.
template <class Real>
void Simulation<Real>::find_loads(const std::vector<InitialCell>& cells) {
  for (const auto& load : scene_.cells.loads) {
    if (load.cell < 0 || load.cell >= static_cast<int>(cells.size())) continue;
    const InitialCell& cell = cells[load.cell];
    std::vector<mesh::Vec3> x = cell.vertices;
    if (x.empty()) {
      x = make_mesh(scene_.cells.kinds[cell.kind], units_.dx).vertices;
      for (auto& v : x) {
        v = mesh::rotate(cell.orientation, v);
        for (int d = 0; d < 3; ++d) v[d] += cell.centre[d];
      }
    }
    const int axis = load.end[1] - 'x';
    const double sign = load.end[0] == '-' ? -1 : 1;
    std::vector<int> order(x.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return sign * x[a][axis] > sign * x[b][axis]; });
    const int n = std::max(1, static_cast<int>(std::lround(load.fraction * static_cast<double>(x.size()))));
    for (int i = 0; i < n; ++i) {
      std::array<double, 3> share{};
      for (int d = 0; d < 3; ++d) share[d] = units_.force(load.force[d]) / n;
      loads_.push_back({load.cell, order[i], share});
    }
  }
}

template <class Real>
void Simulation<Real>::build_coupling() {
  std::vector<contact::Shape> shapes;
  std::vector<int> vertices;
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          contact::Shape shape;
          for (const auto& t : g.rest().triangles)
            for (const int v : t) shape.triangles.push_back(static_cast<std::uint32_t>(v));
          shape.area = g.vertex_areas();
          shapes.push_back(std::move(shape));
          vertices.push_back(g.vertices());
          scratch_stride_ = std::max<std::size_t>(scratch_stride_, 3 * g.vertices() * g.lanes);
        },
        group.cells);
  scratch_ = Array<Real>(scratch_stride_ * omp_get_max_threads());
  const contact::Law law = make_contact(scene_, units_);
  const bool by_kernel = scene_.contact.model == data::Contact::Model::particle_in_kernel;
  const bool in_contact = law.stiffness > 0 && any_cells_ && !by_kernel;
  if (scheme_ == Scheme::paper) {
    paper_ = std::make_unique<Paper>();
    paper_->momentum = Array<Node4<Real>>(block_.size());
    for (const auto& group : groups_)
      paper_->rings.emplace_back(std::visit([](const auto& g) { return g.rest(); }, group.cells));
    if (by_kernel)
      paper_->contact = std::make_unique<contact::KernelContact<Real>>(make_kernel_contact(scene_, units_),
                                                                       make_domain(scene_, block_), vertices);
  }
  copies_ = std::make_unique<Copies<Real>>(decomposition_, in_contact ? law.range : -1, vertices);
  if (in_contact) {
    contact::Domain domain = make_domain(scene_, block_);
    if (const auto gap = region_.gap(); gap.size > 0) {
      const Block& whole = decomposition_.whole();
      domain.walls.geometry = contact::Walls::Geometry::surface;
      domain.walls.distance = gap.data, domain.walls.nodes = {whole.nx, whole.ny, whole.nz};
      domain.walls.first_plane = decomposition_.first_plane();
    }
    if (decomposition_.divided()) domain.period[2] = 0;  // periodic images come as copies
    contact_ = std::make_unique<contact::Contact<Real>>(law, domain, shapes);
  }
  arrange();
  markers_ = std::make_unique<ibm::Markers<Real>>(block_, faces_, make_kernel(scene_.coupling.kernel),
                                                  copies_->body_of());
}

/// Places of the own cells in the arrays, after cells came or went: kind by kind, batch by batch.
template <class Real>
void Simulation<Real>::arrange() {
  bodies_ = slots_ = 0;
  std::vector<contact::Body> bodies;
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    Group<Real>& group = groups_[i];
    group.first_body = static_cast<std::int32_t>(bodies_);
    group.first_marker = static_cast<std::uint32_t>(slots_);
    std::visit(
        [&](const auto& g) {
          for (int c = 0; c < g.count(); ++c)
            bodies.push_back({group.marker(c, 0), static_cast<std::uint32_t>(g.lanes),
                              static_cast<std::uint16_t>(i), true});
          for (auto& load : loads_) {
            if (i == 0) load.slot = -1;
            for (int c = 0; c < g.count(); ++c)
              if (g.id(c) == load.cell) load.slot = group.marker(c, load.vertex);
          }
          bodies_ += g.count();
          slots_ += static_cast<std::size_t>(g.batches()) * g.vertices() * g.lanes;
        },
        group.cells);
  }
  copies_->set_bodies(std::move(bodies), slots_);
  fit_arrays();
}

/// Room for all bodies and slots. The first size fits exactly; a number that changes gets room for more.
template <class Real>
void Simulation<Real>::fit_arrays() {
  const auto fit = [](auto& array, std::size_t n) {
    if (n <= array.size()) return;
    std::remove_reference_t<decltype(array)> larger(array.size() == 0 ? n : n + n / 4);
    if (array.size())
      std::memcpy(static_cast<void*>(larger.data()), array.data(), array.size() * sizeof(array[0]));
    array = std::move(larger);
  };
  const std::size_t slots = copies_->slots();
  fit(origin_, copies_->bodies().size());
  if (decomposition_.divided()) fit(extent_, bodies_);
  for (auto* field : {&vertices_, &sites_, &reading_, &impulse_, &contact_force_}) fit(*field, slots);
  fit(normal_rate_, 3 * slots_), fit(couple_force_, 3 * slots_);
  if (!one_theta_) fit(force_reading_, slots);
  if (paper_) fit(paper_->normal, slots);
}

namespace {

/// Last impulses of the cells of one group, [cell][vertex][3]: they belong to a cell's state.
template <class Real>
using Impulses = std::vector<Real>;

template <class Real>
Impulses<Real> impulses_of(const Group<Real>& group, const Array<Node4<Real>>& impulse) {
  Impulses<Real> out;
  const int vertices = std::visit([](const auto& g) { return g.vertices(); }, group.cells);
  for (int c = 0; c < group.count(); ++c)
    for (int k = 0; k < vertices; ++k) {
      const Node4<Real>& j = impulse[group.marker(c, k)];
      out.insert(out.end(), {j.x, j.y, j.z});
    }
  return out;
}

}  // namespace

/// Cells whose centre is a node or more outside the slab go to the neighbour that holds it, whole; with them
/// go those that are outside at all, so that this happens seldom.
template <class Real>
void Simulation<Real>::hand_over(Copies<Real>& copies) {
  if (!copies.passing()) return;
  if (solid_.give_back) solid_.give_back();
  read_positions();
  std::vector<Impulses<Real>> impulses;
  std::vector<std::byte> outgoing[2], incoming;
  for (auto& group : groups_) {
    impulses.push_back(impulses_of(group, impulse_));
    Impulses<Real>& of_group = impulses.back();
    std::visit(
        [&](auto& g) {
          const std::size_t length = 3 * static_cast<std::size_t>(g.vertices());
          std::vector<std::byte> state(g.state_bytes());
          const std::int32_t number = static_cast<std::int32_t>(&group - groups_.data());
          for (int c = g.count() - 1; c >= 0;
               --c) {  // downwards: the last cell takes the place of one that goes
            const auto body = static_cast<std::size_t>(group.first_body + c);
            for (const Side side : both_sides) {
              const int z = origin_[body][2];
              if (!copies.leaving(side) || (side == Side::low ? z >= 0 : z < block_.nz)) continue;
              std::vector<std::byte>& out = outgoing[index_of(side)];
              g.save(c, state.data());
              put(out, &number, 1), put(out, state.data(), state.size());
              put(out, of_group.data() + c * length, length);
              copies.gave_away(side, extent_[body]);
              g.remove(c);
              std::copy(of_group.end() - length, of_group.end(), of_group.begin() + c * length);
              of_group.resize(of_group.size() - length);
              break;
            }
          }
        },
        group.cells);
  }
  for (const Side side : both_sides)
    if (copies.leaving(side)) {
      const auto& out = outgoing[index_of(side)];
      handing_over_.send(side, out.data(), out.size());
    }
  for (const Side side : both_sides) {
    if (!copies.arriving(side)) continue;
    handing_over_.receive(side, incoming);
    for (Reader in({incoming.data(), incoming.size()}); !in.at_end(); ++arrivals_) {
      const auto number = in.take<std::int32_t>().at(0);
      const auto state = in.take<std::byte>();
      std::visit([&](auto& g) { g.load(state.data()); }, groups_.at(number).cells);
      const auto of_cell = in.take<Real>();
      impulses[number].insert(impulses[number].end(), of_cell.begin(), of_cell.end());
    }
  }
  handing_over_.wait();
  arrange();
  for (auto* field : {&reading_, &impulse_, &contact_force_})
    std::memset(static_cast<void*>(field->data()), 0, field->size() * sizeof(Node4<Real>));
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const Real* j = impulses[i].data();
    const int vertices = std::visit([](const auto& g) { return g.vertices(); }, groups_[i].cells);
    for (int c = 0; c < groups_[i].count(); ++c)
      for (int k = 0; k < vertices; ++k, j += 3)
        impulse_[groups_[i].marker(c, k)] = {j[0], j[1], j[2], Real(0)};
  }
  if (solid_.take_over) solid_.take_over();
}

template void Simulation<float>::build_groups(const std::vector<InitialCell>&);
template void Simulation<float>::find_loads(const std::vector<InitialCell>&);
template void Simulation<float>::build_coupling();
template void Simulation<float>::arrange();
template void Simulation<float>::fit_arrays();
template void Simulation<float>::hand_over(Copies<float>&);
template void Simulation<double>::build_groups(const std::vector<InitialCell>&);
template void Simulation<double>::find_loads(const std::vector<InitialCell>&);
template void Simulation<double>::build_coupling();
template void Simulation<double>::arrange();
template void Simulation<double>::fit_arrays();
template void Simulation<double>::hand_over(Copies<double>&);

}  // namespace hemowalk::resolved
