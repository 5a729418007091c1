// What a pixel sees, resident on the device: the input of every estimator.
#pragma once

#include "luxfield/render/device/device.h"

namespace luxfield::render {

// One surface point per pixel, row-major from the top left, float4 each, world frame, metres.
struct GBuffer {
  int width = 0, height = 0;
  Buffer position;  // xyz; w = 1 where the pixel's ray hit something, else 0 and everything below
                    // is 0
  Buffer normal;    // xyz of unit length, on the side of the eye; w = 0; where surfaces are glossy
                    // its cosine to the eye is above 0
  Buffer albedo;    // xyz: base colour, linear Rec. 709 reflectance in [0, 1]; w: the kind of BRDF,
                    // kernels/brdf/brdf_types.clh
  // The rest of the BRDF's parameters, as the kind asks. Null: every surface is Lambertian, and
  // what reaches the eye is albedo / pi times the irradiance.
  Buffer gloss;
  // xyz: radiance that the surface sends out by itself. Null: none does.
  Buffer emission;
  cl_float4 eye{};  // world; read where surfaces are glossy

  GBuffer() = default;
  GBuffer(const Device& device, int width_, int height_, bool glossy = false, bool emissive = false)
      : width(width_),
        height(height_),
        position(device, pixel_count() * sizeof(cl_float4)),
        normal(device, pixel_count() * sizeof(cl_float4)),
        albedo(device, pixel_count() * sizeof(cl_float4)) {
    if (glossy) gloss = Buffer(device, pixel_count() * sizeof(cl_float4));
    if (emissive) emission = Buffer(device, pixel_count() * sizeof(cl_float4));
  }

  std::size_t pixel_count() const { return static_cast<std::size_t>(width) * height; }
  bool glossy() const { return static_cast<bool>(gloss); }
};

}  // namespace luxfield::render
