// From a scene to a lit picture: primary visibility, then every luminaire through an estimator,
// then area lights and the environment map.
//
//   L(pixel) = sum over lights of scale * L_o(p)
//   L_o = albedo / pi * E_n(p)                        on Lambertian surfaces
//
// (docs/theory.md 6, 7 and 8), and what the surface sends out by itself; the environment's own
// radiance where nothing was hit.
//
// Light that reached them over other surfaces is not counted.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/core/progress.h"
#include "luxfield/render/film/band_film.h"
#include "luxfield/render/film/frame.h"
#include "luxfield/render/film/relit_pixels.h"
#include "luxfield/render/lights/environment_background.h"
#include "luxfield/render/lights/shadow_maps.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/many_lights.h"
#include "luxfield/render/significant_lights.h"

namespace luxfield::render {

struct RenderOptions {
  std::string estimator = "cells";  // a name of EstimatorList()
  // Light samples per pixel over all lights and pixel samples: no pixel takes more (but for `exact`,
  // `volume` and `gloss` with traced shadows, which take at least one of each luminaire, pixel sample
  // and pass). Of two or more luminaires and area lights each pixel draws those that its samples go
  // to (many_lights.h); with an environment these share the samples equally with it.
  int samples_per_pixel = 200;
  // Samples of each light instead, over all pixel samples: luminaires, area lights, environment, in
  // the scene's order; 0 leaves a light out. Empty: samples_per_pixel.
  std::vector<int> light_samples;
  int width = 0, height = 0;  // of the picture, 0: the scene's
  // Samples of a pixel over samples_per_pixel: one channel of any size, stretched over the picture;
  // empty: 1 everywhere. Pixels of equal density are lit together, so it should have few values.
  // None takes less than two samples of a pass where even pixels take two, and those of 0 none: no
  // light falls on them.
  // It must not depend on the samples it governs, or the picture is biased (Kirk and Arvo 1991).
  core::Image sample_density;
  bool background = true;  // whether the environment is seen where nothing is hit
  // Whether glossy surfaces are shown as Lambertian ones of their base colour, which every estimator
  // takes.
  bool matt = false;
  int antialias = 1;  // surface points per pixel; 1: the pixel's centre
  // Independent passes that the samples are split over. With two or more, the variance is taken
  // from the spread between passes. One pass is better, as its samples are stratified together; its
  // variance is what it states of itself, scaled by what pixels show that are lit again.
  int passes = 1;
  // Whether some pixels of a picture of one pass are lit again (render/film/relit_pixels.h).
  // Without, its variance is what it states of itself, which takes samples as independent and so is
  // too large, up to thirty times.
  bool relight = true;
  bool lights_apart = false;  // whether the frame tells lights apart (Frame::lights)
  bool light_groups = false;  // whether the frame has a picture of each light (Frame::groups)
  int first_pass = 0;         // passes of the same seed and different numbers draw independently
  std::uint64_t seed = 1;
  Shadows shadows = Shadows::kTraced;  // of other lights than luminaires: traced, or none
  int shadow_map_size = 0;  // texels along each side of a shadow map; 0: ShadowMapSize() says
  // Relative error asked of what approximates without noise: the volume's table, gloss.
  double approximation_error = 2e-3;
  float max_samples_per_image = 0;  // K_max of docs/theory.md 6.2; 0: no bound
  Knobs knobs{};

  // The size of shadow maps: that asked for, else 384 of soft ones, whose look-ups are fewer then,
  // and 192 of others.
  int ShadowMapSize() const;
  // Throws InputError naming the option.
  void Validate() const;
};

// Takes pictures of a resident scene.
class Renderer {
 public:
  // Bands bound the device memory, and the time until Ctrl-C is heard.
  static constexpr int kBandPixels = 1 << 16;

  // Has the scene's tables made, and shadow maps cast. Throws InputError for wrong options and what
  // LitScene::Require refuses; DeviceError.
  Renderer(LitScene& scene, const RenderOptions& options);

  // Equal scenes, options and device types give equal frames, whatever the number of threads.
  // Throws Interrupted.
  Frame Render();

 private:
  // Pixels that are lit together with the same number of samples.
  struct EquallySampled {
    double density = 1;
    std::vector<std::size_t> pixels;  // of the band; empty: all of them
    std::uint64_t seed = 0;           // of the random streams, with
    std::uint32_t first_pixel = 0;
    Buffer list;      // `pixels` on the device; null: all of them
    GBuffer gbuffer;  // of these pixels alone, one after the other
    Lighting lighting;
  };

