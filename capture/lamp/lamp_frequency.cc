#include "luxfield/capture/lamp/lamp_frequency.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace luxfield::capture {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr int kMostHarmonics = 8;
constexpr int kMostColumns = 2 + 2 * kMostHarmonics;
constexpr double kOversampling = 6;  // points of the search over 1 / span
constexpr double kLeastRss = 1e-14;  // of frames without noise
constexpr double kMostPeaked = 6;    // beyond, chance can range the few frames with light in a row

// A burst about its middle, its straight line taken out, the sum of squares 1.
struct Block {
  std::vector<double> t, y;
  double peakedness = 0;  // kurtosis: that of a sine is 1.5, of noise 3, of a share w of ones 1 / w
};

// A small symmetric matrix by its Cholesky factor.
class Normal {
 public:
  explicit Normal(int size) : size_(size) {}
  double& at(int row, int column) { return a_[row][column]; }  // column <= row
  void Factor() {
    constexpr double kLeastPivot = 1e-12;  // of columns that a coarse grid of times makes equal
    for (int j = 0; j < size_; ++j) {
      for (int k = 0; k < j; ++k) a_[j][j] -= a_[j][k] * a_[j][k];
      a_[j][j] = std::sqrt(std::max(a_[j][j], kLeastPivot));
      for (int i = j + 1; i < size_; ++i) {
        for (int k = 0; k < j; ++k) a_[i][j] -= a_[i][k] * a_[j][k];
        a_[i][j] /= a_[j][j];
      }
    }
  }
  void Solve(std::array<double, kMostColumns>& b) const {
    for (int i = 0; i < size_; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= a_[i][k] * b[k];
      b[i] /= a_[i][i];
    }
    for (int i = size_ - 1; i >= 0; --i) {
      for (int k = i + 1; k < size_; ++k) b[i] -= a_[k][i] * b[k];
      b[i] /= a_[i][i];
    }
  }

 private:
  int size_;
  std::array<std::array<double, kMostColumns>, kMostColumns> a_{};
};

// Least squares of the columns 1, t and K harmonics of f. With d_n the change of the residual e_n
// with f, the columns' part taken out:
struct HarmonicFit {
  double rss = 0;               // sum e^2
  double slope2 = 0;            // sum d^2
  double slope_residual = 0;    // sum d e
  double slope2_residual2 = 0;  // sum d^2 e^2, e as if its frame were left out; where asked for
};

HarmonicFit FitHarmonics(const Block& block, double hz, int harmonics, bool left_out = false) {
  const int columns = 2 + 2 * harmonics;
  const double half_s = 0.5 * (block.t.back() - block.t.front());
  const std::size_t frames = block.t.size();
  std::vector<std::array<double, kMostColumns>> rows(frames);
  Normal normal(columns);
  std::array<double, kMostColumns> x{}, projection{};
  for (std::size_t n = 0; n < frames; ++n) {
    auto& row = rows[n];
    const double turns = hz * block.t[n], angle = kTwoPi * (turns - std::floor(turns));
    const double c = std::cos(angle), s = std::sin(angle);
    row[0] = 1, row[1] = block.t[n] / half_s, row[2] = c, row[3] = s;
    for (int j = 4; j < columns; j += 2) {
      row[j] = row[j - 2] * c - row[j - 1] * s;
      row[j + 1] = row[j - 1] * c + row[j - 2] * s;
    }
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j <= i; ++j) normal.at(i, j) += row[i] * row[j];
      x[i] += row[i] * block.y[n];
    }
  }
  normal.Factor();
  normal.Solve(x);
  HarmonicFit fit;
  std::vector<double> residual(frames), slope(frames);
  for (std::size_t n = 0; n < frames; ++n) {
    const auto& row = rows[n];
    double value = 0, change = 0;
    for (int j = 0; j < columns; ++j) value += x[j] * row[j];
    for (int k = 1; k <= harmonics; ++k)
      change += k * (x[2 * k + 1] * row[2 * k] - x[2 * k] * row[2 * k + 1]);
    residual[n] = block.y[n] - value;
    slope[n] = kTwoPi * block.t[n] * change;
    fit.rss += residual[n] * residual[n];
    for (int j = 0; j < columns; ++j) projection[j] += row[j] * slope[n];
  }
  normal.Solve(projection);
  for (std::size_t n = 0; n < frames; ++n) {
    for (int j = 0; j < columns; ++j) slope[n] -= projection[j] * rows[n][j];
    fit.slope2 += slope[n] * slope[n];
    fit.slope_residual += slope[n] * residual[n];
  }
  if (!left_out) return fit;
  for (std::size_t n = 0; n < frames; ++n) {
    std::array<double, kMostColumns> row = rows[n];
    normal.Solve(row);
    double leverage = fit.slope2 > 0 ? slope[n] * slope[n] / fit.slope2 : 0;
    for (int j = 0; j < columns; ++j) leverage += row[j] * rows[n][j];
    const double without = residual[n] / std::max(1 - leverage, 0.05);
    fit.slope2_residual2 += slope[n] * slope[n] * without * without;
  }
  return fit;
}

