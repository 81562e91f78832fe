#include "resolved/build.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.hpp"
#include "resolved/mesh/mesh_file.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::resolved {

Block make_block(const data::Scene& scene) {
  std::array<int, 3> n{};
  for (int d = 0; d < 3; ++d) {
    const double nodes = scene.domain.size[d] / scene.fluid.dx;
    n[d] = static_cast<int>(std::lround(nodes));
    require(n[d] >= 4 && std::abs(nodes - n[d]) < 1e-6 * nodes, [&] {
      return "domain.size." + std::to_string(d) + " is " + std::to_string(nodes) +
             " lattice spacings (it must be a whole number, 4 or more) choose a multiple of fluid.dx";
    });
  }
  return {n[0], n[1], n[2]};
}

ibm::Faces make_faces(const data::Scene& scene, const LatticeUnits& units) {
  ibm::Faces faces;
  faces.periodic_y = scene.domain.geometry != data::Domain::Geometry::slab;  // else solid nodes are the walls
  if (scene.flow.type == data::Flow::Type::couette) {
    const double speed = units.velocity(scene.flow.shear_rate * scene.domain.size[1]);
    const bool both = scene.flow.walls == data::Flow::Walls::both;
    faces.lower_wall[2] = both ? -speed / 2 : 0;
    faces.upper_wall[2] = both ? speed / 2 : speed;
  }
  return faces;
}

ibm::Kernel make_kernel(data::Coupling::Kernel kernel) {
  switch (kernel) {
    case data::Coupling::Kernel::phi2:
      return ibm::Kernel::phi2;
    case data::Coupling::Kernel::phi3:
      return ibm::Kernel::phi3;
    default:
      return ibm::Kernel::phi4;
  }
}

namespace {

/// Pressure gradient that drives a poiseuille flow, N/m3: given, or for a mean velocity U 12 mu U/H^2 in a
/// slab, 32 mu U/D^2 in a tube.
double driving_force(const data::Scene& scene) {
  if (scene.flow.type != data::Flow::Type::poiseuille) return 0;
  if (scene.flow.pressure_gradient) return *scene.flow.pressure_gradient;
  const double mu = scene.fluid.density * scene.fluid.kinematic_viscosity, H = scene.domain.size[1];
  if (scene.domain.geometry == data::Domain::Geometry::tube)
    return 32 * mu * scene.flow.mean_velocity.value_or(0) / std::pow(scene.domain.tube_diameter, 2);
  return 12 * mu * scene.flow.mean_velocity.value_or(0) / (H * H);
}

}  // namespace

lbm::Parameters make_fluid(const data::Scene& scene, const LatticeUnits& units) {
  lbm::Parameters p;
  p.tau = scene.fluid.tau;
  p.collision =
      scene.fluid.collision == data::Fluid::Collision::trt ? lbm::Collision::trt : lbm::Collision::bgk;
  p.magic = scene.fluid.magic;
  p.forcing = scene.fluid.forcing == data::Fluid::Forcing::guo ? lbm::Forcing::guo : lbm::Forcing::shan_chen;
  const ibm::Faces faces = make_faces(scene, units);
  p.walls_y = !faces.periodic_y;
  p.lower_wall_velocity = faces.lower_wall, p.upper_wall_velocity = faces.upper_wall;
  p.body_force[2] = units.force_density(driving_force(scene));
  return p;
}

double steady_velocity(const data::Scene& scene, const LatticeUnits& units, double x, double y) {
  const double H = units.length(scene.domain.size[1]);
  const double nu = (scene.fluid.tau - 0.5) / 3, g = units.force_density(driving_force(scene));
  if (scene.domain.geometry == data::Domain::Geometry::tube) {
    const double rx = x - units.length(scene.domain.size[0]) / 2, ry = y - H / 2,
                 radius = units.length(scene.domain.tube_diameter) / 2;
    return std::max(0.0, g / (4 * nu) * (radius * radius - rx * rx - ry * ry));
  }
  const ibm::Faces faces = make_faces(scene, units);
  if (faces.periodic_y) return 0;
  return faces.lower_wall[2] + (faces.upper_wall[2] - faces.lower_wall[2]) * y / H +
         g / (2 * nu) * y * (H - y);
}

mesh::TriangleMesh make_mesh(const data::Kind& kind, double unit) {
  using Type = data::Shape::Type;
  const auto& radii = kind.shape.radii;
  switch (kind.shape.type) {
    case Type::rbc:
      return mesh::red_cell(1e-6 / unit, kind.subdivision);
    case Type::platelet:
      return mesh::platelet(1e-6 / unit, kind.subdivision);
    case Type::sphere:
      return mesh::sphere(radii[0] / unit, kind.subdivision);
    case Type::ellipsoid:
      return mesh::ellipsoid({radii[0] / unit, radii[1] / unit, radii[2] / unit}, kind.subdivision);
    case Type::mesh:
      break;
  }
  mesh::TriangleMesh m = mesh::read_mesh(kind.shape.file);
  const mesh::Vec3 centre = mesh::centroid(m);
  for (auto& v : m.vertices)
    for (int d = 0; d < 3; ++d) v[d] = (v[d] - centre[d]) * kind.shape.unit / unit;
  return m;
}

