#include "calibration/local_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"

namespace hemowalk::calibration {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// Observed heights are known by cell only: uniform inside the first and the last cell adds h^2/6 to the
/// variance of a displacement (Sheppard). This stencil adds the same to the propagator.
Matrix observed(const Matrix& P) {
  const Eigen::Index n = P.cols();
  Matrix out = (5.0 / 6) * P;
  out.middleCols(1, n - 1) += P.leftCols(n - 1) / 12;
  out.middleCols(0, n - 1) += P.rightCols(n - 1) / 12;
  out.col(0) += P.col(0) / 12;
  out.col(n - 1) += P.col(n - 1) / 12;
  return out;
}

constexpr double least_probability =
    1e-12;  // round-off of the exponential; also bounds what one wild jump can do
constexpr double smooth_D = 0.5, smooth_pi = 1;  // prior sigma of second differences of the coefficients
constexpr double loose_pi = 30;                  // prior sigma of ln pi itself: its level is not observable

/// Second-difference penalty (precision matrix) of the smoothness prior.
Matrix penalty(int nD, int npi) {
  Matrix h = Matrix::Zero(nD + npi, nD + npi);
  const auto add = [&](int first, int n, double sigma) {
    for (int k = first; k + 2 < first + n; ++k) {
      const double d[3] = {1, -2, 1};
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) h(k + a, k + b) += d[a] * d[b] / (sigma * sigma);
    }
  };
  add(0, nD, smooth_D);
  add(nD, npi, smooth_pi);
  for (int k = nD; k < nD + npi; ++k) h(k, k) += 1 / (loose_pi * loose_pi);
  return h;
}

LocalLaw with_coefficients(LocalLaw law, const Vector& t) {
  const Eigen::Index nD = law.log_D.size();
  law.log_D = t.head(nD);
  law.log_pi = t.tail(t.size() - nD);
  return law;
}

/// Cell of the grid at every start and end of a displacement, per path.
struct Transitions {
  std::vector<std::vector<std::int32_t>> pair;  ///< [path] from * cells + to
  Matrix count;                                 ///< [from][to], all used paths
};
Transitions count_transitions(const Ensemble& e, int steps, int cells, const std::vector<char>& use) {
  Transitions t;
  t.pair.resize(e.paths.size());
  t.count = Matrix::Zero(cells, cells);
  const double h = (e.walls[1] - e.walls[0]) / cells;
  const auto cell = [&](double y) {
    return std::clamp(static_cast<int>((y - e.walls[0]) / h), 0, cells - 1);
  };
  const auto k = static_cast<std::size_t>(steps);
  for (std::size_t p = 0; p < e.paths.size(); ++p) {
    if (!use.empty() && !use[p]) continue;
    for (const Segment& s : e.run_of(e.paths[p]).segments)
      for (std::size_t i = s.begin; i + k < s.end; ++i) {
        const int a = cell(e.paths[p].y[i]), b = cell(e.paths[p].y[i + k]);
        t.pair[p].push_back(a * cells + b);
        t.count(a, b) += 1;
      }
  }
  return t;
}

double log_likelihood(const Matrix& count, const Matrix& P) {
  const Matrix q = observed(P);
  double sum = 0;
  for (Eigen::Index j = 0; j < q.cols(); ++j)
    for (Eigen::Index i = 0; i < q.rows(); ++i)
      if (count(i, j) > 0) sum += count(i, j) * std::log(std::max(q(i, j), least_probability));
  return sum;
}

/// d ln P_observed / d coefficient, zero where the floor acts.
std::vector<Matrix> score_matrices(const Propagator& propagator) {
  const Matrix q = observed(propagator.matrix());
  std::vector<Matrix> s = propagator.derivatives();
  for (Matrix& m : s)
    m = (q.array() > least_probability).select(observed(m).array() / q.array().max(least_probability), 0);
  return s;
}

/// Gradient and Fisher information of the counted transitions.
void score_and_information(const std::vector<Matrix>& score, const Matrix& count, const Matrix& q,
                           Vector& gradient, Matrix& information) {
  const auto n = static_cast<Eigen::Index>(score.size());
  const Vector from = count.rowwise().sum();
  const Matrix expected = from.asDiagonal() * q;
  gradient.resize(n);
  information.resize(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const Matrix weighted = expected.cwiseProduct(score[static_cast<std::size_t>(a)]);
    gradient(a) = count.cwiseProduct(score[static_cast<std::size_t>(a)]).sum();
    for (Eigen::Index b = a; b < n; ++b)
      information(a, b) = weighted.cwiseProduct(score[static_cast<std::size_t>(b)]).sum();
  }
  information.triangularView<Eigen::StrictlyLower>() = information.transpose();
}

}  // namespace

