// The lamps of the simulated lab: radiance along any ray that crosses F and I.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include "luxfield/core/config.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::hal::sim {

using lightfield::Vec2;

// Radiance L(u->s) in W sr^-1 m^-2 (or the unit the lab is in), at full lamp power.
class Lamp {
 public:
  virtual ~Lamp() = default;
  // Planes that Radiance fills: 3 only where the colours differ in more than a factor.
  virtual int traced_channels() const { return 1; }
  // Factor of a colour channel on the traced plane (1 for lamps that trace three).
  virtual double channel_factor(int channel) const = 0;
  // True if no light passes F at u.
  virtual bool DarkAt(Vec2 u) const = 0;
  // L(u -> (s[k], t)) for all k, into radiance[plane * s.size() + k]; the image plane is z = delta.
  virtual void Radiance(Vec2 u, double delta_m, double t_m, std::span<const double> s_m,
                        std::span<double> radiance) const = 0;
  // Set if the lamp is a light field itself.
  virtual const lightfield::LightField* field() const { return nullptr; }
};

// From the [lamp] table: kind = "square", "headlight", "bowl", "filament" or "lightfield". Throws InputError.
std::unique_ptr<Lamp> MakeLamp(const core::Config& config, int channels);

// A square Lambertian emitter in the plane z = -depth, centred on the axis.
struct SquareOptions {
  double side_m = 0.1;
  double depth_m = 0;
  double radiance = 1;
  std::array<double, 3> colour{1, 1, 1};
};
std::unique_ptr<Lamp> MakeSquare(const SquareOptions& options);

std::unique_ptr<Lamp> MakeLightFieldLamp(lightfield::LightField field);

}  // namespace luxfield::hal::sim
