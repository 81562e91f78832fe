// Surfaces on disk: readable after every frame, kept and cut on restart.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/check.hpp"
#include "core/hdf5.hpp"
#include "resolved/surface_output.hpp"

using namespace hemowalk;
using resolved::SurfaceOutput;
namespace fs = std::filesystem;

namespace {

class SurfaceFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = (fs::temp_directory_path() / ("hemowalk_surface_" + std::to_string(::getpid()))).string();
    fs::remove_all(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  std::string index() const {
    std::ifstream in(folder + "/cells.xdmf");
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  static std::size_t count(const std::string& text, const std::string& what) {
    std::size_t n = 0;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++n;
    return n;
  }
  /// Every file:/path the index names exists and has as many elements as it says.
  void expect_complete(const std::string& text) const {
    for (std::size_t at = 0; (at = text.find("<DataItem", at)) != std::string::npos; ++at) {
      const std::size_t d = text.find("Dimensions=\"", at) + 12, open = text.find('>', at) + 1;
      std::istringstream dimensions(text.substr(d, text.find('"', d) - d));
      const std::string where = text.substr(open, text.find('<', open) - open);
      const std::size_t colon = where.find(':');
      hdf5::Shape shape;
      for (std::size_t n; dimensions >> n;) shape.push_back(n);
      ASSERT_NE(where[0], '/') << "paths are relative to the index";
      EXPECT_EQ(hdf5::File::open(folder + "/" + where.substr(0, colon)).shape(where.substr(colon + 1)),
                shape);
    }
  }
  std::string folder;
  const std::vector<resolved::SurfaceKind> kinds{
      {"rbc", {{{0, 2, 1}}, {{0, 1, 3}}, {{1, 2, 3}}, {{2, 0, 3}}}, 4, 2},
      {"platelet", {{{0, 2, 1}}, {{0, 1, 3}}, {{1, 2, 3}}, {{2, 0, 3}}}, 4, 1}};
  std::vector<double> position(double offset) const {
    std::vector<double> x(36);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1e-6 * static_cast<double>(i) + offset;
    return x;
  }
};

TEST_F(SurfaceFiles, AreCompleteAfterEveryFrame) {
  SurfaceOutput out(folder, kinds);
  EXPECT_EQ(out.position_size(), 36u);
  expect_complete(index());
  for (int frame = 0; frame < 3; ++frame) {
    out.append(0.05 * frame, position(frame));
    EXPECT_EQ(count(index(), "<Time"), static_cast<std::size_t>(frame + 1));
    expect_complete(index());
  }
  const auto file = hdf5::File::open(folder + "/surfaces/000002.h5");
  EXPECT_EQ(file.units("/cells/position"), "m");
  EXPECT_EQ(file.read("/cells/position"), position(2));
  EXPECT_EQ(file.read("/cells/time").at(0), 0.1);
  const auto mesh = hdf5::File::open(folder + "/surfaces/mesh.h5");
  const auto triangles = mesh.read_integers("/cells/triangles");
  EXPECT_EQ(triangles[12], 4);  // the second cell's first vertex
  EXPECT_EQ(mesh.read_integers("/cells/kind"),
            (std::vector<std::int64_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1}));
  EXPECT_EQ(mesh.read_integers("/cells/cell"),
            (std::vector<std::int64_t>{0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2}));
  EXPECT_THROW(out.append(1, std::vector<double>(33)), InputError);
}

TEST_F(SurfaceFiles, RestartKeepsWhatCameBeforeTheCheckpoint) {
  {
    SurfaceOutput out(folder, kinds);
    for (int frame = 0; frame < 5; ++frame) out.append(0.05 * frame, position(frame));
  }
  std::ofstream(folder + "/surfaces/000004.h5") << "half a file";
  SurfaceOutput again(folder, kinds, 0.10);
  EXPECT_EQ(again.frames(), 3u);
  EXPECT_FALSE(fs::exists(folder + "/surfaces/000003.h5"));
  EXPECT_FALSE(fs::exists(folder + "/surfaces/000004.h5"));
  again.append(0.15, position(30));
  EXPECT_EQ(count(index(), "<Time"), 4u);
  expect_complete(index());
  SurfaceOutput fresh(folder, kinds);
  EXPECT_EQ(fresh.frames(), 0u);
  EXPECT_FALSE(fs::exists(folder + "/surfaces/000000.h5"));
}

}  // namespace
