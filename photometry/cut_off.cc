#include "luxfield/photometry/cut_off.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {
namespace {

constexpr double kPair_deg = 0.1, kStep_deg = 0.05, kDarkest = 1e-3;
// Of derivatives along a scan and of the aim.
constexpr double kSmall_deg = 0.025;

double LengthOf(const CutOffScan& scan) {
  return std::abs(scan.to.h_deg - scan.from.h_deg) + std::abs(scan.to.v_deg - scan.from.v_deg);
}

// x degrees along the scan, from its bright end.
Place At(const CutOffScan& scan, double x) {
  const double share = x / LengthOf(scan);
  return {scan.from.h_deg + share * (scan.to.h_deg - scan.from.h_deg),
          scan.from.v_deg + share * (scan.to.v_deg - scan.from.v_deg)};
}

double Along(const CutOffScan& scan, Place place) {
  return std::abs(place.h_deg - scan.from.h_deg) + std::abs(place.v_deg - scan.from.v_deg);
}

// G of the pair at x and x + 0.1; absent where either is not above `darkest`.
std::optional<double> Gradient(double bright, double dark, double darkest) {
  if (!(dark > darkest && bright > darkest)) return {};
  return std::log10(bright) - std::log10(dark);
}

class Scan {
 public:
  Scan(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame, const CutOffScan& scan)
      : lamp_(lamp), receiver_(receiver), frame_(frame), scan_(scan) {}

  // Below 0 where not all of the light is shown.
  double Value(double x) const {
    const Place place = At(scan_, x);
    if (!IsCovered(lamp_, frame_.Direction(place))) return -1;
    return ReceivedValue(lamp_, receiver_, frame_, place);
  }
  std::optional<double> G(double x, double darkest = 0) const {
    return Gradient(Value(x), Value(x + kPair_deg), darkest);
  }
  // Weights of G(x): (dE(x) / E(x) - dE(x + 0.1) / E(x + 0.1)) / ln 10.
  Functional WeightsOfG(double x) const {
    const Functional bright = Received(lamp_, receiver_, frame_, At(scan_, x)),
                     dark = Received(lamp_, receiver_, frame_, At(scan_, x + kPair_deg));
    const double factor = 1 / std::numbers::ln10;
    return Sum({{factor / Value(x), &bright}, {-factor / Value(x + kPair_deg), &dark}});
  }

 private:
  const Lamp& lamp_;
  const Receiver& receiver_;
  const BeamFrame& frame_;
  const CutOffScan& scan_;
};

// The largest of f between lo and hi, by golden sections; f absent counts as lowest.
template <typename F>
double Largest(double lo, double hi, F&& f) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSections = 24;  // 0.1 degrees to 1e-6
  const auto value = [&](double x) { return f(x).value_or(-1e300); };
  double a = hi - kGolden * (hi - lo), b = lo + kGolden * (hi - lo);
  double fa = value(a), fb = value(b);
  for (int k = 0; k < kSections; ++k) {
    if (fa >= fb) {
      hi = b, b = a, fb = fa;
      a = hi - kGolden * (hi - lo);
      fa = value(a);
    } else {
      lo = a, a = b, fa = fb;
      b = lo + kGolden * (hi - lo);
      fb = value(b);
    }
  }
  return 0.5 * (lo + hi);
}

// a(x) of cut_off.h; absent where one of its gradients is.
constexpr int kReach = 2;
std::optional<double> Tilt(const Scan& along, double x, double darkest) {
  double tilt = 0;
  for (int t = -kReach; t <= kReach; ++t) {
    const auto g = along.G(x + t * kStep_deg, darkest);
    if (!g) return {};
    tilt += t * *g;
  }
  return tilt;
}

