#include "luxfield/photometry/aimed_beam.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {
namespace {

using Kind = Requirement::Kind;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAlongLine_deg = 0.05, kInZone_deg = 0.1;

struct Box {
  Place low{1e9, 1e9}, high{-1e9, -1e9};
  void Hold(Place place) {
    low = {std::min(low.h_deg, place.h_deg), std::min(low.v_deg, place.v_deg)};
    high = {std::max(high.h_deg, place.h_deg), std::max(high.v_deg, place.v_deg)};
  }
};

// In the aimed frame: what is asked for and where the lamp may be turned to, on the side that a flat
// screen shows well.
Box AskedBox(const Regulation& regulation) {
  constexpr Place kLow{-25, -32}, kHigh{25, 32};
  Box box;
  for (const Requirement& one : regulation.requirements)
    if (one.kind != Kind::kFlux)
      for (const Place& place : one.places) box.Hold(place);
  if (box.low.h_deg > box.high.h_deg) box.Hold({});
  const double h = regulation.aiming.tolerance_h_deg + 0.2,
               v = regulation.aiming.tolerance_v_deg + 0.2;
  return {{std::max(kLow.h_deg, box.low.h_deg - h), std::max(kLow.v_deg, box.low.v_deg - v)},
          {std::min(kHigh.h_deg, box.high.h_deg + h), std::min(kHigh.v_deg, box.high.v_deg + v)}};
}

// The same in the frame before aiming.
Box MapOf(const Regulation& regulation, const BeamFrame& mounted, const BeamFrame& frame) {
  constexpr int kSteps = 16;
  const Box asked = AskedBox(regulation);
  const auto between = [](double low, double high, int k) {
    return low + (high - low) * k / kSteps;
  };
  Box box;
  for (int h = 0; h <= kSteps; ++h)
    for (int v = 0; v <= kSteps; ++v)
      box.Hold(mounted.PlaceOf(frame.Direction({between(asked.low.h_deg, asked.high.h_deg, h),
                                                between(asked.low.v_deg, asked.high.v_deg, v)})));
  return box;
}

Place Between(Place a, Place b, double share) {
  return {a.h_deg + share * (b.h_deg - a.h_deg), a.v_deg + share * (b.v_deg - a.v_deg)};
}

void AddLine(std::vector<Place>* places, Place a, Place b, double step) {
  const double length = std::hypot(b.h_deg - a.h_deg, b.v_deg - a.v_deg);
  const int steps = std::max(1, static_cast<int>(std::ceil(length / step)));
  for (int k = 0; k <= steps; ++k) places->push_back(Between(a, b, double(k) / steps));
}

std::vector<Place> ZoneSamples(const std::vector<Place>& corners) {
  constexpr double kMost = 20000;
  Box box;
  for (const Place& corner : corners) box.Hold(corner);
  const double width = box.high.h_deg - box.low.h_deg, height = box.high.v_deg - box.low.v_deg;
  const double step = std::max(kInZone_deg, std::sqrt(width * height / kMost));
  std::vector<Place> places;
  for (std::size_t k = 0; k < corners.size(); ++k)
    AddLine(&places, corners[k], corners[(k + 1) % corners.size()], step);
  const int columns = static_cast<int>(width / step), rows = static_cast<int>(height / step);
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const Place place{box.low.h_deg + column * step, box.low.v_deg + row * step};
      if (Holds(corners, place)) places.push_back(place);
    }
  return places;
}

// Cells of a flux's rectangle: a quarter of the angle on which intensity changes.
double FluxStep(const Lamp& lamp) {
  constexpr double kFinest_deg = 0.25, kCoarsest_deg = 1;
  return std::clamp(FinestAngle(lamp) / kDegree / 4, kFinest_deg, kCoarsest_deg);
}

// of(place, solid angle) for cells of a rectangle.
template <typename F>
void ForCells(const Requirement& flux, double step, F&& of) {
  Box box;
  for (const Place& place : flux.places) box.Hold(place);
  const auto count = [&](double extent) {
    return std::max(1, static_cast<int>(std::ceil(extent / step - 1e-9)));
  };
  const int columns = count(box.high.h_deg - box.low.h_deg),
            rows = count(box.high.v_deg - box.low.v_deg);
  const double dh = (box.high.h_deg - box.low.h_deg) / columns,
               dv = (box.high.v_deg - box.low.v_deg) / rows;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Place place{box.low.h_deg + (column + 0.5) * dh, box.low.v_deg + (row + 0.5) * dv};
      of(place, std::cos(place.v_deg * kDegree) * dh * kDegree * dv * kDegree);
    }
}

}  // namespace