struct Candidate {
  double hz = 0;
  int harmonics = 1;
  double evidence = 0;  // -ln P of the header
  double sigma_hz = 0;  // of even noise
};

// -ln(exp(-x) sum_{j < m} x^j / j!)
double MinusLogGammaTail(int m, double x) {
  double sum = 1, term = 1;
  for (int j = 1; j < m; ++j) {
    term *= x / j;
    sum += term;
  }
  return std::max(0.0, x - std::log(sum));
}

// Whether one is p / q times the other, p and q up to the most harmonics, within so many Hz.
bool Related(double a_hz, double b_hz, double within_hz) {
  for (int p = 1; p <= kMostHarmonics; ++p)
    for (int q = 1; q <= kMostHarmonics; ++q)
      if (std::abs(a_hz * q - b_hz * p) < within_hz * std::max(p, q)) return true;
  return false;
}

class Search {
 public:
  explicit Search(std::span<const LevelBurst> bursts) {
    for (const LevelBurst& burst : bursts) Add(burst);
    for (const Block& block : blocks_)
      span_s_ = std::max(span_s_, block.t.back() - block.t.front());
    step_hz_ = 1 / (kOversampling * span_s_);
  }

  LampFrequency Best();

 private:
  void Add(const LevelBurst& burst);
  void Transform();
  std::vector<double> Peaks(int harmonics, std::size_t count) const;
  std::vector<double> Places() const;
  // Gauss-Newton in f, the rest linear.
  Candidate Refined(double first_hz, int harmonics) const;
  double StandardError(const Candidate& candidate) const;

  std::vector<Block> blocks_;
  double span_s_ = 0, step_hz_ = 0;
  std::vector<std::vector<float>> power_;  // by burst: share of its variance that one harmonic is
};

void Search::Add(const LevelBurst& burst) {
  Block block;
  const auto frames = static_cast<double>(burst.level.size());
  const double mean = std::accumulate(burst.level.begin(), burst.level.end(), 0.0) / frames;
  const double middle_s = std::accumulate(burst.start_s.begin(), burst.start_s.end(), 0.0) / frames;
  double tt = 0, ty = 0;
  for (std::size_t n = 0; n < burst.level.size(); ++n) {
    block.t.push_back(burst.start_s[n] - middle_s);
    block.y.push_back(burst.level[n] - mean);
    tt += block.t[n] * block.t[n];
    ty += block.t[n] * block.y[n];
  }
  double squares = 0, fourths = 0;
  for (std::size_t n = 0; n < block.t.size(); ++n) {
    block.y[n] -= ty / tt * block.t[n];
    squares += std::pow(block.y[n], 2);
    fourths += std::pow(block.y[n], 4);
  }
  if (!(squares > 0)) return;
  for (double& y : block.y) y /= std::sqrt(squares);
  block.peakedness = frames * fourths / (squares * squares);
  blocks_.push_back(std::move(block));
}

