#include "luxfield/photometry/headlamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/aim.h"
#include "luxfield/photometry/aimed_beam.h"
#include "luxfield/photometry/conformity.h"
#include "luxfield/photometry/distribution.h"
#include "luxfield/photometry/planes.h"

namespace luxfield::photometry {
namespace {

using lightfield::Vec3;
using Kind = Requirement::Kind;

constexpr double kDegree = std::numbers::pi / 180;

// A sum of functionals that Covariances knows by their numbers.
using Combination = std::map<int, double>;

void AddTo(Combination& sum, double factor, const Combination& one) {
  for (const auto& [index, share] : one) sum[index] += factor * share;
}

double CovarianceOf(const Covariances& covariances, const Combination& a, const Combination& b) {
  double sum = 0;
  for (const auto& [i, x] : a)
    for (const auto& [j, y] : b)
      if (x != 0 && y != 0) sum += x * y * covariances.Of(i, j);
  return sum;
}

// Measures one regulation's requirements in one aimed beam.
class Judge {
 public:
  Judge(const Lamp& lamp, const Regulation& regulation, const BeamFrame& mounted, const Aim& aim)
      : lamp_(lamp),
        regulation_(regulation),
        aim_(aim),
        beam_(lamp, regulation, mounted, aim.frame),
        covariances_(lamp) {
    if (lamp.noise.empty() || aim.of_h.empty()) return;
    aim_h_ = covariances_.Add(aim.of_h);
    aim_v_ = covariances_.Add(aim.of_v);
  }

  Finding Find(const Requirement& requirement, bool is_least) {
    const Limit& limit = is_least ? *requirement.least : *requirement.most;
    const Measured measured = beam_.Measure(requirement, is_least);
    Finding finding;
    finding.name = requirement.name;
    finding.kind = requirement.kind;
    finding.is_least = is_least;
    finding.unless = requirement.unless;
    finding.place = measured.place;
    finding.value.value = measured.value;
    const Requirement* other = limit.value ? nullptr : &Named(limit.of);
    const Measured of = other ? beam_.Measure(*other, false) : Measured{};
    finding.limit = limit.value ? *limit.value : limit.share * of.value;
    if (other) finding.limit_text = fmt::format("{:g} × {}", limit.share, limit.of);
    const double sign = is_least ? 1 : -1;
    finding.margin.value = sign * (measured.value - finding.limit);
    finding.verdict = VerdictOf(requirement, finding);
    Combination margin;
    if (!lamp_.noise.empty()) {
      const Combination value = LinearIn(requirement, measured.place);
      AddTo(margin, sign, value);
      if (other) AddTo(margin, -sign * limit.share, LinearIn(*other, of.place));
      finding.value.u = Deviation(value);
      finding.margin.u = Deviation(margin);
      finding.pass_probability = PassProbability(finding.margin.value, *finding.margin.u);
    }
    if (finding.unless.empty() && finding.verdict != Verdict::kNotMeasured)
      Count(finding.margin.value, margin);
    return finding;
  }

  // A margin that counts for the probability of all.
  void Count(double margin, Combination combination) {
    margins_.push_back(margin);
    combinations_.push_back(std::move(combination));
  }
  Combination Plain(const Functional& functional) { return {{covariances_.Add(functional), 1}}; }
  double Deviation(const Combination& of) const {
    return std::sqrt(std::max(0.0, CovarianceOf(covariances_, of, of)));
  }

  double JointProbability() const {
    return JointPassProbability(margins_, [&](std::size_t a, std::size_t b) {
      return CovarianceOf(covariances_, combinations_[a], combinations_[b]);
    });
  }
  std::optional<std::array<double, 2>> AimDeviations() const {
    if (aim_h_ < 0) return {};
    return std::array<double, 2>{Deviation({{aim_h_, 1}}), Deviation({{aim_v_, 1}})};
  }

  AimSweep Sweep() const;

 private:
  const Requirement& Named(const std::string& name) const {
    return *std::find_if(regulation_.requirements.begin(), regulation_.requirements.end(),
                         [&](const Requirement& one) { return one.name == name; });
  }

