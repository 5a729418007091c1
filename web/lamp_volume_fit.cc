#include "luxfield/web/lamp_volume_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/colour.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/random.h"

namespace luxfield::web {
namespace {

using lightfield::LightField;
using lightfield::Vec2;
using lightfield::Vec3;
using preprocess::Receiver;

constexpr double kTableBorder = 0.8;  // tau and zeta where tables join, besides I
constexpr int kSlices = 16;           // of heights at which a table is judged
constexpr int kPlacesAcross = 64;     // along either side of a slice
constexpr double kFiner = 1.45;       // more nodes on an axis in one step
constexpr double kMostNodes = 254;    // on an axis: WebGL2 promises textures of 256
constexpr int kMostTables = 4;        // RangesOf
constexpr int kBrightTrials = 64;     // to find a bright receiver

// A random unit vector at most 45 degrees from -z, uniform in solid angle.
Vec3 NormalTowardsLamp(core::Random& random) {
  const double cosine = 1 - random.Uniform() * (1 - std::numbers::sqrt2 / 2);
  const double sine = std::sqrt(1 - cosine * cosine),
               turn = 2 * std::numbers::pi * random.Uniform();
  return {sine * std::cos(turn), sine * std::sin(turn), -cosine};
}

double ExactIlluminance(const LightField& field, const Receiver& receiver) {
  return core::Luminance(lightfield::ExactIrradiance(field, receiver.p, receiver.n));
}

struct Judged {
  Receiver receiver;
  double exact = 0;
};

std::vector<Judged> Judge(const LightField& field, const std::vector<Receiver>& receivers) {
  std::vector<Judged> judged(receivers.size());
  core::ParallelFor(receivers.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      judged[k] = {receivers[k], ExactIlluminance(field, receivers[k])};
  });
  return judged;
}

// (J_x, J_y, J_z) over tau^2 or 1, at places on a lattice of one height, by the closed form.
struct JudgedSlice {
  double z_m = 0;
  std::vector<double> q_x, q_y;
  std::vector<Vec3> k;  // [y][x], as luminance weighs the channels
};

// Slices at heights that are log-uniform, one in each of `count` parts of the range, with lattices
// that are shifted at random.
std::vector<JudgedSlice> JudgeSlices(const LightField& field, const LampVolume& volume,
                                     double z_first_m, double z_last_m, int count,
                                     std::uint64_t seed) {
  core::Random random(seed, 1);
  std::vector<JudgedSlice> slices(count);
  for (int part = 0; part < count; ++part) {
    JudgedSlice& slice = slices[part];
    slice.z_m = z_first_m * std::pow(z_last_m / z_first_m, (part + random.Uniform()) / count);
    const double shift_x = random.Uniform(), shift_y = random.Uniform();
    for (int k = 0; k < kPlacesAcross; ++k) {
      slice.q_x.push_back(2 * (k + shift_x) / kPlacesAcross - 1);
      slice.q_y.push_back(2 * (k + shift_y) / kPlacesAcross - 1);
    }
    const Side side = slice.z_m >= volume.delta_m ? Side::kFront : Side::kBetween;
    const double w = side == Side::kFront ? volume.delta_m / slice.z_m : slice.z_m / volume.delta_m;
    const auto values = ExactSlice(field, volume.bounds, side, w, slice.q_x, slice.q_y);
    const std::size_t channels = volume.channels;
    for (std::size_t place = 0; place < slice.q_x.size() * slice.q_y.size(); ++place) {
      Vec3 k;
      for (std::size_t channel = 0; channel < channels; ++channel) {
        const float* one = values.data() + (place * channels + channel) * 3;
        const double weight = channels == 1 ? 1 : core::kLuminanceWeights[channel];
        k = k + weight * Vec3{double(one[0]), double(one[1]), double(one[2])};
      }
      slice.k.push_back(k);
    }
  }
  return slices;
}

struct Deviations {
  double largest = 0;   // in units of the receiver
  double rms = 0;       // of these
  double rel_rmse = 0;  // RMSE over the mean
};

// Of J; the unit is that of a receiver that faces F.
Deviations DeviationsOf(const LampVolume& volume, const std::vector<JudgedSlice>& slices) {
  std::vector<double> largest(slices.size()), squares(slices.size());
  core::ParallelFor(slices.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const JudgedSlice& slice = slices[s];
      const double tau = std::min(1.0, volume.delta_m / slice.z_m),
                   dimmest = kFloorShare * BrightestAt(volume, slice.z_m) / (tau * tau);
      for (std::size_t place = 0; place < slice.k.size(); ++place) {
        const Vec2 q{slice.q_x[place % slice.q_x.size()], slice.q_y[place / slice.q_x.size()]};
        const auto vector = LightVectorAt(volume, PointAt(volume, q, slice.z_m));
        Vec3 k;
        for (int channel = 0; channel < 3; ++channel)
          k = k + (core::kLuminanceWeights[channel] / (tau * tau)) * vector.j[channel];
        const double error = lightfield::Length(k - slice.k[place]);
        if (error == 0) continue;
        const double in_units = error / std::max(std::abs(slice.k[place].z), dimmest);
        largest[s] = std::max(largest[s], in_units);
        squares[s] += in_units * in_units;
      }
    }
  });
  Deviations d;
  double sum = 0, count = 0;
  for (std::size_t s = 0; s < slices.size(); ++s) {
    d.largest = std::max(d.largest, largest[s]);
    sum += squares[s];
    count += double(slices[s].k.size());
  }
  d.rms = std::sqrt(sum / count);
  return d;
}

