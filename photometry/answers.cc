#include "luxfield/photometry/answers.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/luminance.h"
#include "luxfield/photometry/planes.h"

namespace luxfield::photometry {
namespace {

// least / of, with the uncertainty of their weights.
std::optional<Estimate> RatioOf(const Lamp& lamp, double least, const Functional& least_weights,
                                double of, const Functional& of_weights) {
  if (!(of > 0) || least < 0) return {};
  Estimate ratio{least / of, {}};
  if (!lamp.noise.empty())
    ratio.u = Uncertainty(lamp, Sum({{1 / of, &least_weights}, {-ratio.value / of, &of_weights}}));
  return ratio;
}

bool IsInCandela(const Lamp& lamp) { return lamp.unit == lightfield::FluxUnit::kLumen; }

// Of the opening as one area of the mean luminance that the eye sees of it,
//
//   L = integral L dw / omega
//
// Absent of one that is dark, or seen from the side or behind, which the formula is not for.
std::optional<Estimate> PlainRatingOf(const Lamp& lamp, const EyeAsked& asked) {
  const auto [width_m, height_m] = *asked.opening_m;
  const double omega = SolidAngleOfOpening(asked.eye_m, width_m, height_m);
  const auto direction = Normalized(-1 * asked.eye_m);
  if (!(omega > 0) || !(Dot(direction, *asked.line_of_sight) > 0)) return {};
  const Functional light = FluenceRateAt(lamp, asked.eye_m);
  const Estimate luminance = Evaluate(lamp, Sum({{1 / omega, &light}}));
  if (!(luminance.value > 0)) return {};
  Estimate rating{UnifiedGlareRating(luminance.value, omega,
                                     PositionIndex(*asked.line_of_sight, asked.up, direction),
                                     *asked.background),
                  {}};
  // d UGR = 8 / ln 10 d(L^2) / L^2
  if (luminance.u) rating.u = 16 / std::numbers::ln10 * *luminance.u / luminance.value;
  return rating;
}

struct GlareRatings {
  std::optional<Estimate> ugr, plain;
};
GlareRatings RatingsOf(const Lamp& lamp, const EyeAsked& asked,
                       const std::vector<BrightRay>& bright) {
  if (!asked.background) return {};
  return {
      GlareRatingOf(lamp, asked.eye_m, bright, *asked.line_of_sight, asked.up, *asked.background),
      asked.opening_m ? PlainRatingOf(lamp, asked) : std::nullopt};
}

// Of what stands in its values; at(k) and mean() are their weights.
template <typename At, typename Mean>
void Summarise(const Lamp& lamp, At&& at, Mean&& mean, ManyPoints* points) {
  const auto& values = points->values;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  points->least_at = static_cast<std::size_t>(least - values.begin());
  points->most_at = static_cast<std::size_t>(most - values.begin());
  points->mean.value =
      std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  points->least.value = *least;
  points->most.value = *most;
  Functional of_least, of_most, of_mean;
  if (!lamp.noise.empty()) {
    of_least = at(points->least_at);
    of_most = at(points->most_at);
    of_mean = mean();
  }
  points->mean.u = Uncertainty(lamp, of_mean);
  points->least.u = Uncertainty(lamp, of_least);
  points->most.u = Uncertainty(lamp, of_most);
  points->uniformity = RatioOf(lamp, *least, of_least, points->mean.value, of_mean);
  points->diversity = RatioOf(lamp, *least, of_least, *most, of_most);
}

}  // namespace

PointAnswer AnswerAt(const Lamp& lamp, const PointAsked& asked) {
  PointAnswer answer;
  answer.asked = asked;
  answer.illuminance = {IlluminanceValue(lamp, asked.p_m, asked.normal),
                        Uncertainty(lamp, IlluminanceAt(lamp, asked.p_m, asked.normal))};
  const auto j = LightVectorAt(lamp, asked.p_m);
  for (std::size_t k = 0; k < j.size(); ++k) answer.light_vector[k] = Evaluate(lamp, j[k]);
  const auto received = [&](const PointReceiver& receiver) {
    return Evaluate(lamp, ReceivedAt(lamp, receiver, asked.p_m));
  };
  answer.spherical = received({.shape = ReceiverShape::kSphere});
  answer.cylindrical = received({.shape = ReceiverShape::kCylinder, .axis = asked.axis});
  if (asked.facing)
    answer.semicylindrical = received(
        {.shape = ReceiverShape::kSemicylinder, .axis = asked.axis, .facing = *asked.facing});
  return answer;
}

EyeAnswer AnswerFor(const Lamp& lamp, const EyeAsked& asked) {
  EyeAnswer answer;
  answer.asked = asked;
  for (const double mrad : asked.fields_of_view_mrad) {
    const double angle = 1e-3 * mrad;
    const auto w = BrightestPlace(lamp, asked.eye_m, angle);
    const auto ray = BrightestRay(lamp, asked.eye_m, w, angle);
    answer.fields.push_back({mrad, Evaluate(lamp, MeanLuminance(lamp, asked.eye_m, w, angle)), w,
                             Evaluate(lamp, LuminanceTowards(lamp, asked.eye_m, ray)), ray});
  }
  if (IsInCandela(lamp)) {
    const auto bright = BrightRays(lamp, asked.eye_m, asked.threshold);
    answer.area = AreaOf(lamp, asked.eye_m, bright);
    const auto [ugr, plain] = RatingsOf(lamp, asked, bright);
    answer.ugr = ugr;
    answer.plain_ugr = plain;
  }
  if (!asked.line_of_sight) return answer;
  answer.veiling =
      Evaluate(lamp, VeilingLuminanceAt(lamp, asked.eye_m, *asked.line_of_sight, asked.age_years));
  if (asked.road_luminance && IsInCandela(lamp)) {
    const double factor = ThresholdIncrement(1, *asked.road_luminance);
    answer.threshold_increment =
        Estimate{factor * answer.veiling->value,
                 answer.veiling->u ? std::optional(factor * *answer.veiling->u) : std::nullopt};
  }
  return answer;
}

GlareAnswer AnswerFor(const Lamp& lamp, const GlareAsked& asked) {
  GlareAnswer answer{asked, {}, {}};
  for (std::size_t plane = 0; plane < asked.c_deg.size(); ++plane)
    for (std::size_t distance = 0; distance < asked.distances_m.size(); ++distance) {
      const EyeAsked eye = asked.Eye(plane, distance);
      GlareRatings ratings;
      if (IsInCandela(lamp))
        ratings = RatingsOf(lamp, eye, BrightRays(lamp, eye.eye_m, asked.threshold));
      answer.ugr.push_back(ratings.ugr);
      answer.plain_ugr.push_back(ratings.plain);
    }
  return answer;
}

LineAnswer AnswerAlong(const Lamp& lamp, const LineAsked& asked) {
  LineAnswer answer{asked, std::vector<PointAnswer>(asked.points)};
  core::ParallelFor(answer.points.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      answer.points[k] = AnswerAt(lamp, asked.Point(static_cast<int>(k)));
  });
  return answer;
}

