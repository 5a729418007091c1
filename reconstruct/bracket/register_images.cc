#include "luxfield/reconstruct/bracket/register_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/simd.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Lattice;
using lightfield::Vec2;

constexpr double kNegligible = 1e-6;  // of a texel's area
constexpr double kSnap = 1e-7;        // of a sensor pixel

// Sums of every pixel column over the rows that one row of texels covers.
struct ColumnSums {
  std::vector<double> covered, unknown, value, square, variance, count;
  std::vector<std::uint32_t> flags;

  explicit ColumnSums(int width) : flags(width) {
    for (auto* sum : {&covered, &unknown, &value, &square, &variance, &count}) sum->resize(width);
  }
  void Clear() {
    for (auto* sum : {&covered, &unknown, &value, &square, &variance, &count})
      std::fill(sum->begin(), sum->end(), 0.0);
    std::fill(flags.begin(), flags.end(), 0u);
  }
};

// Adds columns [begin, end) of a sensor row, each with the row's weight.
LUXFIELD_SIMD_CLONES void AddRow(const MergedFrame& merged, std::span<const float> scale,
                                 std::size_t row, double weight, int begin, int end,
                                 ColumnSums* sums) {
  const std::size_t first = row * merged.width;
  const float* const rate = merged.rate_e_per_s.data() + first;
  const float* const sigma = merged.sigma_e_per_s.data() + first;
  const float* const count = merged.count.data() + first;
  const std::uint32_t* const mask = merged.mask.data() + first;
  const bool one_scale = scale.size() == 1;
  const float* const scales = one_scale ? nullptr : scale.data() + first;
  const double common = scale[0];
  double* const covered = sums->covered.data();
  double* const unknown = sums->unknown.data();
  double* const value_sum = sums->value.data();
  double* const square = sums->square.data();
  double* const variance = sums->variance.data();
  double* const count_sum = sums->count.data();
  std::uint32_t* const flags = sums->flags.data();
  const auto add = [&](int x, double per_rate) __attribute__((always_inline)) {
    const std::uint32_t bad = mask[x] & lightfield::kUnknownMask;
    const double share = bad ? 0.0 : weight;
    const double value = per_rate * rate[x];
    const double deviation = share * per_rate * sigma[x];
    covered[x] += share;
    unknown[x] += weight - share;
    value_sum[x] += share * value;
    square[x] += share * value * value;
    variance[x] += deviation * deviation;
    count_sum[x] += share * count[x];
    flags[x] |= bad;
  };
  if (one_scale) {
    LUXFIELD_INDEPENDENT
    for (int x = begin; x < end; ++x) add(x, common);
  } else {
    LUXFIELD_INDEPENDENT
    for (int x = begin; x < end; ++x) add(x, scales[x]);
  }
}

// Collects what touches one texel.
class Texel {
 public:
  Texel(const MergedFrame& merged, std::span<const float> scale) : merged_(merged), scale_(scale) {}

  void AddColumn(const ColumnSums& sums, int x, double weight) {
    covered_ += weight * sums.covered[x];
    unknown_ += weight * sums.unknown[x];
    value_ += weight * sums.value[x];
    square_ += weight * sums.square[x];
    variance_ += weight * weight * sums.variance[x];
    count_ += weight * sums.count[x];
    flags_ |= sums.flags[x];
  }

  void Add(std::size_t pixel, double weight) {
    const std::uint32_t mask = merged_.mask[pixel];
    if (mask & lightfield::kUnknownMask) {
      unknown_ += weight;
      flags_ |= mask & lightfield::kUnknownMask;
      return;
    }
    covered_ += weight;
    const double scale = scale_[scale_.size() == 1 ? 0 : pixel];
    const double value = scale * merged_.rate_e_per_s[pixel];
    value_ += weight * value;
    square_ += weight * value * value;
    const double sigma = weight * scale * merged_.sigma_e_per_s[pixel];
    variance_ += sigma * sigma;
    count_ += weight * merged_.count[pixel];
  }

  void Store(std::size_t texel, RegisteredImage* image) const {
    std::uint32_t mask = unknown_ > kNegligible ? flags_ : 0;
    if (covered_ + unknown_ < 1 - kNegligible) mask |= lightfield::kOffSensor;
    double gap_variance = 0;
    if (mask == lightfield::kDefect && unknown_ < 0.5 - kNegligible) {
      mask = lightfield::kPartlyDefect;
      // The gap's mean differs from the rest's by about the spread of the pixels in the rest.
      const double mean = value_ / covered_;
      gap_variance = unknown_ * unknown_ * 2 * std::max(square_ / covered_ - mean * mean, 0.0);
    }
    image->mask[texel] = mask;
    if (mask & lightfield::kUnknownMask) return;
    image->value[texel] = static_cast<float>(value_ / covered_);
    image->sigma[texel] =
        static_cast<float>(std::sqrt(variance_ / (covered_ * covered_) + gap_variance));
    image->count[texel] = static_cast<float>(count_ / covered_);
  }

