#include "luxfield/environment/cloud_layer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"

namespace luxfield::environment {
namespace {

constexpr double kEarthRadius = 6.371e6, kCellPerAltitude = 1.6;
constexpr double kAsymmetry = 0.85, kForward = kAsymmetry * kAsymmetry;
constexpr double kLargestMean = 4;     // of the field in the tables
constexpr double kLargestSlant = 400;  // of the tables, times 1 / (1 - kForward) included

// Share of the standard normal distribution above x.
double UpperTail(double x) { return 0.5 * std::erfc(x / std::numbers::sqrt2); }

// The inverse of UpperTail, by bisection.
double UpperQuantile(double share) {
  double low = -9, high = 9;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (UpperTail(middle) > share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void Require(double value, double least, double largest, const char* name) {
  if (!(value >= least && value <= largest))
    throw InputError(fmt::format("{} {} must be from {} to {}", name, value, least, largest));
}

CloudOptions Checked(const CloudOptions& options) {
  if (!(options.cover > 0 && options.cover <= 1))
    throw InputError(fmt::format("cloud cover {} must be above 0 to 1", options.cover));
  Require(options.altitude_m, 100, 12000, "cloud altitude");
  Require(options.optical_thickness, 0.1, 200, "optical thickness of clouds");
  Require(options.wind_m_s, 0, 150, "wind speed");
  Require(options.wind_from_deg, -360, 360, "wind direction");
  return options;
}

lightfield::Vec2 Drift(const CloudOptions& options, UtcTime when) {
  const double seconds = double(when.time_since_epoch().count());
  const double from = options.wind_from_deg * std::numbers::pi / 180;
  return {-seconds * options.wind_m_s * std::sin(from),
          -seconds * options.wind_m_s * std::cos(from)};
}

}  // namespace

double UnscatteredSunlight(double tau, double cosine) { return std::exp(-tau / cosine); }

double StraightSunlight(double tau, double cosine) {
  return std::exp(-(1 - kForward) * tau / cosine);
}

double TransmittedSunlight(double tau, double cosine) {
  return (2 + 3 * cosine + (2 - 3 * cosine) * StraightSunlight(tau, cosine)) /
         (4 + 3 * (1 - kAsymmetry) * tau);
}

double TransmittedSkylight(double tau) { return TransmittedSunlight(tau, 2.0 / 3); }

CloudLayer::CloudLayer(const CloudOptions& options, UtcTime when, lightfield::Vec3 sun_direction)
    : options_(Checked(options)),
      field_(options.seed, kCellPerAltitude * options.altitude_m),
      drift_m_(Drift(options, when)),
      sun_direction_(sun_direction),
      threshold_(UpperQuantile(options.cover)),
      shape_(1 + 3 * options.cover) {
  sun_cosine_ = PlaceOf(sun_direction).cosine;
  scale_ = options.optical_thickness / std::tgamma(1 + 1 / shape_);
  FillTables();
}

double CloudLayer::ThicknessOf(double g) const {
  const double share = UpperTail(g) / options_.cover;
  return share < 1 ? scale_ * std::pow(-std::log(share), 1 / shape_) : 0;
}

double CloudLayer::OpticalThickness(lightfield::Vec2 position) const {
  return ThicknessOf(field_.At({position.x - drift_m_.x, position.y - drift_m_.y}, 0).mean);
}

CloudLayer::Place CloudLayer::PlaceOf(lightfield::Vec3 w) const {
  const double h = options_.altitude_m, up = kEarthRadius * std::max(0.0, w.z);
  const double distance =
      (2 * kEarthRadius + h) * h / (up + std::sqrt(up * up + (2 * kEarthRadius + h) * h));
  const double level = std::hypot(w.x, w.y);
  const double arc = kEarthRadius * std::atan2(distance * level, kEarthRadius + distance * w.z);
  const double scale = level > 0 ? arc / level : 0;
  return {{scale * w.x, scale * w.y}, distance, (up + distance) / (kEarthRadius + h)};
}

double CloudLayer::SlantOf(lightfield::Vec3 direction) const {
  return PlaceOf(direction).distance / options_.altitude_m;
}

CloudField::Value CloudLayer::FieldAt(const Place& place, double width) const {
  return field_.At({place.position.x - drift_m_.x, place.position.y - drift_m_.y},
                   width * place.distance / place.cosine);
}

// Means over a normal distribution of the field by a sum over its values, 1/64 apart.
void CloudLayer::FillTables() {
  constexpr int kSteps = 64, kReach = 8;
  constexpr int kValues = 2 * kReach * kSteps + 1, kEntries = kFluxes + kSlants;
  std::vector<double> values(kValues * kEntries);
  for (int v = 0; v < kValues; ++v) {
    const double tau = ThicknessOf(double(v) / kSteps - kReach);
    double* entry = &values[v * kEntries];
    const double sky = TransmittedSkylight(tau);
    *entry++ = TransmittedSunlight(tau, sun_cosine_) - StraightSunlight(tau, sun_cosine_);
    *entry++ = sky - StraightSunlight(tau, 2.0 / 3);
    *entry++ = 1 - sky;
    for (int s = 0; s < kSlants; ++s)
      *entry++ =
          std::exp(-(1 - kForward) * tau * std::pow(kLargestSlant, double(s) / (kSlants - 1)));
  }
  fluxes_.resize(kMeans * kSigmas * kFluxes);
  through_.resize(kMeans * kSigmas * kSlants);
  std::array<double, kEntries> sum;
  for (int m = 0; m < kMeans; ++m)
    for (int d = 0; d < kSigmas; ++d) {
      const double mean = kLargestMean * (2.0 * m / (kMeans - 1) - 1), sigma = d / (kSigmas - 1.0);
      const int centre = static_cast<int>(std::lround((mean + kReach) * kSteps));
      const int reach = static_cast<int>(std::lround(3.5 * sigma * kSteps));
      sum.fill(0);
      double weights = 0;
      for (int v = centre - reach; v <= centre + reach; ++v) {
        const double x = double(v) / kSteps - kReach - mean;
        const double weight = d == 0 ? 1 : std::exp(-0.5 * x * x / (sigma * sigma));
        weights += weight;
        for (int k = 0; k < kEntries; ++k) sum[k] += weight * values[v * kEntries + k];
      }
      const int cell = m * kSigmas + d;
      for (int k = 0; k < kFluxes; ++k)
        fluxes_[cell * kFluxes + k] = static_cast<float>(sum[k] / weights);
      for (int s = 0; s < kSlants; ++s)
        through_[cell * kSlants + s] = static_cast<float>(sum[kFluxes + s] / weights);
    }
}

CloudLayer::Cell CloudLayer::CellOf(CloudField::Value g) {
  const double x = std::clamp((g.mean / kLargestMean + 1) / 2, 0.0, 1.0) * (kMeans - 1);
  const double y = std::clamp(g.sigma, 0.0, 1.0) * (kSigmas - 1);
  const int i = std::min(static_cast<int>(x), kMeans - 2),
            j = std::min(static_cast<int>(y), kSigmas - 2);
  const double u = x - i, v = y - j;
  const int cell = i * kSigmas + j;
  return {{cell, cell + 1, cell + kSigmas, cell + kSigmas + 1},
          {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v}};
}

double CloudLayer::Through(const Cell& cell, double slant) const {
  const double x = std::clamp(std::log(slant) / std::log(kLargestSlant), 0.0, 1.0) * (kSlants - 1);
  const int s = std::min(static_cast<int>(x), kSlants - 2);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const float* entry = &through_[cell.index[k] * kSlants + s];
    sum += cell.weight[k] * ((s + 1 - x) * entry[0] + (x - s) * entry[1]);
  }
  return sum;
}

CloudLayer::Sight CloudLayer::SightOf(CloudField::Value g, double slant) const {
  const Cell cell = CellOf(g);
  std::array<double, kFluxes> flux{};
  for (int k = 0; k < 4; ++k)
    for (int f = 0; f < kFluxes; ++f)
      flux[f] += cell.weight[k] * fluxes_[cell.index[k] * kFluxes + f];
  const double sun_slant = 1 / sun_cosine_;
  const double cloud =
      g.sigma > 0 ? UpperTail((threshold_ - g.mean) / g.sigma) : (g.mean > threshold_ ? 1.0 : 0.0);
  Sight sight;
  sight.cloud = cloud;
  sight.through = Through(cell, slant);
  const double straight = Through(cell, sun_slant);
  sight.forward_scatterings = std::max(1.0, -std::log(straight) * kForward / (1 - kForward));
  sight.sun_forward = straight - Through(cell, sun_slant / (1 - kForward));
  sight.sun_diffuse = flux[0];
  sight.sky_diffuse = flux[1];
  sight.reflected = flux[2];
  return sight;
}

CloudLayer::Sight CloudLayer::See(lightfield::Vec3 direction, double width) const {
  const Place place = PlaceOf(direction);
  return SightOf(FieldAt(place, width), 1 / place.cosine);
}

CloudLayer::Sight CloudLayer::MeanSight() const { return SightOf({0, 1}, 1 / sun_cosine_); }

double CloudLayer::SunThrough(double disc_radius) const {
  const auto g = FieldAt(PlaceOf(sun_direction_), 2 * disc_radius);
  return Through(CellOf(g), 1 / (sun_cosine_ * (1 - kForward)));
}

double CloudLayer::MeanSunThrough() const {
  return Through(CellOf({0, 1}), 1 / (sun_cosine_ * (1 - kForward)));
}

}  // namespace luxfield::environment
