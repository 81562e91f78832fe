#include "core/data/scene_checks.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/data/scene.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

using yaml::Problems;
using yaml::Value;

std::string in_micrometres(double metres) { return format_number(std::round(metres * 1e15) / 1e9) + " um"; }

void check_domain(const Value& v, Problems& problems) {
  const Value *size = v.find("domain.size"), *dx = v.find("fluid.dx");
  if (size && dx)
    for (std::size_t i = 0; i < size->items.size(); ++i) {
      const double n = size->items[i].number() / dx->number();
      if (std::abs(n - std::round(n)) <= 1e-9 * n && n > 0.5) continue;
      const double below = std::max(1.0, std::floor(n)) * dx->number(),
                   above = std::max(1.0, std::ceil(n)) * dx->number();
      problems.add(size->items[i].mark,
                   "domain.size." + std::to_string(i) + ": " + in_micrometres(size->items[i].number()) +
                       " is no whole multiple of fluid.dx = " + in_micrometres(dx->number()) +
                       " (walls and periods lie on the lattice) use " + in_micrometres(below) +
                       (above > below ? " or " + in_micrometres(above) : ""));
    }
  const Value* geometry = v.find("domain.geometry");
  if (!geometry || geometry->type != Value::Type::map) return;
  const Value* tube = geometry->find("tube.diameter");
  if (geometry->has("tube") == geometry->has("stl"))
    problems.add(
        geometry->mark,
        "domain.geometry: " +
            std::string(geometry->has("tube") ? "tube and stl together" : "neither tube nor stl") +
            " (one of them bounds the flow) write {tube: {diameter: 40 um}} or {stl: FILE, unit: um}");
  if (geometry->has("unit") && !geometry->has("stl"))
    problems.add(geometry->mark,
                 "domain.geometry.unit without stl (it belongs to the file's numbers) remove it");
  if (tube && size &&
      tube->number() > std::min(size->items[0].number(), size->items[1].number()) * (1 + 1e-9))
    problems.add(tube->mark, "domain.geometry.tube.diameter: " + in_micrometres(tube->number()) +
                                 " does not fit (the box is " + in_micrometres(size->items[0].number()) +
                                 " x " + in_micrometres(size->items[1].number()) +
                                 " across) enlarge domain.size or use a smaller tube");
}

void check_flow(const Value& v, Problems& problems) {
  const Value *type = v.find("flow.type"), *geometry = v.find("domain.geometry");
  if (!type) return;
  const std::string shape = !geometry                            ? ""
                            : geometry->type == Value::Type::map ? (geometry->has("tube") ? "tube" : "stl")
                                                                 : geometry->text();
  if (type->text() == "couette" && !shape.empty() && shape != "slab")
    problems.add(type->mark,
                 "flow.type: couette with geometry " + shape +
                     " (it needs two plane walls) use domain.geometry: slab or another flow.type");
  if (type->text() != "poiseuille") return;
  if (v.has("flow.mean_velocity") == v.has("flow.pressure_gradient"))
    problems.add(
        type->mark,
        std::string("flow: ") + (v.has("flow.mean_velocity") ? "both" : "neither") +
            " of mean_velocity and pressure_gradient (exactly one drives the flow) give one of them");
  if (shape == "periodic")
    problems.add(type->mark,
                 "flow.type: poiseuille without walls (it would accelerate for ever) use domain.geometry: "
                 "slab or a tube");
}

void check_placements(const Value& v, Problems& problems) {
  const Value *kinds = v.find("cells.kinds"), *placed = v.find("cells.explicit"),
              *size = v.find("domain.size");
  if (!placed) return;
  std::vector<std::string> names;
  if (kinds)
    for (const auto& [name, kind] : kinds->members) names.push_back(name);
  const Value* geometry = v.find("domain.geometry");
  const bool walls = geometry && geometry->type == Value::Type::text && geometry->word == "slab";
  for (std::size_t i = 0; i < placed->items.size(); ++i) {
    const std::string path = "cells.explicit." + std::to_string(i);
    if (const Value* kind = placed->items[i].find("kind");
        kind && kinds && !kinds->members.count(kind->text())) {
      const std::string near = yaml::nearest(kind->text(), names);
      std::string suggestion =
          near.empty() ? "describe it under cells.kinds" : "did you mean `" + near + "`?";
      problems.add(kind->mark, path + ".kind: unknown kind `" + kind->text().substr(0, 60) +
                                   "` (not under cells.kinds) " + suggestion);
    }
    if (const Value* axis = placed->items[i].find("axis")) {
      const auto a = axis->numbers();
      if (a[0] == 0 && a[1] == 0 && a[2] == 0)
        problems.add(axis->mark,
                     path + ".axis: the zero vector (it has no direction) write [0, 1, 0] for none");
    }
    if (const Value* y = placed->items[i].find("position.1"); y && walls && size)
      if (y->number() <= 0 || y->number() >= size->items[1].number())
        problems.add(y->mark, path + ".position.1: " + in_micrometres(y->number()) +
                                  " is outside the walls (y from 0 to " +
                                  in_micrometres(size->items[1].number()) + ") move the cell");
  }
}