 private:
  const MergedFrame& merged_;
  std::span<const float> scale_;
  double covered_ = 0, unknown_ = 0, value_ = 0, square_ = 0, variance_ = 0, count_ = 0;
  std::uint32_t flags_ = 0;
};

// Weights of consecutive pixels for one texel along one axis.
struct AxisWeights {
  int first = 0;
  std::vector<double> weights;
};

// edges[n], edges[n + 1]: texel n in pixel units, either order.
std::vector<AxisWeights> OverlapWeights(const std::vector<double>& edges, int pixels) {
  std::vector<AxisWeights> result;
  for (std::size_t n = 0; n + 1 < edges.size(); ++n) {
    const double low = std::min(edges[n], edges[n + 1]), high = std::max(edges[n], edges[n + 1]);
    AxisWeights& axis = result.emplace_back();
    if (high <= 0 || low >= pixels) continue;
    axis.first = static_cast<int>(std::floor(std::max(low, 0.0)));
    const int end = static_cast<int>(std::ceil(std::min(high, static_cast<double>(pixels))));
    for (int pixel = axis.first; pixel < end; ++pixel)
      axis.weights.push_back(
          (std::min(high, pixel + 1.0) - std::max(low, static_cast<double>(pixel))) / (high - low));
  }
  return result;
}

// First and one past the last pixel that any texel covers.
std::pair<int, int> Range(const std::vector<AxisWeights>& texels) {
  std::pair<int, int> range{std::numeric_limits<int>::max(), 0};
  for (const AxisWeights& axis : texels) {
    if (axis.weights.empty()) continue;
    range.first = std::min(range.first, axis.first);
    range.second = std::max(range.second, axis.first + static_cast<int>(axis.weights.size()));
  }
  return range;
}

double Snapped(double edge) {
  const double nearest = std::round(edge);
  return std::abs(edge - nearest) < kSnap ? nearest : edge;
}

// Overlaps along both axes for a mapping without rotation or perspective.
struct AlignedWeights {
  std::vector<AxisWeights> along_s, along_t;

  AlignedWeights(const rig::Homography& image_from_sensor, int sensor_width, int sensor_height,
                 const Lattice& lattice, Vec2 centre_m) {
    const auto& h = image_from_sensor;
    std::vector<double> columns, rows;
    for (int c = 0; c <= lattice.width; ++c)
      columns.push_back(
          Snapped(((lattice.s_of_column(c) - centre_m.x) * h(2, 2) - h(0, 2)) / h(0, 0)));
    for (int r = 0; r <= lattice.height; ++r)
      rows.push_back(Snapped(((lattice.t_of_row(r) - centre_m.y) * h(2, 2) - h(1, 2)) / h(1, 1)));
    along_s = OverlapWeights(columns, sensor_width);
    along_t = OverlapWeights(rows, sensor_height);
  }
};

// A convex polygon of at most 8 corners: a quadrilateral clipped by a rectangle.
struct Polygon {
  std::array<Vec2, 8> corner;
  int count = 0;
};

// Keeps the side where sign * (coordinate - border) >= 0 (Sutherland and Hodgman 1974).
template <double Vec2::*coordinate>
Polygon ClipBy(const Polygon& polygon, double border, double sign) {
  Polygon result;
  for (int n = 0; n < polygon.count; ++n) {
    const Vec2 a = polygon.corner[n], b = polygon.corner[n + 1 < polygon.count ? n + 1 : 0];
    const double da = sign * (a.*coordinate - border), db = sign * (b.*coordinate - border);
    if (da >= 0 && result.count < 8) result.corner[result.count++] = a;
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      const double t = da / (da - db);
      if (result.count < 8) result.corner[result.count++] = a + t * (b - a);
    }
  }
  return result;
}

double Area(const Polygon& polygon) {
  double twice = 0;
  for (int n = 1; n + 1 < polygon.count;
       ++n) {  // a fan: differences keep digits far from the origin
    const Vec2 a = polygon.corner[n] - polygon.corner[0],
               b = polygon.corner[n + 1] - polygon.corner[0];
    twice += a.x * b.y - a.y * b.x;
  }
  return std::abs(twice) / 2;
}

