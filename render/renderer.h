// From a scene to a lit picture: primary visibility, then every luminaire through an estimator.
//
//   L(pixel) = sum over luminaires of scale * L_o(p),   L_o = albedo / pi * E_n(p) on Lambertian
//   surfaces (THEORY.md 6 and 7)
//
// Light that reached them over other surfaces is not counted.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/image.h"
#include "lightfield/light_field.h"
#include "render/device_scene.h"
#include "render/estimators/estimator.h"
#include "scene/scene.h"

namespace luxfield::render {

struct RenderOptions {
  std::string estimator = "windowed";  // a name of EstimatorList()
  int samples_per_pixel = 200;  // light samples per pixel over all luminaires and pixel samples
  int antialias = 1;            // surface points per pixel; 1: the pixel's centre
  std::uint64_t seed = 1;
  bool shadows = true;
  float max_samples_per_image = 0;  // K_max of THEORY.md 6.2; 0: no bound

  // Throws InputError naming the option.
  void Validate() const;
};

struct RenderTimes {
  double gbuffer_s = 0;   // primary visibility
  double lighting_s = 0;  // estimators on resident G-buffers, without transfers
};

// What a camera sees. Images are height x width, row 0 on top; black where nothing was hit.
struct Frame {
  int width = 0, height = 0;
  lightfield::FluxUnit unit = lightfield::FluxUnit::kRelative;
  core::Image radiance;    // RGB, unit / (sr m^2): cd m^-2 for lm; mean over the pixel samples
  core::Image irradiance;  // RGB, unit / m^2: lx for lm; mean over the pixel samples that hit
  core::Image normal;      // xyz, world; of the pixel's first sample, as position
  core::Image position;    // xyz, world, metres
  core::Image coverage;    // share of the pixel samples that hit
  core::Image variance;    // estimated variance of the luminance of `radiance`
  core::Image samples;     // light samples taken
  RenderTimes times;
  lightfield::Provenance provenance;  // options and the SHA-256 of the files that were read
};

// "lx", "W/m2", "rel." and "cd/m2", "W/(sr m2)", "rel.".
std::string IrradianceUnitName(lightfield::FluxUnit unit);
std::string RadianceUnitName(lightfield::FluxUnit unit);

// A scene resident on a device: meshes, hierarchy, light fields and, where the estimator asks for
// them, tables. A light field that several luminaires share is uploaded once.
class Renderer {
 public:
  // Tables that the estimator needs are read where the scene names them or X.tab.exr lies beside
  // the light field, and built otherwise. Throws InputError for wrong options, luminaire files that
  // cannot be read, tables that belong to another light field, and luminaires of different units;
  // DeviceError.
  Renderer(const Device& device, const scene::Scene& scene, const RenderOptions& options);

  // Equal scenes, options and device types give equal frames, whatever the number of threads.
  // Throws Interrupted.
  Frame Render();

 private:
  struct LitBy {
    std::string name;
    std::shared_ptr<const LuminaireOnDevice> light_field;
    scene::Pose world_from_luminaire;
    double scale = 1;
  };

  void LoadLuminaires(const scene::Scene& scene);
  void RenderBand(int first_row, GBuffer& gbuffer, int pixel_sample, Frame& frame);
  void AddPixels(const GBuffer& gbuffer, const Lighting& lighting, float scale, int first_row,
                 Frame& frame) const;

  Device device_;
  RenderOptions options_;
  scene::Camera camera_;
  lightfield::Provenance provenance_;
  lightfield::FluxUnit unit_ = lightfield::FluxUnit::kRelative;
  std::unique_ptr<Estimator> estimator_;
  std::vector<LitBy> luminaires_;
  PrimaryVisibility primary_;
  DeviceScene scene_;
};

}  // namespace luxfield::render