Deviations DeviationsOf(const LampVolume& volume, const std::vector<Judged>& judged) {
  Deviations d;
  double squares = 0, sum = 0;
  for (const auto& [receiver, exact] : judged) {
    const double error = std::abs(IlluminanceAt(volume, receiver.p, receiver.n) - exact);
    const double unit = std::max(std::abs(exact), kFloorShare * BrightestAt(volume, receiver.p.z));
    squares += error * error;
    sum += exact;
    if (error > 0) d.largest = std::max(d.largest, error / unit);
  }
  if (squares > 0) d.rel_rmse = std::sqrt(squares * double(judged.size())) / std::abs(sum);
  return d;
}

// ---- one table ----

// Nodes: about `across` along the footprint's sides, in proportion to them.
TableSize SizeOf(const LampVolume& volume, double across, double w) {
  const Rectangle &f = volume.bounds.on_f, &i = volume.bounds.on_i;
  const double shape = std::clamp((i.half.x + f.half.x) / (i.half.y + f.half.y), 0.25, 4.0);
  const auto nodes = [](double n) {
    return static_cast<int>(std::lround(std::clamp(n, 4.0, kMostNodes)));
  };
  return {nodes(across * std::sqrt(shape)), nodes(across / std::sqrt(shape)), nodes(w)};
}

struct Range {
  Side side = Side::kFront;
  double w_first = 0, w_last = 1;
  double across = 48, along = 6;  // nodes to begin with
};

double HeightOf(double delta_m, Side side, double w) {
  return side == Side::kFront ? delta_m / w : delta_m * w;
}

// The heights of a range that are neither about I nor beyond the farthest.
std::array<double, 2> StatedHeights(double delta_m, const Range& range) {
  const double about = HalfWidthAboutImagePlane(delta_m);
  if (range.side == Side::kBetween)
    return {HeightOf(delta_m, range.side, range.w_first),
            std::min(delta_m - about, HeightOf(delta_m, range.side, range.w_last))};
  return {std::max(delta_m + about, HeightOf(delta_m, range.side, range.w_last)),
          range.w_first > 0 ? HeightOf(delta_m, range.side, range.w_first)
                            : std::max(kFarthestHeight_m, 10 * delta_m)};
}

struct Attempt {
  double across = 0, along = 0;
  LampTable table;
  std::vector<std::uint8_t> packed;
  Deviations error;
};

// How much the error falls per byte that is spent.
double Gain(const Attempt& before, const Attempt& after) {
  const double bytes =
      std::max<double>(1, double(after.packed.size()) - double(before.packed.size()));
  return std::log(before.error.rms / std::max(after.error.rms, 1e-12)) / bytes;
}

