// Two sheets sliding past each other: the hydrodynamic thickness of a smeared sheet and its remedy
// (method 5.2).
#include <gtest/gtest.h>

#include <cstdio>

#include "core/data/scene.hpp"
#include "support/sheets.hpp"

namespace hemowalk::resolved {
namespace {

double mean_over_offsets(test_support::SheetCase c) {
  double sum = 0;
  for (const double offset : {0.0, 0.25}) {
    c.offset = offset;
    sum += test_support::relative_friction(c) / 2;
  }
  return sum;
}

// With the retraction and chi that belong to each kernel. A narrower kernel smears a sheet less, and less
// retraction is right at all gaps at once.
TEST(SheetFriction, IsRightWithTheRetractionOfEachKernel) {
  using Kernel = data::Coupling::Kernel;
  const struct {
    Kernel kernel;
    ibm::Kernel weights;
    double close, apart;  // errors allowed at a gap of half a spacing and from one spacing up
  } kernels[] = {{Kernel::phi2, ibm::Kernel::phi2, 0.10, 0.10},
                 {Kernel::phi3, ibm::Kernel::phi3, 0.16, 0.04},
                 {Kernel::phi4, ibm::Kernel::phi4, 0.45, 0.25}};
  for (const auto& k : kernels) {
    const auto coupling = data::Coupling::with(k.kernel);
    for (const double gap : {0.5, 1.0, 2.0, 4.0}) {
      test_support::SheetCase c;
      c.gap = gap, c.kernel = k.weights, c.retraction = coupling.retraction, c.chi = coupling.chi;
      EXPECT_NEAR(mean_over_offsets(c), 1, gap < 1 ? k.close : k.apart)
          << "kernel " << static_cast<int>(k.kernel) << ", gap " << gap << " dx";
    }
  }
}

// Two membranes 0.5 um apart, as in crowded blood, on the lattices of dx 0.5, 1/3 and 0.25 um.
TEST(SheetFriction, OfOneFilmOverLatticeSpacing) {
  const auto shipped = data::Coupling::with(data::Coupling::Kernel::phi3);
  for (const double dx : {0.5, 1.0 / 3, 0.25}) {
    test_support::SheetCase c;
    c.gap = 0.5 / dx, c.kernel = ibm::Kernel::phi3, c.retraction = shipped.retraction, c.chi = shipped.chi;
    const double friction = mean_over_offsets(c);
    std::printf("film of 0.5 um, dx %.3f um: friction %.3f\n", dx, friction);
    EXPECT_NEAR(friction, 1, 0.04) << "dx " << dx << " um";
  }
}

TEST(SheetFriction, WithoutRetractionASheetIsHalfASpacingTooThick) {
  // The measured table of the method for chi 8/3, theta 0.97: it pins the coupling itself.
  const double gaps[] = {0.5, 1, 2, 4}, table[] = {5.4, 3.0, 1.8, 1.35};
  for (int i = 0; i < 4; ++i) {
    test_support::SheetCase c;
    c.gap = gaps[i], c.retraction = 0;
    EXPECT_NEAR(mean_over_offsets(c) / table[i], 1, 0.04) << "gap " << gaps[i] << " dx";
  }
}

}  // namespace
}  // namespace hemowalk::resolved
