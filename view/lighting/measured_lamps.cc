#include "luxfield/view/lighting/measured_lamps.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/cli/verbs/lamp_noise.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::view {
namespace {

constexpr std::string_view kLightField = ".lf.exr";

photometry::Lamp ReadLamp(const std::filesystem::path& light_field) {
  photometry::Lamp lamp = photometry::LampOf(lightfield::ReadLightFields(light_field));
  cli::SetNoise(lamp, cli::ReadLampNoise(SigmaBeside(light_field).string()));
  return lamp;
}

}  // namespace

std::filesystem::path SigmaBeside(const std::filesystem::path& light_field) {
  const std::string path = light_field.string();
  if (!path.ends_with(kLightField)) return path + ".sigma.lf.exr";
  return path.substr(0, path.size() - kLightField.size()) + ".sigma.lf.exr";
}

MeasuredLamps::MeasuredLamps(const scene::Scene& scene)
    : other_lights_(!scene.area_lights.empty() || !scene.classical_lights.empty() ||
                    scene.environment.has_value()) {
  for (const scene::Luminaire& luminaire : scene.luminaires) {
    if (!std::filesystem::exists(SigmaBeside(luminaire.light_field))) {
      lamps_.push_back(nullptr);
      continue;
    }
    auto known = files_.find(luminaire.light_field);
    if (known == files_.end())
      known = files_.emplace(luminaire.light_field, ReadLamp(luminaire.light_field)).first;
    lamps_.push_back(&known->second);
  }
}

std::optional<double> MeasuredLamps::RelativeSigma(lightfield::Vec3 p, lightfield::Vec3 normal,
                                                   std::span<const scene::PlacedLamp> lamps) const {
  if (other_lights_ || lamps.size() != lamps_.size() || files_.empty()) return {};
  struct Light {
    std::vector<photometry::Functional> of_lamps;
    std::vector<double> scales;
  };
  std::map<const photometry::Lamp*, Light> by_file;
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    const core::Rgb scale = scene::ChannelScale(lamps[l].scale, lamps[l].colour);
    if (!(std::ranges::max(scale) > 0)) continue;
    // A lamp is known by its luminance, which is not that of a colour of it.
    if (!lamps_[l] || std::ranges::min(scale) < std::ranges::max(scale)) return {};
    const scene::Pose luminaire_from_world = lamps[l].world_from_luminaire.Inverse();
    Light& light = by_file[lamps_[l]];
    light.of_lamps.push_back(photometry::IlluminanceAt(*lamps_[l], luminaire_from_world.Point(p),
                                                       luminaire_from_world.Vector(normal)));
    light.scales.push_back(scale[0]);
  }
  double sum = 0, variance = 0;
  for (const auto& [lamp, light] : by_file) {
    std::vector<photometry::FunctionalTerm> terms;
    for (std::size_t k = 0; k < light.scales.size(); ++k)
      terms.push_back({light.scales[k], &light.of_lamps[k]});
    const photometry::Estimate e = photometry::Evaluate(*lamp, photometry::Sum(terms));
    if (!e.u) return {};
    sum += e.value;
    variance += *e.u * *e.u;
  }
  if (!(sum > 0)) return {};
  return std::sqrt(variance) / sum;
}

}  // namespace luxfield::view
