#include "render/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/colour.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/file.h"

namespace luxfield::render {
namespace {

constexpr char kKind[] = "render";
constexpr int kVersion = 1;

core::Rgb PixelOf(const core::Image& image, std::size_t i) {
  const std::size_t n = image.plane_size();
  if (image.channels == 1) return {image.data[i], image.data[i], image.data[i]};
  return {image.data[i], image.data[n + i], image.data[2 * n + i]};
}

}  // namespace

void WriteFrame(const std::filesystem::path& path, const Frame& frame) {
  core::ExrPartView part;
  part.width = frame.width;
  part.height = frame.height;
  const auto add = [&](const std::string& layer, const core::Image& image,
                       const std::string& names) {
    for (int c = 0; c < image.channels; ++c)
      part.channels.push_back({layer + names[c], image.plane(c)});
  };
  add("", frame.radiance, "RGB");
  add("", frame.alpha, "A");
  add("irradiance.", frame.irradiance, "RGB");
  add("normal.", frame.normal, "XYZ");
  add("position.", frame.position, "XYZ");
  add("coverage.", frame.coverage, "Y");
  add("variance.", frame.variance, "Y");
  add("samples.", frame.samples, "Y");
  part.attributes = {{"luxfield:kind", std::string(kKind)},
                     {"luxfield:version", kVersion},
                     {"luxfield:unit", FluxUnitName(frame.unit)}};
  for (const auto& [name, value] : frame.provenance)
    part.attributes["luxfield:provenance." + name] = value;
  core::WriteExr(path, std::span(&part, 1));
}

Frame ReadFrame(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  if (reader.GetString(0, "luxfield:kind") != kKind)
    throw InputError(path.string(), "is not a rendered picture",
                     "use a file that 'luxfield render' wrote");
  if (const int version = reader.GetInt(0, "luxfield:version"); version != kVersion)
    throw InputError(path.string(),
                     fmt::format("luxfield:version = {} where {} is understood", version, kVersion),
                     "render it again");
  Frame frame;
  frame.width = reader.parts()[0].width;
  frame.height = reader.parts()[0].height;
  frame.unit = lightfield::FluxUnitFromName(reader.GetString(0, "luxfield:unit"));
  const auto read = [&](const std::string& layer) {
    core::Image image(frame.width, frame.height, 3);
    const std::vector<std::string> names = {layer + "R", layer + "G", layer + "B"};
    const std::vector<std::span<float>> planes = {image.plane(0), image.plane(1), image.plane(2)};
    reader.ReadFloats(0, names, planes);
    return image;
  };
  frame.radiance = read("");
  frame.irradiance = read("irradiance.");
  return frame;
}

core::Image ToneMap(const core::Image& linear, const ToneMapping& mapping) {
  core::Image out(linear.width, linear.height, 3);
  const std::size_t count = linear.plane_size();
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += core::Luminance(PixelOf(linear, i));
  const double average = count ? sum / static_cast<double>(count) : 0;
  for (std::size_t i = 0; i < count; ++i) {
    core::Rgb rgb = PixelOf(linear, i);
    if (mapping.exposure)
      for (double& value : rgb) value = std::clamp(value * *mapping.exposure, 0.0, 1.0);
    else
      rgb = core::ExponentialTone(rgb, mapping.k, average);
    for (int c = 0; c < 3; ++c) out.data[c * count + i] = static_cast<float>(rgb[c]);
  }
  return out;
}

void WritePng(const std::filesystem::path& path, const core::Image& linear01) {
  cv::Mat image(linear01.height, linear01.width, CV_8UC3);
  for (int row = 0; row < linear01.height; ++row)
    for (int column = 0; column < linear01.width; ++column) {
      const core::Rgb rgb =
          PixelOf(linear01, static_cast<std::size_t>(row) * linear01.width + column);
      for (int c = 0; c < 3; ++c)
        image.at<cv::Vec3b>(row, column)[2 - c] = static_cast<unsigned char>(
            std::lround(255 * core::SrgbEncode(std::isfinite(rgb[c]) ? rgb[c] : 0)));
    }
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes))
    throw DeviceError(path.string() + ": the PNG encoder failed");
  core::WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace luxfield::render
