#pragma once
/// \file MembraneStep: one solid step of one cell by one block of threads, all iterations in one launch,
/// state in shared memory. What happens in a triangle, an edge and a body is terms/ and
/// mesh/rigid_motion.hpp; the order of work is that of BatchKernel::step, the definition of right.
///
/// The constant matrix is applied as its dense inverse, one row per thread: 258 x 258 numbers in single
/// precision are 266 kB and stay in the second-level cache for all cells, where triangular sweeps would be 2
/// x 258 dependent steps (docs/adr/0010).

#include "core/device.hpp"
#include "resolved/mesh/cell_fields.hpp"
#include "resolved/mesh/rigid_motion.hpp"
#include "resolved/npfem/tables.hpp"

namespace hemowalk::npfem {

/// An edge seen from one of its four vertices: the force on it is -weight times the edge's vector.
template <class Real>
struct Hinge {
  int edge;
  Real weight;
};

/// Tables of a cell type where the kernels run.
template <class Real>
struct MembraneTables {
  int vertices, triangles, edges, pitch;
  const typename Tables<Real>::TriangleRow* triangle;
  const typename Tables<Real>::EdgeRow* edge;
  const int *ring_begin, *ring;  ///< per vertex: 4 triangle + corner
  const int* hinge_begin;
  const Hinge<Real>* hinge;
  const Real *metric, *mass_rate, *kappa;
  const Real* inverse;  ///< [vertices][pitch], symmetric
  const int *lap_begin, *lap_index;
  const Real* lap_value;
  Law law;
  bool bending, damped, stiff_volume;
  PaperLaw<Real> paper;
  NeoHookean<Real> neo_hookean;
  Skalak<Real> skalak;
  Real h, inverse_h, rest_volume, rest_gradient_square, volume_modulus, epsilon2, total_metric, rayleigh_beta;
};

/// What one cell reports of a step.
template <class Real>
struct CellReport {
  Real increment;  ///< square of |last correction|/|displacement|
  Real probe;      ///< not finite where any vertex is not
};

template <class Real>
struct MembraneStep {
  using V = Vector<Real>;
  static constexpr int threads = 288, workers = 32, sums = 16;
  MembraneTables<Real> t;
  mesh::CellFields<Real> cells;
  Real* residual;  ///< rounding residual of the offsets, as the fields
  CellReport<Real>* report;
  int iterations;
  bool damping;

  /// The same for the cells from \p first on.
  MembraneStep from(std::size_t first) const {
    MembraneStep s = *this;
    s.cells = cells.from(first), s.residual += cells.at(first, 0, 0), s.report += first;
    return s;
  }

  /// Where things are in shared memory.
  struct Shared {
    Real *x, *d, *moved, *force, *gradient, *predicted;  ///< [3][vertices]
    Real* element;  ///< [10][triangles]: forces on corners 1 and 2, area normal, volume share; later
                    ///< corrections
    Real* bend;     ///< [3][edges]
    Real* part;     ///< [workers][sums]
    Real* total;    ///< [2][sums]: of the frame, of the iteration
    Real *y, *u;    ///< [3][vertices], in the place of element
  };
  HEMO_HD static std::size_t reals(int vertices, int triangles, int edges) {
    const int element = 10 * triangles > 6 * vertices ? 10 * triangles : 6 * vertices;
    return static_cast<std::size_t>(18 * vertices + element + 3 * edges + workers * sums + 2 * sums);
  }
  std::size_t shared_bytes() const { return sizeof(Real) * reals(t.vertices, t.triangles, t.edges); }
  HEMO_HD Shared divide(unsigned char* shared) const {
    Real* p = reinterpret_cast<Real*>(shared);
    const int n = 3 * t.vertices, element = 10 * t.triangles > 2 * n ? 10 * t.triangles : 2 * n;
    Shared s;
    s.x = p, s.d = p + n, s.moved = p + 2 * n, s.force = p + 3 * n, s.gradient = p + 4 * n,
    s.predicted = p + 5 * n;
    s.element = p + 6 * n;
    s.bend = s.element + element;
    s.part = s.bend + 3 * t.edges;
    s.total = s.part + workers * sums;
    s.y = s.element, s.u = s.element + n;
    return s;
  }

