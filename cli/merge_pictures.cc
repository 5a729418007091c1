#include "cli/merge_pictures.h"

#include <fmt/format.h>

#include <algorithm>

#include "lightfield/measurements.h"
#include "reconstruct/calibrate_response.h"
#include "reconstruct/merge_stack.h"

namespace luxfield::cli {
namespace {

core::Json EstimateAndApply(reconstruct::PictureStack& stack,
                            const std::vector<reconstruct::ResponseCurve>& curves) {
  const auto estimate = reconstruct::EstimateExposures(stack, curves);
  core::Json rungs = core::Json::array();
  for (std::size_t j = 0; j < stack.pictures.size(); ++j) {
    double& exposure_s = stack.pictures[j].exposure_s;
    const auto& ratio = estimate.ratio[j];
    if (estimate.known[j])
      fmt::print("  exposure {:>10.6g} s   estimated {:.6g} +- {:.2g} s\n", exposure_s,
                 ratio.value * exposure_s, ratio.sigma * exposure_s);
    else
      fmt::print("  exposure {:>10.6g} s   shares no pixels with the others: taken as it is\n",
                 exposure_s);
    rungs.push_back({{"nominal_s", exposure_s},
                     {"estimated_s", ratio.value * exposure_s},
                     {"sigma_s", ratio.sigma * exposure_s},
                     {"known", static_cast<bool>(estimate.known[j])}});
    exposure_s *= ratio.value;
  }
  return rungs;
}

}  // namespace

core::Json MergePictures(const MergePicturesOptions& options) {
  const std::string output = options.output.string();
  if (!output.ends_with(".exr") || output.ends_with(".meas.exr"))
    throw InputError(fmt::format(
        "--output = {} must end in .exr and not in .meas.exr, which holds a session's irradiance",
        output));
  const auto response = reconstruct::ReadResponseCalibration(options.calibration);
  auto stack = reconstruct::ReadPictureStack(options.images, options.exposures_s, 1);
  if (stack.bits != response.bits)
    throw InputError(options.calibration.string(),
                     fmt::format("is of {} bits, the pictures have {}", response.bits, stack.bits),
                     "calibrate the response of this camera and mode");
  core::Json result;
  if (options.estimate_exposures) result["exposures"] = EstimateAndApply(stack, response.curves);
  const auto merged = reconstruct::MergeStack(stack, response.curves);
  reconstruct::WriteMergedPicture(options.output, merged,
                                  {{"response_calibration", response.sha256}});
  const auto count = [&](std::uint32_t flag) {
    return static_cast<double>(std::count(merged.mask.begin(), merged.mask.end(), flag)) /
           static_cast<double>(merged.mask.size());
  };
  const double saturated = count(lightfield::kSaturated), dark = count(lightfield::kTooDark);
  fmt::print("{}: {} x {} pixels in {} channels from {} pictures\n", output, stack.width,
             stack.height, stack.channels, stack.pictures.size());
  fmt::print("  flagged, not numbers  {:.3g} % saturated in all, {:.3g} % too dark in all\n",
             100 * saturated, 100 * dark);
  result["saturated_share"] = saturated;
  result["too_dark_share"] = dark;
  return result;
}

}  // namespace luxfield::cli
