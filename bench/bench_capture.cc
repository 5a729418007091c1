#include "luxfield/bench/bench_capture.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "luxfield/capture/take/capture.h"
#include "luxfield/cli/verbs/session_window.h"
#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/options/stage_options.h"
#include "luxfield/hal/sim/simulated_lab.h"

namespace luxfield::bench {
namespace {

constexpr double kBlack_dn = 400, kSaturation_dn = 60000, kGain = 0.16, kReadNoise_dn = 2;

// The camera aside, a lab like any other.
constexpr const char* kLab = R"([lab]
driver = "sim"
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[lamp]
kind = "square"
side_m = 0.06
depth_m = 0.03
radiance = 1000
[camera]
pitch_m = 0.01
width = 8
height = 8
bits = 16
black_dn = {}
saturation_dn = {}
gain_dn_per_e = {}
responsivity_e_per_s_per_w_m2 = [1000]
min_exposure_s = 1e-5
max_exposure_s = 100
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
)";

// What the camera sees, shared with the shutter.
struct View {
  bool open = true;
};

class Shutter : public hal::Selector {
 public:
  explicit Shutter(std::shared_ptr<View> view) : view_(std::move(view)) {}
  std::string identity() const override { return "bench shutter"; }
  std::vector<std::string> positions() const override { return {"closed", "open"}; }
  void Select(const std::string& position, double) override { view_->open = position == "open"; }
  std::string Current() override { return view_->open ? "open" : "closed"; }

 private:
  std::shared_ptr<View> view_;
};

// Frames are made when an exposure is set, two of each, and handed over during the exposure: what
// is left is the wait.
class Camera : public hal::Camera {
 public:
  // Exposures start at whole multiples of `period_s`; 0: when they are asked for.
  Camera(int side, double shortest_s, double period_s, std::shared_ptr<core::Clock> clock,
         std::shared_ptr<View> view)
      : side_(side),
        shortest_s_(shortest_s),
        period_s_(period_s),
        clock_(std::move(clock)),
        view_(std::move(view)) {}

  std::string identity() const override { return "bench camera"; }
  hal::CameraCapabilities capabilities() const override {
    return {side_, side_, 16, 1e-5, 100, 0, 0};
  }
  hal::AppliedSettings Configure(const hal::CameraSettings& settings, double) override {
    applied_ = {settings.exposure_s, applied_.settings_epoch + 1};
    for (const std::uint64_t which : {0, 1}) Picture(which);
    return applied_;
  }
  void Abort() override {}

  hal::Frame Expose(double) override {
    double start_s = clock_->MonotonicSeconds();
    if (period_s_ > 0) {
      const double tick = std::ceil(start_s / period_s_);
      if (last_tick_ > 0) missed_ += static_cast<int>(tick - last_tick_ - 1);
      last_tick_ = tick;
      start_s = tick * period_s_;
    }
    hal::Frame frame;
    frame.image = Picture(++frames_ % 2);
    frame.settings = applied_;
    frame.frame_id = frames_;
    frame.t_start_s = start_s;
    frame.t_end_s = start_s + applied_.exposure_s;
    clock_->SleepSeconds(frame.t_end_s - clock_->MonotonicSeconds());
    return frame;
  }

  int missed() const { return missed_; }
  void Forget() { missed_ = 0, last_tick_ = 0; }

 private:
  // A ramp whose upper end saturates in the longer exposure, with noise.
  const session::RawFrame& Picture(std::uint64_t which) {
    const auto key = std::tuple(view_->open, applied_.exposure_s, which);
    session::RawFrame& picture = pictures_[key];
    if (picture.size() > 0) return picture;
    core::Random random(which, view_->open);
    picture.width = picture.height = side_;
    picture.dn.resize(picture.size());
    const double top = view_->open ? 0.6 * kSaturation_dn * applied_.exposure_s / shortest_s_ : 0;
    for (std::size_t k = 0; k < picture.dn.size(); ++k) {
      const double signal = top * static_cast<double>(k) / static_cast<double>(picture.size());
      const double noise = std::sqrt(kReadNoise_dn * kReadNoise_dn + kGain * signal);
      picture.dn[k] = static_cast<std::uint16_t>(
          std::clamp(kBlack_dn + signal + noise * random.Normal(), 0.0, kSaturation_dn));
    }
    return picture;
  }

