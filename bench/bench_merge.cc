#include "luxfield/bench/bench_merge.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/session/session_writer.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;
using session::FrameKind;
using session::FrameRecord;
using session::RawFrame;

constexpr double kLattice_m = 0.3, kSpacing_m = 1e-3;
constexpr double kGain_dn_per_e = 1.2, kReadNoise_dn = 4, kBlack_dn = 500, kDark_e_per_s = 2;
constexpr double kLongest_s = 4;
constexpr int kDarks = 4;  // of every exposure time
constexpr std::uint64_t kSeed = 1;

double Exposure_s(const BenchMergeOptions& options, int index) {
  return kLongest_s * std::pow(4.0, index + 1 - options.exposures);
}

json Plan(const BenchMergeOptions& options, int grid_height) {
  const double texel_m = kLattice_m / options.lattice;
  return {{"geometry",
           {{"delta_m", 0.3},
            {"basis", "bspline2"},
            {"grid_width", options.grid_width},
            {"grid_height", grid_height},
            {"u0_m", -kSpacing_m * (options.grid_width + 2) / 2},
            {"v0_m", -kSpacing_m * (grid_height + 2) / 2},
            {"spacing_m", kSpacing_m},
            {"lattice",
             {{"width", options.lattice},
              {"height", options.lattice},
              {"s0_m", -kLattice_m / 2},
              {"t1_m", kLattice_m / 2},
              {"ds_m", texel_m},
              {"dt_m", texel_m}}},
            {"channels", 1},
            {"unit", "lm"}}},
          {"filter", {{"kind", "basis"}, {"scale", 16.0 / 9}}},
          {"rig", {{"kind", "lensless"}}}};
}

json Session(const BenchMergeOptions& options) {
  const double pitch_m = kLattice_m * 1.05 / options.sensor;
  // A sensor turned and seen at an angle, or one along the lattice.
  const double tilt = options.reflector ? 0.05 : 0, turn = options.reflector ? 0.05 : 0;
  const double half = options.sensor / 2.0, w = tilt / options.sensor;
  return {{"camera",
           {{"width", options.sensor},
            {"height", options.sensor},
            {"bits", 16},
            {"black_dn", kBlack_dn},
            {"saturation_dn", 65535},
            {"gain_dn_per_e", kGain_dn_per_e},
            {"read_noise_dn", kReadNoise_dn},
            {"dark_current_e_per_s", kDark_e_per_s},
            {"prnu", 0.005},
            {"responsivity_e_per_s_per_w_m2", {1e4}},
            {"defects", {{1, 1}}}}},
          {"calibration",
           {{"image_from_sensor",
             {pitch_m, turn * pitch_m, -pitch_m * half * (1 + turn), turn * pitch_m, -pitch_m,
              pitch_m * half * (1 - turn), w, 0, 1 - w * half}}}}};
}

// The sensor before light that grows by 17 stops from the left column to the right one; the normal
// stands in for the Poisson distribution, which the time does not depend on.
RawFrame Expose(const BenchMergeOptions& options, double exposure_s, bool lit,
                std::uint64_t stream) {
  RawFrame frame{options.sensor, options.sensor, {}, {}};
  frame.dn.resize(frame.size());
  std::vector<double> signal_dn;
  for (int column = 0; column < options.sensor; ++column) {
    const double rate = lit ? 10 * std::exp2(17.0 * column / options.sensor) : 0;
    signal_dn.push_back(kGain_dn_per_e * exposure_s * (rate + kDark_e_per_s));
  }
  core::ParallelFor(options.sensor, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      core::Random random(kSeed, stream, static_cast<std::uint32_t>(row));
      for (int column = 0; column < options.sensor; ++column) {
        const double sigma =
            std::sqrt(kGain_dn_per_e * signal_dn[column] + kReadNoise_dn * kReadNoise_dn);
        const double dn = std::round(kBlack_dn + signal_dn[column] + sigma * random.Normal());
        frame.dn[row * options.sensor + column] =
            static_cast<std::uint16_t>(std::clamp(dn, 0.0, 65535.0));
      }
    }
  });
  return frame;
}

bool IsThere(const BenchMergeOptions& options, int grid_height,
             const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "manifest.json")) return false;
  const session::SessionReader session(folder);
  return session.sealed() && session.plan() == Plan(options, grid_height) &&
         session.session() == Session(options);
}

// All positions hold equal frames, each in a file of its own.
void WriteSession(const BenchMergeOptions& options, int grid_height,
                  const std::filesystem::path& folder) {
  core::SimulatedClock clock;
  auto writer = session::SessionWriter::Create(folder, Plan(options, grid_height), Session(options),
                                               {}, clock);
  writer.StartEpoch(json::object());
  std::vector<RawFrame> bracket;
  core::Progress progress("bench session",
                          static_cast<std::uint64_t>(options.grid_width) * grid_height);
  for (int n = 0; n < options.exposures; ++n) {
    FrameRecord record;
    record.kind = FrameKind::kDark;
    record.exposure_index = n;
    record.exposure_s = record.requested_exposure_s = Exposure_s(options, n);
    const RawFrame dark = Expose(options, record.exposure_s, false, 100 + static_cast<unsigned>(n));
    for (record.repeat = 0; record.repeat < kDarks; ++record.repeat)
      writer.CommitFrame(record, dark, json::object());
    bracket.push_back(Expose(options, record.exposure_s, true, static_cast<unsigned>(n)));
  }
  for (int j = 0; j < grid_height; ++j) {
    FrameRecord reference;
    reference.kind = FrameKind::kReference;
    reference.repeat = j;
    reference.exposure_s = reference.requested_exposure_s = Exposure_s(options, 0);
    reference.t_start_s = 100.0 * j;
    writer.CommitFrame(reference, bracket[0], json::object());
    for (int i = 0; i < options.grid_width; ++i) {
      core::ThrowIfInterrupted();
      FrameRecord record;
      record.i = i;
      record.j = j;
      record.stage_u_m = kSpacing_m * (i + 0.5 - options.grid_width / 2.0);
      record.stage_v_m = kSpacing_m * (j + 0.5 - grid_height / 2.0);
      record.t_start_s = 100.0 * j + i;
      for (record.exposure_index = 0; record.exposure_index < options.exposures;
           ++record.exposure_index) {
        record.exposure_s = record.requested_exposure_s =
            Exposure_s(options, record.exposure_index);
        writer.CommitFrame(record, bracket[record.exposure_index], json::object());
      }
      writer.CompletePosition(i, j);
      progress.Advance();
    }
  }
  writer.Seal("done");
}

