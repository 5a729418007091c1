#include "luxfield/photometry/aim.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {
namespace {

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

// Steps to where two offsets are 0, by Broyden's method (Mathematics of Computation 19, 1965) from
// J = -1 on, the beam's own turn: a cut-off that rises slowly goes aside far more than up, and noise
// bends it, so that turns by the offsets themselves can go to and fro.
class Secant {
 public:
  Place Step(Place off, double largest_deg) {
    if (const double length2 = step_.h_deg * step_.h_deg + step_.v_deg * step_.v_deg; length2 > 0) {
      const double h = off.h_deg - off_.h_deg - hh_ * step_.h_deg - hv_ * step_.v_deg,
                   v = off.v_deg - off_.v_deg - vh_ * step_.h_deg - vv_ * step_.v_deg;
      hh_ += h * step_.h_deg / length2;
      hv_ += h * step_.v_deg / length2;
      vh_ += v * step_.h_deg / length2;
      vv_ += v * step_.v_deg / length2;
    }
    off_ = off;
    const double determinant = hh_ * vv_ - hv_ * vh_;
    step_ = {(hv_ * off.v_deg - vv_ * off.h_deg) / determinant,
             (vh_ * off.h_deg - hh_ * off.v_deg) / determinant};
    if (!(std::hypot(step_.h_deg, step_.v_deg) <= largest_deg)) step_ = off;
    return step_;
  }

 private:
  double hh_ = -1, hv_ = 0, vh_ = 0, vv_ = -1;
  Place off_, step_;
};

class Aimer {
 public:
  Aimer(const Lamp& lamp, const Receiver& receiver, const Aiming& aiming)
      : lamp_(lamp), receiver_(receiver), aiming_(aiming) {}

  // Absent, with the reason: no cut-off there, or none that is as bright as in the first search.
  std::optional<Offsets> Find(const BeamFrame& frame, double wider_deg, bool sideways,
                              std::string* why) const {
    Offsets offsets;
    CutOffScan level = aiming_.level;
    const double to_dark = level.to.v_deg > level.from.v_deg ? wider_deg : -wider_deg;
    level.from.v_deg -= to_dark;
    level.to.v_deg += to_dark;
    const auto found = FindCutOff(lamp_, receiver_, frame, level, brightest_);
    if (!found) {
      *why = fmt::format("there is no cut-off at H = {:g} degrees", level.from.h_deg);
      return {};
    }
    offsets.level = *found;
    offsets.v = found->place.v_deg - aiming_.level_v_deg;
    if (!sideways) return offsets;
    for (const CutOffScan& scan : aiming_.sideways) {
      const auto one = FindCutOff(lamp_, receiver_, frame, scan, brightest_);
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

  // Finds where H = V = 0 has to lie in the frame of the lamp; false where that fails.
  bool Turn(const BeamFrame& lamp_frame, bool sideways, Place* aim, std::string* why) {
    constexpr int kMostTurns = 25;
    constexpr double kWider_deg = 4, kClose_deg = 1e-5, kNear_deg = 0.02, kLargestTurn_deg = 1;
    double nearest = 1e300;
    Place next = *aim;
    Secant secant;
    for (int turn = 0; turn < kMostTurns && nearest > kClose_deg; ++turn) {
      const bool first = turn == 0;
      const auto offsets =
          Find(lamp_frame.Turned(next), first ? kWider_deg : 0, sideways && !first, why);
      if (!offsets) return false;
      if (first) brightest_ = offsets->level.brightest;
      has_gradient_peak_ = offsets->level.has_gradient_peak;
      const Place off{std::clamp(offsets->h, -kLargestTurn_deg, kLargestTurn_deg), offsets->v};
      if (first) {
        next.v_deg += off.v_deg;
        continue;
      }
      if (const double distance = std::hypot(off.h_deg, off.v_deg); distance < nearest)
        nearest = distance, *aim = next;
      const Place step = secant.Step(off, kLargestTurn_deg);
      next = {next.h_deg + step.h_deg, next.v_deg + step.v_deg};
    }
    *why = "aiming by it does not settle";
    return nearest < kNear_deg;
  }

  // Of the cut-off that the last turn found.
  bool HasGradientPeak() const { return has_gradient_peak_; }

  // Weights of the aim, of a frame that is aimed. False where some gradient has no peak.
  bool Weigh(const BeamFrame& frame, bool sideways, Aim* aim) const {
    std::string why;
    // J over more than a receiver is wide: over less it would be what noise makes of it, and where that
    // brings it near 0 the aim's uncertainty would have no bounds.
    constexpr double kTurn_deg = 0.15;
    const auto at = [&](double h, double v) {
      return Find(frame.Turned({h, v}), 0, sideways, &why);
    };
    const auto here = at(0, 0), h1 = at(kTurn_deg, 0), h0 = at(-kTurn_deg, 0),
               v1 = at(0, kTurn_deg), v0 = at(0, -kTurn_deg);
    if (!here || !h1 || !h0 || !v1 || !v0) return false;
    const auto slope = [&](double plus, double minus) { return (plus - minus) / (2 * kTurn_deg); };
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
  double brightest_ = 0;  // cd, on the first and widest scan
  bool has_gradient_peak_ = true;
};

}  // namespace

Aim AimOf(const Lamp& lamp, const Receiver& receiver, const Aiming& aiming,
          const BeamFrame& frame) {
  Aim aim;
  aim.frame = frame;
  if (aiming.kind == Aiming::Kind::kPeak)
    aim.frame = frame.Turned(frame.PlaceOf(PeakDirectionOf(lamp)));
  if (aiming.kind == Aiming::Kind::kCutOff) {
    Aimer aimer(lamp, receiver, aiming);
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
    if (aimed && !aimer.HasGradientPeak())
      aim.remarks.push_back(
          "the gradient of the cut-off grows until darkness, blurred as this light field shows it: "
          "the lamp is aimed by the steepest fall of illuminance itself");
    if (aimed && !lamp.noise.empty() && !aimer.Weigh(aim.frame, sideways, &aim))
      aim.remarks.push_back(
          "the gradient of the cut-off has no peak, but a plateau: what the noise of the aim adds "
          "to uncertainties is left out");
  }
  aim.turned = frame.PlaceOf(aim.frame.forward);
  return aim;
}

}  // namespace luxfield::photometry