// Finer and finer tables of one range.
class Ladder {
 public:
  Ladder(const LightField& field, const LampVolume& volume, const Range& range, std::uint64_t seed,
         const std::string& name)
      : field_(field), volume_(volume), range_(range), name_(name) {
    const auto heights = StatedHeights(volume.delta_m, range);
    judges_ = JudgeSlices(field, volume, heights[0], heights[1], kSlices, seed);
    last_ = Try(range.across, range.along);
    best_ = last_;
  }

  const Attempt& best() const { return best_; }
  Attempt& best() { return best_; }
  const Range& range() const { return range_; }
  double stated_error() const { return kStatedMargin * best_.error.largest; }

  // Coarser, until it takes no more bytes than that.
  void Shrink(std::size_t max_bytes) {
    while (best_.packed.size() > max_bytes && last_.across > 4)
      best_ = last_ = Try(last_.across / kFiner, last_.along / kFiner);
  }

  // One step finer, on the axes on which the error falls most per byte; a smaller step where no
  // other takes at most that many bytes. False where that does neither, or where two steps before
  // have not helped.
  bool Climb(std::size_t max_bytes) {
    if (in_vain_ == 2) return false;
    for (const double finer : {kFiner, std::sqrt(kFiner)}) {
      core::ThrowIfInterrupted();
      Attempt wider = Try(last_.across * finer, last_.along),
              longer = Try(last_.across, last_.along * finer);
      const auto fits = [&](const Attempt& attempt) {
        return attempt.packed.size() <= max_bytes &&
               attempt.table.codes.size() <= kMostCodes / kMostTables;
      };
      const bool wider_fits = fits(wider) && last_.across < kMostNodes,
                 longer_fits = fits(longer) && last_.along < kMostNodes;
      if (!wider_fits && !longer_fits) continue;
      const bool widen = wider_fits && (!longer_fits || Gain(last_, wider) >= Gain(last_, longer));
      last_ = widen ? std::move(wider) : std::move(longer);
      ++in_vain_;
      if (last_.error.largest < best_.error.largest) {
        best_ = last_;
        in_vain_ = 0;
      }
      return true;
    }
    return false;
  }

 private:
  Attempt Try(double across, double along) const {
    Attempt attempt;
    attempt.across = across;
    attempt.along = along;
    attempt.table = BuildLampTable(field_, volume_, range_.side, range_.w_first, range_.w_last,
                                   SizeOf(volume_, across, along), name_);
    attempt.packed = PackCodes(attempt.table, volume_.channels);
    LampVolume alone = volume_;
    alone.tables = {attempt.table};
    attempt.error = DeviationsOf(alone, judges_);
    return attempt;
  }

  const LightField& field_;
  const LampVolume& volume_;
  Range range_;
  std::string name_;
  std::vector<JudgedSlice> judges_;
  Attempt last_, best_;
  int in_vain_ = 0;  // steps since the best
};

// ---- all of them ----

// From the nearest to infinitely far.
std::vector<Range> RangesOf(double delta_m) {
  const double nearest = NearestHeight(delta_m) / delta_m;
  std::vector<Range> ranges;
  if (nearest < kTableBorder) ranges.push_back({Side::kBetween, nearest, kTableBorder, 48, 16});
  ranges.push_back({Side::kBetween, std::max(nearest, kTableBorder), 1, 64, 5});
  ranges.push_back({Side::kFront, kTableBorder, 1, 64, 5});
  ranges.push_back({Side::kFront, 0, kTableBorder, 64, 8});
  return ranges;
}

// Whether texels show in a range however fine its table is.
bool IsAboutImagePlane(const Range& range) { return range.w_last == 1; }

std::size_t BytesOf(const std::vector<Ladder>& ladders) {
  std::size_t bytes = 0;
  for (const Ladder& ladder : ladders) bytes += ladder.best().packed.size();
  return bytes;
}

// Those away from I first, until they are as exact as asked for or have a quarter of the bytes;
// then always the worst that can still grow.
void Climb(std::vector<Ladder>& ladders, const FitOptions& options) {
  const std::size_t share = options.max_bytes / ladders.size();
  for (Ladder& ladder : ladders) ladder.Shrink(share);
  for (Ladder& ladder : ladders)
    while (!IsAboutImagePlane(ladder.range()) && ladder.stated_error() > options.max_error &&
           ladder.Climb(share)) {
    }
  std::vector<Ladder*> growing;
  for (Ladder& ladder : ladders) growing.push_back(&ladder);
  for (;;) {
    std::erase_if(
        growing, [&](const Ladder* ladder) { return ladder->stated_error() <= options.max_error; });
    if (growing.empty()) return;
    const auto worst = std::max_element(
        growing.begin(), growing.end(),
        [](const Ladder* a, const Ladder* b) { return a->stated_error() < b->stated_error(); });
    const std::size_t others = BytesOf(ladders) - (*worst)->best().packed.size();
    if (!(*worst)->Climb(options.max_bytes - others)) growing.erase(worst);
  }
}

}  // namespace

