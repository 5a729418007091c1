#include "luxfield/bench/foreign_mergers.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <opencv2/photo.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

using reconstruct::PictureStack;

template <typename Calibrate, typename Merge>
ForeignMerge MergeWithOpenCv(const std::string& name, const PictureStack& stack, int channel,
                             const Calibrate& calibrate, const Merge& merge) {
  ForeignMerge result{.name = name, .refused = {}, .radiance = {}, .curve = {}};
  if (stack.bits != 8) {
    result.refused = "takes 8 bits alone";
    return result;
  }
  std::vector<cv::Mat> pictures;
  std::vector<float> times;
  for (std::size_t k = 0; k < stack.pictures.size(); ++k) {
    cv::Mat grey(stack.height, stack.width, CV_8U), colour;
    const auto plane = stack.plane(k, channel);
    std::copy(plane.begin(), plane.end(), grey.begin<std::uint8_t>());
    cv::merge(std::vector<cv::Mat>{grey, grey, grey}, colour);
    pictures.push_back(colour);
    times.push_back(static_cast<float>(stack.pictures[k].exposure_s));
  }
  cv::Mat curve, merged;
  const core::Stopwatch calibration;
  calibrate->process(pictures, curve, times);
  result.calibrate_s = calibration.WallSeconds();
  const core::Stopwatch merging;
  merge->process(pictures, merged, times, curve);
  result.merge_s = merging.WallSeconds();
  for (int z = 0; z < curve.rows; ++z) result.curve.push_back(curve.at<cv::Vec3f>(z)[0]);
  for (auto it = merged.begin<cv::Vec3f>(); it != merged.end<cv::Vec3f>(); ++it)
    result.radiance.push_back((*it)[0]);
  return result;
}

// The PFS stream of a stack: XYZ of grey that shows `code` in R, G and B.
std::string PfsStream(const PictureStack& stack, int channel) {
  constexpr float kWhite[] = {0.950456f, 1, 1.088754f};
  std::string stream;
  for (std::size_t k = 0; k < stack.pictures.size(); ++k) {
    const double exposure_s = stack.pictures[k].exposure_s;
    // Brightness value of aperture 1 and ISO 100.
    stream += fmt::format(
        "PFS1\n{} {}\n3\n5\nBV={}\nISO=100\naperture=1\nexposure_time={}\nLUMINANCE=DISPLAY\n"
        "X\n0\nY\n0\nZ\n0\nENDH",
        stack.width, stack.height, -std::log2(exposure_s) - 5, exposure_s);
    for (const float white : kWhite)
      for (const std::uint16_t code : stack.plane(k, channel)) {
        const float value =
            white * static_cast<float>(code) / static_cast<float>((1 << stack.bits) - 1);
        stream.append(reinterpret_cast<const char*>(&value), sizeof(value));
      }
  }
  return stream;
}

ForeignMerge MergeWithPfstools(const std::string& name, const std::string& method,
                               const PictureStack& stack, int channel,
                               const std::filesystem::path& folder) {
  ForeignMerge result{.name = name, .refused = {}, .radiance = {}, .curve = {}};
  if (std::system("command -v pfshdrcalibrate >/dev/null") != 0) {
    result.refused = "pfshdrcalibrate is not installed (package pfstools)";
    return result;
  }
  const auto input = folder / "stack.pfs", output = folder / "merged.pfs";
  core::WriteFileAtomically(input, PfsStream(stack, channel));
  const core::Stopwatch watch;
  const int status = std::system(fmt::format("pfshdrcalibrate -c {} -b {} <'{}' >'{}' 2>/dev/null",
                                             method, stack.bits, input.string(), output.string())
                                     .c_str());
  result.merge_s = watch.WallSeconds();
  const std::string bytes = core::ReadFile(output);
  const std::size_t end = bytes.find("ENDH"), plane = stack.plane_size() * sizeof(float);
  if (status != 0 || end == std::string::npos || bytes.size() < end + 4 + 3 * plane) {
    result.refused = "pfshdrcalibrate wrote no picture";
    return result;
  }
  result.radiance.resize(stack.plane_size());
  std::memcpy(result.radiance.data(), bytes.data() + end + 4 + plane, plane);  // Y
  return result;
}

}  // namespace

std::vector<ForeignMerge> MergeWithOthers(const PictureStack& stack, int channel,
                                          const std::filesystem::path& folder) {
  return {MergeWithOpenCv("OpenCV Debevec", stack, channel, cv::createCalibrateDebevec(),
                          cv::createMergeDebevec()),
          MergeWithOpenCv("OpenCV Robertson", stack, channel, cv::createCalibrateRobertson(),
                          cv::createMergeRobertson()),
          MergeWithPfstools("pfstools Robertson", "robertson", stack, channel, folder),
          MergeWithPfstools("pfstools Mitsunaga", "mitsunaga", stack, channel, folder)};
}

}  // namespace luxfield::bench
