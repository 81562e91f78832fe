#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/check.hpp"
#include "resolved/mesh/mesh_file.hpp"
#include "resolved/mesh/shapes.hpp"

namespace hemowalk::mesh {
namespace {

class MeshFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() /
        ("hemowalk_mesh_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    const auto path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  std::string complaint(const std::string& name, const std::string& text) {
    try {
      read_mesh(write(name, text));
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }
  std::filesystem::path folder_;
  const TriangleMesh shape_ = ellipsoid({3, 1, 2}, 4);
};

std::string off_text(const TriangleMesh& m) {
  std::ostringstream out;
  out.precision(17);
  out << "OFF\n# a comment\n" << m.vertex_count() << " " << m.triangle_count() << " 0\n";
  for (const auto& v : m.vertices) out << v[0] << " " << v[1] << " " << v[2] << "\n";
  for (const auto& t : m.triangles) out << "3 " << t[0] << " " << t[1] << " " << t[2] << "\n";
  return out.str();
}
std::string obj_text(const TriangleMesh& m) {
  std::ostringstream out;
  out.precision(17);
  for (const auto& v : m.vertices) out << "v " << v[0] << " " << v[1] << " " << v[2] << "\n";
  out << "vn 0 0 1\n";
  for (const auto& t : m.triangles)  // first corner counted from the end, as OBJ allows
    out << "f " << t[0] - m.vertex_count() << "//1 " << t[1] + 1 << "//1 " << t[2] + 1 << "//1\n";
  return out.str();
}
std::string stl_text(const TriangleMesh& m) {
  std::ostringstream out;
  out << "solid cell\n";
  for (const auto& t : m.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (int v : t)
      out << "vertex " << m.vertices[v][0] << " " << m.vertices[v][1] << " " << m.vertices[v][2] << "\n";
    out << "endloop\nendfacet\n";
  }
  out << "endsolid cell\n";
  return out.str();
}
std::string stl_binary(const TriangleMesh& m) {
  std::string out = "solid, yet binary";
  out.resize(80, ' ');
  const auto put = [&out](const auto& x) {
    char bytes[sizeof x];
    std::memcpy(bytes, &x, sizeof x);
    out.append(bytes, sizeof x);
  };
  put(static_cast<std::uint32_t>(m.triangle_count()));
  for (const auto& t : m.triangles) {
    for (int i = 0; i < 3; ++i) put(0.0f);
    for (int v : t)
      for (double x : m.vertices[v]) put(static_cast<float>(x));
    put(std::uint16_t{0});
  }
  return out;
}

TEST_F(MeshFile, EveryFormatGivesTheSameSurface) {
  const double v = volume(shape_), a = area(shape_);
  // Text STL has six digits, binary STL single precision; OFF and OBJ are exact.
  for (auto [name, text, tolerance] : {std::tuple{"a.off", off_text(shape_), 1e-14},
                                       {"a.obj", obj_text(shape_), 1e-14},
                                       {"a.stl", stl_text(shape_), 1e-5},
                                       {"b.STL", stl_binary(shape_), 1e-6}}) {
    const auto mesh = read_mesh(write(name, text), 2);
    EXPECT_EQ(mesh.vertex_count(), shape_.vertex_count()) << name;
    EXPECT_EQ(mesh.triangle_count(), shape_.triangle_count()) << name;
    EXPECT_NEAR(volume(mesh), 8 * v, 8 * v * tolerance) << name;
    EXPECT_NEAR(area(mesh), 4 * a, 4 * a * tolerance) << name;
  }
}

TEST_F(MeshFile, ErrorsNameFileLineAndCause) {
  EXPECT_NE(complaint("a.off", "OFF\n4 4 0\n0 0 0\n1 0 x\n").find("a.off:4: not three numbers"),
            std::string::npos);
  EXPECT_NE(complaint("b.off", "PLY\n").find("does not begin with OFF"), std::string::npos);
  EXPECT_NE(complaint("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2 0\n").find("4 corners"),
            std::string::npos);
  EXPECT_NE(complaint("d.obj", "v 0 0 0\nf 1 q 3\n").find("'q' is no vertex number"), std::string::npos);
  auto open = shape_;
  open.triangles.pop_back();
  EXPECT_NE(complaint("e.stl", stl_text(open)).find("open at edge"), std::string::npos);
  EXPECT_NE(complaint("f.stl", stl_binary(shape_).substr(0, 500).replace(0, 5, "SOLID")).find("truncated"),
            std::string::npos);
  EXPECT_NE(complaint("g.txt", "").find("unknown format"), std::string::npos);
  EXPECT_THROW(read_mesh((folder_ / "none.off").string()), IoError);
}

}  // namespace
}  // namespace hemowalk::mesh