// Where the tilt changes its sign nearest to the steepest pair, by false position (Illinois); absent
// where it does not within a degree.
std::optional<double> LevelPlace(const Scan& along, double steepest, double darkest) {
  constexpr double kClose_deg = 1e-7, kFarthest_deg = 1;
  constexpr int kMostSteps = 60;
  double lo = steepest, hi = steepest;
  auto at_lo = Tilt(along, lo, darkest), at_hi = at_lo;
  if (!at_lo) return {};
  const bool rising = *at_lo > 0;
  while (rising ? *at_hi > 0 : !(*at_lo > 0)) {
    auto& x = rising ? hi : lo;
    x += rising ? kStep_deg : -kStep_deg;
    const auto at_x = Tilt(along, x, darkest);
    if (!at_x || std::abs(x - steepest) > kFarthest_deg) return {};
    (rising ? lo : hi) = rising ? hi - kStep_deg : lo + kStep_deg;
    (rising ? at_lo : at_hi) = rising ? at_hi : at_lo;
    (rising ? at_hi : at_lo) = at_x;
  }
  for (int step = 0; step < kMostSteps && hi - lo > kClose_deg; ++step) {
    const double x = lo + (hi - lo) * *at_lo / (*at_lo - *at_hi);
    const auto at_x = Tilt(along, x, darkest);
    if (!at_x) return {};
    if (*at_x == 0) return x;
    if (*at_x > 0) {
      lo = x, at_lo = at_x, *at_hi /= 2;
    } else {
      hi = x, at_hi = at_x, *at_lo /= 2;
    }
    if (std::abs(*at_x) < 1e-12) return x;
  }
  return 0.5 * (lo + hi);
}

// How far the cut-off is from where the aiming wants it, in the aimed frame.
struct Offsets {
  double h = 0, v = 0;
  std::vector<CutOff> sideways;  // what h follows from
  CutOff level;
};

// The line through the cut-off on several vertical scans, by least squares: H where it meets V, and
// how that follows from each of their V.
struct LineMeets {
  double h = 0;
  std::vector<double> of_v;
};
std::optional<LineMeets> MeetLevel(const std::vector<CutOff>& on, double v_deg) {
  const double n = static_cast<double>(on.size());
  double h = 0, v = 0, hh = 0, hv = 0;
  for (const CutOff& one : on) h += one.place.h_deg / n, v += one.place.v_deg / n;
  for (const CutOff& one : on) {
    hh += (one.place.h_deg - h) * (one.place.h_deg - h);
    hv += (one.place.h_deg - h) * (one.place.v_deg - v);
  }
  const double slope = hv / hh;
  if (!(std::abs(slope) > 0.01)) return {};  // flat: it meets V nowhere in particular
  LineMeets meets{h + (v_deg - v) / slope, {}};
  for (const CutOff& one : on)
    meets.of_v.push_back(-1 / n / slope - (v_deg - v) / slope / slope * (one.place.h_deg - h) / hh);
  return meets;
}

bool IsHorizontal(const CutOffScan& scan) { return scan.from.v_deg == scan.to.v_deg; }

class Aimer {
 public:
  Aimer(const Lamp& lamp, const Receiver& receiver, const Aiming& aiming)
      : lamp_(lamp), receiver_(receiver), aiming_(aiming) {}

  // Absent, with the reason: no cut-off there.
  std::optional<Offsets> Find(const BeamFrame& frame, double wider_deg, bool sideways,
                              std::string* why) const {
    Offsets offsets;
    CutOffScan level = aiming_.level;
    const double to_dark = level.to.v_deg > level.from.v_deg ? wider_deg : -wider_deg;
    level.from.v_deg -= to_dark;
    level.to.v_deg += to_dark;
    const auto found = FindCutOff(lamp_, receiver_, frame, level);
    if (!found) {
      *why = fmt::format("there is no cut-off at H = {:g} degrees", level.from.h_deg);
      return {};
    }
    offsets.level = *found;
    offsets.v = found->place.v_deg - aiming_.level_v_deg;
    if (!sideways) return offsets;
    for (const CutOffScan& scan : aiming_.sideways) {
      const auto one = FindCutOff(lamp_, receiver_, frame, scan);
      if (!one || one->gradient < aiming_.sideways_gradient) {
        *why = fmt::format(
            "on the scan from H = {:g}, V = {:g} to H = {:g}, V = {:g} degrees the cut-off has no "
            "gradient of {:g}",
            scan.from.h_deg, scan.from.v_deg, scan.to.h_deg, scan.to.v_deg,
            aiming_.sideways_gradient);
        return {};
      }
      offsets.sideways.push_back(*one);
    }
    if (IsHorizontal(aiming_.sideways[0])) {
      offsets.h = offsets.sideways[0].place.h_deg - aiming_.sideways_h_deg;
      return offsets;
    }
    const auto meets = MeetLevel(offsets.sideways, aiming_.level_v_deg);
    if (!meets) {
      *why = "the cut-off does not rise sideways";
      return {};
    }
    offsets.h = meets->h - aiming_.sideways_h_deg;
    return offsets;
  }

