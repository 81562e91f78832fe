/// Pieces of the estimators against exact results and brute force.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calibration/diffusivity.hpp"
#include "calibration/gate.hpp"
#include "calibration/holdout.hpp"
#include "calibration/local_law.hpp"
#include "calibration/synthetic.hpp"
#include "core/check.hpp"
#include "core/random.hpp"
#include "core/statistics.hpp"

namespace {

using namespace hemowalk;
using namespace hemowalk::calibration;

Ensemble ensemble_of(const Synthetic& s) {
  Options o;
  o.t0 = 0;
  return gather({generate(s)}, o);
}

TEST(Segments, IrregularIntervalsCutTheWindow) {
  Synthetic s;
  s.platelets = 3;
  s.duration = 0.4;
  auto t = generate(s);
  for (std::size_t k = 200; k < t.time.size(); ++k) t.time[k] -= 0.4e-3;
  Options o;
  o.t0 = 0.1;
  const Ensemble e = gather({t}, o);
  ASSERT_EQ(e.runs[0].segments.size(), 2u);
  EXPECT_EQ(e.runs[0].segments[0].begin, 100u);
  EXPECT_EQ(e.runs[0].segments[0].end, 200u);
  EXPECT_EQ(e.runs[0].segments[1].begin, 200u);
  EXPECT_EQ(e.runs[0].segments[1].end, 401u);
}

TEST(Msd, LagSumsEqualBruteForce) {
  Synthetic s;
  s.platelets = 4;
  s.duration = 0.1;
  const Ensemble e = ensemble_of(s);
  const Layer layer{15e-6, 35e-6};
  const LagSums sums = lag_sums(e, layer, 7);
  for (std::size_t p = 0; p < 4; ++p) {
    double n = 0, m2 = 0;
    for (std::size_t i = 0; i + 7 < e.paths[p].y.size(); ++i) {
      if (e.paths[p].y[i] < layer.low || e.paths[p].y[i] > layer.high) continue;
      n += 1;
      m2 += std::pow(e.paths[p].y[i + 7] - e.paths[p].y[i], 2);
    }
    EXPECT_EQ(sums.count[p], n);
    EXPECT_NEAR(sums.second[p], m2, 1e-12 * m2);
  }
}

TEST(Bootstrap, DrawsAreCellCountsAndDoNotDependOnHowManyAreAsked) {
  Synthetic s;
  s.platelets = 20;
  s.duration = 0.1;
  const Ensemble e = ensemble_of(s);
  const Resampling few(e, 5, 3), many(e, 50, 3), other(e, 5, 4);
  int differ = 0;
  for (int b = 0; b < 5; ++b) {
    int sum = 0;
    for (std::size_t n = 0; n < 20; ++n) {
      EXPECT_EQ(few[b][n], many[b][n]);
      sum += few[b][n];
      differ += few[b][n] != other[b][n];
    }
    EXPECT_EQ(sum, 20);
  }
  EXPECT_GT(differ, 0);
}

// Delta method and bootstrap estimate the same error: 2000 draws know it to 1.6 %, the delta method's own
// small-sample term is 1/(2 n) = 1 %; 4 standard errors.
TEST(Bootstrap, AgreesWithTheDeltaMethod) {
  RandomSequence random(1, Stream::test);
  Ratio r;
  for (int n = 0; n < 60; ++n) {
    r.denominator.push_back(50 + 20 * random.uniform());
    r.numerator.push_back(r.denominator.back() * (1 + 0.3 * random.normal()));
  }
  Synthetic s;
  s.platelets = 60;
  s.duration = 0.1;
  const Ensemble e = ensemble_of(s);
  const Estimate x = estimate_ratio("x", e, Resampling(e, 2000, 1), r, 1);
  EXPECT_NEAR(x.sigma / r.sigma(), 1, 0.08);
}

// Three runs whose own values differ by ten times their errors: the error must come from the runs.
TEST(Bootstrap, RunsThatDisagreeWidenTheError) {
  std::vector<data::Trajectories> runs;
  for (double D : {0.5e-10, 1e-10, 1.5e-10}) {
    Synthetic s;
    s.platelets = 50;
    s.D = D;
    s.seed = static_cast<std::uint64_t>(D * 1e11);
    runs.push_back(generate(s));
  }
  Options o;
  const Ensemble e = gather(runs, o);
  const LagSums sums = lag_sums(e, core_layer(runs, e, o), 20);
  const Estimate x = estimate_ratio("x", e, Resampling(e, 300, 1), sums.msd(), 0.5 / sums.lag);
  EXPECT_NEAR(x.sigma_between_runs, 0.5e-10, 0.1e-10);
  EXPECT_NEAR(x.sigma, 0.5e-10 / std::sqrt(3), 0.06e-10);
}

// Overlapping displacements of Brownian motion: the closed double sum against 4000 walks. An element of a
// sample covariance has relative error sqrt((1 + 1/r^2)/n) < 4 %; 4 standard errors.
TEST(Gls, BrownianCovarianceAgainstMonteCarlo) {
  const std::vector<Segment> segments{{0, 60}, {60, 100}};
  const std::vector<int> steps{3, 10, 25};
  const std::vector<double> c = brownian_msd_covariance(segments, steps);
  std::vector<std::vector<double>> msd(3);
  for (int walk = 0; walk < 4000; ++walk) {
    RandomSequence random(7, Stream::test, static_cast<std::uint64_t>(walk));
    std::vector<double> y{0};
    for (int k = 1; k < 100; ++k) y.push_back(y.back() + random.normal());  // 2 D interval = 1
    for (std::size_t a = 0; a < 3; ++a) {
      double sum = 0, n = 0;
      for (const Segment& s : segments)
        for (std::size_t i = s.begin; i + static_cast<std::size_t>(steps[a]) < s.end; ++i) {
          sum += std::pow(y[i + static_cast<std::size_t>(steps[a])] - y[i], 2);
          ++n;
        }
      msd[a].push_back(sum / n);
    }
  }
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) {
      const double ma = mean(msd[a]), mb = mean(msd[b]);
      double cov = 0;
      for (std::size_t k = 0; k < msd[a].size(); ++k) cov += (msd[a][k] - ma) * (msd[b][k] - mb) / 3999;
      EXPECT_NEAR(cov / c[a * 3 + b], 1, 0.16) << a << b;
    }
}

