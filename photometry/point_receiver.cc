#include "luxfield/photometry/point_receiver.h"

#include <cmath>
#include <numbers>

#include "luxfield/photometry/point_nodes.h"

namespace luxfield::photometry {
namespace {

using lightfield::Dot;
using lightfield::LuminaireGeometry;
using lightfield::PosedLightField;
using lightfield::Vec3;

Vec3 NormalAt(const PointReceiver& receiver, Vec3 p) {
  return receiver.normal.value_or(lightfield::Normalized(-1 * p));
}

// k of the other shapes, of directions in a field's frame.
struct Kernel {
  ReceiverShape shape;
  Vec3 axis, facing;

  double operator()(Vec3 w) const {
    if (shape == ReceiverShape::kSphere) return 0.25;
    const double cosine = Dot(axis, w), sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const double ahead = shape == ReceiverShape::kSemicylinder ? Dot(facing, w) : 0;
    return (sine + ahead) / std::numbers::pi;
  }
};

Kernel KernelIn(const PosedLightField& posed, const PointReceiver& receiver) {
  const auto& pose = posed.luminaire_from_field;
  return {receiver.shape, pose.InverseDirection(receiver.axis),
          pose.InverseDirection(receiver.facing)};
}

// visit(m, row, column, weight) of the coefficients of one field.
template <typename Visit>
void ForField(const PosedLightField& posed, const PointReceiver& receiver, Vec3 p, Visit&& visit) {
  ForWeights(NodesAt(posed.field.geometry, posed.luminaire_from_field.Inverse().Point(p), 1),
             KernelIn(posed, receiver), visit);
}

}  // namespace

Functional ReceivedAt(const Lamp& lamp, const PointReceiver& receiver, Vec3 p) {
  if (receiver.shape == ReceiverShape::kPlane) return IlluminanceAt(lamp, p, NormalAt(receiver, p));
  Functional functional;
  for (const PosedLightField& posed : lamp.fields)
    functional.push_back(OfKernel(posed.field.geometry,
                                  posed.luminaire_from_field.Inverse().Point(p), 1,
                                  KernelIn(posed, receiver)));
  return functional;
}

double ReceivedValue(const Lamp& lamp, const PointReceiver& receiver, Vec3 p) {
  if (receiver.shape == ReceiverShape::kPlane)
    return IlluminanceValue(lamp, p, NormalAt(receiver, p));
  double sum = 0;
  for (const PosedLightField& posed : lamp.fields) {
    const int width = posed.field.geometry.lattice.width;
    ForField(posed, receiver, p, [&](int m, int row, int column, double weight) {
      sum += weight * posed.field.image(m, 0)[std::size_t(row) * width + column];
    });
  }
  return sum;
}

void AddReceived(Functional& sum, double factor, const Lamp& lamp, const PointReceiver& receiver,
                 Vec3 p) {
  if (receiver.shape == ReceiverShape::kPlane) {
    Add(sum, factor, IlluminanceAt(lamp, p, NormalAt(receiver, p)));
    return;
  }
  for (std::size_t k = 0; k < lamp.fields.size(); ++k) {
    const auto& lattice = lamp.fields[k].field.geometry.lattice;
    std::vector<double>& weights = sum[k].weights;
    ForField(lamp.fields[k], receiver, p, [&](int m, int row, int column, double weight) {
      weights[(std::size_t(m) * lattice.height + row) * lattice.width + column] += factor * weight;
    });
  }
}

}  // namespace luxfield::photometry
