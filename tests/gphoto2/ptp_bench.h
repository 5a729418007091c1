// A still camera on the network of this computer, whose frames follow its exposures.
#pragma once

#include <cmath>
#include <string>

#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"
#include "tests/fakes/dng.h"
#include "tests/fakes/ptp_camera.h"
#include "tests/fakes/ptp_ip_host.h"

namespace luxfield::hal::gphoto2 {

struct PtpBench {
  static constexpr int kWidth = 48, kHeight = 32;

  // A pixel of exposure number `number`.
  static std::uint16_t Pixel(std::size_t pixel, double exposure_s, int number) {
    return static_cast<std::uint16_t>(512 + std::lround(1e4 * exposure_s) +
                                      static_cast<long>(7 * (pixel % 100)) + number);
  }
  static std::string Shoot(double exposure_s, int number) {
    fakes::Negative negative{kWidth, kHeight, {}, "GRBG", exposure_s};
    for (std::size_t k = 0; k < std::size_t{kWidth} * kHeight; ++k)
      negative.dn.push_back(Pixel(k, exposure_s, number));
    return fakes::EncodeDng(negative);
  }
  Gphoto2Options Options() const {
    Gphoto2Options options;
    options.port = host.port();
    options.width = kWidth;
    options.height = kHeight;
    options.cfa = "GRBG";
    options.settings = {{"iso", "200"}};
    options.readout_s = 0.1;
    return options;
  }

  fakes::PtpCamera camera{{10, 20, 50, 100, 200, 500, 1000, 2000}, Shoot};
  fakes::PtpIpHost host{camera};
};

}  // namespace luxfield::hal::gphoto2