void check_cells(const Value& v, Problems& problems) {
  const Value *cells = v.find("cells"), *hematocrit = v.find("cells.hematocrit"),
              *placed = v.find("cells.explicit");
  if (!cells) return;
  if (const Value* kinds = v.find("cells.kinds"))
    for (const auto& [name, kind] : kinds->members) {
      bool good = !name.empty() && std::isalpha(static_cast<unsigned char>(name[0]));
      for (const char c : name) good = good && (std::isalnum(static_cast<unsigned char>(c)) || c == '_');
      if (!good || name.size() > 40)
        problems.add(kind.mark, "cells.kinds: `" + name.substr(0, 60) +
                                    "` is no name (letters, digits and _) rename the kind");
    }
  const bool has_placed = placed && !placed->items.empty();
  if (hematocrit && has_placed)
    problems.add(placed->mark,
                 "cells.explicit and cells.hematocrit together (cells are placed one by one or packed, never "
                 "both) remove one of them");
  if (const Value* ratio = v.find("cells.platelets_per_rbc");
      ratio && ratio->number() > 0 && !hematocrit && ratio->given)
    problems.add(ratio->mark,
                 "cells.platelets_per_rbc without cells.hematocrit (there are no packed red cells to count) "
                 "remove it or give a hematocrit");
  check_placements(v, problems);
  const Value* loads = v.find("cells.loads");
  if (!loads || !placed) return;
  const std::size_t n = placed->items.size();
  for (std::size_t i = 0; i < loads->items.size(); ++i)
    if (const Value* cell = loads->items[i].find("cell");
        cell && !hematocrit && static_cast<std::size_t>(cell->integer()) >= n)
      problems.add(cell->mark,
                   "cells.loads." + std::to_string(i) + ".cell: " + std::to_string(cell->integer()) +
                       " (there " + (n == 1 ? "is 1 cell" : "are " + std::to_string(n) + " cells") +
                       ", counted from 0) " +
                       (n ? "use 0 to " + std::to_string(n - 1) : "place a cell under cells.explicit"));
}

void check_time(const Value& v, Problems& problems) {
  const Value *dx = v.find("fluid.dx"), *tau = v.find("fluid.tau"), *nu = v.find("fluid.kinematic_viscosity");
  if (!dx || !tau || !nu) return;
  const Value* acceleration = v.find("acceleration");
  const double s = acceleration ? acceleration->number() : 1;  // one step of an accelerated run covers s dt
  Fluid fluid;
  fluid.dx = dx->number();
  fluid.tau = tau->number();
  fluid.kinematic_viscosity = nu->number();
  for (const char* key : {"end", "sample", "profile"})
    if (const Value* t = v.find(std::string("time.") + key); t && t->number() < s * fluid.time_step())
      problems.add(t->mark,
                   std::string("time.") + key + ": " + format_number(t->number()) +
                       " s is below the time step of " + format_number(s * fluid.time_step()) +
                       " s (from fluid.dx, tau, kinematic_viscosity and acceleration) use a longer time");
}

/// Keys of the coupling that the scheme does not read, given another value than the usual one.
void check_coupling(const Value& v, Problems& problems) {
  const Value *scheme = v.find("coupling.scheme"), *kernel = v.find("coupling.kernel");
  if (!scheme || !kernel) return;
  const Coupling usual = Coupling::with(kernel->choice<Coupling::Kernel>());
  const auto idle = [&](const std::string& key, const std::vector<std::string>& readers,
                        const auto& is_usual) {
    if (std::find(readers.begin(), readers.end(), scheme->text()) != readers.end()) return;
    const Value* value = v.find("coupling." + key);
    if (!value || !value->given || is_usual(*value)) return;
    std::string words;
    for (const std::string& word : readers) words += (words.empty() ? "" : " or ") + word;
    problems.warn(value->mark, "`coupling." + key + "` has no effect (it belongs to scheme: " + words +
                                   ", not " + scheme->text() + ") remove it");
  };
  idle("cycles", {"paper"}, [&](const Value& x) { return x.integer() == usual.cycles; });
  idle("velocity_cap", {"paper"}, [](const Value& x) { return x.type == Value::Type::text; });  // off
  idle("median_filter", {"paper"}, [&](const Value& x) { return x.boolean() == usual.median_filter; });
  idle("iterations", {"conservative", "paper"},
       [&](const Value& x) { return x.integer() == usual.iterations; });
  idle("integrator", {"conservative"}, [](const Value& x) { return x.index == 0; });
  idle("theta", {"conservative"}, [&](const Value& x) {
    return x.numbers() == std::vector<double>{usual.theta_n, usual.theta_t};
  });
  idle("chi", {"conservative"}, [&](const Value& x) { return std::abs(x.number() / usual.chi - 1) < 1e-9; });
}

void check_place(const Value& v, Problems& problems) {
  const Value *distribution = v.find("place.distribution"), *solid = v.find("place.solid"),
              *fluid = v.find("place.fluid"), *coupling = v.find("place.coupling");
  if (!distribution || distribution->text() != "even" || !solid || !fluid || !coupling) return;
  if (solid->text() == "device" && fluid->text() == "host" && coupling->text() == "host") return;
  problems.add(
      distribution->mark,
      "place.distribution: even without the solid alone on devices (elsewhere cells are solved where "
      "their fluid is) "
      "use place: {fluid: host, coupling: host, solid: device}, or remove it");
}

}  // namespace

void check_scene(const Value& scene, Problems& problems) {
  check_domain(scene, problems);
  check_flow(scene, problems);
  check_cells(scene, problems);
  check_time(scene, problems);
  check_coupling(scene, problems);
  check_place(scene, problems);
}

}  // namespace hemowalk::data
