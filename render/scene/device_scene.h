// A scene's geometry in device memory, and primary visibility.
#pragma once

#include <memory>
#include <vector>

#include "luxfield/render/kernels/scene/gbuffer_types.clh"
#include "luxfield/render/scene/device_bvh.h"
#include "luxfield/render/scene/gbuffer.h"
#include "luxfield/render/scene/ray_scene.h"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

struct DeviceScene {
  Device device;
  std::shared_ptr<const RayScene> rays;
  Buffer vertices;        // SceneVertex, kernels/scene/gbuffer_types.clh
  Buffer triangles;       // SceneTriangle
  Buffer materials;       // SurfaceMaterial
  Buffer texels;          // 8-bit RGBA, all textures one after the other
  bool glossy = false;    // a material's look depends on the eye: G-buffers need their gloss
  bool emissive = false;  // a material sends out light: G-buffers need their emission
  // The hierarchy for kernels that trace rays or walk triangles themselves, built when first asked
  // for where `rays` has none.
  const DeviceBvh& bvh() const;
  mutable std::shared_ptr<const DeviceBvh> own_bvh{};
};

// Builds the hierarchy and uploads. Throws InputError if the scene is too large for the kernels'
// 32-bit numbers, DeviceError if the device cannot hold it.
DeviceScene UploadScene(const Device& device, const scene::Geometry& geometry);
// The same; vertices and triangles go as soon as the device has them.
DeviceScene UploadScene(const Device& device, scene::Geometry&& geometry);

// Other materials for the surfaces of an uploaded scene, as many and of the same kinds, with the same
// textures.
void ReplaceMaterials(const std::vector<scene::Material>& materials,
                      const std::vector<scene::Texture>& textures, DeviceScene& scene);

// A camera as kernels see it (kernels/scene/gbuffer_types.clh): rows [first_row, first_row + rows)
// of its picture; `sample` is the place in every pixel, (0.5, 0.5) its centre.
PinholeCamera MakePinhole(const scene::Camera& camera, int width, int first_row, int rows,
                          lightfield::Vec2 sample);

// Fills G-buffers with one ray per pixel. Positions are interpolated from the corners of the hit
// triangle (error some 2e-7 of its coordinates); normals are interpolated where the mesh has them,
// tilted by normal textures, turned to the camera's side, and bent towards the eye until their
// cosine to it is at least MIN_EYE_COSINE (kernels/scene/gbuffer.cl): BRDFs have no meaning below
// 0.
class PrimaryVisibility {
 public:
  explicit PrimaryVisibility(const Device& device);  // builds the kernels (cached on disk)

  // Rows [first_row, first_row + gbuffer.height) of the camera's picture; `sample` is the place in
  // every pixel, (0.5, 0.5) its centre. Sets the G-buffer's eye. The last piece may be under way
  // when this returns. A G-buffer without gloss keeps the base colour of glossy surfaces and calls them Lambertian.
  Event Render(const DeviceScene& scene, const scene::Camera& camera, int first_row,
               lightfield::Vec2 sample, GBuffer& gbuffer, WorkSize local = {16, 4});

 private:
  Device device_;
  Kernel cast_, shade_;
};

}  // namespace luxfield::render
