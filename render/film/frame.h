// What a camera sees of a lit scene, what took how long, and means of such pictures.
#pragma once

#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/film/light_groups.h"

namespace luxfield::render {

struct RenderTimes {
  double gbuffer_s = 0;             // primary visibility
  double relighting_s = 0;          // of pixels that are lit again, not part of lighting_s
  double lighting_s = 0;            // estimators on resident G-buffers, without transfers
  double lighting_core_s = 0;       // the same in CPU time of this process
  std::vector<double> light_s;      // of lighting_s, each light's
  std::vector<KernelTime> kernels;  // device time of all of them
};

// What one light does to a picture.
struct LightTotals {
  double mean_luminance = 0;  // of a pixel
  double mean_variance = 0;  // of that luminance: mean over the pixels of a pixel's variance, which
                             // is measured as Frame::variance is; lights' add up
};

// What a camera sees. Images are height x width, row 0 on top; black where nothing was hit, but for
// the radiance of an environment.
struct Frame {
  int width = 0, height = 0;
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  core::Image radiance;    // RGB, unit / (sr m^2): cd m^-2 for lm; mean over the pixel samples
  core::Image irradiance;  // RGB, unit / m^2: lx for lm; mean over the pixel samples that hit
  core::Image normal;      // xyz, world; of the pixel's first sample, as position
  core::Image position;    // xyz, world, metres
  core::Image coverage;    // share of the pixel samples that hit
  core::Image alpha;       // the same, or 1 where the environment is seen behind
  core::Image variance;    // estimated variance of the luminance of `radiance`
  // The same as passes state it of themselves, taking samples as independent.
  core::Image stated_variance;
  // Of a picture of one pass, `variance` over `stated_variance`, and the variance of the factor's
  // logarithm.
  double variance_scale = 1, scale_log_variance = 0;
  core::Image samples;              // light samples taken
  std::vector<LightTotals> lights;  // where RenderOptions asks for it
  // Where it asks for them: their sums are radiance, irradiance and variance, up to rounding.
  std::vector<LightGroup> groups;
  RenderTimes times;
  lightfield::Provenance provenance;  // options and the SHA-256 of the files that were read
};

// "lx", "W/m2", "rel." and "cd/m2", "W/(sr m2)", "rel.".
std::string IrradianceUnitName(lightfield::FluxUnit unit);
std::string RadianceUnitName(lightfield::FluxUnit unit);

void AddTimes(const RenderTimes& times, RenderTimes& to);

// Of all values.
double SumOf(const core::Image& image);

// The mean of two independent frames of the same view with the weights a and b, for instance their
// samples. Both tell their lights apart, or neither.
Frame MeanFrame(const Frame& frame_a, double a, const Frame& frame_b, double b);

// The same with a weight of each pixel, one channel as large as the frames; where both are 0 the
// frames count alike. Totals of lights are left out.
Frame MeanFrame(const Frame& frame_a, const core::Image& a, const Frame& frame_b,
                const core::Image& b);

}  // namespace luxfield::render