PlaneAnswer AnswerOn(const Lamp& lamp, const PlaneAsked& asked) {
  PlaneAnswer answer;
  answer.asked = asked;
  answer.values = ReceivedOn(lamp, asked);
  const PointReceiver receiver = ReceiverOn(asked);
  Summarise(
      lamp, [&](std::size_t k) { return ReceivedAt(lamp, receiver, asked.PointAt(k)); },
      [&] { return MeanReceivedOn(lamp, asked); }, &answer);
  return answer;
}

VolumeAnswer AnswerIn(const Lamp& lamp, const VolumeAsked& asked) {
  VolumeAnswer answer;
  answer.asked = asked;
  for (int layer = 0; layer < asked.layers; ++layer) {
    const auto values = ReceivedOn(lamp, asked.Layer(layer));
    answer.values.insert(answer.values.end(), values.begin(), values.end());
  }
  const auto at = [&](std::size_t k) {
    const PlaneAsked layer = asked.Layer(static_cast<int>(k / asked.middle.count()));
    return ReceivedAt(lamp, ReceiverOn(layer), layer.PointAt(k % asked.middle.count()));
  };
  const auto mean = [&] {
    Functional sum = ZeroOf(lamp);
    for (int layer = 0; layer < asked.layers; ++layer)
      Add(sum, 1.0 / asked.layers, MeanReceivedOn(lamp, asked.Layer(layer)));
    return sum;
  };
  Summarise(lamp, at, mean, &answer);
  return answer;
}

PlaneAsked PlaneOfBeam(const Distribution& distribution, double distance_m) {
  constexpr double kDegree = std::numbers::pi / 180, kMargin = 1.2;
  constexpr int kPoints = 51, kParts = 20;
  const double half =
      kMargin * std::tan(std::clamp(EdgeGammaOf(distribution), 3.0, 60.0) * kDegree);
  const double width = 2 * distance_m * std::ceil(kParts * half) / kParts;
  return PlaneBefore(distance_m, width, width, kPoints, kPoints);
}

}  // namespace luxfield::photometry
