#include "luxfield/hal/sim/lamp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "luxfield/hal/sim/bowl.h"
#include "luxfield/hal/sim/filament.h"
#include "luxfield/hal/sim/headlight.h"

namespace luxfield::hal::sim {
namespace {

class Square : public Lamp {
 public:
  explicit Square(const SquareOptions& options) : options_(options) {}

  double channel_factor(int channel) const override { return options_.colour[channel]; }

  bool DarkAt(Vec2 u) const override {
    // Behind F any ray can start on the square; on F only points inside it shine.
    const double half = 0.5 * options_.side_m;
    return options_.depth_m == 0 && (std::abs(u.x) > half || std::abs(u.y) > half);
  }

  void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                std::span<double> radiance) const override {
    const double half = 0.5 * options_.side_m, k = options_.depth_m / delta_m;
    const bool inside_y = std::abs(u.y - k * (t_m - u.y)) <= half;
    for (std::size_t n = 0; n < s_m.size(); ++n)
      radiance[n] =
          inside_y && std::abs(u.x - k * (s_m[n] - u.x)) <= half ? options_.radiance : 0.0;
  }

 private:
  SquareOptions options_;
};

// A luminaire that lies in the span of a basis, exactly as its file has it.
class LightFieldLamp : public Lamp {
 public:
  explicit LightFieldLamp(lightfield::LightField field) : field_(std::move(field)) {}

  int traced_channels() const override { return field_.geometry.channels; }
  double channel_factor(int) const override { return 1; }
  const lightfield::LightField* field() const override { return &field_; }

  bool DarkAt(Vec2 u) const override {
    const auto& g = field_.geometry.grid;
    const double x = (u.x - g.u0_m) / g.spacing_m, y = (u.y - g.v0_m) / g.spacing_m;
    return x < 0 || y < 0 || x > g.width - 1 + g.basis.cells || y > g.height - 1 + g.basis.cells;
  }

  // docs/theory.md 2: L = delta^2 / cos^4 * sum C_ij(s) Phi_ij(u).
  void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                std::span<double> radiance) const override {
    std::fill(radiance.begin(), radiance.end(), 0.0);
    const auto& geometry = field_.geometry;
    const auto& grid = geometry.grid;
    const auto& lattice = geometry.lattice;
    const auto row = static_cast<int>(std::floor(lattice.row_of_t(t_m)));
    if (row < 0 || row >= lattice.height) return;
    const double x = (u.x - grid.u0_m) / grid.spacing_m, y = (u.y - grid.v0_m) / grid.spacing_m;
    const int last_i = std::min(grid.width - 1, static_cast<int>(std::floor(x)));
    const int last_j = std::min(grid.height - 1, static_cast<int>(std::floor(y)));
    for (int j = std::max(0, last_j - grid.basis.cells); j <= last_j; ++j)
      for (int i = std::max(0, last_i - grid.basis.cells); i <= last_i; ++i) {
        const double phi = grid.basis.Value(x - i) * grid.basis.Value(y - j);
        if (phi == 0) continue;
        for (int channel = 0; channel < geometry.channels; ++channel) {
          const float* texels = field_.image(grid.index(i, j), channel).data() +
                                static_cast<std::size_t>(row) * lattice.width;
          double* out = radiance.data() + channel * s_m.size();
          for (std::size_t n = 0; n < s_m.size(); ++n) {
            const auto column = static_cast<int>(std::floor(lattice.column_of_s(s_m[n])));
            if (column >= 0 && column < lattice.width) out[n] += phi * texels[column];
          }
        }
      }
    const double delta2 = delta_m * delta_m, dy = t_m - u.y;
    for (std::size_t n = 0; n < s_m.size(); ++n) {
      const double dx = s_m[n] - u.x;
      const double inverse_cos2 = (delta2 + dx * dx + dy * dy) / delta2;
      for (int channel = 0; channel < geometry.channels; ++channel)
        radiance[channel * s_m.size() + n] *= delta2 * inverse_cos2 * inverse_cos2;
    }
  }

 private:
  lightfield::LightField field_;
};

std::array<double, 3> ReadColour(const core::Config& config) {
  const auto values = config.Numbers("colour", 3, {1, 1, 1});
  for (const double value : values)
    if (value < 0) config.Fail("colour", "must not be negative");
  return {values[0], values[1], values[2]};
}

}  // namespace

std::unique_ptr<Lamp> MakeSquare(const SquareOptions& options) {
  return std::make_unique<Square>(options);
}

std::unique_ptr<Lamp> MakeLightFieldLamp(lightfield::LightField field) {
  return std::make_unique<LightFieldLamp>(std::move(field));
}

std::unique_ptr<Lamp> MakeLamp(const core::Config& config, int channels) {
  constexpr double kTiny = std::numeric_limits<double>::min();
  const std::string kind =
      config.Choice("kind", {"square", "headlight", "bowl", "filament", "lightfield"});
  if (kind == "square") {
    SquareOptions options;
    options.side_m = config.Number("side_m", {kTiny, 10});
    options.depth_m = config.Number("depth_m", 0, {0, 10});
    options.radiance = config.Number("radiance", {kTiny, 1e15});
    options.colour = ReadColour(config);
    return MakeSquare(options);
  }
  if (kind == "headlight") {
    HeadlightOptions options = ReadHeadlight(config);
    options.colour = ReadColour(config);
    return MakeHeadlight(options);
  }
  if (kind == "bowl") {
    BowlOptions options = ReadBowl(config);
    options.colour = ReadColour(config);
    return MakeBowl(options);
  }
  if (kind == "filament") {
    FilamentOptions options = ReadFilament(config);
    options.colour = ReadColour(config);
    return MakeFilament(options);
  }
  auto field = lightfield::ReadLightField(config.Path("file"));
  if (field.geometry.channels != channels)
    config.Fail("file",
                "has " + std::to_string(field.geometry.channels) + " channels, the lab " +
                    std::to_string(channels),
                "set lab.channels to the file's");
  return MakeLightFieldLamp(std::move(field));
}

}  // namespace luxfield::hal::sim
