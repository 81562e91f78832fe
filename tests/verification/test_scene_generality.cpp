// Scenes as a user writes them, from the text to trajectories.h5: cells from mesh files of every type, free
// ellipsoids and spheres, every law, boxes from files, flow by a pressure gradient, loads.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "core/data/trajectories.hpp"
#include "resolved/mesh/shapes.hpp"
#include "resolved/resolve.hpp"

namespace hemowalk::resolved {
namespace {

using mesh::Vec3;

// Half axes, um, of all cells but the sphere, and their mesh.
constexpr Vec3 ellipsoid{3, 1.5, 2};
constexpr int subdivision = 6;

struct Case {
  std::string name, shape, law;
  std::string domain, flow;
  std::string loads = "[]";
  Vec3 push{};          ///< signs of the way the centre must go; 0: not asked
  bool soft = true;     ///< law is not rigid
  bool sphere = false;  ///< of 2 um
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const std::string slab = "{size: [14 um, 14 um, 14 um]}",
                  periodic = "{size: [14 um, 14 um, 14 um], geometry: periodic}",
                  vessel = "{size: [16 um, 16 um, 12 um], geometry: {stl: vessel.stl, unit: um}}";
const std::string couette = "{type: couette, shear_rate: 100 1/s, walls: both}", rest = "{type: rest}",
                  gradient = "{type: poiseuille, pressure_gradient: 1e5 Pa/m}";
const std::string pulled = "[{cell: 0, end: +x, fraction: 0.1, force: [20 pN, 0 pN, 0 pN]}]";

const Case cases[] = {
    {"SphereOfThePaper",
     "sphere, radius: 2 um",
     "paper, kappa_damping: 0.5",
     slab,
     couette,
     "[]",
     {},
     true,
     true},
    {"EllipsoidSkalakInAVessel",
     "ellipsoid, radii: [3 um, 1.5 um, 2 um]",
     "skalak, Gs: 4 pN/um, C: 10",
     vessel,
     gradient,
     "[]",
     {0, 0, 1}},
    {"OffNeoHookeanPulled",
     "mesh, file: cell.off",
     "neo_hookean, Gs: 5 pN/um",
     periodic,
     rest,
     pulled,
     {1, 0, 0}},
    {"ObjRigidByAGradient", "mesh, file: cell.obj", "rigid", slab, gradient, "[]", {0, 0, 1}, false},
    {"StlSkalakInShearPulled",
     "mesh, file: cell.stl",
     "skalak, Gs: 5 pN/um, C: 1, bending: {model: helfrich, reference_curvature: 0.2 1/um}",
     slab,
     couette,
     pulled,
     {1, 0, 0}},
    {"EllipsoidRigidPulledInAVessel",
     "ellipsoid, radii: [3 um, 1.5 um, 2 um]",
     "rigid",
     vessel,
     gradient,
     pulled,
     {1, 0, 1},
     false},
};

void write_off(const mesh::TriangleMesh& m, const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(17);
  out << "OFF\n" << m.vertex_count() << " " << m.triangle_count() << " 0\n";
  for (const auto& v : m.vertices) out << v[0] << " " << v[1] << " " << v[2] << "\n";
  for (const auto& t : m.triangles) out << "3 " << t[0] << " " << t[1] << " " << t[2] << "\n";
}
void write_obj(const mesh::TriangleMesh& m, const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(17);
  for (const auto& v : m.vertices) out << "v " << v[0] << " " << v[1] << " " << v[2] << "\n";
  for (const auto& t : m.triangles) out << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
}
void write_stl(const mesh::TriangleMesh& m, const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(17);
  out << "solid s\n";
  for (const auto& t : m.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int v : t) {
      const auto& x = m.vertices[v];
      out << "vertex " << x[0] << " " << x[1] << " " << x[2] << "\n";
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid s\n";
}
/// Cylinder of 7 um round (8, 8) um, from -1 to 13 um.
mesh::TriangleMesh cylinder() {
  mesh::TriangleMesh m;
  const int n = 48;
  for (const double z : {-1.0, 13.0})
    for (int i = 0; i < n; ++i)
      m.vertices.push_back({8 + 7 * std::cos(2 * M_PI * i / n), 8 + 7 * std::sin(2 * M_PI * i / n), z});
  m.vertices.push_back({8, 8, -1}), m.vertices.push_back({8, 8, 13});
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    m.triangles.push_back({i, j, n + j}), m.triangles.push_back({i, n + j, n + i});
    m.triangles.push_back({2 * n, j, i}), m.triangles.push_back({2 * n + 1, n + i, n + j});
  }
  return m;
}

/// Area of an ellipsoid, midpoint rule in the polar angles.
double area_of(const Vec3& a) {
  const int n = 400;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double t = (i + 0.5) * M_PI / n, p = (j + 0.5) * M_PI / n, s = std::sin(t);
      sum += s * std::hypot(a[1] * a[2] * s * std::cos(p), a[0] * a[2] * s * std::sin(p),
                            a[0] * a[1] * std::cos(t));
    }
  return sum * M_PI * M_PI / (n * n);
}

class SceneGenerality : public testing::TestWithParam<Case> {};

TEST_P(SceneGenerality, FromTheTextToTheTrajectories) {
  const Case& c = GetParam();
  const auto folder =
      std::filesystem::temp_directory_path() / ("hemowalk_generality_" + c.name + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const Vec3 axes = c.sphere ? Vec3{2, 2, 2} : ellipsoid;
  const mesh::TriangleMesh shape = mesh::ellipsoid(axes, subdivision),
                           finer = mesh::ellipsoid(axes, 2 * subdivision);
  write_off(shape, folder / "cell.off"), write_obj(shape, folder / "cell.obj"),
      write_stl(shape, folder / "cell.stl");
  write_stl(cylinder(), folder / "vessel.stl");
  const bool from_file = c.shape.starts_with("mesh");
  const std::string text =
      "format: hemowalk.scene/1\nacceleration: 50\nfluid: {precision: double}\ndomain: " + c.domain +
      "\nflow: " + c.flow + "\ncells:\n  kinds: {cell: {shape: " + c.shape + ", law: " + c.law +
      (from_file ? "" : ", subdivision: " + std::to_string(subdivision)) +
      "}}\n  explicit: [{kind: cell, position: [7.1 um, 7.2 um, 6.4 um]}]\n  loads: " + c.loads +
      "\ntime: {end: 0.3 ms, sample: 0.05 ms, profile: 0.1 ms}\n";
  const data::Scene scene = data::parse_scene(text, (folder / "scene.yaml").string());
  EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
  for (const auto& problem : preflight(scene)) ADD_FAILURE() << problem;
  RunOptions options;
  options.out = (folder / "run").string();
  const RunSummary summary = resolve(scene, options);
  EXPECT_EQ(summary.steps, 48);
  const data::Trajectories run = data::read_trajectories(options.out + "/trajectories.h5");
  std::filesystem::remove_all(folder);
  ASSERT_EQ(run.time.size(), 7u);
  const data::Tracks& cell = run.kinds.at("cell");
  ASSERT_EQ(cell.cells(), 1u);
  const auto all = [&](const std::string& name) {
    const auto& values = cell.observables.at(name);
    EXPECT_EQ(values.size(), run.time.size()) << name;
    for (const double v : values) EXPECT_TRUE(std::isfinite(v)) << name;
    return values;
  };
  // The known shape: what a mesh of n lacks is 4/3 of what 2 n adds (second order), with a third to spare.
  const double volume = 4 * M_PI / 3 * axes[0] * axes[1] * axes[2] * 1e-18, area = area_of(axes) * 1e-12;
  const auto volumes = all("volume"), areas = all("area");
  EXPECT_NEAR(volumes[0], volume, 1.8e-18 * (mesh::volume(finer) - mesh::volume(shape)));
  EXPECT_NEAR(areas[0], area, 1.8e-12 * (mesh::area(finer) - mesh::area(shape)));
  EXPECT_NEAR(volumes[0] / (1e-18 * mesh::volume(shape)), 1, 1e-6);  // the mesh's own, as a file in single
  // Vertices lie on the axes: the extents are those of the shape, along x and z.
  const auto longest = all("axial_diameter"), across = all("transverse_diameter");
  if (!c.sphere) {
    EXPECT_NEAR(longest[0], 2e-6 * axes[0], 1e-9);
    EXPECT_NEAR(across[0], 2e-6 * axes[2], 1e-9);
  }
  // In the plane of the flow an ellipsoid of 2 by 1.5 um, its long axis along the flow. A strain of 0.06 at
  // most turns and stretches by no more, a pull of 20 pN on Gs of 4 pN/um by some 10 %.
  const auto deformation = all("taylor_deformation"), inclination = all("inclination"),
             treading = all("tank_treading_angle");
  for (std::size_t t = 0; t < run.time.size(); ++t) {
    EXPECT_NEAR(deformation[t], (axes[2] - axes[1]) / (axes[2] + axes[1]), t ? 0.06 : 0.01) << t;
    if (!c.sphere) {
      EXPECT_NEAR(inclination[t], 0, t ? 0.06 : 1e-6) << t;
    }
    EXPECT_NEAR(treading[t], 0, t ? 0.06 : 1e-6) << t;
    EXPECT_NEAR(volumes[t] / volumes[0], 1, c.soft ? 0.005 : 1e-9) << t;
    EXPECT_NEAR(areas[t] / areas[0], 1, c.soft ? 0.03 : 1e-9) << t;
    EXPECT_NEAR(longest[t] / longest[0], 1, c.soft ? 0.1 : 1e-9) << t;
    EXPECT_NEAR(across[t] / across[0], 1, c.soft ? 0.1 : 1e-9) << t;
    double square = 0;
    for (int d = 0; d < 3; ++d) square += std::pow(cell.orientation[3 * t + d], 2);
    EXPECT_NEAR(square, 1, 1e-6) << t;
  }
  const Vec3 start{7.1e-6, 7.2e-6, 6.4e-6};
  for (int d = 0; d < 3; ++d) {
    EXPECT_NEAR(cell.at(0, 0, d), start[d], 1e-9);
    const double way = cell.at(6, 0, d) - start[d];
    EXPECT_LT(std::abs(way), 1e-6);
    if (c.push[d] != 0) {
      EXPECT_GT(way, 1e-9) << "axis " << d;
    }
  }
  // Along the flow a free cell goes with the undisturbed velocity at its centre; Faxen's term, some
  // axes^2/10 of its curvature, takes 2 % of the parabola, the start from rest the rest. (A vessel from a
  // file starts at rest.)
  if (c.domain == slab) {
    const double velocity = c.flow == couette ? 100 * 0.2e-6 : 1e5 * 7.2e-6 * 6.8e-6 / (2 * 1.025e-3);
    EXPECT_NEAR((cell.at(6, 0, 2) - start[2]) / (velocity * run.time[6]), 1, 0.05);
  }
  // Round-off of 48 steps; the energy of a cell pulled at once closes to a few thousandths.
  for (const double r : run.diagnostics.momentum_residual) EXPECT_LT(std::abs(r), 1e-11);
  for (const double m : run.diagnostics.mass_error) EXPECT_LT(std::abs(m), 1e-12);
  for (std::size_t k = 1; k < run.diagnostics.energy_residual.size(); ++k)
    EXPECT_LT(std::abs(run.diagnostics.energy_residual[k]), 0.01) << k;
  for (const double v : run.profile.velocity) EXPECT_TRUE(std::isfinite(v));
}

INSTANTIATE_TEST_SUITE_P(Scenes, SceneGenerality, testing::ValuesIn(cases),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace hemowalk::resolved