TEST(Slab, MsdSeriesHasTheRightLimitsAndInverse) {
  const double H = 20e-6, D = 1e-10;
  const SlabMsd middle(H, {H / 2}, {1});
  // Far from the walls on the scale of the step: free diffusion (erfc(10/sqrt(4 D t)/2) is below round-off).
  EXPECT_NEAR(middle(D, 10e-3), 2 * D * 10e-3, 1e-9 * 2 * D * 10e-3);
  // Long times: uniform over the slab, mean square distance from the middle H^2/12, from the wall H^2/3.
  EXPECT_NEAR(middle(D, 100), H * H / 12, 1e-12 * H * H);
  EXPECT_NEAR(SlabMsd(H, {0}, {1})(D, 100), H * H / 3, 1e-12 * H * H);
  // From the wall the reflected walk has the MSD of the free one (|y|^2 = y^2).
  EXPECT_NEAR(SlabMsd(H, {0}, {1})(D, 10e-3), 2 * D * 10e-3, 1e-4 * 2 * D * 10e-3);  // 512 terms at the wall
  EXPECT_NEAR(middle.solve(middle(D, 0.3), 0.3), D, 1e-9 * D);
  EXPECT_TRUE(std::isnan(middle.solve(H * H, 0.3)));
}

TEST(Splines, SumToOneAndDifferentiate) {
  const SplineBasis b(1, 9, 7);
  for (double y : {1.0, 1.3, 4.99, 5.0, 8.7, 9.0}) {
    EXPECT_NEAR(b.values(y).sum(), 1, 1e-14);
    EXPECT_NEAR(b.slopes(y).sum(), 0, 1e-14);
  }
  for (double y : {1.3, 4.2, 8.5})
    EXPECT_NEAR((b.slopes(y) - (b.values(y + 1e-5) - b.values(y - 1e-5)) / 2e-5).norm(), 0, 1e-9);
}

