#include "luxfield/pictures/write_png.h"

#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/pictures/codecs.h"

namespace luxfield::pictures {

void WritePng(const std::filesystem::path& path, const cv::Mat& picture) {
  std::vector<unsigned char> bytes;
  if (!LoadCodecs().encode(".png", picture, bytes, {}))
    throw DeviceError(path.string() + ": the PNG encoder failed");
  core::WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace luxfield::pictures
