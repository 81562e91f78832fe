#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "core/check.hpp"
#include "core/data/scene.hpp"
#include "core/io.hpp"
#include "core/yaml/document.hpp"

using namespace hemowalk;
using namespace hemowalk::data;
namespace fs = std::filesystem;

namespace {

const std::string blood = R"(format: hemowalk.scene/1
acceleration: 1                       # s
domain: {size: [50 um, 50 um, 50 um], geometry: slab}
flow: {type: couette, shear_rate: 100 1/s, walls: top}
fluid: {density: 1025 kg/m3, kinematic_viscosity: 1 mm2/s, dx: 0.5 um, tau: 2, collision: trt, magic: 0.1875, forcing: guo, precision: single}
coupling: {scheme: conservative, kernel: phi4, cycles: 1, solid_every: 1, retraction: 0.7, theta: [0.97, 0.97], chi: 2.667, velocity_cap: off, median_filter: false}
contact: {model: pairwise, range: 0.5 um, stiffness: 20 pN/um}
cells:
  hematocrit: 0.35
  platelets_per_rbc: 0.2
  kinds:
    rbc: {shape: rbc, subdivision: 8, density: 1125 kg/m3, law: paper, B: 5 pN/um, C: 5000 pN/um, D: 35 pN/um,
          bending: {model: paper, modulus: 1 pN um}, volume_modulus: 250 pN/um, kappa_damping: 0.9, rayleigh_beta: 0 us}
    platelet: {shape: platelet, subdivision: 4, law: rigid}
  loads: [{cell: 0, end: +x, fraction: 0.02, force: [25 pN, 0 pN, 0 pN]}]
time: {end: 1 s, sample: 1 ms, profile: 10 ms, surface: 50 ms, checkpoint: {wall: 10 min}}
seed: 1
place: {fluid: host, coupling: host, solid: host}
)";

const std::string one_cell = R"(format: hemowalk.scene/1
domain: {size: [20 um, 20 um, 20 um]}
cells: {explicit: [{kind: rbc, position: [10 um, 10 um, 10 um], axis: [0, 1, 0], angle: 90 deg}]}
)";

std::string errors_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse_scene(text, "s.yaml", overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string hash(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s.yaml", overrides).input_sha256;
}

}  // namespace

TEST(SchemaScene, ValuesArriveInSi) {
  const Scene s = parse_scene(blood, "s.yaml");
  EXPECT_EQ(s.domain.size, (Vec3{5e-5, 5e-5, 5e-5}));
  EXPECT_EQ(s.flow.shear_rate, 100);
  EXPECT_EQ(s.fluid.dx, 5e-7);
  EXPECT_NEAR(s.fluid.time_step(), 0.125e-6, 1e-20);
  EXPECT_EQ(s.coupling.theta_t, 0.97);
  EXPECT_EQ(s.coupling.chi, 2.667);
  EXPECT_FALSE(s.coupling.velocity_cap);
  EXPECT_EQ(s.contact.stiffness, 20e-6);
  EXPECT_EQ(s.cells.hematocrit, 0.35);
  ASSERT_EQ(s.cells.kinds.size(), 2u);
  const Kind& rbc = *s.find_kind("rbc");
  EXPECT_EQ(rbc.B, 5e-6);
  EXPECT_EQ(rbc.C, 5e-3);
  EXPECT_EQ(rbc.D, 35e-6);
  EXPECT_EQ(rbc.bending.modulus, 1e-18);
  EXPECT_EQ(rbc.volume_modulus, 250e-6);
  EXPECT_EQ(rbc.kappa_damping, 0.9);
  EXPECT_EQ(s.find_kind("platelet")->law, Kind::Law::rigid);
  EXPECT_EQ(s.find_kind("platelet")->subdivision, 4);
  EXPECT_EQ(s.cells.loads.at(0).force[0], 25e-12);
  EXPECT_EQ(s.time.sample, 1e-3);
  EXPECT_EQ(s.time.checkpoint_wall, 600);
  EXPECT_TRUE(s.warnings.empty());
  EXPECT_NEAR(parse_scene(one_cell, "s.yaml").cells.placements.at(0).angle, std::acos(-1.0) / 2, 1e-13);
}

