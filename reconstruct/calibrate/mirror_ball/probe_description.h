// probe.toml: the pictures of a light probe and how they were taken (docs/formats/probe.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

struct ProbeExposure {
  std::vector<std::filesystem::path> files;  // one, or one for each channel
  double exposure_s = 0;
  double attenuation = 1;
};

struct ProbeDescription {
  std::filesystem::path file;
  ProbeOptics optics;  // the pinhole's principal point is that of the file; none: the middle
  bool has_principal_point = false;
  core::Rgb radiance_per_rate = {1, 1, 1};  // of one electron per second, reflectance divided out
  std::string unit;
  double margin_px = 2;
  std::optional<std::filesystem::path> mask;
  std::optional<Circle> start;
  // Either exposures of a linear camera, or a picture that `merge IMAGES` has merged.
  rig::SensorModel sensor;  // without a size
  std::vector<ProbeExposure> exposures;
  std::optional<std::filesystem::path> merged;
  bool take_lower_bounds = false;  // of the merged picture's saturated pixels, instead of refusing
};

// Throws InputError naming file and field.
ProbeDescription ReadProbeDescription(const std::filesystem::path& path);

// The picture of an exposure, a frame for each of its channels: 1 or 3. Throws InputError naming
// the file: neither TIFF nor OpenEXR, a merged picture, channels of different sizes.
std::vector<session::RawFrame> ReadProbePicture(const ProbeExposure& exposure);

}  // namespace luxfield::reconstruct