std::vector<std::filesystem::path> Files(const session::SessionReader& session) {
  std::vector<std::filesystem::path> files;
  for (const FrameRecord& record : session.frames())
    files.push_back(session.folder() / record.file);
  return files;
}

// Makes the next reading come from the disk: what a session writer made durable can be dropped.
void DropFromCache(const std::vector<std::filesystem::path>& files) {
  for (const auto& file : files) {
    const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) continue;
    ::posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
    ::close(fd);
  }
}

double ReadAll(const std::vector<std::filesystem::path>& files) {
  const core::Stopwatch stopwatch;
  core::ParallelFor(files.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) core::ReadInPieces(files[n], [](std::string_view) {});
  });
  return stopwatch.WallSeconds();
}

// Seconds for which a copy in memory occupies all threads, per byte.
double CopySecondsPerByte(std::size_t bytes) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  std::vector<char> from(bytes, 1), to(bytes, 0);
  std::vector<double> seconds;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const core::Stopwatch stopwatch;
    core::ParallelFor(bytes, kPiece, [&](std::size_t begin, std::size_t end) {
      std::memcpy(to.data() + begin, from.data() + begin, end - begin);
    });
    seconds.push_back(stopwatch.WallSeconds());
  }
  return core::Median(seconds) / static_cast<double>(bytes);
}

}  // namespace

void WriteMergeSession(const BenchMergeOptions& options, const std::filesystem::path& folder) {
  WriteSession(options, options.grid_height, folder);
}

json BenchMerge(const BenchMergeOptions& options) {
  if (std::min({options.grid_width, options.grid_height, options.exposures, options.sensor,
                options.lattice}) < 1)
    throw InputError("bench merge: grid, exposures, sensor and lattice must be at least 1");
  std::filesystem::create_directories(options.folder);
  const double frame_bytes = 2.0 * options.sensor * options.sensor;
  const double copy_s_per_byte = CopySecondsPerByte(static_cast<std::size_t>(frame_bytes) *
                                                    static_cast<std::size_t>(options.exposures));

  json rows = json::array();
  const auto run = [&](const std::string& name, const session::SessionReader& session,
                       bool check_hashes, double disk_s) {
    reconstruct::MergeSessionOptions how;
    how.check_hashes = check_hashes;
    reconstruct::MergeSessionSummary summary;
    core::TakePeakMib();
    const core::Stopwatch stopwatch;
    reconstruct::MergeSessionToFile(session, options.folder / "bench.meas.exr", how, &summary);
    const double wall_s = stopwatch.WallSeconds();
    const int frames = summary.frames + summary.dark_frames + summary.reference_frames;
    rows.push_back({{"case", name},
                    {"positions", summary.positions},
                    {"exposures", options.exposures},
                    {"mpix", frame_bytes / 2e6},
                    {"gb", frames * frame_bytes * 1e-9},
                    {"wall_s", wall_s},
                    {"core_s", stopwatch.CoreSeconds()},
                    {"mpix_per_s", frames * frame_bytes / 2e6 / wall_s},
                    {"disk_share", disk_s / wall_s},
                    {"copy_ratio", wall_s / (frames * frame_bytes * copy_s_per_byte)},
                    {"peak_mib", core::TakePeakMib()}});
  };

  const auto asked = [&](const std::string& name) {
    return options.cases.empty() ||
           std::any_of(options.cases.begin(), options.cases.end(),
                       [&](const std::string& start) { return name.starts_with(start); });
  };
  // Runs the cases asked for of one session.
  struct Case {
    const char* name;
    bool cached, check_hashes;
  };
  const auto merge = [&](const std::string& name, int grid_height, std::vector<Case> cases) {
    std::erase_if(cases, [&](const Case& c) { return !asked(c.name); });
    if (cases.empty()) return;
    const auto folder = options.folder / name;
    if (!IsThere(options, grid_height, folder)) {
      std::filesystem::remove_all(folder);
      WriteSession(options, grid_height, folder);
    }
    {
      const session::SessionReader session(folder);
      const auto files = Files(session);
      DropFromCache(files);
      const double disk_s = ReadAll(files);
      for (const Case& c : cases) {
        if (!c.cached) DropFromCache(files);
        run(c.name, session, c.check_hashes, disk_s);
      }
    }
    if (!options.keep) std::filesystem::remove_all(folder);
  };
  merge("session", options.grid_height,
        {{"from disk", false, true},
         {"cached", true, true},
         {"cached, hashes not checked", true, false}});
  merge("few", (options.grid_height + 7) / 8, {{"cached, an eighth of the positions", true, true}});
  if (rows.empty()) throw InputError("--case: none of the cases has such a name; leave it out");
  std::filesystem::remove(options.folder / "bench.meas.exr");
  return rows;
}

}  // namespace luxfield::bench
