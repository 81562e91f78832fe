/// \file The table of scene.yaml. Words of choices stand in the order of the enumerators in scene.hpp.

#include "core/data/formats.hpp"
#include "core/units.hpp"

namespace hemowalk::data {
namespace {

using namespace yaml;

Field length() { return quantity("m", "um"); }
Field duration() { return quantity("s", "ms"); }
Field tension() { return quantity("N/m", "pN/um").at_least(0); }
Field vector_of(const Field& component) { return list_of(component, 3, 3); }

Field domain() {
  return map_of({
      with_default("size", vector_of(length().above(0)), "[50 um, 50 um, 50 um]",
                   "box along x, y (wall to wall), z; whole multiples of fluid.dx"),
      with_default(
          "geometry",
          any_of(
              {choice({"slab", "periodic"}),
               map_of({optional(
                           "tube",
                           map_of({required("diameter", length().above(0), "inner diameter; axis along z")}),
                           "round tube centred in x and y"),
                       optional("stl", text(), "file with the surface of the flow region"),
                       optional("unit", unit_name("m", "um"), "of the file's numbers; um if not given")})}),
          "slab", "slab: walls at y = 0 and y = H; a tube or a surface from a file lies in a periodic box"),
  });
}

Field flow() {
  return map_of({
      with_default("type", choice({"couette", "poiseuille", "rest"}), "couette",
                   "what drives the flow along z"),
      with_default("shear_rate", quantity("1/s", "1/s"), "100 1/s", "wall speed over gap")
          .when("type", {"couette"}),
      with_default("walls", choice({"top", "both"}), "top",
                   "which walls move: top at U, or both at -U/2 and U/2")
          .when("type", {"couette"}),
      optional("mean_velocity", quantity("m/s", "mm/s"), "mean velocity without cells (or pressure_gradient)")
          .when("type", {"poiseuille"}),
      optional("pressure_gradient", quantity("Pa/m", "Pa/mm"),
               "driving force per volume, positive along z (or mean_velocity)")
          .when("type", {"poiseuille"}),
  });
}

Field fluid() {
  return map_of({
      with_default("density", quantity("kg/m3", "kg/m3").above(0), "1025 kg/m3", "of the plasma"),
      with_default("kinematic_viscosity", quantity("m2/s", "mm2/s").above(0), "1 mm2/s", "of the plasma"),
      with_default("dx", length().above(0), "0.5 um", "lattice spacing"),
      with_default("tau", number().above(0.5).at_most(50), "2",
                   "relaxation time; the time step is (tau - 1/2)/3 dx^2/nu"),
      with_default("collision", choice({"trt", "bgk"}), "trt", "collision operator"),
      with_default("magic", number().above(0).at_most(10), "0.1875",
                   "Lambda of TRT; 3/16 puts walls exactly half-way")
          .when("collision", {"trt"}),
      with_default("forcing", choice({"guo", "shan_chen"}), "guo",
                   "how forces enter the lattice Boltzmann equation"),
      with_default("precision", choice({"single", "double"}), "single",
                   "of the populations (stored as deviations)"),
  });
}

/// Defaults of `scheme: paper` are those of the paper, where they differ.
Field coupling() {
  const std::vector<std::string> conservative{"conservative"}, paper{"paper"}, peskin{"peskin"},
      ours{"conservative", "peskin"}, others{"paper", "peskin"};
  const Field every = integer().at_least(1).at_most(1000), shift = number().at_least(0).at_most(2);
  const Coupling usual;  // numbers found by calibration stand in one place, the struct
  using Kernel = Coupling::Kernel;
  const Field kernel = choice({"phi2", "phi3", "phi4"});
  const auto retraction = [&](Kernel k, const std::string& word) {
    return with_default("retraction", shift, format_number(Coupling::with(k).retraction),
                        "distance of the coupling surface inside the membrane, in dx")
        .when("scheme", conservative)
        .when("kernel", {word});
  };
  const auto chi = [](Kernel k, const std::string& word) {
    return with_default("chi", number().above(0).at_most(100), format_number(Coupling::with(k).chi),
                        "coupling mass of scheme: conservative, in rho A dx")
        .when("kernel", {word});
  };
  const Field cap = any_of({choice({"off"}), number().above(0).at_most(0.5)});
  return map_of({
      with_default("scheme", choice({"conservative", "paper", "peskin"}), "conservative",
                   "how cells and plasma exchange momentum"),
      with_default("kernel", kernel, "phi3", "regularised delta function").when("scheme", conservative),
      with_default("kernel", kernel, "phi4", "regularised delta function").when("scheme", others),
      with_default("cycles", integer().at_least(1).at_most(100), "1",
                   "multi-direct-forcing cycles of scheme: paper"),
      with_default("solid_every", every, "1", "fluid steps per solid step").when("scheme", ours),
      with_default("solid_every", every, "2", "fluid steps per solid step").when("scheme", paper),
      retraction(Kernel::phi2, "phi2"),
      retraction(Kernel::phi3, "phi3"),
      retraction(Kernel::phi4, "phi4"),
      with_default("retraction", shift, "0", "distance of the coupling surface inside the membrane, in dx")
          .when("scheme", others),
      with_default("theta", list_of(number().at_least(0).at_most(1), 2, 2),
                   "[" + format_number(usual.theta_n) + ", " + format_number(usual.theta_t) + "]",
                   "slip correction of scheme: conservative, normal and tangential"),
      chi(Kernel::phi2, "phi2"),
      chi(Kernel::phi3, "phi3"),
      chi(Kernel::phi4, "phi4"),
      with_default("velocity_cap", cap, "off", "largest velocity handed to a vertex, lattice units")
          .when("scheme", ours),
      with_default("velocity_cap", cap, "0.03", "largest velocity handed to a vertex, lattice units")
          .when("scheme", paper),
      with_default("force_cap", any_of({choice({"off"}), quantity("N", "pN").above(0)}), "off",
                   "largest elastic force of a vertex on the fluid")
          .when("scheme", peskin),
      with_default("median_filter", boolean(), "false", "one-ring median of the forces on the solid")
          .when("scheme", ours),
      with_default("median_filter", boolean(), "true", "one-ring median of the forces on the solid")
          .when("scheme", paper),
      with_default("iterations", integer().at_least(1).at_most(1000), "1",
                   "solid iterations per coupling step")
          .when("scheme", ours),
      with_default("iterations", integer().at_least(1).at_most(1000), "4",
                   "solid iterations per coupling step")
          .when("scheme", paper),
      with_default("integrator", choice({"implicit", "runge_kutta"}), "implicit",
                   "of the membranes over a step; runge_kutta is explicit: accurate, for soft membranes only")
          .when("scheme", ours),
  });
}

Field contact() {
  return map_of({
      with_default("model", choice({"pairwise", "particle_in_kernel", "none"}), "pairwise",
                   "repulsion of close surfaces"),
      with_default("range", length().above(0), "0.5 um", "gap at which it starts")
          .when("model", {"pairwise"}),
      with_default("range", length().above(0), "1 um",
                   "how far outside the neighbour the point lies that is pulled to")
          .when("model", {"particle_in_kernel"}),
      with_default("stiffness", tension(), "20 pN/um", "per vertex (pairwise: at zero gap)")
          .when("model", {"pairwise", "particle_in_kernel"}),
  });
}

Field bending(const std::string& modulus) {
  return map_of({
      with_default("model", choice({"paper", "helfrich", "none"}), "paper",
                   "paper: by edge, blind to the sign of curvature"),
      with_default("modulus", quantity("N m", "pN um").at_least(0), modulus, "bending modulus")
          .when("model", {"paper", "helfrich"}),
      with_default("reference_curvature", quantity("1/m", "1/um"), "0 1/um", "spontaneous curvature")
          .when("model", {"helfrich"}),
  });
}

Field kind() {
  const std::vector<std::string> soft{"paper", "neo_hookean", "skalak"}, elastic{"neo_hookean", "skalak"};
  const std::vector<std::string> not_platelet{"rbc", "sphere", "ellipsoid", "mesh"};
  const Field law = choice({"paper", "neo_hookean", "skalak", "rigid"}),
              subdivision = integer().at_least(2).at_most(64);
  const Field kappa = number().at_least(0).below(1);
  return map_of({
      required("shape", choice({"rbc", "platelet", "sphere", "ellipsoid", "mesh"}),
               "resting shape; kinds called rbc and platelet have it by default"),
      required("radius", length().above(0), "of the sphere").when("shape", {"sphere"}),
      required("radii", vector_of(length().above(0)), "half axes along x, y, z").when("shape", {"ellipsoid"}),
      required("file", text(), "closed triangle mesh: OFF, OBJ or STL").when("shape", {"mesh"}),
      with_default("unit", unit_name("m", "um"), "um", "of the file's numbers").when("shape", {"mesh"}),
      with_default("subdivision", subdivision, "8", "n of the octahedron: 4 n^2 + 2 vertices")
          .when("shape", {"rbc", "sphere", "ellipsoid"}),
      with_default("subdivision", subdivision, "4", "n of the octahedron: 4 n^2 + 2 vertices")
          .when("shape", {"platelet"}),
      with_default("density", quantity("kg/m3", "kg/m3").above(0), "1125 kg/m3", "of the whole body"),
      with_default("law", law, "paper", "membrane law").when("shape", not_platelet),
      with_default("law", law, "rigid", "membrane law").when("shape", {"platelet"}),
      with_default("B", tension(), "5 pN/um", "strain hardening").when("law", {"paper"}),
      with_default("C", tension(), "5000 pN/um", "local area modulus").when("law", {"paper"}),
      with_default("D", tension(), "35 pN/um", "shear, fourth order").when("law", {"paper"}),
      with_default("Gs", tension(), "5 pN/um", "surface shear modulus").when("law", elastic),
      with_default("C", number().at_least(0), "1", "area ratio of Skalak's law").when("law", {"skalak"}),
      with_default("bending", bending("1 pN um"), "{}", "bending energy")
          .when("law", {"paper"})
          .when("shape", not_platelet),
      with_default("bending", bending("100 pN um"), "{}", "bending energy")
          .when("law", {"paper"})
          .when("shape", {"platelet"}),
      with_default("bending", bending("1 pN um"), "{model: none}", "bending energy").when("law", elastic),
      with_default("volume_modulus", tension(), "250 pN/um", "stiffness of the enclosed volume")
          .when("law", soft),
      with_default("kappa_damping", kappa, "0.9", "membrane damping at h = 0.25 us").when("law", {"paper"}),
      with_default("kappa_damping", kappa, "0", "membrane damping at h = 0.25 us").when("law", elastic),
      with_default("rayleigh_beta", quantity("s", "us").at_least(0), "0 us", "stiffness-proportional damping")
          .when("law", soft),
  });
}

Field cells() {
  return map_of({
      optional("hematocrit", number().at_least(0).below(0.9),
               "volume share of kind rbc (or explicit, never both)"),
      with_default("platelets_per_rbc", number().at_least(0).at_most(100), "0",
                   "cells of kind platelet per red cell"),
      with_default("kinds", dictionary(kind()), "{}",
                   "the kinds of cells by name; rbc and platelet exist by default"),
      with_default("explicit",
                   list_of(map_of({
                       required("kind", text(), "one of kinds"),
                       required("position", vector_of(length()), "centre"),
                       with_default("axis", vector_of(number()), "[0, 1, 0]", "rotation axis"),
                       with_default("angle", quantity("rad", "deg"), "0 deg", "rotation about the axis"),
                   })),
                   "[]", "cells one by one"),
      with_default(
          "loads",
          list_of(map_of({
              required("cell", integer().at_least(0), "number of the cell, counted from 0"),
              required("end", choice({"+x", "-x", "+y", "-y", "+z", "-z"}), "the end that is pulled"),
              with_default("fraction", number().above(0).at_most(0.5), "0.02",
                           "share of the vertices, those farthest out"),
              required("force", vector_of(quantity("N", "pN")), "on all of them together"),
          })),
          "[]", "external forces"),
  });
}

Field time() {
  return map_of({
      with_default("end", duration().above(0), "1 s", "simulated time"),
      with_default("sample", duration().above(0), "1 ms", "interval of trajectories and diagnostics"),
      with_default("profile", duration().above(0), "10 ms", "interval of profiles"),
      with_default("surface", duration().at_least(0), "0 ms",
                   "interval of cell surfaces for visualisation; 0 = never"),
      with_default(
          "checkpoint",
          map_of({with_default("wall", quantity("s", "min").at_least(0), "10 min", "of wall time; 0 = never"),
                  optional("every", duration().above(0), "of simulated time")}),
          "{}", "intervals of checkpoints")
          .not_physical(),
  });
}

Field places() {
  const Field place = choice({"host", "device"});
  return map_of(
      {with_default("fluid", place, "host", "where the plasma lives"),
       with_default("coupling", place, "host", "where markers live"),
       with_default("solid", place, "host", "where cells live"),
       with_default(
           "distribution", choice({"with_fluid", "even"}), "with_fluid",
           "with the solid alone on devices: a cell is solved by the rank of its fluid, or cells are "
           "dealt out to all ranks in equal numbers, for good")
           .not_physical()});
}

}  // namespace

const Field& scene_format() {
  static const Field format = map_of({
      format_key("hemowalk.scene/1"),
      with_default("acceleration", number().at_least(1).at_most(1000), "1",
                   "all rates times s at constant capillary number; all values stay physical"),
      with_default("domain", domain(), "{}", "the box"),
      with_default("flow", flow(), "{}", "the flow"),
      with_default("fluid", fluid(), "{}", "the plasma and its lattice"),
      with_default("coupling", coupling(), "{}", "cells and plasma"),
      with_default("contact", contact(), "{}", "cells among each other"),
      with_default("cells", cells(), "{}", "the cells"),
      with_default("time", time(), "{}", "how long, and what is kept"),
      with_default("seed", integer().at_least(0), "1", "of all random numbers"),
      with_default("place", places(), "{}",
                   "host or device, per part: all three on one place, or the solid alone on the device"),
  });
  return format;
}

}  // namespace hemowalk::data