  int side_;
  double shortest_s_, period_s_;
  std::shared_ptr<core::Clock> clock_;
  std::shared_ptr<View> view_;
  hal::AppliedSettings applied_;
  std::map<std::tuple<bool, double, std::uint64_t>, session::RawFrame> pictures_;
  std::uint64_t frames_ = 0;
  double last_tick_ = 0;
  int missed_ = 0;
};

capture::Plan OnePosition(const rig::RigDescription& rig, double shortest_s, int rungs,
                          int repeats) {
  capture::Plan plan;
  plan.name = "bench";
  plan.geometry.delta_m = rig.delta_m;
  plan.geometry.grid = lightfield::BasisGrid::Centred(rig.basis, 1, 1, rig.spacing_m);
  plan.geometry.lattice = {8, 8, -0.04, -0.04, 0.01, 0.01};
  plan.filter_scale = rig.filter_scale;
  plan.exposure.min_s = shortest_s;
  plan.exposure.max_s = shortest_s * (rungs == 2 ? 2 : 1);
  plan.exposure.ratio = 2;
  plan.exposure.repeats = repeats;
  plan.reference.every = 0;
  plan.warm_up.window_s = 0;
  plan.dark_repeats = 1;
  return plan;
}

std::unique_ptr<hal::Stage> RealStage(const std::filesystem::path& lab_toml,
                                      const std::shared_ptr<core::Clock>& clock) {
  const hal::StageOptions stage = hal::ReadStage(core::Config::FromFile(lab_toml).Table("stage"));
  if (stage.port.empty())
    throw InputError(lab_toml.string(), "stage.driver: names no real stage",
                     "name the lab of a real one, or leave --stage out");
  return hal::OpenStage(stage, clock);
}

struct Run {
  double core_s = 0, window_core_s = 0;      // of this process, and of the window on the session
  std::map<std::string, std::string> files;  // of frames: SHA-256
  std::vector<double> committed_s;  // when each frame of the position was handed to storage
  int missed = 0;
  std::vector<double> peaks_mib;  // largest resident set over each tenth of the frames
};

// CPU time of processes that have ended and been waited for.
double ChildrenSeconds() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

std::map<std::string, std::string> FramesOf(const std::filesystem::path& session) {
  std::map<std::string, std::string> frames;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(session / "frames"))
    if (entry.is_regular_file())
      frames[std::filesystem::relative(entry.path(), session).string()] =
          core::Sha256OfFile(entry.path());
  return frames;
}

Run Capture(const BenchCaptureOptions& options, double shortest_s, int rungs, int repeats,
            double period_s, bool watched = false) {
  hal::Devices devices =
      hal::sim::SimulatedLab(
          core::Config::FromString(fmt::format(kLab, kBlack_dn, kSaturation_dn, kGain), "bench"))
          .MakeDevices();
  devices.clock = std::make_shared<core::SystemClock>();
  devices.announce = {};
  devices.monitor.reset();  // its warm-up runs on the simulated clock
  devices.rig.camera.read_noise_dn = kReadNoise_dn;
  if (options.stage) devices.stage = RealStage(*options.stage, devices.clock);
  const auto view = std::make_shared<View>();
  devices.shutter = std::make_unique<Shutter>(view);
  auto owned = std::make_unique<Camera>(options.side, shortest_s, period_s, devices.clock, view);
  Camera& camera = *owned;
  devices.camera = std::move(owned);

  const auto folder = options.folder / "session";
  const int darks = rungs, frames = rungs * repeats;
  Run run;
  capture::CaptureOptions how;
  how.on_frame = [&](const capture::CaptureSummary& summary) {
    const int n = summary.frames - darks;  // of the position
    if (n < 1 || n > frames) return;
    if (n == 1) {
      camera.Forget();
      core::TakePeakMib();
    }
    run.missed = camera.missed();
    run.committed_s.push_back(devices.clock->MonotonicSeconds());
    if (n * 10 / frames > static_cast<int>(run.peaks_mib.size()))
      run.peaks_mib.push_back(core::TakePeakMib());
  };
  std::optional<cli::SessionWindow> window;
  const double windows_s = ChildrenSeconds();
  if (watched) window.emplace(folder);
  const core::Stopwatch stopwatch;
  capture::RunCapture(OnePosition(devices.rig, shortest_s, rungs, repeats), devices, folder, how);
  run.core_s = stopwatch.CoreSeconds();
  const bool shown = window && window->IsOpen();
  if (window) window->Close();
  run.window_core_s = ChildrenSeconds() - windows_s;
  run.files = FramesOf(folder);
  std::filesystem::remove_all(folder);
  if (watched && !shown)
    throw DeviceError(
        "the window did not stay open while the session was captured, for the reason that it gave "
        "above; without a display, run under xvfb-run");
  return run;
}

