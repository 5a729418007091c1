#include "luxfield/bench/all/bench_ray_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "luxfield/bench/all/process.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/formats/ray_formats.h"

namespace luxfield::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = 1 << 20;

ProcessRun MedianOf(int runs, const std::function<ProcessRun()>& work) {
  std::vector<ProcessRun> all;
  for (int run = 0; run < runs; ++run) {
    core::ThrowIfInterrupted();
    all.push_back(work());
  }
  std::sort(all.begin(), all.end(),
            [](const ProcessRun& a, const ProcessRun& b) { return a.wall_s < b.wall_s; });
  return all[all.size() / 2];
}

// The same of work in this process.
ProcessRun Here(const std::function<void()>& work) {
  core::TakePeakMib();
  const core::Stopwatch watch;
  work();
  return {watch.WallSeconds(), watch.CoreSeconds(), core::TakePeakMib()};
}

void WriteBytes(const fs::path& path, std::uintmax_t count) {
  core::WriteAtomically(path, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    const std::string piece(kPiece, '\x55');
    for (std::uintmax_t left = count; left > 0; left -= std::min<std::uintmax_t>(left, kPiece))
      stream.write(piece.data(),
                   static_cast<std::streamsize>(std::min<std::uintmax_t>(left, kPiece)));
    if (!stream.flush()) throw DeviceError(fmt::format("{}: cannot write", temporary.string()));
  });
}

void ReadBytes(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string piece(kPiece, '\0');
  while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size()))) continue;
}

void CountRays(const fs::path& path, std::uint64_t expected) {
  std::uint64_t count = 0;
  double flux = 0;
  formats::StreamRays(path, [&](const formats::Ray& ray) {
    ++count;
    flux += ray.flux;
  });
  if (count != expected || !(flux > 0))
    throw std::logic_error(fmt::format("{}: {} rays of flux {}", path.string(), count, flux));
}

}  // namespace

nlohmann::json BenchRayFiles(const BenchRayFilesOptions& options) {
  core::RequireRegularFile(options.light_field);
  fs::create_directories(options.folder);
  const std::string program = LuxfieldProgram();
  nlohmann::json rows = nlohmann::json::array();
  core::Progress progress("formats", options.formats.size());
  for (const std::string& format : options.formats) {
    const fs::path file = options.folder / ("rays." + format), plain = options.folder / "plain.bin",
                   field = options.folder / "back.lf.exr";
    const auto measure = [&](const char* name, const std::function<ProcessRun()>& work) {
      const ProcessRun run = MedianOf(options.runs, work);
      const double mib = double(fs::file_size(file)) / 0x1p20, rays = double(options.rays);
      rows.push_back({{"work", name},
                      {"format", format},
                      {"rays", options.rays},
                      {"mib", mib},
                      {"wall_s", run.wall_s},
                      {"core_s", run.core_s},
                      {"rays_per_core_s", rays / std::max(run.core_s, 1e-3)},
                      {"mib_per_s", mib / std::max(run.wall_s, 1e-3)},
                      {"peak_mib", run.peak_mib}});
    };
    const auto start = [&](std::vector<std::string> words) {
      words.insert(words.begin(), program);
      words.push_back("--quiet");
      return [words, &options] { return RunProcess(words, options.folder); };
    };
    measure("export", start({"export", options.light_field, "-o", file, "--rays",
                             std::to_string(options.rays)}));
    const std::uintmax_t bytes = fs::file_size(file);
    measure("disk write", [&] { return Here([&] { WriteBytes(plain, bytes); }); });
    measure("read", [&] { return Here([&] { CountRays(file, options.rays); }); });
    measure("disk read", [&] { return Here([&] { ReadBytes(plain); }); });
    measure("import", start({"import", file, "-o", field}));
    for (const fs::path& done : {file, plain, field}) fs::remove(done);
    progress.Advance();
  }
  return rows;
}

}  // namespace luxfield::bench
