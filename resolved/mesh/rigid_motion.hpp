#pragma once
/// \file Linear and angular momentum of a set of vertices and the rigid motion that carries it.
/// T is a number or a pack of numbers (one body per lane).

#include "resolved/mesh/lane_vector.hpp"

namespace hemowalk::mesh {

/// Sums over vertices of mass m at r: the six numbers of the inertia tensor and the first moment.
template <class T>
struct Inertia {
  Vector<T> first{T(0), T(0), T(0)};
  T xx{0}, yy{0}, zz{0}, xy{0}, xz{0}, yz{0};  ///< sum m r_i r_j

  template <class S>
  HEMO_HD void add(const S& m, const Vector<T>& r) {
    const Vector<T> q = m * r;
    first = first + q;
    xx += q.x * r.x, yy += q.y * r.y, zz += q.z * r.z;
    xy += q.x * r.y, xz += q.x * r.z, yz += q.y * r.z;
  }
  HEMO_HD void add(const Inertia& o) {
    first = first + o.first;
    xx += o.xx, yy += o.yy, zz += o.zz, xy += o.xy, xz += o.xz, yz += o.yz;
  }
};

template <class T>
struct Momentum {
  Vector<T> linear{T(0), T(0), T(0)}, angular{T(0), T(0), T(0)};
  template <class S>
  HEMO_HD void add(const S& m, const Vector<T>& r, const Vector<T>& v) {
    const Vector<T> p = m * v;
    linear = linear + p;
    angular = angular + cross(r, p);
  }
  HEMO_HD void add(const Momentum& o) {
    linear = linear + o.linear;
    angular = angular + o.angular;
  }
};

/// v(r) = velocity + spin x (r - centre)
template <class T>
struct RigidMotion {
  Vector<T> velocity, spin;
};

/// A body as a mass metric: total mass, centre, inverse inertia tensor about the centre.
template <class T>
class Body {
 public:
  HEMO_HD Body(const T& mass, const Inertia<T>& i) : mass_(mass), centre_((1 / mass) * i.first) {
    const Vector<T>& c = centre_;
    const T xx = i.xx - i.first.x * c.x, yy = i.yy - i.first.y * c.y, zz = i.zz - i.first.z * c.z;
    const T xy = i.xy - i.first.x * c.y, xz = i.xz - i.first.x * c.z, yz = i.yz - i.first.y * c.z;
    const T a = yy + zz, b = xx + zz, d = xx + yy, e = -xy, f = -xz, g = -yz;  // inertia tensor
    const T ca = b * d - g * g, ce = f * g - e * d, cf = e * g - f * b;        // cofactors
    const T inverse = 1 / (a * ca + e * ce + f * cf);
    xx_ = ca * inverse, xy_ = ce * inverse, xz_ = cf * inverse;
    yy_ = (a * d - f * f) * inverse, yz_ = (e * f - a * g) * inverse, zz_ = (a * b - e * e) * inverse;
  }
  HEMO_HD const Vector<T>& centre() const { return centre_; }

  /// The rigid motion with momentum \\p p taken about the origin.
  HEMO_HD RigidMotion<T> motion(const Momentum<T>& p) const {
    return motion_about_centre({p.linear, p.angular - cross(centre_, p.linear)});
  }
  /// The same with the angular part taken about the centre.
  HEMO_HD RigidMotion<T> motion_about_centre(const Momentum<T>& p) const {
    const auto& l = p.angular;
    return {(1 / mass_) * p.linear,
            {xx_ * l.x + xy_ * l.y + xz_ * l.z, xy_ * l.x + yy_ * l.y + yz_ * l.z,
             xz_ * l.x + yz_ * l.y + zz_ * l.z}};
  }

 private:
  T mass_;
  Vector<T> centre_;
  T xx_, yy_, zz_, xy_, xz_, yz_;
};

}  // namespace hemowalk::mesh