namespace {

/// How far a platelet is drawn back, in units of the retraction of a flat sheet: its rim (fitted to the drag)
/// and its faces, over the half thickness in dx (fitted to the Jeffery period, linear in between). Two faces
/// that share kernels must come closer the thinner the platelet is. docs/evidence/validation.md, section 1.
/// phi2 has no fit of its own: it takes phi3's.
struct PlateletFit {
  double rim;
  std::array<std::array<double, 2>, 6> faces;  ///< {half thickness, depth}

  double face(double half_thickness) const {
    std::size_t i = 1;
    while (i + 1 < faces.size() && half_thickness > faces[i][0]) ++i;
    const auto [x0, y0] = faces[i - 1];
    const auto [x1, y1] = faces[i];
    return std::max(1.0, y0 + (y1 - y0) * (half_thickness - x0) / (x1 - x0));
  }
};
constexpr PlateletFit with_phi4{
    1.58, {{{0.917, 1.245}, {1.1, 1.48}, {1.375, 1.767}, {1.65, 1.967}, {1.85, 1.90}, {2.2, 1.55}}}};
constexpr PlateletFit with_phi3{
    1.714, {{{0.917, 1.914}, {1.1, 2.151}, {1.375, 2.191}, {1.65, 1.857}, {1.833, 1.557}, {2.2, 1.18}}}};

/// By which shares of its semi-axes (y: of the faces, x and z: of the rim) a platelet is drawn back.
mesh::Vec3 platelet_shares(const data::Kind& kind, const mesh::TriangleMesh& rest,
                           const data::Coupling& coupling) {
  mesh::Vec3 radius{};
  for (const auto& p : rest.vertices)
    for (int d = 0; d < 3; ++d) radius[d] = std::max(radius[d], p[d]);
  const PlateletFit& fit = coupling.kernel == data::Coupling::Kernel::phi4 ? with_phi4 : with_phi3;
  const double rim = fit.rim * coupling.retraction, face = fit.face(radius[1]) * coupling.retraction;
  const mesh::Vec3 depth{rim, face, rim};
  for (int d = 0; d < 3; ++d)
    require(depth[d] < radius[d], [&] {
      return "cells.kinds." + kind.name + " is too thin for coupling.retraction (its half thickness of " +
             std::to_string(radius[d]) + " dx would be drawn back by " + std::to_string(depth[d]) +
             " dx) lower fluid.dx or the retraction";
    });
  return {depth[0] / radius[0], depth[1] / radius[1], depth[2] / radius[2]};
}

}  // namespace

std::vector<mesh::Vec3> coupling_points(const data::Kind& kind, const mesh::TriangleMesh& rest,
                                        const data::Coupling& coupling) {
  std::vector<mesh::Vec3> points = rest.vertices;
  if (kind.shape.type == data::Shape::Type::platelet) {
    const mesh::Vec3 share = platelet_shares(kind, rest, coupling);
    for (auto& p : points)
      for (int d = 0; d < 3; ++d) p[d] *= 1 - share[d];
    return points;
  }
  const auto normals = mesh::vertex_normals(rest);
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int d = 0; d < 3; ++d) points[k][d] -= coupling.retraction * normals[k][d];
  return points;
}