  // Values are at least what was measured, so that what meets a least value does so for sure, and what
  // exceeds a largest one too.
  Verdict VerdictOf(const Requirement& requirement, const Finding& finding) const {
    const bool met = finding.margin.value >= 0;
    if (finding.is_least && !met && !beam_.IsCoveredAt(finding.place)) return Verdict::kNotMeasured;
    if (!finding.is_least && met && !beam_.IsCovered(requirement)) return Verdict::kNotMeasured;
    return met ? Verdict::kPass : Verdict::kFail;
  }

  // The value at a place as it depends on C, also through the aim.
  Combination LinearIn(const Requirement& requirement, Place place) {
    constexpr double kTurn_deg = 0.02;
    Combination sum{{covariances_.Add(beam_.Weights(requirement, place)), 1}};
    if (aim_h_ < 0) return sum;
    const auto slope = [&](Place turn) {
      return (beam_.ValueOfTurned(requirement, place, turn) -
              beam_.ValueOfTurned(requirement, place, {-turn.h_deg, -turn.v_deg})) /
             (2 * kTurn_deg);
    };
    sum[aim_h_] += slope({kTurn_deg, 0});
    sum[aim_v_] += slope({0, kTurn_deg});
    return sum;
  }

  const Lamp& lamp_;
  const Regulation& regulation_;
  const Aim& aim_;
  AimedBeam beam_;
  Covariances covariances_;
  int aim_h_ = -1, aim_v_ = -1;
  std::vector<double> margins_;
  std::vector<Combination> combinations_;
};

AimSweep Judge::Sweep() const {
  constexpr int kAcross = 7, kUp = 5;
  const Aiming& aiming = regulation_.aiming;
  AimSweep sweep;
  for (int k = 0; k < kAcross; ++k)
    sweep.h_deg.push_back(aiming.tolerance_h_deg * (2.0 * k / (kAcross - 1) - 1));
  for (int k = 0; k < kUp; ++k)
    sweep.v_deg.push_back(aiming.tolerance_v_deg * (2.0 * k / (kUp - 1) - 1));
  sweep.margin.assign(kAcross * kUp, 1e300);
  sweep.failed.assign(kAcross * kUp, 0);
  core::ParallelFor(sweep.margin.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Place turned{sweep.h_deg[k % kAcross], sweep.v_deg[k / kAcross]};
      for (const Requirement& one : regulation_.requirements)
        for (const bool is_least : {true, false}) {
          const auto& limit = is_least ? one.least : one.most;
          if (!limit || !one.unless.empty()) continue;
          const double bound = limit->value
                                   ? *limit->value
                                   : limit->share * beam_.Sketch(Named(limit->of), false, turned);
          const double value = beam_.Sketch(one, is_least, turned);
          const double margin = (is_least ? value - bound : bound - value) / bound;
          if (!(bound > 0)) continue;
          sweep.margin[k] = std::min(sweep.margin[k], margin);
          sweep.failed[k] += margin < 0;
        }
    }
  });
  return sweep;
}

