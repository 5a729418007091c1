#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/pictures/decode_picture.h"
#include "luxfield/reconstruct/calibrate/response/exif.h"

namespace luxfield::reconstruct {
namespace {

// By the first bytes.
bool IsPngJpegOrTiff(const std::string& bytes) {
  using namespace std::string_literals;
  for (const std::string& magic : {"\x89PNG"s, "\xff\xd8\xff"s, "II*\0"s, "MM\0*"s})
    if (bytes.starts_with(magic)) return true;
  return false;
}

cv::Mat Decode(const std::string& bytes, const std::string& file) {
  cv::Mat picture;
  if (IsPngJpegOrTiff(bytes))
    picture = pictures::DecodePicture(
        {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
        cv::IMREAD_UNCHANGED | cv::IMREAD_IGNORE_ORIENTATION, file);
  if (picture.empty())
    throw InputError(file, "is not a picture that can be read", "give PNG, JPEG or TIFF files");
  if (picture.depth() != CV_8U && picture.depth() != CV_16U)
    throw InputError(file, "holds neither 8-bit nor 16-bit samples", "give the camera's own file");
  if (picture.channels() == 2)
    throw InputError(file, "has 2 channels", "give grey or colour pictures");
  return picture;
}

// OpenCV interleaves B, G, R (and opacity).
template <typename Sample>
void SplitPlanes(const cv::Mat& picture, int channels, std::vector<std::uint16_t>& code) {
  const std::size_t plane = picture.total();
  code.resize(plane * channels);
  std::size_t p = 0;
  for (int row = 0; row < picture.rows; ++row) {
    const Sample* sample = picture.ptr<Sample>(row);
    for (int column = 0; column < picture.cols; ++column, ++p, sample += picture.channels())
      for (int channel = 0; channel < channels; ++channel)
        code[channel * plane + p] = sample[channels - 1 - channel];
  }
}

double ExposureFromExif(const ExifExposure& exif, const ExifExposure& first,
                        const std::string& file) {
  if (!exif.exposure_s)
    throw InputError(file, "states no exposure time (Exif ExposureTime)",
                     "give the exposure times of all pictures with --exposure");
  if (exif.f_number != first.f_number || exif.iso != first.iso)
    throw InputError(file,
                     "has another aperture or sensitivity than the first picture (Exif FNumber, "
                     "PhotographicSensitivity)",
                     "vary the exposure time alone, or give effective times with --exposure");
  return *exif.exposure_s;
}

}  // namespace

PictureStack ReadPictureStack(std::span<const std::filesystem::path> files,
                              std::span<const double> exposures_s, int least) {
  if (static_cast<int>(files.size()) < least)
    throw InputError(fmt::format("{} picture{} given, but a stack has at least {}; add exposures",
                                 files.size(), files.size() == 1 ? "" : "s", least));
  if (!exposures_s.empty() && exposures_s.size() != files.size())
    throw InputError(fmt::format("--exposure lists {} times for {} pictures; give one for each",
                                 exposures_s.size(), files.size()));
  PictureStack stack;
  ExifExposure first;
  for (std::size_t k = 0; k < files.size(); ++k) {
    const std::string file = files[k].string();
    const std::string bytes = core::ReadFile(files[k]);
    const ExifExposure exif = ReadExif(bytes);
    if (k == 0) first = exif;
    StackPicture next;
    next.exposure_s = exposures_s.empty() ? ExposureFromExif(exif, first, file) : exposures_s[k];
    if (!(next.exposure_s > 0 && next.exposure_s < 1e6))
      throw InputError(file, fmt::format("exposure time {} s is not above 0", next.exposure_s),
                       "correct --exposure");
    const cv::Mat picture = Decode(bytes, file);
    const int channels = picture.channels() >= 3 ? 3 : 1, bits = picture.depth() == CV_8U ? 8 : 16;
    if (k == 0) {
      stack.width = picture.cols;
      stack.height = picture.rows;
      stack.channels = channels;
      stack.bits = bits;
    }
    if (picture.cols != stack.width || picture.rows != stack.height || channels != stack.channels ||
        bits != stack.bits)
      throw InputError(file,
                       fmt::format("has {} x {} pixels, {} channels and {} bits, but {} has {} x "
                                   "{}, {} and {}",
                                   picture.cols, picture.rows, channels, bits, files[0].string(),
                                   stack.width, stack.height, stack.channels, stack.bits),
                       "give pictures of one camera and mode");
    if (bits == 8)
      SplitPlanes<std::uint8_t>(picture, channels, next.code);
    else
      SplitPlanes<std::uint16_t>(picture, channels, next.code);
    stack.pictures.push_back(std::move(next));
  }
  std::stable_sort(
      stack.pictures.begin(), stack.pictures.end(),
      [](const StackPicture& a, const StackPicture& b) { return a.exposure_s < b.exposure_s; });
  for (std::size_t k = 1; k < stack.pictures.size(); ++k)
    if (stack.pictures[k].exposure_s == stack.pictures[k - 1].exposure_s)
      throw InputError(
          fmt::format("two pictures have the exposure time {} s; a stack's exposures differ",
                      stack.pictures[k].exposure_s));
  return stack;
}

}  // namespace luxfield::reconstruct