TEST(SchemaScene, TheTablesDefaultsAreTheStructsDefaults) {
  EXPECT_EQ(write_scene(Scene{}), parse_scene("format: hemowalk.scene/1\n", "s.yaml").source_text);
  Scene kinds;
  kinds.cells.hematocrit = 0.2;
  kinds.cells.kinds.push_back({});
  kinds.cells.kinds[0].name = "rbc";
  EXPECT_EQ(write_scene(kinds),
            parse_scene("format: hemowalk.scene/1\ncells: {hematocrit: 0.2}\n", "s.yaml").source_text);
}

TEST(SchemaScene, EqualPhysicsEqualHash) {
  const std::string other = R"(
# the same scene, written by somebody else
seed: 1
format: hemowalk.scene/1
cells:
    kinds:
      platelet: {law: rigid, shape: platelet}
      rbc: {shape: rbc}
    platelets_per_rbc: 0.20
    hematocrit: 35 %
    loads:
      - cell: 0
        end: +x
        force: [2.5e-5 uN, 0 N, 0 pN]
domain:
  size: [0.05 mm, 5e-5 m, 50000 nm]
fluid: {dx: 500 nm, tau: 2.0}
coupling: {kernel: phi4, chi: 2.667, retraction: 0.7}
time: {surface: 0.05 s}
)";
  EXPECT_EQ(parse_scene(other, "t.yaml").source_text, parse_scene(blood, "s.yaml").source_text);
  EXPECT_EQ(hash(other), hash(blood));
  // Checkpoints do not change results, nor does it matter which device solves a cell.
  EXPECT_EQ(hash(blood, {"time.checkpoint.wall=5 min", "time.checkpoint.every=10 ms"}), hash(blood));
  EXPECT_EQ(hash(blood, {"place.solid=device", "place.distribution=even"}),
            hash(blood, {"place.solid=device"}));
}

TEST(SchemaScene, EveryKeyOfPhysicsChangesTheHash) {
  const std::vector<std::string> changes{"acceleration=2",
                                         "domain.size.0=51 um",
                                         "domain.size.1=100 um",
                                         "flow.shear_rate=101 1/s",
                                         "flow.walls=both",
                                         "flow.type=rest",
                                         "fluid.density=1000 kg/m3",
                                         "fluid.kinematic_viscosity=2 mm2/s",
                                         "fluid.dx=0.25 um",
                                         "fluid.tau=1",
                                         "fluid.collision=bgk",
                                         "fluid.magic=0.25",
                                         "fluid.forcing=shan_chen",
                                         "fluid.precision=double",
                                         "coupling.scheme=paper",
                                         "coupling.kernel=phi3",
                                         "coupling.cycles=2",
                                         "coupling.solid_every=2",
                                         "coupling.retraction=0.5",
                                         "coupling.theta.1=0.5",
                                         "coupling.chi=1",
                                         "coupling.velocity_cap=0.1",
                                         "coupling.median_filter=true",
                                         "coupling.iterations=2",
                                         "contact.model=none",
                                         "contact.range=0.4 um",
                                         "contact.stiffness=10 pN/um",
                                         "cells.hematocrit=0.3500001",
                                         "cells.platelets_per_rbc=0.1",
                                         "cells.kinds.rbc.subdivision=6",
                                         "cells.kinds.rbc.density=1100 kg/m3",
                                         "cells.kinds.rbc.B=4 pN/um",
                                         "cells.kinds.rbc.bending.model=helfrich",
                                         "cells.kinds.rbc.bending.modulus=2 pN um",
                                         "cells.kinds.rbc.kappa_damping=0.8",
                                         "cells.kinds.rbc.rayleigh_beta=0.01 us",
                                         "cells.kinds.platelet.law=paper",
                                         "cells.loads.0.end=-x",
                                         "cells.loads.0.force.1=1 pN",
                                         "time.end=2 s",
                                         "time.sample=2 ms",
                                         "time.profile=5 ms",
                                         "time.surface=0 ms",
                                         "seed=2",
                                         "place.solid=device"};
  std::set<std::string> hashes{hash(blood)};
  for (const std::string& change : changes)
    EXPECT_TRUE(hashes.insert(hash(blood, {change})).second) << change;
}

