// How photometric quantities are called by unit of flux: keys of JSON, units on pages.
#pragma once

#include <string>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/photometry/asked.h"

namespace luxfield::cli {

// "" of a plane, "spherical", "cylindrical", "semicylindrical".
inline std::string ShapeName(photometry::ReceiverShape shape) {
  switch (shape) {
    case photometry::ReceiverShape::kPlane:
      return "";
    case photometry::ReceiverShape::kSphere:
      return "spherical";
    case photometry::ReceiverShape::kCylinder:
      return "cylindrical";
    case photometry::ReceiverShape::kSemicylinder:
      return "semicylindrical";
  }
  return "";
}

struct PhotometryNames {
  std::string flux_key, intensity_suffix, illuminance_key, illuminance_suffix;
  std::string flux_unit, intensity_unit, illuminance_unit;
  std::string flux, intensity, illuminance;

  // Within a sentence; keys of JSON say luminance of all units.
  std::string Luminance() const { return intensity_unit == "W/sr" ? "radiance" : "luminance"; }
  std::string LuminanceTitle() const { return intensity_unit == "W/sr" ? "Radiance" : "Luminance"; }
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
  // Over time: "dose_lx_s", "lx s"; J/m^2 of W/m^2.
  std::string DoseKey() const {
    return illuminance_suffix == "w_per_m2" ? "dose_j_per_m2" : "dose_" + illuminance_suffix + "_s";
  }
  std::string DoseUnit() const {
    return illuminance_suffix == "w_per_m2" ? "J/m²" : illuminance_unit + " s";
  }
  // "illuminance_spherical_mean_lx".
  std::string Illuminance(photometry::ReceiverShape shape, const std::string& which) const {
    const std::string name = ShapeName(shape);
    return Illuminance(name + (name.empty() || which.empty() ? "" : "_") + which);
  }
  // "spherical illuminance", "PPFD": within a sentence.
  std::string Received(photometry::ReceiverShape shape) const {
    const std::string name = ShapeName(shape);
    return (name.empty() ? "" : name + " ") +
           (illuminance_suffix == "weighted" ? illuminance : illuminance_key);
  }
  // "Illuminance, spherical".
  std::string IlluminanceTitle(photometry::ReceiverShape shape) const {
    const std::string name = ShapeName(shape);
    return illuminance + (name.empty() ? "" : ", " + name);
  }
};

// Of what channels are weighed into: "irradiance_spherical_weighted".
inline PhotometryNames NamesOf(const photometry::Weighting& weighting) {
  PhotometryNames names;
  names.illuminance_key = "irradiance";
  names.illuminance_suffix = "weighted";
  names.illuminance_unit = weighting.unit;
  names.illuminance = weighting.name;
  return names;
}

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
