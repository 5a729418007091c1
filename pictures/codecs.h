// OpenCV's codecs, loaded when the first picture is read or written: some ninety libraries come with
// them (GDAL's among them), which take four times as long to load as all that the program links.
// Internal to pictures/.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace luxfield::pictures {

struct Codecs {
  cv::Mat (*decode)(cv::InputArray bytes, int flags);  // cv::imdecode
  bool (*encode)(const cv::String& ending, cv::InputArray picture,
                 std::vector<unsigned char>& bytes,
                 const std::vector<int>& options);  // cv::imencode
};

// Throws DeviceError where the library is missing or another than was built with. Any thread.
const Codecs& LoadCodecs();

}  // namespace luxfield::pictures
