#include "luxfield/hal/sim/world.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/sim/targets.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::hal::sim {
namespace {

constexpr std::uint64_t kStageStream = 3, kShutterStream = 4, kSpacerStream = 7,
                        kShutterTimeStream = 9;
constexpr int kPointsPerAxis = 3;  // per sensor pixel, reflector rig

// Where the sensor's outline lies on I, about the filter's axis.
void FootprintBounds(const LabDescription& lab, Vec2& low, Vec2& high) {
  // With distortion the outline bulges: its corners and points between them.
  constexpr int kSteps = 16;
  const double w = lab.camera.sensor.width, h = lab.camera.sensor.height;
  low = high = lab.geometry.ImageFromSensor(0, 0);
  for (int k = 0; k <= kSteps; ++k) {
    const double x = w * k / kSteps, y = h * k / kSteps;
    for (const auto& [column, row] :
         {std::pair{x, 0.0}, std::pair{x, h}, std::pair{0.0, y}, std::pair{w, y}}) {
      const Vec2 q = lab.geometry.ImageFromSensor(column, row);
      low = {std::min(low.x, q.x), std::min(low.y, q.y)};
      high = {std::max(high.x, q.x), std::max(high.y, q.y)};
    }
  }
}

}  // namespace

World::World(LabDescription lab)
    : lab_(std::move(lab)), sensor_(lab_.camera.sensor, lab_.seed), print_model_(lab_.Print()) {
  visit_ = NextVisit(setpoint_, visit_counts_);
}

World::Visit World::NextVisit(Vec2 setpoint, std::map<Visit, int>& counts) const {
  Visit visit{std::llround(setpoint.x * 1e9), std::llround(setpoint.y * 1e9), 0};
  visit.number = counts[visit]++;
  return visit;
}

Vec2 World::ActualCentre(const Visit& visit) const {
  const Vec2 nominal = lab_.geometry.FilterCentre(
      {static_cast<double>(visit.u_nm) * 1e-9, static_cast<double>(visit.v_nm) * 1e-9});
  if (lab_.stage.repeatability_m == 0) return nominal;
  const auto place = static_cast<std::uint64_t>(visit.u_nm) * 0x9E3779B97F4A7C15u +
                     static_cast<std::uint64_t>(visit.v_nm);
  core::Random random(lab_.seed ^ place, kStageStream + (static_cast<std::uint64_t>(epoch_) << 32),
                      static_cast<std::uint32_t>(visit.number));
  const double du = random.Normal(), dv = random.Normal();
  return nominal + lab_.stage.repeatability_m * Vec2{du, dv};
}

void World::Announce(const VisitPlan& plan) {
  epoch_ = plan.epoch;
  announced_.clear();
  cache_.clear();
  pixel_key_.reset();
  auto counts = visit_counts_;
  Vec2 at = setpoint_;
  for (const Vec2 centre : plan.filter_centres) {
    if (centre.x == at.x && centre.y == at.y) {  // already there: no move, no new error
      if (announced_.empty()) announced_.push_back(visit_);
      continue;
    }
    at = centre;
    announced_.push_back(NextVisit(centre, counts));
  }
}

void World::SwitchLamp(bool on) {
  if (on && !lamp_on_since_) lamp_on_since_ = clock_->MonotonicSeconds();
  if (!on) lamp_on_since_.reset();
}

void World::MoveStage(Vec2 setpoint) {
  if (setpoint.x == setpoint_.x && setpoint.y == setpoint_.y) return;
  setpoint_ = setpoint;
  visit_ = NextVisit(setpoint, visit_counts_);
}

std::size_t World::BytesPerVisit() const {
  Vec2 low, high;
  FootprintBounds(lab_, low, high);
  const double texels =
      ((high.x - low.x) / lab_.camera.pitch_m + 4) * ((high.y - low.y) / lab_.camera.pitch_m + 4);
  return static_cast<std::size_t>(texels * 4 * lab_.lamp->traced_channels() *
                                  (lab_.filter.dual ? 2 : 1));
}