  HEMO_HD int per_iteration() const { return t.stiff_volume ? 6 : 5; }
  HEMO_HD int phases() const { return 3 + iterations * per_iteration() + 6; }
  HEMO_HD void operator()(int phase, BlockThread at, unsigned char* shared) const {
    const Shared s = divide(shared);
    const int me = static_cast<int>(at.thread);
    if (phase < 3) return start(phase, at.block, me, s);
    phase -= 3;
    if (phase >= iterations * per_iteration())
      return finish(phase - iterations * per_iteration(), at.block, me, s);
    phase %= per_iteration();
    if (phase == 0) return elements(me, s);
    if (phase == 1) return gather(me, s);
    if (phase == 2) return unbalance(me, s);
    if (phase == 3) return respond(me, s);
    if (phase == 4 && t.stiff_volume) return volume_sums(me, s);
    correct(at.block, me, s);
  }

  HEMO_HD V get(const Real* field, int k) const { return mesh::get3(field, t.vertices, k); }
  HEMO_HD void put(const V& v, Real* field, int k) const { mesh::put3(v, field, t.vertices, k); }

  /// The vertices (or triangles) whose sums a worker takes: partial sums keep the round-off small.
  struct Span {
    int begin, end;
  };
  HEMO_HD static Span span(int n, int worker) {
    const int each = (n + workers - 1) / workers, begin = each * worker, end = begin + each;
    return {begin < n ? begin : n, end < n ? end : n};
  }
  /// Totals of the first \p n sums into \p total, by as many threads.
  HEMO_HD static void add_parts(int n, int me, const Real* part, Real* total) {
    if (me >= n) return;
    Real sum = 0;
    for (int w = 0; w < workers; ++w) sum += part[w * sums + me];
    total[me] = sum;
  }

  // ---- the rigid motion that carries the momenta of v_pred

  /// Starts from the last velocity: what is wrong with the stand-in then acts on dv/dt only.
  HEMO_HD void start(int phase, unsigned cell, int me, const Shared& s) const {
    if (phase == 0) {
      for (int k = me; k < t.vertices; k += threads) {
        const V d = t.h * cells.get(cells.velocity, cell, k);
        put(cells.get(cells.offset, cell, k), s.x, k);
        put(d, s.d, k);
        put(cells.get(residual, cell, k) + d, s.moved, k);
        put(cells.get(cells.predicted, cell, k), s.predicted, k);
      }
    } else if (phase == 1) {
      if (me >= workers) return;
      mesh::Inertia<Real> inertia;
      mesh::Momentum<Real> momentum;
      const Span mine = span(t.vertices, me);
      for (int k = mine.begin; k < mine.end; ++k) {
        const V r = get(s.x, k);
        inertia.add(t.metric[k], r);
        momentum.add(t.metric[k], r, get(s.predicted, k));
      }
      Real* p = s.part + me * sums;
      p[0] = inertia.first.x, p[1] = inertia.first.y, p[2] = inertia.first.z;
      p[3] = inertia.xx, p[4] = inertia.yy, p[5] = inertia.zz;
      p[6] = inertia.xy, p[7] = inertia.xz, p[8] = inertia.yz;
      store_momentum(momentum, p + 9);
    } else {
      add_parts(15, me, s.part, s.total);
    }
  }
  HEMO_HD static void store_momentum(const mesh::Momentum<Real>& m, Real* p) {
    p[0] = m.linear.x, p[1] = m.linear.y, p[2] = m.linear.z;
    p[3] = m.angular.x, p[4] = m.angular.y, p[5] = m.angular.z;
  }
  HEMO_HD static mesh::Momentum<Real> load_momentum(const Real* p) {
    mesh::Momentum<Real> m;
    m.linear = {p[0], p[1], p[2]};
    m.angular = {p[3], p[4], p[5]};
    return m;
  }
  HEMO_HD mesh::Body<Real> body(const Shared& s) const {
    mesh::Inertia<Real> i;
    const Real* p = s.total;
    i.first = {p[0], p[1], p[2]};
    i.xx = p[3], i.yy = p[4], i.zz = p[5], i.xy = p[6], i.xz = p[7], i.yz = p[8];
    return mesh::Body<Real>(t.total_metric, i);
  }

