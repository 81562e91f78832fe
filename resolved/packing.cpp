#include "resolved/packing.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "core/random.hpp"
#include "core/text.hpp"
#include "resolved/build.hpp"
#include "resolved/contact/grid.hpp"
#include "resolved/contact/walls.hpp"
#include "resolved/region.hpp"
#include "resolved/resolve.hpp"

namespace hemowalk::resolved {

namespace {

using mesh::Vec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Kinds that a hematocrit speaks of: the red cell ("rbc", else the first that is no platelet) and the
/// platelet.
struct Counted {
  int red = -1, platelet = -1;
};
Counted counted_kinds(const data::Scene& scene) {
  Counted counted;
  const auto& kinds = scene.cells.kinds;
  for (int k = static_cast<int>(kinds.size()) - 1; k >= 0; --k) {
    const bool platelet = kinds[k].name == "platelet" || kinds[k].shape.type == data::Shape::Type::platelet;
    (platelet ? counted.platelet : counted.red) = k;
  }
  for (int k = 0; k < static_cast<int>(kinds.size()); ++k)
    if (kinds[k].name == "rbc") counted.red = k;
  return counted;
}

/// floor() of a quotient that round-off may have pushed just below a whole number.
int count_of(double quotient) { return static_cast<int>(std::floor(quotient * (1 + 1e-12) + 1e-9)); }

}  // namespace

Census census(const data::Scene& scene) {
  Census result;
  const Counted kinds = counted_kinds(scene);
  const auto volume_of = [&](int k) {
    return k < 0 ? 0.0 : 1e-18 * mesh::volume(make_mesh(scene.cells.kinds[k], 1e-6));
  };
  result.rbc_volume = volume_of(kinds.red);
  result.platelet_volume = volume_of(kinds.platelet);
  if (!scene.cells.hematocrit) {
    for (const auto& placement : scene.cells.placements)
      for (int k = 0; k < static_cast<int>(scene.cells.kinds.size()); ++k)
        if (scene.cells.kinds[k].name == placement.kind)
          ++(k == kinds.platelet ? result.platelets : result.rbc);
    return result;
  }
  require(kinds.red >= 0 || *scene.cells.hematocrit == 0,
          "cells.hematocrit needs red cells (cells.kinds has none) describe a kind rbc");
  require(kinds.platelet >= 0 || scene.cells.platelets_per_rbc == 0,
          "cells.platelets_per_rbc needs platelets (cells.kinds has none) describe a kind platelet");
  if (kinds.red >= 0)
    result.rbc = count_of(*scene.cells.hematocrit * Region(scene).volume() / result.rbc_volume);
  if (kinds.platelet >= 0) result.platelets = count_of(result.rbc * scene.cells.platelets_per_rbc);
  return result;
}

namespace {

/// The bodies of a packing in the arrays that contact works on.
struct Surfaces {
  std::vector<contact::Shape> shapes;
  std::vector<contact::Body> bodies;
  std::vector<contact::Origin> origin;
  std::vector<Node4<float>> local, force;

  View<const contact::Origin> origins() const { return {origin.data(), origin.size()}; }
  View<const Node4<float>> positions() const { return {local.data(), local.size()}; }
  View<Node4<float>> forces() { return {force.data(), force.size()}; }
};

contact::Shape shape_of(const mesh::TriangleMesh& rest) {
  contact::Shape shape;
  for (const auto& t : rest.triangles)
    for (const int v : t) shape.triangles.push_back(static_cast<std::uint32_t>(v));
  shape.area = mesh::vertex_areas(rest);
  return shape;
}

class Packing {
 public:
  /// Groups of cells without any cell in them.
  explicit Packing(const data::Scene& scene);

  std::vector<InitialCell> place();
  std::vector<InitialCell> grow(PackingReport& report);

