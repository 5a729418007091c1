#include "luxfield/photometry/comparison.h"

#include <cmath>

namespace luxfield::photometry {

std::optional<Estimate> ComparedQuantity::Difference() const {
  if (!a || !b) return {};
  Estimate difference{a->value - b->value, {}};
  if (a->u && b->u) difference.u = std::hypot(*a->u, *b->u);
  return difference;
}

std::optional<double> ComparedQuantity::InUncertainties() const {
  const auto difference = Difference();
  if (!difference || !difference->u || !(*difference->u > 0)) return {};
  return difference->value / *difference->u;
}

Comparison Compare(const Lamp& a, const Lamp& b, const ColourLamp* colour_a,
                   const ColourLamp* colour_b, const PlaneAsked& plane) {
  using Unit = ComparedUnit;
  const Distribution da = DistributionOf(a), db = DistributionOf(b);
  Comparison comparison{{}, AnswerOn(a, plane), AnswerOn(b, plane)};
  const auto add = [&](std::string name, Unit unit, std::optional<Estimate> of_a,
                       std::optional<Estimate> of_b) {
    comparison.quantities.push_back({std::move(name), unit, of_a, of_b});
  };
  add("flux", Unit::kFlux, da.flux, db.flux);
  add("intensity on the axis", Unit::kIntensity, da.axis, db.axis);
  add("largest intensity", Unit::kIntensity, da.peak, db.peak);
  const auto angle = [](const std::optional<BeamAngle>& beam) {
    return beam ? std::optional(beam->mean_deg) : std::nullopt;
  };
  add("beam angle", Unit::kDegree, angle(da.beam), angle(db.beam));
  add("field angle", Unit::kDegree, angle(da.field), angle(db.field));
  const PlaneAnswer &pa = comparison.plane_a, &pb = comparison.plane_b;
  add("mean illuminance", Unit::kIlluminance, pa.mean, pb.mean);
  add("largest illuminance", Unit::kIlluminance, pa.most, pb.most);
  add("smallest illuminance", Unit::kIlluminance, pa.least, pb.least);
  add("uniformity, smallest / mean", Unit::kNone, pa.uniformity, pb.uniformity);
  if (!colour_a || !colour_b) return comparison;
  const auto ca = ColourOf(*colour_a, FluxOf(colour_a->channels[0])),
             cb = ColourOf(*colour_b, FluxOf(colour_b->channels[0]));
  const auto part = [](const std::optional<Colour>& colour, Estimate Colour::*which) {
    return colour ? std::optional((*colour).*which) : std::nullopt;
  };
  add("u' of the flux", Unit::kNone, part(ca, &Colour::u), part(cb, &Colour::u));
  add("v' of the flux", Unit::kNone, part(ca, &Colour::v), part(cb, &Colour::v));
  return comparison;
}

}  // namespace luxfield::photometry