  // Finds where H = V = 0 has to lie in the frame of the lamp; false where that fails. Noise can leave
  // two places of one cut-off between which the aim goes to and fro: the nearer one is taken.
  bool Turn(const BeamFrame& lamp_frame, bool sideways, Place* aim, std::string* why) const {
    constexpr int kMostTurns = 20;
    constexpr double kWider_deg = 4, kClose_deg = 1e-5, kNear_deg = 0.02, kLargestTurn_deg = 1;
    double nearest = 1e300;
    Place best, next = *aim;
    for (int turn = 0; turn < kMostTurns && nearest > kClose_deg; ++turn) {
      const bool first = turn == 0;
      const auto offsets =
          Find(lamp_frame.Turned(next), first ? kWider_deg : 0, sideways && !first, why);
      if (!offsets) return false;
      const double h = std::clamp(offsets->h, -kLargestTurn_deg, kLargestTurn_deg);
      if (const double off = std::hypot(h, offsets->v); !first && off < nearest)
        nearest = off, best = next;
      next = {next.h_deg + h, next.v_deg + offsets->v};
    }
    *aim = best;
    *why = "aiming by it does not settle";
    return nearest < kNear_deg;
  }

  // Weights of the aim, of a frame that is aimed. False where some gradient has no peak.
  bool Weigh(const BeamFrame& frame, bool sideways, Aim* aim) const {
    std::string why;
    const auto at = [&](double h, double v) {
      return Find(frame.Turned({h, v}), 0, sideways, &why);
    };
    const auto here = at(0, 0), h1 = at(kSmall_deg, 0), h0 = at(-kSmall_deg, 0),
               v1 = at(0, kSmall_deg), v0 = at(0, -kSmall_deg);
    if (!here || !h1 || !h0 || !v1 || !v0) return false;
    const auto slope = [&](double plus, double minus) { return (plus - minus) / (2 * kSmall_deg); };
    const double vh = slope(h1->v, h0->v), vv = slope(v1->v, v0->v);
    const Functional level = ShiftOf(lamp_, receiver_, frame, aiming_.level, here->level);
    if (level.empty()) return false;
    const double up = aiming_.level.to.v_deg > aiming_.level.from.v_deg ? 1 : -1;
    if (!sideways) {
      aim->of_v = Sum({{-up / vv, &level}});
      aim->of_h = Sum({{0, &level}});
      return true;
    }
    const double hh = slope(h1->h, h0->h), hv = slope(v1->h, v0->h);
    const double determinant = hh * vv - hv * vh;
    if (!(std::abs(determinant) > 1e-3)) return false;
    const auto side = SidewaysWeights(frame, *here);
    if (side.empty()) return false;
    aim->of_h = Sum({{-vv / determinant, &side}, {hv / determinant * up, &level}});
    aim->of_v = Sum({{vh / determinant, &side}, {-hh / determinant * up, &level}});
    return true;
  }

 private:
  Functional SidewaysWeights(const BeamFrame& frame, const Offsets& offsets) const {
    std::vector<Functional> shifts;
    std::vector<FunctionalTerm> terms;
    shifts.reserve(aiming_.sideways.size());
    const auto meets = IsHorizontal(aiming_.sideways[0])
                           ? std::nullopt
                           : MeetLevel(offsets.sideways, aiming_.level_v_deg);
    for (std::size_t k = 0; k < aiming_.sideways.size(); ++k) {
      const CutOffScan& scan = aiming_.sideways[k];
      shifts.push_back(ShiftOf(lamp_, receiver_, frame, scan, offsets.sideways[k]));
      if (shifts.back().empty()) return {};
      const double sign =
          scan.to.h_deg + scan.to.v_deg > scan.from.h_deg + scan.from.v_deg ? 1 : -1;
      terms.push_back({sign * (meets ? meets->of_v[k] : 1), &shifts.back()});
    }
    return Sum(terms);
  }