double OverlapArea(const std::array<Vec2, 4>& quad, Vec2 low, Vec2 high) {
  double min_x = quad[0].x, max_x = min_x, min_y = quad[0].y, max_y = min_y;
  for (const Vec2 q : quad) {
    min_x = std::min(min_x, q.x);
    max_x = std::max(max_x, q.x);
    min_y = std::min(min_y, q.y);
    max_y = std::max(max_y, q.y);
  }
  if (max_x <= low.x || min_x >= high.x || max_y <= low.y || min_y >= high.y) return 0;
  if (min_x >= low.x && max_x <= high.x && min_y >= low.y && max_y <= high.y) {
    // Nothing to clip: half the cross product of the diagonals.
    const Vec2 a = quad[2] - quad[0], b = quad[3] - quad[1];
    return 0.5 * std::abs(a.x * b.y - a.y * b.x);
  }
  Polygon polygon;
  polygon.count = 4;
  std::copy(quad.begin(), quad.end(), polygon.corner.begin());
  if (min_x < low.x) polygon = ClipBy<&Vec2::x>(polygon, low.x, 1);
  if (max_x > high.x) polygon = ClipBy<&Vec2::x>(polygon, high.x, -1);
  if (min_y < low.y) polygon = ClipBy<&Vec2::y>(polygon, low.y, 1);
  if (max_y > high.y) polygon = ClipBy<&Vec2::y>(polygon, high.y, -1);
  return Area(polygon);
}

}  // namespace

Registration::Registration(const rig::Homography& image_from_sensor, int sensor_width,
                           int sensor_height, const Lattice& lattice,
                           const std::optional<rig::Lens>& lens)
    : image_from_sensor_(image_from_sensor),
      sensor_width_(sensor_width),
      sensor_height_(sensor_height),
      lattice_(lattice),
      lens_(lens) {
  const char* const remedy = "calibrate image_from_sensor again";
  std::array<double, 9> matrix = image_from_sensor.row_major();
  if (!std::all_of(matrix.begin(), matrix.end(), [](double x) { return std::isfinite(x); }))
    throw InputError("calibration", "image_from_sensor is not finite", remedy);
  bool positive = true, negative = true;
  for (const double column : {0, sensor_width})
    for (const double row : {0, sensor_height}) {
      const double w = image_from_sensor.Lift({column, row}).w;
      positive &= w > 0;
      negative &= w < 0;
    }
  if (!positive && !negative)
    throw InputError("calibration", "image_from_sensor sends a part of the sensor through infinity",
                     remedy);
  if (image_from_sensor.Singular())
    throw InputError("calibration", "image_from_sensor is singular", remedy);
  if (negative)  // W is to be above 0 on the sensor
    for (double& value : matrix) value = -value;
  image_from_sensor_ = matrix;
  sensor_from_image_ = image_from_sensor_.Inverse();

  const auto& h = image_from_sensor_;
  axis_aligned_ = !lens_ && h(0, 1) == 0 && h(1, 0) == 0 && h(2, 0) == 0 && h(2, 1) == 0;
  if (axis_aligned_) return;
  corners_m_.reserve(static_cast<std::size_t>(sensor_width + 1) * (sensor_height + 1));
  for (int row = 0; row <= sensor_height; ++row)
    for (int column = 0; column <= sensor_width; ++column) {
      const Vec2 pixel{static_cast<double>(column), static_cast<double>(row)};
      const Vec2 straight = lens_ ? lens_->Straight(pixel) : pixel;
      corners_m_.push_back(h.Map(straight));
    }
}