SplineBasis::SplineBasis(double low, double high, int size)
    : low_(low), spacing_((high - low) / (size - 3)), size_(size) {}

Vector SplineBasis::values(double y) const {
  Vector v = Vector::Zero(size_);
  const double u = std::clamp((y - low_) / spacing_, 0.0, static_cast<double>(size_ - 3));
  const int k = std::min(static_cast<int>(u), size_ - 4);
  const double t = u - k, s = 1 - t;
  v(k) = s * s * s / 6;
  v(k + 1) = (3 * t * t * t - 6 * t * t + 4) / 6;
  v(k + 2) = (3 * s * s * s - 6 * s * s + 4) / 6;
  v(k + 3) = t * t * t / 6;
  return v;
}

Vector SplineBasis::slopes(double y) const {
  Vector v = Vector::Zero(size_);
  const double u = std::clamp((y - low_) / spacing_, 0.0, static_cast<double>(size_ - 3));
  const int k = std::min(static_cast<int>(u), size_ - 4);
  const double t = u - k, s = 1 - t;
  v(k) = -s * s / 2;
  v(k + 1) = (3 * t * t - 4 * t) / 2;
  v(k + 2) = (4 * s - 3 * s * s) / 2;
  v(k + 3) = t * t / 2;
  return v / spacing_;
}

double LocalLaw::D(double y) const {
  return D_scale *
         std::exp(SplineBasis(walls[0], walls[1], static_cast<int>(log_D.size())).values(y).dot(log_D));
}
double LocalLaw::v(double y) const {
  return D(y) * SplineBasis(walls[0], walls[1], static_cast<int>(log_pi.size())).slopes(y).dot(log_pi);
}
double LocalLaw::mean_D(double low, double high) const {
  constexpr int n = 128;
  double sum = 0;
  for (int k = 0; k < n; ++k) sum += D(low + (high - low) * (k + 0.5) / n);
  return sum / n;
}

Vector LocalLaw::coefficients() const {
  Vector t(parameters());
  t << log_D, log_pi;
  return t;
}

Vector LocalLaw::mean_D_gradient(double low, double high) const {
  constexpr int n = 128;
  const SplineBasis basis(walls[0], walls[1], static_cast<int>(log_D.size()));
  Vector sum = Vector::Zero(parameters());
  for (int k = 0; k < n; ++k) {
    const double y = low + (high - low) * (k + 0.5) / n;
    sum.head(log_D.size()) += D(y) / n * basis.values(y);
  }
  return sum;
}

std::vector<double> LocalLaw::equilibrium(const std::vector<double>& y) const {
  const SplineBasis basis(walls[0], walls[1], static_cast<int>(log_pi.size()));
  std::vector<double> p;
  double sum = 0;
  for (double height : y) {
    p.push_back(std::exp(basis.values(height).dot(log_pi)));
    sum += p.back();
  }
  for (double& v : p) v *= static_cast<double>(y.size()) / (sum * (walls[1] - walls[0]));
  return p;
}

Propagator::Propagator(const LocalLaw& law, int cells, double lag)
    : law_(law), lag_(lag), width_((law.walls[1] - law.walls[0]) / cells) {
  const SplineBasis of_D(law.walls[0], law.walls[1], static_cast<int>(law.log_D.size()));
  const SplineBasis of_pi(law.walls[0], law.walls[1], static_cast<int>(law.log_pi.size()));
  face_basis_.resize(cells - 1, of_D.size());
  cell_basis_.resize(cells, of_pi.size());
  for (int i = 0; i + 1 < cells; ++i) face_basis_.row(i) = of_D.values(law.walls[0] + (i + 1) * width_);
  for (int i = 0; i < cells; ++i) cell_basis_.row(i) = of_pi.values(law.walls[0] + (i + 0.5) * width_);
  rate_ = law.D_scale / (width_ * width_) * (face_basis_ * law.log_D).array().exp();
  const Vector log_pi = cell_basis_ * law.log_pi;
  root_pi_ = ((log_pi.array() - log_pi.maxCoeff()) / 2).exp();
  Vector diagonal = Vector::Zero(cells);
  for (int i = 0; i + 1 < cells; ++i) {
    diagonal(i) -= rate_(i) * root_pi_(i + 1) / root_pi_(i);
    diagonal(i + 1) -= rate_(i) * root_pi_(i) / root_pi_(i + 1);
  }
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
  solver.computeFromTridiagonal(diagonal, rate_);
  value_ = solver.eigenvalues().cwiseMin(0);
  vectors_ = solver.eigenvectors();
  symmetric_ = vectors_ * (value_ * lag).array().exp().matrix().asDiagonal() * vectors_.transpose();
  P_ = root_pi_.cwiseInverse().asDiagonal() * symmetric_ * root_pi_.asDiagonal();
}