double NearestHeight(double delta_m) { return std::min(0.02, 0.4 * delta_m); }

double HalfWidthAboutImagePlane(double delta_m) { return std::min(0.02, 0.1 * delta_m); }

std::size_t FittedVolume::packed_bytes() const {
  std::size_t bytes = 0;
  for (const auto& table : packed) bytes += table.size();
  return bytes;
}

double FittedVolume::stated_error() const {
  double largest = 0;
  for (const ErrorZone& zone : zones)
    if (!zone.on_image_plane) largest = std::max(largest, zone.stated_error);
  return largest;
}

std::vector<Receiver> LitReceivers(const LightField& field, const LampVolume& volume,
                                   double z_first_m, double z_last_m, int count,
                                   std::uint64_t seed) {
  core::Random random(seed, 0);
  const auto draw = [&] {
    const double z = z_first_m * std::pow(z_last_m / z_first_m, random.Uniform());
    const double x = 2 * random.Uniform() - 1, y = 2 * random.Uniform() - 1;
    return PointAt(volume, {x, y}, z);
  };
  const Vec3 facing{0, 0, -1};
  std::vector<Receiver> receivers;
  for (int k = 0; k < count; ++k) {
    Receiver receiver{draw(), NormalTowardsLamp(random)};
    for (int trial = 0; k % 2 == 1 && trial < kBrightTrials; ++trial) {
      const double share = IlluminanceAt(volume, receiver.p, facing) /
                           std::max(BrightestAt(volume, receiver.p.z), 1e-300);
      if (random.Uniform() < share) break;
      receiver.p = draw();
    }
    if (lightfield::HorizonCutsSupport(field.geometry, receiver.p, receiver.n)) receiver.n = facing;
    receivers.push_back(receiver);
  }
  return receivers;
}

void MeasureZone(const LightField& field, const LampVolume& volume, int receivers,
                 std::uint64_t seed, ErrorZone& zone) {
  const auto judged =
      Judge(field, LitReceivers(field, volume, zone.z_first_m, zone.z_last_m, receivers, seed));
  const Deviations d = DeviationsOf(volume, judged);
  const double on_slices =
      DeviationsOf(volume, JudgeSlices(field, volume, zone.z_first_m, zone.z_last_m, kSlices, seed))
          .largest;
  zone.stated_error = kStatedMargin * std::max(d.largest, on_slices);
  zone.rel_rmse = d.rel_rmse;
  zone.receivers = receivers;
}

FittedVolume FitLampVolume(const LightField& field, const FitOptions& options,
                           const std::string& name) {
  const double delta_m = field.geometry.delta_m;
  FittedVolume fitted;
  fitted.volume = EmptyLampVolume(field, name);
  const LampVolume empty = fitted.volume;
  std::vector<Ladder> ladders;
  for (const Range& range : RangesOf(delta_m))
    ladders.emplace_back(field, empty, range, 2 * options.seed, name);
  Climb(ladders, options);
  const double about = HalfWidthAboutImagePlane(delta_m);
  for (Ladder& ladder : ladders) {
    const Range& range = ladder.range();
    fitted.volume.tables.push_back(std::move(ladder.best().table));
    fitted.packed.push_back(std::move(ladder.best().packed));
    if (range.side == Side::kFront && IsAboutImagePlane(range))
      fitted.zones.push_back({delta_m - about, delta_m + about, true});
    const auto heights = StatedHeights(delta_m, range);
    fitted.zones.push_back({heights[0], heights[1]});
  }
  for (ErrorZone& zone : fitted.zones)
    MeasureZone(field, fitted.volume, options.receivers, 2 * options.seed + 1, zone);
  return fitted;
}

}  // namespace luxfield::web