nlohmann::json WatchedRow(const BenchCaptureOptions& options) {
  constexpr int kTimes = 3;
  const double period_s = 1 / options.stream_fps;
  std::vector<double> core_ms[2], missed[2], window_ms;
  std::optional<std::map<std::string, std::string>> files;
  bool same = true;
  for (int k = 0; k < kTimes; ++k)
    for (const bool watched : {false, true}) {
      const Run run = Capture(options, 0.8 * period_s, 1, options.stream_frames, period_s, watched);
      const double frames = options.stream_frames;
      core_ms[watched].push_back(1e3 * run.core_s / frames);
      missed[watched].push_back(run.missed);
      if (watched) window_ms.push_back(1e3 * run.window_core_s / frames);
      same = same && (!files || *files == run.files);
      files = run.files;
    }
  return {{"case", "watched"},
          {"frames", options.stream_frames},
          {"frame_mb", 2e-6 * options.side * options.side},
          {"alone_core_ms", core::Median(core_ms[0])},
          {"watched_core_ms", core::Median(core_ms[1])},
          {"window_core_ms", core::Median(window_ms)},
          {"alone_missed", core::Median(missed[0])},
          {"watched_missed", core::Median(missed[1])},
          {"same_frames", same}};
}

}  // namespace

nlohmann::json BenchCapture(const BenchCaptureOptions& options) {
  if (options.side < 1 || options.exposures < 10 || options.stream_frames < 10 ||
      !(options.exposure_s > 0) || !(options.stream_fps > 0))
    throw InputError("bench capture", "needs 10 frames of a pixel at least", "give more");
  std::filesystem::create_directories(options.folder);
  const double frame_mb = 2e-6 * options.side * options.side;
  nlohmann::json rows;
  {
    const Run run = Capture(options, options.exposure_s, 2, options.exposures, 0);
    const auto& t = run.committed_s;
    const auto longer = static_cast<std::size_t>(options.exposures);
    const double overhead_s = (t.back() - t[longer]) / static_cast<double>(t.size() - longer - 1) -
                              2 * options.exposure_s;
    rows.push_back({{"case", "overhead"},
                    {"frames", t.size()},
                    {"frame_mb", frame_mb},
                    {"overhead_ms", 1e3 * overhead_s},
                    {"overhead_share", overhead_s / options.exposure_s},
                    {"missed", nullptr},
                    {"peaks_mib", run.peaks_mib}});
  }
  const double period_s = 1 / options.stream_fps;
  const Run run = Capture(options, 0.8 * period_s, 1, options.stream_frames, period_s);
  rows.push_back({{"case", "stream"},
                  {"frames", run.committed_s.size()},
                  {"frame_mb", frame_mb},
                  {"overhead_ms", nullptr},
                  {"overhead_share", nullptr},
                  {"missed", run.missed},
                  {"peaks_mib", run.peaks_mib}});
  if (options.watched) rows.push_back(WatchedRow(options));
  return rows;
}

}  // namespace luxfield::bench
