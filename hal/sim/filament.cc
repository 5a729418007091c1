#include "luxfield/hal/sim/filament.h"

#include <cmath>
#include <numbers>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::hal::sim {
namespace {

using lightfield::Vec3;

// Beyond sqrt(32) deviations the coil is dark: it glows with 1e-7 of L_0 there.
constexpr double kDark2 = 32;

class Filament : public Lamp {
 public:
  explicit Filament(const FilamentOptions& o)
      : colour_(o.colour),
        opening2_(o.opening_m * o.opening_m),
        coil_{o.coil_radiance,
              o.coil_radius_m,
              o.coil_length_m,
              {0, 0, -o.gap_m},
              o.coil_turn_deg * std::numbers::pi / 180} {}

  double channel_factor(int channel) const override { return colour_[channel]; }

  bool DarkAt(Vec2 u) const override { return u.x * u.x + u.y * u.y > opening2_; }

  void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                std::span<double> radiance) const override {
    const bool dark = DarkAt(u);
    for (std::size_t n = 0; n < s_m.size(); ++n)
      radiance[n] = dark ? 0 : coil_.Radiance({u.x, u.y, 0}, {s_m[n] - u.x, t_m - u.y, delta_m});
  }

 private:
  std::array<double, 3> colour_;
  double opening2_;
  Coil coil_;
};

}  // namespace

double Coil::Radiance(Vec3 point, Vec3 direction) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  const auto scaled = [&](Vec3 v) {
    return Vec3{(c * v.x + s * v.y) / length_m, (c * v.y - s * v.x) / radius_m, v.z / radius_m};
  };
  const Vec3 d = scaled(direction), p = scaled(point - centre);
  const double d2 = Dot(d, d), along = Dot(p, d);
  const double q2 = Dot(p, p) - along * along / d2;
  if (q2 > kDark2) return 0;
  const double across = Length(direction) / (radius_m * std::sqrt(d2));  // 1 / |d'|
  return radiance * std::exp(-0.5 * q2) * across;
}

FilamentOptions ReadFilament(const core::Config& config) {
  FilamentOptions o;
  o.coil_radiance = config.Number("coil_radiance", o.coil_radiance, {1e-300, 1e15});
  o.coil_radius_m = config.Number("coil_radius_m", o.coil_radius_m, {1e-5, 1});
  o.coil_length_m = config.Number("coil_length_m", o.coil_length_m, {1e-5, 1});
  o.coil_turn_deg = config.Number("coil_turn_deg", o.coil_turn_deg, {-360, 360});
  o.gap_m = config.Number("gap_m", o.gap_m, {0, 1});
  o.opening_m = config.Number("opening_m", o.opening_m, {1e-5, 10});
  return o;
}

std::unique_ptr<Lamp> MakeFilament(const FilamentOptions& options) {
  return std::make_unique<Filament>(options);
}

}  // namespace luxfield::hal::sim
