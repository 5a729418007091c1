#include "luxfield/view/window/screenshot.h"

#include <opencv2/core.hpp>

#include "luxfield/pictures/write_png.h"

namespace luxfield::view {

void WriteScreenshot(const std::filesystem::path& path, const WindowPixels& pixels) {
  cv::Mat image(pixels.size.height, pixels.size.width, CV_8UC3);
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.cols; ++column) {
      const std::uint8_t* rgba =
          &pixels.rgba[4 * (static_cast<std::size_t>(row) * image.cols + column)];
      image.at<cv::Vec3b>(row, column) = {rgba[2], rgba[1], rgba[0]};
    }
  pictures::WritePng(path, image);
}

}  // namespace luxfield::view