  const Lamp& lamp_;
  const Receiver& receiver_;
  const Aiming& aiming_;
};

}  // namespace

std::optional<CutOff> FindCutOff(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                                 const CutOffScan& scan) {
  const Scan along(lamp, receiver, frame, scan);
  constexpr int kPair = 2;  // steps
  const int steps = static_cast<int>(std::floor(LengthOf(scan) / kStep_deg + 1e-9));
  if (steps < kPair) return {};
  std::vector<double> values(static_cast<std::size_t>(steps) + 1);
  core::ParallelFor(values.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      values[k] = along.Value(kStep_deg * static_cast<double>(k));
  });
  const double darkest = kDarkest * *std::max_element(values.begin(), values.end());
  if (!(darkest > 0)) return {};
  int best = -1;
  double largest = 0;
  for (int k = 0; k + kPair <= steps; ++k)
    if (const auto g = Gradient(values[k], values[k + kPair], darkest); g && *g > largest)
      largest = *g, best = k;
  if (best < 0) return {};
  const double middle = kStep_deg * best;
  const double x = Largest(std::max(0.0, middle - kStep_deg),
                           std::min(middle + kStep_deg, kStep_deg * (steps - kPair)),
                           [&](double at) { return along.G(at, darkest); });
  const double refined = along.G(x, darkest).value_or(0);
  CutOff found{At(scan, middle + kPair_deg / 2), std::max(largest, refined),
               At(scan, refined >= largest ? x : middle)};
  if (const auto level = LevelPlace(along, middle, darkest))
    found.place = At(scan, *level + kPair_deg / 2);
  return found;
}

Functional GradientOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                      const CutOffScan& scan, const CutOff& cut_off) {
  return Scan(lamp, receiver, frame, scan).WeightsOfG(Along(scan, cut_off.steepest));
}

Functional ShiftOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                   const CutOffScan& scan, const CutOff& cut_off) {
  const Scan along(lamp, receiver, frame, scan);
  const double x = Along(scan, cut_off.place) - kPair_deg / 2;
  const auto before = Tilt(along, x - kSmall_deg, 0), after = Tilt(along, x + kSmall_deg, 0);
  if (!before || !after) return {};
  const double slope = (*after - *before) / (2 * kSmall_deg);
  if (!(slope < 0)) return {};
  std::vector<Functional> gradients;
  std::vector<FunctionalTerm> terms;
  gradients.reserve(2 * kReach);
  for (const int t : {-2, -1, 1, 2}) {
    gradients.push_back(along.WeightsOfG(x + t * kStep_deg));
    terms.push_back({-t / slope, &gradients.back()});
  }
  return Sum(terms);
}

Aim AimOf(const Lamp& lamp, const Receiver& receiver, const Aiming& aiming,
          const BeamFrame& frame) {
  Aim aim;
  aim.frame = frame;
  if (aiming.kind == Aiming::Kind::kPeak)
    aim.frame = frame.Turned(frame.PlaceOf(PeakDirectionOf(lamp)));
  if (aiming.kind == Aiming::Kind::kCutOff) {
    const Aimer aimer(lamp, receiver, aiming);
    std::string why;
    Place turned;
    bool sideways = !aiming.sideways.empty();
    bool aimed = aimer.Turn(frame, sideways, &turned, &why);
    if (!aimed && sideways) {
      aim.remarks.push_back(fmt::format("the lamp is not aimed sideways: {}", why));
      sideways = false;
      turned = {};
      aimed = aimer.Turn(frame, sideways, &turned, &why);
    }
    if (!aimed)
      aim.remarks.push_back(fmt::format("the lamp is not aimed: {}", why));
    else
      aim.frame = frame.Turned(turned);
    if (aimed && !lamp.noise.empty() && !aimer.Weigh(aim.frame, sideways, &aim))
      aim.remarks.push_back(
          "the gradient of the cut-off has no peak, but a plateau: what the noise of the aim adds "
          "to uncertainties is left out");
  }
  aim.turned = frame.PlaceOf(aim.frame.forward);
  return aim;
}

}  // namespace luxfield::photometry
