#include "luxfield/scene/texture.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/pictures/decode_picture.h"

namespace luxfield::scene {
namespace {

// IEC 61966-2-1.
float LinearFromSrgb8(std::uint32_t value) {
  const float x = static_cast<float>(value) / 255.0f;
  return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
}

// The file's alpha, 8 bits; empty if it has none.
cv::Mat DecodeAlpha(std::span<const unsigned char> bytes, const std::string& name) {
  const cv::Mat image = pictures::DecodePicture(bytes, cv::IMREAD_UNCHANGED, name);
  if (image.channels() != 4) return {};
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  if (alpha.depth() == CV_16U) alpha.convertTo(alpha, CV_8U, 1 / 257.0);
  return alpha.depth() == CV_8U ? alpha : cv::Mat();
}

}  // namespace

Texture DecodeTexture(std::span<const unsigned char> bytes, const std::string& name, Alpha alpha) {
  const cv::Mat image = pictures::DecodePicture(bytes, cv::IMREAD_COLOR, name);
  if (image.empty() || image.type() != CV_8UC3)
    throw InputError(name, "is not an image that can be decoded", "use PNG or JPEG");
  Texture texture{name, image.cols, image.rows, {}};
  texture.rgba.reserve(image.total());
  const cv::Mat opacity = alpha == Alpha::kKept ? DecodeAlpha(bytes, name) : cv::Mat();
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.cols; ++column) {
      const auto bgr = image.at<cv::Vec3b>(row, column);
      const std::uint32_t a = opacity.empty() ? 255 : opacity.at<unsigned char>(row, column);
      texture.rgba.push_back((a << 24) | (std::uint32_t{bgr[0]} << 16) |
                             (std::uint32_t{bgr[1]} << 8) | bgr[2]);
    }
  return texture;
}

Texture ReadTexture(const std::filesystem::path& path) {
  const std::string bytes = core::ReadFile(path);
  return DecodeTexture({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
                       path.string());
}

std::array<float, 3> SampleTexture(const Texture& texture, std::array<float, 2> uv,
                                   TexelEncoding encoding) {
  const float x = (uv[0] - std::floor(uv[0])) * static_cast<float>(texture.width) - 0.5f;
  const float y = (1.0f - (uv[1] - std::floor(uv[1]))) * static_cast<float>(texture.height) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y);
  const float fx = x - x0, fy = y - y0;
  std::array<float, 3> out{};
  for (int corner = 0; corner < 4; ++corner) {
    const int column = (static_cast<int>(x0) + (corner & 1) + texture.width) % texture.width;
    const int row = (static_cast<int>(y0) + (corner >> 1) + texture.height) % texture.height;
    const std::uint32_t texel =
        texture.rgba[static_cast<std::size_t>(row) * texture.width + column];
    const float weight = ((corner & 1) ? fx : 1 - fx) * ((corner >> 1) ? fy : 1 - fy);
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t value = (texel >> (8 * c)) & 255u;
      out[c] += weight * (encoding == TexelEncoding::kSrgb ? LinearFromSrgb8(value)
                                                           : static_cast<float>(value) / 255.0f);
    }
  }
  return out;
}

}  // namespace luxfield::scene
