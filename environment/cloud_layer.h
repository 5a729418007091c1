// Clouds as a thin layer at one altitude over a spherical earth, drifting with the wind
// (docs/theory.md section 8). Where the field g of environment/cloud_field.h is among its highest
// `cover`, with P(g) the share of places above g,
//
//   tau = tau_mean / Gamma(1 + 1/k) (-ln(P(g) / cover))^(1/k),   k = 1 + 3 cover,
//
// elsewhere 0: optical thickness has a Weibull distribution inside of clouds, exponential where
// they are few (Barker, Wielicki and Parker 1996), narrow where they close. Light goes through each
// column by itself: by the delta-Eddington approximation for conservative scattering (Joseph,
// Wiscombe and Weinman 1976) with asymmetry g = 0.85 of water clouds, tau' = (1 - g^2) tau.
#pragma once

#include <cstdint>
#include <vector>

#include "luxfield/environment/cloud_field.h"
#include "luxfield/environment/sun_position.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

struct CloudOptions {
  double cover = 0;  // share of the layer that is cloud, above 0 to 1
  std::uint64_t seed = 1;
  double wind_m_s = 8;
  double wind_from_deg = 250;  // from north (0) over east (90)
  double altitude_m = 1500;
  double optical_thickness = 12;  // mean of the clouds along the vertical, at all wavelengths
};

// Shares of light that a column of optical thickness tau lets through. Sunlight at the cosine
// `cosine` of the zenith angle, all of it that arrives below and what goes straight on, scattered
// by its forward peak included or not; light of an even sky.
double TransmittedSunlight(double tau, double cosine);
double StraightSunlight(double tau, double cosine);
double UnscatteredSunlight(double tau, double cosine);
double TransmittedSkylight(double tau);

class CloudLayer {
 public:
  // Throws InputError for a cover, a wind, an altitude (100 to 12000 m) or a thickness (0.1 to 200)
  // out of range.
  CloudLayer(const CloudOptions& options, UtcTime when, lightfield::Vec3 sun_direction);

  // Means over what a line of sight of angular width `width` (radians) meets. The direction is
  // above the horizon.
  struct Sight {
    double cloud = 0;    // share that is cloud
    double through = 1;  // of the clear sky behind, its scattering by less than the peak included
    double sun_diffuse = 0;          // of the sun's flux, scattered down
    double forward_scatterings = 1;  // that make up sun_forward, on average, at least 1
    double sun_forward = 0;          // of the sun's beam, scattered in the forward peak
    double sky_diffuse = 0;          // of the clear sky's flux, scattered down
    double reflected = 0;            // of the flux from below, thrown back
  };
  Sight See(lightfield::Vec3 direction, double width) const;
  Sight MeanSight() const;  // of the layer, its `through` along the sun's rays
  // Unscattered share of the sun's beam: over the disc, and over the layer.
  double SunThrough(double disc_radius) const;
  double MeanSunThrough() const;

  double OpticalThickness(
      lightfield::Vec2 position_m) const;            // over a place, metres to the east and north
  double SlantOf(lightfield::Vec3 direction) const;  // path below the layer over its altitude
  const CloudOptions& options() const { return options_; }

 private:
  static constexpr int kMeans = 257, kSigmas = 11, kSlants = 40, kFluxes = 3;
  struct Place {
    lightfield::Vec2 position;
    double distance, cosine;  // of the line of sight; to the layer's own zenith
  };
  Place PlaceOf(lightfield::Vec3 direction) const;
  CloudField::Value FieldAt(const Place& place, double width) const;
  double ThicknessOf(double g) const;
  void FillTables();
  // Entries of the tables at a mean and a deviation of the field.
  struct Cell {
    int index[4];
    double weight[4];
  };
  static Cell CellOf(CloudField::Value g);
  double Through(const Cell& cell, double slant) const;
  Sight SightOf(CloudField::Value g, double slant) const;

  CloudOptions options_;
  CloudField field_;
  lightfield::Vec2 drift_m_;
  lightfield::Vec3 sun_direction_;
  double sun_cosine_ = 1, threshold_ = 0, scale_ = 1, shape_ = 1;
  std::vector<float> fluxes_;   // kMeans x kSigmas x kFluxes
  std::vector<float> through_;  // kMeans x kSigmas x kSlants
};

}  // namespace luxfield::environment
