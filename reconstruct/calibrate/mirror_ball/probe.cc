#include "luxfield/reconstruct/calibrate/mirror_ball/probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_resampling.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"
#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

namespace luxfield::reconstruct {
namespace {

using environment::CubeMap;
using lightfield::Vec3;

// The picture that errors name: of several exposures that whose pixels fill up last.
std::string PictureFile(const ProbeDescription& description) {
  if (description.merged) return description.merged->string();
  const auto darkest =
      std::min_element(description.exposures.begin(), description.exposures.end(),
                       [](const ProbeExposure& a, const ProbeExposure& b) {
                         return a.exposure_s * a.attenuation < b.exposure_s * b.attenuation;
                       });
  return darkest->files[0].string();
}

ProbeOptics OpticsOf(const ProbePicture& picture, const ProbeDescription& description) {
  ProbeOptics optics = description.optics;
  if (!description.has_principal_point)
    optics.principal_point = {0.5 * picture.radiance.width, 0.5 * picture.radiance.height};
  return optics;
}

// Saturated pixels hold lower bounds with a sigma as large; the mask and the sigma of all others
// are in what they weigh.
ProbePicture TakeMerged(const ProbeDescription& description) {
  MergedPicture merged = ReadMergedPicture(*description.merged);
  ProbePicture picture = {std::move(merged.radiance), std::move(merged.sigma), {}};
  picture.unknown = core::Image(picture.radiance.width, picture.radiance.height, 1);
  const std::size_t pixels = picture.unknown.data.size();
  std::vector<bool> saturated(pixels);
  for (std::size_t k = 0; k < picture.radiance.data.size(); ++k) {
    const auto scale = static_cast<float>(description.radiance_per_rate[k / pixels]);
    picture.radiance.data[k] *= scale;
    picture.sigma.data[k] *= scale;
    if (merged.mask[k] == lightfield::kSaturated) saturated[k % pixels] = true;
  }
  for (std::size_t k = 0; k < pixels; ++k) {
    if (!saturated[k]) continue;
    if (description.take_lower_bounds)
      ++picture.lower_bounds;
    else
      picture.unknown.data[k] = 1;
  }
  return picture;
}

core::Image Brightness(const core::Image& radiance) {
  if (radiance.channels == 1) return radiance;
  core::Image sum(radiance.width, radiance.height, 1);
  for (std::size_t k = 0; k < sum.data.size(); ++k)
    sum.data[k] = static_cast<float>(
        core::Luminance({radiance.plane(0)[k], radiance.plane(1)[k], radiance.plane(2)[k]}));
  return sum;
}

core::Image ReadMask(const std::filesystem::path& path, const core::Image& like) {
  core::Image mask;
  if (path.extension() == ".png") {
    const PictureStack stack = ReadPictureStack(std::span(&path, 1), std::vector<double>{1}, 1);
    mask = core::Image(stack.width, stack.height, 1);
    std::copy_n(stack.plane(0, 0).begin(), mask.data.size(), mask.data.begin());
  } else {
    const auto planes = ReadProbePicture({{path}, 1, 1});
    mask = core::Image(planes[0].width, planes[0].height, 1);
    for (std::size_t k = 0; k < mask.data.size(); ++k) mask.data[k] = planes[0].at(k);
  }
  if (mask.width != like.width || mask.height != like.height)
    throw InputError(path.string(),
                     fmt::format("is {} x {} pixels, the photograph {} x {}", mask.width,
                                 mask.height, like.width, like.height),
                     "a mask covers the photograph pixel by pixel");
  return mask;
}

// The four texels beside one, also across the cube's edges.
std::array<std::size_t, 4> Neighbours(const CubeMap& cube, std::size_t texel) {
  const int n = cube.face_size;
  const int face = static_cast<int>(texel / n / n), row = static_cast<int>(texel / n % n),
            column = static_cast<int>(texel % n);
  const double step = 2.0 / n, x = -1 + (column + 0.5) * step, y = 1 - (row + 0.5) * step;
  const auto at = [&](double u, double v) {
    return cube.texel_of(environment::CubeVector({face, u, v}));
  };
  return {at(x - step, y), at(x + step, y), at(x, y - step), at(x, y + step)};
}

// Unseen texels take the mean of their known neighbours, layer by layer from the border inwards;
// all of them the spread of the first layer as their standard deviation. Returns their solid angle.
double Fill(Probe& probe) {
  const std::size_t count = probe.coverage.size();
  const std::vector<double> angles = environment::TexelSolidAngles(probe.radiance.face_size);
  std::vector<bool> known(count);
  std::vector<std::size_t> unseen;
  for (std::size_t t = 0; t < count; ++t) {
    known[t] = probe.coverage[t] > 0;
    if (!known[t]) unseen.push_back(t);
  }
  if (unseen.size() == count) return 0;
  const std::vector<std::size_t> filled = unseen;
  core::Rgb sum{}, squares{};
  std::size_t border = 0;
  for (bool first = true; !unseen.empty(); first = false) {
    std::vector<std::pair<std::size_t, core::Rgb>> layer;
    std::vector<std::size_t> left;
    for (const std::size_t t : unseen) {
      core::Rgb mean{};
      int neighbours = 0;
      for (const std::size_t other : Neighbours(probe.radiance, t)) {
        if (!known[other]) continue;
        ++neighbours;
        for (std::size_t c = 0; c < 3; ++c) mean[c] += probe.radiance.data[3 * other + c];
      }
      if (neighbours == 0) {
        left.push_back(t);
        continue;
      }
      for (double& value : mean) value /= neighbours;
      layer.emplace_back(t, mean);
    }
    for (const auto& [t, mean] : layer) {
      known[t] = true;
      for (std::size_t c = 0; c < 3; ++c) {
        probe.radiance.data[3 * t + c] = static_cast<float>(mean[c]);
        if (first) sum[c] += mean[c], squares[c] += mean[c] * mean[c];
      }
      border += first;
    }
    unseen = std::move(left);
  }
  double solid_angle = 0;
  for (const std::size_t t : filled) {
    solid_angle += angles[t % angles.size()];
    for (std::size_t c = 0; c < 3; ++c) {
      const double mean = sum[c] / double(border);
      probe.sigma.data[3 * t + c] =
          static_cast<float>(std::sqrt(std::max(0.0, squares[c] / double(border) - mean * mean)));
    }
  }
  return solid_angle;
}

// Negative texels to 0; the share of the luminous energy that this adds.
double CutNegative(CubeMap& cube) {
  const std::vector<double> angles = environment::TexelSolidAngles(cube.face_size);
  double added = 0, energy = 0;
  for (std::size_t t = 0; t < cube.texel_count(); ++t) {
    core::Rgb cut{}, left{};
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = cube.data[3 * t + c];
      if (value < 0) cut[c] = -value, value = 0;
      left[c] = value;
    }
    added += angles[t % angles.size()] * core::Luminance(cut);
    energy += angles[t % angles.size()] * core::Luminance(left);
  }
  return energy > 0 ? added / energy : 0;
}

}  // namespace