const World::Traced& World::Trace(const Visit& visit) {
  if (const auto found = cache_.find(visit); found != cache_.end()) return found->second;
  std::vector<Visit> batch = {visit};
  if (const auto planned = std::find(announced_.begin(), announced_.end(), visit);
      planned != announced_.end()) {
    const std::size_t room = std::max<std::size_t>(1, lab_.tracing.memory_bytes / BytesPerVisit());
    const auto count =
        std::min<std::size_t>(room, static_cast<std::size_t>(announced_.end() - planned));
    batch.assign(planned, planned + static_cast<std::ptrdiff_t>(count));
  }
  TraceBatch(batch);
  return cache_.at(visit);
}

void World::TraceBatch(const std::vector<Visit>& visits) {
  cache_.clear();
  const double pitch = lab_.camera.pitch_m;
  Vec2 low, high;
  FootprintBounds(lab_, low, high);
  // The lattice's phase is that of the first visit's pixels: where the filter moves by whole pixels
  // all visits share it exactly.
  const Vec2 anchor{static_cast<double>(visits.front().u_nm) * 1e-9 + low.x,
                    static_cast<double>(visits.front().v_nm) * 1e-9 + high.y};
  struct Bounds {
    int column0, row0, column1, row1;
  };
  std::vector<Bounds> bounds;
  for (const Visit& visit : visits) {
    const Vec2 centre = ActualCentre(visit);
    bounds.push_back({static_cast<int>(std::floor((centre.x + low.x - anchor.x) / pitch)) - 1,
                      static_cast<int>(std::floor((anchor.y - centre.y - high.y) / pitch)) - 1,
                      static_cast<int>(std::ceil((centre.x + high.x - anchor.x) / pitch)) + 1,
                      static_cast<int>(std::ceil((anchor.y - centre.y - low.y) / pitch)) + 1});
  }
  Bounds all = bounds.front();
  for (const Bounds& b : bounds)
    all = {std::min(all.column0, b.column0), std::min(all.row0, b.row0),
           std::max(all.column1, b.column1), std::max(all.row1, b.row1)};
  lattice_ = {all.column1 - all.column0,
              all.row1 - all.row0,
              anchor.x + all.column0 * pitch,
              anchor.y - all.row0 * pitch,
              pitch,
              pitch};

  const int prints = lab_.filter.dual ? 2 : 1;
  std::vector<FilterPose> poses;
  std::vector<LatticeWindow> windows;
  for (std::size_t k = 0; k < visits.size(); ++k)
    for (int p = 0; p < prints; ++p) {
      const Bounds& b = bounds[k];
      poses.push_back({ActualCentre(visits[k]), p});
      windows.push_back(
          {b.column0 - all.column0, b.row0 - all.row0, b.column1 - b.column0, b.row1 - b.row0});
    }
  TraceOptions options;
  options.delta_m = lab_.geometry.delta_m;
  options.cell_m = lab_.filter.spacing_m;
  const double half_support = 0.5 * lab_.filter.basis.cells * lab_.filter.spacing_m;
  options.cell_origin = {static_cast<double>(visits.front().u_nm) * 1e-9 - half_support,
                         static_cast<double>(visits.front().v_nm) * 1e-9 - half_support};
  // A dual filter jumps at its knots, and a jump that moves between two nodes is not seen at all.
  if (lab_.filter.dual) options.cell_origin = options.cell_origin + lab_.filter.errors.shift_m;
  options.u_samples_per_cell = lab_.tracing.u_samples_per_cell;
  options.s_samples_per_texel = lab_.tracing.s_samples_per_pixel;
  auto images = TraceIrradiance(
      *lab_.lamp,
      [this](Vec2 offset, int print_index) {
        return print_model_.Transmittance(offset, print_index,
                                          lab_.filter.spacing_m / lab_.tracing.u_samples_per_cell);
      },
      print_model_.half_width_m(), poses, lattice_, windows, options);
  for (std::size_t k = 0; k < visits.size(); ++k) {
    Traced& traced = cache_[visits[k]];
    traced.window = windows[k * prints];
    for (int p = 0; p < prints; ++p) traced.images.push_back(std::move(images[k * prints + p]));
  }
}