Matrix Propagator::divided_differences() const {
  // Of exp: the derivative of a matrix exponential in the eigenbasis (Daleckii and Krein).
  const Eigen::Index n = P_.rows();
  Matrix difference(n, n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b) {
      const double x = (value_(a) - value_(b)) * lag_;
      const double ratio = std::abs(x) < 1e-6 ? 1 + x / 2 : std::expm1(x) / x;
      difference(a, b) = lag_ * std::exp(value_(b) * lag_) * ratio;
    }
  return difference;
}

Propagator::GeneratorDerivative Propagator::generator_derivative(Eigen::Index c) const {
  const Eigen::Index n = P_.rows(), nD = face_basis_.cols();
  GeneratorDerivative d{Vector::Zero(n), Vector::Zero(n - 1), Vector::Zero(n)};
  if (c >= nD) d.log_pi = cell_basis_.col(c - nD);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const double up = rate_(i) * root_pi_(i + 1) / root_pi_(i),
                 down = rate_(i) * root_pi_(i) / root_pi_(i + 1);
    if (c < nD) {
      d.off(i) = rate_(i) * face_basis_(i, c);
      d.diagonal(i) -= up * face_basis_(i, c);
      d.diagonal(i + 1) -= down * face_basis_(i, c);
    } else {
      const double tilt = (d.log_pi(i + 1) - d.log_pi(i)) / 2;
      d.diagonal(i) -= up * tilt;
      d.diagonal(i + 1) += down * tilt;
    }
  }
  return d;
}

std::vector<Matrix> Propagator::derivatives() const {
  const Eigen::Index n = P_.rows(), nD = face_basis_.cols(), all_of_them = nD + cell_basis_.cols();
  const Matrix difference = divided_differences();
  std::vector<Matrix> all(static_cast<std::size_t>(all_of_them));
  for (Eigen::Index c = 0; c < all_of_them; ++c) {
    const GeneratorDerivative g = generator_derivative(c);
    Matrix dH_V = g.diagonal.asDiagonal() * vectors_;
    dH_V.topRows(n - 1) += g.off.asDiagonal() * vectors_.bottomRows(n - 1);
    dH_V.bottomRows(n - 1) += g.off.asDiagonal() * vectors_.topRows(n - 1);
    const Matrix inner = (vectors_.transpose() * dH_V).cwiseProduct(difference);
    Matrix d = vectors_ * inner * vectors_.transpose();
    d = root_pi_.cwiseInverse().asDiagonal() * d * root_pi_.asDiagonal();
    if (c >= nD) d += 0.5 * (P_ * g.log_pi.asDiagonal()) - 0.5 * (g.log_pi.asDiagonal() * P_);
    all[static_cast<std::size_t>(c)] = std::move(d);
  }
  return all;
}

Matrix Propagator::msd_weights(double low, double high) const {
  const Eigen::Index n = P_.rows();
  Matrix w(n, n);
  double total = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double a = law_.walls[0] + static_cast<double>(i) * width_, b = a + width_;
    const double inside = std::max(0.0, std::min(b, high) - std::max(a, low));
    total += inside;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double d = static_cast<double>(j - i) * width_;
      w(i, j) = inside * d * d;
    }
  }
  return w / total;
}

double Propagator::msd(double low, double high) const {
  return msd_weights(low, high).cwiseProduct(P_).sum();
}

Vector Propagator::msd_gradient(double low, double high) const {
  // Backwards through the exponential: sum of weights x dP = sum of M x dH, M computed once.
  const Eigen::Index n = P_.rows(), nD = face_basis_.cols(), all = nD + cell_basis_.cols();
  const Matrix w = msd_weights(low, high);
  const Matrix A = root_pi_.cwiseInverse().asDiagonal() * w * root_pi_.asDiagonal();
  const Matrix B = (vectors_.transpose() * A * vectors_).cwiseProduct(divided_differences());
  const Matrix M = vectors_ * B * vectors_.transpose();
  const Matrix flow = w.cwiseProduct(P_);
  const Vector scale = (flow.colwise().sum().transpose() - flow.rowwise().sum()) / 2;
  Vector gradient(all);
  for (Eigen::Index c = 0; c < all; ++c) {
    const GeneratorDerivative g = generator_derivative(c);
    gradient(c) = M.diagonal().dot(g.diagonal) + scale.dot(g.log_pi);
    for (Eigen::Index i = 0; i + 1 < n; ++i) gradient(c) += g.off(i) * (M(i, i + 1) + M(i + 1, i));
  }
  return gradient;
}

