#include "luxfield/pictures/codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <type_traits>

#include "luxfield/core/error.h"

namespace luxfield::pictures {
namespace {

// Names of the Itanium C++ ABI for the two signatures in codecs.h.
constexpr char kDecode[] = "_ZN2cv8imdecodeERKNS_11_InputArrayEi";
constexpr char kEncode[] =
    "_ZN2cv8imencodeERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKNS_11_InputArrayERSt6"
    "vectorIhSaIhEERKSB_IiSaIiEE";
static_assert(std::is_same_v<decltype(Codecs::encode), decltype(&cv::imencode)>);
static_assert(
    std::is_same_v<decltype(Codecs::decode),
                   decltype(static_cast<cv::Mat (*)(cv::InputArray, int)>(&cv::imdecode))>);

Codecs Load() {
  Codecs codecs{};
  // Never unloaded: libraries below it do not bear that.
  if (void* library = ::dlopen(LUXFIELD_OPENCV_CODECS, RTLD_NOW | RTLD_LOCAL)) {
    codecs.decode = reinterpret_cast<decltype(Codecs::decode)>(::dlsym(library, kDecode));
    codecs.encode = reinterpret_cast<decltype(Codecs::encode)>(::dlsym(library, kEncode));
  }
  if (codecs.decode && codecs.encode) return codecs;
  const char* error = ::dlerror();
  throw DeviceError(fmt::format(
      "{} cannot be loaded ({}), and pictures in PNG, JPEG and TIFF are neither read nor written "
      "without it; install OpenCV's codecs",
      LUXFIELD_OPENCV_CODECS, error ? error : "it has no codecs"));
}

}  // namespace

const Codecs& LoadCodecs() {
  static const Codecs codecs = Load();
  return codecs;
}

}  // namespace luxfield::pictures
