#include "luxfield/photometry/beam.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/photometry/planes.h"

namespace luxfield::photometry {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Normalized;
using lightfield::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kAcross = 3;  // points of a map along a receiver's side

// Nodes of equal weight along a receiver's side, shares of it from its middle: two of Gauss, or the
// middles of equal parts, up to 8, of two thirds of a texel of the finest field as seen from the lamp.
std::vector<double> NodesAlong(const Lamp& lamp, const Receiver& receiver) {
  constexpr int kMost = 8;
  double texel = 1e300;
  for (const auto& posed : lamp.fields) {
    const auto& g = posed.field.geometry;
    texel = std::min(texel, std::min(g.lattice.ds_m, g.lattice.dt_m) / g.delta_m);
  }
  const double texels = receiver.side_m / receiver.distance_m / texel;
  const int count = static_cast<int>(std::min<double>(kMost, std::ceil(1.5 * texels)));
  if (count <= 2) return {-0.5 / std::sqrt(3.0), 0.5 / std::sqrt(3.0)};
  std::vector<double> nodes;
  for (int k = 0; k < count; ++k) nodes.push_back((k + 0.5) / count - 0.5);
  return nodes;
}

// of(a node of the receiver, its normal, its share of r^2).
template <typename F>
void ForNodes(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame, Place place,
              F&& of) {
  const BeamFrame at = frame.Turned(place);
  const double r = receiver.distance_m;
  const std::vector<double> nodes = NodesAlong(lamp, receiver);
  const double share = r * r / double(nodes.size() * nodes.size());
  for (const double x : nodes)
    for (const double y : nodes)
      of(r * at.forward + receiver.side_m * (x * at.right + y * at.up), -1 * at.forward, share);
}

// Sums of kAcross neighbours along rows and columns over their number; edges repeat.
std::vector<double> Smoothed(const std::vector<double>& values, int columns, int rows) {
  const auto along = [&](const std::vector<double>& from, int dx, int dy) {
    std::vector<double> to(from.size());
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        double sum = 0;
        for (int k = -(kAcross / 2); k <= kAcross / 2; ++k)
          sum += from[std::size_t(std::clamp(row + k * dy, 0, rows - 1)) * columns +
                      std::clamp(column + k * dx, 0, columns - 1)];
        to[std::size_t(row) * columns + column] = sum / kAcross;
      }
    return to;
  };
  return along(along(values, 1, 0), 0, 1);
}

}  // namespace

BeamFrame BeamFrame::Of(Vec3 forward, Vec3 up) {
  BeamFrame frame;
  frame.forward = Normalized(forward);
  frame.right = Normalized(Cross(frame.forward, up));
  frame.up = Cross(frame.right, frame.forward);
  return frame;
}

Vec3 BeamFrame::Direction(Place place) const {
  const double h = place.h_deg * kDegree, v = place.v_deg * kDegree;
  return std::cos(v) * (std::cos(h) * forward + std::sin(h) * right) + std::sin(v) * up;
}

Place BeamFrame::PlaceOf(Vec3 direction) const {
  const double x = Dot(direction, right), y = Dot(direction, up), z = Dot(direction, forward);
  return {std::atan2(x, z) / kDegree, std::atan2(y, std::hypot(x, z)) / kDegree};
}

BeamFrame BeamFrame::Turned(Place place) const {
  BeamFrame turned;
  const double h = place.h_deg * kDegree;
  turned.forward = Direction(place);
  turned.right = std::cos(h) * right - std::sin(h) * forward;
  turned.up = Cross(turned.right, turned.forward);
  return turned;
}

double ReceivedValue(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                     Place place) {
  double value = 0;
  ForNodes(lamp, receiver, frame, place,
           [&](Vec3 p, Vec3 n, double share) { value += share * IlluminanceValue(lamp, p, n); });
  return value;
}

Functional Received(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                    Place place) {
  std::vector<WeighedReceiver> nodes;
  ForNodes(lamp, receiver, frame, place, [&](Vec3 p, Vec3 n, double share) {
    nodes.push_back({share, p, n});
  });
  return IlluminanceSum(lamp, nodes);
}

BeamMap::BeamMap(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame, Place low,
                 Place high)
    : frame_(frame) {
  constexpr double kFarthest_deg = 60;
  const auto tangent = [&](double degrees) {
    return std::tan(std::clamp(degrees, -kFarthest_deg, kFarthest_deg) * kDegree);
  };
  pitch_ = receiver.side_m / receiver.distance_m / kAcross;
  // V is that of the middle of a row; at its ends, off to the side, tan V cos H is less.
  const double x0 = tangent(low.h_deg), x1 = tangent(high.h_deg), y0 = tangent(low.v_deg),
               y1 = tangent(high.v_deg), stretch = std::hypot(1.0, std::max(-x0, x1));
  x0_ = x0;
  y1_ = y1 > 0 ? y1 * stretch : y1;
  const double y_low = y0 < 0 ? y0 * stretch : y0;
  columns_ = std::max(2, static_cast<int>(std::ceil((x1 - x0) / pitch_)) + 1);
  rows_ = std::max(2, static_cast<int>(std::ceil((y1_ - y_low) / pitch_)) + 1);
  const double r = receiver.distance_m;
  PlaneAsked screen;
  screen.right = frame.right;
  screen.up = frame.up;
  screen.columns = columns_;
  screen.rows = rows_;
  screen.width_m = columns_ * pitch_ * r;
  screen.height_m = rows_ * pitch_ * r;
  screen.centre_m = r * (frame.forward + (x0_ + 0.5 * (columns_ - 1) * pitch_) * frame.right +
                         (y1_ - 0.5 * (rows_ - 1) * pitch_) * frame.up);
  const std::vector<Vec3> vectors = LightVectorsOn(lamp, screen);
  values_.resize(vectors.size());
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const std::size_t k = std::size_t(row) * columns_ + column;
      const Vec3 p = screen.Point(column, row);
      values_[k] = -Length(p) * Dot(vectors[k], p);  // r^2 J . (-p / r)
    }
  values_ = Smoothed(values_, columns_, rows_);
}

std::optional<double> BeamMap::At(Vec3 direction) const {
  const double z = Dot(direction, frame_.forward);
  if (!(z > 0)) return {};
  const double x = (Dot(direction, frame_.right) / z - x0_) / pitch_,
               y = (y1_ - Dot(direction, frame_.up) / z) / pitch_;
  if (!(x >= 0 && y >= 0 && x <= columns_ - 1 && y <= rows_ - 1)) return {};
  const int column = std::min(static_cast<int>(x), columns_ - 2),
            row = std::min(static_cast<int>(y), rows_ - 2);
  const double fx = x - column, fy = y - row;
  const double* at = &values_[std::size_t(row) * columns_ + column];
  return (1 - fy) * ((1 - fx) * at[0] + fx * at[1]) +
         fy * ((1 - fx) * at[columns_] + fx * at[columns_ + 1]);
}

}  // namespace luxfield::photometry
