#include "luxfield/photometry/cut_off.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {
namespace {

// Two places of a pair are kPair steps apart; a(x) reaches as far as kReach steps of pairs.
constexpr double kStep_deg = 0.05;
constexpr int kPair = 2, kReach = 2;
constexpr double kPair_deg = kPair * kStep_deg;
constexpr double kDarkest = 1e-2;

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

// How a fall from one place of a pair to the other is measured: G or D.
struct Fall {
  bool by_logarithm = true;
  double darkest = 0;  // of G: pairs whose darker side is not above it are left out

  // Absent where a pair is left out; values that are not known are NaN.
  std::optional<double> operator()(double bright, double dark) const {
    if (by_logarithm) {
      if (!(dark > darkest && bright > darkest)) return {};
      return std::log10(bright) - std::log10(dark);
    }
    if (std::isnan(bright) || std::isnan(dark)) return {};
    return bright - dark;
  }
};

// a(x) from values at x - 0.1, x - 0.05 ... x + 0.2.
constexpr int kAround = 2 * kReach + kPair + 1;
std::optional<double> Tilt(const Fall& fall, const double* around) {
  double tilt = 0;
  for (int t = -kReach; t <= kReach; ++t) {
    const auto g = fall(around[t + kReach], around[t + kReach + kPair]);
    if (!g) return {};
    tilt += t * *g;
  }
  return tilt;
}

class Scan {
 public:
  Scan(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame, const CutOffScan& scan)
      : lamp_(lamp), receiver_(receiver), frame_(frame), scan_(scan) {}

  // NaN where not all of the light is shown.
  double Value(double x) const {
    const Place place = At(scan_, x);
    if (!IsCovered(lamp_, frame_.Direction(place))) return std::numeric_limits<double>::quiet_NaN();
    return ReceivedValue(lamp_, receiver_, frame_, place);
  }
  // From 0 on, a step apart; empty where the scan is shorter than a pair.
  std::vector<double> Values() const {
    const int steps = static_cast<int>(std::floor(LengthOf(scan_) / kStep_deg + 1e-9));
    if (steps < kPair) return {};
    std::vector<double> values(static_cast<std::size_t>(steps) + 1);
    core::ParallelFor(values.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) values[k] = Value(kStep_deg * double(k));
    });
    return values;
  }
  std::optional<double> FallAt(const Fall& fall, double x) const {
    return fall(Value(x), Value(x + kPair_deg));
  }
  std::optional<double> TiltAt(const Fall& fall, double x) const {
    std::array<double, kAround> around;
    for (int k = 0; k < kAround; ++k) around[k] = Value(x + (k - kReach) * kStep_deg);
    return Tilt(fall, around.data());
  }
  // Weights of the fall at x. Of G: (dE(x) / E(x) - dE(x + 0.1) / E(x + 0.1)) / ln 10.
  Functional WeightsAt(bool by_logarithm, double x) const {
    const Functional bright = Received(lamp_, receiver_, frame_, At(scan_, x)),
                     dark = Received(lamp_, receiver_, frame_, At(scan_, x + kPair_deg));
    const double of_bright = by_logarithm ? 1 / std::numbers::ln10 / Value(x) : 1,
                 of_dark = by_logarithm ? 1 / std::numbers::ln10 / Value(x + kPair_deg) : 1;
    return Sum({{of_bright, &bright}, {-of_dark, &dark}});
  }

 private:
  const Lamp& lamp_;
  const Receiver& receiver_;
  const BeamFrame& frame_;
  const CutOffScan& scan_;
};

double BrightestOf(const std::vector<double>& values) {
  double brightest = 0;
  for (const double value : values)
    if (value > brightest) brightest = value;
  return brightest;
}

// The largest of f between lo and hi, by golden sections; f absent counts as lowest.
template <typename F>
double Largest(double lo, double hi, F&& f) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSections =
      10;  // 0.1 degrees to 0.001: of a peak as wide, a hundredth of a per cent
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

// The step of the steepest fall; absent where nothing falls.
std::optional<int> SteepestStep(const Fall& fall, const std::vector<double>& values) {
  std::optional<int> best;
  double largest = 0;
  for (int k = 0; k + kPair < static_cast<int>(values.size()); ++k)
    if (const auto g = fall(values[k], values[k + kPair]); g && *g > largest)
      largest = *g, best = k;
  return best;
}

// A root of the tilt between lo and hi, where it is above 0 and not, by false position (Illinois).
std::optional<double> RootOfTilt(const Scan& along, const Fall& fall, double lo, double at_lo,
                                 double hi, double at_hi) {
  constexpr double kClose_deg = 1e-7;
  constexpr int kMostSteps = 60;
  const double small = 1e-12 * std::max(std::abs(at_lo), std::abs(at_hi));
  for (int step = 0; step < kMostSteps && hi - lo > kClose_deg; ++step) {
    const double x = lo + (hi - lo) * at_lo / (at_lo - at_hi);
    const auto at_x = along.TiltAt(fall, x);
    if (!at_x) return {};
    if (std::abs(*at_x) <= small) return x;
    if (*at_x > 0) {
      lo = x, at_lo = *at_x, at_hi /= 2;
    } else {
      hi = x, at_hi = *at_x, at_lo /= 2;
    }
  }
  return 0.5 * (lo + hi);
}

