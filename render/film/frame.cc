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

namespace {

// Of a pixel, both adding up to 1.
struct Weights {
  std::vector<float> a, b;
};

Weights EqualWeights(std::size_t pixels, double a, double b) {
  return {std::vector<float>(pixels, static_cast<float>(a / (a + b))),
          std::vector<float>(pixels, static_cast<float>(b / (a + b)))};
}

void Blend(const Weights& weights, const core::Image& from, core::Image& to) {
  const std::size_t pixels = to.plane_size();
  for (std::size_t i = 0; i < to.data.size(); ++i)
    to.data[i] = weights.a[i % pixels] * to.data[i] + weights.b[i % pixels] * from.data[i];
}

// Of the means, from those of what is averaged.
void BlendVariances(const Weights& weights, const core::Image& from, core::Image& to) {
  for (std::size_t i = 0; i < to.data.size(); ++i)
    to.data[i] =
        weights.a[i] * weights.a[i] * to.data[i] + weights.b[i] * weights.b[i] * from.data[i];
}

double SumOfVariances(const std::vector<float>& weights, const core::Image& variance) {
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i)
    sum += double{weights[i]} * weights[i] * variance.data[i];
  return sum;
}

Frame Mean(const Frame& frame_a, const Frame& frame_b, const Weights& weights) {
  Frame mean = frame_a;
  Blend(weights, frame_b.radiance, mean.radiance);
  Blend(weights, frame_b.irradiance, mean.irradiance);
  const double all_a = SumOfVariances(weights.a, frame_a.variance),
               all_b = SumOfVariances(weights.b, frame_b.variance);
  BlendVariances(weights, frame_b.variance, mean.variance);
  BlendVariances(weights, frame_b.stated_variance, mean.stated_variance);
  if (all_a + all_b > 0) {
    mean.variance_scale = (all_a + all_b) / SumOf(mean.stated_variance);
    mean.scale_log_variance =
        (all_a * all_a * frame_a.scale_log_variance + all_b * all_b * frame_b.scale_log_variance) /
        ((all_a + all_b) * (all_a + all_b));
  }
  for (std::size_t i = 0; i < mean.samples.data.size(); ++i)
    mean.samples.data[i] += frame_b.samples.data[i];
  for (std::size_t g = 0; g < mean.groups.size(); ++g) {
    LightGroup& to = mean.groups[g];
    const LightGroup& from = frame_b.groups[g];
    Blend(weights, from.radiance, to.radiance);
    Blend(weights, from.irradiance, to.irradiance);
    BlendVariances(weights, from.variance, to.variance);
  }
  AddTimes(frame_b.times, mean.times);
  return mean;
}

}  // namespace

Frame MeanFrame(const Frame& frame_a, double a, const Frame& frame_b, double b) {
  Frame mean = Mean(frame_a, frame_b, EqualWeights(frame_a.radiance.plane_size(), a, b));
  const double weight_a = a / (a + b), weight_b = b / (a + b);
  for (std::size_t l = 0; l < mean.lights.size(); ++l) {
    LightTotals& to = mean.lights[l];
    const LightTotals& from = frame_b.lights[l];
    to.mean_luminance = weight_a * to.mean_luminance + weight_b * from.mean_luminance;
    to.mean_variance =
        weight_a * weight_a * to.mean_variance + weight_b * weight_b * from.mean_variance;
  }
  return mean;
}

Frame MeanFrame(const Frame& frame_a, const core::Image& a, const Frame& frame_b,
                const core::Image& b) {
  Weights weights = EqualWeights(a.data.size(), 1, 1);
  for (std::size_t i = 0; i < a.data.size(); ++i)
    if (const float sum = a.data[i] + b.data[i]; sum > 0) {
      weights.a[i] = a.data[i] / sum;
      weights.b[i] = b.data[i] / sum;
    }
  Frame mean = Mean(frame_a, frame_b, weights);
  mean.lights.clear();
  return mean;
}

}  // namespace luxfield::render
