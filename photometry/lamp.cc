#include "luxfield/photometry/lamp.h"

#include <cmath>

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

// of(r, g, b) of three channels, the value itself of one.
template <typename F>
LightField Combined(const LightField& field, F&& of) {
  LightField one(OneChannel(field.geometry));
  one.provenance = field.provenance;
  if (field.geometry.channels == 1) {
    one.data = field.data;
    return one;
  }
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    const auto r = field.image(m, 0), g = field.image(m, 1), b = field.image(m, 2);
    const auto y = one.image(m, 0);
    for (std::size_t k = 0; k < y.size(); ++k)
      y[k] = static_cast<float>(of(core::Rgb{r[k], g[k], b[k]}));
  }
  return one;
}

double LuminanceSigma(const core::Rgb& sigma) {
  const core::Rgb& share = core::kLuminanceWeights;
  return std::hypot(share[0] * sigma[0], share[1] * sigma[1], share[2] * sigma[2]);
}

}  // namespace

Lamp LampOf(std::span<const PosedLightField> fields) {
  Lamp lamp;
  lamp.unit = fields.empty() ? lightfield::FluxUnit::kRelative : fields[0].field.geometry.unit;
  for (const PosedLightField& posed : fields)
    lamp.fields.push_back(
        {posed.name, posed.luminaire_from_field, Combined(posed.field, core::Luminance)});
  return lamp;
}

void SetNoise(Lamp& lamp, std::span<const PosedLightField> sigma, std::span<const SolveMaps> maps,
              const std::string& file) {
  const auto fit = [&] {
    if (sigma.size() != lamp.fields.size() || maps.size() != sigma.size()) return false;
    for (std::size_t k = 0; k < sigma.size(); ++k)
      if (!(OneChannel(sigma[k].field.geometry) == lamp.fields[k].field.geometry) ||
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
    lamp.noise.emplace_back(Combined(sigma[k].field, LuminanceSigma), maps[k]);
  }
}

}  // namespace luxfield::photometry
