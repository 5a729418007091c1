#include "luxfield/reconstruct/bracket/register_mosaic.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

// image_from_sensor after sensor = 2 plane + offset.
rig::Homography ImageFromPlane(const rig::Homography& image_from_sensor, Vec2 offset) {
  return image_from_sensor * rig::Homography({2, 0, offset.x, 0, 2, offset.y, 0, 0, 1});
}

std::optional<rig::Lens> OfPlane(std::optional<rig::Lens> lens, Vec2 offset) {
  if (lens) {
    lens->focal_px = 0.5 * lens->focal_px;
    lens->centre_px = 0.5 * (lens->centre_px - offset);
  }
  return lens;
}

// The mean of two images of the same light.
RegisteredImage Mean(const RegisteredImage& a, const RegisteredImage& b) {
  RegisteredImage mean = a;
  for (std::size_t p = 0; p < mean.value.size(); ++p) {
    mean.mask[p] = a.mask[p] | b.mask[p];
    const bool known = !(mean.mask[p] & lightfield::kUnknownMask);
    mean.value[p] = known ? 0.5f * (a.value[p] + b.value[p]) : 0;
    mean.sigma[p] = known ? 0.5f * std::hypot(a.sigma[p], b.sigma[p]) : 0;
    mean.count[p] = known ? 0.5f * (a.count[p] + b.count[p]) : 0;
  }
  return mean;
}

}  // namespace

MosaicRegistration::MosaicRegistration(const rig::Homography& image_from_sensor, int sensor_width,
                                       int sensor_height, const lightfield::Lattice& lattice,
                                       const std::optional<rig::Lens>& lens, const std::string& cfa,
                                       const std::vector<std::vector<float>>& irradiance_per_rate)
    : cfa_(cfa), sensor_width_(sensor_width) {
  if (sensor_width < 2 || sensor_height < 2)
    throw InputError(
        fmt::format("a sensor of {} x {} pixels has no colour mosaic; correct camera.cfa",
                    sensor_width, sensor_height));
  for (int site = 0; site < SitesOf(cfa); ++site) {
    const auto [row, column] = PixelOfSite(cfa, site, 0, 0);
    const int channel = rig::CfaChannel(cfa, row, column);
    const Vec2 offset{column - 0.5, row - 0.5};
    const std::vector<float>& scale = irradiance_per_rate[channel];
    sites_.push_back(
        {site, channel,
         Registration(ImageFromPlane(image_from_sensor, offset), (sensor_width - column + 1) / 2,
                      (sensor_height - row + 1) / 2, lattice, OfPlane(lens, offset)),
         scale.size() == 1 ? scale : PixelsOfSite(scale, sensor_width, sensor_height, site)});
  }
}

RegisteredImage MosaicRegistration::Apply(const MergedFrame& merged, int channel,
                                          Vec2 centre_m) const {
  std::optional<RegisteredImage> image;
  for (const Site& site : sites_) {
    if (site.channel != channel) continue;
    RegisteredImage one = site.registration.Apply(PixelsOfSite(merged, site.site),
                                                  site.irradiance_per_rate, centre_m);
    image = image ? Mean(*image, one) : std::move(one);
  }
  return std::move(*image);
}

std::vector<std::vector<std::vector<PixelShare>>> MosaicRegistration::Overlaps(
    int channel, Vec2 centre_m) const {
  std::vector<std::vector<std::vector<PixelShare>>> sites;
  for (const Site& site : sites_) {
    if (site.channel != channel) continue;
    auto& texels = sites.emplace_back(site.registration.Overlaps(centre_m));
    const int own_width = (sensor_width_ + 1 - site.site % 2) / 2;
    for (std::vector<PixelShare>& shares : texels)
      for (PixelShare& share : shares) {
        const auto own = static_cast<int>(share.pixel);
        const auto [row, column] = PixelOfSite(cfa_, site.site, own / own_width, own % own_width);
        share.pixel = static_cast<std::uint32_t>(row) * sensor_width_ + column;
      }
  }
  return sites;
}

}  // namespace luxfield::reconstruct
