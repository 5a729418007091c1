#include "luxfield/preprocess/intensity_table.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/parallel.h"
#include "luxfield/preprocess/summed_area.h"

namespace luxfield::preprocess {
namespace {

struct Interval {
  double low, high;
};

float RoundedUp(double x) { return static_cast<float>(x * (1 + 1e-6)); }

struct TexelRange {
  int begin = 0, end = 0;
};

// Bins of one axis that an interval of tangents meets, and the share of it in each.
struct Spread {
  int first = 0;
  std::vector<double> shares;
};

// Tangents along one axis.
struct TangentAxis {
  double low, bin;
  int bins;

  Spread Nothing(Interval tangents) const {
    Spread spread;
    spread.first = BinOf(tangents.low);
    spread.shares.assign(BinOf(tangents.high) - spread.first + 1, 0.0);
    return spread;
  }
  // Adds `share`, evenly over tangents that lie in those of `spread`.
  void Add(Interval tangents, double share, Spread& spread) const {
    const double from = (tangents.low - low) / bin, to = (tangents.high - low) / bin;
    for (int k = BinOf(tangents.low); k <= BinOf(tangents.high); ++k)
      spread.shares[k - spread.first] +=
          share * std::max(std::min(to, k + 1.0) - std::max(from, double{1} * k), 0.0) /
          (to - from);
  }

 private:
  int BinOf(double tangent) const {
    return std::clamp(static_cast<int>(std::floor((tangent - low) / bin)), 0, bins - 1);
  }
};

constexpr int kPiecesOfCell = 4;

// A part of a basis function's support, as the function of a cell divides it, and its share of the
// integral.
struct Piece {
  Interval at;  // from the support's lower end
  double share;
};

std::vector<Piece> PiecesOf(const lightfield::Basis& basis, double spacing) {
  const int count = basis.cells * kPiecesOfCell;
  std::vector<Piece> pieces;
  for (int k = 0; k < count; ++k) {
    const double from = double{1} * k / kPiecesOfCell, to = (k + 1.0) / kPiecesOfCell;
    pieces.push_back(
        {{from * spacing, to * spacing}, basis.Integral(from, to) / basis.TotalIntegral()});
  }
  return pieces;
}

// One axis of the planes: where supports and texels lie, texels by rising coordinate or falling.
struct PlaneAxis {
  double support_low, spacing, support_size;
  int images;
  double texel_0, texel_step;  // edge 0, signed
  int texels;
  double delta;

  Interval Support(int image) const {
    const double low = support_low + image * spacing;
    return {low, low + support_size};
  }
  Interval Texel(int texel) const {
    const double a = texel_0 + texel * texel_step, b = a + texel_step;
    return {std::min(a, b), std::max(a, b)};
  }
  Interval Tangents(Interval support, Interval texel) const {
    return {(texel.low - support.high) / delta, (texel.high - support.low) / delta};
  }
  TangentAxis Range() const {
    const double end = texel_0 + texels * texel_step;
    const Interval all = Tangents({support_low, Support(images - 1).high},
                                  {std::min(texel_0, end), std::max(texel_0, end)});
    const int bins = std::clamp(texels, 1, IntensityTable::kMostBins);
    return {all.low, (all.high - all.low) / bins, bins};
  }
  // Texels that are seen through an image's support under tangents of a bin or its neighbours.
  std::vector<TexelRange> TexelsOf(int image, const TangentAxis& range) const {
    std::vector<TexelRange> of_bin(range.bins, {texels, 0});
    for (int k = 0; k < texels; ++k) {
      const Interval tangents = Tangents(Support(image), Texel(k));
      const int first = static_cast<int>(std::floor((tangents.low - range.low) / range.bin)) - 2,
                last = static_cast<int>(std::floor((tangents.high - range.low) / range.bin)) + 2;
      for (int bin = std::max(first, 0); bin <= std::min(last, range.bins - 1); ++bin)
        of_bin[bin] = {std::min(of_bin[bin].begin, k), k + 1};
    }
    return of_bin;
  }
  // How texels spread their light: over what is seen of each through every piece of the support.
  std::vector<Spread> SpreadsOf(int image, const std::vector<Piece>& pieces,
                                const TangentAxis& range) const {
    std::vector<Spread> spreads;
    const Interval support = Support(image);
    for (int k = 0; k < texels; ++k) {
      Spread spread = range.Nothing(Tangents(support, Texel(k)));
      for (const Piece& piece : pieces)
        range.Add(Tangents({support.low + piece.at.low, support.low + piece.at.high}, Texel(k)),
                  piece.share, spread);
      spreads.push_back(spread);
    }
    return spreads;
  }
};

// Adds the light of an image to the bins.
void AddImage(const std::vector<float>& magnitude, const std::vector<Spread>& columns,
              const std::vector<Spread>& rows, double scale, int bin_columns,
              std::vector<double>& bins) {
  std::vector<double> of_row(bin_columns);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::fill(of_row.begin(), of_row.end(), 0.0);
    const float* texel = magnitude.data() + row * columns.size();
    for (std::size_t column = 0; column < columns.size(); ++column) {
      const Spread& spread = columns[column];
      for (std::size_t k = 0; k < spread.shares.size(); ++k)
        of_row[spread.first + k] += scale * texel[column] * spread.shares[k];
    }
    for (std::size_t k = 0; k < rows[row].shares.size(); ++k) {
      double* bin = bins.data() + (rows[row].first + k) * bin_columns;
      for (int column = 0; column < bin_columns; ++column)
        bin[column] += rows[row].shares[k] * of_row[column];
    }
  }
}

// Adds scale times the largest magnitude over each bin's texels.
void AddLargest(const std::vector<float>& magnitude, const std::vector<TexelRange>& columns,
                const std::vector<TexelRange>& rows, std::size_t width, double scale,
                std::vector<double>& bounds) {
  std::vector<float> of_rows(magnitude.size() / width * columns.size(), 0.0f);
  for (std::size_t row = 0; row < magnitude.size() / width; ++row)
    for (std::size_t bin = 0; bin < columns.size(); ++bin)
      for (int k = columns[bin].begin; k < columns[bin].end; ++k)
        of_rows[row * columns.size() + bin] =
            std::max(of_rows[row * columns.size() + bin], magnitude[row * width + k]);
  for (std::size_t row_bin = 0; row_bin < rows.size(); ++row_bin)
    for (std::size_t bin = 0; bin < columns.size(); ++bin) {
      float largest = 0;
      for (int row = rows[row_bin].begin; row < rows[row_bin].end; ++row)
        largest = std::max(largest, of_rows[row * columns.size() + bin]);
      bounds[row_bin * columns.size() + bin] += scale * largest;
    }
}

}  // namespace