TEST(SchemaScene, WritingAndReadingGivesTheSameScene) {
  const std::vector<std::vector<std::string>> variants{
      {},
      {"domain.geometry.tube.diameter=40 um", "flow={type: poiseuille, mean_velocity: 1 mm/s}"},
      {"flow={type: poiseuille, pressure_gradient: 1e5 Pa/m}", "fluid.collision=bgk", "fluid.magic=0.1875"},
      {"domain.geometry=periodic", "flow.type=rest", "contact.model=none"},
      {"cells.kinds.rbc={shape: {ellipsoid: {radii: [1 um, 2 um, 3 um]}}, law: {skalak: {Gs: 3 pN/um, C: "
       "50}}, bending: {model: helfrich, reference_curvature: -1 1/um}}"},
      {"cells.kinds.rbc={shape: sphere, radius: 3.91 um, law: neo_hookean, Gs: 4.2 pN/um}",
       "coupling.scheme=peskin", "coupling.force_cap=3 pN"},
      {"coupling.scheme=peskin", "coupling.force_cap=off", "coupling.retraction=0"},
      {"coupling.scheme=paper", "coupling.velocity_cap=0.07", "time.checkpoint.every=7 ms",
       "seed=9007199254740993"},
      {"place={solid: device, distribution: even}"}};
  for (const auto& overrides : variants) {
    const Scene s = parse_scene(blood, "s.yaml", overrides);
    EXPECT_EQ(write_scene(s), s.source_text);
    const Scene again = parse_scene(s.source_text, "again.yaml");
    EXPECT_EQ(again.source_text, s.source_text);
    EXPECT_EQ(again.input_sha256, s.input_sha256);
    EXPECT_EQ(write_scene(again), s.source_text);
  }
  const Scene s = parse_scene(one_cell, "s.yaml");
  EXPECT_EQ(write_scene(s), s.source_text);
}

