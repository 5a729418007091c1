// A lamp on F, seen through one texel of I, as a sum of spots: what filters leave open of it.
//
// Prior (compound Poisson, second moments): spots of Gaussian shape, standard deviations evenly
// spread in the logarithm, strengths independent of size, at places c whose strengths have the
// variance a lambda(c). So the lamp x has the covariance
//
//   K = a sum_k p_k T_k diag(lambda) T_k^T,      T_k the spots of size k at all places
//
// and what the filters see, e = X x + noise, the covariance A = X K X^T + N. Normal with these
// moments, the lamp has behind them (Rasmussen and Williams 2006, 2.23 to 2.24) for any linear form
// rho
//
//   mean = rho^T K X^T A^-1 e,      variance = rho^T K rho - rho^T K X^T A^-1 X K rho.
//
// lambda is the square of the lamp's own brightness, deconvolved: it starts as the brightness seen,
// and three times becomes the square of the places' posterior mean. Without that it would reach as
// far as filters and spots smear the lamp, and the variance with it. a is the likeliest,
// e^T A^-1 e / n.
//
// Everything is a product of one matrix per axis but lambda. Double. n filters, N places: n^3 / 3
// and 2 n^2 sqrt(N) multiplications per size, 8 n^2 bytes.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {

// One axis of the filter plane. Lamps are coefficients of `bspline2` functions, `finer` of them a
// spacing, that fill the supports of the grid's.
struct SpotAxis {
  // `smallest` in spacings, at least 1 / finer; sizes go from there to 2, or are that one where it
  // is above.
  SpotAxis(const lightfield::Basis& basis, lightfield::FilterKind filter, int count, int finer,
           double smallest);

  Eigen::MatrixXd seen;                     // what each filter sees of each fine function; exact
  Eigen::MatrixXd basis;                    // basis functions at the middles of the fine ones
  Eigen::MatrixXd resolved;                 // the coefficients that a fine function is seen as
  Eigen::MatrixXd overlap;                  // what each filter sees of each basis function
  std::vector<Eigen::MatrixXd> spots;       // T_k: column c is the spot at place c
  std::vector<Eigen::MatrixXd> seen_spots;  // X T_k
};

struct Moments {
  double mean = 0, variance = 0;
};

class SpotPosterior {
 public:
  // c(i, j) the coefficients of a lamp that is not dark everywhere, noise the variance of what
  // filter ij saw, in spacings (0 is allowed). Both axes must outlive this.
  SpotPosterior(const SpotAxis& u, const SpotAxis& v, const Eigen::MatrixXd& c,
                const Eigen::MatrixXd& noise);

  // Of sum form(a, b) x(a, b), x the lamp's fine coefficients.
  Moments Of(const Eigen::MatrixXd& form) const;

 private:
  Eigen::MatrixXd SeenCovariance() const;  // X K X^T / a, column i * H + j
  void Solve();                            // solver_ and weighted_, for the places' present lambda
  Eigen::MatrixXd Strengths(std::size_t size) const;  // posterior mean of places' spots, over a

  const SpotAxis *u_, *v_;
  Eigen::MatrixXd e_, noise_, places_;
  Eigen::LLT<Eigen::MatrixXd> solver_;
  Eigen::MatrixXd weighted_;  // A^-1 e
  Eigen::MatrixXd mean_;
  double amplitude_ = 0;
};

}  // namespace luxfield::reconstruct
