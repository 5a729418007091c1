// How photometric quantities are called by unit of flux: keys of JSON, units on pages.
#pragma once

#include <string>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::cli {

struct PhotometryNames {
  std::string flux_key, intensity_suffix, illuminance_key, illuminance_suffix;
  std::string flux_unit, intensity_unit, illuminance_unit;
  std::string flux, intensity, illuminance;

  std::string LuminanceSuffix() const {
    return intensity_suffix == "relative" ? intensity_suffix : intensity_suffix + "_per_m2";
  }
  std::string LuminanceUnit() const {
    return intensity_unit == "cd" ? "cd/m²" : intensity_unit == "W/sr" ? "W/(sr m²)" : "relative";
  }

  // "intensity_axis_cd", "illuminance_mean_lx".
  std::string Intensity(const std::string& which) const {
    return "intensity_" + which + "_" + intensity_suffix;
  }
  std::string Illuminance(const std::string& which = {}) const {
    return illuminance_key + (which.empty() ? "" : "_" + which) + "_" + illuminance_suffix;
  }
};

inline PhotometryNames NamesOf(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return {"flux_lm",
              "cd",
              "illuminance",
              "lx",
              "lm",
              "cd",
              "lx",
              "Luminous flux",
              "Luminous intensity",
              "Illuminance"};
    case lightfield::FluxUnit::kWatt:
      return {"flux_w", "w_per_sr", "irradiance",   "w_per_m2",          "W",
              "W/sr",   "W/m²",     "Radiant flux", "Radiant intensity", "Irradiance"};
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return {"flux_relative",
          "relative",
          "illuminance",
          "relative",
          "relative",
          "relative",
          "relative",
          "Flux, relative",
          "Intensity, relative",
          "Illuminance, relative"};
}

}  // namespace luxfield::cli
