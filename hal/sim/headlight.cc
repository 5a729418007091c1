#include "luxfield/hal/sim/headlight.h"

#include <cmath>
#include <numbers>

namespace luxfield::hal::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class Headlight : public Lamp {
 public:
  explicit Headlight(const HeadlightOptions& o)
      : o_(o),
        shield_distance_(o.lens_focal_m * (1 + o.shield_defocus)),
        edge_(-shield_distance_ * std::tan(o.cutoff_deg * kDegree)),
        kink_(std::tan(o.kink_deg * kDegree)),
        // The rim is where z = r^2 / 4p; the vertex lies that far behind it.
        vertex_to_shield_(o.mirror_radius_m * o.mirror_radius_m / (4 * o.mirror_focal_m) +
                          o.mirror_gap_m),
        normal_y_(std::sin(o.chip_tilt_deg * kDegree)),
        normal_z_(-std::cos(o.chip_tilt_deg * kDegree)) {}

  double channel_factor(int channel) const override { return o_.colour[channel]; }

  bool DarkAt(Vec2 u) const override {
    // The lens is lens_gap behind F; no ray of use is flatter than 60 degrees from the axis.
    const double reach = o_.lens_radius_m + 1.7321 * o_.lens_gap_m;
    return u.x * u.x + u.y * u.y > reach * reach;
  }

  void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                std::span<double> radiance) const override {
    const double slope_y = (t_m - u.y) / delta_m;
    const double lens_y = u.y - slope_y * o_.lens_gap_m;
    const double lens2 = o_.lens_radius_m * o_.lens_radius_m;
    for (std::size_t n = 0; n < s_m.size(); ++n) {
      const double slope_x = (s_m[n] - u.x) / delta_m;
      const double lens_x = u.x - slope_x * o_.lens_gap_m;
      const bool through_lens = lens_x * lens_x + lens_y * lens_y <= lens2;
      radiance[n] = through_lens ? BehindLens(lens_x, lens_y, slope_x, slope_y) : 0.0;
    }
  }

 private:
  double BehindLens(double lens_x, double lens_y, double slope_x, double slope_y) const {
    const double haze = o_.haze * o_.chip_radiance;
    // Slopes dx/dz behind the lens, and where the ray crosses the shield's plane.
    const double mx = slope_x + lens_x / o_.lens_focal_m;
    const double my = slope_y + lens_y / o_.lens_focal_m;
    const double x = lens_x - mx * shield_distance_;
    const double y = lens_y - my * shield_distance_;
    if (y < edge_ - kink_ * std::max(x, 0.0)) return haze;

    // The mirror z = r^2 / 4p about its own axis, z from its vertex: going back from the shield by
    // w, r(w) = (x, y - axis) - m w and vertex_to_shield - w = r^2 / 4p. The smaller w is the side
    // of the mirror that the ray meets first.
    const double p4 = 4 * o_.mirror_focal_m, ry = y - o_.mirror_axis_m;
    const double a = mx * mx + my * my, b = p4 - 2 * (x * mx + ry * my);
    const double c = x * x + ry * ry - p4 * vertex_to_shield_;
    const double discriminant = b * b - 4 * a * c;
    if (!(c < 0) || discriminant < 0) return haze;
    const double w = -2 * c / (b + std::sqrt(discriminant));
    const double hx = x - mx * w, hy = ry - my * w;
    const double r2 = hx * hx + hy * hy;
    if (!(w > 0) || r2 > o_.mirror_radius_m * o_.mirror_radius_m) return haze;

    // Reflect (-mx, -my, -1) about the inner normal (-hx / 2p, -hy / 2p, 1).
    const double nx = -2 * hx / p4, ny = -2 * hy / p4;
    const double dot = -mx * nx - my * ny - 1, scale = 2 * dot / (nx * nx + ny * ny + 1);
    const double dx = -mx - scale * nx, dy = -my - scale * ny, dz = -1 - scale;

    // Onto the chips' plane through the focus; only their front shines.
    const double hz = r2 / p4 - o_.mirror_focal_m;  // from the focus
    const double towards = dy * normal_y_ + dz * normal_z_;
    if (towards >= 0) return haze;
    const double k = -(hy * normal_y_ + hz * normal_z_) / towards;
    if (k <= 0) return haze;
    const double px = hx + k * dx;
    // Within the plane, along the direction perpendicular to x and to the normal.
    const double py = -(hy + k * dy) * normal_z_ + (hz + k * dz) * normal_y_;
    return haze +
           o_.transmission * o_.chip_radiance * Glow(px, o_.chip_columns) * Glow(py, o_.chip_rows);
  }

  // Relative radiance along one axis of the array, at a position from its middle.
  double Glow(double position, int count) const {
    const double pitch = o_.chip_m + o_.chip_gap_m, length = count * pitch - o_.chip_gap_m;
    const double inside = 0.5 * length - std::abs(position);  // from the border
    if (inside <= 0) return 0;
    const double from_start = position + 0.5 * length;
    const bool gap = from_start - pitch * std::floor(from_start / pitch) > o_.chip_m;
    const double fade =
        inside < o_.rim_m ? 0.5 - 0.5 * std::cos(std::numbers::pi * inside / o_.rim_m) : 1.0;
    return gap ? o_.gap_radiance * fade : fade;
  }

  HeadlightOptions o_;
  double shield_distance_, edge_, kink_, vertex_to_shield_, normal_y_, normal_z_;
};

}  // namespace

HeadlightOptions ReadHeadlight(const core::Config& config) {
  HeadlightOptions o;
  const auto length = [&](const char* key, double fallback) {
    return config.Number(key, fallback, {1e-5, 1});
  };
  o.chip_radiance = config.Number("chip_radiance", o.chip_radiance, {1e-300, 1e15});
  o.transmission = config.Number("transmission", o.transmission, {0, 1});
  o.haze = config.Number("haze", o.haze, {0, 1});
  o.chip_columns = config.Integer("chip_columns", o.chip_columns, 1, 100);
  o.chip_rows = config.Integer("chip_rows", o.chip_rows, 1, 100);
  o.chip_m = length("chip_m", o.chip_m);
  o.chip_gap_m = config.Number("chip_gap_m", o.chip_gap_m, {0, 1});
  o.gap_radiance = config.Number("gap_radiance", o.gap_radiance, {0, 1});
  o.rim_m = length("rim_m", o.rim_m);
  o.chip_tilt_deg = config.Number("chip_tilt_deg", o.chip_tilt_deg, {0, 90});
  o.mirror_focal_m = length("mirror_focal_m", o.mirror_focal_m);
  o.mirror_radius_m = length("mirror_radius_m", o.mirror_radius_m);
  o.mirror_axis_m = config.Number("mirror_axis_m", o.mirror_axis_m, {-1, 1});
  o.mirror_gap_m = config.Number("mirror_gap_m", o.mirror_gap_m, {0, 1});
  o.lens_focal_m = length("lens_focal_m", o.lens_focal_m);
  o.lens_radius_m = length("lens_radius_m", o.lens_radius_m);
  o.lens_gap_m = config.Number("lens_gap_m", o.lens_gap_m, {0, 1});
  o.shield_defocus = config.Number("shield_defocus", o.shield_defocus, {-0.5, 0.5});
  o.cutoff_deg = config.Number("cutoff_deg", o.cutoff_deg, {-45, 45});
  o.kink_deg = config.Number("kink_deg", o.kink_deg, {0, 60});
  return o;
}

std::unique_ptr<Lamp> MakeHeadlight(const HeadlightOptions& options) {
  return std::make_unique<Headlight>(options);
}

}  // namespace luxfield::hal::sim