std::vector<float> World::Resample(const Traced& traced, Vec2 centre, int plane) const {
  const int width = lab_.camera.sensor.width, height = lab_.camera.sensor.height;
  const LatticeWindow& window = traced.window;
  const std::size_t plane_size = static_cast<std::size_t>(window.width) * window.height;
  const float* texels = traced.images[lab_.filter.dual ? print : 0].data() + plane * plane_size;
  std::vector<float> pixels(static_cast<std::size_t>(width) * height);
  // Bilinear between the texels (row, column) and its neighbours; the window has a margin of one
  // texel.
  const auto mix = [&](int row, int column, double fy, double fx) {
    row = std::clamp(row, 0, window.height - 2);
    column = std::clamp(column, 0, window.width - 2);
    const float* at = texels + static_cast<std::size_t>(row) * window.width + column;
    return (1 - fy) * ((1 - fx) * at[0] + fx * at[1]) +
           fy * ((1 - fx) * at[window.width] + fx * at[window.width + 1]);
  };
  if (lab_.rig == rig::RigKind::kLensless) {
    // Pixels and texels have one size: a pixel overlaps two texels per axis, and the overlaps are
    // the same everywhere.
    const Vec2 corner = centre + lab_.geometry.ImageFromSensor(0, 0);
    const double x = lattice_.column_of_s(corner.x) - window.column,
                 y = lattice_.row_of_t(corner.y) - window.row;
    const auto split = [](double value, int& whole, double& fraction) {
      whole = static_cast<int>(std::floor(value + 1e-6));
      fraction = std::max(0.0, value - whole);
      if (fraction < 1e-6) fraction = 0;  // aligned but for rounding
    };
    int column0 = 0, row0 = 0;
    double fx = 0, fy = 0;
    split(x, column0, fx);
    split(y, row0, fy);
    core::ParallelFor(static_cast<std::size_t>(height), 16,
                      [&](std::size_t begin, std::size_t end) {
                        for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
                          for (int column = 0; column < width; ++column)
                            pixels[static_cast<std::size_t>(row) * width + column] =
                                static_cast<float>(mix(row0 + row, column0 + column, fy, fx));
                      });
    return pixels;
  }
  // Texels as samples at their centres, the pixel as the mean of points spread over it.
  core::ParallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
      for (int column = 0; column < width; ++column) {
        double sum = 0;
        for (int n = 0; n < kPointsPerAxis * kPointsPerAxis; ++n) {
          const int across = n % kPointsPerAxis, down = n / kPointsPerAxis;
          const Vec2 s =
              centre + lab_.geometry.ImageFromSensor(column + (across + 0.5) / kPointsPerAxis,
                                                     row + (down + 0.5) / kPointsPerAxis);
          const double x = lattice_.column_of_s(s.x) - window.column - 0.5,
                       y = lattice_.row_of_t(s.y) - window.row - 0.5;
          const double x0 = std::floor(x), y0 = std::floor(y);
          sum += mix(static_cast<int>(y0), static_cast<int>(x0), y - y0, x - x0);
        }
        pixels[static_cast<std::size_t>(row) * width + column] =
            static_cast<float>(sum / (kPointsPerAxis * kPointsPerAxis));
      }
  });
  return pixels;
}

std::vector<float> World::TargetIrradiance() const {
  const Vec2 moved = ActualCentre(visit_);
  const auto& axes = lab_.geometry.stage_axes;
  const Vec2 setpoint{static_cast<double>(visit_.u_nm) * 1e-9,
                      static_cast<double>(visit_.v_nm) * 1e-9};
  core::Random random(lab_.seed, kSpacerStream);
  const double across = random.Normal(), up = random.Normal();
  const double spread = lab_.targets ? lab_.targets->spacer_shift_m : 0;
  return PictureOfTarget(lab_,
                         {target,
                          {-moved.x, -moved.y, -(axes[0].z * setpoint.x + axes[1].z * setpoint.y)},
                          spread * Vec2{across, up}});
}

