#include "luxfield/hal/sim/bowl.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/hal/sim/filament.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::hal::sim {
namespace {

using lightfield::Vec3;

constexpr std::uint64_t kFacetSeed = 7;

class Bowl : public Lamp {
 public:
  explicit Bowl(const BowlOptions& o)
      : o_(o),
        p4_(4 * o.focal_m),
        depth_(o.radius_m * o.radius_m / p4_),
        coil_{
            o.coil_radiance, o.coil_radius_m, o.coil_length_m, {0, 0, o.focal_m + o.coil_ahead_m}} {
    for (int facet = 0; facet < o.rings * o.sectors; ++facet) {
      core::Random random(kFacetSeed, static_cast<std::uint64_t>(facet));
      const double across = o.tilt_across * random.Normal();
      tilts_.push_back({across, o.tilt_up * random.Normal()});
    }
  }

  double channel_factor(int channel) const override { return o_.colour[channel]; }

  bool DarkAt(Vec2 u) const override {
    // No ray of use is flatter than 60 degrees from the axis.
    const double reach = o_.radius_m + 1.7321 * o_.gap_m;
    return u.x * u.x + u.y * u.y > reach * reach;
  }

  void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                std::span<double> radiance) const override {
    const double slope_y = (t_m - u.y) / delta_m;
    for (std::size_t n = 0; n < s_m.size(); ++n) {
      const double slope_x = (s_m[n] - u.x) / delta_m;
      const double x = u.x - slope_x * o_.gap_m, y = u.y - slope_y * o_.gap_m;
      const bool through_glass = x * x + y * y <= o_.radius_m * o_.radius_m;
      radiance[n] = through_glass ? BehindGlass(x, y, slope_x, slope_y) : 0.0;
    }
  }

 private:
  // The ray with slopes mx = dx/dz and my crosses the rim's plane at (x, y). z counts from the
  // bowl's vertex.
  double BehindGlass(double x, double y, double mx, double my) const {
    // The mirror z = r^2 / 4p: back by w from the rim at z = depth,
    //   r = |(x, y) - m w|,   depth - w = r^2 / 4p.
    // c <= 0 inside the rim, so that one root is not positive and the other is the hit; of its two
    // forms the one that takes no difference.
    const double a = mx * mx + my * my, b = p4_ - 2 * (x * mx + y * my);
    const double c = x * x + y * y - p4_ * depth_;
    const double root = std::sqrt(b * b - 4 * a * c);
    const double w = b > 0 ? -2 * c / (b + root) : (root - b) / (2 * a);
    const Vec3 hit{x - mx * w, y - my * w, depth_ - w};
    // The paraboloid's inner normal (-x / 2p, -y / 2p, 1), turned with its facet.
    const Vec2 tilt = Tilt(hit.x, hit.y);
    const Vec3 back{-mx, -my, -1}, n{tilt.x - 2 * hit.x / p4_, tilt.y - 2 * hit.y / p4_, 1};
    return o_.haze * o_.coil_radiance +
           o_.reflectance * coil_.Radiance(hit, back - (2 * Dot(back, n) / Dot(n, n)) * n);
  }

  Vec2 Tilt(double x, double y) const {
    const int ring =
        std::min(o_.rings - 1, static_cast<int>(o_.rings * std::hypot(x, y) / o_.radius_m));
    const double turn = std::atan2(y, x) / (2 * std::numbers::pi);
    const int sector = std::min(o_.sectors - 1, static_cast<int>(o_.sectors * (turn + 0.5)));
    return tilts_[ring * o_.sectors + sector];
  }

  BowlOptions o_;
  double p4_, depth_;
  Coil coil_;
  std::vector<Vec2> tilts_;  // [ring * sectors + sector]
};

}  // namespace

BowlOptions ReadBowl(const core::Config& config) {
  BowlOptions o;
  const auto length = [&](const char* key, double fallback) {
    return config.Number(key, fallback, {1e-5, 1});
  };
  o.coil_radiance = config.Number("coil_radiance", o.coil_radiance, {1e-300, 1e15});
  o.coil_radius_m = length("coil_radius_m", o.coil_radius_m);
  o.coil_length_m = length("coil_length_m", o.coil_length_m);
  o.coil_ahead_m = config.Number("coil_ahead_m", o.coil_ahead_m, {-1, 1});
  o.reflectance = config.Number("reflectance", o.reflectance, {0, 1});
  o.focal_m = length("focal_m", o.focal_m);
  o.radius_m = length("radius_m", o.radius_m);
  o.gap_m = config.Number("gap_m", o.gap_m, {0, 1});
  o.haze = config.Number("haze", o.haze, {0, 1});
  o.rings = config.Integer("rings", o.rings, 1, 1000);
  o.sectors = config.Integer("sectors", o.sectors, 3, 1000);
  o.tilt_across = config.Number("tilt_across", o.tilt_across, {0, 1});
  o.tilt_up = config.Number("tilt_up", o.tilt_up, {0, 1});
  return o;
}

std::unique_ptr<Lamp> MakeBowl(const BowlOptions& options) {
  return std::make_unique<Bowl>(options);
}

}  // namespace luxfield::hal::sim
