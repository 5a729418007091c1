#include "luxfield/bench/all/bench_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "luxfield/bench/all/car_field.h"
#include "luxfield/bench/all/process.h"
#include "luxfield/bench/bench_merge.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/lightfield/file_pieces.h"

namespace luxfield::bench {
namespace {

namespace fs = std::filesystem;

using lightfield::Measurement;
using lightfield::Measurements;

constexpr std::uintmax_t kPiece = 1 << 20, kMostOfDisk = std::uintmax_t{1} << 30;

Measurements Header(const BenchMemoryOptions& options, int grid) {
  constexpr double kSpacing_m = 1e-3, kSide_m = 0.3;
  Measurements header;
  auto& g = header.geometry;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          grid, grid, kSpacing_m);
  const double texel_m = kSide_m / options.texels;
  g.lattice = {options.texels, options.texels, -kSide_m / 2, kSide_m / 2, texel_m, texel_m};
  header.positions.resize(static_cast<std::size_t>(g.grid.count()));
  return header;
}

// Bits that look like noise: a multiplicative hash of what number of a value this is.
std::uint32_t Bits(std::size_t number) {
  std::uint64_t x = (number + 1) * 0x9E3779B97F4A7C15u;
  x ^= x >> 29;
  return static_cast<std::uint32_t>((x * 0xBF58476D1CE4E5B9u) >> 32);
}

// Light that falls off from the middle filter, with noise of a hundredth in the rows that are
// filled.
Measurement Position(const BenchMemoryOptions& options, int grid, int m) {
  const auto side = static_cast<std::size_t>(options.texels), texels = side * side;
  const double u = m % grid - grid / 2, v = m / grid - grid / 2;
  const float peak = static_cast<float>(std::exp(-4 * (u * u + v * v) / (grid * grid)));
  const std::size_t lit =
      side * static_cast<std::size_t>(std::ceil(options.filled * options.texels));
  Measurement position;
  position.irradiance.assign(texels, 0);
  position.sigma.assign(texels, 0);
  position.count.assign(texels, 0);
  position.mask.assign(texels, 0);
  for (std::size_t p = 0; p < lit; ++p) {
    const std::uint32_t bits = Bits(static_cast<std::size_t>(m) * texels + p);
    const float noise = static_cast<float>(bits & 0xFFFF) / 0x8000 - 1;
    position.irradiance[p] = peak * (1 + 0.01f * noise);
    position.sigma[p] = peak * (0.005f + 0.001f * static_cast<float>(bits >> 16) / 0x10000);
    position.count[p] = 1;
  }
  return position;
}

void Drop(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

// Seconds in which so many bytes are written durably to the disk.
double WriteSeconds(const fs::path& path, std::uintmax_t bytes) {
  const core::Stopwatch watch;
  core::WriteAtomically(path, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    const std::string piece(kPiece, '\x55');
    for (std::uintmax_t left = bytes; left > 0; left -= std::min(left, kPiece))
      stream.write(piece.data(), static_cast<std::streamsize>(std::min(left, kPiece)));
    if (!stream.flush()) throw DeviceError(fmt::format("{}: cannot write", temporary.string()));
  });
  return watch.WallSeconds();
}

// Seconds in which a file is read from the disk.
double ReadSeconds(const fs::path& path) {
  Drop(path);
  const core::Stopwatch watch;
  core::ReadInPieces(path, [](std::string_view) {});
  return watch.WallSeconds();
}

// How long the disk takes for so many bytes read and written, from at most kMostOfDisk of each.
double DiskSeconds(const fs::path& folder, double read, double written) {
  const auto sample = [](double bytes) {
    return std::clamp(static_cast<std::uintmax_t>(bytes), kPiece, kMostOfDisk);
  };
  const fs::path plain = folder / "plain.bin";
  const double write_s = WriteSeconds(plain, sample(written)),
               of_written = written / static_cast<double>(sample(written));
  if (sample(read) != sample(written)) WriteSeconds(plain, sample(read));
  const double read_s = ReadSeconds(plain), of_read = read / static_cast<double>(sample(read));
  fs::remove(plain);
  return write_s * of_written + read_s * of_read;
}

// A verb of the program, what makes its input, and the files that it reads and writes.
struct Work {
  std::string name;
  std::vector<std::string> words;
  std::vector<fs::path> read, written;  // of a folder: what is in it
  std::function<void()> prepare{};
};

void MakeMeasurements(const BenchMemoryOptions& options, int grid, const fs::path& path) {
  lightfield::WriteMeasurementPositions(
      path, Header(options, grid), 0, grid * grid,
      [&](int m) { return Position(options, grid, m); },
      options.filled < 1 ? core::ExrCompression::kZip : core::ExrCompression::kNone);
}

void MakeSession(const BenchMemoryOptions& options, int grid, const fs::path& folder) {
  WriteMergeSession({.grid_width = grid,
                     .grid_height = grid,
                     .exposures = 2,
                     .sensor = options.texels,
                     .lattice = std::max(1, options.texels / 4),
                     .reflector = false,
                     .folder = folder,
                     .keep = true,
                     .cases = {}},
                    folder);
}

// Each reads what those before it have made.
std::vector<Work> Works(const BenchMemoryOptions& options, int grid) {
  const fs::path session = options.folder / "session", merged = options.folder / "s.meas.exr",
                 measured = options.folder / "m.meas.exr", field = options.folder / "c.lf.exr",
                 sigma = options.folder / "sigma.lf.exr", projected = options.folder / "p.lf.exr",
                 tables = options.folder / "t.tab.exr", car = options.folder / "car.lf.exr",
                 picture = options.folder / "picture.exr";
  const auto render = [&](const std::string& estimator) {
    return Work{"render " + estimator,
                {"render", options.folder / "car.toml", "-o", picture, "--estimator", estimator,
                 "--shadows", "none", "--width", "512", "--height", "384"},
                {car},
                {picture},
                [=, &options] {
                  if (!fs::exists(car)) WriteCarField(options.folder, grid, grid, options.texels);
                }};
  };
  return {{"merge",
           {"merge", session, "-o", merged},
           {session / "frames"},
           {merged},
           [=, &options] { MakeSession(options, grid, session); }},
          {"reconstruct",
           {"reconstruct", measured, "--sigma", sigma, "-o", field},
           {measured},
           {field, sigma},
           [=, &options] { MakeMeasurements(options, grid, measured); }},
          {"reconstruct --non-negative",
           {"reconstruct", measured, "--sigma", sigma, "-o", projected, "--non-negative"},
           {measured},
           {projected, sigma}},
          {"preprocess", {"preprocess", field, "-o", tables}, {field}, {tables}},
          render("exact"),
          render("volume")};
}

std::vector<fs::path> FilesIn(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths)
    if (fs::is_directory(path))
      for (const auto& entry : fs::recursive_directory_iterator(path)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
      }
    else
      files.push_back(path);
  return files;
}