  // ---- one iteration

  HEMO_HD StretchGradient<Real> law_gradient(const Stretch<Real>& stretch) const {
    if (t.law == Law::paper) return t.paper.gradient(stretch);
    if (t.law == Law::neo_hookean) return t.neo_hookean.gradient(stretch);
    return t.skalak.gradient(stretch);
  }

  HEMO_HD void elements(int me, const Shared& s) const {
    const int n = t.triangles;
    for (int i = me; i < n; i += threads) {
      const auto row = t.triangle[i];
      const V r0 = get(s.x, row.v0), d0 = get(s.moved, row.v0);
      const V e1 = (get(s.x, row.v1) - r0) + (get(s.moved, row.v1) - d0);
      const V e2 = (get(s.x, row.v2) - r0) + (get(s.moved, row.v2) - d0);
      const auto now = make_triangle(e1, e2);
      const auto stretch = stretch_of(row.rest, now);
      V f1, f2;
      stretch_forces(row.rest, now, stretch, law_gradient(stretch), f1, f2);
      mesh::put3(f1, s.element, n, i);
      mesh::put3(f2, s.element + 3 * n, n, i);
      mesh::put3(now.normal, s.element + 6 * n, n, i);
      s.element[9 * n + i] = volume_share(r0 + d0, now.normal);
    }
    if (!t.bending) return;
    for (int i = me; i < t.edges; i += threads) {
      const auto row = t.edge[i];
      const V r0 = get(s.x, row.v0), d0 = get(s.moved, row.v0);
      const auto from0 = [&](int j) { return (get(s.x, j) - r0) + (get(s.moved, j) - d0); };
      const V e = edge_vector(row.rest, from0(row.v1), from0(row.v2), from0(row.v3));
      mesh::put3(edge_bending_factor(row.rest, t.epsilon2, e) * e, s.bend, t.edges, i);
    }
  }

  /// Forces and area normals round every vertex; partial sums of the volume.
  HEMO_HD void gather(int me, const Shared& s) const {
    const int n = t.triangles;
    for (int k = me; k < t.vertices; k += threads) {
      V force{Real(0), Real(0), Real(0)}, gradient{Real(0), Real(0), Real(0)};
      for (int i = t.ring_begin[k]; i < t.ring_begin[k + 1]; ++i) {
        const int triangle = t.ring[i] >> 2, corner = t.ring[i] & 3;
        const V f1 = mesh::get3(s.element, n, triangle), f2 = mesh::get3(s.element + 3 * n, n, triangle);
        force = force + (corner == 1 ? f1 : corner == 2 ? f2 : Real(-1) * (f1 + f2));
        gradient = gradient + mesh::get3(s.element + 6 * n, n, triangle);
      }
      if (t.bending)
        for (int i = t.hinge_begin[k]; i < t.hinge_begin[k + 1]; ++i)
          force = force - t.hinge[i].weight * mesh::get3(s.bend, t.edges, t.hinge[i].edge);
      put(force, s.force, k);
      put(gradient, s.gradient, k);
    }
    if (me >= workers) return;
    const Span mine = span(n, me);
    Real volume = 0;
    for (int i = mine.begin; i < mine.end; ++i) volume += s.element[9 * n + i];
    s.part[me * sums] = volume;
  }

