#include "luxfield/photometry/dose.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/parallel.h"
#include "luxfield/photometry/point_receiver.h"

namespace luxfield::photometry {
namespace {

// From the middle outwards; every second one is of the rule of seven.
constexpr std::array<double, 8> kNode = {
    0.000000000000000000, 0.207784955007898468, 0.405845151377397167, 0.586087235467691130,
    0.741531185599394440, 0.864864423359769073, 0.949107912342758525, 0.991455371120812640};
constexpr std::array<double, 8> kKronrod = {
    0.209482141084727828, 0.204432940075298892, 0.190350578064785410, 0.169004726639267903,
    0.140653259715525919, 0.104790010322250184, 0.063092092629978553, 0.022935322010529225};
constexpr std::array<double, 4> kGauss = {0.417959183673469388, 0.381830050505118945,
                                          0.279705391489276668, 0.129484966168869693};
constexpr int kNodes = 15;

// 0 to 14 in order of time.
double NodeAt(int k) { return k < 7 ? -kNode[7 - k] : kNode[k - 7]; }
double KronrodAt(int k) { return kKronrod[std::abs(k - 7)]; }
double GaussAt(int k) { return k % 2 == 1 ? kGauss[std::abs(k - 7) / 2] : 0; }

struct Stretch {
  double from = 0, to = 0;
  std::array<double, kNodes> rate{};
  double time(int k) const { return 0.5 * (from + to) + 0.5 * (to - from) * NodeAt(k); }
  double weight(int k) const { return 0.5 * (to - from) * KronrodAt(k); }
  double sum() const {
    double sum = 0;
    for (int k = 0; k < kNodes; ++k) sum += weight(k) * rate[k];
    return sum;
  }
  double error() const {
    double error = 0;
    for (int k = 0; k < kNodes; ++k) error += (KronrodAt(k) - GaussAt(k)) * rate[k];
    return std::abs(0.5 * (to - from) * error);
  }
};

class Integral {
 public:
  Integral(const Lamp& lamp, const PathAsked& path) : lamp_(lamp), path_(path) {
    std::vector<Stretch> stretches;
    for (std::size_t k = 0; k + 1 < path.times_s.size(); ++k)
      for (int part = 0; part < kPartsAtFirst; ++part)
        stretches.push_back({At(k, part), At(k, part + 1)});
    Fill(&stretches);
    Halve(std::move(stretches));
    std::ranges::sort(done_, {}, &Stretch::from);
  }
  const std::vector<Stretch>& stretches() const { return done_; }

  double Rate(double time) const {
    return ReceivedValue(lamp_, path_.At(time), path_.Position(time));
  }

 private:
  static constexpr int kPartsAtFirst = 4, kMostHalvings = 24, kMostStretches = 4096;
  static constexpr double kTolerance = 1e-6;

  double At(std::size_t key, int part) const {
    const double share = 1.0 * part / kPartsAtFirst;
    return (1 - share) * path_.times_s[key] + share * path_.times_s[key + 1];
  }
  void Fill(std::vector<Stretch>* stretches) const {
    core::ParallelFor(stretches->size() * kNodes, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        Stretch& one = (*stretches)[k / kNodes];
        const int node = static_cast<int>(k % kNodes);
        one.rate[node] = Rate(one.time(node));
      }
    });
  }
  // A stretch may differ by its share of the tolerance.
  void Halve(std::vector<Stretch> stretches) {
    const double duration = path_.times_s.back() - path_.times_s.front();
    for (int halving = 0; !stretches.empty(); ++halving) {
      double whole = 0;
      for (const auto* list : {&done_, &stretches})
        for (const Stretch& one : *list) whole += std::abs(one.sum());
      std::vector<Stretch> finer;
      for (const Stretch& one : stretches) {
        const double allowed = kTolerance * whole * (one.to - one.from) / duration;
        const bool many = done_.size() + stretches.size() + finer.size() > kMostStretches;
        if (halving == kMostHalvings || many || !(one.error() > allowed)) {
          done_.push_back(one);
          continue;
        }
        const double middle = 0.5 * (one.from + one.to);
        finer.push_back({one.from, middle});
        finer.push_back({middle, one.to});
      }
      Fill(&finer);
      stretches = std::move(finer);
    }
  }

  const Lamp& lamp_;
  const PathAsked& path_;
  std::vector<Stretch> done_;
};

// The time of the largest rate: that of the largest node, and between its neighbours by sections of
// the golden ratio.
double TimeOfMost(const Integral& integral, const DoseAnswer& answer) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSections = 40;
  const auto most = std::ranges::max_element(answer.rate) - answer.rate.begin();
  const auto last = static_cast<std::ptrdiff_t>(answer.time_s.size()) - 1;
  double low = most > 0 ? answer.time_s[most - 1] : answer.asked.times_s.front(),
         high = most < last ? answer.time_s[most + 1] : answer.asked.times_s.back();
  for (int section = 0; section < kSections; ++section) {
    const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    (integral.Rate(a) < integral.Rate(b) ? low = a : high = b);
  }
  return 0.5 * (low + high);
}

}  // namespace

DoseAnswer DoseAlong(const Lamp& lamp, const PathAsked& asked) {
  DoseAnswer answer;
  answer.asked = asked;
  const Integral integral(lamp, asked);
  Functional weights = lamp.noise.empty() ? Functional{} : ZeroOf(lamp);
  for (const Stretch& one : integral.stretches())
    for (int k = 0; k < kNodes; ++k) {
      const double time = one.time(k);
      answer.time_s.push_back(time);
      answer.rate.push_back(one.rate[k]);
      answer.dose.value += one.weight(k) * one.rate[k];
      if (!lamp.noise.empty())
        AddReceived(weights, one.weight(k), lamp, asked.At(time), asked.Position(time));
    }
  answer.dose.u = Uncertainty(lamp, weights);
  const double duration = asked.times_s.back() - asked.times_s.front();
  answer.mean = {answer.dose.value / duration, {}};
  if (answer.dose.u) answer.mean.u = *answer.dose.u / duration;
  answer.most_at_s = TimeOfMost(integral, answer);
  answer.most.value = integral.Rate(answer.most_at_s);
  if (!lamp.noise.empty())
    answer.most.u = Uncertainty(
        lamp, ReceivedAt(lamp, asked.At(answer.most_at_s), asked.Position(answer.most_at_s)));
  return answer;
}

}  // namespace luxfield::photometry
