#include "core/data/scene.hpp"

#include <filesystem>
#include <utility>

#include "core/data/formats.hpp"
#include "core/data/scene_checks.hpp"
#include "core/io.hpp"
#include "core/provenance.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

using yaml::Node;
using yaml::Problems;
using yaml::Value;

/// Kinds called rbc and platelet need not be described; those that are used need not even be named.
void fill_in_kinds(Node& root) {
  Node* cells = root.is_map() ? root.find("cells") : nullptr;
  if (!cells || !cells->is_map()) return;
  if (!cells->find("kinds")) {
    Node kinds = yaml::map({});
    kinds.mark = cells->mark;
    cells->set("kinds", kinds);
  }
  const auto add_kind = [&](const std::string& name) {
    Node* kinds = cells->find("kinds");
    if ((name != "rbc" && name != "platelet") || !kinds->is_map()) return;
    if (!kinds->find(name)) {
      Node kind = yaml::map({});
      kind.mark = kinds->mark;
      kinds->set(name, kind);
    }
    Node* kind = kinds->find(name);
    if (!kind->is_map() || kind->find("shape")) return;
    Node shape = yaml::scalar(name);
    shape.mark = kind->mark;
    kind->set("shape", shape);
  };
  if (cells->find("hematocrit")) add_kind("rbc");
  if (const Node* ratio = cells->find("platelets_per_rbc");
      ratio && parse_number(ratio->text).value_or(0) > 0)
    add_kind("platelet");
  if (const Node* placed = cells->find("explicit"))
    for (const Node& one : placed->items)
      if (const Node* name = one.find("kind")) add_kind(name->text);
  std::vector<std::string> names;  // add_kind may move the map's members
  for (const yaml::Member& m : cells->find("kinds")->members) names.push_back(m.key);
  for (const std::string& name : names) add_kind(name);
}

/// Makes a file name absolute, so that the canonical text means the same everywhere, and checks the file.
void resolve_file(Value* file, const std::string& folder, Problems& problems) {
  if (!file || file->type != Value::Type::text) return;
  file->word = resolved_path(folder, file->word);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file->word, error))
    problems.add(file->mark,
                 "file `" + file->word +
                     "` does not exist (names are relative to the file that holds them) check the name");
}

template <class Visit>
void for_each_file(Value& root, Visit visit) {
  Value& geometry = root.members["domain"].members["geometry"];
  if (const auto stl = geometry.members.find("stl"); stl != geometry.members.end()) visit(&stl->second);
  for (auto& [name, kind] : root.members["cells"].members["kinds"].members)
    if (const auto file = kind.members.find("file"); file != kind.members.end()) visit(&file->second);
}

/// Hash of what decides the results: files count by content, checkpoint intervals not at all.
std::string physics_hash(Value root) {
  for_each_file(root, [](Value* file) { file->word = "sha256:" + sha256_of_file(file->word); });
  return sha256(yaml::physical_text(root));
}

Vec3 vec3(const Value& v) { return {v["0"].number(), v["1"].number(), v["2"].number()}; }

/// The number at \p path; nothing where there is none, or a word such as `off`.
std::optional<double> maybe(const Value& v, const std::string& path) {
  const Value* found = v.find(path);
  return found && found->type == Value::Type::number ? std::optional(found->number()) : std::nullopt;
}

Kind kind_of(const std::string& name, const Value& v) {
  Kind k;
  k.name = name;
  k.shape.type = v["shape"].choice<Shape::Type>();
  if (const Value* radius = v.find("radius"))
    k.shape.radii = {radius->number(), radius->number(), radius->number()};
  if (const Value* radii = v.find("radii")) k.shape.radii = vec3(*radii);
  if (const Value* file = v.find("file")) k.shape.file = file->text();
  if (const Value* unit = v.find("unit")) k.shape.unit = unit->number();
  if (const Value* n = v.find("subdivision")) k.subdivision = static_cast<int>(n->integer());
  k.density = v["density"].number();
  k.law = v["law"].choice<Kind::Law>();
  k.B = maybe(v, "B").value_or(k.B);
  k.D = maybe(v, "D").value_or(k.D);
  k.Gs = maybe(v, "Gs").value_or(k.Gs);
  (k.law == Kind::Law::skalak ? k.skalak_C : k.C) = maybe(v, "C").value_or(k.C);
  k.volume_modulus = maybe(v, "volume_modulus").value_or(0);
  k.kappa_damping = maybe(v, "kappa_damping").value_or(0);
  k.rayleigh_beta = maybe(v, "rayleigh_beta").value_or(0);
  k.bending = {Bending::Model::none, 0, 0};
  if (const Value* bending = v.find("bending"))
    k.bending = {(*bending)["model"].choice<Bending::Model>(), maybe(*bending, "modulus").value_or(0),
                 maybe(*bending, "reference_curvature").value_or(0)};
  return k;
}

Cells cells_of(const Value& v) {
  Cells c;
  c.hematocrit = maybe(v, "hematocrit");
  c.platelets_per_rbc = v["platelets_per_rbc"].number();
  for (const auto& [name, kind] : v["kinds"].members) c.kinds.push_back(kind_of(name, kind));
  for (const Value& p : v["explicit"].items)
    c.placements.push_back({p["kind"].text(), vec3(p["position"]), vec3(p["axis"]), p["angle"].number()});
  for (const Value& l : v["loads"].items)
    c.loads.push_back(
        {static_cast<int>(l["cell"].integer()), l["end"].text(), l["fraction"].number(), vec3(l["force"])});
  return c;
}

