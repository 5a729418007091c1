// From a scene to a lit picture: primary visibility, then every luminaire through an estimator,
// then area lights and the environment map.
//
//   L(pixel) = sum over lights of scale * L_o(p),   L_o = albedo / pi * E_n(p) on Lambertian
//   surfaces (THEORY.md 6, 7 and 8), and what the surface sends out by itself; the environment's
//   own radiance where nothing was hit
//
// Light that reached them over other surfaces is not counted.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "lightfield/light_field.h"
#include "render/environment_background.h"
#include "render/light_groups.h"
#include "render/lit_scene.h"
#include "render/relit_pixels.h"
#include "render/shadow_maps.h"

namespace luxfield::render {

struct RenderOptions {
  std::string estimator = "cells";  // a name of EstimatorList()
  int samples_per_pixel = 200;      // light samples per pixel over all lights and pixel samples
  // Samples of each light instead, over all pixel samples: luminaires, area lights, environment, in
  // the scene's order; 0 leaves a light out. Empty: samples_per_pixel, shared equally.
  std::vector<int> light_samples;
  int width = 0, height = 0;        // of the picture, 0: the scene's
  // Samples of a pixel over samples_per_pixel: one channel of any size, stretched over the picture;
  // empty: 1 everywhere. Pixels of equal density are lit together, so it should have few values.
  // None takes less than two samples of a luminaire and pass where even pixels take two.
  // It must not depend on the samples it governs, or the picture is biased (Kirk and Arvo 1991).
  core::Image sample_density;
  bool background = true;  // whether the environment is seen where nothing is hit
  int antialias = 1;  // surface points per pixel; 1: the pixel's centre
  // Independent passes that the samples are split over. With two or more, the variance is taken
  // from the spread between passes. One pass is better, as its samples are stratified together; its
  // variance is what it states of itself, scaled by what pixels show that are lit again.
  int passes = 1;
  // Whether some pixels of a picture of one pass are lit again (render/relit_pixels.h). Without,
  // its variance is what it states of itself, which takes samples as independent and so is too
  // large, up to thirty times.
  bool relight = true;
  bool lights_apart = false;  // whether the frame tells lights apart (Frame::lights)
  bool light_groups = false;  // whether the frame has a picture of each light (Frame::groups)
  int first_pass = 0;  // passes of the same seed and different numbers draw independently
  std::uint64_t seed = 1;
  Shadows shadows = Shadows::kTraced;  // of other lights than luminaires: traced, or none
  int shadow_map_size = 192;           // texels along each side of a shadow map
  // Relative error asked of what approximates without noise: the volume's table, gloss.
  double approximation_error = 2e-3;
  float max_samples_per_image = 0;  // K_max of THEORY.md 6.2; 0: no bound
  Knobs knobs{};

  // Throws InputError naming the option.
  void Validate() const;
};

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

// The mean of two independent frames of the same view with the weights a and b, for instance their
// samples. Both tell their lights apart, or neither.
Frame MeanFrame(const Frame& frame_a, double a, const Frame& frame_b, double b);

// Takes pictures of a resident scene.
class Renderer {
 public:
  // Has the scene's tables made, and shadow maps cast. Throws InputError for wrong options and what
  // LitScene::Require refuses; DeviceError.
  Renderer(LitScene& scene, const RenderOptions& options);

  // Equal scenes, options and device types give equal frames, whatever the number of threads.
  // Throws Interrupted.
  Frame Render();

 private:
  // What one pass shows of a band: sums over the lights, per pixel.
  struct BandLight {
    BandLight(std::size_t pixels, std::size_t lights_apart)
        : radiance(pixels, cl_float4{}),
          irradiance(pixels, cl_float4{}),
          variance(pixels, 0.0f),
          samples(pixels, 0.0f),
          luminance(lights_apart, std::vector<float>(pixels, 0.0f)),
          stated(lights_apart, std::vector<float>(pixels, 0.0f)) {}
    std::vector<cl_float4> radiance, irradiance;
    std::vector<float> variance, samples;  // variance as the estimator states it
    // Of each light, where they are told apart: luminance and its variance.
    std::vector<std::vector<float>> luminance, stated;
    // Likewise, for light groups.
    std::vector<std::vector<cl_float4>> radiance_of, irradiance_of;
  };

  // What is known of a band's surface points on the host.
  struct BandSurface {
    std::vector<cl_float4> position, normal, albedo, gloss;  // gloss: empty if nothing is glossy
  };

  // Pixels that are lit together with the same number of samples.
  struct EquallySampled {
    double density = 1;
    std::vector<std::size_t> pixels;  // of the band; empty: all of them
    std::uint64_t seed = 0;           // of the random streams, with
    std::uint32_t first_pixel = 0;
    GBuffer gbuffer;                  // of these pixels alone, one after the other
    Lighting lighting;
  };

  // The parts of a band by sample_density. They have G-buffers of their own, so that work-items
  // next to each other have the same to do.
  std::vector<EquallySampled> BySamples(const GBuffer& gbuffer, const BandSurface& surface,
                                        int first_row) const;
  EquallySampled PartOf(const GBuffer& gbuffer, const BandSurface& surface,
                        std::vector<std::size_t> pixels) const;
  void RenderBand(int first_row, EquallySampled& band, int pixel_sample, Frame& frame);
  // Lights some pixels of a part again, which `light` shows, and adds what they tell to relit_ and
  // the frame's lights.
  void Relight(const EquallySampled& part, const GBuffer& gbuffer, const BandSurface& surface,
               int pixel_sample, const BandLight& light, Frame& frame);
  // Adds a pass to the groups.
  void AddToGroups(const BandLight& light, std::size_t first, Frame& frame) const;
  // Scales the groups' variances by what pixels that were lit again showed of each light.
  void ScaleGroups(Frame& frame) const;
  void ShowBackground(int first_row, const GBuffer& gbuffer, lightfield::Vec2 sample, Frame& frame);
  void ShowEmission(int first_row, const GBuffer& gbuffer, Frame& frame);
  int LightCount() const;
  // Samples of a light that a pass takes at a surface point, where density is `density`.
  int SamplesOf(int light, double density, int pixel_sample, int pass) const;
  // Sets of samples that all pixels share; 0: each has its own.
  int SharedSets() const;
  Visibility VisibilityOf(std::size_t luminaire) const;
  // Adds the light of one pass.
  void LightPart(EquallySampled& part, const std::vector<cl_float4>& albedo, int pixel_sample,
                 int pass, BandLight& light, RenderTimes& times);

  // Lights a part with light `number` by light(options), and adds `scale` of it.
  template <typename Light>
  void AddLight(EquallySampled& part, const std::vector<cl_float4>& albedo, int pixel_sample,
                int pass, int number, double scale, const Light& light, BandLight& sum,
                RenderTimes& times);

  LitScene& scene_;
  RenderOptions options_;
  scene::Camera camera_;
  Estimator& estimator_;
  std::vector<LightGroup> groups_;       // black, where they are asked for
  std::vector<std::size_t> group_of_;    // each light
  std::vector<ShadowMaps> shadow_maps_;  // one set per luminaire; empty: none are asked for
  PrimaryVisibility primary_;
  std::optional<EnvironmentBackground> background_;  // of scenes with an environment
  RelitPixels relit_;
};

}  // namespace luxfield::render
