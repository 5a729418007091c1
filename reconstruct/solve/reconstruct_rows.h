// Rows of the image plane solved apart: to the bit the rows of the solution of all.
//
// A texel's coefficients follow from its own measurements and from what is found once of all of them.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/edge_light_sums.h"
#include "luxfield/reconstruct/solve/coefficient_sums.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {

// What the solution of some rows takes from all of them.
struct WholeFigures {
  std::optional<lightfield::EdgeLight> edges;  // absent: dual filters
  // Root mean square of sigma over the known texels of every position of all measurements; empty
  // where the ideal filters at their places need none.
  std::vector<double> position_noise;
};
WholeFigures FindWholeFigures(std::span<const lightfield::Measurements> measurements,
                              const ReconstructOptions& options = {});

// The same of measurements that come in bands of rows, from the top: to the bit that of all rows,
// whatever the bands.
class WholeFigureSums {
 public:
  explicit WholeFigureSums(const ReconstructOptions& options) : options_(options) {}
  void Add(std::span<const lightfield::Measurements> rows);
  WholeFigures Find() const;

 private:
  struct Noise {
    double squares = 0, count = 0;
  };

  ReconstructOptions options_;
  std::optional<lightfield::EdgeLightSums> edges_;
  std::vector<Noise> noise_;  // of each position of all measurements
};

struct RowsSolution {
  // `report` is of these rows; the sigma of texels of which nothing is known follows from these rows
  // alone, and is to be put in again by FillUnknown (unknown_texels.h) when all are there.
  Reconstruction rows;
  std::vector<double> row_squares;  // RowSquares (unknown_texels.h) of the least-squares solution
  CoefficientSums sums;             // of the texels of which something is known
};

// Reconstruct() of measurements that are rows of others (lightfield/file_pieces.h). Throws InputError
// as it does, and for what takes sums over all texels: a regularisation, the projection by irradiance.
RowsSolution ReconstructRows(std::span<const lightfield::Measurements> rows,
                             const ReconstructOptions& options, const WholeFigures& whole);

// SHA-256 of the files that a solution is made of.
struct SourceHashes {
  std::vector<std::string> measurements;  // in their order
  std::string filter;                     // empty: ideal filters
};

// Adds to the provenance of C and sigma, which is the measurements', what they were solved of and
// how.
void StateProvenance(const ReconstructOptions& options, const SourceHashes& sources,
                     Reconstruction* result);

}  // namespace luxfield::reconstruct
