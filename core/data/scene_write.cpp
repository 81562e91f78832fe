#include <iterator>
#include <utility>

#include "core/data/formats.hpp"
#include "core/data/scene.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

using yaml::list;
using yaml::Node;
using yaml::scalar;

using Members = std::vector<std::pair<std::string, Node>>;

Node value(double x, const std::string& unit = "1") { return scalar(format_quantity(x, unit)); }
Node whole(std::int64_t n) { return scalar(std::to_string(n)); }
Node vector(const Vec3& v, const std::string& unit = "1") {
  return list({value(v[0], unit), value(v[1], unit), value(v[2], unit)});
}

/// The word that stands at an enumerator's position in the table of the format, found by its path.
template <class Enum>
Node word(const std::string& path, Enum e) {
  const yaml::Field* field = &scene_format();
  for (const std::string& part : yaml::split_path(path)) {
    if (field->type == yaml::Field::Type::dictionary) {
      field = &field->parts[0];
      continue;
    }
    for (const yaml::Key& k : field->keys)
      if (k.name == part) {
        field = &k.field;
        break;
      }
  }
  return scalar(field->words.at(static_cast<std::size_t>(e)));
}

void add(Members& members, const std::string& key, const std::optional<double>& x,
         const std::string& unit = "1") {
  if (x) members.emplace_back(key, value(*x, unit));
}

Node domain(const Domain& d) {
  Node geometry = scalar(d.geometry == Domain::Geometry::slab ? "slab" : "periodic");
  if (d.geometry == Domain::Geometry::tube)
    geometry = yaml::map({{"tube", yaml::map({{"diameter", value(d.tube_diameter, "m")}})}});
  if (d.geometry == Domain::Geometry::stl)
    geometry = yaml::map({{"stl", scalar(d.stl_file)}, {"unit", value(d.stl_unit, "m")}});
  return yaml::map({{"size", vector(d.size, "m")}, {"geometry", geometry}});
}

Node flow(const Flow& f) {
  Members m{{"type", word("flow.type", f.type)}};
  if (f.type == Flow::Type::couette) {
    m.emplace_back("shear_rate", value(f.shear_rate, "1/s"));
    m.emplace_back("walls", word("flow.walls", f.walls));
  } else if (f.type == Flow::Type::poiseuille) {
    add(m, "mean_velocity", f.mean_velocity, "m/s");
    add(m, "pressure_gradient", f.pressure_gradient, "Pa/m");
  }
  return yaml::map(std::move(m));
}

Node fluid(const Fluid& f) {
  Members m{{"density", value(f.density, "kg/m3")},
            {"kinematic_viscosity", value(f.kinematic_viscosity, "m2/s")},
            {"dx", value(f.dx, "m")},
            {"tau", value(f.tau)},
            {"collision", word("fluid.collision", f.collision)},
            {"forcing", word("fluid.forcing", f.forcing)},
            {"precision", word("fluid.precision", f.precision)}};
  if (f.collision == Fluid::Collision::trt) m.emplace_back("magic", value(f.magic));
  return yaml::map(std::move(m));
}

Node coupling(const Coupling& c) {
  Members m{{"scheme", word("coupling.scheme", c.scheme)},
            {"kernel", word("coupling.kernel", c.kernel)},
            {"cycles", whole(c.cycles)},
            {"solid_every", whole(c.solid_every)},
            {"retraction", value(c.retraction)},
            {"theta", list({value(c.theta_n), value(c.theta_t)})},
            {"chi", value(c.chi)},
            {"velocity_cap", c.velocity_cap ? value(*c.velocity_cap) : scalar("off")},
            {"median_filter", scalar(c.median_filter ? "true" : "false")},
            {"iterations", whole(c.iterations)}};
  if (c.scheme == Coupling::Scheme::conservative)
    m.emplace_back("integrator", word("coupling.integrator", c.integrator));
  if (c.scheme == Coupling::Scheme::peskin)
    m.emplace_back("force_cap", c.force_cap ? value(*c.force_cap, "N") : scalar("off"));
  return yaml::map(std::move(m));
}

Node contact(const Contact& c) {
  Members m{{"model", word("contact.model", c.model)}};
  if (c.model != Contact::Model::none) {
    m.emplace_back("range", value(c.range, "m"));
    m.emplace_back("stiffness", value(c.stiffness, "N/m"));
  }
  return yaml::map(std::move(m));
}

