#include "luxfield/render/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string_view>
#include <type_traits>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/pictures/write_png.h"

namespace luxfield::render {
namespace {

constexpr char kKind[] = "render";
constexpr int kVersion = 1;

constexpr std::string_view kProvenance = "luxfield:provenance.";

std::string GroupAttribute(std::size_t group) {
  return fmt::format("luxfield:light_group_{}", group + 1);
}

// An image of a frame, const or not, and the names of its channels.
template <typename Image>
struct Layer {
  std::vector<std::string> channels;
  Image* image;
};

template <typename Image>
void AddLayer(const std::string& layer, const std::string& names, Image& image,
              std::vector<Layer<Image>>& layers) {
  layers.push_back({{}, &image});
  for (const char name : names) layers.back().channels.push_back(layer + name);
}

template <typename Group, typename Image>
void AddGroup(Group& group, std::vector<Layer<Image>>& layers) {
  AddLayer(group.name + ".", "RGB", group.radiance, layers);
  AddLayer(group.name + ".irradiance.", "RGB", group.irradiance, layers);
  AddLayer(group.name + ".variance.", "Y", group.variance, layers);
}

template <typename AnyFrame>
auto LayersOf(AnyFrame& frame) {
  std::vector<Layer<std::remove_reference_t<decltype((frame.radiance))>>> layers;
  AddLayer("", "RGB", frame.radiance, layers);
  AddLayer("", "A", frame.alpha, layers);
  AddLayer("irradiance.", "RGB", frame.irradiance, layers);
  AddLayer("normal.", "XYZ", frame.normal, layers);
  AddLayer("position.", "XYZ", frame.position, layers);
  AddLayer("coverage.", "Y", frame.coverage, layers);
  AddLayer("variance.", "Y", frame.variance, layers);
  AddLayer("samples.", "Y", frame.samples, layers);
  for (auto& group : frame.groups) AddGroup(group, layers);
  return layers;
}

template <typename Image>
std::vector<std::string> NamesOf(const std::vector<Layer<Image>>& layers) {
  std::vector<std::string> names;
  for (const auto& layer : layers)
    names.insert(names.end(), layer.channels.begin(), layer.channels.end());
  return names;
}

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
  for (const auto& layer : LayersOf(frame))
    for (std::size_t c = 0; c < layer.channels.size(); ++c)
      part.channels.push_back({layer.channels[c], layer.image->plane(static_cast<int>(c))});
  part.attributes = {{"luxfield:kind", std::string(kKind)},
                     {"luxfield:version", kVersion},
                     {"luxfield:unit", FluxUnitName(frame.unit)}};
  for (std::size_t g = 0; g < frame.groups.size(); ++g)
    part.attributes[GroupAttribute(g)] = frame.groups[g].name;
  for (const auto& [name, value] : frame.provenance)
    part.attributes[std::string(kProvenance) + name] = value;
  core::WriteExr(path, std::span(&part, 1));
}

std::vector<std::string> ChannelNames() {
  const Frame frame;
  return NamesOf(LayersOf(frame));
}

std::vector<std::string> GroupChannelNames(const std::string& group) {
  const LightGroup named{group, {}, {}, {}};
  std::vector<Layer<const core::Image>> layers;
  AddGroup(named, layers);
  return NamesOf(layers);
}

Frame ReadFrame(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  if (!reader.parts()[0].attributes.contains("luxfield:kind") ||
      reader.GetString(0, "luxfield:kind") != kKind)
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
  const auto& attributes = reader.parts()[0].attributes;
  for (std::size_t g = 0; attributes.contains(GroupAttribute(g)); ++g)
    frame.groups.push_back({reader.GetString(0, GroupAttribute(g)), {}, {}, {}});
  for (const auto& attribute : attributes)
    if (const std::string& name = attribute.first; name.starts_with(kProvenance))
      frame.provenance[name.substr(kProvenance.size())] = reader.GetString(0, name);
  std::vector<core::ExrTarget> planes;
  for (const auto& layer : LayersOf(frame)) {
    if (layer.image == &frame.alpha && !reader.has_channel(0, "A")) continue;
    *layer.image = core::Image(frame.width, frame.height, static_cast<int>(layer.channels.size()));
    for (std::size_t c = 0; c < layer.channels.size(); ++c)
      planes.push_back({layer.channels[c], layer.image->plane(static_cast<int>(c))});
  }
  reader.Read(0, planes);
  if (frame.alpha.data.empty()) frame.alpha = frame.coverage;
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
      rgb = Toned(rgb, mapping.curve, mapping.k, average);
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
  pictures::WritePng(path, image);
}

}  // namespace luxfield::render