 private:
  // Numerical choices, none of which is felt once the cells are apart.
  static constexpr double start_scale = 0.6;  ///< largest size of the cells at the start, of their full size
  static constexpr double start_fraction = 0.10;   ///< volume fraction of bounding spheres there
  static constexpr double shrink = 0.99;           ///< of the box, per step
  static constexpr double shrink_gap = 0.35;       ///< smallest gap at which it shrinks, in contact ranges
  static constexpr double wished_gap = 0.5;        ///< gap to end with if it is to be had, in contact ranges
  static constexpr double least_stiffness = 40e6;  ///< of contact, N/m3 (method 5.2)
  static constexpr double mass_per_stiffness =
      0.5;                                     ///< vertex mass over K A h^2: explicit contact stays stable
  static constexpr double persistence = 0.95;  ///< of velocities from step to step
  static constexpr int patience = 400;         ///< steps granted for the wished gap
  static constexpr int surrender = 1500;       ///< steps without any shrinking that end the attempt

  void add_groups();
  void scatter();
  void build_surfaces();
  void read_positions();
  contact::Domain domain(double scale) const;
  void shrink_box(double& scale);
  void step();
  double volume_error() const;
  contact::Overlap measure(double within) const;
  std::vector<InitialCell> result() const;
  [[noreturn]] void give_up(double scale, const contact::Overlap& overlap) const;

