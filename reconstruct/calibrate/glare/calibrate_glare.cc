#include "luxfield/reconstruct/calibrate/glare/calibrate_glare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/reconstruct/bracket/session_views.h"
#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/version.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;

constexpr const char* kFormat = "luxfield glare calibration";
constexpr int kVersion = 1;

// The value that `share` of them lie below. Reorders them.
float Quantile(std::vector<float>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Largest region of non-zero pixels that does not touch the border, as 255 in an image; empty:
// none.
cv::Mat LargestInside(const cv::Mat& dark) {
  cv::Mat labels, statistics, centroids;
  const int count =
      cv::connectedComponentsWithStats(dark, labels, statistics, centroids, 4, CV_32S);
  int best = 0;
  for (int label = 1; label < count; ++label) {
    const int* s = statistics.ptr<int>(label);
    const int right = s[cv::CC_STAT_LEFT] + s[cv::CC_STAT_WIDTH],
              bottom = s[cv::CC_STAT_TOP] + s[cv::CC_STAT_HEIGHT];
    const bool inside = s[cv::CC_STAT_LEFT] > 0 && s[cv::CC_STAT_TOP] > 0 && right < dark.cols &&
                        bottom < dark.rows;
    if (inside && (best == 0 || s[cv::CC_STAT_AREA] > statistics.at<int>(best, cv::CC_STAT_AREA)))
      best = label;
  }
  return best == 0 ? cv::Mat() : cv::Mat(labels == best);
}

}  // namespace

GlarePlace MeasureGlare(const MergedFrame& merged, const std::vector<float>& sensitivity,
                        const std::string& what) {
  const std::size_t pixels = merged.rate_e_per_s.size();
  const auto known = [&](std::size_t p) { return !(merged.mask[p] & lightfield::kUnknownMask); };
  const auto light = [&](std::size_t p) {
    return merged.rate_e_per_s[p] / sensitivity[sensitivity.size() == 1 ? 0 : p];
  };
  std::vector<float> all;
  double mean = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!known(p)) continue;
    all.push_back(light(p));
    mean += all.back();
  }
  if (all.empty()) throw InputError(what, "has no pixel that is known", "take it again");
  mean /= static_cast<double>(all.size());
  const float half = 0.5f * Quantile(all, 0.5);

  cv::Mat dark(merged.height, merged.width, CV_8UC1);
  for (std::size_t p = 0; p < pixels; ++p)
    dark.data[p] = !known(p) || light(p) < half ? 255 : 0;  // a hot pixel does not part the trap
  const cv::Mat trap = LargestInside(dark);
  const char* const remedy = "put a larger trap well inside an evenly lit picture";
  if (trap.empty()) throw InputError(what, "shows no light trap", remedy);
  cv::Mat depth;  // distance to the nearest pixel outside
  cv::distanceTransform(trap, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE, CV_32F);
  double deepest = 0;
  cv::minMaxLoc(depth, nullptr, &deepest);

  GlarePlace place;
  double core = 0, variance = 0;
  std::vector<float> field;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!known(p)) continue;
    if (!dark.data[p]) field.push_back(light(p));
    if (depth.ptr<float>()[p] < 2.0 / 3 * deepest) continue;
    const double scale = sensitivity[sensitivity.size() == 1 ? 0 : p];
    core += light(p);
    variance += std::pow(merged.sigma_e_per_s[p] / scale, 2);
    place.column += static_cast<double>(p % merged.width) + 0.5;
    place.row += static_cast<double>(p / merged.width) + 0.5;
    ++place.pixels;
  }
  if (place.pixels < 9)
    throw InputError(what, fmt::format("shows a light trap with a core of {} pixels", place.pixels),
                     remedy);
  const double n = place.pixels, sigma = std::sqrt(variance) / n;
  core /= n;
  place.column /= n;
  place.row /= n;
  double trap_reach = 0, core_reach = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!trap.data[p]) continue;
    const double from_middle =
        std::hypot(static_cast<double>(p % merged.width) + 0.5 - place.column,
                   static_cast<double>(p / merged.width) + 0.5 - place.row);
    trap_reach = std::max(trap_reach, from_middle);
    if (depth.ptr<float>()[p] >= 2.0 / 3 * deepest) core_reach = std::max(core_reach, from_middle);
  }
  place.radius_px = trap_reach + core_reach;
  const double dimmest = Quantile(field, 0.05);
  place.share = core / mean;
  place.share_sigma = sigma / mean;
  place.bound = core / dimmest;
  place.bound_sigma = sigma / dimmest;
  return place;
}