LocalLaw wavy_law() {
  LocalLaw law;
  law.walls = {0, 40e-6};
  law.D_scale = 1e-10;
  law.log_D = Eigen::VectorXd(9);
  law.log_pi = Eigen::VectorXd(9);
  for (int k = 0; k < 9; ++k) {
    law.log_D(k) = 0.4 * std::sin(1.0 * k);
    law.log_pi(k) = 0.7 * std::cos(0.8 * k);
  }
  return law;
}

TEST(Propagator, IsAStochasticMatrixInDetailedBalance) {
  const LocalLaw law = wavy_law();
  const Propagator p(law, 50, 20e-3);
  const auto& P = p.matrix();
  std::vector<double> y;
  for (int i = 0; i < 50; ++i) y.push_back((i + 0.5) * 0.8e-6);
  const std::vector<double> pi = law.equilibrium(y);
  for (int i = 0; i < 50; ++i) {
    EXPECT_NEAR(P.row(i).sum(), 1, 1e-12);
    for (int j = 0; j < 50; ++j) {
      EXPECT_GE(P(i, j), -1e-14);
      EXPECT_NEAR(pi[static_cast<std::size_t>(i)] * P(i, j), pi[static_cast<std::size_t>(j)] * P(j, i), 1e-9);
    }
  }
}

TEST(Propagator, DerivativesAgreeWithDifferences) {
  const LocalLaw law = wavy_law();
  const auto exact = Propagator(law, 40, 20e-3).derivatives();
  for (int c : {0, 4, 8, 9, 13, 17}) {
    const auto moved = [&](double by) {
      LocalLaw l = law;
      (c < 9 ? l.log_D(c) : l.log_pi(c - 9)) += by;
      return Propagator(l, 40, 20e-3).matrix();
    };
    const Eigen::MatrixXd difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
    // Central difference: truncation 1e-10, round-off 1e-15/1e-5.
    EXPECT_LT((exact[static_cast<std::size_t>(c)] - difference).cwiseAbs().maxCoeff(), 1e-8) << c;
  }
}

TEST(Propagator, GradientsAgreeWithDifferences) {
  const LocalLaw law = wavy_law();
  const double low = 7e-6, high = 29e-6;
  const Eigen::VectorXd msd = Propagator(law, 40, 20e-3).msd_gradient(low, high),
                        D = law.mean_D_gradient(low, high);
  for (int c = 0; c < 18; ++c) {
    const auto moved = [&](double by) {
      LocalLaw l = law;
      (c < 9 ? l.log_D(c) : l.log_pi(c - 9)) += by;
      return std::pair{Propagator(l, 40, 20e-3).msd(low, high), l.mean_D(low, high)};
    };
    const auto up = moved(1e-5), down = moved(-1e-5);
    // MSD of some 5e-12 m2 and D of 1e-10 m2/s, relative errors as above.
    EXPECT_NEAR(msd(c), (up.first - down.first) / 2e-5, 1e-8 * 5e-12) << c;
    EXPECT_NEAR(D(c), (up.second - down.second) / 2e-5, 1e-8 * 1e-10) << c;
  }
}

TEST(Propagator, MsdOfConstantDIsTheSlabSeries) {
  LocalLaw law;
  law.walls = {0, 20e-6};
  law.D_scale = 1e-10;
  law.log_D = law.log_pi = Eigen::VectorXd::Zero(8);
  std::vector<double> starts, weights;
  for (int k = 0; k < 200; ++k) {
    starts.push_back((k + 0.5) * 0.1e-6);
    weights.push_back(1.0 / 200);
  }
  const double exact = SlabMsd(20e-6, starts, weights)(1e-10, 50e-3);
  // Second order in the width of the cells: halving it divides the error by 4.
  const double e1 = Propagator(law, 20, 50e-3).msd(0, 20e-6) / exact - 1;
  const double e2 = Propagator(law, 40, 50e-3).msd(0, 20e-6) / exact - 1;
  EXPECT_NEAR(e1 / e2, 4, 0.4);
  EXPECT_LT(std::abs(e2), 2e-3);
}