TEST(SchemaScene, WordsMeanTheirEnumerators) {
  const auto with = [](const std::string& change) { return parse_scene(blood, "s.yaml", {change}); };
  EXPECT_EQ(with("fluid.collision=trt").fluid.collision, Fluid::Collision::trt);
  EXPECT_EQ(with("fluid.collision=bgk").fluid.collision, Fluid::Collision::bgk);
  EXPECT_EQ(with("fluid.forcing=shan_chen").fluid.forcing, Fluid::Forcing::shan_chen);
  EXPECT_EQ(with("fluid.precision=single").fluid.precision, Fluid::Precision::single_);
  EXPECT_EQ(with("fluid.precision=double").fluid.precision, Fluid::Precision::double_);
  EXPECT_EQ(with("coupling.scheme=paper").coupling.scheme, Coupling::Scheme::paper);
  EXPECT_EQ(with("coupling.scheme=peskin").coupling.scheme, Coupling::Scheme::peskin);
  EXPECT_EQ(with("coupling.kernel=phi2").coupling.kernel, Coupling::Kernel::phi2);
  EXPECT_EQ(with("coupling.kernel=phi3").coupling.kernel, Coupling::Kernel::phi3);
  EXPECT_EQ(with("contact.model=particle_in_kernel").contact.model, Contact::Model::particle_in_kernel);
  EXPECT_EQ(with("contact.model=none").contact.model, Contact::Model::none);
  EXPECT_EQ(with("flow.walls=both").flow.walls, Flow::Walls::both);
  EXPECT_EQ(with("flow.type=rest").flow.type, Flow::Type::rest);
  EXPECT_EQ(with("cells.kinds.rbc.bending.model=helfrich").find_kind("rbc")->bending.model,
            Bending::Model::helfrich);
  EXPECT_EQ(with("cells.kinds.rbc.bending.model=none").find_kind("rbc")->bending.model, Bending::Model::none);
  EXPECT_EQ(with("place.solid=device").place.solid, Place::device);
  EXPECT_EQ(with("place.fluid=host").place.fluid, Place::host);
  EXPECT_EQ(with("place={solid: device, distribution: even}").place.distribution, Places::Distribution::even);
  EXPECT_EQ(with("place.distribution=with_fluid").place.distribution, Places::Distribution::with_fluid);
  const auto rbc = [](const std::string& kind) {
    return *parse_scene(blood, "s.yaml", {"cells.kinds.rbc=" + kind}).find_kind("rbc");
  };
  EXPECT_EQ(rbc("{shape: rbc, law: paper}").law, Kind::Law::paper);
  EXPECT_EQ(rbc("{shape: rbc, law: neo_hookean}").law, Kind::Law::neo_hookean);
  EXPECT_EQ(rbc("{shape: rbc, law: skalak, C: 7}").law, Kind::Law::skalak);
  EXPECT_EQ(rbc("{shape: rbc, law: skalak, C: 7}").skalak_C, 7);
  EXPECT_EQ(rbc("{shape: rbc, law: rigid}").law, Kind::Law::rigid);
  EXPECT_EQ(rbc("{shape: platelet}").shape.type, Shape::Type::platelet);
  EXPECT_EQ(rbc("{shape: {sphere: {radius: 2 um}}}").shape.type, Shape::Type::sphere);
  EXPECT_EQ(rbc("{shape: sphere, radius: 2 um}").shape.radii, (Vec3{2e-6, 2e-6, 2e-6}));
  EXPECT_EQ(rbc("{shape: ellipsoid, radii: [1 um, 2 um, 3 um]}").shape.type, Shape::Type::ellipsoid);
}

TEST(SchemaScene, TheSchemeOfThePaperBringsItsDefaults) {
  const Scene s = parse_scene("format: hemowalk.scene/1\ncoupling: {scheme: paper}\n", "s.yaml");
  EXPECT_EQ(s.coupling.solid_every, 2);
  EXPECT_EQ(s.coupling.velocity_cap, 0.03);
  EXPECT_TRUE(s.coupling.median_filter);
  EXPECT_EQ(s.coupling.kernel, Coupling::Kernel::phi4);
  EXPECT_EQ(s.coupling.retraction, 0);
  EXPECT_EQ(s.coupling.iterations, 4);
}

TEST(SchemaScene, AKernelBringsItsRetractionAndChi) {
  const auto coupling = [](const std::string& keys) {
    return parse_scene("format: hemowalk.scene/1\ncoupling: {" + keys + "}\n", "s.yaml").coupling;
  };
  for (const auto& [word, kernel] : {std::pair{"phi2", Coupling::Kernel::phi2},
                                     {"phi3", Coupling::Kernel::phi3},
                                     {"phi4", Coupling::Kernel::phi4}}) {
    const Coupling c = coupling("kernel: " + std::string(word));
    EXPECT_EQ(c.kernel, kernel);
    EXPECT_EQ(c.retraction, Coupling::with(kernel).retraction) << word;
    EXPECT_EQ(c.chi, Coupling::with(kernel).chi) << word;
  }
  EXPECT_NE(coupling("kernel: phi3").retraction, coupling("kernel: phi4").retraction);
  EXPECT_EQ(coupling("cycles: 1").kernel, Coupling::Kernel::phi3);
  EXPECT_EQ(coupling("kernel: phi4, retraction: 0.4").retraction, 0.4);
}