CutOffFindings CutOffOf(const Lamp& lamp, const Regulation& regulation, const Aim& aim,
                        const CutOff& cut_off, Judge* judge) {
  const CutOffLimits& limits = *regulation.cut_off;
  const Receiver receiver{regulation.distance_m, limits.receiver_side_m};
  const CutOffScan& level = regulation.aiming.level;
  CutOffFindings findings;
  findings.place = cut_off.place;
  findings.has_gradient_peak = cut_off.has_gradient_peak;
  findings.gradient.value = cut_off.gradient;
  const double low = limits.least_gradient.value_or(-1e300),
               high = limits.most_gradient.value_or(1e300);
  findings.gradient_met = cut_off.gradient >= low && cut_off.gradient <= high;
  if (!lamp.noise.empty()) {
    const Combination g = judge->Plain(GradientOf(lamp, receiver, aim.frame, level, cut_off));
    findings.gradient.u = judge->Deviation(g);
    findings.gradient_probability = PassProbability(cut_off.gradient - low, *findings.gradient.u) +
                                    PassProbability(high - cut_off.gradient, *findings.gradient.u) -
                                    1;
    for (const double sign : {1.0, -1.0}) {
      Combination margin;
      AddTo(margin, sign, g);
      const double of = sign > 0 ? cut_off.gradient - low : high - cut_off.gradient;
      if (sign > 0 ? limits.least_gradient.has_value() : limits.most_gradient.has_value())
        judge->Count(of, margin);
    }
  }
  const auto at_h = [&](double h, const Receiver& by) {
    CutOffScan scan = level;
    scan.from.h_deg = scan.to.h_deg = h;
    return FindCutOff(lamp, by, aim.frame, scan);
  };
  double lowest = 1e300, highest = -1e300;
  bool all = !limits.straight_h_deg.empty();
  for (const double h : limits.straight_h_deg) {
    const auto found = at_h(h, receiver);
    all = all && found;
    if (!found) continue;
    lowest = std::min(lowest, found->place.v_deg);
    highest = std::max(highest, found->place.v_deg);
  }
  if (all) findings.spread_deg = highest - lowest;
  findings.straight =
      limits.straight_h_deg.empty() || (all && highest - lowest <= limits.straight_within_deg);
  constexpr double kFarthest_deg = 8, kStep_deg = 1, kFaintest = 0.02;
  for (double h = -kFarthest_deg; h <= kFarthest_deg; h += kStep_deg)
    if (const auto found = at_h(h, receiver); found && found->gradient > kFaintest)
      findings.along.push_back(*found);
  if (regulation.screen_m) {
    // The receiver is as wide seen from the lamp.
    const double nearer = *regulation.screen_m / regulation.distance_m;
    findings.at_screen =
        at_h(level.from.h_deg, {*regulation.screen_m, limits.receiver_side_m * nearer});
  }
  return findings;
}

// A flat screen across the aimed lamp's axis, from -h to h and from `low` to `high` degrees.
PlaneAsked ScreenAt(const BeamFrame& frame, double distance_m, double h_deg, double low_deg,
                    double high_deg, int columns) {
  const double low = std::tan(low_deg * kDegree), high = std::tan(high_deg * kDegree);
  PlaneAsked screen;
  screen.name = fmt::format("screen {:g} m before the lamp", distance_m);
  screen.right = frame.right;
  screen.up = frame.up;
  screen.width_m = 2 * distance_m * std::tan(h_deg * kDegree);
  screen.height_m = distance_m * (high - low);
  screen.centre_m = distance_m * (frame.forward + 0.5 * (low + high) * frame.up);
  screen.columns = columns;
  screen.rows = std::max(2, static_cast<int>(columns * screen.height_m / screen.width_m));
  return screen;
}

PlaneAsked RoadOf(const BeamFrame& frame, double height_m) {
  constexpr double kAside_m = 10, kNear_m = 2, kFar_m = 80;
  PlaneAsked road;
  road.name = "road, from above";
  road.right = frame.right;
  road.up = frame.forward;
  road.width_m = 2 * kAside_m;
  road.height_m = kFar_m - kNear_m;
  road.centre_m = 0.5 * (kNear_m + kFar_m) * frame.forward - height_m * frame.up;
  road.columns = 60;
  road.rows = 117;
  return road;
}

RoadView ViewOf(const BeamFrame& frame, const HeadlampAsked& asked) {
  const auto [right_m, above_m, ahead_m] = asked.eye_m;
  constexpr double kAside = 0.45, kNear = 0.2, kFar = 0.012;
  RoadView view;
  view.frame = frame;
  view.eye_height_m = above_m;
  view.eye_m =
      right_m * frame.right + (above_m - asked.height_m) * frame.up + ahead_m * frame.forward;
  view.left = -kAside;
  view.right = kAside;
  view.nearest = kNear;
  view.farthest = kFar;
  view.columns = 120;
  view.rows = 64;
  return view;
}

void AddRemarks(const Lamp& lamp, const Regulation& regulation, Headlamp* out) {
  double coarsest = 0;
  for (const auto& posed : lamp.fields) {
    const auto& g = posed.field.geometry;
    coarsest = std::max(coarsest, std::max(g.grid.spacing_m, g.lattice.dt_m) / g.delta_m);
  }
  const double resolved = coarsest / kDegree;
  constexpr double kFine_deg = 0.2;
  if (regulation.cut_off && resolved > kFine_deg)
    out->remarks.push_back(fmt::format(
        "the light field resolves angles of some {:.2g} degrees (spacing of the filter over the "
        "distance of the planes): a sharper cut-off is shown blurred, which its gradient and "
        "values "
        "near it share",
        resolved));
  for (const Finding& finding : out->findings)
    if (finding.verdict == Verdict::kNotMeasured) {
      out->remarks.push_back(
          "some of what is asked lies where the light field does not show all of the filter plane: "
          "'not measured', and left out of the probability of all");
      break;
    }
}