LocalFit fit_local_law(const Ensemble& e, double lag, const Resampling& resampling, int draws,
                       const std::vector<char>& use) {
  const int steps = e.steps(lag);
  LocalFit fit;
  fit.lag = steps * e.interval;
  const double gap = e.walls[1] - e.walls[0];
  double squares = 0, pairs = 0;
  for (std::size_t p = 0; p < e.paths.size(); ++p)
    if (use.empty() || use[p])
      for (const Segment& s : e.run_of(e.paths[p]).segments)
        for (std::size_t i = s.begin; i + static_cast<std::size_t>(steps) < s.end; ++i) {
          const double d = e.paths[p].y[i + static_cast<std::size_t>(steps)] - e.paths[p].y[i];
          squares += d * d;
          ++pairs;
        }
  require(pairs > 0 && squares > 0,
          "no displacements at the lag of the local law (window too short, or cells that "
          "do not move) run longer or shorten the lag");
  // A quarter of a typical displacement per cell; splines every 4 um or an eighth of the gap.
  fit.cells = std::clamp(static_cast<int>(std::lround(4 * gap / std::sqrt(squares / pairs))), 32, 128);
  const int knots = std::clamp(static_cast<int>(std::lround(gap / 4e-6)), 8, 24) + 3;

  LocalLaw law;
  law.walls = e.walls;
  law.D_scale = squares / pairs / (2 * fit.lag);
  law.log_D = Vector::Zero(knots);
  law.log_pi = Vector::Zero(knots);
  const Transitions transitions = count_transitions(e, steps, fit.cells, use);
  const Matrix count = transitions.count / steps, prior = penalty(knots, knots);
  const auto objective = [&](const LocalLaw& l) {
    const Vector t = l.coefficients();
    return log_likelihood(count, Propagator(l, fit.cells, fit.lag).matrix()) - 0.5 * t.dot(prior * t);
  };

  Vector gradient;
  Matrix information;
  std::vector<Matrix> score;
  double best = objective(law);
  for (fit.iterations = 0; fit.iterations < 30; ++fit.iterations) {
    const Propagator propagator(law, fit.cells, fit.lag);
    score = score_matrices(propagator);
    score_and_information(score, count, observed(propagator.matrix()), gradient, information);
    const Vector t = law.coefficients(), slope = gradient - prior * t;
    const Vector step = (information + prior).ldlt().solve(slope);
    if (slope.dot(step) < 1e-4) break;  // expected gain in log-likelihood, far below one standard error (1/2)
    double reach = 1;
    LocalLaw next = law;
    double value = best;
    for (; reach > 1e-3; reach /= 2) {
      next = with_coefficients(law, t + reach * step);
      value = objective(next);
      if (std::isfinite(value) && value > best) break;
    }
    if (!(value > best)) break;
    law = next;
    best = value;
  }
  fit.law = law;
  fit.log_likelihood = log_likelihood(count, Propagator(law, fit.cells, fit.lag).matrix());

  // Scores of whole platelets, for the sandwich and the one-step bootstrap.
  const auto n = static_cast<Eigen::Index>(score.size());
  Matrix per_path = Matrix::Zero(n, static_cast<Eigen::Index>(e.paths.size()));
  for (Eigen::Index a = 0; a < n; ++a) {
    const Matrix by_row =
        score[static_cast<std::size_t>(a)].transpose();  // column-major: data() runs from * cells + to
    for (std::size_t p = 0; p < e.paths.size(); ++p) {
      double sum = 0;
      for (std::int32_t k : transitions.pair[p]) sum += by_row.data()[k];
      per_path(a, static_cast<Eigen::Index>(p)) = sum / steps;
    }
  }
  const Matrix inverse = (information + prior).ldlt().solve(Matrix::Identity(n, n));
  const Matrix reaction = inverse * per_path;  // change of the coefficients if a platelet is drawn once more
  const Vector mean_reaction = reaction.rowwise().mean();
  const Matrix centred = reaction.colwise() - mean_reaction;
  fit.covariance = centred * centred.transpose();
  const Vector t = law.coefficients();
  for (int b = 0; b < std::min(draws, resampling.draws()); ++b) {
    Vector move = Vector::Zero(n);
    for (std::size_t p = 0; p < e.paths.size(); ++p)
      move += (static_cast<double>(resampling[b][p]) - 1) * reaction.col(static_cast<Eigen::Index>(p));
    fit.draws.push_back(with_coefficients(law, t + move));
  }
  return fit;
}

}  // namespace hemowalk::calibration
