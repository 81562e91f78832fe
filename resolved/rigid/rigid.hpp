#pragma once
/// \file RigidBodies: all rigid cells of one shape, six degrees of freedom each, with the face of
/// npfem::Membranes.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/array.hpp"
#include "resolved/mesh/host_fields.hpp"
#include "resolved/mesh/lanes.hpp"
#include "resolved/mesh/observables.hpp"
#include "resolved/mesh/rotation.hpp"
#include "resolved/mesh/step.hpp"

namespace hemowalk::rigid {

/// Shape and mass metric of one kind of rigid body. Its own inertia enters through v_pred = (m v^n + ..)/(m +
/// k a).
struct BodyType {
  mesh::TriangleMesh rest;
  std::vector<double>
      mass;  ///< m_k: own inertia, for diagnostics; the step sees it through v_pred and metric
  std::vector<double> metric;  ///< m_k + k a_k: the mass of the implicit step, > 0
  double h = 1;                ///< solid time step
  /// Points of the body frame, one per vertex, where the surroundings hold it: metric, v_pred and velocities
  /// belong to them. Empty: the vertices themselves.
  std::vector<mesh::Vec3> held = {};
};

struct Shape;

using mesh::StepOptions;
using mesh::StepReport;

/// Positions are anchor (double) + R(q) rest, q kept in double; fields as in npfem::Membranes.
template <class Real>
class RigidBodies {
 public:
  static constexpr int lanes = mesh::lanes_of<Real>;
  explicit RigidBodies(BodyType type);
  /// The same type, no bodies.
  RigidBodies empty() const { return RigidBodies(type()); }
  ~RigidBodies();
  RigidBodies(RigidBodies&&) noexcept;
  RigidBodies& operator=(RigidBodies&&) noexcept;

  int count() const;
  int vertices() const;
  int batches() const { return (count() + lanes - 1) / lanes; }
  mesh::Layout<Real> layout() const { return {vertices()}; }
  const mesh::TriangleMesh& rest() const;
  const std::vector<double>& vertex_areas() const;
  double bounding_radius() const;
  double rest_volume() const;
  double h() const;

  void reserve(int cells);
  int add(std::int64_t id, const mesh::Vec3& centre, const mesh::Quaternion& q);
  void remove(int c);
  std::int64_t id(int c) const;

  View<const double> anchors() const;
  View<const Real> offsets() const;
  View<const Real> held() const;        ///< BodyType::held - anchor
  View<const Real> velocities() const;  ///< of the held points
  View<const Real> normals() const;
  View<Real> predicted();
  /// Torque about the anchor during the next step, beside what v_pred carries; forgotten after it.
  void add_couple(int c, const mesh::Vec3& torque);

  /// Moves every body by h: V and omega such that sum metric (v - v_pred) = 0 and sum r^n x metric (v -
  /// v_pred) = h couple with v = V + (exp(h omega) - 1) r^n/h, the chord velocity of the held points r:
  /// x^{n+1} = x^n + h v holds as for membranes, the shape stays exactly rigid and both momenta are conserved
  /// to round-off.
  StepReport step(const StepOptions& options = {});

  mesh::Vec3 anchor(int c) const;
  mesh::Vec3 position(int c, int k) const;
  std::vector<mesh::Vec3> positions(int c) const;
  void translate(int c, const mesh::Vec3& shift);
  mesh::Observables observe(int c) const;
  std::size_t state_bytes() const;
  void save(int c, std::byte* out) const;
  int load(const std::byte* in);
  void restore(int c, const std::byte* in);  ///< body c becomes the saved one
  /// For who takes the step elsewhere and writes its outcome here.
  mesh::HostFields<Real> host_fields();

  // --- rigid bodies only -------------------------------------------------------------------------------
  const BodyType& type() const;
  const Shape& shape() const;
  mesh::Quaternion orientation(int c) const;
  mesh::Vec3 velocity(int c) const;  ///< of the centre
  mesh::Vec3 angular_velocity(int c) const;
  void set_motion(int c, const mesh::Vec3& velocity, const mesh::Vec3& angular_velocity);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class RigidBodies<float>;
extern template class RigidBodies<double>;

}  // namespace hemowalk::rigid