ProbePicture MergeProbe(const ProbeDescription& description) {
  if (description.merged) return TakeMerged(description);
  std::vector<std::vector<session::RawFrame>> pictures;
  for (const ProbeExposure& exposure : description.exposures) {
    pictures.push_back(ReadProbePicture(exposure));
    const auto &first = pictures.front(), &last = pictures.back();
    if (last.size() != first.size() || last[0].width != first[0].width ||
        last[0].height != first[0].height || (last.size() != 1 && last.size() != 3))
      throw InputError(
          exposure.files[0].string(),
          fmt::format("is {} x {} pixels of {} channels, the first exposure {} x {} of {}",
                      last[0].width, last[0].height, last.size(), first[0].width, first[0].height,
                      first.size()),
          "the exposures must agree, in 1 or 3 channels");
  }
  const int width = pictures[0][0].width, height = pictures[0][0].height,
            channels = static_cast<int>(pictures[0].size());
  rig::SensorModel sensor = description.sensor;
  sensor.width = width;
  sensor.height = height;
  sensor.bits = pictures[0][0].dn.empty() ? 32 : 16;
  ProbePicture merged = {core::Image(width, height, channels), core::Image(width, height, channels),
                         core::Image(width, height, 1)};
  for (int c = 0; c < channels; ++c) {
    std::vector<Exposure> exposures;
    for (std::size_t k = 0; k < pictures.size(); ++k)
      exposures.push_back({&pictures[k][c], description.exposures[k].exposure_s,
                           description.exposures[k].attenuation});
    const MergedFrame frame = MergeExposures(sensor, exposures);
    const double scale = description.radiance_per_rate[c];
    for (std::size_t k = 0; k < frame.mask.size(); ++k) {
      merged.radiance.plane(c)[k] = static_cast<float>(scale * frame.rate_e_per_s[k]);
      merged.sigma.plane(c)[k] = static_cast<float>(scale * frame.sigma_e_per_s[k]);
      if (frame.mask[k] & lightfield::kUnknownMask) merged.unknown.data[k] = 1;
    }
  }
  return merged;
}

