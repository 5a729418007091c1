// A lamp as a binary glTF 2.0 file (*.glb): its light-vector volume in the extension
// LUXFIELD_light_field (docs/formats/gltf-light-field.md), and for viewers that do not know it the far
// field in EXT_lights_ies and a spot light in KHR_lights_punctual.
//
// A light of glTF shines along -z of its node, C0 along +x and C90 along +y, so that the luminaire's
// frame is
//
//   u = x,   v = -y,   z = -z      of the node
//
// The spot light points along the mean direction of the light; its inner cone holds half of the
// flux, its outer cone 95 %, and with glTF's falloff between the two its flux is the lamp's:
//
//   I = flux / (2 pi (1 - cos a_i) + 2 pi (cos a_i - cos a_o) / 3)
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/lightfield/posed_light_field.h"
#include "luxfield/web/lamp_volume_fit.h"

namespace luxfield::bridges {

struct GltfLamp {
  web::FittedVolume fitted;
  std::size_t bytes = 0;  // of the file
};

// Throws InputError naming `source` where the light field is not of lm, the unit of glTF's lights, or
// holds no light.
//
//   WriteGltfLamp("lamp.glb", field, "lamp.lf.exr", {});
GltfLamp WriteGltfLamp(const std::filesystem::path& path, const lightfield::LightField& field,
                       const std::string& source, const web::FitOptions& options);

// The volume of such a file and what is stated of it; `packed` stays empty. InputError naming the
// file.
web::FittedVolume ReadGltfLamp(const std::filesystem::path& path);

}  // namespace luxfield::bridges