bool Holds(const std::vector<Place>& polygon, Place place) {
  constexpr double kOnBorder = 1e-9;
  bool inside = false;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Place a = polygon[k], b = polygon[(k + 1) % polygon.size()];
    const double dh = b.h_deg - a.h_deg, dv = b.v_deg - a.v_deg, length = std::hypot(dh, dv);
    if (length == 0) continue;
    const double along = ((place.h_deg - a.h_deg) * dh + (place.v_deg - a.v_deg) * dv) / length,
                 off = ((place.h_deg - a.h_deg) * dv - (place.v_deg - a.v_deg) * dh) / length;
    if (std::abs(off) <= kOnBorder && along >= -kOnBorder && along <= length + kOnBorder)
      return true;
    if ((a.v_deg > place.v_deg) != (b.v_deg > place.v_deg) &&
        place.h_deg < a.h_deg + (place.v_deg - a.v_deg) / dv * dh)
      inside = !inside;
  }
  return inside;
}

AimedBeam::AimedBeam(const Lamp& lamp, const Regulation& regulation, const BeamFrame& mounted,
                     const BeamFrame& frame)
    : lamp_(lamp),
      frame_(frame),
      receiver_{regulation.distance_m, regulation.receiver_side_m},
      map_([&] {
        const Box box = MapOf(regulation, mounted, frame);
        return BeamMap(lamp, receiver_, mounted, box.low, box.high);
      }()) {}

double AimedBeam::Value(const BeamFrame& frame, Place place) const {
  return ReceivedValue(lamp_, receiver_, frame, place);
}

std::vector<Place> AimedBeam::Samples(const Requirement& requirement) const {
  if (requirement.kind == Kind::kZone) return ZoneSamples(requirement.places);
  if (requirement.kind != Kind::kLine) return requirement.places;
  std::vector<Place> places;
  AddLine(&places, requirement.places[0], requirement.places[1], kAlongLine_deg);
  return places;
}

double AimedBeam::Flux(const BeamFrame& frame, const Requirement& requirement) const {
  std::vector<std::pair<Place, double>> cells;
  ForCells(requirement, FluxStep(lamp_), [&](Place place, double omega) {
    cells.push_back({place, omega});
  });
  std::vector<double> parts(cells.size());
  core::ParallelFor(cells.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      parts[k] = cells[k].second * IntensityValue(lamp_, frame.Direction(cells[k].first));
  });
  double flux = 0;
  for (const double part : parts) flux += part;
  return flux;
}