Domain domain_of(const Value& v) {
  Domain d;
  d.size = vec3(v["size"]);
  const Value& geometry = v["geometry"];
  if (geometry.type == Value::Type::text) {
    d.geometry = geometry.choice<Domain::Geometry>();
  } else if (const Value* tube = geometry.find("tube")) {
    d.geometry = Domain::Geometry::tube;
    d.tube_diameter = (*tube)["diameter"].number();
  } else {
    d.geometry = Domain::Geometry::stl;
    d.stl_file = geometry["stl"].text();
    d.stl_unit = maybe(geometry, "unit").value_or(1e-6);
  }
  return d;
}

Flow flow_of(const Value& v) {
  Flow f;
  f.type = v["type"].choice<Flow::Type>();
  f.shear_rate = maybe(v, "shear_rate").value_or(0);
  if (const Value* walls = v.find("walls")) f.walls = walls->choice<Flow::Walls>();
  f.mean_velocity = maybe(v, "mean_velocity");
  f.pressure_gradient = maybe(v, "pressure_gradient");
  return f;
}

Fluid fluid_of(const Value& v) {
  Fluid f;
  f.density = v["density"].number();
  f.kinematic_viscosity = v["kinematic_viscosity"].number();
  f.dx = v["dx"].number();
  f.tau = v["tau"].number();
  f.collision = v["collision"].choice<Fluid::Collision>();
  f.magic = maybe(v, "magic").value_or(f.magic);
  f.forcing = v["forcing"].choice<Fluid::Forcing>();
  f.precision = v["precision"].choice<Fluid::Precision>();
  return f;
}

Coupling coupling_of(const Value& v) {
  Coupling c;
  c.scheme = v["scheme"].choice<Coupling::Scheme>();
  c.kernel = v["kernel"].choice<Coupling::Kernel>();
  c.cycles = static_cast<int>(v["cycles"].integer());
  c.solid_every = static_cast<int>(v["solid_every"].integer());
  c.retraction = v["retraction"].number();
  c.theta_n = v["theta.0"].number();
  c.theta_t = v["theta.1"].number();
  c.chi = v["chi"].number();
  c.velocity_cap = maybe(v, "velocity_cap");
  c.force_cap = maybe(v, "force_cap");
  c.median_filter = v["median_filter"].boolean();
  c.iterations = static_cast<int>(v["iterations"].integer());
  if (v.has("integrator")) c.integrator = v["integrator"].choice<Coupling::Integrator>();
  return c;
}

Contact contact_of(const Value& v) {
  Contact c;
  c.model = v["model"].choice<Contact::Model>();
  c.range = maybe(v, "range").value_or(0);
  c.stiffness = maybe(v, "stiffness").value_or(0);
  return c;
}

Time time_of(const Value& v) {
  return {v["end"].number(),     v["sample"].number(),          v["profile"].number(),
          v["surface"].number(), v["checkpoint.wall"].number(), maybe(v, "checkpoint.every")};
}

Scene scene_of(const Value& v) {
  Scene s;
  s.acceleration = v["acceleration"].number();
  s.domain = domain_of(v["domain"]);
  s.flow = flow_of(v["flow"]);
  s.fluid = fluid_of(v["fluid"]);
  s.coupling = coupling_of(v["coupling"]);
  s.contact = contact_of(v["contact"]);
  s.cells = cells_of(v["cells"]);
  s.time = time_of(v["time"]);
  s.seed = static_cast<std::uint64_t>(v["seed"].integer());
  s.place = {v["place.fluid"].choice<Place>(), v["place.coupling"].choice<Place>(),
             v["place.solid"].choice<Place>(), v["place.distribution"].choice<Places::Distribution>()};
  return s;
}

}  // namespace

std::string folder_of(const std::string& file) {
  const auto folder = std::filesystem::path(file).parent_path();
  return folder.empty() ? "." : folder.string();
}

std::string resolved_path(const std::string& folder, const std::string& name) {
  return std::filesystem::absolute(std::filesystem::path(folder) / name).lexically_normal().string();
}

std::optional<Scene> scene_from(Node root, const std::string& folder, Problems& problems) {
  Problems own;
  fill_in_kinds(root);
  Value value = yaml::validate(root, scene_format(), own);
  check_scene(value, own);
  if (value.type == Value::Type::map)
    for_each_file(value, [&](Value* file) { resolve_file(file, folder, own); });
  problems.append(own);
  if (!own.empty()) return {};
  Scene scene = scene_of(value);
  scene.source_text = yaml::canonical_text(value);
  scene.input_sha256 = physics_hash(std::move(value));
  scene.warnings = own.warnings();
  return scene;
}

Scene parse_scene(const std::string& text, const std::string& name,
                  const std::vector<std::string>& overrides) {
  Problems problems;
  Node root = yaml::parse(text, name, problems);
  yaml::apply_overrides(root, scene_format(), overrides, problems);
  auto scene = scene_from(std::move(root), folder_of(name), problems);
  problems.throw_if_any();
  return *scene;
}

Scene read_scene(const std::string& path, const std::vector<std::string>& overrides) {
  return parse_scene(read_input_file(path), path, overrides);
}

}  // namespace hemowalk::data