// Calls body(texel, overlaps) for every texel, in parallel over rows; overlaps(add) calls
// add(pixel, share of the texel's area) for every pixel that covers a part of it.
template <typename Body>
void Registration::ForEachTexel(Vec2 centre_m, Body&& body) const {
  if (axis_aligned_) {
    const AlignedWeights weights(image_from_sensor_, sensor_width_, sensor_height_, lattice_,
                                 centre_m);
    const auto& [along_s, along_t] = weights;
    core::ParallelFor(lattice_.height, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r)
        for (int c = 0; c < lattice_.width; ++c)
          body(r * lattice_.width + c, [&](auto&& add) {
            for (std::size_t y = 0; y < along_t[r].weights.size(); ++y)
              for (std::size_t x = 0; x < along_s[c].weights.size(); ++x)
                add((along_t[r].first + y) * sensor_width_ + along_s[c].first + x,
                    along_t[r].weights[y] * along_s[c].weights[x]);
          });
    });
    return;
  }

  core::ParallelFor(lattice_.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r)
      for (int c = 0; c < lattice_.width; ++c) {
        const Vec2 low{lattice_.s_of_column(c) - centre_m.x,
                       lattice_.t_of_row(static_cast<double>(r) + 1) - centre_m.y};
        const Vec2 high{low.x + lattice_.ds_m, low.y + lattice_.dt_m};
        double min_x = sensor_width_, max_x = 0, min_y = sensor_height_, max_y = 0;
        bool finite = true;
        for (const Vec2 q : {low, Vec2{high.x, low.y}, high, Vec2{low.x, high.y}}) {
          const rig::Homogeneous p = sensor_from_image_.Lift(q);
          finite &= p.w > 0;
          const Vec2 straight{p.x / p.w, p.y / p.w};
          const Vec2 pixel = lens_ ? lens_->Bent(straight) : straight;
          min_x = std::min(min_x, pixel.x);
          max_x = std::max(max_x, pixel.x);
          min_y = std::min(min_y, pixel.y);
          max_y = std::max(max_y, pixel.y);
        }
        // The texel's edges bulge through a lens: by less than a pixel and a part of their length.
        if (lens_) {
          const double bulge = 1 + 0.05 * std::max(max_x - min_x, max_y - min_y);
          min_x -= bulge, min_y -= bulge, max_x += bulge, max_y += bulge;
        }
        body(r * lattice_.width + c, [&](auto&& add) {
          if (!(finite && max_x > 0 && max_y > 0 && min_x < sensor_width_ &&
                min_y < sensor_height_))
            return;
          const int first_x = static_cast<int>(std::max(min_x - kSnap, 0.0));
          const int first_y = static_cast<int>(std::max(min_y - kSnap, 0.0));
          const int end_x =
              static_cast<int>(std::ceil(std::min<double>(max_x + kSnap, sensor_width_)));
          const int end_y =
              static_cast<int>(std::ceil(std::min<double>(max_y + kSnap, sensor_height_)));
          const double area = lattice_.texel_area_m2();
          for (int y = first_y; y < end_y; ++y)
            for (int x = first_x; x < end_x; ++x) {
              const Vec2* top = &corners_m_[static_cast<std::size_t>(y) * (sensor_width_ + 1) + x];
              const Vec2* bottom = top + sensor_width_ + 1;
              const double overlap = OverlapArea({top[0], top[1], bottom[1], bottom[0]}, low, high);
              if (overlap > 0) add(static_cast<std::size_t>(y) * sensor_width_ + x, overlap / area);
            }
        });
      }
  });
}

// Pixel columns first, over the rows of a texel, side by side; then texels from their columns.
void Registration::ApplyAligned(const MergedFrame& merged,
                                std::span<const float> irradiance_per_rate, Vec2 centre_m,
                                RegisteredImage* image) const {
  const AlignedWeights weights(image_from_sensor_, sensor_width_, sensor_height_, lattice_,
                               centre_m);
  const std::pair<int, int> seen = Range(weights.along_s);
  core::ParallelFor(lattice_.height, 16, [&](std::size_t begin, std::size_t end) {
    ColumnSums sums(sensor_width_);
    for (std::size_t r = begin; r < end; ++r) {
      const AxisWeights& rows = weights.along_t[r];
      sums.Clear();
      for (std::size_t y = 0; y < rows.weights.size(); ++y)
        AddRow(merged, irradiance_per_rate, rows.first + y, rows.weights[y], seen.first,
               seen.second, &sums);
      for (int c = 0; c < lattice_.width; ++c) {
        const AxisWeights& columns = weights.along_s[c];
        Texel texel(merged, irradiance_per_rate);
        for (std::size_t x = 0; x < columns.weights.size(); ++x)
          texel.AddColumn(sums, columns.first + static_cast<int>(x), columns.weights[x]);
        texel.Store(r * lattice_.width + c, image);
      }
    }
  });
}

RegisteredImage Registration::Apply(const MergedFrame& merged,
                                    std::span<const float> irradiance_per_rate,
                                    Vec2 centre_m) const {
  const std::size_t texels = static_cast<std::size_t>(lattice_.width) * lattice_.height;
  RegisteredImage image;
  image.value.assign(texels, 0);
  image.sigma.assign(texels, 0);
  image.count.assign(texels, 0);
  image.mask.assign(texels, 0);
  if (axis_aligned_) {
    ApplyAligned(merged, irradiance_per_rate, centre_m, &image);
    return image;
  }
  ForEachTexel(centre_m, [&](std::size_t k, auto&& overlaps) {
    Texel texel(merged, irradiance_per_rate);
    overlaps([&](std::size_t pixel, double share) { texel.Add(pixel, share); });
    texel.Store(k, &image);
  });
  return image;
}

std::vector<std::vector<PixelShare>> Registration::Overlaps(Vec2 centre_m) const {
  std::vector<std::vector<PixelShare>> result(static_cast<std::size_t>(lattice_.width) *
                                              lattice_.height);
  ForEachTexel(centre_m, [&](std::size_t k, auto&& overlaps) {
    overlaps([&](std::size_t pixel, double share) {
      result[k].push_back({static_cast<std::uint32_t>(pixel), share});
    });
  });
  return result;
}

}  // namespace luxfield::reconstruct
