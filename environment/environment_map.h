// Environment maps from files: Radiance and OpenEXR pictures in any layout
// (docs/formats/environment.md).
#pragma once

#include <filesystem>
#include <optional>

#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/image.h"
#include "luxfield/environment/cube_map.h"
#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// A picture as it is in the file, and how directions lie on it.
struct EnvironmentPicture {
  core::Image image;  // 3 channels of linear Rec. 709, or 1; radiance in the file's unit
  EnvironmentLayout layout = EnvironmentLayout::kLatitudeLongitude;
  TexelRegistration registration = TexelRegistration::kCells;
};

// Reads a Radiance picture (core/radiance_hdr.h) or channels R, G, B or Y of an OpenEXR file's
// first part, at full resolution where there are several; a `chromaticities` attribute's R, G, B
// become Rec. 709, white staying white (core/primaries.h). The layout is, in this order: an OpenEXR
// `envmap` attribute's (pixels registered as kNodes), that of the attribute `luxfield:layout`, the
// one that is named, latitude-longitude for a picture twice as wide as high, cube for one six times
// as high as wide and for the crosses of 3 : 4 and 4 : 3, which become such a strip, pixel by
// pixel.
//
// Throws InputError naming the file: a shape that tells no layout and none named; an attribute that
// contradicts the name or is unknown; a disc that is not square or a cube that is not 1 : 6;
// radiance that is negative or not finite (in a pixel that shows something: what lies outside of a
// disc is not looked at).
EnvironmentPicture ReadEnvironmentPicture(const std::filesystem::path& path,
                                          std::optional<EnvironmentLayout> named = {});

// Whether an OpenEXR file says that it is an environment map: by one of the two attributes.
bool SaysEnvironmentLayout(const core::ExrReader& reader);

// Writes a picture of 1 or 3 channels, its pixels equal rectangles (kCells), as OpenEXR FLOAT with
// the attribute `luxfield:layout`. Throws DeviceError.
void WriteEnvironmentPicture(const std::filesystem::path& path, const core::Image& image,
                             EnvironmentLayout layout, core::ExrAttributes attributes = {});

// A cube map as a picture of layout kCube: MakeCubeMap of it is the map again, texel by texel.
core::Image CubeStrip(const CubeMap& cube);

// The picture as a cube map (CubeResampler); face_size 0 is DefaultFaceSize. For a sequence build
// one CubeResampler instead.
CubeMap MakeCubeMap(const EnvironmentPicture& picture, int face_size = 0);

// The pixel of largest luminance among those that show something; the first of equals.
struct BrightestPixel {
  int row = 0, column = 0;
  core::Rgb radiance{};
  lightfield::Vec3 direction;  // of the pixel's centre
  double solid_angle_sr = 0;   // of the whole pixel
};
BrightestPixel FindBrightestPixel(const EnvironmentPicture& picture);

}  // namespace luxfield::environment
