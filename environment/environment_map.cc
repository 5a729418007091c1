#include "luxfield/environment/environment_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/radiance_hdr.h"
#include "luxfield/environment/disc_layout.h"
#include "luxfield/environment/environment_resampling.h"
#include "luxfield/environment/layout_of_shape.h"

namespace luxfield::environment {
namespace {

bool IsOpenExr(const std::filesystem::path& path) {
  return core::ReadStart(path, 4) == "\x76\x2f\x31\x01";
}

constexpr const char* kLayoutAttribute = "luxfield:layout";

// The layout and registration an OpenEXR file's attributes tell.
struct AttributeLayout {
  const char* attribute;
  EnvironmentLayout layout;
  TexelRegistration registration;
};
std::optional<AttributeLayout> ReadAttributeLayout(const core::ExrReader& reader) {
  const auto& attributes = reader.parts().front().attributes;
  const auto unknown = [&](const char* attribute, const std::string& value) {
    return InputError(reader.path().string(),
                      fmt::format("attribute {} = {} is not known", attribute, value),
                      "remove it and name the layout");
  };
  if (attributes.contains("envmap")) {
    const std::string value = reader.GetString(0, "envmap");
    if (value != "latlong" && value != "cube") throw unknown("envmap", value);
    return AttributeLayout{
        "envmap",
        value == "cube" ? EnvironmentLayout::kCube : EnvironmentLayout::kLatitudeLongitude,
        TexelRegistration::kNodes};
  }
  if (!attributes.contains(kLayoutAttribute)) return {};
  const std::string value = reader.GetString(0, kLayoutAttribute);
  const auto layout = EnvironmentLayoutFromName(value);
  if (!layout) throw unknown(kLayoutAttribute, value);
  return AttributeLayout{kLayoutAttribute, *layout, TexelRegistration::kCells};
}

core::Image ReadOpenExr(const std::filesystem::path& path, const core::ExrReader& reader) {
  if (reader.has_channel(0, "RY") || reader.has_channel(0, "BY"))
    throw InputError(path.string(), "channels RY, BY (luminance and chroma) are not read",
                     "convert the picture to channels R, G, B");
  return core::ReadExrImage(path);
}

// Linear Rec. 709 of the R, G, B that the file's `chromaticities` define; none where they are Rec.
// 709's or absent.
std::optional<core::Matrix3> Rec709OfFile(const core::ExrReader& reader) {
  if (!reader.parts().front().attributes.contains("chromaticities")) return {};
  core::Primaries p;
  std::istringstream text(reader.GetString(0, "chromaticities"));
  double distance = 0;
  for (const auto& [given, known] :
       {std::pair{&p.red, core::kRec709.red}, std::pair{&p.green, core::kRec709.green},
        std::pair{&p.blue, core::kRec709.blue}, std::pair{&p.white, core::kRec709.white}}) {
    text >> given->x >> given->y;
    distance = std::max({distance, std::abs(given->x - known.x), std::abs(given->y - known.y)});
  }
  if (distance <= 1e-3) return {};  // as writers round them
  try {
    return core::Rec709FromRgb(p);
  } catch (const InputError& error) {
    throw InputError(reader.path().string(), fmt::format("chromaticities: {}", error.what()),
                     "mend or remove the attribute");
  }
}

// Pixels that show something are not negative, and stay so.
void BringToRec709(const core::Matrix3& rec709_from_rgb, core::Image& image) {
  for (std::size_t k = 0; k < image.plane_size(); ++k) {
    const core::Rgb rgb = core::IntoGamut(
        core::Apply(rec709_from_rgb, {image.plane(0)[k], image.plane(1)[k], image.plane(2)[k]}));
    for (int c = 0; c < 3; ++c) image.plane(c)[k] = static_cast<float>(rgb[c]);
  }
}

// A square of an unfolded cube: where it lies, in squares, and what it shows.
struct CrossCell {
  int column, row;
  lightfield::Vec3 axis, right, up;
};
constexpr lightfield::Vec3 kForward = {0, -1, 0}, kBackward = {0, 1, 0}, kRight = {-1, 0, 0},
                           kLeft = {1, 0, 0}, kUp = {0, 0, 1}, kDown = {0, 0, -1};
// The viewer's front in the middle of the crossbar, its neighbours folded out around it.
constexpr std::array<CrossCell, 5> kCrossOfBoth = {{{1, 0, kUp, kRight, kBackward},
                                                    {0, 1, kLeft, kForward, kUp},
                                                    {1, 1, kForward, kRight, kUp},
                                                    {2, 1, kRight, kBackward, kUp},
                                                    {1, 2, kDown, kRight, kForward}}};
constexpr CrossCell kBackOfVertical = {1, 3, kBackward, kRight, kDown},
                    kBackOfHorizontal = {3, 1, kBackward, kLeft, kUp};

// The squares of a cross in the order and orientation of the strip, pixel by pixel.
core::Image StripOfCross(const core::Image& cross) {
  const bool vertical = cross.height > cross.width;
  const int n = cross.width / (vertical ? 3 : 4);
  std::vector<CrossCell> cells(kCrossOfBoth.begin(), kCrossOfBoth.end());
  cells.push_back(vertical ? kBackOfVertical : kBackOfHorizontal);
  core::Image strip(n, 6 * n, cross.channels);
  for (int row = 0; row < strip.height; ++row)
    for (int column = 0; column < n; ++column) {
      const lightfield::Vec3 w =
          DirectionFromPicture(EnvironmentLayout::kCube,
                               {(column + 0.5) / n, (row + 0.5) / strip.height})
              ->direction;
      const CrossCell& cell =
          *std::max_element(cells.begin(), cells.end(), [w](const auto& a, const auto& b) {
            return lightfield::Dot(a.axis, w) < lightfield::Dot(b.axis, w);
          });
      const double x = lightfield::Dot(cell.right, w) / lightfield::Dot(cell.axis, w),
                   y = lightfield::Dot(cell.up, w) / lightfield::Dot(cell.axis, w);
      const int from_column = cell.column * n + static_cast<int>(0.5 * (1 + x) * n),
                from_row = cell.row * n + static_cast<int>(0.5 * (1 - y) * n);
      for (int channel = 0; channel < cross.channels; ++channel)
        strip.at(channel, row, column) = cross.at(channel, from_row, from_column);
    }
  return strip;
}

EnvironmentLayout LayoutByShape(const std::filesystem::path& path, const core::Image& image) {
  if (const auto layout = LayoutOfShape(image.width, image.height)) return *layout;
  throw InputError(
      path.string(),
      fmt::format("its {} x {} pixels do not tell the layout", image.width, image.height),
      fmt::format("name it with --layout: {}", EnvironmentLayoutNames()));
}

void CheckShape(const std::filesystem::path& path, const EnvironmentPicture& picture) {
  const int width = picture.image.width, height = picture.image.height;
  const auto name = EnvironmentLayoutName(picture.layout);
  if (picture.layout == EnvironmentLayout::kCube) {
    if (height != 6 * width)
      throw InputError(path.string(), fmt::format("{} x {} pixels are no {}", width, height, name),
                       "six squares belong one below the other, N wide and 6 N high");
  } else if (FindDisc(picture.layout) && width != height) {
    throw InputError(path.string(), fmt::format("{} x {} pixels are no {}", width, height, name),
                     "crop it to the square around the disc");
  }
}

double PixelSolidAngle(const EnvironmentPicture& picture, const TexelEdges& edges, int row,
                       int column) {
  return PictureRectangleSolidAngle(picture.layout, edges.x[column], edges.x[column + 1],
                                    edges.y[row], edges.y[row + 1]);
}

TexelEdges EdgesOf(const EnvironmentPicture& picture) {
  return MakeTexelEdges(picture.layout, picture.registration, picture.image.width,
                        picture.image.height);
}

void CheckRadiance(const std::filesystem::path& path, const EnvironmentPicture& picture) {
  const core::Image& image = picture.image;
  const TexelEdges edges = EdgesOf(picture);
  for (int channel = 0; channel < image.channels; ++channel)
    for (int row = 0; row < image.height; ++row)
      for (int column = 0; column < image.width; ++column) {
        const float value = image.at(channel, row, column);
        if (std::isfinite(value) && value >= 0) continue;
        if (PixelSolidAngle(picture, edges, row, column) > 0)
          throw InputError(
              path.string(),
              fmt::format("row {}, column {} of channel {} holds {}", row, column,
                          image.channels == 1 ? "Y" : std::string(1, "RGB"[channel]), value),
              "radiance must be finite and not negative: mend the pixel");
      }
}

}  // namespace

EnvironmentPicture ReadEnvironmentPicture(const std::filesystem::path& path,
                                          std::optional<EnvironmentLayout> named) {
  EnvironmentPicture picture;
  std::optional<AttributeLayout> attribute;
  std::optional<core::Matrix3> rec709_from_rgb;
  if (IsOpenExr(path)) {
    const core::ExrReader reader(path);
    attribute = ReadAttributeLayout(reader);
    rec709_from_rgb = Rec709OfFile(reader);
    picture.image = ReadOpenExr(path, reader);
  } else {
    picture.image = core::ReadRadianceHdr(path);
  }
  if (attribute && named && attribute->layout != *named)
    throw InputError(
        path.string(),
        fmt::format("its {} attribute says {}, not {}", attribute->attribute,
                    EnvironmentLayoutName(attribute->layout), EnvironmentLayoutName(*named)),
        "leave the layout out");
  if (attribute) {
    picture.layout = attribute->layout;
    picture.registration = attribute->registration;
  } else {
    if (IsCross(picture.image.width, picture.image.height) &&
        named.value_or(EnvironmentLayout::kCube) == EnvironmentLayout::kCube)
      picture.image = StripOfCross(picture.image);
    picture.layout = named ? *named : LayoutByShape(path, picture.image);
  }
  CheckShape(path, picture);
  CheckRadiance(path, picture);
  if (rec709_from_rgb && picture.image.channels == 3)
    BringToRec709(*rec709_from_rgb, picture.image);
  return picture;
}

bool SaysEnvironmentLayout(const core::ExrReader& reader) {
  const auto& attributes = reader.parts().front().attributes;
  return attributes.contains("envmap") || attributes.contains(kLayoutAttribute);
}

void WriteEnvironmentPicture(const std::filesystem::path& path, const core::Image& image,
                             EnvironmentLayout layout, core::ExrAttributes attributes) {
  attributes[kLayoutAttribute] = std::string(EnvironmentLayoutName(layout));
  core::WriteExrImage(path, image, attributes);
}

core::Image CubeStrip(const CubeMap& cube) {
  const int n = cube.face_size;
  core::Image strip(n, 6 * n, 3);
  for (int row = 0; row < strip.height; ++row)
    for (int column = 0; column < n; ++column) {
      const auto shown = DirectionFromPicture(EnvironmentLayout::kCube,
                                              {(column + 0.5) / n, (row + 0.5) / strip.height});
      const std::size_t texel = cube.texel_of(shown->direction);
      for (int channel = 0; channel < 3; ++channel)
        strip.at(channel, row, column) = cube.data[3 * texel + channel];
    }
  return strip;
}

CubeMap MakeCubeMap(const EnvironmentPicture& picture, int face_size) {
  const core::Image& image = picture.image;
  if (face_size == 0) face_size = DefaultFaceSize(picture.layout, image.width);
  return CubeResampler(picture.layout, picture.registration, image.width, image.height,
                       face_size)(image);
}

BrightestPixel FindBrightestPixel(const EnvironmentPicture& picture) {
  const core::Image& image = picture.image;
  const TexelEdges edges = EdgesOf(picture);
  BrightestPixel brightest;
  double largest = -std::numeric_limits<double>::infinity();
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      core::Rgb radiance;
      for (int c = 0; c < 3; ++c) radiance[c] = image.at(image.channels == 3 ? c : 0, row, column);
      const double luminance = core::Luminance(radiance);
      if (!(luminance > largest)) continue;
      const double solid_angle = PixelSolidAngle(picture, edges, row, column);
      const auto centre = DirectionFromPicture(
          picture.layout,
          {0.5 * (edges.x[column] + edges.x[column + 1]), 0.5 * (edges.y[row] + edges.y[row + 1])});
      if (!centre || !(solid_angle > 0)) continue;
      largest = luminance;
      brightest = {row, column, radiance, centre->direction, solid_angle};
    }
  return brightest;
}

}  // namespace luxfield::environment
