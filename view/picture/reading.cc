#include "luxfield/view/picture/reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/core/colour.h"
#include "luxfield/render/film/neighbours.h"

namespace luxfield::view {
namespace {

double LuminanceAt(const core::Image& image, int column, int row) {
  return core::Luminance(
      {image.at(0, row, column), image.at(1, row, column), image.at(2, row, column)});
}

bool Hit(const render::Frame& frame, int column, int row) {
  return !frame.coverage.data.empty() && frame.coverage.at(0, row, column) > 0;
}

// Of the luminance. A pixel's samples hardly know their own variance: in a penumbra all of a few may
// see the light. Those of the 3 x 3 pixels around it know that of one sample, and so its own.
double VarianceAt(const render::Frame& frame, int column, int row) {
  const double own = frame.variance.at(0, row, column);
  if (frame.samples.data.empty() || !(frame.samples.at(0, row, column) > 0)) return own;
  core::Image of_one(3, 3, 1), counted(3, 3, 1);
  for (int r = std::max(0, row - 1); r <= std::min(frame.height - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(frame.width - 1, column + 1); ++c) {
      const float samples = frame.samples.at(0, r, c);
      counted.at(0, r - row + 1, c - column + 1) = samples;
      of_one.at(0, r - row + 1, c - column + 1) = samples * frame.variance.at(0, r, c);
    }
  return render::MeanAround(of_one, counted, 1, 1) / frame.samples.at(0, row, column);
}

}  // namespace

std::optional<Reading> ReadAt(const render::Frame& frame, int column, int row) {
  if (column < 0 || row < 0 || column >= frame.width || row >= frame.height) return {};
  Reading reading;
  reading.column = column;
  reading.row = row;
  reading.luminance = LuminanceAt(frame.radiance, column, row);
  const bool hit = Hit(frame, column, row);
  if (hit && !frame.irradiance.data.empty())
    reading.illuminance = LuminanceAt(frame.irradiance, column, row);
  if (!frame.variance.data.empty())
    reading.luminance_sigma = std::sqrt(std::max(0.0, VarianceAt(frame, column, row)));
  if (hit && !frame.position.data.empty())
    reading.position = {frame.position.at(0, row, column), frame.position.at(1, row, column),
                        frame.position.at(2, row, column)};
  if (hit && !frame.normal.data.empty())
    reading.normal = {frame.normal.at(0, row, column), frame.normal.at(1, row, column),
                      frame.normal.at(2, row, column)};
  return reading;
}

std::optional<Reading> ReadAtPlace(const render::Frame& frame, PicturePlace place, int width,
                                   int height) {
  auto reading = ReadAt(frame, static_cast<int>(place.x * frame.width),
                        static_cast<int>(place.y * frame.height));
  if (!reading) return {};
  reading->column = static_cast<int>(place.x * width);
  reading->row = static_cast<int>(place.y * height);
  return reading;
}

std::optional<double> Reading::IlluminanceSigma() const {
  if (!illuminance || !luminance_sigma || !(luminance > 0)) return {};
  return *illuminance * *luminance_sigma / luminance;
}

std::string WithSigma(double value, const std::optional<double>& sigma) {
  if (!sigma || !(*sigma > 0)) return cli::Digits(value, 4);
  return cli::RoundedTo(value, sigma) + " +- " + cli::UncertaintyText(*sigma);
}

std::string Describe(const Reading& reading, lightfield::FluxUnit unit) {
  std::string text = fmt::format("({}, {})  {} {}", reading.column, reading.row,
                                 WithSigma(reading.luminance, reading.luminance_sigma),
                                 render::RadianceUnitName(unit));
  if (reading.illuminance)
    text += fmt::format("  {} {} (direct light only)",
                        WithSigma(*reading.illuminance, reading.IlluminanceSigma()),
                        render::IrradianceUnitName(unit));
  if (reading.measured_rel_sigma)
    text += fmt::format("  measured to {:.2g} %", 100 * *reading.measured_rel_sigma);
  if (reading.position)
    text += fmt::format("  at {:.3f} {:.3f} {:.3f} m", reading.position->x, reading.position->y,
                        reading.position->z);
  return text;
}

}  // namespace luxfield::view