MirrorSurface mirror_surface(const data::Kind& kind, const mesh::TriangleMesh& rest,
                             const data::Coupling& coupling) {
  if (kind.shape.type != data::Shape::Type::platelet || kind.law == data::Kind::Law::rigid ||
      coupling.retraction == 0)
    return {};
  const mesh::Vec3 share = platelet_shares(kind, rest, coupling);
  MirrorSurface surface{{}, share[1], share[0]};
  const auto& x = rest.vertices;
  for (const auto& p : x) {
    const mesh::Vec3 image{p[0], -p[1], p[2]};
    const auto distance = [&](const mesh::Vec3& q) { return mesh::norm(mesh::subtract(q, image)); };
    const auto nearest = std::min_element(
        x.begin(), x.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    require(distance(*nearest) < 1e-6, "the mesh of a platelet has no mirror plane");
    surface.mirror.push_back(static_cast<int>(nearest - x.begin()));
  }
  return surface;
}

npfem::Material make_material(const data::Kind& kind, const LatticeUnits& units) {
  npfem::Material m;
  switch (kind.law) {
    case data::Kind::Law::neo_hookean:
      m.law = npfem::Law::neo_hookean;
      break;
    case data::Kind::Law::skalak:
      m.law = npfem::Law::skalak;
      break;
    default:
      m.law = npfem::Law::paper;
  }
  m.B = units.modulus(kind.B), m.C = units.modulus(kind.C), m.D = units.modulus(kind.D);
  m.Gs = units.modulus(kind.Gs), m.skalak_C = kind.skalak_C;
  switch (kind.bending.model) {
    case data::Bending::Model::paper:
      m.bending = npfem::Bending::paper;
      break;
    case data::Bending::Model::helfrich:
      m.bending = npfem::Bending::helfrich;
      break;
    case data::Bending::Model::none:
      m.bending = npfem::Bending::none;
      break;
  }
  m.bending_modulus = units.bending(kind.bending.modulus);
  m.reference_curvature = units.curvature(kind.bending.reference_curvature);
  m.volume_modulus = units.modulus(kind.volume_modulus);
  m.rayleigh_beta = units.time(kind.rayleigh_beta);
  // fg/(us um2) = 1e-18 kg / (1e-6 s 1e-12 m2) = 1 kg/(s m2)
  m.drag_per_area = units.drag_per_area(npfem::drag_per_area_of(kind.kappa_damping));
  return m;
}

contact::Law make_contact(const data::Scene& scene, const LatticeUnits& units) {
  contact::Law law;
  const bool by_kernel = scene.contact.model == data::Contact::Model::particle_in_kernel;
  law.range = units.length(by_kernel ? data::Contact{}.range : scene.contact.range);
  law.stiffness = scene.contact.model == data::Contact::Model::none
                      ? 0
                      : units.stiffness_density(scene.contact.stiffness / reference_vertex_area);
  return law;
}

contact::KernelLaw make_kernel_contact(const data::Scene& scene, const LatticeUnits& units) {
  using Kernel = data::Coupling::Kernel;
  const Kernel kernel = scene.coupling.kernel;
  return {kernel == Kernel::phi4   ? 2.0
          : kernel == Kernel::phi3 ? 1.5
                                   : 1.0,
          units.length(scene.contact.range), units.modulus(scene.contact.stiffness)};
}

std::vector<std::string> coupling_problems(const data::Scene& scene) {
  using Scheme = data::Coupling::Scheme;
  const data::Coupling& c = scene.coupling;
  std::vector<std::string> problems;
  if (c.scheme != Scheme::paper && scene.contact.model == data::Contact::Model::particle_in_kernel)
    problems.push_back(
        "contact.model particle_in_kernel belongs to coupling.scheme paper (it takes the place of that "
        "scheme's "
        "fluid forces) use pairwise");
  if (c.scheme == Scheme::conservative) return problems;
  const std::string name = c.scheme == Scheme::paper ? "paper" : "peskin";
  if (c.retraction != 0)
    problems.push_back("coupling.retraction with coupling.scheme " + name +
                       " (its markers are the vertices themselves) set retraction: 0");
  if (scene.place.fluid != Place::host || scene.place.coupling != Place::host ||
      scene.place.solid != Place::host)
    problems.push_back("place: device with coupling.scheme " + name +
                       " (the device's kernels know the conservative scheme only) use place: host");
  if (c.scheme == Scheme::paper) return problems;
  if (c.solid_every != 1)
    problems.push_back("coupling.solid_every is " + std::to_string(c.solid_every) +
                       " (coupling.scheme peskin moves membranes with the fluid, in every step) set it to 1");
  for (const auto& kind : scene.cells.kinds) {
    const std::string path = "cells.kinds." + kind.name;
    if (kind.law == data::Kind::Law::rigid) {
      problems.push_back(path +
                         ".law is rigid (coupling.scheme peskin moves every vertex with the fluid) use law: "
                         "paper with a high bending.modulus");
    } else if (kind.kappa_damping > 0 || kind.rayleigh_beta > 0) {
      problems.push_back(path +
                         " is damped (coupling.scheme peskin has membranes without mass or drag) set "
                         "kappa_damping and rayleigh_beta to 0");
    }
  }
  return problems;
}

contact::Domain make_domain(const data::Scene& scene, const Block& block) {
  contact::Domain domain;
  using Geometry = data::Domain::Geometry;
  domain.period = {static_cast<double>(block.nx), static_cast<double>(block.ny),
                   static_cast<double>(block.nz)};
  if (scene.domain.geometry == Geometry::slab) {
    domain.walls.geometry = contact::Walls::Geometry::slab;
    domain.walls.lower = 0, domain.walls.upper = block.ny;
    domain.period[1] = 0;
  } else if (scene.domain.geometry == Geometry::tube) {
    domain.walls.geometry = contact::Walls::Geometry::tube;
    domain.walls.x = block.nx / 2.0, domain.walls.y = block.ny / 2.0;
    domain.walls.radius = scene.domain.tube_diameter / scene.fluid.dx / 2;
    domain.period[0] = domain.period[1] = 0;
  }
  return domain;
}

}  // namespace hemowalk::resolved
