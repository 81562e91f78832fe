#pragma once
/// \file SurfaceOutput: the cells' surfaces over time, for ParaView and the like, readable while the run goes
/// on.
///
/// <folder>/cells.xdmf            the index: a temporal collection, replaced as a whole after every frame
/// <folder>/surfaces/mesh.h5      /cells/triangles [T, 3], /cells/kind [T], /cells/cell [T] (T triangles of
/// all cells) <folder>/surfaces/000000.h5 .. /cells/position [N, 3] in m, /cells/time in s A frame is
/// complete before it gets its name, and the index names complete frames only: a killed run leaves a valid
/// record.

#include <array>
#include <string>
#include <vector>

namespace hemowalk::resolved {

/// All cells of one kind.
struct SurfaceKind {
  std::string name;
  std::vector<std::array<int, 3>> triangles;  ///< of one cell
  int vertices = 0;                           ///< of one cell
  int cells = 0;
};

class SurfaceOutput {
 public:
  /// Prepares \p folder and writes the mesh. Frames of an earlier run at times up to \p keep_until (s) are
  /// kept, later ones removed: pass the time of the checkpoint on restart, nothing for a fresh run. \throws
  /// IoError.
  SurfaceOutput(const std::string& folder, std::vector<SurfaceKind> kinds, double keep_until = -1);

  /// Adds a frame. \p position: x, y, z of every vertex, m; kinds in their order, cell after cell, vertex
  /// after vertex. \throws IoError.
  void append(double time, const std::vector<double>& position);

  std::size_t frames() const { return times_.size(); }
  /// Numbers that append() expects.
  std::size_t position_size() const { return 3 * vertices_; }

 private:
  std::string frame_name(std::size_t frame) const;
  void keep_frames(double keep_until);
  void write_mesh() const;
  void write_index() const;

  std::string folder_;
  std::vector<SurfaceKind> kinds_;
  std::size_t vertices_ = 0, triangles_ = 0;
  std::vector<double> times_;  ///< of the frames on disk, s
};

}  // namespace hemowalk::resolved
