// Frames as files: EXR with AOVs, PNG for eyes, false colour with a legend.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/core/image.h"
#include "luxfield/render/film/frame.h"
#include "luxfield/render/film/tone.h"

namespace luxfield::render {

// One part, FLOAT channels named as layered viewers expect, docs/formats/render.md: R G B
// (radiance), A (alpha), irradiance.R/G/B, normal.X/Y/Z, position.X/Y/Z, coverage.Y, variance.Y,
// samples.Y, and of each light group GROUP.R/G/B, GROUP.irradiance.R/G/B, GROUP.variance.Y. Throws
// DeviceError.
void WriteFrame(const std::filesystem::path& path, const Frame& frame);

// The channels of a file of WriteFrame without light groups, and those of one group.
std::vector<std::string> ChannelNames();
std::vector<std::string> GroupChannelNames(const std::string& group);

// A file of WriteFrame: its layers, unit and provenance; alpha is the coverage in files that do not
// have it. Needs as much memory as its channels.
Frame ReadFrame(const std::filesystem::path& path);

// Surface points per pixel (RenderOptions::antialias) of pictures that are to be looked at.
constexpr int kSmoothAntialias = 4;

struct ToneMapping {
  std::optional<double> exposure;  // given: value * exposure, clipped at 1; else the curve
  // The curve's k; its average is the mean luminance of the picture (render/film/tone.h).
  double k = 1;
  ToneCurve curve = ToneCurve::kExponential;
};

// Display values in [0, 1] before sRGB encoding; 1 or 3 channels in, 3 out. Negative values are
// black.
core::Image ToneMap(const core::Image& linear, const ToneMapping& mapping);

// 8-bit sRGB PNG of values in [0, 1] (1 or 3 channels), rounded to nearest. Throws DeviceError.
void WritePng(const std::filesystem::path& path, const core::Image& linear01);

struct FalseColourScale {
  double min = 0, max = 0;  // 0 < min < max; both 0: from the picture
};

// The range that FalseColour picks: max = the 99.9th percentile of the positive values rounded up
// to 1, 2 or 5 times a power of ten, min = 3 decades below. 1e-3 to 1 for a picture without
// positive values.
FalseColourScale AutomaticScale(const core::Image& values);

// Luminance of `image` (Y of 3 channels, or the channel) on a logarithmic colour scale, with a
// legend on the right: ticks at 1, 2, 5 of every decade, `quantity` and `unit` as its title. Values
// below min take the lowest colour, zero and less are black. The PNG is image.width + 110 by
// max(image.height, 160) pixels. Throws InputError for a scale that is not 0 < min < max,
// DeviceError.
void WriteFalseColour(const std::filesystem::path& path, const core::Image& image,
                      const std::string& quantity, const std::string& unit,
                      FalseColourScale scale = {});

// A linear scale of colours, display values in [0, 1]; `position` goes from 0 at min to 1 at max.
struct ColourScale {
  double min = 0, max = 1;
  std::function<core::Rgb(double position)> colour;
};

// The single channel of `image` in these colours with a legend on the right: values beyond the
// scale take its ends' colours, NaN is black. The PNG is as wide and high as WriteFalseColour's.
// Throws DeviceError.
void WriteColourScale(const std::filesystem::path& path, const core::Image& image,
                      const std::string& quantity, const std::string& unit,
                      const ColourScale& scale);

// A colour and what it stands for.
struct ColourKey {
  std::string name;
  core::Rgb colour{};
};

// Three channels of display values in [0, 1] as they are, and the keys on the right; likewise.
void WriteColourKeys(const std::filesystem::path& path, const core::Image& image,
                     const std::string& quantity, const std::vector<ColourKey>& keys);

// What the legend writes at these values, all of them the same way: "0.002", "50", "500000" where the
// largest lies below 1e7 and the smallest above 0 is 1e-4 or more, else "0", "5e-6", "1.5e8"; to
// four digits.
std::vector<std::string> TickLabels(std::span<const double> values);

}  // namespace luxfield::render