TEST(Memory, FindsWhatIsThereAndNothingElse) {
  Synthetic s;
  s.platelets = 300;
  const Ensemble brownian = ensemble_of(s);
  EXPECT_EQ(fit_memory(brownian, {10e-6, 40e-6}, 80e-3).memory, 0);
  s.memory = 10e-3;
  const Ensemble persistent = ensemble_of(s);
  const MemoryFit m = fit_memory(persistent, {10e-6, 40e-6}, 80e-3);
  EXPECT_NEAR(m.memory, 10e-3, 1e-3);  // 300 s of tracks hold 3e4 memory times: 4 standard errors are 6 %
  EXPECT_NEAR(m.share, 1, 0.1);
  EXPECT_NEAR(m.D, 1e-10, 0.12e-10);
  EXPECT_NEAR(m.factor(20e-3), 1 - 0.5 * (1 - std::exp(-2.0)), 0.05);
}

TEST(Lags, RefusesALagThatDoesNotFit) {
  Synthetic s;
  s.platelets = 5;
  const Ensemble e = ensemble_of(s);
  Options o;
  o.lag = 0.8;
  EXPECT_THROW(choose_lags(e, {10e-6, 40e-6}, o), InputError);
}

// --- gate: silent on clean data, each artefact found
// -------------------------------------------------------------

const data::Finding* find(const data::TransportLaw::Gate& g, const std::string& name) {
  for (const auto& f : g.findings)
    if (f.name == name) return &f;
  return nullptr;
}
data::TransportLaw::Gate gate_of(const data::Trajectories& t) {
  return artefact_gate({t}, gather({t}, Options{}));
}
data::Trajectories clean() {
  Synthetic s;
  s.D = 0.3e-10;  // 1-ms steps of 0.24 um: none comes near the 2 um of a jump
  return generate(s);
}

TEST(Gate, SilentOnCleanData) {
  const auto g = gate_of(clean());
  EXPECT_TRUE(g.passed);
  EXPECT_GE(g.findings.size(), 6u);
  for (const auto& f : g.findings) EXPECT_TRUE(f.passed) << f.name << ' ' << f.value << ' ' << f.note;
}
TEST(Gate, FindsJumps) {
  Synthetic s;
  s.jump_fraction = 0.0035;
  s.jump_size = 3e-6;
  const auto g = gate_of(generate(s));
  EXPECT_FALSE(g.passed);
  EXPECT_FALSE(find(g, "cross_stream_jumps")->passed);
  // Jumps beyond 2 um: 2 (1 - Phi(2/3)) of 0.35 % of the samples.
  EXPECT_NEAR(find(g, "cross_stream_jumps")->value, 0.0035 * 2 * (1 - normal_cdf(2.0 / 3)), 4e-4);
}
TEST(Gate, FindsAVorticityFlow) {
  auto t = clean();
  auto& p = t.kinds["platelet"].position;
  for (std::size_t k = 0; k < t.time.size(); ++k)
    for (std::size_t n = 0; n < 95; ++n) p[(k * 95 + n) * 3] += 0.3e-3 * t.time[k];
  EXPECT_FALSE(find(gate_of(t), "vorticity_velocity_over_wall")->passed);
}
TEST(Gate, FindsAPlug) {
  auto t = clean();
  auto& p = t.kinds["platelet"].position;
  for (std::size_t k = 1; k < t.time.size(); ++k)
    for (std::size_t n = 0; n < 95; ++n) {
      const double y = p[(k * 95 + n) * 3 + 1] / 50e-6, dt = t.time[k] - t.time[k - 1];
      // Half the shear in the core, the rest in the outer tenths.
      const double u = 5e-3 * (y < 0.1 ? 3 * y : y > 0.9 ? 1 - 3 * (1 - y) : 0.3 + 0.5 * (y - 0.1));
      p[(k * 95 + n) * 3 + 2] = p[((k - 1) * 95 + n) * 3 + 2] + u * dt;
    }
  const auto g = gate_of(t);
  EXPECT_FALSE(find(g, "core_shear_over_nominal")->passed);
  EXPECT_NEAR(find(g, "core_shear_over_nominal")->value, 0.5, 0.05);
  EXPECT_TRUE(find(g, "velocity_antisymmetry")->passed);
}
TEST(Gate, FindsBadBookkeepingAndStress) {
  auto t = clean();
  t.diagnostics.time = {0.5};
  t.diagnostics.momentum_residual = {0, 0.02, 0};
  t.diagnostics.volume_error_max = {0.3};
  for (int j = 0; j < 10; ++j) t.profile.y.push_back((j + 0.5) * 5e-6);
  for (double time : {0.4, 0.5, 0.6}) {
    t.profile.time.push_back(time);
    for (double y : t.profile.y) {
      for (double u : {0.0, 0.0, 100 * y}) t.profile.velocity.push_back(u);
      t.profile.shear_stress.push_back(0.1 + 2e3 * y);
    }
  }
  const auto g = gate_of(t);
  EXPECT_FALSE(find(g, "momentum_residual")->passed);
  EXPECT_FALSE(find(g, "volume_drift")->passed);
  EXPECT_FALSE(find(g, "stress_uniformity")->passed);
  EXPECT_TRUE(find(g, "core_shear_over_nominal")->passed);
}
TEST(Gate, UnevenHalvesAreAFaultOnlyIfTheStressIsUneven) {
  // A tenth of the wall speed more in the lower half: u = gamma y + 0.075 U sin^2 gives a spread of 0.15 U.
  for (const double slope : {0.0, 2e3}) {
    auto t = clean();
    for (int j = 0; j < 10; ++j) t.profile.y.push_back((j + 0.5) * 5e-6);
    for (const double time : {0.4, 0.5, 0.6}) {
      t.profile.time.push_back(time);
      for (const double y : t.profile.y) {
        const double wave = std::sin(M_PI * y / 50e-6);
        for (const double u : {0.0, 0.0, 100 * y + 0.075 * 5e-3 * wave * wave})
          t.profile.velocity.push_back(u);
        t.profile.shear_stress.push_back(0.1 + slope * y);
      }
    }
    const auto g = gate_of(t);
    EXPECT_NEAR(find(g, "velocity_antisymmetry")->value, 0.15, 0.01);
    EXPECT_EQ(find(g, "velocity_antisymmetry")->passed, slope == 0);
  }
}
TEST(Gate, FindsCellsAtOneWall) {
  auto t = clean();
  auto& p = t.kinds["platelet"].position;
  for (std::size_t k = 0; k < p.size(); k += 3)
    p[k + 1] = 50e-6 * std::sqrt(p[k + 1] / 50e-6);  // uniform becomes proportional to y
  EXPECT_FALSE(find(gate_of(t), "wall_symmetry")->passed);
}