GlarePlace MeasureGlare(const MergedFrame& merged, const std::vector<float>& sensitivity,
                        const std::string& cfa, const std::string& what) {
  if (cfa.empty()) return MeasureGlare(merged, sensitivity, what);
  GlarePlace place;
  const int sites = SitesOf(cfa);
  for (int site = 0; site < sites; ++site) {
    const GlarePlace one = MeasureGlare(
        PixelsOfSite(merged, site),
        sensitivity.size() == 1 ? sensitivity
                                : PixelsOfSite(sensitivity, merged.width, merged.height, site),
        what);
    // The middle of a site's pixel (row, column) is the sensor's (2 row + site / 2 + 1/2, ...).
    place.column += (2 * one.column + site % 2 - 0.5) / sites;
    place.row += (2 * one.row + site / 2 - 0.5) / sites;
    place.pixels += one.pixels;
    place.radius_px = std::max(place.radius_px, 2 * one.radius_px);
    place.share += one.share / sites;
    place.share_sigma = std::hypot(place.share_sigma, one.share_sigma / sites);
    if (one.bound < place.bound) continue;
    place.bound = one.bound;
    place.bound_sigma = one.bound_sigma;
  }
  return place;
}

GlareCalibration CalibrateGlare(const session::SessionReader& session, bool check_hashes) {
  const std::string plan_file = (session.folder() / "plan.json").string();
  if (session::PlanOf(session).kind != session::PlanKind::kGlare)
    throw InputError(plan_file, "is no plan of kind \"glare\"",
                     "capture data/plans/glare.toml and give its session");
  rig::SensorModel sensor = session::SensorModelOf(session);
  sensor.prnu = 0;  // of the core's many pixels: below what the places scatter
  const std::vector<float> sensitivity =
      sensor.vignetting.empty() ? std::vector<float>{1} : sensor.vignetting;

  GlareCalibration result;
  result.width = sensor.width;
  result.height = sensor.height;
  std::string hashes;
  for (const auto& [number, records] : FramesByView(session)) {
    for (const session::FrameRecord* record : records) hashes += record->sha256;
    result.places.push_back(MeasureGlare(MergeView(session, records, sensor, check_hashes),
                                         sensitivity, sensor.cfa,
                                         (session.folder() / records[0]->file).string()));
  }
  if (result.places.empty())
    throw InputError(session.folder().string(), "has no frame of a light trap",
                     "resume its capture");

  const auto count = static_cast<double>(result.places.size());
  double noise = 0, scatter = 0;
  for (const GlarePlace& place : result.places) {
    result.share += place.share / count;
    noise += std::pow(place.share_sigma / count, 2);
    result.bound = std::max(result.bound, place.bound + 2 * place.bound_sigma);
    result.radius_px = std::max(result.radius_px, place.radius_px);
  }
  for (const GlarePlace& place : result.places)
    scatter += std::pow(place.share - result.share, 2) / (count * std::max(count - 1, 1.0));
  result.share_sigma = std::sqrt(std::max(noise, scatter));
  result.provenance = {{"session_plan", session.plan_id()},
                       {"frames_sha256", core::Sha256(hashes)},
                       {"software", "luxfield " LUXFIELD_VERSION}};
  return result;
}

Json ToJson(const GlareCalibration& c) {
  Json places = Json::array();
  for (const GlarePlace& place : c.places)
    places.push_back({{"column", place.column},
                      {"row", place.row},
                      {"pixels", place.pixels},
                      {"radius_px", place.radius_px},
                      {"share", place.share},
                      {"share_sigma", place.share_sigma},
                      {"bound", place.bound},
                      {"bound_sigma", place.bound_sigma}});
  return {{"format", kFormat},         {"version", kVersion},      {"width", c.width},
          {"height", c.height},        {"share", c.share},         {"share_sigma", c.share_sigma},
          {"bound", c.bound},          {"radius_px", c.radius_px}, {"places", places},
          {"provenance", c.provenance}};
}

void WriteGlareCalibration(const std::filesystem::path& path, const GlareCalibration& calibration) {
  core::WriteJson(path, ToJson(calibration));
}

bool IsGlareCalibration(const std::filesystem::path& path) {
  return Field<std::string>(core::ReadJson(path), "format", path.string()) == kFormat;
}

StatedGlare ReadGlareCalibration(const std::filesystem::path& path,
                                 const rig::SensorModel& sensor) {
  const std::string file = path.string(), bytes = core::ReadFile(path);
  const Json json = core::ParseJson(bytes, file);
  if (const int version = Field<int>(json, "version", file); version != kVersion)
    throw InputError(file, fmt::format("has version {}, this program reads {}", version, kVersion),
                     "calibrate the glare again");
  const int width = Field<int>(json, "width", file), height = Field<int>(json, "height", file);
  if (width != sensor.width || height != sensor.height)
    throw InputError(file,
                     fmt::format("is of a camera of {} x {} pixels, the session's has {} x {}",
                                 width, height, sensor.width, sensor.height),
                     "use the calibration of this camera");
  const auto number = [&](const char* key) {
    const double value = Field<double>(json, key, file);
    if (!std::isfinite(value))
      throw InputError(file, fmt::format("{} is not finite", key), "calibrate the glare again");
    return value;
  };
  return {number("share"), number("share_sigma"), number("bound"), number("radius_px"),
          core::Sha256(bytes)};
}

}  // namespace luxfield::reconstruct
