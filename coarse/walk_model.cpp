#include "coarse/walk_model.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/text.hpp"

namespace hemowalk::coarse {

namespace {

Wall make_wall(const Face& face, const Case& the_case, double D, double cell_free_layer) {
  const double unit = the_case.height / top_position;
  Wall wall{face.type, 0, 0, static_cast<float>(2 * D * the_case.dt / (unit * unit))};
  if (face.type == Face::Type::robin) wall.uptake = static_cast<float>(face.rate * the_case.dt / unit);
  if (face.type == Face::Type::trap) {
    const double layer = face.layer > 0 ? face.layer : cell_free_layer;
    require(face.rate > 0, "a trap needs a residence time > 0 (trap: tau) give it, e.g. trap: 1 s");
    require(
        std::isfinite(layer) && layer > 0,
        "a trap needs the thickness of its layer (neither the face nor the law's cell_free_layer states one) "
        "use a law with a cell-free layer");
    wall.residence = static_cast<float>(face.rate / the_case.dt);
    wall.uptake = static_cast<float>(layer / face.rate * the_case.dt / unit);
  }
  return wall;
}

/// Exact integration of an Ornstein-Uhlenbeck velocity over one step; t = dt/memory.
void set_persistent(WalkModel& m, double t) {
  const double keep = std::exp(-t), lost = -std::expm1(-t);
  const double fresh2 = -std::expm1(-2 * t);
  // variance of the displacement/memory given the velocity, 2t - 3 + 4 keep - keep^2, by series where it
  // cancels
  const double total = t > 0.02 ? 2 * t - 3 + 4 * keep - keep * keep
                                : t * t * t * (2.0 / 3 - t / 2 + 7 * t * t / 30 - t * t * t / 12);
  const double first = lost * lost / std::sqrt(fresh2), scale = 1 / std::sqrt(2 * t);
  m.persistent.keep = static_cast<float>(keep);
  m.persistent.fresh = static_cast<float>(std::sqrt(fresh2));
  m.persistent.keep_in = static_cast<float>(lost * scale);
  m.persistent.first = static_cast<float>(first * scale);
  m.persistent.second = static_cast<float>(std::sqrt(std::max(total - first * first, 0.0)) * scale);
  // Successive displacements are correlated; with sqrt(2 D) read at each step's start that brings a drift
  // D' lost/(2 t) of its own (D'/2 for short steps, none for long ones): the rest is added.
  m.gradient_drift = static_cast<float>(0.5 * (1 - lost / (2 * t)));
}

/// Unit variance in all: (1 - f) body^2 + f scale^2 a/(a - 2) = 1, the tail starting at twice the body.
void set_heavy_tail(WalkModel& m, double exponent, double fraction) {
  require(exponent > 2 && fraction > 0 && fraction < 0.5,
          "the heavy-tailed step law is unusable (it needs tail_exponent > 2, or D is infinite, and 0 < "
          "tail_fraction < 0.5) calibrate again");
  const double body = 1 / std::sqrt(1 - fraction + fraction * 4 * exponent / (exponent - 2));
  m.heavy_tail = {static_cast<float>(fraction), static_cast<float>(body), static_cast<float>(2 * body),
                  static_cast<float>(1 / exponent)};
}

void check_case(const Case& c, const SlabLaw& law) {
  require(c.height > 0 && c.dt > 0 && c.walkers > 0,
          "height, dt and walkers must be positive (the slab or the ensemble is empty) correct the case");
  require((c.bottom.type == Face::Type::periodic) == (c.top.type == Face::Type::periodic),
          "one face is periodic and the other is not (a period joins both) make both periodic");
  require(
      !c.release ||
          (0 <= (*c.release)[0] && (*c.release)[0] < (*c.release)[1] && (*c.release)[1] <= c.height),
      "the walkers' layer at the start does not lie in the slab (0 <= lower < upper <= height) correct it");
  const double rms = std::sqrt(2 * law.largest_D() * c.dt);
  require(rms <= c.height / 8, [&] {
    return formatted("dt = %g s is too long for the slab (rms step %g um, height %g um) use dt <= %g s", c.dt,
                     rms * 1e6, c.height * 1e6, c.height * c.height / (128 * law.largest_D()));
  });
}

}  // namespace

WalkTables make_walk(const Case& c, const SlabLaw& law, const WalkSettings& settings) {
  check_case(c, law);
  WalkTables walk;
  const double unit = c.height / top_position;
  const std::size_t cells = law.cells();
  require((cells & (cells - 1)) == 0, "the slab's law needs 2^n cells");
  walk.drifts = law.has_drift();
  walk.table = cells > 1 || walk.drifts;
  for (std::size_t i = 0; i < cells + 2; ++i) {
    const std::size_t node = std::min(i, cells);
    walk.variance.push_back(static_cast<float>(2 * law.D[node] * c.dt / (unit * unit)));
    walk.drift.push_back(static_cast<float>(law.v[node] * c.dt / unit));
  }
  WalkModel& m = walk.model;
  m.shift = 30;
  for (std::size_t n = cells; n > 1; n /= 2) --m.shift;
  m.inverse_cell = std::ldexp(1.0f, -m.shift);
  m.bottom = make_wall(c.bottom, c, law.D.front(), settings.cell_free_layer);
  m.top = make_wall(c.top, c, law.D.back(), settings.cell_free_layer);
  m.periodic = c.bottom.type == Face::Type::periodic;
  m.scheme = settings.scheme;
  m.seed = c.seed;
  if (c.release) {
    m.release_low = std::llround((*c.release)[0] / unit);
    m.release_span = std::llround((*c.release)[1] / unit) - m.release_low;
  }
  m.step_law = settings.step_law;
  if (settings.step_law == StepLaw::persistent) {
    require(settings.memory > 0,
            "a persistent walk needs a memory time > 0 (step_law: persistent) calibrate again");
    set_persistent(m, c.dt / settings.memory);
  }
  if (settings.step_law == StepLaw::heavy_tail)
    set_heavy_tail(m, settings.tail_exponent, settings.tail_fraction);
  if (!settings.ito_drift) m.gradient_drift = 0;
  return walk;
}

}  // namespace hemowalk::coarse
