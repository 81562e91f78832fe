#pragma once
/// \file Bodies for the contact tests: meshes placed anywhere, in the arrays contact works on.

#include <cmath>
#include <vector>

#include "core/array.hpp"
#include "resolved/contact/contact.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/shapes.hpp"

namespace hemowalk::test {

inline contact::Shape contact_shape(const mesh::TriangleMesh& mesh) {
  contact::Shape shape;
  for (const auto& t : mesh.triangles)
    for (const int v : t) shape.triangles.push_back(static_cast<std::uint32_t>(v));
  shape.area = mesh::vertex_areas(mesh);
  return shape;
}

template <class Real>
struct ContactBodies {
  std::vector<mesh::TriangleMesh> meshes;
  std::vector<contact::Shape> shapes;
  std::vector<contact::Body> bodies;
  std::vector<contact::Origin> origin;
  std::vector<Node4<Real>> local, force;

  int add_shape(const mesh::TriangleMesh& mesh) {
    meshes.push_back(mesh);
    shapes.push_back(contact_shape(mesh));
    return static_cast<int>(meshes.size()) - 1;
  }
  int add(int shape, const mesh::Vec3& centre, const mesh::Quaternion& q = mesh::identity_rotation) {
    contact::Origin o;
    for (int k = 0; k < 3; ++k) o[k] = static_cast<std::int32_t>(std::floor(centre[k]));
    bodies.push_back({static_cast<std::uint32_t>(local.size()), 1, static_cast<std::uint16_t>(shape), true});
    origin.push_back(o);
    for (const mesh::Vec3& r : meshes[shape].vertices) {
      const mesh::Vec3 x = mesh::rotate(q, r);
      local.push_back({static_cast<Real>(x[0] + centre[0] - o[0]), static_cast<Real>(x[1] + centre[1] - o[1]),
                       static_cast<Real>(x[2] + centre[2] - o[2]), Real(0)});
    }
    force.resize(local.size());
    return static_cast<int>(bodies.size()) - 1;
  }
  View<const contact::Origin> origins() const { return {origin.data(), origin.size()}; }
  View<const Node4<Real>> positions() const { return {local.data(), local.size()}; }
  View<Node4<Real>> forces() { return {force.data(), force.size()}; }
  contact::Summary compute(contact::Contact<Real>& contact) {
    return contact.compute(origins(), positions(), forces());
  }
  contact::Contact<Real> contact(const contact::Law& law, const contact::Domain& domain = {}) const {
    contact::Contact<Real> c(law, domain, shapes);
    c.set_bodies(bodies);
    return c;
  }
  std::size_t vertices(int b) const { return meshes[bodies[b].shape].vertices.size(); }
  /// Absolute position of vertex v of body b.
  mesh::Vec3 at(int b, std::size_t v) const {
    const auto& p = local[bodies[b].first + v];
    return {origin[b][0] + double(p.x), origin[b][1] + double(p.y), origin[b][2] + double(p.z)};
  }
};

}  // namespace hemowalk::test
