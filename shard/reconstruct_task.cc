#include "luxfield/shard/reconstruct_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/warning.h"
#include "luxfield/lightfield/edge_light_json.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/reconstruct/solve/reconstruct_rows.h"
#include "luxfield/reconstruct/solve/unknown_texels.h"
#include "luxfield/shard/join_exr.h"

namespace luxfield::shard {
namespace {

using core::Field;
using reconstruct::WholeFigures;

constexpr char kFile[] = "job.json";
constexpr std::uint64_t kBytesOfPlan = std::uint64_t{1} << 29;
constexpr float kSigmaOfOthers = -1;  // follows from the C of all rows: put in by Join

core::Json ToJson(const WholeFigures& whole) {
  return {{"edges", whole.edges ? lightfield::ToJson(*whole.edges) : core::Json()},
          {"position_noise", whole.position_noise}};
}

WholeFigures FiguresFrom(const core::Json& json) {
  WholeFigures whole;
  whole.position_noise = Field<std::vector<double>>(json, "position_noise", kFile);
  const auto edges = Field<core::Json>(json, "edges", kFile);
  if (edges.is_null()) return whole;
  whole.edges.emplace();
  whole.edges->measured_flux = Field<double>(edges, "measured_flux", kFile);
  const auto sides = Field<std::vector<core::Json>>(edges, "sides", kFile);
  if (sides.size() != whole.edges->sides.size())
    throw InputError(kFile, "whole.edges does not have four sides", "plan the job anew");
  for (std::size_t k = 0; k < sides.size(); ++k)
    whole.edges->sides[k] = {
        Field<std::string>(sides[k], "side", kFile), Field<double>(sides[k], "ratio", kFile),
        Field<double>(sides[k], "share", kFile), Field<bool>(sides[k], "reached", kFile)};
  return whole;
}

// Marks the sigma of texels of which nothing is known; how many there are.
std::size_t MarkUnknown(std::size_t positions, reconstruct::Reconstruction& result) {
  const auto& geometry = result.sigma.geometry;
  std::size_t count = 0;
  for (std::size_t p = 0; p < result.unknown_positions.size(); ++p) {
    if (result.unknown_positions[p] != positions) continue;
    ++count;
    for (int m = 0; m < geometry.grid.count(); ++m)
      for (int channel = 0; channel < geometry.channels; ++channel)
        result.sigma.image(m, channel)[p] = kSigmaOfOthers;
  }
  return count;
}

}  // namespace

ReconstructTask::ReconstructTask(ReconstructFiles files,
                                 const reconstruct::ReconstructOptions& options)
    : files_(std::move(files)), options_(options) {}

int ReconstructTask::Length() const {
  return lightfield::ReadMeasurementGeometry(files_.measurements.at(0)).lattice.height;
}

std::vector<std::filesystem::path> ReconstructTask::Inputs() const {
  auto inputs = files_.measurements;
  if (!files_.filter.empty()) inputs.push_back(files_.filter);
  return inputs;
}

std::vector<std::filesystem::path> ReconstructTask::Outputs() const {
  if (files_.sigma.empty()) return {files_.output};
  return {files_.output, files_.sigma};
}

std::vector<std::string> ReconstructTask::Endings(int, int) const {
  if (files_.sigma.empty()) return {".exr"};
  return {".exr", ".sigma.exr"};
}

core::Json ReconstructTask::Whole() const {
  auto options = options_;
  std::optional<lightfield::MeasuredFilter> filter;
  if (!files_.filter.empty()) filter = lightfield::ReadMeasuredFilter(files_.filter);
  options.filter = filter ? &*filter : nullptr;
  const int rows = reconstruct::BandRows(
      files_, std::max(kBytesOfPlan, reconstruct::BandBytes(files_, core::ExrRowSpool::kRows)));
  return ToJson(reconstruct::FindWholeFigures(files_.measurements, options, rows));
}

core::Json ReconstructTask::Run(const core::Json& whole, int first, int last,
                                std::span<const std::filesystem::path> files) const {
  auto options = options_;
  std::optional<lightfield::MeasuredFilter> filter;
  if (!files_.filter.empty()) filter = lightfield::ReadMeasuredFilter(files_.filter);
  options.filter = filter ? &*filter : nullptr;
  std::vector<lightfield::Measurements> rows;
  std::size_t positions = 0;
  for (const auto& file : files_.measurements) {
    rows.push_back(lightfield::ReadMeasurementRows(file, first, last - first));
    positions += rows.back().positions.size();
  }
  auto solution = reconstruct::ReconstructRows(rows, options, FiguresFrom(whole));
  reconstruct::Reconstruction& result = solution.rows;
  auto hashes = Field<std::vector<std::string>>(whole, "inputs_sha256", kFile);
  reconstruct::SourceHashes sources;
  if (filter) {
    sources.filter = hashes.back();
    hashes.pop_back();
  }
  sources.measurements = hashes;
  reconstruct::StateProvenance(options, sources, &result);
  if (first == 0)
    for (const std::string& warning : result.report.warnings) core::Warn(warning);

  const auto geometry = lightfield::ReadMeasurementGeometry(files_.measurements[0]);
  lightfield::WriteLightFieldRows(files[0], geometry, result.coefficients);
  const std::size_t unknown = MarkUnknown(positions, result);
  if (files.size() > 1) lightfield::WriteLightFieldRows(files[1], geometry, result.sigma);
  return {{"row_squares", solution.row_squares},
          {"unknown_texels", unknown},
          {"texels", result.unknown_positions.size()}};
}

void ReconstructTask::Join(const core::Json&, std::span<const Piece> pieces) const {
  std::vector<std::filesystem::path> of_c, of_sigma;
  for (const Piece& piece : pieces) {
    of_c.push_back(piece.files[0]);
    if (!files_.sigma.empty()) of_sigma.push_back(piece.files[1]);
  }
  JoinExrRows(of_c, files_.output, core::ExrCompression::kZip);
  if (files_.sigma.empty()) return;

  const auto geometry = lightfield::ReadMeasurementGeometry(files_.measurements[0]);
  std::vector<std::vector<double>> squares(geometry.channels);  // of a channel's rows
  std::size_t known = 0;
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    const std::string file = of_c[n].string();
    const auto own = Field<std::vector<double>>(pieces[n].figures, "row_squares", file);
    known += Field<std::size_t>(pieces[n].figures, "texels", file) -
             Field<std::size_t>(pieces[n].figures, "unknown_texels", file);
    const std::size_t rows = own.size() / squares.size();
    for (std::size_t channel = 0; channel < squares.size(); ++channel)
      squares[channel].insert(squares[channel].end(),
                              own.begin() + static_cast<std::ptrdiff_t>(channel * rows),
                              own.begin() + static_cast<std::ptrdiff_t>((channel + 1) * rows));
  }
  const double values = static_cast<double>(known) * static_cast<double>(geometry.grid.count());
  const auto mend = [&](int, const std::string& name, std::span<float> pixels) {
    const std::size_t channel = name == "G" ? 1 : name == "B" ? 2 : 0;
    const float sigma = reconstruct::RootMeanSquare(squares[channel], values);
    std::replace(pixels.begin(), pixels.end(), kSigmaOfOthers, sigma);
  };
  JoinExrRows(of_sigma, files_.sigma, core::ExrCompression::kZip, mend);
}

}  // namespace luxfield::shard
