#include "luxfield/pictures/decode_picture.h"

#include <limits>
#include <new>
#include <opencv2/core.hpp>
#include <vector>

#include "luxfield/core/apart.h"
#include "luxfield/core/error.h"
#include "luxfield/pictures/codecs.h"

namespace luxfield::pictures {
namespace {

constexpr double kMemoryPerByte = 16;
constexpr char kRemedy[] = "give a smaller or undamaged picture";

cv::Mat Decode(const Codecs& codecs, std::span<const unsigned char> bytes, int flags) {
  cv::setNumThreads(0);  // those of the process that this one began as are not here
  try {
    // imdecode reads only; OpenCV's matrix header has no const form.
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                          const_cast<unsigned char*>(bytes.data()));
    return codecs.decode(encoded, flags);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw std::bad_alloc();
    return {};
  }
}

}  // namespace

cv::Mat DecodePicture(std::span<const unsigned char> bytes, int flags, const std::string& name) {
  if (bytes.empty() || bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    return {};
  const Codecs& codecs = LoadCodecs();  // here, since a process apart takes no locks
  cv::Mat picture;
  const auto work = [&](core::ApartWriter& writer) {
    const cv::Mat decoded = Decode(codecs, bytes, flags);
    writer(decoded.rows, decoded.cols, decoded.type());
    const std::size_t row_bytes = decoded.cols * decoded.elemSize();
    for (int row = 0; row < decoded.rows; ++row) writer.Bytes(decoded.ptr(row), row_bytes);
  };
  const auto take = [&](core::ApartReader& reader) {
    const int rows = reader.Value<int>(), columns = reader.Value<int>(), type = reader.Value<int>();
    if (rows == 0) return;
    const auto refuse = [&] { throw InputError(name, "is not decoded into a picture", kRemedy); };
    if (rows < 1 || columns < 1 || type != CV_MAKETYPE(CV_MAT_DEPTH(type), CV_MAT_CN(type)))
      refuse();
    const double total = double{1} * rows * columns * static_cast<double>(CV_ELEM_SIZE(type));
    if (total > static_cast<double>(reader.limits().memory_bytes)) refuse();
    picture.create(rows, columns, type);
    reader.Bytes(picture.data, picture.total() * picture.elemSize());
  };
  core::ReadApart(name, kRemedy, core::ApartLimitsOf(bytes.size(), kMemoryPerByte), work, take);
  return picture;
}

}  // namespace luxfield::pictures