// Each level turned round by its time, all frequencies of the grid in rising order: a step is one
// complex product. In single precision, which errs by some 1e-5 of a level over a run.
void Search::Transform() {
  constexpr std::size_t kRun = 1024, kLanes = 8;
  const auto points = static_cast<std::size_t>(kHighestPulse_hz / step_hz_) + 1;
  for (const Block& block : blocks_) {
    std::vector<float>& power = power_.emplace_back(points);
    std::array<float, kRun> re, im;
    for (std::size_t first = 0; first < points; first += kRun) {
      re.fill(0), im.fill(0);
      for (std::size_t n = 0; n < block.t.size(); ++n) {
        std::array<float, kLanes> c, s;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const double turns = step_hz_ * static_cast<double>(first + lane) * block.t[n];
          const double angle = kTwoPi * (turns - std::floor(turns));
          c[lane] = static_cast<float>(block.y[n] * std::cos(angle));
          s[lane] = static_cast<float>(block.y[n] * std::sin(angle));
        }
        const double turn = kTwoPi * step_hz_ * kLanes * block.t[n];
        const auto a = static_cast<float>(std::cos(turn)), b = static_cast<float>(std::sin(turn));
        for (std::size_t j = 0; j < kRun; j += kLanes)
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            re[j + lane] += c[lane];
            im[j + lane] += s[lane];
            const float next = c[lane] * a - s[lane] * b;
            s[lane] = s[lane] * a + c[lane] * b;
            c[lane] = next;
          }
      }
      const float scale = 2 / static_cast<float>(block.t.size());
      for (std::size_t j = 0; j < std::min(kRun, points - first); ++j)
        power[first + j] = scale * (re[j] * re[j] + im[j] * im[j]);
    }
  }
}

// By the place of the highest harmonic on the grid, so that the lower ones are exact to a part of a
// step. Harmonics count as independent of each other: the places are refined without that.
std::vector<double> Search::Peaks(int harmonics, std::size_t count) const {
  constexpr float kLeastLeft = 0.03F;  // where the sum of shares exceeds 1
  const std::size_t points = power_.front().size();
  std::vector<float> score(points);
  for (std::size_t g = 0; g < blocks_.size(); ++g) {
    const auto half = 0.5F * static_cast<float>(blocks_[g].t.size());
    for (std::size_t i = 0; i < points; ++i) {
      float left = 1;
      for (int k = 1; k <= harmonics; ++k) left -= power_[g][(i * k + harmonics / 2) / harmonics];
      score[i] -= half * std::log(std::max(kLeastLeft, left));
    }
  }
  std::vector<std::size_t> peaks;
  const auto first = static_cast<std::size_t>(std::ceil(kLowestPulse_hz * harmonics / step_hz_));
  for (std::size_t i = std::max<std::size_t>(first, 1); i + 1 < points; ++i)
    if (score[i] >= score[i - 1] && score[i] > score[i + 1]) peaks.push_back(i);
  count = std::min(count, peaks.size());
  std::partial_sort(peaks.begin(), peaks.begin() + static_cast<std::ptrdiff_t>(count), peaks.end(),
                    [&](std::size_t a, std::size_t b) { return score[a] > score[b]; });
  std::vector<double> places;
  for (std::size_t k = 0; k < count; ++k)
    places.push_back(static_cast<double>(peaks[k]) * step_hz_ / harmonics);
  return places;
}

Candidate Search::Refined(double first_hz, int harmonics) const {
  constexpr int kSteps = 8;
  const double longest_hz = 0.25 / (span_s_ * harmonics);
  Candidate c{first_hz, harmonics};
  for (int step = 0;; ++step) {
    double slope2 = 0, slope_residual = 0, x = 0;
    for (const Block& block : blocks_) {
      const HarmonicFit fit = FitHarmonics(block, c.hz, harmonics);
      const double freedom = static_cast<double>(block.t.size()) - 2 - 2 * harmonics;
      const double rss = fit.rss + kLeastRss, weight = freedom / rss;
      slope2 += weight * fit.slope2;
      slope_residual += weight * fit.slope_residual;
      x -= 0.5 * freedom * std::log(std::min(1.0, rss));
    }
    // Those that the span tells apart by the highest harmonic.
    const double frequencies = harmonics * span_s_ * (kHighestPulse_hz - kLowestPulse_hz);
    c.evidence =
        MinusLogGammaTail(harmonics * static_cast<int>(blocks_.size()), x) - std::log(frequencies);
    if (!(slope2 > 0)) return c;
    c.sigma_hz = 1 / std::sqrt(slope2);
    const double by = std::clamp(slope_residual / slope2, -longest_hz, longest_hz);
    const bool there = std::abs(by) < 1e-3 * c.sigma_hz;
    if (there || step == kSteps || std::abs(c.hz + by - first_hz) > 1 / span_s_) return c;
    c.hz += by;
  }
}

