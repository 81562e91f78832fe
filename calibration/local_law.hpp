#pragma once
/// \file D(y) and v(y) as smooth functions, fitted through the walker's own propagator.
///
/// The walk between the walls is a diffusion with zero flux at both: in equilibrium c(y) = pi(y), and J = v c
/// - D c' = 0 everywhere means v = D (ln pi)'. So the pair (ln D, ln pi), both smooth, is every drift that a
/// closed slab can have, and the fit needs no separate constraint. On cells of width h the generator has the
/// rates D/h^2 sqrt(pi_next/pi_here) (Bicout and Szabo 1998; Hummer 2005), which is detailed balance by
/// construction; the propagator over a lag is its exponential, walls included, so nothing is biased within
/// sqrt(2 D lag) of them.

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "calibration/resampling.hpp"
#include "calibration/tracks.hpp"

namespace hemowalk::calibration {

/// A cubic B-spline basis on uniform knots over [low, high].
class SplineBasis {
 public:
  SplineBasis(double low, double high, int size);
  int size() const { return size_; }
  /// Row of basis values at y, and of their derivatives.
  Eigen::VectorXd values(double y) const;
  Eigen::VectorXd slopes(double y) const;

 private:
  double low_, spacing_;
  int size_;
};

/// Coefficients of ln(D/D_scale) and ln pi.
struct LocalLaw {
  std::array<double, 2> walls{};
  double D_scale = 1;  ///< m2/s
  Eigen::VectorXd log_D, log_pi;

  int parameters() const { return static_cast<int>(log_D.size() + log_pi.size()); }
  double D(double y) const;
  double v(double y) const;  ///< D (ln pi)', without D', m/s
  double mean_D(double low, double high) const;
  Eigen::VectorXd coefficients() const;  ///< log_D, then log_pi
  /// d mean_D / d coefficients, m2/s.
  Eigen::VectorXd mean_D_gradient(double low, double high) const;
  /// Equilibrium density pi at the given heights (uniform grid over the gap), 1/m.
  std::vector<double> equilibrium(const std::vector<double>& y) const;
};

/// The propagator on cells: P(i, j) = probability to be in cell j after the lag, from cell i.
class Propagator {
 public:
  Propagator(const LocalLaw& law, int cells, double lag);
  const Eigen::MatrixXd& matrix() const { return P_; }
  int cells() const { return static_cast<int>(P_.rows()); }
  /// Derivatives of the matrix with respect to every coefficient (log_D first).
  std::vector<Eigen::MatrixXd> derivatives() const;
  /// Mean-squared displacement from starts spread evenly over the layer [low, high], m2.
  double msd(double low, double high) const;
  /// d msd / d coefficients, m2.
  Eigen::VectorXd msd_gradient(double low, double high) const;

 private:
  /// Derivative of the symmetric generator (diagonal, off-diagonal) and of ln pi by one coefficient.
  struct GeneratorDerivative {
    Eigen::VectorXd diagonal, off, log_pi;
  };
  GeneratorDerivative generator_derivative(Eigen::Index coefficient) const;
  Eigen::MatrixXd divided_differences() const;
  Eigen::MatrixXd msd_weights(double low, double high) const;  ///< msd = sum of these times P

  LocalLaw law_;
  double lag_, width_;
  Eigen::VectorXd rate_, value_;  // face rates D/h^2; eigenvalues of the symmetric generator
  Eigen::VectorXd root_pi_;
  Eigen::MatrixXd vectors_, symmetric_, P_;
  Eigen::MatrixXd face_basis_, cell_basis_;  // [face][coefficient of ln D], [cell][coefficient of ln pi]
};

struct LocalFit {
  LocalLaw law;
  double lag = 0;  ///< s
  int cells = 0, iterations = 0;
  double log_likelihood = 0;    ///< per independent displacement count
  Eigen::MatrixXd covariance;   ///< of the coefficients, sandwich over cells
  std::vector<LocalLaw> draws;  ///< one-step bootstrap, one per draw asked
};

/// Penalised maximum likelihood with Fisher scoring. Overlapping displacements share the weight 1/steps; the
/// errors come from the scores of whole platelets (one-step bootstrap and sandwich), so overlap and memory
/// are in them. \p use: cells to use (empty = all). Cost: about 30 ms per iteration at 90 grid cells, 5-10
/// iterations.
LocalFit fit_local_law(const Ensemble& ensemble, double lag, const Resampling& resampling, int draws,
                       const std::vector<char>& use = {});

}  // namespace hemowalk::calibration
