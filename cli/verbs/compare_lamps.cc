#include "luxfield/cli/verbs/compare_lamps.h"

#include <optional>

#include "luxfield/cli/verbs/lamp_noise.h"

namespace luxfield::cli {
namespace {

struct OneLamp {
  photometry::Lamp lamp;
  std::optional<photometry::ColourLamp> colour;
};

OneLamp Read(const std::string& file, const std::string& sigma) {
  const auto fields = lightfield::ReadLightFields(file);
  const LampNoise noise = ReadLampNoise(sigma);
  OneLamp one{photometry::LampOf(fields),
              ColourLampOf(fields, noise.sigma, noise.maps, noise.file)};
  SetNoise(one.lamp, noise);
  return one;
}

}  // namespace

ComparisonReport CompareLamps(const LampsToCompare& lamps) {
  const OneLamp a = Read(lamps.a, lamps.sigma_a), b = Read(lamps.b, lamps.sigma_b);
  const auto plane = PlaneOfBeam(DistributionOf(b.lamp), lamps.distance_m);
  const bool in_colour = a.colour && b.colour;
  return {lamps.a, lamps.b, a.lamp.unit,
          Compare(a.lamp, b.lamp, in_colour ? &*a.colour : nullptr,
                  in_colour ? &*b.colour : nullptr, plane)};
}

}  // namespace luxfield::cli
