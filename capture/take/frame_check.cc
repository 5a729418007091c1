#include "luxfield/capture/take/frame_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include "luxfield/core/json.h"
#include "luxfield/core/parallel.h"

namespace luxfield::capture {
namespace {

constexpr double kFewestPixels = 100;
// Pixels of a block: their sum fits 32 bits, their number 16; whole numbers as narrow as that are
// what compilers vectorise best.
constexpr std::size_t kBlock = 1 << 15;
constexpr std::size_t kGrain = 16;  // blocks that a thread takes at once

template <typename Value>
using BlockSum = std::conditional_t<std::is_integral_v<Value>, std::uint32_t, double>;
template <typename Value>
using BlockCount = std::conditional_t<std::is_integral_v<Value>, std::uint16_t, std::uint32_t>;

// The part of each block that is looked at.
struct Part {
  std::size_t first = 0, last = kBlock;
};
// Noise of a level ratio, of the tolerance: at most, and where a sample is enough.
constexpr double kMostNoise = 0.1, kSampleNoise = 0.02;
constexpr Part kSample{0, kBlock / 16}, kRest{kBlock / 16, kBlock};

// Read noise and quantisation, DN.
double NoiseFloor(const rig::SensorModel& c, bool adc) {
  return std::sqrt(c.read_noise_dn * c.read_noise_dn + (adc ? 1.0 / 12 : 0.0));
}

// What pixels are compared with: whole numbers with their own kind.
template <typename Value>
using Bound = std::conditional_t<std::is_integral_v<Value>, Value, double>;

// The least pixel from `x` on and the greatest up to it: of whole numbers n, n >= x is
// n >= ceil(x) and n <= x is n <= floor(x). Nothing where there is none.
template <typename Value>
std::optional<Bound<Value>> LeastFrom(double x) {
  if constexpr (!std::is_integral_v<Value>) return x;
  if (x > std::numeric_limits<Value>::max()) return {};
  return static_cast<Bound<Value>>(std::ceil(std::max(x, 0.0)));
}
template <typename Value>
std::optional<Bound<Value>> GreatestTo(double x) {
  if constexpr (!std::is_integral_v<Value>) return x;
  if (x < 0) return {};
  return static_cast<Bound<Value>>(
      std::floor(std::min(x, double{std::numeric_limits<Value>::max()})));
}

// Lets `look(begin, end, total)` see the usable runs within a part of every block of a plane, on
// all cores, each with a total of its own, and adds up the totals in their order.
template <typename Total, typename Look>
Total AddRuns(std::size_t pixels, const std::vector<PixelRun>& usable, Part part,
              const Look& look) {
  std::vector<Total> totals((pixels + kBlock - 1) / kBlock);
  core::ParallelFor(totals.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t n = first; n < last; ++n) {
      const std::size_t begin = std::min(n * kBlock + part.first, pixels),
                        end = std::min(n * kBlock + part.last, pixels);
      auto run =
          std::upper_bound(usable.begin(), usable.end(), begin,
                           [](std::size_t at, const PixelRun& other) { return at < other.end; });
      for (; run != usable.end() && run->begin < end; ++run) {
        Total total;
        look(std::max(begin, run->begin), std::min(end, run->end), total);
        totals[n] += total;
      }
    }
  });
  Total sum;
  for (const Total& total : totals) sum += total;
  return sum;
}

struct Levels {
  double sum = 0, brightest = -HUGE_VAL;
  std::size_t count = 0, saturated = 0, black = 0;

  void operator+=(const Levels& other) {
    sum += other.sum;
    brightest = std::max(brightest, other.brightest);
    count += other.count;
    saturated += other.saturated;
    black += other.black;
  }
};

template <typename Value>
FrameStatistics MeasurePlane(const std::vector<Value>& plane, const std::vector<PixelRun>& usable,
                             const rig::SensorModel& c) {
  using Count = BlockCount<Value>;
  const auto saturation = LeastFrom<Value>(c.saturation_dn);
  const auto black_level = GreatestTo<Value>(c.black_dn);
  const auto look = [&](std::size_t begin, std::size_t end, Levels& levels) {
    BlockSum<Value> sum = 0;
    Value brightest = std::numeric_limits<Value>::lowest();
    Count saturated = 0, black = 0;
    const Bound<Value> high = saturation.value_or(0), low = black_level.value_or(0);
    for (std::size_t k = begin; k < end; ++k) {
      const Value dn = plane[k];
      sum += dn;
      brightest = std::max(brightest, dn);
      saturated = static_cast<Count>(saturated + (dn >= high));
      black = static_cast<Count>(black + (dn <= low));
    }
    levels = {double(sum), double(brightest), end - begin, saturation ? saturated : std::size_t{0},
              black_level ? black : std::size_t{0}};
  };
  const auto levels = AddRuns<Levels>(plane.size(), usable, {}, look);
  if (levels.count == 0) return {};
  const auto n = static_cast<double>(levels.count);
  return {levels.sum / n, levels.brightest, static_cast<double>(levels.saturated) / n,
          static_cast<double>(levels.black) / n};
}

