#pragma once
/// \file The coupling surface of a deformable platelet as a map of its vertices (coupling.hpp: drawn_in()).

#include <vector>

namespace hemowalk::resolved {

/// Which vertex mirrors which, and the shares of drawn_in(). Empty: the normals' retraction.
struct MirrorSurface {
  std::vector<int> mirror;
  double axial = 0, radial = 0;
};

}  // namespace hemowalk::resolved
