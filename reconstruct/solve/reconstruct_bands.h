// Files of measurements to files of a light field, in bands of rows of the image plane, one after the
// other, so that a band is all that is in memory.
//
// The files are, to the byte, those of Reconstruct() of all rows. The measurements are read twice, once
// for what the solution of a row takes from all of them (reconstruct_rows.h); what is solved waits
// packed beside the output, as large as the output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/reconstruct/solve/reconstruct_rows.h"

namespace luxfield::reconstruct {

struct ReconstructFiles {
  std::vector<std::filesystem::path> measurements;
  std::filesystem::path filter;         // empty: ideal filters
  std::filesystem::path output, sigma;  // sigma empty: not written
};

// Bytes that `rows` rows of these measurements take while they are solved: E, sigma, count and masks
// of all positions, C and its sigma; and what is needed beside them.
std::uint64_t BandBytes(const ReconstructFiles& files, int rows);

// How many rows at once are solved within so many bytes: all of them, or a multiple of
// core::ExrRowSpool::kRows. Throws InputError, naming the bytes that are needed, where the smallest
// band does not fit.
int BandRows(const ReconstructFiles& files, std::uint64_t bytes);

// FindWholeFigures of files, `rows` rows of which are in memory. options.filter as for Reconstruct.
WholeFigures FindWholeFigures(const std::vector<std::filesystem::path>& measurements,
                              const ReconstructOptions& options, int rows);

// Writes files.output and files.sigma. options.filter is that of files.filter, which is not read.
// Throws what Reconstruct does, and InputError for what takes sums over all texels: a regularisation,
// the projection by irradiance.
ReconstructionReport ReconstructInBands(const ReconstructFiles& files,
                                        const ReconstructOptions& options, int rows);

}  // namespace luxfield::reconstruct