// Where the tilt falls through 0 nearest to the steepest step; absent where it does not within a
// degree, or the scan ends before.
std::optional<double> LevelPlace(const Scan& along, const Fall& fall,
                                 const std::vector<double>& values, int steepest) {
  constexpr int kFarthest = 20;
  const auto tilt = [&](int k) -> std::optional<double> {
    if (k < kReach || k + kReach + kPair >= static_cast<int>(values.size())) return {};
    return Tilt(fall, &values[k - kReach]);
  };
  auto at_lo = tilt(steepest), at_hi = at_lo;
  if (!at_lo) return {};
  const bool rising = *at_lo > 0;
  for (int k = 1; k <= kFarthest; ++k) {
    const auto next = tilt(rising ? steepest + k : steepest - k);
    if (!next) return {};
    (rising ? at_hi : at_lo) = next;
    if (rising ? !(*at_hi > 0) : *at_lo > 0) {
      const int first = rising ? steepest + k - 1 : steepest - k;
      return RootOfTilt(along, fall, kStep_deg * first, *at_lo, kStep_deg * (first + 1), *at_hi);
    }
    (rising ? at_lo : at_hi) = next;
  }
  return {};
}

// The slope of a(x) over as far as noise of that deviation moves its root; absent where a does not fall
// there.
std::optional<double> SlopeOver(const Scan& along, const Fall& fall, double x, double deviation) {
  constexpr double kSmallest_deg = 0.001, kLargest_deg = kPair_deg;
  constexpr int kTurns = 3;
  double slope = 0, reach = kStep_deg / 2;
  for (int turn = 0; turn < kTurns; ++turn) {
    const auto before = along.TiltAt(fall, x - reach), after = along.TiltAt(fall, x + reach);
    if (!before || !after) return {};
    slope = (*after - *before) / (2 * reach);
    if (!(slope < 0)) return {};
    reach = std::clamp(std::sqrt(3.0) * deviation / -slope, kSmallest_deg, kLargest_deg);
  }
  return slope;
}

}  // namespace

std::optional<CutOff> FindCutOff(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                                 const CutOffScan& scan, double brightest) {
  const Scan along(lamp, receiver, frame, scan);
  const std::vector<double> values = along.Values();
  const double on_scan = BrightestOf(values);
  const Fall g{true, kDarkest * std::max(brightest, on_scan)};
  if (values.empty() || !(g.darkest > 0)) return {};
  const auto best = SteepestStep(g, values);
  if (!best) return {};
  const double middle = kStep_deg * *best, end = kStep_deg * double(values.size() - 1);
  const double x =
      Largest(std::max(0.0, middle - kStep_deg), std::min(middle + kStep_deg, end - kPair_deg),
              [&](double at) { return along.FallAt(g, at); });
  const double on_lattice = *g(values[*best], values[*best + kPair]),
               refined = along.FallAt(g, x).value_or(0);
  CutOff found{At(scan, middle + kPair_deg / 2), std::max(on_lattice, refined),
               At(scan, refined >= on_lattice ? x : middle), on_scan};
  auto level = LevelPlace(along, g, values, *best);
  if (!level) {
    const Fall d{false, 0};
    found.has_gradient_peak = false;
    if (const auto steepest = SteepestStep(d, values)) {
      found.place = At(scan, kStep_deg * *steepest + kPair_deg / 2);
      level = LevelPlace(along, d, values, *steepest);
    }
  }
  if (level) found.place = At(scan, *level + kPair_deg / 2);
  return found;
}

Functional GradientOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                      const CutOffScan& scan, const CutOff& cut_off) {
  return Scan(lamp, receiver, frame, scan).WeightsAt(true, Along(scan, cut_off.steepest));
}

Functional ShiftOf(const Lamp& lamp, const Receiver& receiver, const BeamFrame& frame,
                   const CutOffScan& scan, const CutOff& cut_off) {
  const Scan along(lamp, receiver, frame, scan);
  const Fall fall{cut_off.has_gradient_peak, 0};
  const double x = Along(scan, cut_off.place) - kPair_deg / 2;
  std::vector<Functional> gradients;
  std::vector<FunctionalTerm> terms;
  gradients.reserve(2 * kReach);
  for (const int t : {-2, -1, 1, 2}) {
    gradients.push_back(along.WeightsAt(fall.by_logarithm, x + t * kStep_deg));
    terms.push_back({double(t), &gradients.back()});
  }
  const Functional tilt = Sum(terms);
  const auto slope = SlopeOver(along, fall, x, Uncertainty(lamp, tilt).value_or(0));
  return slope ? Sum({{-1 / *slope, &tilt}}) : Functional{};
}

}  // namespace luxfield::photometry