  /// F_int - m/(h^2 (1 - kappa)) (d - h v'), v' = v_pred damped towards the rigid motion; see
  /// BatchKernel::unbalance.
  HEMO_HD void unbalance(int me, const Shared& s) const {
    Real volume = 0;
    for (int w = 0; w < workers; ++w) volume += s.part[w * sums];
    const Real p =
        volume_factor(t.volume_modulus, t.rest_volume, volume * (Real(1) / Real(6)), t.rest_gradient_square) *
        (Real(1) / Real(6));
    const bool drag = damping && t.damped;
    const mesh::Body<Real> frame = body(s);
    const mesh::RigidMotion<Real> motion = frame.motion(load_momentum(s.total + 9));
    for (int k = me; k < t.vertices; k += threads) {
      V wanted = get(s.predicted, k);
      Real rate = t.mass_rate[k];
      if (drag)
        wanted = wanted +
                 t.kappa[k] * (motion.velocity + cross(motion.spin, get(s.x, k) - frame.centre()) - wanted);
      else
        rate *= Real(1) - t.kappa[k];
      V r = get(s.force, k) + (rate * (t.h * wanted - get(s.d, k)) - p * get(s.gradient, k));
      if (t.rayleigh_beta > Real(0)) {
        V sum{Real(0), Real(0), Real(0)};
        for (int i = t.lap_begin[k]; i < t.lap_begin[k + 1]; ++i)
          sum = sum + t.lap_value[i] * get(s.d, t.lap_index[i]);
        r = r - (t.rayleigh_beta * t.inverse_h) * sum;
      }
      put(r, s.force, k);
    }
  }

  /// y = N^{-1} r and, where the volume is stiff, u = N^{-1} g.
  HEMO_HD void respond(int me, const Shared& s) const {
    for (int k = me; k < t.vertices; k += threads) {
      V y{Real(0), Real(0), Real(0)}, u = y;
      const Real* row = t.inverse + k;
      if (t.stiff_volume) {
        for (int j = 0; j < t.vertices; ++j, row += t.pitch) {
          y = y + *row * get(s.force, j);
          u = u + *row * get(s.gradient, j);
        }
        put(u, s.u, k);
      } else {
        for (int j = 0; j < t.vertices; ++j, row += t.pitch) y = y + *row * get(s.force, j);
      }
      put(y, s.y, k);
    }
  }

  /// g.u and u.r of the Woodbury formula, see BatchKernel::solve_with_volume.
  HEMO_HD void volume_sums(int me, const Shared& s) const {
    if (me >= workers) return;
    Real gu = 0, ur = 0;
    const Span mine = span(t.vertices, me);
    for (int k = mine.begin; k < mine.end; ++k) {
      const V u = get(s.u, k);
      gu += dot(get(s.gradient, k), u);
      ur += dot(u, get(s.force, k));
    }
    s.part[me * sums] = gu, s.part[me * sums + 1] = ur;
  }

  HEMO_HD void correct(unsigned cell, int me, const Shared& s) const {
    Real factor = 0;
    if (t.stiff_volume) {
      Real gu = 0, ur = 0;
      for (int w = 0; w < workers; ++w) gu += s.part[w * sums], ur += s.part[w * sums + 1];
      const Real c = t.volume_modulus / (36 * t.rest_gradient_square);  // gradient holds 6 g
      factor = c * ur / (1 + c * gu);
    }
    for (int k = me; k < t.vertices; k += threads) {
      V y = get(s.y, k);
      if (t.stiff_volume) y = y - factor * get(s.u, k);
      const V d = get(s.d, k) + y;
      put(y, s.y, k);
      put(d, s.d, k);
      put(cells.get(residual, cell, k) + d, s.moved, k);
    }
  }

  // ---- velocity, move, normals

  HEMO_HD void finish(int phase, unsigned cell, int me, const Shared& s) const {
    if (phase == 0) return missing_momentum(me, s);
    if (phase == 1) return add_parts(8, me, s.part, s.total + sums);
    if (phase == 2) return project(cell, me, s);
    if (phase == 3) return mean_velocity(me, s);
    if (phase == 4) return move(cell, me, s);
    normals(cell, me, s);
  }