  data::Scene scene_;
  LatticeUnits units_;
  Block block_;
  Region region_;
  contact::Law law_;
  std::vector<Group<float>> groups_;
  Surfaces surfaces_;
  std::vector<std::vector<double>> mass_;  ///< [group][vertex]
  double scale_ = 1;                       ///< size of the cells over that of the box, full = 1
};

/// Packing is quasi-static: no acceleration, and its own damping instead of the membrane's.
data::Scene quasi_static(data::Scene scene) {
  scene.acceleration = 1;
  return scene;
}

Packing::Packing(const data::Scene& scene)
    : scene_(quasi_static(scene)), units_(scene_), block_(make_block(scene_)), region_(scene_) {
  law_ = make_contact(scene_, units_);
  law_.stiffness = std::max(law_.stiffness, units_.stiffness_density(least_stiffness));
  add_groups();
}

/// One group per kind that has cells, empty yet.
void Packing::add_groups() {
  for (int k = 0; k < static_cast<int>(scene_.cells.kinds.size()); ++k) {
    const data::Kind& kind = scene_.cells.kinds[k];
    mesh::TriangleMesh rest = make_mesh(kind, units_.dx);
    std::vector<double> mass = mesh::vertex_areas(rest);
    for (double& m : mass) m *= mass_per_stiffness * law_.stiffness;
    surfaces_.shapes.push_back(shape_of(rest));
    const auto make = [&]() -> decltype(Group<float>::cells) {
      if (kind.law == data::Kind::Law::rigid)
        return rigid::RigidBodies<float>(rigid::BodyType{.rest = rest, .mass = mass, .metric = mass});
      npfem::Material material = make_material(kind, units_);
      material.drag_per_area = 0, material.rayleigh_beta = 0;
      return npfem::Membranes<float>(std::make_shared<npfem::CellType>(rest, material, mass, 1));
    };
    groups_.push_back({make(), k, 0, 0, {}, {}});
    mass_.push_back(mass);
  }
}

contact::Domain Packing::domain(double scale) const {
  contact::Domain d = make_domain(scene_, block_);
  for (double& p : d.period) p /= scale;
  if (const auto gap = region_.gap(); gap.size > 0) {
    d.walls.geometry = contact::Walls::Geometry::surface;
    d.walls.distance = gap.data, d.walls.nodes = {block_.nx, block_.ny, block_.nz}, d.walls.scale = scale;
  }
  for (double* length : {&d.walls.lower, &d.walls.upper, &d.walls.x, &d.walls.y, &d.walls.radius})
    *length /= scale;
  return d;
}

/// Numbers of bodies and markers, once all cells are there.
void Packing::build_surfaces() {
  std::uint32_t slots = 0;
  std::int32_t bodies = 0;
  for (auto& group : groups_) {
    group.first_marker = slots;
    group.first_body = bodies;
    for (int c = 0; c < group.count(); ++c)
      surfaces_.bodies.push_back({group.marker(c, 0), group.marker(c, 1) - group.marker(c, 0),
                                  static_cast<std::uint16_t>(group.kind), true});
    std::visit(
        [&](const auto& g) { slots += static_cast<std::uint32_t>(g.batches() * g.vertices() * g.lanes); },
        group.cells);
    bodies += group.count();
  }
  surfaces_.origin.resize(bodies);
  surfaces_.local.resize(slots);
  surfaces_.force.resize(slots);
  read_positions();
}

void Packing::read_positions() {
  for (auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          const auto layout = g.layout();
          const auto anchors = g.anchors();
          const auto offsets = g.offsets();
#pragma omp parallel for schedule(static)
          for (int c = 0; c < g.count(); ++c) {
            contact::Origin& origin = surfaces_.origin[group.first_body + c];
            float shift[3];
            for (int d = 0; d < 3; ++d) {
              const double anchor = anchors[layout.anchor(c, d)];
              origin[d] = static_cast<std::int32_t>(std::floor(anchor));
              shift[d] = static_cast<float>(anchor - origin[d]);
            }
            for (int k = 0; k < g.vertices(); ++k)
              surfaces_.local[group.first_marker + layout.at(c, k)] = {
                  shift[0] + offsets[layout.at(c, k, 0)], shift[1] + offsets[layout.at(c, k, 1)],
                  shift[2] + offsets[layout.at(c, k, 2)], 0};
          }
        },
        group.cells);
}

/// Uniform rotation: four normal numbers give a uniform direction in quaternion space.
mesh::Quaternion random_rotation(std::uint64_t seed, std::uint64_t cell) {
  const auto a = normal2(random_bits(seed, Stream::packing, cell, 0));
  const auto b = normal2(random_bits(seed, Stream::packing, cell, 1));
  return mesh::normalized({a[0], a[1], b[0], b[1]});
}

/// Random sequential addition of bounding spheres in the enlarged box: cell after cell takes the first of its
/// random positions that is free. Cells and box have the proportions of scale_ to 1.
void Packing::scatter() {
  const Census count = census(scene_);
  const Counted kinds = counted_kinds(scene_);
  struct Batch {
    int kind, cells;
  };
  const Batch batches[] = {{kinds.red, count.rbc}, {kinds.platelet, count.platelets}};
  double spheres = 0, largest = 0;
  const auto radius_of = [&](int kind) {
    return std::visit([](const auto& g) { return g.bounding_radius(); }, groups_[kind].cells) +
           law_.range / 2;
  };
  for (const Batch& b : batches)
    if (b.cells > 0) {
      spheres += b.cells * 4.18879 * std::pow(radius_of(b.kind), 3);
      largest = std::max(largest, radius_of(b.kind));
    }
  const double room = units_.volume(region_.volume());
  double needed = 0;  // with half the smallest gap around every cell
  for (const Batch& b : batches)
    if (b.cells > 0) {
      const mesh::TriangleMesh rest = make_mesh(scene_.cells.kinds[b.kind], units_.dx);
      needed += b.cells * (mesh::volume(rest) + mesh::area(rest) * smallest_packed_gap / 2);
    }
  require(needed < room, [&] {
    return formatted(
        "cells.hematocrit %g cannot be packed (cells with gaps of %g dx fill %.0f %% of the box) lower "
        "it",
        scene_.cells.hematocrit.value_or(0), smallest_packed_gap, 100 * needed / room);
  });
  scale_ = std::min(start_scale, std::cbrt(start_fraction * room / std::max(spheres, 1e-9)));
  const contact::Domain box = domain(scale_);
  const Vec3 size{block_.nx / scale_, block_.ny / scale_, block_.nz / scale_};
  using Geometry = contact::Walls::Geometry;
  const contact::WallGaps<double> gaps(box.walls, {0, 0, 0});
  const double known_gap = 0.99 * Region::gap_limit / scale_;
  const auto clear = [&](const Vec3& x, double radius) {
    return box.walls.geometry != Geometry::surface ||
           gaps({x[0], x[1], x[2]}).gap >= std::min(radius, known_gap);
  };
  require((box.walls.geometry != Geometry::slab || size[1] > 2 * largest) &&
              (box.walls.geometry != Geometry::tube || box.walls.radius > largest),
          "cells do not fit between the walls (bounding sphere against gap) enlarge the box");
  // A uniform point of the box, or of the room that walls leave to a sphere's centre.
  const auto point = [&](const auto& u, const auto& w, double radius) -> Vec3 {
    if (box.walls.geometry == Geometry::tube) {
      const double r = (box.walls.radius - radius) * std::sqrt(u[0]), angle = 2 * std::acos(-1.0) * u[1];
      return {box.walls.x + r * std::cos(angle), box.walls.y + r * std::sin(angle), w[0] * size[2]};
    }
    const double margin = box.walls.geometry == Geometry::slab ? radius : 0;
    return {u[0] * size[0], margin + u[1] * (size[1] - 2 * margin), w[0] * size[2]};
  };

  // Cells of a grid as wide as the largest diameter: neighbours are in the 27 around.
  std::array<int, 3> cells;
  for (int d = 0; d < 3; ++d) cells[d] = std::clamp(static_cast<int>(size[d] / (2 * largest)), 1, 512);
  struct Sphere {
    Vec3 centre;
    double radius;
  };
  std::vector<std::vector<Sphere>> grid(static_cast<std::size_t>(cells[0]) * cells[1] * cells[2]);
  const auto bin = [&](int i, int j, int k) -> std::vector<Sphere>& {
    return grid[(static_cast<std::size_t>((k + cells[2]) % cells[2]) * cells[1] + (j + cells[1]) % cells[1]) *
                    cells[0] +
                (i + cells[0]) % cells[0]];
  };
  std::uint64_t id = 0;
  for (const Batch& b : batches)
    for (int c = 0; c < b.cells; ++c, ++id) {
      const double radius = radius_of(b.kind);
      bool placed = false;
      for (std::uint64_t attempt = 0; attempt < 10000 && !placed; ++attempt) {
        const auto u = uniform2(random_bits(scene_.seed, Stream::packing, id, 2 + 2 * attempt));
        const auto w = uniform2(random_bits(scene_.seed, Stream::packing, id, 3 + 2 * attempt));
        const Vec3 x = point(u, w, radius);
        std::array<int, 3> at;
        for (int d = 0; d < 3; ++d)
          at[d] = std::min(static_cast<int>(x[d] / size[d] * cells[d]), cells[d] - 1);
        bool free = true;
        for (int i = -1; i <= 1 && free; ++i)
          for (int j = -1; j <= 1 && free; ++j)
            for (int k = -1; k <= 1 && free; ++k)
              for (const Sphere& s : bin(at[0] + i, at[1] + j, at[2] + k)) {
                double squared = 0;
                for (int d = 0; d < 3; ++d) {
                  double r = x[d] - s.centre[d];
                  if (box.period[d] > 0) r -= box.period[d] * std::round(r / box.period[d]);
                  squared += r * r;
                }
                free = free && squared > (radius + s.radius) * (radius + s.radius);
              }
        if (!free || !clear(x, radius)) continue;
        placed = true;
        bin(at[0], at[1], at[2]).push_back({x, radius});
        std::visit(
            [&](auto& g) { g.add(static_cast<std::int64_t>(id), x, random_rotation(scene_.seed, id)); },
            groups_[b.kind].cells);
      }
      require(placed, [&] {
        return formatted(
            "cells.hematocrit: no room for cell %s even at %.0f %% of its size (the box is too small for "
            "such "
            "bodies) enlarge the box or lower the hematocrit",
            std::to_string(id).c_str(), 100 * scale_);
      });
    }
}

/// Moves every cell with the shrinking box and leaves its shape as it is.
void Packing::shrink_box(double& scale) {
  const double next = std::min(1.0, scale / shrink), ratio = scale / next;
  for (auto& group : groups_)
    std::visit(
        [&](auto& g) {
          for (int c = 0; c < g.count(); ++c) {
            const Vec3 at = g.anchor(c);
            g.translate(c, {(ratio - 1) * at[0], (ratio - 1) * at[1], (ratio - 1) * at[2]});
          }
        },
        group.cells);
  scale = next;
}

/// One step of damped motion under contact and elasticity; the velocity that moved a cell last carries on,
/// less a part.
void Packing::step() {
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    auto& group = groups_[i];
    std::visit(
        [&](auto& g) {
          const int lanes = g.lanes, vertices = g.vertices();
          const auto velocity = g.velocities();
          const auto predicted = g.predicted();
#pragma omp parallel for schedule(static)
          for (int b = 0; b < g.batches(); ++b)
            for (int k = 0; k < vertices; ++k) {
              const std::size_t at = (static_cast<std::size_t>(b) * vertices + k) * lanes;
              const float inverse = static_cast<float>(1 / mass_[i][k]);
              for (int l = 0; l < lanes; ++l) {
                const Node4<float>& f = surfaces_.force[group.first_marker + at + l];
                predicted[3 * at + l] = float(persistence) * velocity[3 * at + l] + inverse * f.x;
                predicted[3 * at + lanes + l] =
                    float(persistence) * velocity[3 * at + lanes + l] + inverse * f.y;
                predicted[3 * at + 2 * lanes + l] =
                    float(persistence) * velocity[3 * at + 2 * lanes + l] + inverse * f.z;
              }
            }
          mesh::StepOptions options;
          options.iterations = 2;
          options.damping = false;
          const mesh::StepReport report = g.step(options);
          if (report.bad_cell >= 0)
            throw PhysicsError(
                formatted("packing: cell %d of kind %s blew up (its position is not finite) try another seed",
                          report.bad_cell, scene_.cells.kinds[group.kind].name.c_str()));
        },
        group.cells);
  }
}

