#pragma once
/// \file Triangle meshes from files: OFF, OBJ, STL (text and binary).

#include <string>

#include "resolved/mesh/mesh.hpp"

namespace hemowalk::mesh {

/// Reads \p path (format by extension: .off, .obj, .stl), multiplies by \p unit, merges the duplicate
/// vertices of STL files and makes the surface valid (make_valid). \throws InputError naming file, line and
/// what is wrong; IoError when it cannot be read.
TriangleMesh read_mesh(const std::string& path, double unit = 1);

}  // namespace hemowalk::mesh
