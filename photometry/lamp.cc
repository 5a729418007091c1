#include "luxfield/photometry/lamp.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numeric>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;

lightfield::LuminaireGeometry OneChannel(lightfield::LuminaireGeometry geometry) {
  geometry.channels = 1;
  return geometry;
}

// of(values of a texel, weights) of every texel.
template <typename F>
LightField Combined(const LightField& field, std::span<const double> weights, F&& of) {
  LightField one(OneChannel(field.geometry));
  one.provenance = field.provenance;
  std::vector<double> values(weights.size());
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    const auto to = one.image(m, 0);
    for (std::size_t k = 0; k < to.size(); ++k) {
      for (std::size_t channel = 0; channel < values.size(); ++channel)
        values[channel] = field.image(m, static_cast<int>(channel))[k];
      to[k] = static_cast<float>(of(values, weights));
    }
  }
  return one;
}

double WeighedSum(std::span<const double> values, std::span<const double> weights) {
  return std::inner_product(values.begin(), values.end(), weights.begin(), 0.0);
}

double WeighedSigma(std::span<const double> sigma, std::span<const double> weights) {
  double variance = 0;
  for (std::size_t k = 0; k < sigma.size(); ++k)
    variance += weights[k] * sigma[k] * weights[k] * sigma[k];
  return std::sqrt(variance);
}

}  // namespace

Lamp LampOf(std::span<const PosedLightField> fields) {
  if (fields.empty() || fields[0].field.geometry.channels == 1)
    return LampOf(fields, std::array{1.0}, "");
  return LampOf(fields, core::kLuminanceWeights, "");
}

Lamp LampOf(std::span<const PosedLightField> fields, std::span<const double> weights,
            const std::string& what) {
  Lamp lamp;
  lamp.unit = fields.empty() ? lightfield::FluxUnit::kRelative : fields[0].field.geometry.unit;
  lamp.channel_weights.assign(weights.begin(), weights.end());
  for (const PosedLightField& posed : fields) {
    if (posed.field.geometry.channels != static_cast<int>(weights.size()))
      throw InputError(what,
                       fmt::format("has {} factors, and the light field has {} channels",
                                   weights.size(), posed.field.geometry.channels),
                       "give a factor for each channel");
    lamp.fields.push_back(
        {posed.name, posed.luminaire_from_field, Combined(posed.field, weights, WeighedSum)});
  }
  return lamp;
}

void SetNoise(Lamp& lamp, std::span<const PosedLightField> sigma, std::span<const SolveMaps> maps,
              const std::string& file) {
  const auto fit = [&] {
    if (sigma.size() != lamp.fields.size() || maps.size() != sigma.size()) return false;
    for (std::size_t k = 0; k < sigma.size(); ++k)
      if (sigma[k].field.geometry.channels != static_cast<int>(lamp.channel_weights.size()) ||
          !(OneChannel(sigma[k].field.geometry) == lamp.fields[k].field.geometry) ||
          !(sigma[k].luminaire_from_field == lamp.fields[k].luminaire_from_field))
        return false;
    return true;
  };
  if (!fit())
    throw InputError(file, "is of another geometry than the light field",
                     "name the file that `luxfield reconstruct --sigma` wrote beside it");
  lamp.noise.clear();
  for (std::size_t k = 0; k < sigma.size(); ++k) {
    for (const float value : sigma[k].field.data)
      if (!(value >= 0))
        throw InputError(file, "holds a negative value, which is no standard deviation",
                         "name the file that `luxfield reconstruct --sigma` wrote");
    lamp.noise.emplace_back(Combined(sigma[k].field, lamp.channel_weights, WeighedSigma), maps[k]);
  }
}

}  // namespace luxfield::photometry