  // Pixels of a band that are lit, part by part.
  struct LitPixels {
    std::vector<std::size_t> pixels;  // of the band
    std::vector<std::size_t> part;    // of each of them
    std::vector<float> densities;     // of each of them
    // What they and those next to them state, for samples as many as their own.
    std::vector<float> Guides(std::span<const float> stated, int width, int height) const;
  };
  static LitPixels PixelsOf(std::span<const EquallySampled> parts, std::span<const float> hits);

  // The parts of a band by sample_density, of pixels that hit something. They have G-buffers of
  // their own, so that work-items next to each other have the same to do.
  std::vector<EquallySampled> BySamples(const GBuffer& gbuffer, std::span<const float> hits,
                                        int first_row);
  EquallySampled PartOf(const GBuffer& gbuffer, std::vector<std::size_t> pixels);
  void RenderBand(int first_row, int rows, core::Progress& progress, Frame& frame);
  // Lights the band's points of one pixel sample in all passes.
  void LightPixelSample(EquallySampled& band, int first_row, int pixel_sample, BandFilm& film,
                        Frame& frame);
  // Lights some pixels of a band's parts again, which `sums` show, and adds what they tell to relit_
  // and the frame's lights.
  void Relight(std::span<const EquallySampled> parts, const GBuffer& gbuffer,
               std::span<const float> hits, int pixel_sample, const PassSums& sums, Frame& frame);
  // Normals and positions of the pixels' first points.
  void ShowSurfaces(const GBuffer& gbuffer, int first_row, Frame& frame) const;
  // What a band's film holds, over its pixel samples.
  void Develop(const BandFilm& film, int first_row, Frame& frame) const;
  // Scales the groups' variances by what pixels that were lit again showed of each light.
  void ScaleGroups(Frame& frame) const;
  double LitShare() const;  // of the pixels: sample_density is not 0
  int LightCount() const;
  // Sorts lights into such as are drawn from and such as are lit one by one.
  void SortLights();
  bool MayBeDrawn(std::size_t light);
  // Its table is added to `tables`, if it has one.
  BoundedLight Bound(std::size_t light, std::vector<BoundedTable>& tables) const;
  DrawnLight MakeDrawnLight(std::size_t light, std::vector<BoundedTable>& tables);
  // Throws InputError if there are fewer samples than strata, pixel samples and passes.
  void RequireSamples() const;
  // Samples that a pass takes at a surface point, where density is `density`, of those that share
  // samples_per_pixel: part `stratum` of strata_.
  int SamplesOf(int stratum, double density, int pixel_sample, int pass) const;
  // The same of a light of its own.
  int SamplesOfLight(int light, double density, int pixel_sample, int pass) const;
  // Options of light number 0 for so many samples.
  EstimatorOptions OptionsFor(const EquallySampled& part, int pixel_sample, int pass,
                              int samples) const;
  // Sets of samples that all pixels share; 0: each has its own.
  int SharedSets() const;
  Visibility VisibilityOf(std::size_t light) const;

  // Which pass a part is lit in, over all lights.
  struct Pass {
    int pixel_sample = 0, number = 0;
    BandFilm* film = nullptr;  // whose light groups it adds to; null: to none
  };
  void LightPart(EquallySampled& part, const Pass& pass, PassSums& sums, RenderTimes& times);
  // All lights that are lit one by one.
  void LightAlone(EquallySampled& part, const Pass& pass, PassSums& sums, RenderTimes& times);
  // One light of a pass.
  void AddLight(EquallySampled& part, const Pass& pass, int light, PassSums& sums,
                RenderTimes& times);

  LitScene& scene_;
  RenderOptions options_;
  scene::Camera camera_;
  Estimator& estimator_;  // of luminaires
  std::vector<PlacedLight> lights_;
  std::vector<int> alone_;          // lights that are lit one by one
  std::vector<int> stratum_of_;     // each light's part of the samples; -1: it takes none
  int strata_ = 0;                  // that share the samples; drawn lights are the last one
  std::optional<ManyLights> many_;  // the other lights
  // Of two or more luminaires that are lit without noise, and not by few look-ups: the first lights
  // of alone_.
  std::optional<SignificantLights> significant_;
  std::vector<LightGroup> groups_;       // black, where they are asked for
  std::vector<std::size_t> group_of_;    // each light
  std::vector<ShadowMaps> shadow_maps_;  // one set per luminaire; empty: none are asked for
  PrimaryVisibility primary_;
  FilmKernels film_kernels_;
  std::optional<EnvironmentBackground> background_;  // where an environment is seen
  RelitPixels relit_;
};

}  // namespace luxfield::render