double Search::StandardError(const Candidate& c) const {
  double slope2 = 0, scatter = 0;
  for (const Block& block : blocks_) {
    const HarmonicFit fit = FitHarmonics(block, c.hz, c.harmonics, true);
    const double freedom = static_cast<double>(block.t.size()) - 2 - 2 * c.harmonics;
    const double weight = freedom / (fit.rss + kLeastRss);
    slope2 += weight * fit.slope2;
    scatter += weight * weight * fit.slope2_residual2;
  }
  return std::max(c.sigma_hz, std::sqrt(scatter) / slope2);
}

// Where peaks of the search are, and parts of them: a peak may be a harmonic.
std::vector<double> Search::Places() const {
  constexpr std::size_t kPeaks = 12;
  const double equal_hz = 0.05 / span_s_;
  std::vector<double> places;
  const auto add = [&](double hz) {
    const bool known = std::any_of(places.begin(), places.end(),
                                   [&](double place) { return std::abs(place - hz) < equal_hz; });
    if (hz >= kLowestPulse_hz && hz <= kHighestPulse_hz && !known) places.push_back(hz);
  };
  for (const int harmonics : {1, 2, 4, 8})
    for (const double peak_hz : Peaks(harmonics, kPeaks)) {
      add(peak_hz);
      if (harmonics > 1) continue;
      for (int part = 2; part <= kMostHarmonics; ++part) add(peak_hz / part);
    }
  return places;
}

LampFrequency Search::Best() {
  LampFrequency result;
  if (blocks_.empty()) {
    result.why = "the frames are equal";
    return result;
  }
  Transform();
  std::vector<Candidate> candidates;
  for (const double hz : Places())
    for (const int harmonics : {1, 2, 3, 4, 6, 8}) candidates.push_back(Refined(hz, harmonics));
  Candidate best, rival;
  for (const Candidate& c : candidates)
    if (c.evidence > best.evidence) best = c;
  for (const Candidate& c : candidates)
    if (c.evidence > rival.evidence && !Related(best.hz, c.hz, 1 / span_s_)) rival = c;
  result.false_alarm = std::exp(-best.evidence);
  result.harmonics = best.harmonics;
  if (std::all_of(blocks_.begin(), blocks_.end(),
                  [](const Block& b) { return b.peakedness > kMostPeaked; }))
    result.why = "too few frames catch a pulse: its pulses are short and the exposures are too";
  else if (result.false_alarm > kFalseAlarm)
    result.why = fmt::format(
        "none from {} to {} Hz explains the frames: the times at which they begin are "
        "known too inexactly, or the pulses do not repeat",
        kLowestPulse_hz, kHighestPulse_hz);
  else if (best.evidence - rival.evidence < -std::log(kFalseAlarm))
    result.why = fmt::format("{:.6g} and {:.6g} Hz explain the frames about equally well", best.hz,
                             rival.hz);
  else
    result.hz = best.hz, result.sigma_hz = StandardError(best);
  return result;
}

}  // namespace

LampFrequency FrequencyOf(std::span<const LevelBurst> bursts) { return Search(bursts).Best(); }

std::string FormatHertz(double hz, double sigma_hz) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(1 - std::log10(sigma_hz))), 0, 9);
  return fmt::format("{:.{}f} Hz (standard error {:.1g} Hz)", hz, decimals, sigma_hz);
}

}  // namespace luxfield::capture