// Sums over the pixels that two frames both show well: the shorter one's from `low_dn` to
// `high_dn`, the other's up to `high_dn`.
struct Common {
  double frame = 0, shorter = 0, count = 0;

  void operator+=(const Common& other) {
    frame += other.frame;
    shorter += other.shorter;
    count += other.count;
  }
};
template <typename Value>
Common SumCommon(const std::vector<Value>& frame, const std::vector<Value>& shorter,
                 const std::vector<PixelRun>& usable, Part part, double low_dn, double high_dn) {
  const auto least = LeastFrom<Value>(low_dn);
  const auto greatest = GreatestTo<Value>(high_dn);
  if (!least || !greatest) return {};
  const Bound<Value> low = *least, high = *greatest;
  const auto look = [&](std::size_t begin, std::size_t end, Common& common) {
    BlockSum<Value> of_frame = 0, of_shorter = 0;
    BlockCount<Value> count = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const Value a = frame[k], b = shorter[k];
      const bool use = (b >= low) & (b <= high) & (a <= high);
      of_frame += use ? a : Value{0};
      of_shorter += use ? b : Value{0};
      count = static_cast<BlockCount<Value>>(count + use);
    }
    common = {double(of_frame), double(of_shorter), double(count)};
  };
  return AddRuns<Common>(frame.size(), usable, part, look);
}

}  // namespace

std::vector<PixelRun> UsablePixels(const hal::CameraCapabilities& camera,
                                   const rig::SensorModel& calibration) {
  const auto width = static_cast<std::size_t>(camera.width);
  const std::size_t pixels = width * camera.height;
  std::vector<std::size_t> defects;
  for (const auto& [row, column] : calibration.defects)
    if (row >= 0 && row < camera.height && column >= 0 && column < camera.width)
      defects.push_back(row * width + column);
  defects.push_back(pixels);
  std::sort(defects.begin(), defects.end());
  std::vector<PixelRun> usable;
  std::size_t begin = 0;
  for (const std::size_t defect : defects) {
    if (defect > begin) usable.push_back({begin, defect});
    begin = defect + 1;
  }
  return usable;
}

FrameStatistics Measure(const session::RawFrame& frame, const std::vector<PixelRun>& usable,
                        const rig::SensorModel& c) {
  return frame.value.empty() ? MeasurePlane(frame.dn, usable, c)
                             : MeasurePlane(frame.value, usable, c);
}

core::Json ToJson(const FrameStatistics& s) {
  return {{"mean_dn", s.mean_dn},
          {"brightest_dn", s.brightest_dn},
          {"saturated_share", s.saturated_share},
          {"black_share", s.black_share}};
}

std::optional<double> LevelRatio(const session::RawFrame& frame, double exposure_s,
                                 const session::RawFrame& shorter, double shorter_exposure_s,
                                 const std::vector<PixelRun>& usable, const rig::SensorModel& c,
                                 double tolerance) {
  const double noise = NoiseFloor(c, frame.value.empty());
  const double low = c.black_dn + 10 * noise, high = 0.8 * c.saturation_dn;
  const auto add = [&](Part part) {
    return frame.value.empty() ? SumCommon(frame.dn, shorter.dn, usable, part, low, high)
                               : SumCommon(frame.value, shorter.value, usable, part, low, high);
  };
  const auto signal = [&](const Common& sums, double sum) { return sum - sums.count * c.black_dn; };
  const auto quiet = [&](const Common& sums, double share) {
    const double of_shorter = signal(sums, sums.shorter);
    const double variance = sums.count * noise * noise + c.gain_dn_per_e * of_shorter;
    return sums.count >= kFewestPixels && std::sqrt(variance) <= share * tolerance * of_shorter;
  };
  Common sums = add(kSample);
  if (!quiet(sums, kSampleNoise)) sums += add(kRest);
  if (!quiet(sums, kMostNoise)) return std::nullopt;
  const double dark = c.gain_dn_per_e * c.dark_current_e_per_s * sums.count;
  return (signal(sums, sums.frame) - dark * exposure_s) /
         (signal(sums, sums.shorter) - dark * shorter_exposure_s) * shorter_exposure_s / exposure_s;
}

}  // namespace luxfield::capture