TEST(SchemaScene, PeskinIsCappedOnRequestAndParticleInKernelReachesFarther) {
  const auto coupling = [](const std::string& keys) {
    return parse_scene("format: hemowalk.scene/1\ncoupling: {scheme: peskin" + keys + "}\n", "s.yaml")
        .coupling;
  };
  EXPECT_FALSE(coupling("").force_cap);
  EXPECT_EQ(coupling("").retraction, 0);
  EXPECT_DOUBLE_EQ(coupling(", force_cap: 3 pN").force_cap.value_or(0), 3e-12);
  EXPECT_TRUE(
      contains(errors_of(blood, {"coupling.scheme=peskin", "coupling.force_cap=0 pN"}), "out of range"));
  EXPECT_TRUE(contains(errors_of(blood, {"coupling.scheme=peskin", "coupling.force_cap=3 um"}), "um"));
  const Scene s = parse_scene("format: hemowalk.scene/1\ncontact: {model: particle_in_kernel}\n", "s.yaml");
  EXPECT_DOUBLE_EQ(s.contact.range, 1e-6);
  EXPECT_DOUBLE_EQ(s.contact.stiffness, 20e-6);
}

TEST(SchemaScene, ConditionsBetweenKeys) {
  EXPECT_TRUE(contains(errors_of(blood, {"domain.size.1=50.3 um"}),
                       "--set domain.size.1=50.3 um: domain.size.1: 50.3 um is no whole multiple of fluid.dx "
                       "= 0.5 um (walls and periods lie on the lattice) use 50 um or 50.5 um"));
  EXPECT_EQ(errors_of(blood, {"domain.size.1=50.00000000001 um"}), "");  // within 1e-9
  EXPECT_EQ(errors_of(blood, {"fluid.dx=0.1 um"}), "");                  // 500 nodes, not 499.99..
  EXPECT_TRUE(contains(errors_of(blood, {"domain.size.1=50.0000002 um"}), "whole multiple"));
  EXPECT_TRUE(
      contains(errors_of(blood, {"cells.explicit=[{kind: rbc, position: [1 um, 1 um, 1 um]}]"}), "together"));
  EXPECT_TRUE(contains(errors_of(blood, {"cells.loads.0.cell=1"}), "") &&
              errors_of(blood, {"cells.loads.0.cell=1"}).empty());  // packed: how many is not known yet
  EXPECT_TRUE(contains(errors_of(one_cell, {"cells.loads=[{cell: 1, end: +x, force: [1 pN, 0 pN, 0 pN]}]"}),
                       "(there is 1 cell, counted from 0) use 0 to 0"));
  EXPECT_TRUE(contains(errors_of(one_cell, {"cells.explicit.0.kind=rcb"}),
                       "unknown kind `rcb` (not under cells.kinds)"));
  EXPECT_TRUE(contains(errors_of(one_cell, {"cells.explicit.0.axis=[0, 0, 0]"}), "zero vector"));
  EXPECT_TRUE(contains(errors_of(one_cell, {"cells.explicit.0.position.1=21 um"}), "outside the walls"));
  EXPECT_TRUE(contains(errors_of(one_cell, {"cells.platelets_per_rbc=0.2"}), "without cells.hematocrit"));
  EXPECT_TRUE(contains(errors_of(blood, {"domain.geometry=periodic"}), "needs two plane walls"));
  EXPECT_TRUE(contains(errors_of(blood, {"flow={type: poiseuille}"}),
                       "neither of mean_velocity and pressure_gradient"));
  EXPECT_TRUE(contains(
      errors_of(blood, {"flow={type: poiseuille, mean_velocity: 1 mm/s, pressure_gradient: 1 Pa/m}"}),
      "both of"));
  EXPECT_TRUE(contains(
      errors_of(blood, {"flow={type: poiseuille, mean_velocity: 1 mm/s}", "domain.geometry=periodic"}),
      "without walls"));
  EXPECT_TRUE(contains(errors_of(blood, {"domain.geometry={tube: {diameter: 60 um}}", "flow.type=rest"}),
                       "does not fit"));
  EXPECT_TRUE(
      contains(errors_of(blood, {"domain.geometry={unit: um}", "flow.type=rest"}), "neither tube nor stl"));
  EXPECT_TRUE(contains(errors_of(blood, {"time.sample=0.1 us"}), "below the time step of 1.25e-07 s"));
  EXPECT_TRUE(
      contains(errors_of(blood, {"time.sample=1 us", "acceleration=16"}), "below the time step of 2e-06 s"));
}

