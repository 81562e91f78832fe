#pragma once
/// \file One walk step for all lanes: local law, step law, faces. Nothing here owns memory.
///
/// Units of the walk: length height/2^30, time dt. Positions are 32-bit integers 0 .. 2^30 over the slab (0.8
/// pm for 0.82 mm): the same resolution everywhere, four bytes per walker, reflection and cell index exact,
/// and a drift of a thousandth of a step's scatter is added without the bias a float position has far from
/// zero.

#include <cstdint>

#include "coarse/case.hpp"
#include "coarse/normal.hpp"
#include "coarse/philox.hpp"
#include "coarse/scalar_lanes.hpp"

namespace hemowalk::coarse {

/// How a face tells that a walker reached it within a step (docs/coarse.md gives the observed orders).
enum class WallScheme {
  plain,   ///< end point beyond the face; robin reacts with P = k sqrt(pi dt/D): weak order 1/2
  bridge,  ///< Brownian-bridge crossing test; robin reacts with half that P
  exact,   ///< bridge; robin and trap by the exact one-step kernel of the partially reflecting half-space
};

enum class StepLaw { gaussian, persistent, heavy_tail };

inline constexpr std::int32_t top_position = 1 << 30;

/// What a position below zero says about a walker.
namespace state {
inline constexpr std::int32_t absorbed_bottom = -1, absorbed_top = -2, nobody = -3;
/// Held by a trap: -(first + 2 release + side), release = step in which it leaves.
inline constexpr std::int32_t trapped_first = 16, last_release = (1 << 29) - 1;
HEMO_HD constexpr bool is_trapped(std::int32_t y) { return y <= -trapped_first; }
HEMO_HD constexpr bool is_absorbed(std::int32_t y) { return y == absorbed_bottom || y == absorbed_top; }
}  // namespace state

/// A face in the units of the walk.
struct Wall {
  Face::Type type = Face::Type::reflect;
  float uptake = 0;     ///< robin: k dt; trap: layer dt/residence
  float residence = 0;  ///< trap: residence time in steps
  float variance = 0;   ///< 2 D dt at the face
  HEMO_HD bool active() const { return type != Face::Type::reflect && type != Face::Type::periodic; }
};

/// Everything a step needs, by value and by pointers that outlive the walk.
struct WalkModel {
  const float* variance = nullptr;  ///< [cells + 2] 2 D dt at the nodes
  const float* drift = nullptr;     ///< [cells + 2] v dt at the nodes; null = no drift
  int shift = 30;                   ///< position >> shift = cell; 30 = homogeneous
  float inverse_cell = 0;           ///< 2^-shift
  Wall bottom, top;
  bool periodic = false;
  WallScheme scheme = WallScheme::exact;
  std::uint64_t seed = 1;
  std::int64_t release_low = 0, release_span = top_position;  ///< where walkers start, evenly spread

  StepLaw step_law = StepLaw::gaussian;
  struct {  ///< displacement / sqrt(2 D dt) = keep_in x + first n1 + second n2; x' = keep x + fresh n1
    float keep = 0, fresh = 1, keep_in = 0, first = 1, second = 0;
  } persistent;
  struct {  ///< with probability fraction: body n -> sign(n) scale u^(-1/exponent), else body n
    float fraction = 0, body = 1, scale = 0, inverse_exponent = 0;
  } heavy_tail;
  float gradient_drift = 0.5f;  ///< share of d(2 D dt)/dy in the drift: 1/2 is D'; less for a persistent walk
};

/// Where walker \p id starts.
HEMO_HD inline std::int32_t initial_position(const WalkModel& m, std::uint64_t id) {
  const std::int64_t drawn = random_bits(m.seed, Stream::initial, id, 0).word[0] >> 2;
  return static_cast<std::int32_t>(m.release_low + (drawn * m.release_span >> 30));
}

/// The walkers of one set of lanes.
template <class L>
struct LaneState {
  typename L::Int y;        ///< position; of ghosts any place in the slab
  typename L::Int code;     ///< 0 = free, else what will be stored instead of y (state::)
  typename L::Real memory;  ///< persistent walk: velocity / its standard deviation
  typename L::Bits offset;  ///< walker id - first id
};

/// 2 D dt and (v + D') dt at y.
template <class L, bool Table, bool Drift>
struct LocalLaw {
  typename L::Real variance, drift;