Verdict WorstOf(const Headlamp& headlamp) {
  bool measured = true;
  for (const Finding& finding : headlamp.findings) {
    if (!finding.unless.empty()) continue;
    if (finding.verdict == Verdict::kFail) return Verdict::kFail;
    measured = measured && finding.verdict == Verdict::kPass;
  }
  if (headlamp.asked.regulation.cut_off &&
      (!headlamp.cut_off || !headlamp.cut_off->gradient_met || !headlamp.cut_off->straight))
    return Verdict::kFail;
  return measured ? Verdict::kPass : Verdict::kNotMeasured;
}

}  // namespace

PlaneAsked RoadView::LineOf(int row) const {
  const double below = farthest + (nearest - farthest) * (row + 0.5) / rows,
               ahead_m = eye_height_m / below;
  PlaneAsked line;
  line.right = frame.right;
  line.up = frame.forward;
  line.width_m = (right - left) * ahead_m;
  line.height_m = 1e-3;
  line.centre_m = eye_m + ahead_m * frame.forward - eye_height_m * frame.up +
                  0.5 * (left + right) * ahead_m * frame.right;
  line.columns = columns;
  line.rows = 1;
  return line;
}

std::vector<double> IlluminanceIn(const Lamp& lamp, const RoadView& view) {
  std::vector<double> values;
  for (int row = 0; row < view.rows; ++row) {
    const std::vector<double> line = IlluminanceOn(lamp, view.LineOf(row));
    values.insert(values.end(), line.begin(), line.end());
  }
  return values;
}

Headlamp HeadlampOf(const Lamp& lamp, const HeadlampAsked& asked) {
  const Regulation& regulation = asked.regulation;
  const BeamFrame as_mounted = BeamFrame::Of(asked.forward, asked.up);
  const Receiver cut_off_receiver{regulation.distance_m, regulation.cut_off
                                                             ? regulation.cut_off->receiver_side_m
                                                             : regulation.receiver_side_m};
  Aim aim;
  if (asked.aim) {
    aim.frame = as_mounted.Turned(*asked.aim);
    aim.turned = *asked.aim;
  } else {
    aim = AimOf(lamp, cut_off_receiver, regulation.aiming, as_mounted);
  }
  Headlamp out;
  out.asked = asked;
  out.aimed = aim.turned;
  out.remarks = aim.remarks;
  Judge judge(lamp, regulation, as_mounted, aim);
  out.aimed_u_deg = judge.AimDeviations();
  for (const Requirement& one : regulation.requirements)
    for (const bool is_least : {true, false})
      if (is_least ? one.least : one.most) out.findings.push_back(judge.Find(one, is_least));
  if (regulation.cut_off) {
    const auto found = FindCutOff(lamp, cut_off_receiver, aim.frame, regulation.aiming.level);
    if (found)
      out.cut_off = CutOffOf(lamp, regulation, aim, *found, &judge);
    else
      out.remarks.push_back("there is no cut-off where the regulation looks for one");
  }
  out.verdict = WorstOf(out);
  if (!lamp.noise.empty()) out.pass_probability = judge.JointProbability();
  if (regulation.aiming.tolerance_h_deg > 0 && regulation.aiming.tolerance_v_deg > 0)
    out.sweep = judge.Sweep();
  constexpr double kWide_deg = 12, kLow_deg = -6, kHigh_deg = 5, kAimingWide_deg = 6;
  out.screen = ScreenAt(aim.frame, regulation.distance_m, kWide_deg, kLow_deg, kHigh_deg, 121);
  if (regulation.screen_m)
    out.aiming_screen = ScreenAt(aim.frame, *regulation.screen_m, kAimingWide_deg, -3, 3, 121);
  out.road = RoadOf(aim.frame, asked.height_m);
  out.view = ViewOf(aim.frame, asked);
  AddRemarks(lamp, regulation, &out);
  return out;
}

}  // namespace luxfield::photometry
