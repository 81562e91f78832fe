#pragma once
/// \file SlabLaw: D(y) and v(y) on a fine uniform grid of the slab, from a law that was measured in a thin
/// gap.

#include <string>
#include <vector>

#include "coarse/case.hpp"
#include "core/data/transport_law.hpp"

namespace hemowalk::coarse {

/// D and v at the nodes y_i = i height/cells; linear in between, so D' is the slope of its cell: the D a
/// walker diffuses with and the D' it drifts with are one function, and a uniform concentration stays
/// uniform.
struct SlabLaw {
  double height = 0;         ///< m
  std::vector<double> D, v;  ///< [cells + 1] m2/s, m/s; v without D'

  std::size_t cells() const { return D.size() - 1; }
  double spacing() const { return height / static_cast<double>(cells()); }
  bool has_drift() const;
  double largest_D() const;
  double D_at(double y) const;
  double v_at(double y) const;
};

/// One member of the ensemble over the law's uncertainty. The default is the law itself.
struct LawDraw {
  int draw = -1;              ///< index into profile.D_draws; -1 = the profile itself
  double core_score = 0;      ///< core value = D + score D_sigma, cut off at D/20
  double exponent_score = 0;  ///< shear exponent = value + score sigma
};

/// Maps \p law onto the slab of \p the_case (docs/coarse.md):
/// - no profile, or periodic faces: the core value everywhere;
/// - slab as high as the measured gap (to 1 %): the profile as it is, wall to wall;
/// - other heights: wall layers by distance from the nearest wall (mean of both walls), core value in
/// between,
///   joined by a cosine over half a layer thickness. A layer ends where core.y_range begins.
/// D and v are scaled by (shear / measured shear)^exponent unless the case gives a constant D or has no flow.
/// Nodes: a power of two of cells, at least 16 per node of the profile, at most 4096.
/// D below 1 % of the core value is raised to that (a finding tells). \throws InputError for a profile that
/// is unsorted or not finite.
SlabLaw map_law(const data::TransportLaw& law, const Case& the_case, const LawDraw& draw = {});

/// \p count members that represent the law's uncertainty, evenly spread over its quantiles (no random
/// numbers, so two cases meet the same members): the posterior draws where the law has them, with core values
/// ordered like the draws' own; else the core value and the profile move together by D_sigma. Empty when the
/// law states no uncertainty at all.
std::vector<LawDraw> law_ensemble(const data::TransportLaw& law, int count);

/// A slab with D and v given as functions of y; for tests and studies.
template <class D, class V>
SlabLaw make_slab_law(double height, int cells, D&& D_of_y, V&& v_of_y) {
  SlabLaw slab{height, {}, {}};
  for (int i = 0; i <= cells; ++i) {
    slab.D.push_back(D_of_y(height * i / cells));
    slab.v.push_back(v_of_y(height * i / cells));
  }
  return slab;
}

/// What the law cannot vouch for in this case: shear rate, time step, failed gate, thin slab. One sentence
/// each.
std::vector<std::string> validity_findings(const data::TransportLaw& law, const Case& the_case);

}  // namespace hemowalk::coarse