  HEMO_HD HEMO_INLINE LocalLaw(const WalkModel& m, const typename L::Int& y) {
    using Real = typename L::Real;
    if constexpr (!Table) {
      variance = Real(m.variance[0]);
      drift = Real(0);
    } else {
      using Int = typename L::Int;
      const Int cell = y >> m.shift;
      const Real at = to_real(y - (cell << m.shift)) * Real(m.inverse_cell);
      Real s0, s1;
      gather_pair(m.variance, cell, s0, s1);
      const Real slope = s1 - s0;
      variance = s0 + at * slope;
      drift = slope * Real(m.gradient_drift * m.inverse_cell);
      if constexpr (Drift) {
        Real v0, v1;
        gather_pair(m.drift, cell, v0, v1);
        drift += v0 + at * (v1 - v0);
      }
    }
  }
};

/// Probability that a walker is taken up by a partially reflecting face during a step of variance \p s from
/// distance x0 to distance x1 >= 0 (elastic Brownian motion: 1 - kernel with uptake / kernel without):
/// Q = sqrt(4 pi) e erfcx((x0 + x1)/sqrt(2 s) + e) / (1 + exp(2 x0 x1/s)), e = k sqrt(dt/D) =
/// uptake/sqrt(s/2).
template <class L>
HEMO_HD HEMO_INLINE typename L::Real uptake_probability(const typename L::Real& x0,
                                                        const typename L::Real& x1, const typename L::Real& s,
                                                        const typename L::Real& uptake) {
  using std::sqrt;
  using Real = typename L::Real;
  const Real e = uptake / sqrt(s * Real(0.5f));
  const Real a = (x0 + x1) / sqrt(s * Real(2)) + e;
  return Real(3.5449077018f) * e * erfcx<L>(a) / (Real(1) + exponential<L>(Real(2) * x0 * x1 / s));
}

/// What a walker taken up in \p step is stored as: absorbed, or trapped until an exponential time has passed.
template <class L>
HEMO_HD HEMO_INLINE typename L::Int taken_code(const Wall& wall, int side, std::int64_t step,
                                               const typename L::Bits& word) {
  using std::min;
  using Real = typename L::Real;
  using Int = typename L::Int;
  if (wall.type != Face::Type::trap) return Int(side == 0 ? state::absorbed_bottom : state::absorbed_top);
  const Real stay = Real(0.5f * wall.residence) * minus_two_log<L>(to_real(word) + Real(0.5f));
  const auto room = static_cast<std::int32_t>(std::max<std::int64_t>(state::last_release - step - 1, 0));
  const Int after = min(to_int(min(stay, Real(5e8f))), Int(room));
  const auto next = static_cast<std::int32_t>(std::min<std::int64_t>(step + 1, state::last_release));
  return Int(-(state::trapped_first + side)) - ((after + Int(next)) << 1);
}

/// The new codes after the way from distance \p x0 to \p x1 (below zero: beyond the face) of the face \p side
/// (0 bottom, 1 top). Called only when a lane is near, so it stays out of line, and takes everything by value
/// so that the lanes stay in registers where it is not called.
template <class L>
[[gnu::noinline]] HEMO_HD typename L::Int meet_wall(const WalkModel& m, int side, typename L::Int code,
                                                    typename L::Bits offset, typename L::Real x0,
                                                    typename L::Real x1, typename L::Real s,
                                                    std::uint64_t first_id, std::int64_t step) {
  using std::abs;
  using std::sqrt;
  using Real = typename L::Real;
  using Int = typename L::Int;
  const Wall& wall = side == 0 ? m.bottom : m.top;
  const Words<L> random = lane_bits<L>(m.seed, Stream::coarse_wall, first_id, offset, step);
  const Real u = uniform<L>(random.word[2 * side]);
  const auto crossed = [&] { return flag_of(u < exponential<L>(Real(-2) * x0 * x1 / s)); };
  typename L::Flag hit(false);
  if (wall.type == Face::Type::absorb) {
    hit = m.scheme == WallScheme::plain ? flag_of(x1 < Real(0)) : crossed();
  } else if (m.scheme == WallScheme::exact || wall.type == Face::Type::trap) {
    hit = flag_of(u < uptake_probability<L>(x0, abs(x1), s, Real(wall.uptake)));
  } else {
    const Real reaction = Real(1.7724538509f * wall.uptake) / sqrt(s * Real(0.5f));
    const Real u2 = uniform<L>(random.word[2 * side + 1]);
    hit = m.scheme == WallScheme::plain ? flag_of(x1 < Real(0)) && flag_of(u2 < reaction)
                                        : crossed() && flag_of(u2 < Real(0.5f) * reaction);
  }
  hit = hit && (code == Int(0));
  return select(hit, taken_code<L>(wall, side, step, random.word[2 * side + 1]), code);
}

template <class L>
struct Release {
  typename L::Int y, code;
  typename L::Real memory;  ///< a fresh velocity, away from the face
};

/// Place and code of walkers whose residence ends within \p step: they diffuse for the rest of it from the
/// face, and may be taken up again at once.
template <class L>
[[gnu::noinline]] HEMO_HD Release<L> leave_trap(const WalkModel& m, int side, typename L::Bits offset,
                                                std::uint64_t first_id, std::int64_t step) {
  using std::abs;
  using std::max;
  using std::sqrt;
  using Real = typename L::Real;
  using Int = typename L::Int;
  const Wall& wall = side == 0 ? m.bottom : m.top;
  const Words<L> random = lane_bits<L>(m.seed, Stream::coarse_wall, first_id, offset, step);
  // a second block of the same stream: steps are below 2^29, so bit 40 is free
  const Words<L> more =
      lane_bits<L>(m.seed, Stream::coarse_wall, first_id, offset, step | (std::int64_t{1} << 40));
  const NormalPair<L> normal(more.word[0], more.word[1]);
  // time of release within the step: exponential, given that it falls into the step
  const float within = -std::expm1(-1 / wall.residence);
  const Real kept = Real(1) - Real(within) * uniform<L>(random.word[0]);
  const Real released = Real(0.5f * wall.residence) * minus_two_log<L>(kept * Real(4294967296.0f));
  const Real rest = max(Real(1) - released, Real(1e-6f));
  const Real s = Real(wall.variance) * rest, x = abs(normal.cosine) * sqrt(normal.square * s);
  const Real u = uniform<L>(random.word[1]);
  const auto again = flag_of(u < uptake_probability<L>(Real(0), x, s, Real(wall.uptake) * rest));
  const Real speed = abs(normal.sine) * sqrt(normal.square);
  return {side == 0 ? to_int(x) : Int(top_position) - to_int(x),
          select(again, taken_code<L>(wall, side, step, random.word[2]), Int(0)), side == 0 ? speed : -speed};
}

/// Moves the walkers by \p scatter + \p drift and lets the faces act.
template <class L, StepLaw S>
HEMO_HD HEMO_INLINE void move(const WalkModel& m, LaneState<L>& w, const typename L::Real& scatter,
                              const typename L::Real& drift, const typename L::Real& s,
                              std::uint64_t first_id, std::int64_t step) {
  using std::abs;
  using Real = typename L::Real;
  using Int = typename L::Int;
  const Int top(top_position);
  const Int y1 = w.y + to_int(scatter + drift);
  const Real reach = Real(11.5f) * s;  // beyond it a bridge touches the face with probability < 2^-33
  if (m.bottom.active()) {
    const Real x0 = to_real(w.y), x1 = to_real(y1);
    if (any(x0 * x1 < reach)) w.code = meet_wall<L>(m, 0, w.code, w.offset, x0, x1, s, first_id, step);
  }
  if (m.top.active()) {
    const Real x0 = to_real(top - w.y), x1 = to_real(top - y1);
    if (any(x0 * x1 < reach)) w.code = meet_wall<L>(m, 1, w.code, w.offset, x0, x1, s, first_id, step);
  }
  if (m.periodic) {
    w.y = y1 & Int(top_position - 1);
  } else {
    const Int folded = top - abs(top - abs(y1));
    if constexpr (S == StepLaw::persistent)  // a mirrored walker moves the other way
      w.memory = select(folded == y1, w.memory, -w.memory);
    w.y = folded;
  }
  for (int side = 0; side < 2; ++side) {
    if ((side == 0 ? m.bottom : m.top).type != Face::Type::trap) continue;
    const auto leaving = w.code == Int(static_cast<std::int32_t>(-(state::trapped_first + side) - 2 * step));
    if (!any(leaving)) continue;
    const Release<L> free = leave_trap<L>(m, side, w.offset, first_id, step);
    w.y = select(leaving, free.y, w.y);
    w.code = select(leaving, free.code, w.code);
    if constexpr (S == StepLaw::persistent) w.memory = select(leaving, free.memory, w.memory);
  }
}

/// Steps of one Philox block: 4 for the Gaussian walk (one normal each), 2 for the others.
constexpr int steps_per_block(StepLaw law) { return law == StepLaw::gaussian ? 4 : 2; }

/// The random part of the displacement in step \p k of a block.
template <class L, StepLaw S>
HEMO_HD HEMO_INLINE typename L::Real scatter_of(const WalkModel& m, int k, const NormalPair<L>& pair,
                                                const Words<L>& words, const typename L::Real& variance,
                                                LaneState<L>& w) {
  using std::sqrt;
  using Real = typename L::Real;
  const Real& turn = k % 2 == 0 ? pair.cosine : pair.sine;
  if constexpr (S == StepLaw::gaussian) {
    return sqrt(variance * pair.square) * turn;
  } else if constexpr (S == StepLaw::persistent) {
    const Real radius = sqrt(pair.square), n1 = radius * pair.cosine, n2 = radius * pair.sine;
    const auto& p = m.persistent;
    const Real x = Real(p.keep_in) * w.memory + Real(p.first) * n1 + Real(p.second) * n2;
    w.memory = Real(p.keep) * w.memory + Real(p.fresh) * n1;
    return sqrt(variance) * x;
  } else {
    const auto& h = m.heavy_tail;
    const Real n = sqrt(pair.square) * turn, u = uniform<L>(words.word[2 + k]);
    Real x = Real(h.body) * n;
    const auto tail = flag_of(u < Real(h.fraction));
    if (any(tail)) {
      // u/fraction is uniform again, and (.)^(-1/a) = exp(-ln(.)/a)
      const Real minus_log = Real(0.5f) * minus_two_log<L>(u * Real(4294967296.0f / h.fraction));
      const Real size = Real(h.scale) * exponential<L>(minus_log * Real(h.inverse_exponent));
      x = select(tail, select(flag_of(n < Real(0)), -size, size), x);
    }
    return sqrt(variance) * x;
  }
}

/// Walks the \p N lane sets \p w through the steps [begin, end) in registers and cache. A step is a long
/// chain of dependent instructions (position, cell, D, square root, position); several sets side by side fill
/// its gaps. \p visit(set, before) is called every step.
template <class L, StepLaw S, bool Table, bool Drift, int N, class Visit>
HEMO_HD HEMO_INLINE void walk_steps(const WalkModel& m, LaneState<L> (&w)[N], std::uint64_t first_id,
                                    std::int64_t begin, std::int64_t end, const Visit& visit) {
  constexpr int n = steps_per_block(S);
  for (std::int64_t block = begin / n; block * n < end; ++block) {
    Words<L> words[N];
    NormalPair<L> pair[N][2];
    for (int j = 0; j < N; ++j) {
      words[j] = lane_bits<L>(m.seed, Stream::coarse_walk, first_id, w[j].offset, block);
      pair[j][0] = NormalPair<L>(words[j].word[0], words[j].word[1]);
      if (S != StepLaw::heavy_tail) pair[j][1] = NormalPair<L>(words[j].word[2], words[j].word[3]);
    }
    for (int k = 0; k < n; ++k) {
      const std::int64_t step = block * n + k;
      if (step < begin || step >= end) continue;
      const int used = S == StepLaw::gaussian ? k / 2 : S == StepLaw::persistent ? k : 0;
#pragma GCC unroll 8
      for (int j = 0; j < N; ++j) {
        const auto before = w[j].y;
        const LocalLaw<L, Table, Drift> law(m, before);
        const auto scatter = scatter_of<L, S>(m, k, pair[j][used], words[j], law.variance, w[j]);
        move<L, S>(m, w[j], scatter, law.drift, law.variance, first_id, step);
        visit(j, before);
      }
    }
  }
}

}  // namespace hemowalk::coarse
