// Pictures as PNG files.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

namespace luxfield::pictures {

// Of 8 bits, one channel or blue, green, red. Written atomically (core/file.h). Throws DeviceError.
void WritePng(const std::filesystem::path& path, const cv::Mat& picture);

}  // namespace luxfield::pictures
