// The bench where a lab's filter is photographed without the luminaire (docs/theory.md 3, "Measured
// filters"): its holder before an even light, and a camera that somebody put there by hand.
#pragma once

#include "luxfield/hal/sim/lab_description.h"
#include "luxfield/rig/homography.h"

namespace luxfield::hal::sim {

class FilterBench {
 public:
  // What is in the holder, or a closed shutter.
  enum class View { kDark, kLight, kPlus, kMinus };  // a basis filter is kPlus

  // The lab's print and camera model, with `pixels` x `pixels` of them. The light falls off by some
  // per cent over the sheet; the camera sees the holder askew, drawn from the seed. A photograph's
  // light is off by 0.3 % rms from the last one's.
  FilterBench(const LabDescription& lab, int pixels);

  const Sensor& sensor() const { return sensor_; }
  const rig::FilterSheet& sheet() const { return print_.sheet(); }
  // The truth: holder coordinates of sensor positions (column, row).
  const rig::Homography& holder_from_sensor() const { return holder_from_sensor_; }
  const FilterPrint& print() const { return print_; }
  // The truth: the light of a photograph over the nominal one.
  double Light(View view) const;
  // Exposure time that fills three quarters of a pixel with the bare light.
  double exposure_s() const { return exposure_s_; }

  // `number` tells exposures of equal settings apart.
  session::RawFrame Expose(View view, double exposure_s, int number) const;

 private:
  std::vector<float> Irradiance(View view) const;  // relative, per pixel

  FilterPrint print_;
  Sensor sensor_;
  std::uint64_t seed_;
  double exposure_s_;
  rig::Homography holder_from_sensor_;
  std::vector<std::vector<float>> irradiance_;  // by View, empty for kDark
};

// The same bench with the lab's own camera, as [filter.bench] of lab.toml has it: E' of its pixels,
// the mean over 4 x 4 points of each.
std::vector<float> PictureOfFilter(const LabDescription& lab, FilterBench::View view);

}  // namespace luxfield::hal::sim
