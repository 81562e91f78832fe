#pragma once
/// \file From the words of a scene to the solver's structures, in lattice units.

#include <string>
#include <vector>

#include "core/block.hpp"
#include "core/data/scene.hpp"
#include "resolved/contact/kernel_contact.hpp"
#include "resolved/ibm/markers.hpp"
#include "resolved/lbm/fluid.hpp"
#include "resolved/mesh/mesh.hpp"
#include "resolved/mirror_surface.hpp"
#include "resolved/npfem/material.hpp"
#include "resolved/units.hpp"

namespace hemowalk::resolved {

/// Membrane area per vertex of the paper's red cell, m2: where stiffness per vertex and per area meet.
inline constexpr double reference_vertex_area = 0.511e-12;

Block make_block(const data::Scene& scene);
ibm::Faces make_faces(const data::Scene& scene, const LatticeUnits& units);
ibm::Kernel make_kernel(data::Coupling::Kernel kernel);
lbm::Parameters make_fluid(const data::Scene& scene, const LatticeUnits& units);
/// Steady velocity along z at (x, y) (lattice units), without cells; 0 where it is not known (a surface from
/// a file).
double steady_velocity(const data::Scene& scene, const LatticeUnits& units, double x, double y);
/// Rest shape centred at the origin, in units of \p unit metres.
mesh::TriangleMesh make_mesh(const data::Kind& kind, double unit);
/// Where a cell at rest touches the fluid, in its own frame: every vertex drawn back along its normal by \p
/// retraction (lattice units). A platelet's rim is sharper than that, its normals would cross: it becomes a
/// smaller spheroid instead. \throws InputError when nothing would be left of it.
std::vector<mesh::Vec3> coupling_points(const data::Kind& kind, const mesh::TriangleMesh& rest,
                                        const data::Coupling& coupling);
/// The same surface for a deformable platelet, as a map of its vertices; empty for other cells, which are
/// drawn back along their normals, and without retraction.
MirrorSurface mirror_surface(const data::Kind& kind, const mesh::TriangleMesh& rest,
                             const data::Coupling& coupling);
npfem::Material make_material(const data::Kind& kind, const LatticeUnits& units);
/// The pairwise law; of contact.model: particle_in_kernel the one it is packed with.
contact::Law make_contact(const data::Scene& scene, const LatticeUnits& units);
contact::KernelLaw make_kernel_contact(const data::Scene& scene, const LatticeUnits& units);
/// What of a scene its coupling.scheme cannot do, one text each.
std::vector<std::string> coupling_problems(const data::Scene& scene);
contact::Domain make_domain(const data::Scene& scene, const Block& block);

}  // namespace hemowalk::resolved