// --- near the walls
// ---------------------------------------------------------------------------------------------

TEST(Residence, CountsVisitsByHand) {
  Ensemble e;
  e.interval = 1;
  e.walls = {0, 50};
  e.height = 50;
  hemowalk::calibration::Run run;
  Path a, b;
  a.y = {2,  2,  8,  20, 25,
         49, 47, 45, 45, 45};  // near at t0, leaves after 3 s; comes to the top, stays (2+ s ... 4 s)
  b.y = {25, 25, 3, 3, 15, 25, 25, 25, 25, 25};  // one visit of 2 s
  for (int k = 0; k < 10; ++k) run.time.push_back(k);
  run.last = 2;
  e.runs = {run};
  e.paths = {a, b};
  const auto r = residence(e, {10, 40}, 4);
  EXPECT_EQ(r.near_at_t0, 1);
  EXPECT_EQ(r.left_of_t0, 1);
  EXPECT_EQ(r.visits, 3);
  EXPECT_EQ(r.left, 2);
  EXPECT_NEAR(r.mean_time, (3 + 4 + 2) / 2.0, 1e-12);
  EXPECT_EQ(r.arrivals, 2);
  EXPECT_NEAR(r.mean_time_out, (2 + 2 + 5) / 2.0, 1e-12);
}

TEST(Layers, RbcRichLayerEndsAtHalfTheCoreHematocrit) {
  data::Trajectories t = clean();
  for (int j = 0; j < 50; ++j) t.profile.y.push_back((j + 0.5) * 1e-6);
  t.profile.time = {0.1, 0.5};
  for (double time : t.profile.time)
    for (double y : t.profile.y) {
      const double d = std::min(y, 50e-6 - y);
      t.profile.hematocrit.push_back(time < 0.3 ? 1 : std::min(0.4, 0.4 * d / 6e-6));  // half at 3 um
    }
  const Layer l = rbc_rich_layer({t}, 0.3);
  EXPECT_NEAR(l.low, 3e-6, 1e-12);
  EXPECT_NEAR(l.high, 47e-6, 1e-12);
}

}  // namespace
