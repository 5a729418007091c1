#include "luxfield/render/film/frame.h"

#include <algorithm>

namespace luxfield::render {

std::string IrradianceUnitName(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "lx";
    case lightfield::FluxUnit::kWatt:
      return "W/m2";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "rel.";
}

std::string RadianceUnitName(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "cd/m2";
    case lightfield::FluxUnit::kWatt:
      return "W/(sr m2)";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "rel.";
}

void ScaleVariances(Frame& frame) {
  frame.variance_scale = RelitScale(frame.relit);
  for (float& v : frame.variance.data) v *= static_cast<float>(frame.variance_scale);
}

double SumOf(const core::Image& image) {
  double sum = 0;
  for (const float x : image.data) sum += x;
  return sum;
}

void AddTimes(const RenderTimes& times, RenderTimes& to) {
  to.gbuffer_s += times.gbuffer_s;
  to.relighting_s += times.relighting_s;
  to.lighting_s += times.lighting_s;
  to.lighting_core_s += times.lighting_core_s;
  to.light_s.resize(std::max(to.light_s.size(), times.light_s.size()));
  for (std::size_t l = 0; l < times.light_s.size(); ++l) to.light_s[l] += times.light_s[l];
  for (const KernelTime& kernel : times.kernels) AddKernelTime(kernel, to.kernels);
}

Frame MeanFrame(const Frame& frame_a, double a, const Frame& frame_b, double b) {
  Frame mean = frame_a;
  const double weight_a = a / (a + b), weight_b = b / (a + b);
  const auto blend = [](core::Image& to, const core::Image& from, double keep, double add) {
    for (std::size_t i = 0; i < to.data.size(); ++i)
      to.data[i] = static_cast<float>(keep * to.data[i] + add * from.data[i]);
  };
  blend(mean.radiance, frame_b.radiance, weight_a, weight_b);
  blend(mean.irradiance, frame_b.irradiance, weight_a, weight_b);
  const double all_a = weight_a * weight_a * SumOf(frame_a.variance),
               all_b = weight_b * weight_b * SumOf(frame_b.variance);
  blend(mean.variance, frame_b.variance, weight_a * weight_a, weight_b * weight_b);
  blend(mean.stated_variance, frame_b.stated_variance, weight_a * weight_a, weight_b * weight_b);
  if (all_a + all_b > 0) {
    mean.variance_scale = (all_a + all_b) / SumOf(mean.stated_variance);
    mean.scale_log_variance =
        (all_a * all_a * frame_a.scale_log_variance + all_b * all_b * frame_b.scale_log_variance) /
        ((all_a + all_b) * (all_a + all_b));
  }
  blend(mean.samples, frame_b.samples, 1, 1);
  for (std::size_t g = 0; g < mean.groups.size(); ++g) {
    LightGroup& to = mean.groups[g];
    const LightGroup& from = frame_b.groups[g];
    blend(to.radiance, from.radiance, weight_a, weight_b);
    blend(to.irradiance, from.irradiance, weight_a, weight_b);
    blend(to.variance, from.variance, weight_a * weight_a, weight_b * weight_b);
  }
  for (std::size_t l = 0; l < mean.lights.size(); ++l) {
    LightTotals& to = mean.lights[l];
    const LightTotals& from = frame_b.lights[l];
    to.mean_luminance = weight_a * to.mean_luminance + weight_b * from.mean_luminance;
    to.mean_variance =
        weight_a * weight_a * to.mean_variance + weight_b * weight_b * from.mean_variance;
  }
  AddTimes(frame_b.times, mean.times);
  return mean;
}

}  // namespace luxfield::render
