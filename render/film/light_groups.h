// Light groups: the picture light by light, so that lights are dimmed without rendering again.
//
//   L = sum_g L_g,   E = sum_g E_g,   v = sum_g v_g
//
// of radiance, irradiance and the variance of the luminance. Groups scaled by s_g are the picture
//
//   L' = sum_g s_g L_g,   E' = sum_g s_g E_g,   v' = sum_g s_g^2 v_g
//
// as lights are sampled independently.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/image.h"

namespace luxfield::render {

struct Frame;  // render/film/frame.h

struct LightGroup {
  std::string
      name;  // of the light in scene.toml; "environment", with what is seen of it; "emission"
  core::Image radiance, irradiance;  // RGB, as Frame's
  core::Image variance;              // of the luminance of `radiance`, as Frame's
};

// The groups of a picture, black: one of each name that the lights have, in their order, and
// "emission" of surfaces that send out light. Throws InputError if two lights have one name, if a
// name would take another layer's channel, and for groups of more than 4 GiB.
std::vector<LightGroup> MakeLightGroups(std::span<const std::string> luminaires,
                                        std::span<const std::string> others, bool emissive,
                                        int width, int height);

// The same picture of scaled groups, which remain; groups that are not named keep 1. Its provenance
// gains "light_scales". Throws InputError naming `file` if it has no groups, and for names it does
// not have.
Frame ScaleLightGroups(Frame frame, const std::map<std::string, double>& scales,
                       const std::string& file);

}  // namespace luxfield::render
