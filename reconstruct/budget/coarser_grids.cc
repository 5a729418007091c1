#include "luxfield/reconstruct/budget/coarser_grids.h"

#include <Eigen/Dense>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/quadrature.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::reconstruct {
namespace {

using Eigen::MatrixXd;
using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;
using DoubleRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Functions beyond the supports on either side: the solve's response falls by 0.43 from one to the
// next.
constexpr int kBeyond = 2;

// p: of the irradiance from Lambertian lamps with edges, as it is found over them.
double Order(BasisKind kind) { return kind == BasisKind::kBspline2 ? 2 : 1; }

struct CoarserAxis {
  int count = 0;
  int first_spacing = 0;  // where they begin, in spacings of the finer grid from its corner
  MatrixXd resolved;      // the coefficients that a function of the finer grid is seen as
};

CoarserAxis MakeAxis(const Basis& basis, FilterKind filter, int fine, int place) {
  const int cells = (fine + basis.cells - 1 + place + 1) / 2 + 2 * kBeyond;
  CoarserAxis axis;
  axis.count = cells - basis.cells + 1;
  axis.first_spacing = -place - 2 * kBeyond;
  axis.resolved = MatrixXd::Zero(axis.count, fine);
  // In coarser spacings, between the knots of both, which are a half apart, and half of that: a
  // dual filter of two cells changes in the middle of its support.
  constexpr double kPiece = 0.25;
  for (int k = 0; k < axis.count; ++k)
    for (int i = 0; i < fine; ++i) {
      const double start = 0.5 * (i - axis.first_spacing);  // of the finer function
      for (int piece = 0; piece < 2 * basis.cells; ++piece) {
        const double x0 = start + piece * kPiece;
        axis.resolved(k, i) += lightfield::Gauss3(x0, x0 + kPiece, [&](double x) {
          const double seen = filter == FilterKind::kDual
                                  ? basis.DualValue(x - k - 0.5 * basis.cells)
                                  : basis.Value(x - k);
          return seen * basis.Value(2 * (x - start));
        });
      }
    }
  if (filter == FilterKind::kDual) return axis;
  const auto gram =
      GramAxis::Factor(lightfield::GramMatrix(basis, axis.count, 1), axis.count, "a coarser axis");
  axis.resolved =
      Eigen::Map<const DoubleRows>(gram.inverse.data(), axis.count, axis.count) * axis.resolved;
  return axis;
}

LightField Coarser(const LightField& field, FilterKind filter, int place_u, int place_v) {
  const BasisGrid& fine = field.geometry.grid;
  const CoarserAxis u = MakeAxis(fine.basis, filter, fine.width, place_u),
                    v = MakeAxis(fine.basis, filter, fine.height, place_v);
  lightfield::LuminaireGeometry geometry = field.geometry;
  geometry.grid.width = u.count;
  geometry.grid.height = v.count;
  geometry.grid.u0_m += u.first_spacing * fine.spacing_m;
  geometry.grid.v0_m += v.first_spacing * fine.spacing_m;
  geometry.grid.spacing_m *= 2;
  LightField coarser(geometry);
  const std::size_t plane = geometry.plane_size() * geometry.channels;
  core::ParallelFor(plane, 512, [&](std::size_t begin, std::size_t end) {
    MatrixXd c(fine.width, fine.height);
    for (std::size_t k = begin; k < end; ++k) {
      for (int m = 0; m < fine.count(); ++m)
        c(m % fine.width, m / fine.width) = field.data[static_cast<std::size_t>(m) * plane + k];
      const MatrixXd seen = u.resolved * c * v.resolved.transpose();
      for (int m = 0; m < geometry.grid.count(); ++m)
        coarser.data[static_cast<std::size_t>(m) * plane + k] =
            static_cast<float>(seen(m % u.count, m / u.count));
    }
  });
  return coarser;
}

double ValueOf(const std::vector<Term>& terms, const LightField& field) {
  double sum = 0;
  for (const auto& [factor, form] : terms)
    sum += factor * Apply(form.weights(field.geometry), field);
  return sum;
}

}  // namespace

std::vector<std::optional<double>> CoarserGridSigmas(
    const LightField& field, FilterKind filter,
    const std::vector<const std::vector<Term>*>& quantities) {
  std::vector<double> values, squares(quantities.size());
  std::vector<int> places(quantities.size());
  for (const auto* terms : quantities) values.push_back(ValueOf(*terms, field));
  for (const int place_v : {0, 1})
    for (const int place_u : {0, 1}) {
      const LightField coarser = Coarser(field, filter, place_u, place_v);
      for (std::size_t q = 0; q < quantities.size(); ++q) try {
          squares[q] += std::pow(ValueOf(*quantities[q], coarser) - values[q], 2);
          ++places[q];
        } catch (const InputError&) {  // the horizon of a receiver
        }
    }
  const double gain = std::pow(2, Order(field.geometry.grid.basis.kind));
  std::vector<std::optional<double>> sigmas(quantities.size());
  for (std::size_t q = 0; q < quantities.size(); ++q)
    if (places[q] > 0) sigmas[q] = std::sqrt(squares[q] / places[q]) / (gain - 1);
  return sigmas;
}

}  // namespace luxfield::reconstruct