TEST(SchemaScene, EvenDistributionWantsTheSolidAloneOnDevices) {
  const auto errors = [](const std::string& place) {
    return errors_of("format: hemowalk.scene/1\nplace: " + place + "\n", {});
  };
  const std::string why =
      ": place.distribution: even without the solid alone on devices (elsewhere cells are";
  EXPECT_TRUE(contains(errors("{distribution: even}"), ":2:23" + why)) << errors("{distribution: even}");
  EXPECT_TRUE(contains(errors("{fluid: device, coupling: device, solid: device, distribution: even}"),
                       ":2:71" + why));
  EXPECT_TRUE(contains(errors("{fluid: device, solid: device, distribution: even}"), why));
  EXPECT_TRUE(contains(errors("{coupling: device, solid: device, distribution: even}"), why));
  EXPECT_EQ(errors("{solid: device, distribution: even}"), "");
  EXPECT_EQ(errors("{distribution: with_fluid}"), "");
}

TEST(SchemaScene, Ranges) {
  for (const char* change :
       {"fluid.tau=0.5", "fluid.dx=0 um", "fluid.dx=-1 um", "cells.hematocrit=0.9", "cells.hematocrit=-0.1",
        "cells.kinds.rbc.kappa_damping=1", "cells.kinds.rbc.kappa_damping=-0.1",
        "cells.kinds.rbc.subdivision=1", "acceleration=0.5", "coupling.theta.0=1.1",
        "coupling.velocity_cap=0", "time.end=0 s", "seed=-1", "coupling.cycles=0", "fluid.density=0 kg/m3"})
    EXPECT_TRUE(contains(errors_of(blood, {change}), "out of range")) << change << "\n"
                                                                      << errors_of(blood, {change});
}

TEST(SchemaScene, ThreeMistakesThreeLinesExitCodeTwo) {
  const std::string text = "format: hemowalk.scene/1\nfluid: {tau: 0.4, dx: 0.5}\ndomain:\n  geomtry: slab\n";
  try {
    parse_scene(text, "dir/s.yaml");
    FAIL();
  } catch (const yaml::InvalidDocument& error) {
    ASSERT_EQ(error.problems.size(), 3u) << error.what();
    EXPECT_EQ(error.problems[0].rfind("dir/s.yaml:2:14: fluid.tau: ", 0), 0u) << error.problems[0];
    EXPECT_EQ(error.problems[1].rfind("dir/s.yaml:2:23: fluid.dx: ", 0), 0u) << error.problems[1];
    EXPECT_EQ(error.problems[2].rfind("dir/s.yaml:4:3: unknown key `domain.geomtry`", 0), 0u)
        << error.problems[2];
    EXPECT_EQ(error.code, Exit::usage);
  }
}

TEST(SchemaScene, KeysWithoutEffectAreWarnedAbout) {
  const Scene s = parse_scene(blood, "s.yaml", {"cells.kinds.platelet.kappa_damping=0.5", "flow.type=rest"});
  ASSERT_EQ(s.warnings.size(), 3u);
  EXPECT_TRUE(contains(
      s.warnings[0],
      "--set cells.kinds.platelet.kappa_damping=0.5: `cells.kinds.platelet.kappa_damping` has no effect"));
  EXPECT_TRUE(contains(s.warnings[1], "s.yaml:4:23: `flow.shear_rate` has no effect"));
  EXPECT_EQ(s.find_kind("platelet")->kappa_damping, 0);
}

