// A lamp as a photometer sees it: light fields of one channel, and how uncertain they are.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/photometry/coefficient_noise.h"

namespace luxfield::photometry {

struct Lamp {
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  std::vector<lightfield::PosedLightField> fields;  // one channel each, their sum is the lamp
  std::vector<CoefficientNoise> noise;              // one for each field; empty: not known
  std::vector<double> channel_weights;              // of the channels that `fields` are made of
};

// The luminance Y of three channels, the only channel of one.
Lamp LampOf(std::span<const lightfield::PosedLightField> fields);

// The sum of factor times channel, one factor for each. Throws InputError naming `what` where a field
// has another number of channels.
Lamp LampOf(std::span<const lightfield::PosedLightField> fields, std::span<const double> weights,
            const std::string& what);

// Whose sigma is laid out as the field is: of the same sum, channels being independent. `maps`
// for each field. Throws InputError naming `file` where the geometries differ.
void SetNoise(Lamp& lamp, std::span<const lightfield::PosedLightField> sigma,
              std::span<const SolveMaps> maps, const std::string& file);

}  // namespace luxfield::photometry
