// Rheology of red cells in Couette flow: viscosity against hematocrit, shear rate, lattice spacing, box and
// the coupling's constants. Prints the tables of docs/evidence/validation.md. HEMOWALK_PACKINGS (2) chooses
// how many packings are averaged.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "support/figure.hpp"
#include "support/pries.hpp"
#include "support/suspension.hpp"

namespace hemowalk::resolved {
namespace {

using test::SuspensionCase;
using test::SuspensionResult;
using test::wide_tube_viscosity;

int packings() {
  const char* asked = std::getenv("HEMOWALK_PACKINGS");
  return asked ? std::max(1, std::atoi(asked)) : 2;
}

std::vector<SuspensionResult> shear(const SuspensionCase& c) {
  std::vector<SuspensionResult> runs;
  for (int seed = 1; seed <= packings(); ++seed) runs.push_back(test::shear_suspension(c, seed));
  return runs;
}

void print_row(const std::vector<SuspensionResult>& runs) {
  using R = SuspensionResult;
  for (const auto member : {&R::viscosity, &R::core_shear, &R::core_hematocrit, &R::core_viscosity,
                            &R::plasma_layer, &R::stray}) {
    const test::Mean m = test::mean_of(runs, member);
    std::isfinite(m.error) ? std::printf(" %.3f ± %.3f |", m.value, m.error)
                           : std::printf(" %.3f |", m.value);
  }
  std::printf("\n");
  std::fflush(stdout);
}

constexpr const char* columns =
    " viscosity | core shear/γ | core hematocrit | stress/(μ core shear) | plasma layer, µm | square "
    "displacement over a strain of 2, µm² |";

void expect_sound(const std::vector<SuspensionResult>& runs) {
  for (const auto& r : runs) {
    EXPECT_NEAR(r.volume, 1, 0.01);
    EXPECT_GT(r.core_shear, 0.5);
  }
}

// Between walls plasma layers lower the stress at the nominal shear rate. What can be compared with wide
// tubes is the core: its stress over its own shear rate at its own hematocrit. Pries et al. scatter by some
// 10 % about their fit. Above it dx 0.5 um with 258 vertices adds a third of what the cells add, eta - 1
// (2.38 in place of 2.04 at Ht 0.32, ViscosityAndPowerOverLatticeSpacing extrapolated), and packings scatter:
// two standard errors (of the default two packings rough ones; of a single packing nothing is known).
TEST(Rheology, ViscosityOverHematocrit) {
  std::printf("| Ht | wide tube at the core's Ht |%s\n", columns);
  double before = 1;
  std::vector<double> there, inside, gap, gap_error, core_value, core_error, smooth, law, layer, layer_error;
  for (double h = 0; h < 0.501; h += 0.02) smooth.push_back(h), law.push_back(wide_tube_viscosity(h));
  for (const double hematocrit : {0.1, 0.2, 0.3, 0.45}) {
    SuspensionCase c;
    c.hematocrit = hematocrit;
    const auto runs = shear(c);
    const double core = test::mean_of(runs, &SuspensionResult::core_hematocrit).value,
                 wide = wide_tube_viscosity(core);
    std::printf("| %.2f | %.2f |", hematocrit, wide);
    print_row(runs);
    expect_sound(runs);
    const double viscosity = test::mean_of(runs, &SuspensionResult::viscosity).value;
    EXPECT_GT(viscosity, before);
    before = viscosity;
    const auto middle = test::mean_of(runs, &SuspensionResult::core_viscosity);
    EXPECT_LT(middle.value, 1.1 * wide + (wide - 1) / 3 + 2 * middle.error) << hematocrit;
    EXPECT_GT(middle.value, 0.9 * wide - 2 * middle.error) << hematocrit;
    const auto finite = [](double error) { return std::isfinite(error) ? error : 0; };
    // Whole cells only: what there is differs from what was asked for.
    const auto cells = resolved::census(test::suspension_scene(c, 1));
    const double box = 1e-18 * c.box[0] * c.box[1] * c.box[2];
    there.push_back(cells.rbc * cells.rbc_volume / box), inside.push_back(core);
    gap.push_back(viscosity);
    gap_error.push_back(finite(test::mean_of(runs, &SuspensionResult::viscosity).error));
    core_value.push_back(middle.value), core_error.push_back(finite(middle.error));
    const auto plasma = test::mean_of(runs, &SuspensionResult::plasma_layer);
    layer.push_back(plasma.value), layer_error.push_back(finite(plasma.error));
    // More cells, thinner layers; the difference within the errors of both.
    if (layer.size() > 1) {
      EXPECT_LT(layer.back(),
                layer[layer.size() - 2] + 2 * std::hypot(layer_error.back(), layer_error[layer.size() - 2]));
    }
  }
  using Style = test::Figure::Style;
  test::Figure("viscosity_over_hematocrit", "Red cells between walls 20 µm apart", "hematocrit",
               "viscosity over that of plasma")
      .curve("whole gap", Style::points, 0, there, gap, gap_error)
      .curve("core, at its own hematocrit and shear rate", Style::points, 1, inside, core_value, core_error)
      .curve("wide tube, Pries et al. 1992", Style::line, -1, smooth, law)
      .write();
  test::Figure("plasma_layer", "Red cells between walls 20 µm apart", "hematocrit", "plasma layer, µm")
      .with("set yrange [0:]")
      .curve("hematocrit below half of that in the core", Style::points, 0, there, layer, layer_error)
      .write();
}

// Blood thins under shear, also where nothing aggregates. A box of 15 um.
TEST(Rheology, ViscosityOverShearRate) {
  std::printf("| γ, 1/s | κ |%s\n", columns);
  const auto run = [](double rate, double kappa) {
    SuspensionCase c;
    c.box = {15, 15, 15}, c.strain = 16;
    c.shear_rate = rate, c.kappa = kappa;
    c.inertia = std::min(5000.0, 100 * rate);  // acceleration 100 at most
    const auto runs = shear(c);
    std::printf("| %.0f | %.1f |", rate, kappa);
    print_row(runs);
    expect_sound(runs);
    return test::mean_of(runs, &SuspensionResult::viscosity).value;
  };
  const std::vector<double> rates{20, 100, 500};
  std::vector<double> viscosity;
  for (const double rate : rates) {
    viscosity.push_back(run(rate, 0.5));
    if (viscosity.size() > 1) {
      EXPECT_LT(viscosity.back(), viscosity[viscosity.size() - 2]);
    }
  }
  const double damped = run(100, 0.9);
  using Style = test::Figure::Style;
  test::Figure("viscosity_over_shear_rate", "Red cells at 35 % between walls 15 µm apart", "shear rate, 1/s",
               "viscosity over that of plasma")
      .with("set logscale x\nset xrange [10:1000]\nset yrange [1:]")
      .curve("κ 0.5", Style::dots, 0, rates, viscosity)
      .curve("κ 0.9", Style::points, 1, {100}, {damped})
      .write();
}

// The same packing on three lattices, and on the coarsest with the meshes of the finer ones: a box of 12 um,
// 35 %. What slip and modes without stress take is the lattice's and falls with it; is it the excess
// viscosity?
TEST(Rheology, ViscosityAndPowerOverLatticeSpacing) {
  SuspensionCase c;
  c.box = {12, 12, 12}, c.strain = 8;
  const auto coarse = test::suspension_scene(c, 1);
  const auto cells = pack(coarse);
  std::printf("| dx, µm | subdivision |%s\n", columns);
  std::vector<SuspensionResult> runs;
  const auto run = [&](double dx, int subdivision) {
    c.dx = dx, c.subdivision = subdivision;
    const auto scene = test::suspension_scene(c, 1);
    const auto r = test::shear_suspension(c, test::refine(cells, coarse, scene), scene);
    std::printf("| %.3f | %d |", dx, subdivision);
    print_row({r});
    r.power.print("shares");
    const double p = r.power.sum.fed() / r.viscosity;
    std::printf("as stress/μγ: plasma %.3f, numerical %.3f\n", r.power.sum.viscous / p,
                r.power.numerical() * r.viscosity);
    std::fflush(stdout);
    expect_sound({r});
    EXPECT_LT(std::abs(r.power.sum.residual()), 1e-3);
    return r;
  };
  for (const auto& [dx, subdivision] : {std::pair{0.5, 8}, {1.0 / 3, 12}, {0.25, 16}})
    runs.push_back(run(dx, subdivision));
  using Style = test::Figure::Style;
  test::Figure("viscosity_over_dx", "Red cells at 35 % between walls 12 µm apart, one packing",
               "lattice spacing, µm", "over that of plasma at the nominal shear rate")
      .with("set xrange [0:0.55]\nset yrange [0:]")
      .curve("stress", Style::dots, 0, {0.5, 1.0 / 3, 0.25},
             {runs[0].viscosity, runs[1].viscosity, runs[2].viscosity})
      .curve("of it slip and modes without stress", Style::dots, 1, {0.5, 1.0 / 3, 0.25},
             {runs[0].power.numerical() * runs[0].viscosity, runs[1].power.numerical() * runs[1].viscosity,
              runs[2].power.numerical() * runs[2].viscosity})
      .write();
  // Known: the coupling acts too thick on a coarse lattice, 12 and 3.1 % at 0.5 and 1/3 um against 0.25 um.
  // The excesses are as 4 to 1, which is order 2 (order 1: 3 to 1). One packing on three lattices, so that
  // its scatter drops out of the differences; a quarter more is allowed.
  const double excess[] = {runs[0].viscosity / runs[2].viscosity - 1,
                           runs[1].viscosity / runs[2].viscosity - 1};
  EXPECT_LT(excess[0], 0.15);
  EXPECT_LT(std::abs(excess[1]), 0.04);
  EXPECT_GT(excess[0], 3 * excess[1]) << "below order 1";
  for (const int i : {0, 1}) EXPECT_LT(runs[i + 1].power.numerical(), 0.75 * runs[i].power.numerical());
  for (const int subdivision : {12, 16}) runs.push_back(run(0.5, subdivision));
  std::printf("phi4\n");
  c.coupling = data::Coupling::with(data::Coupling::Kernel::phi4);
  for (const int subdivision : {8, 12}) {
    // More slip; the stress does not tell the kernels apart.
    const auto wide = run(0.5, subdivision);
    const auto& r = runs[subdivision == 8 ? 0 : 3];
    EXPECT_LT(r.power.sum.slip / r.power.sum.fed(), 0.7 * wide.power.sum.slip / wide.power.sum.fed());
    EXPECT_NEAR(r.viscosity / wide.viscosity, 1, 0.03);
  }
  // With the same mesh the stress that dx 0.5 um adds is what the lattice takes for itself (0.121, 0.149);
  // the rest of the 12 % is the coarse mesh's.
  const auto numerical = [](const SuspensionResult& r) { return r.power.numerical() * r.viscosity; };
  const double added = runs[4].viscosity - runs[2].viscosity;
  EXPECT_NEAR(numerical(runs[4]) - numerical(runs[2]), added, 0.25 * added);
  EXPECT_GT(runs[0].viscosity - runs[4].viscosity, 0.3 * (runs[0].viscosity - runs[2].viscosity));
}

// Walls 15 um apart, periodic box twice and four times as wide: one packing each of what holds more cells.
TEST(Rheology, ViscosityOverBox) {
  std::printf("| box, µm |%s\n", columns);
  std::vector<double> viscosity;
  for (const double width : {15.0, 21.0, 30.0}) {
    SuspensionCase c;
    c.box = {width, 15, width}, c.strain = 16;
    std::vector<SuspensionResult> runs;
    const int share = std::max(1, static_cast<int>(std::lround(packings() * std::pow(15 / width, 2))));
    for (int seed = 1; seed <= share; ++seed) runs.push_back(test::shear_suspension(c, seed));
    std::printf("| %.0f x 15 x %.0f |", width, width);
    print_row(runs);
    expect_sound(runs);
    viscosity.push_back(test::mean_of(runs, &SuspensionResult::viscosity).value);
  }
  for (const double v : viscosity) EXPECT_NEAR(v / viscosity.back(), 1, 0.1);
}

// How much the coupling's constants matter to a suspension: 15 um, 35 %, one packing. What slips makes up for
// the thickness that the lattice adds, so the viscosity rises with theta and chi, which both hold the surface
// to the fluid: by 1.9 % from the shipped theta to 0.99 (nearly none is left), by 3.2 % from half the shipped
// chi to it. Half as much again is allowed; the kernel matters less (1.3 %).
TEST(Rheology, ViscosityOverTheCoupling) {
  SuspensionCase c;
  c.box = {15, 15, 15}, c.strain = 8;
  const auto cells = pack(test::suspension_scene(c, 1));
  std::printf("| θ | χ | retraction | worst volume |%s\n", columns);
  const data::Coupling shipped;
  const auto run = [&](double theta, double chi) {
    c.coupling.theta_n = c.coupling.theta_t = theta, c.coupling.chi = chi;
    const auto r = test::shear_suspension(c, cells, test::suspension_scene(c, 1));
    std::printf("| %.2f | %.2f | %.2f | %.4f |", theta, chi, c.coupling.retraction, r.volume);
    print_row({r});
    EXPECT_NEAR(r.volume, 1, 0.003);  // 0.1 % is seen; kept by k_v
    return r.viscosity;
  };
  const double reference = run(shipped.theta_n, shipped.chi), tight = run(0.99, shipped.chi);
  EXPECT_GT(tight, reference);
  EXPECT_LT(tight, 1.03 * reference);
  double before = reference;
  for (const double theta : {0.9, 0.8, 0.5}) {
    const double viscosity = run(theta, shipped.chi);
    EXPECT_LT(viscosity, before) << theta;
    before = viscosity;
  }
  const double half = run(shipped.theta_n, 0.5 * shipped.chi),
               three_quarters = run(shipped.theta_n, 0.75 * shipped.chi);
  EXPECT_GT(half, 0.95 * reference);
  EXPECT_GT(three_quarters, half);
  EXPECT_GT(reference, three_quarters);
  std::printf("phi4\n");
  c.coupling = data::Coupling::with(data::Coupling::Kernel::phi4);
  const double wide = run(0.97, c.coupling.chi);
  EXPECT_NEAR(wide / reference, 1, 0.02);
  EXPECT_LT(run(0.9, c.coupling.chi), wide);
}

}  // namespace
}  // namespace hemowalk::resolved
