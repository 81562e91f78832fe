#include "resolved/surface_output.hpp"

#include <fmt/core.h>

#include <filesystem>

#include "core/check.hpp"
#include "core/hdf5.hpp"
#include "core/io.hpp"

namespace hemowalk::resolved {

namespace fs = std::filesystem;

SurfaceOutput::SurfaceOutput(const std::string& folder, std::vector<SurfaceKind> kinds, double keep_until)
    : folder_(folder), kinds_(std::move(kinds)) {
  for (const SurfaceKind& kind : kinds_) {
    vertices_ += static_cast<std::size_t>(kind.vertices) * kind.cells;
    triangles_ += kind.triangles.size() * kind.cells;
  }
  std::error_code error;
  fs::create_directories(folder_ + "/surfaces", error);
  if (error)
    throw IoError("cannot make " + folder_ + "/surfaces: " + error.message() +
                  " (the surfaces go there) check the path");
  keep_frames(keep_until);
  write_mesh();
  write_index();
}

std::string SurfaceOutput::frame_name(std::size_t frame) const {
  return fmt::format("surfaces/{:06}.h5", frame);
}

/// Frames are numbered without gaps, so the record ends at the first that is missing, damaged or too late.
void SurfaceOutput::keep_frames(double keep_until) {
  bool keep = true;
  for (std::size_t frame = 0;; ++frame) {
    const std::string path = folder_ + "/" + frame_name(frame);
    if (!fs::exists(path)) return;
    if (keep) {
      try {
        const auto file = hdf5::File::open(path);
        const double time = file.read("/cells/time").at(0);
        keep = time <= keep_until * (1 + 1e-12) && file.shape("/cells/position") == hdf5::Shape{vertices_, 3};
        if (keep) times_.push_back(time);
      } catch (const Error&) {
        keep = false;
      }
    }
    if (!keep) fs::remove(path);
  }
}

void SurfaceOutput::write_mesh() const {
  std::vector<std::int64_t> triangles, kind_of, cell_of;
  triangles.reserve(3 * triangles_);
  std::int64_t first = 0, cell = 0;
  for (std::size_t k = 0; k < kinds_.size(); ++k)
    for (int c = 0; c < kinds_[k].cells; ++c, ++cell, first += kinds_[k].vertices)
      for (const auto& t : kinds_[k].triangles) {
        for (const int v : t) triangles.push_back(first + v);
        kind_of.push_back(static_cast<std::int64_t>(k));
        cell_of.push_back(cell);
      }
  AtomicFile target(folder_ + "/surfaces/mesh.h5");
  auto file = hdf5::File::create(target.temporary());
  file.write_attribute("format", std::string("hemowalk.surfaces/1"));
  for (std::size_t k = 0; k < kinds_.size(); ++k)
    file.write_attribute(fmt::format("kind_{}", k), kinds_[k].name);
  file.write("/cells/triangles", {triangles_, 3}, triangles, "1");
  file.write("/cells/kind", {triangles_}, kind_of, "1");
  file.write("/cells/cell", {triangles_}, cell_of, "1");
  file.close();
  target.commit();
}

void SurfaceOutput::append(double time, const std::vector<double>& position) {
  require(position.size() == position_size(), [&] {
    return fmt::format("surfaces: {} coordinates given for {} (cells were lost or added) restart the output",
                       position.size(), position_size());
  });
  AtomicFile target(folder_ + "/" + frame_name(times_.size()));
  auto file = hdf5::File::create(target.temporary());
  file.write("/cells/position", {vertices_, 3}, position, "m");
  file.write("/cells/time", {1}, std::vector<double>{time}, "s");
  file.close();
  target.commit();
  times_.push_back(time);
  write_index();
}

void SurfaceOutput::write_index() const {
  const auto item = [](const std::string& shape, const char* type, const std::string& where) {
    return fmt::format(
        "<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"8\" Format=\"HDF\">{}</DataItem>", shape,
        type, where);
  };
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
      "<Grid Name=\"cells\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  const std::string T = std::to_string(triangles_), N = std::to_string(vertices_);
  for (std::size_t frame = 0; frame < times_.size(); ++frame) {
    text +=
        fmt::format("<Grid Name=\"cells\" GridType=\"Uniform\">\n<Time Value=\"{:.17g}\"/>\n", times_[frame]);
    text += fmt::format("<Topology TopologyType=\"Triangle\" NumberOfElements=\"{}\">{}</Topology>\n", T,
                        item(T + " 3", "Int", "surfaces/mesh.h5:/cells/triangles"));
    text += fmt::format("<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
                        item(N + " 3", "Float", frame_name(frame) + ":/cells/position"));
    for (const std::string name : {"kind", "cell"})
      text += fmt::format("<Attribute Name=\"{}\" AttributeType=\"Scalar\" Center=\"Cell\">{}</Attribute>\n",
                          name, item(T, "Int", "surfaces/mesh.h5:/cells/" + name));
    text += "</Grid>\n";
  }
  write_file_atomic(folder_ + "/cells.xdmf", text + "</Grid>\n</Domain>\n</Xdmf>\n");
}

}  // namespace hemowalk::resolved
