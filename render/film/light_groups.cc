#include "luxfield/render/film/light_groups.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/core/nearest.h"
#include "luxfield/render/film/film.h"

namespace luxfield::render {
namespace {

constexpr double kMostBytes = 4.0 * (1u << 30);

LightGroup Black(const std::string& name, int width, int height) {
  return {name, core::Image(width, height, 3), core::Image(width, height, 3),
          core::Image(width, height, 1)};
}

void RequireNames(const std::vector<std::string>& names) {
  std::set<std::string> taken;
  for (const auto& channel : ChannelNames()) taken.insert(channel);
  for (const auto& name : names)
    for (const auto& channel : GroupChannelNames(name))
      if (!taken.insert(channel).second)
        throw InputError(
            fmt::format("the light group '{}' would take the name of another layer "
                        "({}); rename the light in the scene",
                        name, channel));
}

// A sum of images, in double.
class Sum {
 public:
  explicit Sum(const core::Image& like)
      : image_(like.width, like.height, like.channels), values_(image_.data.size(), 0.0) {}

  void Add(const core::Image& from) {
    for (std::size_t i = 0; i < values_.size(); ++i) values_[i] += from.data[i];
  }
  core::Image Rounded() const {
    core::Image image = image_;
    for (std::size_t i = 0; i < values_.size(); ++i) image.data[i] = static_cast<float>(values_[i]);
    return image;
  }

 private:
  core::Image image_;
  std::vector<double> values_;
};

void Scale(core::Image& image, double factor) {
  for (float& value : image.data) value = static_cast<float>(factor * double{value});
}

}  // namespace

std::vector<LightGroup> MakeLightGroups(std::span<const std::string> luminaires,
                                        std::span<const std::string> others, bool emissive,
                                        int width, int height) {
  std::vector<std::string> names;
  // Each once: luminaires of several fields and lights in arrays come as often.
  for (const std::span<const std::string> kind : {luminaires, others}) {
    const auto first = static_cast<std::ptrdiff_t>(names.size());
    for (const auto& name : kind)
      if (std::find(names.begin() + first, names.end(), name) == names.end()) names.push_back(name);
  }
  if (emissive) names.push_back("emission");
  RequireNames(names);
  const double bytes = 7.0 * sizeof(float) * width * height * static_cast<double>(names.size());
  if (bytes > kMostBytes)
    throw InputError(fmt::format(
        "{} light groups of {} x {} pixels take {:.1f} GiB where 4 are allowed; render fewer "
        "pixels or lights at a time",
        names.size(), width, height, bytes / (1u << 30)));
  std::vector<LightGroup> groups;
  for (const auto& name : names) groups.push_back(Black(name, width, height));
  return groups;
}

Frame ScaleLightGroups(Frame frame, const std::map<std::string, double>& scales,
                       const std::string& file) {
  if (frame.groups.empty())
    throw InputError(file, "has no light groups", "render it with --light-groups");
  std::vector<std::string> names, said;
  for (const auto& group : frame.groups) names.push_back(group.name);
  for (const auto& [name, scale] : scales) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      const auto meant = core::Nearest(name, names);
      throw InputError(file, fmt::format("has no light group '{}'", name),
                       meant ? fmt::format("did you mean '{}'?", *meant)
                             : fmt::format("it has {}", fmt::join(names, ", ")));
    }
    if (!(scale >= 0 && scale <= 1e12))
      throw InputError(
          fmt::format("the scale {} of light group '{}' must be 0 to 1e12", scale, name));
    said.push_back(fmt::format("{} = {}", name, scale));
  }
  Sum radiance(frame.radiance), irradiance(frame.irradiance), variance(frame.variance);
  for (LightGroup& group : frame.groups) {
    const auto found = scales.find(group.name);
    const double s = found == scales.end() ? 1 : found->second;
    Scale(group.radiance, s);
    Scale(group.irradiance, s);
    Scale(group.variance, s * s);
    radiance.Add(group.radiance);
    irradiance.Add(group.irradiance);
    variance.Add(group.variance);
  }
  frame.radiance = radiance.Rounded();
  frame.irradiance = irradiance.Rounded();
  frame.variance = variance.Rounded();
  std::string& history = frame.provenance["light_scales"];
  history += (history.empty() ? "" : "; ") + fmt::format("{}", fmt::join(said, ", "));
  return frame;
}

}  // namespace luxfield::render