double Packing::volume_error() const {
  double worst = 0;
  for (const auto& group : groups_)
    if (const auto* membranes = std::get_if<npfem::Membranes<float>>(&group.cells))
      for (int c = 0; c < membranes->count(); ++c)
        worst = std::max(worst, std::abs(membranes->volume(c) / membranes->rest_volume() - 1));
  return worst;
}

contact::Overlap Packing::measure(double within) const {
  return contact::measure_overlap(domain(scale_), surfaces_.shapes, surfaces_.bodies, surfaces_.origins(),
                                  surfaces_.positions(), within);
}

void Packing::give_up(double scale, const contact::Overlap& overlap) const {
  throw InputError(
      formatted("cells.hematocrit %g cannot be packed (with cells at %.1f %% of their size the smallest "
                "gap is %.3f dx and %s "
                "vertices are inside other cells) lower it",
                scene_.cells.hematocrit.value_or(0), 100 * scale, overlap.minimum_gap,
                std::to_string(overlap.inside).c_str()));
}

/// Cells with their centres in the box.
std::vector<InitialCell> Packing::result() const {
  const contact::Domain box = domain(1);
  std::vector<InitialCell> cells;
  for (const auto& group : groups_)
    std::visit(
        [&](const auto& g) {
          for (int c = 0; c < g.count(); ++c) {
            InitialCell cell;
            cell.kind = group.kind;
            const Vec3 at = g.anchor(c);
            Vec3 shift{};
            for (int d = 0; d < 3; ++d)
              if (box.period[d] > 0) shift[d] = -box.period[d] * std::floor(at[d] / box.period[d]);
            cell.centre = {at[0] + shift[0], at[1] + shift[1], at[2] + shift[2]};
            if constexpr (requires { g.orientation(c); }) {
              cell.orientation = g.orientation(c);
            } else {
              cell.vertices = g.positions(c);
              for (Vec3& x : cell.vertices)
                for (int d = 0; d < 3; ++d) x[d] += shift[d];
            }
            cells.push_back(std::move(cell));
          }
        },
        group.cells);
  return cells;
}

