#include "luxfield/render/film/band_film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"

namespace luxfield::render {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// A film that the device cannot hold is refused before anything is allocated: each of these fits
// but for what it is named after.
TEST(BandFilm, RefusesWhatTheDeviceCannotHold) {
  const Device device = Device::Open();
  FilmKernels kernels(device);
  const std::size_t memory = device.info().global_memory_bytes;
  // Bytes a pixel: 100, and 32 of each group, or 16 of each light.
  const std::size_t pixels = memory / 150;
  EXPECT_THAT([&] { BandFilm(kernels, {.pixels = pixels, .groups = 3}); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("3 light groups"), HasSubstr("MiB"))));
  EXPECT_THAT([&] { BandFilm(kernels, {.pixels = pixels, .lights_apart = 5}); },
              ThrowsMessage<DeviceError>(HasSubstr("5 lights told apart")));
}

}  // namespace
}  // namespace luxfield::render
