// Preloaded: a machine without OpenCV's library of codecs.
#include <dlfcn.h>

#include <cstring>

extern "C" void* dlopen(const char* file, int flags) {
  using Open = void* (*)(const char*, int);
  static const auto open = reinterpret_cast<Open>(dlsym(RTLD_NEXT, "dlopen"));
  const bool codecs = file && std::strstr(file, "opencv_imgcodecs");
  return open(codecs ? "libopencv_imgcodecs.so.none" : file, flags);
}
