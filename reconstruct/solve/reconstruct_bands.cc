#include "luxfield/reconstruct/solve/reconstruct_bands.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr_spool.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/reconstruct/solve/unknown_texels.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LuminaireGeometry;
using lightfield::Measurements;

constexpr int kGrain = core::ExrRowSpool::kRows;
// Headers of files, what is packed before it is written, matrices.
constexpr std::uint64_t kBesideBands = std::uint64_t{64} << 20;

// Calls work(first, rows) for each band, from the top.
void ForBands(const std::string& label, const std::vector<std::filesystem::path>& files, int rows,
              const std::function<void(int first, std::span<const Measurements> rows)>& work) {
  const int height = lightfield::ReadMeasurementGeometry(files.at(0)).lattice.height;
  core::Progress progress(label, static_cast<std::uint64_t>((height + rows - 1) / rows));
  for (int first = 0; first < height; first += rows) {
    core::ThrowIfInterrupted();
    std::vector<Measurements> band;
    band.reserve(files.size());
    for (const auto& file : files)
      band.push_back(lightfield::ReadMeasurementRows(file, first, std::min(rows, height - first)));
    work(first, band);
    progress.Advance();
  }
}

// What bands leave behind that are solved.
struct Solved {
  std::optional<lightfield::LightFieldBands> coefficients, sigma;
  ReconstructionReport report;
  CoefficientSums sums;
  std::vector<std::vector<double>> squares;  // of a channel's rows
  std::size_t known = 0, unknown = 0;        // texels

  float SigmaOfUnknown(int channel, int positions) const {
    return RootMeanSquare(squares[channel],
                          static_cast<double>(known) * static_cast<double>(positions));
  }
};

// Counts and worst cases; the coefficients' statistics stay.
void AddRows(const ReconstructionReport& rows, ReconstructionReport* all) {
  all->incomplete.incomplete += rows.incomplete.incomplete;
  all->incomplete.with_gaps += rows.incomplete.with_gaps;
  all->incomplete.unknown += rows.incomplete.unknown;
  all->off_sensor += rows.off_sensor;
  all->saturated += rows.saturated;
  all->too_dark += rows.too_dark;
  all->defect += rows.defect;
  if (!rows.non_negative) return;
  if (!all->non_negative) all->non_negative.emplace(NonNegativeSummary{rows.non_negative->metric});
  NonNegativeSummary& summary = *all->non_negative;
  summary.pixels += rows.non_negative->pixels;
  summary.unconverged += rows.non_negative->unconverged;
  summary.moments_lost += rows.non_negative->moments_lost;
  summary.iterations = std::max(summary.iterations, rows.non_negative->iterations);
  summary.worst_residual = std::max(summary.worst_residual, rows.non_negative->worst_residual);
}

void AddBand(const ReconstructFiles& files, const LuminaireGeometry& whole, std::size_t positions,
             RowsSolution solution, Solved* solved) {
  Reconstruction& rows = solution.rows;
  std::vector<bool> unknown(rows.unknown_positions.size());
  for (std::size_t p = 0; p < unknown.size(); ++p)
    unknown[p] = rows.unknown_positions[p] == positions;
  const auto count = static_cast<std::size_t>(std::count(unknown.begin(), unknown.end(), true));
  solved->unknown += count;
  solved->known += unknown.size() - count;
  const std::size_t height = solution.row_squares.size() / solved->squares.size();
  for (std::size_t channel = 0; channel < solved->squares.size(); ++channel) {
    const auto begin = solution.row_squares.begin() + static_cast<std::ptrdiff_t>(channel * height);
    solved->squares[channel].insert(solved->squares[channel].end(), begin,
                                    begin + static_cast<std::ptrdiff_t>(height));
  }
  solved->sums.Add(solution.sums);
  if (!solved->coefficients) {
    solved->report = rows.report;
    solved->coefficients.emplace(files.output, whole, rows.coefficients.provenance);
    if (!files.sigma.empty()) solved->sigma.emplace(files.sigma, whole, rows.sigma.provenance);
  } else {
    AddRows(rows.report, &solved->report);
  }
  solved->coefficients->Add(std::move(rows.coefficients));
  if (solved->sigma)
    solved->sigma->Add(std::move(rows.sigma), count > 0 ? unknown : std::vector<bool>());
}

}  // namespace