RimFit FindRim(const ProbePicture& picture, const ProbeDescription& description) {
  return FitRim(Brightness(picture.radiance), OpticsOf(picture, description), description.start,
                PictureFile(description));
}

Probe MakeProbe(const ProbePicture& picture, const ProbeDescription& description, const RimFit& rim,
                const ProbeOptions& options) {
  const core::Image& radiance = picture.radiance;
  const std::string file = PictureFile(description);
  const ProbeOptics optics = OpticsOf(picture, description);
  RequireRim(rim, file);
  Probe probe;
  probe.rim = rim;
  const Circle& circle = probe.rim.circle;

  core::Image used(radiance.width, radiance.height, 1);
  std::fill(used.data.begin(), used.data.end(), 1.0f);
  if (description.mask) used = ReadMask(*description.mask, radiance);
  const int face_size = options.face_size > 0
                            ? options.face_size
                            : std::max(1, static_cast<int>(std::lround(0.5 * circle.radius)));
  const environment::CubeResampler resampler(
      radiance.width, radiance.height, face_size,
      [&](int row, int column, std::vector<Vec3>& outline) {
        if (used.at(0, row, column) != 0)
          optics.PixelOutline(circle, row, column, description.margin_px, outline);
      });
  std::size_t saturated = 0, first_saturated = 0;
  for (std::size_t k = 0; k < used.data.size(); ++k) {
    if (!(resampler.source_solid_angles()[k] > 0)) continue;
    ++probe.used_pixels;
    probe.seen_sr += resampler.source_solid_angles()[k];
    if (picture.unknown.data[k] != 0 && saturated++ == 0) first_saturated = k;
  }
  if (saturated > 0)
    throw InputError(
        file,
        fmt::format("{} pixels of the probe are saturated or dead in every exposure, the first in "
                    "row {}, column {}",
                    saturated, first_saturated / radiance.width, first_saturated % radiance.width),
        "add a shorter exposure or a denser ND filter, or leave them out with a mask");
  if (probe.used_pixels == 0)
    throw InputError(
        file,
        fmt::format("no pixel lies {} pixels inside of the rim, whose radius is {:.1f}",
                    description.margin_px, circle.radius),
        "give a smaller margin_px or a larger picture");

  core::Image variance = picture.sigma;
  for (float& value : variance.data) value *= value;
  probe.radiance = resampler(radiance);
  probe.sigma = resampler.Variance(variance);
  probe.coverage = resampler.coverage();
  for (std::size_t t = 0; t < probe.coverage.size(); ++t) {
    if (!(probe.coverage[t] > 0)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      probe.radiance.data[3 * t + c] /= probe.coverage[t];
      probe.sigma.data[3 * t + c] = std::sqrt(probe.sigma.data[3 * t + c]) / probe.coverage[t];
    }
  }
  if (options.fill && optics.kind == ProbeOptics::Kind::kBall) probe.filled_sr = Fill(probe);
  probe.clamped_share = CutNegative(probe.radiance);
  return probe;
}

void WriteProbe(const std::filesystem::path& path, const Probe& probe,
                const ProbeDescription& description) {
  const core::Image radiance = environment::CubeStrip(probe.radiance),
                    sigma = environment::CubeStrip(probe.sigma);
  CubeMap shown(probe.radiance.face_size);
  for (std::size_t t = 0; t < probe.coverage.size(); ++t) shown.data[3 * t] = probe.coverage[t];
  const core::Image coverage = environment::CubeStrip(shown);
  core::ExrPartView part{"", radiance.width, radiance.height, {}, {}};
  const std::string names[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    part.channels.push_back({names[c], radiance.plane(c)});
    part.channels.push_back({"sigma." + names[c], sigma.plane(c)});
  }
  part.channels.push_back({"coverage.Y", coverage.plane(0)});
  const Circle &circle = probe.rim.circle, &error = probe.rim.sigma;
  part.attributes = {{"luxfield:layout", "cube"},
                     {"luxfield:unit", description.unit},
                     {"luxfield:made_from", description.file.filename().string()},
                     {"luxfield:rim_x_px", circle.x},
                     {"luxfield:rim_y_px", circle.y},
                     {"luxfield:rim_radius_px", circle.radius},
                     {"luxfield:rim_sigma_x_px", error.x},
                     {"luxfield:rim_sigma_y_px", error.y},
                     {"luxfield:rim_sigma_radius_px", error.radius},
                     {"luxfield:seen_sr", probe.seen_sr},
                     {"luxfield:filled_sr", probe.filled_sr}};
  core::WriteExr(path, std::span(&part, 1));
}

}  // namespace luxfield::reconstruct