std::vector<InitialCell> Packing::grow(PackingReport& report) {
  scatter();
  build_surfaces();
  if (surfaces_.bodies.empty()) return {};
  contact::Contact<float> contact(law_, domain(scale_), surfaces_.shapes);
  contact.set_bodies(surfaces_.bodies);
  for (int since_shrink = 0;; ++since_shrink, ++report.iterations) {
    contact::Summary sum = contact.compute(surfaces_.origins(), surfaces_.positions(), surfaces_.forces());
    const double gap = std::min(sum.minimum_gap, sum.minimum_wall_gap);
    if (scale_ < 1 && gap > shrink_gap * law_.range) {
      shrink_box(scale_);
      contact.set_domain(domain(scale_));
      read_positions();
      sum = contact.compute(surfaces_.origins(), surfaces_.positions(), surfaces_.forces());
      since_shrink = 0;
    }
    const bool good = gap > wished_gap * law_.range,
               fair = gap > 1.2 * smallest_packed_gap && since_shrink > patience;
    if (scale_ == 1 && since_shrink > 0 && (good || fair)) {
      const contact::Overlap overlap = measure(law_.range);
      report.minimum_gap = overlap.minimum_gap;
      report.minimum_wall_gap = overlap.minimum_wall_gap;
      if (overlap.inside == 0 && overlap.minimum_gap >= smallest_packed_gap) break;
    }
    if (since_shrink > surrender) give_up(scale_, measure(law_.range));
    step();
    read_positions();
  }
  report.volume_error_max = volume_error();
  return result();
}