const std::vector<float>& World::PixelIrradiance() {
  const PixelKey key{visit_, print, lab_.lamp->traced_channels() > 1 ? channel : 0, target};
  if (pixel_key_ == key) return pixels_;
  pixel_key_.reset();
  pixels_ = LightOf(key.plane);
  if (!lab_.camera.sensor.cfa.empty() && target == 0) TakeMosaic();  // targets are white
  pixel_key_ = key;
  return pixels_;
}

void World::TakeMosaic() {
  const int width = lab_.camera.sensor.width;
  for (int colour = 0; colour < lab_.channels; ++colour) {
    const std::vector<float> light = lab_.lamp->traced_channels() > 1 ? LightOf(colour) : pixels_;
    const auto factor = static_cast<float>(lab_.lamp->channel_factor(colour));
    for (std::size_t k = 0; k < light.size(); ++k)
      if (rig::CfaChannel(lab_.camera.sensor.cfa, static_cast<int>(k / width),
                          static_cast<int>(k % width)) == colour)
        pixels_[k] = factor * light[k];
  }
}

std::vector<float> World::LightOf(int plane) {
  std::vector<float> pixels;
  if (target != 0) {
    pixels = TargetIrradiance();
  } else {
    pixels = Resample(Trace(visit_), ActualCentre(visit_), plane);
    const auto albedo =
        static_cast<float>(lab_.rig == rig::RigKind::kReflector ? lab_.albedo : 1.0);
    for (float& pixel : pixels) pixel *= albedo;
  }
  AddStrayLight(pixels);
  return pixels;
}

void World::AddStrayLight(std::vector<float>& pixels) const {
  const double mean =
      std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
  const auto stray = static_cast<float>(lab_.scatter.stray_share * mean);
  for (float& pixel : pixels) pixel += stray;
  if (lab_.scatter.glare.share > 0)
    lab_.scatter.glare.Veil(lab_.camera.sensor.width, lab_.camera.sensor.height, pixels);
}

double World::LampFactor() const {
  return lamp_on_since_ ? lab_.lamp_time.MeanFactor(clock_->MonotonicSeconds() - *lamp_on_since_, 0)
                        : 0;
}

session::RawFrame World::Expose(double exposure_s, std::uint64_t frame_id) {
  const std::uint64_t stream = (static_cast<std::uint64_t>(epoch_) << 32) + frame_id;
  double real_exposure_s = exposure_s + lab_.camera.shutter.offset_s;
  if (lab_.camera.shutter.time_s > 0)
    real_exposure_s +=
        lab_.camera.shutter.time_s *
        core::Random(lab_.seed ^ kShutterTimeStream, std::bit_cast<std::uint64_t>(exposure_s))
            .Normal();
  if (lab_.camera.shutter.jitter_s > 0)
    real_exposure_s +=
        lab_.camera.shutter.jitter_s * core::Random(lab_.seed ^ kShutterStream, stream).Normal();
  real_exposure_s = std::max(0.0, real_exposure_s);
  static const std::vector<float> kNoLight;
  const bool lit = shutter_open && (lamp_on_since_ || target != 0);
  double factor = lit ? 1 : 0;
  if (lit && target == 0) {
    factor =
        lab_.lamp_time.MeanFactor(clock_->MonotonicSeconds() - *lamp_on_since_, real_exposure_s);
    if (lab_.camera.sensor.cfa.empty()) factor *= lab_.lamp->channel_factor(channel);
  }
  session::RawFrame frame =
      sensor_.Expose(lit ? PixelIrradiance() : kNoLight, factor, channel, real_exposure_s, stream);
  clock_->SleepSeconds(exposure_s + lab_.camera.readout_s);
  return frame;
}

}  // namespace luxfield::hal::sim