Node bending(const Bending& b) {
  Members m{{"model", word("cells.kinds.x.bending.model", b.model)}};
  if (b.model != Bending::Model::none) m.emplace_back("modulus", value(b.modulus, "N m"));
  if (b.model == Bending::Model::helfrich)
    m.emplace_back("reference_curvature", value(b.reference_curvature, "1/m"));
  return yaml::map(std::move(m));
}

Node kind(const Kind& k) {
  Members m{{"shape", word("cells.kinds.x.shape", k.shape.type)},
            {"density", value(k.density, "kg/m3")},
            {"law", word("cells.kinds.x.law", k.law)}};
  if (k.shape.type == Shape::Type::sphere) m.emplace_back("radius", value(k.shape.radii[0], "m"));
  if (k.shape.type == Shape::Type::ellipsoid) m.emplace_back("radii", vector(k.shape.radii, "m"));
  if (k.shape.type == Shape::Type::mesh) {
    m.emplace_back("file", scalar(k.shape.file));
    m.emplace_back("unit", value(k.shape.unit, "m"));
  } else {
    m.emplace_back("subdivision", whole(k.subdivision));
  }
  if (k.law == Kind::Law::paper)
    for (const auto& [name, x] : {std::pair{"B", k.B}, {"C", k.C}, {"D", k.D}})
      m.emplace_back(name, value(x, "N/m"));
  if (k.law == Kind::Law::neo_hookean || k.law == Kind::Law::skalak) m.emplace_back("Gs", value(k.Gs, "N/m"));
  if (k.law == Kind::Law::skalak) m.emplace_back("C", value(k.skalak_C));
  if (k.law != Kind::Law::rigid) {
    m.emplace_back("bending", bending(k.bending));
    m.emplace_back("volume_modulus", value(k.volume_modulus, "N/m"));
    m.emplace_back("kappa_damping", value(k.kappa_damping));
    m.emplace_back("rayleigh_beta", value(k.rayleigh_beta, "s"));
  }
  return yaml::map(std::move(m));
}

Node cells(const Cells& c) {
  Members kinds;
  for (const Kind& k : c.kinds) kinds.emplace_back(k.name, kind(k));
  std::vector<Node> placed, loads;
  for (const Placement& p : c.placements)
    placed.push_back(yaml::map({{"kind", scalar(p.kind)},
                                {"position", vector(p.position, "m")},
                                {"axis", vector(p.axis)},
                                {"angle", value(p.angle, "rad")}}));
  for (const Load& l : c.loads)
    loads.push_back(yaml::map({{"cell", whole(l.cell)},
                               {"end", scalar(l.end)},
                               {"fraction", value(l.fraction)},
                               {"force", vector(l.force, "N")}}));
  Members m{{"platelets_per_rbc", value(c.platelets_per_rbc)},
            {"kinds", yaml::map(std::move(kinds))},
            {"explicit", list(std::move(placed))},
            {"loads", list(std::move(loads))}};
  add(m, "hematocrit", c.hematocrit);
  return yaml::map(std::move(m));
}

Node time(const Time& t) {
  Members checkpoint{{"wall", value(t.checkpoint_wall, "s")}};
  add(checkpoint, "every", t.checkpoint_every, "s");
  return yaml::map({{"end", value(t.end, "s")},
                    {"sample", value(t.sample, "s")},
                    {"profile", value(t.profile, "s")},
                    {"surface", value(t.surface, "s")},
                    {"checkpoint", yaml::map(std::move(checkpoint))}});
}

Node places(const Places& p) {
  return yaml::map({{"fluid", word("place.fluid", p.fluid)},
                    {"coupling", word("place.coupling", p.coupling)},
                    {"solid", word("place.solid", p.solid)},
                    {"distribution", word("place.distribution", p.distribution)}});
}

}  // namespace

std::string write_scene(const Scene& s) {
  const Node root = yaml::map({{"format", scalar("hemowalk.scene/1")},
                               {"acceleration", value(s.acceleration)},
                               {"domain", domain(s.domain)},
                               {"flow", flow(s.flow)},
                               {"fluid", fluid(s.fluid)},
                               {"coupling", coupling(s.coupling)},
                               {"contact", contact(s.contact)},
                               {"cells", cells(s.cells)},
                               {"time", time(s.time)},
                               {"seed", whole(static_cast<std::int64_t>(s.seed))},
                               {"place", places(s.place)}});
  yaml::Problems problems;
  const auto checked = scene_from(root, ".", problems);
  problems.throw_if_any();
  return checked->source_text;
}

}  // namespace hemowalk::data