  HEMO_HD void missing_momentum(int me, const Shared& s) const {
    if (me >= workers) return;
    mesh::Momentum<Real> missing;
    Real change = 0, all = 0;
    const Span mine = span(t.vertices, me);
    for (int k = mine.begin; k < mine.end; ++k) {
      const V d = get(s.d, k), y = get(s.y, k);
      missing.add(t.metric[k], get(s.x, k), get(s.predicted, k) - t.inverse_h * d);
      if (iterations > 0) change += dot(y, y), all += dot(d, d);
    }
    Real* p = s.part + me * sums;
    store_momentum(missing, p);
    p[6] = change, p[7] = all;
  }

  /// v = d/h with its rigid part replaced by that of v_pred, see BatchKernel::project.
  HEMO_HD void project(unsigned cell, int me, const Shared& s) const {
    const mesh::Body<Real> frame = body(s);
    const mesh::RigidMotion<Real> lost = frame.motion(load_momentum(s.total + sums));
    for (int k = me; k < t.vertices; k += threads) {
      const V v =
          t.inverse_h * get(s.d, k) + (lost.velocity + cross(lost.spin, get(s.x, k) - frame.centre()));
      cells.put(v, cells.velocity, cell, k);
      put(v, s.force, k);
    }
    if (me == 0) {
      const Real all = s.total[sums + 7];
      report[cell].increment = s.total[sums + 6] / (all > Real(1e-30) ? all : Real(1e-30));
    }
  }

  HEMO_HD void mean_velocity(int me, const Shared& s) const {
    if (me >= workers) return;
    V sum{Real(0), Real(0), Real(0)};
    const Span mine = span(t.vertices, me);
    for (int k = mine.begin; k < mine.end; ++k) sum = sum + get(s.force, k);
    Real* p = s.part + me * sums;
    p[0] = sum.x, p[1] = sum.y, p[2] = sum.z;
  }

  /// x + y = sum + error, exactly.
  HEMO_HD static Real two_sum(Real x, Real y, Real& error) {
    const Real sum = x + y, part = sum - x;
    error = (x - (sum - part)) + (y - part);
    return sum;
  }

  /// x += h v: the mean into the double anchor, the rest into offset + residual without loss.
  HEMO_HD void move(unsigned cell, int me, const Shared& s) const {
    V mean{Real(0), Real(0), Real(0)};
    for (int w = 0; w < workers; ++w) {
      const Real* p = s.part + w * sums;
      mean = mean + V{p[0], p[1], p[2]};
    }
    mean = (t.h / static_cast<Real>(t.vertices)) * mean;
    for (int k = me; k < t.vertices; k += threads) {
      const V x = get(s.x, k), y = (t.h * get(s.force, k) - mean) + cells.get(residual, cell, k);
      V sum, error;
      sum.x = two_sum(x.x, y.x, error.x);
      sum.y = two_sum(x.y, y.y, error.y);
      sum.z = two_sum(x.z, y.z, error.z);
      put(sum, s.x, k);
      cells.put(sum, cells.offset, cell, k);
      cells.put(error, residual, cell, k);
    }
    if (me != 0) return;
    double* anchor = cells.anchor + 3 * static_cast<std::size_t>(cell);
    anchor[0] += static_cast<double>(mean.x), anchor[1] += static_cast<double>(mean.y),
        anchor[2] += static_cast<double>(mean.z);
    report[cell].probe = mean.x + mean.y + mean.z;
  }

  HEMO_HD void normals(unsigned cell, int me, const Shared& s) const {
    using std::sqrt;
    for (int k = me; k < t.vertices; k += threads) {
      V n{Real(0), Real(0), Real(0)};
      for (int i = t.ring_begin[k]; i < t.ring_begin[k + 1]; ++i) {
        const auto& row = t.triangle[t.ring[i] >> 2];
        const V r0 = get(s.x, row.v0);
        n = n + cross(get(s.x, row.v1) - r0, get(s.x, row.v2) - r0);
      }
      const Real square = dot(n, n);
      cells.put((Real(1) / sqrt(square > Real(1e-30) ? square : Real(1e-30))) * n, cells.normal, cell, k);
    }
  }
};

}  // namespace hemowalk::npfem