namespace {

std::uint64_t BytesOfBand(const LuminaireGeometry& geometry, std::size_t files, int rows) {
  const auto texels =
      static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(geometry.lattice.width);
  const auto positions = static_cast<std::uint64_t>(geometry.grid.count()),
             channels = static_cast<std::uint64_t>(geometry.channels);
  const std::uint64_t measured = 8 * channels + 12,  // E, sigma; count, mask, its unknown bits
      solved = 8 * channels;
  const std::uint64_t bytes = texels * positions * (measured * files + solved) + 64 * texels;
  return bytes + bytes / 16 + kBesideBands;
}

}  // namespace

std::uint64_t BandBytes(const ReconstructFiles& files, int rows) {
  return BytesOfBand(lightfield::ReadMeasurementGeometry(files.measurements.at(0)),
                     files.measurements.size(), rows);
}

int BandRows(const ReconstructFiles& files, std::uint64_t bytes) {
  const LuminaireGeometry geometry = lightfield::ReadMeasurementGeometry(files.measurements.at(0));
  const auto needed = [&](int rows) {
    return BytesOfBand(geometry, files.measurements.size(), rows);
  };
  const int height = geometry.lattice.height, least = std::min(kGrain, height);
  if (needed(height) <= bytes) return height;
  if (needed(least) > bytes)
    throw InputError(
        files.measurements[0].string(),
        fmt::format("the smallest band that is solved at once, {} rows of {} positions, does not "
                    "fit into {} MiB",
                    least, files.measurements.size() * geometry.grid.count(), bytes >> 20),
        fmt::format("give it {} MiB more", ((needed(least) - bytes) >> 20) + 1));
  int rows = least;
  while (rows + kGrain < height && needed(rows + kGrain) <= bytes) rows += kGrain;
  return rows;
}

WholeFigures FindWholeFigures(const std::vector<std::filesystem::path>& measurements,
                              const ReconstructOptions& options, int rows) {
  WholeFigureSums sums(options);
  ForBands("looking through measurements", measurements, rows,
           [&](int, std::span<const Measurements> band) { sums.Add(band); });
  return sums.Find();
}

ReconstructionReport ReconstructInBands(const ReconstructFiles& files,
                                        const ReconstructOptions& options, int rows) {
  const LuminaireGeometry whole = lightfield::ReadMeasurementGeometry(files.measurements.at(0));
  const WholeFigures figures = FindWholeFigures(files.measurements, options, rows);
  SourceHashes sources;
  for (const auto& file : files.measurements)
    sources.measurements.push_back(core::Sha256OfFile(file));
  if (!files.filter.empty()) sources.filter = core::Sha256OfFile(files.filter);
  const int images = whole.grid.count();
  const std::size_t positions = files.measurements.size() * static_cast<std::size_t>(images);
  Solved solved;
  solved.squares.resize(static_cast<std::size_t>(whole.channels));
  ForBands("solving", files.measurements, rows, [&](int, std::span<const Measurements> band) {
    RowsSolution solution = ReconstructRows(band, options, figures);
    StateProvenance(options, sources, &solution.rows);
    AddBand(files, whole, positions, std::move(solution), &solved);
  });
  for (int channel = 0; channel < whole.channels; ++channel)
    solved.sums.AddDark(solved.unknown * static_cast<std::size_t>(images),
                        solved.SigmaOfUnknown(channel, images));
  solved.report.coefficients = solved.sums.Find();
  solved.coefficients->Write();
  if (solved.sigma)
    solved.sigma->Write([&](int channel) { return solved.SigmaOfUnknown(channel, images); });
  return solved.report;
}

}  // namespace luxfield::reconstruct