TEST(SchemaScene, KeysThatTheSchemeDoesNotReadAreWarnedAbout) {
  const auto warnings = [](const std::string& keys) {
    return parse_scene("format: hemowalk.scene/1\ncoupling: {" + keys + "}\n", "s.yaml").warnings;
  };
  const auto expect_idle = [&](const std::string& scheme, const std::string& key, const std::string& value,
                               const std::string& readers) {
    const auto found = warnings("scheme: " + scheme + ", " + key + ": " + value);
    ASSERT_EQ(found.size(), 1u) << scheme << " " << key;
    EXPECT_TRUE(contains(found[0], "s.yaml:2:")) << found[0];
    EXPECT_TRUE(contains(found[0], ": `coupling." + key + "` has no effect (it belongs to scheme: " +
                                       readers + ", not " + scheme + ") remove it"))
        << found[0];
  };
  for (const char* scheme : {"conservative", "peskin"}) {
    expect_idle(scheme, "cycles", "2", "paper");
    expect_idle(scheme, "velocity_cap", "0.1", "paper");
    expect_idle(scheme, "median_filter", "true", "paper");
  }
  for (const char* scheme : {"paper", "peskin"}) {
    expect_idle(scheme, "theta", "[0.9, 0.97]", "conservative");
    expect_idle(scheme, "chi", "1.5", "conservative");
  }
  expect_idle("peskin", "iterations", "2", "conservative or paper");
  expect_idle("peskin", "integrator", "runge_kutta", "conservative");
  for (const char* scheme : {"conservative", "paper"}) expect_idle(scheme, "force_cap", "3 pN", "peskin");
  // Who reads them is not told, nor who gives what a scheme has anyway: all keys of a written scene are
  // given.
  EXPECT_TRUE(warnings("cycles: 1, velocity_cap: off, median_filter: false").empty());
  EXPECT_TRUE(warnings("theta: [0.9, 0.5], chi: 1, iterations: 3, integrator: runge_kutta").empty());
  EXPECT_TRUE(
      warnings("scheme: paper, cycles: 4, velocity_cap: 0.1, median_filter: false, iterations: 2").empty());
  EXPECT_TRUE(warnings("scheme: peskin, force_cap: 3 pN").empty());
  for (const char* scheme : {"conservative", "paper", "peskin"}) {
    const Scene s =
        parse_scene("format: hemowalk.scene/1\ncoupling: {scheme: " + std::string(scheme) + "}\n", "s.yaml");
    EXPECT_TRUE(parse_scene(s.source_text, "again.yaml").warnings.empty()) << scheme;
  }
}

TEST(SchemaScene, FilesAreFoundBesideTheSceneAndCountByContent) {
  const fs::path folder = fs::temp_directory_path() / ("hemowalk_scene_" + std::to_string(::getpid()));
  const std::string text =
      "format: hemowalk.scene/1\ncells: {kinds: {a: {shape: {mesh: {file: cell.off}}}}, explicit: [{kind: a, "
      "position: [1 um, 1 um, 1 um]}]}\n";
  write_file_atomic(folder / "a" / "s.yaml", text);
  EXPECT_TRUE(contains(
      [&] {
        try {
          read_scene(folder / "a" / "s.yaml");
        } catch (const InputError& e) {
          return std::string(e.what());
        }
        return std::string();
      }(),
      "does not exist"));
  write_file_atomic(folder / "a" / "cell.off", "OFF\n");
  write_file_atomic(folder / "b" / "cell.off", "OFF\n");
  write_file_atomic(folder / "b" / "s.yaml", text);
  const Scene a = read_scene(folder / "a" / "s.yaml"), b = read_scene(folder / "b" / "s.yaml");
  EXPECT_EQ(a.find_kind("a")->shape.file, (folder / "a" / "cell.off").string());
  EXPECT_EQ(a.find_kind("a")->shape.unit, 1e-6);
  EXPECT_EQ(a.input_sha256, b.input_sha256);
  write_file_atomic(folder / "b" / "cell.off", "OFF\n# changed\n");
  EXPECT_NE(a.input_sha256, read_scene(folder / "b" / "s.yaml").input_sha256);
  // The canonical text can be read from anywhere.
  EXPECT_EQ(parse_scene(a.source_text, "elsewhere/scene.yaml").input_sha256, a.input_sha256);
  fs::remove_all(folder);
}