double BytesOf(const std::vector<fs::path>& files) {
  double bytes = 0;
  for (const fs::path& file : files) bytes += static_cast<double>(fs::file_size(file));
  return bytes;
}

bool IsAsked(const BenchMemoryOptions& options, const std::string& work) {
  return options.works.empty() ||
         std::any_of(options.works.begin(), options.works.end(),
                     [&](const std::string& start) { return work.starts_with(start); });
}

ProcessRun MedianRun(const BenchMemoryOptions& options, const std::vector<std::string>& words,
                     const std::vector<fs::path>& read) {
  std::vector<ProcessRun> runs;
  for (int run = 0; run < options.runs; ++run) {
    core::ThrowIfInterrupted();
    for (const fs::path& file : read) Drop(file);
    core::TakePeakMib();  // the process begins with this one's peak
    runs.push_back(RunProcess(words, options.folder));
  }
  std::sort(runs.begin(), runs.end(),
            [](const ProcessRun& a, const ProcessRun& b) { return a.core_s < b.core_s; });
  return runs[runs.size() / 2];
}

}  // namespace

nlohmann::json BenchMemory(const BenchMemoryOptions& options) {
  if (options.texels < 1 || options.runs < 1 || !(options.filled > 0 && options.filled <= 1))
    throw InputError("bench memory: texels, runs and filled rows must be above 0");
  fs::create_directories(options.folder);
  const std::string program = LuxfieldProgram();
  nlohmann::json rows = nlohmann::json::array();
  core::Progress progress("bench memory", options.grids.size());
  for (const int grid : options.grids) {
    for (const Work& work : Works(options, grid)) {
      if (!IsAsked(options, work.name)) continue;
      if (work.prepare) work.prepare();
      std::vector<std::string> words = work.words;
      words.insert(words.begin(), program);
      words.insert(words.end(), {"--memory", options.memory, "--quiet"});
      const std::vector<fs::path> inputs = FilesIn(work.read);
      const ProcessRun run = MedianRun(options, words, inputs);
      const double read = BytesOf(inputs), written = BytesOf(work.written);
      rows.push_back({{"work", work.name},
                      {"positions", grid * grid},
                      {"mpix", 1e-6 * options.texels * options.texels},
                      {"read_mib", read / 0x1p20},
                      {"written_mib", written / 0x1p20},
                      {"wall_s", run.wall_s},
                      {"core_s", run.core_s},
                      {"peak_mib", run.peak_mib},
                      {"disk_s", DiskSeconds(options.folder, read, written)}});
    }
    for (const char* made : {"session", "s.meas.exr", "m.meas.exr", "c.lf.exr", "sigma.lf.exr",
                             "p.lf.exr", "t.tab.exr", "car.lf.exr", "car.toml", "picture.exr"})
      fs::remove_all(options.folder / made);
    progress.Advance();
  }
  return rows;
}

}  // namespace luxfield::bench