double IntensityTable::BinFlux(int row, int column) const {
  const double* upper = sums.data() + static_cast<std::size_t>(row) * (columns + 1) + column;
  const double* lower = upper + columns + 1;
  return (lower[1] - lower[0]) - (upper[1] - upper[0]);
}

IntensityTable BuildIntensityTable(const lightfield::LightField& field, const std::string& name) {
  const auto& g = field.geometry;
  const auto& grid = g.grid;
  const auto& lattice = g.lattice;
  const double support = grid.basis.cells * grid.spacing_m;
  const PlaneAxis x{grid.u0_m,    grid.spacing_m, support,       grid.width,
                    lattice.s0_m, lattice.ds_m,   lattice.width, g.delta_m};
  const PlaneAxis y{grid.v0_m,    grid.spacing_m, support,        grid.height,
                    lattice.t1_m, -lattice.dt_m,  lattice.height, g.delta_m};
  const TangentAxis range_x = x.Range(), range_y = y.Range();
  // Flux of a texel of |C| = 1.
  const double basis_area = grid.basis.TotalIntegral() * grid.spacing_m,
               scale = basis_area * basis_area * lattice.texel_area_m2();
  const std::vector<Piece> pieces = PiecesOf(grid.basis, grid.spacing_m);
  const std::size_t bin_count = static_cast<std::size_t>(range_x.bins) * range_y.bins;
  struct OfImage {
    std::vector<double> bins, bounds;
    double largest = 0;
  };
  std::vector<OfImage> of_image(grid.count());
  const double bound_scale = basis_area * basis_area * g.delta_m * g.delta_m;
  core::ParallelFor(of_image.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> magnitude(g.plane_size());
    for (std::size_t m = begin; m < end; ++m) {
      const int image = static_cast<int>(m), i = image % grid.width, j = image / grid.width;
      OfImage& one = of_image[m];
      one.bins.assign(bin_count, 0.0);
      one.bounds.assign(bin_count, 0.0);
      if (!(MagnitudeSum(field, name, image, magnitude) > 0)) continue;
      AddImage(magnitude, x.SpreadsOf(i, pieces, range_x), y.SpreadsOf(j, pieces, range_y), scale,
               range_x.bins, one.bins);
      AddLargest(magnitude, x.TexelsOf(i, range_x), y.TexelsOf(j, range_y),
                 static_cast<std::size_t>(lattice.width), bound_scale, one.bounds);
      one.largest = bound_scale * *std::max_element(magnitude.begin(), magnitude.end());
    }
  });
  IntensityTable table;
  table.columns = range_x.bins;
  table.rows = range_y.bins;
  table.low = {range_x.low, range_y.low};
  table.bin = {range_x.bin, range_y.bin};
  const std::size_t stride = table.columns + 1;
  table.sums.assign(stride * (table.rows + 1), 0.0);
  for (int row = 0; row < table.rows; ++row) {
    double prefix = 0;
    for (int column = 0; column < table.columns; ++column) {
      const std::size_t bin = static_cast<std::size_t>(row) * table.columns + column;
      double bound = 0;
      for (const OfImage& one : of_image) {
        prefix += one.bins[bin];
        bound += one.bounds[bin];
      }
      table.bounds.push_back(RoundedUp(bound));
      table.sums[(row + 1) * stride + column + 1] = table.sums[row * stride + column + 1] + prefix;
    }
  }
  double largest = 0;
  for (const OfImage& one : of_image) largest += one.largest;
  table.largest_bound = RoundedUp(largest);
  return table;
}

}  // namespace luxfield::preprocess