std::vector<InitialCell> Packing::place() {
  std::vector<InitialCell> cells;
  for (std::size_t i = 0; i < scene_.cells.placements.size(); ++i) {
    const data::Placement& p = scene_.cells.placements[i];
    int kind = -1;
    for (int k = 0; k < static_cast<int>(scene_.cells.kinds.size()); ++k)
      if (scene_.cells.kinds[k].name == p.kind) kind = k;
    require(kind >= 0, "cells.explicit." + std::to_string(i) + ": unknown kind " + p.kind +
                           " (not in cells.kinds) describe it");
    InitialCell cell;
    cell.kind = kind;
    for (int d = 0; d < 3; ++d) cell.centre[d] = units_.length(p.position[d]);
    cell.orientation = mesh::rotation(p.axis, p.angle);
    std::visit([&](auto& g) { g.add(static_cast<std::int64_t>(i), cell.centre, cell.orientation); },
               groups_[kind].cells);
    cells.push_back(std::move(cell));
  }
  if (cells.empty()) return cells;
  build_surfaces();
  const contact::Overlap overlap = measure(law_.range);
  const auto name = [&](std::int32_t body) {
    for (const auto& group : groups_)
      if (body >= group.first_body && body < group.first_body + group.count())
        return std::visit([&](const auto& g) { return std::to_string(g.id(body - group.first_body)); },
                          group.cells);
    return std::string("?");
  };
  require(overlap.inside == 0 && overlap.minimum_gap > 0, [&] {
    return formatted(
        "cells.explicit.%s and cells.explicit.%s overlap (by %.3g um; %s vertices are inside another cell) "
        "move them apart",
        name(overlap.first).c_str(), name(overlap.second).c_str(),
        1e6 * units_.to_length(-overlap.minimum_gap), std::to_string(overlap.inside).c_str());
  });
  require(overlap.outside_walls == 0, [&] {
    return formatted("cells.explicit: %s vertices are beyond a wall (by %.3g um) move the cells away from it",
                     std::to_string(overlap.outside_walls).c_str(),
                     1e6 * units_.to_length(-overlap.minimum_wall_gap));
  });
  return cells;
}

}  // namespace

std::vector<InitialCell> pack(const data::Scene& scene, PackingReport* report) {
  const double start = omp_get_wtime();
  PackingReport mine;
  Packing packing(scene);
  std::vector<InitialCell> cells = scene.cells.hematocrit ? packing.grow(mine) : packing.place();
  mine.seconds = omp_get_wtime() - start;
  if (report) *report = mine;
  return cells;
}

}  // namespace hemowalk::resolved
