#include "luxfield/view/window/screenshot.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::view {

void WriteScreenshot(const std::filesystem::path& path, const WindowPixels& pixels) {
  cv::Mat image(pixels.size.height, pixels.size.width, CV_8UC3);
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.cols; ++column) {
      const std::uint8_t* rgba =
          &pixels.rgba[4 * (static_cast<std::size_t>(row) * image.cols + column)];
      image.at<cv::Vec3b>(row, column) = {rgba[2], rgba[1], rgba[0]};
    }
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes))
    throw DeviceError(path.string() + ": the PNG encoder failed");
  core::WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace luxfield::view
