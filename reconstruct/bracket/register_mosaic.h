// A colour mosaic's merged pixels -> the luminaire's lattice, channel by channel, never demosaiced.
//
// The pixels of one colour site (row, column parities p, q) make a plane of half the resolution
// whose pixel (R, C) is centred on the sensor's (2 R + p + 1/2, 2 C + q + 1/2): it stands for the 2
// x 2 pixels about that point, sensor = 2 plane + (p, q) - 1/2. Each site is registered through its
// own mapping (register_images.h), so that channels half a pixel apart land where they were seen; G
// is the mean of its two sites. Against a sensor that sees every colour everywhere a texel's value
// differs by what the image bends within two pixels, and by aliasing where texels are smaller.
#pragma once

#include <string>
#include <vector>

#include "luxfield/reconstruct/bracket/register_images.h"
#include "luxfield/rig/homography.h"

namespace luxfield::reconstruct {

class MosaicRegistration {
 public:
  // As Registration; `cfa` as rig/cfa.h has it. irradiance_per_rate: per channel one entry, or one
  // per sensor pixel. Throws InputError as Registration does, and for a sensor below 2 x 2 pixels.
  MosaicRegistration(const rig::Homography& image_from_sensor, int sensor_width, int sensor_height,
                     const lightfield::Lattice& lattice, const std::optional<rig::Lens>& lens,
                     const std::string& cfa,
                     const std::vector<std::vector<float>>& irradiance_per_rate);

  // Channel 0 R, 1 G, 2 B for the filter centred on centre_m. Of G sigma is that of the mean, the
  // mask joins both sites'.
  RegisteredImage Apply(const MergedFrame& merged, int channel, lightfield::Vec2 centre_m) const;

  // The sites whose mean Apply takes for a channel: their sensor pixels for each texel, as
  // Registration::Overlaps.
  std::vector<std::vector<std::vector<PixelShare>>> Overlaps(int channel,
                                                             lightfield::Vec2 centre_m) const;

 private:
  struct Site {
    int site, channel;
    Registration registration;
    std::vector<float> irradiance_per_rate;
  };
  std::string cfa_;
  int sensor_width_;
  std::vector<Site> sites_;
};

}  // namespace luxfield::reconstruct
