#include "luxfield/cli/merge_pictures.h"

#include <fmt/format.h>

#include <array>

#include "luxfield/reconstruct/calibrate/response/calibrate_response.h"
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

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

// What is flagged, by channel, and how well the pictures agree.
void PrintFigures(const std::vector<reconstruct::MergeFigures>& figures, core::Json& result) {
  reconstruct::MergeFigures all;
  core::Json channels = core::Json::array();
  for (std::size_t c = 0; c < figures.size(); ++c) {
    const reconstruct::MergeFigures& of = figures[c];
    const char* name = figures.size() == 1 ? "grey" : std::array{"red", "green", "blue"}[c];
    const double agreement = of.degrees > 0 ? of.chi_squared / of.degrees : 0;
    fmt::print(
        "  {:<6}  too bright in all {:.3g} %, too dark in all {:.3g} %: flagged, estimates "
        "only; chi^2 of the rest {:.3g} a degree\n",
        name, 100 * of.saturated / of.pixels, 100 * of.too_dark / of.pixels, agreement);
    channels.push_back({{"channel", name},
                        {"saturated_share", of.saturated / of.pixels},
                        {"too_dark_share", of.too_dark / of.pixels},
                        {"chi_squared", of.chi_squared},
                        {"degrees", of.degrees}});
    all += of;
  }
  result["channels"] = channels;
  result["saturated_share"] = all.saturated / all.pixels;
  result["too_dark_share"] = all.too_dark / all.pixels;
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
  fmt::print("{}: {} x {} pixels in {} channels from {} pictures\n", output, stack.width,
             stack.height, stack.channels, stack.pictures.size());
  PrintFigures(merged.figures, result);
  return result;
}

}  // namespace luxfield::cli