Measured AimedBeam::Climb(const Requirement& requirement, Measured from, bool smallest) const {
  constexpr double kSmallest_deg = 0.002;
  const auto allowed = [&](Place place) {
    if (requirement.kind == Kind::kZone) return Holds(requirement.places, place);
    return true;
  };
  // Along a line, else to all sides.
  std::vector<Place> sides{{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  double low = 0, high = 0;
  if (requirement.kind == Kind::kLine) {
    const Place a = requirement.places[0], b = requirement.places[1];
    const double length = std::hypot(b.h_deg - a.h_deg, b.v_deg - a.v_deg);
    if (!(length > 0)) return from;
    const Place along{(b.h_deg - a.h_deg) / length, (b.v_deg - a.v_deg) / length};
    sides = {along, {-along.h_deg, -along.v_deg}};
    high = length;
  }
  const auto on_line = [&](Place place) {
    if (requirement.kind != Kind::kLine) return true;
    const Place a = requirement.places[0];
    const double x =
        (place.h_deg - a.h_deg) * sides[0].h_deg + (place.v_deg - a.v_deg) * sides[0].v_deg;
    return x >= low - 1e-9 && x <= high + 1e-9;
  };
  for (double step = kAlongLine_deg; step > kSmallest_deg;) {
    Measured best = from;
    for (const Place& side : sides) {
      const Place place{from.place.h_deg + step * side.h_deg, from.place.v_deg + step * side.v_deg};
      if (!allowed(place) || !on_line(place)) continue;
      const double value = Value(frame_, place);
      if (smallest ? value < best.value : value > best.value) best = {value, place};
    }
    if (best.value == from.value)
      step /= 2;
    else
      from = best;
  }
  return from;
}

Measured AimedBeam::Measure(const Requirement& requirement, bool smallest) const {
  switch (requirement.kind) {
    case Kind::kPoint:
    case Kind::kSum:
    case Kind::kFlux:
      return {ValueOfTurned(requirement, requirement.places[0], {}), requirement.places[0]};
    case Kind::kPeak: {
      const Place peak = frame_.PlaceOf(PeakDirectionOf(lamp_));
      return Climb(requirement, {Value(frame_, peak), peak}, false);
    }
    case Kind::kLine:
    case Kind::kZone:
      break;
  }
  const std::vector<Place> places = Samples(requirement);
  std::vector<double> sketched(places.size());
  core::ParallelFor(places.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto mapped = map_.At(frame_.Direction(places[k]));
      sketched[k] = mapped ? *mapped : Value(frame_, places[k]);
    }
  });
  std::vector<std::size_t> order(places.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  const std::size_t starts = std::min<std::size_t>(3, order.size());
  std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(starts), order.end(),
                    [&](std::size_t a, std::size_t b) {
                      return smallest ? sketched[a] < sketched[b] : sketched[a] > sketched[b];
                    });
  std::optional<Measured> best;
  for (std::size_t k = 0; k < starts; ++k) {
    const Place place = places[order[k]];
    const Measured found = Climb(requirement, {Value(frame_, place), place}, smallest);
    if (!best || (smallest ? found.value < best->value : found.value > best->value)) best = found;
  }
  return *best;
}

double AimedBeam::Sketch(const Requirement& requirement, bool smallest, Place turned) const {
  const BeamFrame frame = frame_.Turned(turned);
  const auto at = [&](Place place) {
    const auto mapped = map_.At(frame.Direction(place));
    return mapped ? *mapped : Value(frame, place);
  };
  switch (requirement.kind) {
    case Kind::kPeak:
      return Measure(requirement, false).value;
    case Kind::kFlux:
      return Flux(frame, requirement);
    case Kind::kPoint:
    case Kind::kSum: {
      double sum = 0;
      for (const Place& place : requirement.places) sum += at(place);
      return sum;
    }
    case Kind::kLine:
    case Kind::kZone:
      break;
  }
  double best = smallest ? 1e300 : -1e300;
  for (const Place& place : Samples(requirement))
    best = smallest ? std::min(best, at(place)) : std::max(best, at(place));
  return best;
}

Functional AimedBeam::Weights(const Requirement& requirement, Place place) const {
  if (requirement.kind == Kind::kFlux) {
    constexpr double kTwice = 2;  // weights are slower, and their uncertainty needs less
    std::vector<WeighedDirection> cells;
    ForCells(requirement, kTwice * FluxStep(lamp_), [&](Place cell, double omega) {
      cells.push_back({omega, frame_.Direction(cell)});
    });
    return IntensitySum(lamp_, cells);
  }
  if (requirement.kind != Kind::kSum) return Received(lamp_, receiver_, frame_, place);
  std::vector<Functional> parts;
  std::vector<FunctionalTerm> terms;
  parts.reserve(requirement.places.size());
  for (const Place& one : requirement.places) {
    parts.push_back(Received(lamp_, receiver_, frame_, one));
    terms.push_back({1, &parts.back()});
  }
  return photometry::Sum(terms);
}

double AimedBeam::ValueOfTurned(const Requirement& requirement, Place place, Place turned) const {
  const BeamFrame frame = frame_.Turned(turned);
  if (requirement.kind == Kind::kFlux) return Flux(frame, requirement);
  if (requirement.kind != Kind::kSum) return Value(frame, place);
  double sum = 0;
  for (const Place& one : requirement.places) sum += Value(frame, one);
  return sum;
}

bool AimedBeam::IsCovered(const Requirement& requirement) const {
  if (requirement.kind == Kind::kPeak) return true;
  const auto places = Samples(requirement);
  return std::all_of(places.begin(), places.end(), [&](Place place) { return IsCoveredAt(place); });
}

bool AimedBeam::IsCoveredAt(Place place) const {
  return photometry::IsCovered(lamp_, frame_.Direction(place));
}

}  // namespace luxfield::photometry
