#include "resolved/mesh/mesh_file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "core/check.hpp"
#include "resolved/mesh/vector.hpp"

namespace hemowalk::mesh {
namespace {

[[noreturn]] void fail(const std::string& path, int line, const std::string& message) {
  throw InputError(path + ":" + std::to_string(line) + ": " + message);
}

/// Lines of a text file without comments and blank lines, with their numbers.
class Lines {
 public:
  Lines(const std::string& path, const std::string& text) : path_(path), in_(text) {}
  bool next(std::istringstream& fields) {
    std::string line;
    while (std::getline(in_, line)) {
      ++number_;
      line = line.substr(0, line.find('#'));
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      fields.clear();
      fields.str(line);
      return true;
    }
    return false;
  }
  void expect(std::istringstream& fields, const std::string& what) {
    if (!next(fields)) fail("file ends where " + what + " should stand (truncated) check the file");
  }
  [[noreturn]] void fail(const std::string& message) const { mesh::fail(path_, number_, message); }

 private:
  std::string path_;
  std::istringstream in_;
  int number_ = 0;
};

Vec3 read_point(std::istringstream& fields, const Lines& lines) {
  Vec3 v;
  if (!(fields >> v[0] >> v[1] >> v[2])) lines.fail("not three numbers (a vertex has x y z) check the file");
  return v;
}

TriangleMesh read_off(const std::string& path, const std::string& text) {
  Lines lines(path, text);
  std::istringstream fields;
  std::string word;
  lines.expect(fields, "OFF");
  if (!(fields >> word) || word != "OFF")
    lines.fail("does not begin with OFF (not an OFF file) check the format");
  int vertices = 0, faces = 0;
  if (!(fields >> vertices >> faces)) {  // the counts may stand on the first line or the next
    lines.expect(fields, "the counts");
    if (!(fields >> vertices >> faces))
      lines.fail("no counts of vertices and faces (OFF header) check the file");
  }
  if (vertices < 0 || faces < 0) lines.fail("negative count (OFF header) check the file");
  TriangleMesh mesh;
  for (int i = 0; i < vertices; ++i) {
    lines.expect(fields, "a vertex");
    mesh.vertices.push_back(read_point(fields, lines));
  }
  for (int i = 0; i < faces; ++i) {
    lines.expect(fields, "a face");
    int corners = 0;
    std::array<int, 3> t{};
    if (!(fields >> corners) || corners != 3)
      lines.fail("face with " + std::to_string(corners) +
                 " corners (only triangles are read) triangulate the mesh");
    if (!(fields >> t[0] >> t[1] >> t[2]))
      lines.fail("face without three vertex numbers (damaged) check the file");
    mesh.triangles.push_back(t);
  }
  return mesh;
}

TriangleMesh read_obj(const std::string& path, const std::string& text) {
  Lines lines(path, text);
  std::istringstream fields;
  TriangleMesh mesh;
  while (lines.next(fields)) {
    std::string key;
    fields >> key;
    if (key == "v") {
      mesh.vertices.push_back(read_point(fields, lines));
    } else if (key == "f") {
      std::vector<int> corners;
      for (std::string corner; fields >> corner;) {
        std::istringstream number(corner.substr(0, corner.find('/')));
        int i = 0;
        if (!(number >> i) || i == 0)
          lines.fail("face corner '" + corner + "' is no vertex number (OBJ counts from 1) check the file");
        corners.push_back(i > 0 ? i - 1 : mesh.vertex_count() + i);
      }
      if (corners.size() != 3)
        lines.fail("face with " + std::to_string(corners.size()) +
                   " corners (only triangles are read) triangulate the mesh");
      mesh.triangles.push_back({corners[0], corners[1], corners[2]});
    }
  }
  return mesh;
}

/// Joins points nearer than \p tolerance; STL repeats every vertex once per triangle.
class VertexMerger {
 public:
  VertexMerger(TriangleMesh& mesh, double tolerance) : mesh_(mesh), tolerance_(tolerance) {}
  int merge(const Vec3& v) {
    const auto box = box_of(v);
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const auto found = boxes_.find({box[0] + i, box[1] + j, box[2] + k});
          if (found != boxes_.end() && norm(subtract(mesh_.vertices[found->second], v)) <= tolerance_)
            return found->second;
        }
    mesh_.vertices.push_back(v);
    return boxes_[box] = mesh_.vertex_count() - 1;
  }

