#include "luxfield/hal/sim/filter_bench.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"

namespace luxfield::hal::sim {
namespace {

constexpr std::uint64_t kCameraStream = 6, kLightStream = 7;
constexpr double kLightSpread = 0.003;
constexpr int kPointsPerAxis = 4;

SimulatedSensor SquareSensor(SimulatedSensor model, int pixels) {
  model.width = model.height = pixels;
  model.responsivity_e_per_s_per_w_m2 = {1};
  return model;
}

// The holder seen from about its axis, the shorter side 1.9 supports wide: turned by a degree or
// so, off centre and in perspective by a per cent.
rig::Homography PlaceCamera(const rig::FilterSheet& sheet, int width, int height,
                            std::uint64_t seed) {
  core::Random random(seed, kCameraStream);
  const double half = 0.95 * sheet.basis.cells * sheet.spacing_m;
  const double angle = 0.02 * random.Normal(), c = std::cos(angle), s = std::sin(angle);
  const double shorter = std::min(width, height), x = half * width / shorter,
               y = half * height / shorter;
  std::array<Vec2, 4> corners{{{-x, y}, {x, y}, {x, -y}, {-x, -y}}};
  for (Vec2& p : corners) {
    const Vec2 moved{p.x + 0.01 * half * random.Normal(), p.y + 0.01 * half * random.Normal()};
    p = {c * moved.x - s * moved.y, s * moved.x + c * moved.y};
  }
  return rig::Homography::FromCorners(width, height, corners);
}

// Per pixel, the mean over 4 x 4 points; `level` is that of the bare light about the axis.
std::vector<float> Picture(const FilterPrint& print, const rig::Homography& holder_from_sensor,
                           FilterBench::View view, int width, int height, double level) {
  using View = FilterBench::View;
  const auto& sheet = print.sheet();
  const auto transmittance = [&](Vec2 p) {
    if (std::abs(p.x) < sheet.half_m && std::abs(p.y) < sheet.half_m)
      return view == View::kLight ? 1 : print.SheetTransmittance(p, view == View::kMinus);
    const bool hole = std::any_of(sheet.holder_marks.begin(), sheet.holder_marks.end(),
                                  [&](const rig::RegistrationMark& d) {
                                    const Vec2 q = p - d.centre_m;
                                    return q.x * q.x + q.y * q.y <= d.radius_m * d.radius_m;
                                  });
    return hole ? 1.0 : 0.0;
  };
  std::vector<float> image(static_cast<std::size_t>(width) * height);
  core::ParallelFor(height, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < width; ++column) {
        double sum = 0;
        for (int k = 0; k < kPointsPerAxis * kPointsPerAxis; ++k) {
          const Vec2 p = holder_from_sensor.Map(
              {column + (k % kPointsPerAxis + 0.5) / kPointsPerAxis,
               static_cast<double>(row) + (k / kPointsPerAxis + 0.5) / kPointsPerAxis});
          const double x = p.x / sheet.half_m, y = p.y / sheet.half_m;
          sum += transmittance(p) * (1 + 0.03 * x - 0.02 * y - 0.04 * (x * x + y * y));
        }
        image[row * width + column] =
            static_cast<float>(level * sum / (kPointsPerAxis * kPointsPerAxis));
      }
  });
  return image;
}

// The light in a view, relative.
double LightOf(std::uint64_t seed, FilterBench::View view) {
  return 1 +
         kLightSpread * core::Random(seed, kLightStream, static_cast<std::uint32_t>(view)).Normal();
}

}  // namespace

FilterBench::FilterBench(const LabDescription& lab, int pixels)
    : print_(lab.Print()),
      sensor_(SquareSensor(lab.camera.sensor, pixels), lab.seed ^ 0x62656E6368),
      seed_(lab.seed),
      exposure_s_(10 * lab.camera.min_exposure_s),
      holder_from_sensor_(PlaceCamera(print_.sheet(), pixels, pixels, lab.seed)) {
  irradiance_.resize(4);
  for (const View view : {View::kLight, View::kPlus, View::kMinus})
    if (view != View::kMinus || lab.filter.dual)
      irradiance_[static_cast<std::size_t>(view)] = Irradiance(view);
}

std::vector<float> FilterBench::Irradiance(View view) const {
  const SimulatedSensor& model = sensor_.model();
  const double level = 0.75 * (model.saturation_dn - model.black_dn) /
                       (model.gain_dn_per_e * model.responsivity_e_per_s_per_w_m2[0] * exposure_s_);
  return Picture(print_, holder_from_sensor_, view, model.width, model.height, level);
}

double FilterBench::Light(View view) const { return LightOf(seed_, view); }

session::RawFrame FilterBench::Expose(View view, double exposure_s, int number) const {
  const auto index = static_cast<std::uint64_t>(view);
  return sensor_.Expose(irradiance_[index], Light(view), 0, exposure_s,
                        index << 16 | static_cast<std::uint64_t>(number));
}

std::vector<float> PictureOfFilter(const LabDescription& lab, FilterBench::View view) {
  const FilterPrint print = lab.Print();
  const int width = lab.camera.sensor.width, height = lab.camera.sensor.height;
  return Picture(print, PlaceCamera(print.sheet(), width, height, lab.seed), view, width, height,
                 *lab.filter_bench_irradiance * LightOf(lab.seed, view));
}

}  // namespace luxfield::hal::sim