 private:
  std::array<std::int64_t, 3> box_of(const Vec3& v) const {
    std::array<std::int64_t, 3> box;
    for (int d = 0; d < 3; ++d) box[d] = static_cast<std::int64_t>(std::floor(v[d] / tolerance_));
    return box;
  }
  TriangleMesh& mesh_;
  double tolerance_;
  std::map<std::array<std::int64_t, 3>, int> boxes_;
};

TriangleMesh merge(const std::vector<Vec3>& corners) {
  double size = 0;
  for (const auto& v : corners) size = std::max(size, norm(subtract(v, corners.front())));
  TriangleMesh mesh;
  VertexMerger merger(mesh, std::max(1e-6 * size, 1e-300));
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    mesh.triangles.push_back(
        {merger.merge(corners[i]), merger.merge(corners[i + 1]), merger.merge(corners[i + 2])});
  return mesh;
}

TriangleMesh read_stl_text(const std::string& path, const std::string& text) {
  Lines lines(path, text);
  std::istringstream fields;
  std::vector<Vec3> corners;
  std::string key;
  lines.expect(fields, "solid");
  if (!(fields >> key) || key != "solid")
    lines.fail("does not begin with solid (neither text nor binary STL) check the format");
  while (lines.next(fields)) {
    fields >> key;
    if (key == "vertex") corners.push_back(read_point(fields, lines));
    if (key == "endloop" && corners.size() % 3 != 0)
      lines.fail("loop without three vertices (damaged) check the file");
    if (key == "endsolid") return merge(corners);
  }
  lines.fail("no endsolid (truncated) check the file");
}

/// 80 bytes of header, a count, then per triangle 12 floats (normal, three corners) and two bytes.
TriangleMesh read_stl_binary(const std::string& text, std::uint32_t count) {
  std::vector<Vec3> corners;
  for (std::uint32_t t = 0; t < count; ++t)
    for (int c = 0; c < 3; ++c) {
      float v[3];
      std::memcpy(v, text.data() + 84 + 50 * static_cast<std::size_t>(t) + 12 * (c + 1), sizeof v);
      corners.push_back({v[0], v[1], v[2]});
    }
  return merge(corners);
}

TriangleMesh read_stl(const std::string& path, const std::string& text) {
  std::uint32_t count = 0;
  if (text.size() >= 84) std::memcpy(&count, text.data() + 80, sizeof count);
  // Binary files may begin with "solid" too: the size decides.
  if (text.size() >= 84 && text.size() == 84 + 50 * static_cast<std::size_t>(count))
    return read_stl_binary(text, count);
  if (text.rfind("solid", 0) != 0 && text.size() >= 84)
    fail(path, 0,
         "binary STL of " + std::to_string(text.size()) + " bytes (its count says " + std::to_string(count) +
             " triangles) the file is truncated or damaged");
  return read_stl_text(path, text);
}

std::string lower_extension(const std::string& path) {
  const auto dot = path.rfind('.');
  std::string extension = dot == std::string::npos ? "" : path.substr(dot);
  for (auto& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, double unit) {
  require(unit > 0, "unit of mesh " + path + " must be positive (length of one file unit) give unit: 1 um");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError("cannot open mesh " + path + " (missing or not readable) check the path");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto extension = lower_extension(path);
  TriangleMesh mesh;
  if (extension == ".off")
    mesh = read_off(path, text);
  else if (extension == ".obj")
    mesh = read_obj(path, text);
  else if (extension == ".stl")
    mesh = read_stl(path, text);
  else
    throw InputError("mesh " + path + " has an unknown format (.off, .obj and .stl are read) convert it");
  try {
    make_valid(mesh);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
  for (auto& v : mesh.vertices) v = scale(unit, v);
  return mesh;
}

}  // namespace hemowalk::mesh
