#include "luxfield/preprocess/reduction.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;

// How much of the target each step may use up, all steps before it included.
constexpr double kMergeShare = 0.6, kPoolShare = 0.8, kDropShare = 0.9, kRoundShare = 0.97;
constexpr double kMergeFactors[] = {6, 4, 3, 2, 1.5};
constexpr int kPoolFactors[] = {16, 8, 6, 4, 3, 2};

// Luminance of E_n at every receiver.
std::vector<double> Irradiances(const LightField& field, const std::vector<Receiver>& receivers) {
  std::vector<double> e(receivers.size());
  core::ParallelFor(receivers.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      e[k] = core::Luminance(lightfield::ExactIrradiance(field, receivers[k].p, receivers[k].n));
  });
  return e;
}

// CPU time of the closed form; the best of three, over some receivers.
double CoreSecondsPerReceiver(const LightField& field, std::vector<Receiver> receivers) {
  receivers.resize(std::min<std::size_t>(receivers.size(), 200));
  double best_s = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 3; ++run) {
    const core::Stopwatch stopwatch;
    Irradiances(field, receivers);
    best_s = std::min(best_s, stopwatch.CoreSeconds());
  }
  return best_s / static_cast<double>(receivers.size());
}

struct Error {
  double relative = 0;  // RMS of differences over the mean of the truth
  double bound = 0;     // with 97.5 % confidence, for other receivers of the same picture
};

Error Compare(const std::vector<double>& e, const std::vector<double>& truth) {
  double squares = 0, fourth = 0, sum = 0;
  for (std::size_t k = 0; k < e.size(); ++k) {
    const double square = (e[k] - truth[k]) * (e[k] - truth[k]);
    squares += square;
    fourth += square * square;
    sum += truth[k];
  }
  const double n = static_cast<double>(e.size()), mean = sum / n;
  const double mean_square = squares / n;
  const double standard_error =
      std::sqrt(std::max(0.0, fourth / n - mean_square * mean_square) / n);
  return {std::sqrt(mean_square) / mean, std::sqrt(mean_square + 2 * standard_error) / mean};
}

struct IndexRange {
  int begin = 0, end = 0;
  int count() const { return end - begin; }
  void Include(int k) {
    begin = std::min(begin, k);
    end = std::max(end, k + 1);
  }
};

// A part of a light field: images of the grid, texels of the lattice.
struct FieldPart {
  IndexRange i, j, columns, rows;

  static FieldPart All(const LuminaireGeometry& g) {
    return {{0, g.grid.width}, {0, g.grid.height}, {0, g.lattice.width}, {0, g.lattice.height}};
  }
};

LightField Crop(const LightField& field, const FieldPart& part) {
  LuminaireGeometry g = field.geometry;
  g.grid.u0_m += part.i.begin * g.grid.spacing_m;
  g.grid.v0_m += part.j.begin * g.grid.spacing_m;
  g.grid.width = part.i.count();
  g.grid.height = part.j.count();
  g.lattice.s0_m = field.geometry.lattice.s_of_column(part.columns.begin);
  g.lattice.t1_m = field.geometry.lattice.t_of_row(part.rows.begin);
  g.lattice.width = part.columns.count();
  g.lattice.height = part.rows.count();
  LightField cropped(g);
  cropped.provenance = field.provenance;
  for (int j = part.j.begin; j < part.j.end; ++j)
    for (int i = part.i.begin; i < part.i.end; ++i)
      for (int channel = 0; channel < g.channels; ++channel) {
        const auto from = field.image(field.geometry.grid.index(i, j), channel);
        const auto to = cropped.image(g.grid.index(i - part.i.begin, j - part.j.begin), channel);
        for (int row = 0; row < g.lattice.height; ++row)
          std::copy_n(from.begin() +
                          std::ptrdiff_t(row + part.rows.begin) * field.geometry.lattice.width +
                          part.columns.begin,
                      g.lattice.width, to.begin() + std::ptrdiff_t(row) * g.lattice.width);
      }
  return cropped;
}

bool IsDark(const LightField& field, int m) {
  for (int channel = 0; channel < field.geometry.channels; ++channel)
    for (const float c : field.image(m, channel))
      if (c != 0) return false;
  return true;
}

// Leaves out what is outside the rectangle, then border rows and columns of the grid without light.
LightField CropToSeen(const LightField& field, const SeenRectangle& seen) {
  const auto& lattice = field.geometry.lattice;
  const auto clamp_column = [&](double s) {
    return static_cast<int>(std::clamp(s, 0.0, static_cast<double>(lattice.width)));
  };
  const auto clamp_row = [&](double t) {
    return static_cast<int>(std::clamp(t, 0.0, static_cast<double>(lattice.height)));
  };
  FieldPart part = FieldPart::All(field.geometry);
  part.columns = {clamp_column(std::floor(lattice.column_of_s(seen.s0_m))),
                  clamp_column(std::ceil(lattice.column_of_s(seen.s1_m)))};
  part.rows = {clamp_row(std::floor(lattice.row_of_t(seen.t1_m))),
               clamp_row(std::ceil(lattice.row_of_t(seen.t0_m)))};
  if (part.columns.count() <= 0 || part.rows.count() <= 0)
    throw InputError(
        "no surface of the scene sees light of this luminaire; check the luminaire's "
        "place and direction in the scene");
  const auto& grid = field.geometry.grid;
  const LightField cropped = Crop(field, part);
  FieldPart lit = FieldPart::All(cropped.geometry);
  lit.i = {grid.width, 0};
  lit.j = {grid.height, 0};
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (!IsDark(cropped, grid.index(i, j))) {
        lit.i.Include(i);
        lit.j.Include(j);
      }
  return lit.i.count() > 0 ? Crop(cropped, lit) : cropped;
}

// Coarse functions of one axis: `count` centres `spacing` apart around the middle of the fine ones.
struct CoarseAxis {
  int count = 1;
  double first_centre_m = 0, spacing_m = 0;

  double centre_m(int i) const { return first_centre_m + i * spacing_m; }
  // Weight of coarse function i for light under a fine one centred on c.
  double Weight(int i, double c_m) const {
    return count == 1 ? 1.0 : std::max(0.0, 1 - std::abs(c_m - centre_m(i)) / spacing_m);
  }
};

CoarseAxis MakeCoarseAxis(double middle_m, int fine_count, double fine_spacing_m,
                          double spacing_m) {
  CoarseAxis axis;
  axis.spacing_m = spacing_m;
  axis.count =
      1 + static_cast<int>(std::ceil((fine_count - 1) * fine_spacing_m / spacing_m - 1e-9));
  axis.first_centre_m = middle_m - 0.5 * (axis.count - 1) * spacing_m;
  return axis;
}

// One image where `factor` is empty, else functions `factor` times as far apart. Empty if that
// saves nothing.
std::optional<LightField> Merge(const LightField& field, std::optional<double> factor, double tau) {
  const auto& fine = field.geometry.grid;
  const auto& lattice = field.geometry.lattice;
  const double h = fine.spacing_m;
  const auto first = fine.centre(0, 0), last = fine.centre(fine.width - 1, fine.height - 1);
  CoarseAxis u{1, 0.5 * (first.x + last.x), h}, v{1, 0.5 * (first.y + last.y), h};
  if (factor) {
    u = MakeCoarseAxis(0.5 * (first.x + last.x), fine.width, h, *factor * h);
    v = MakeCoarseAxis(0.5 * (first.y + last.y), fine.height, h, *factor * h);
  }
  if (u.count * v.count >= fine.count()) return std::nullopt;

  LuminaireGeometry g = field.geometry;
  g.grid.width = u.count;
  g.grid.height = v.count;
  g.grid.spacing_m = u.spacing_m;
  g.grid.u0_m = u.first_centre_m - 0.5 * fine.basis.cells * u.spacing_m;
  g.grid.v0_m = v.first_centre_m - 0.5 * fine.basis.cells * v.spacing_m;
  // Room for the farthest shift on all sides.
  const double reach_u = u.count == 1 ? last.x - u.first_centre_m : u.spacing_m;
  const double reach_v = v.count == 1 ? last.y - v.first_centre_m : v.spacing_m;
  const int border_columns =
      static_cast<int>(std::ceil(std::abs(1 - tau) * reach_u / lattice.ds_m)) + 1;
  const int border_rows =
      static_cast<int>(std::ceil(std::abs(1 - tau) * reach_v / lattice.dt_m)) + 1;
  g.lattice.width += 2 * border_columns;
  g.lattice.height += 2 * border_rows;
  g.lattice.s0_m -= border_columns * lattice.ds_m;
  g.lattice.t1_m += border_rows * lattice.dt_m;
  LightField merged(g);
  merged.provenance = field.provenance;
  const double scale = (h * h) / (u.spacing_m * u.spacing_m);
  core::ParallelFor(
      static_cast<std::size_t>(g.grid.count()), 1, [&](std::size_t begin, std::size_t end) {
        std::vector<double> sum(g.plane_size());
        for (std::size_t target = begin; target < end; ++target) {
          const int ci = static_cast<int>(target) % u.count,
                    cj = static_cast<int>(target) / u.count;
          for (int channel = 0; channel < g.channels; ++channel) {
            std::fill(sum.begin(), sum.end(), 0.0);
            for (int m = 0; m < fine.count(); ++m) {
              const auto c = fine.centre(m % fine.width, m / fine.width);
              const double weight = scale * u.Weight(ci, c.x) * v.Weight(cj, c.y);
              if (!(weight > 0)) continue;
              // Texel (row, column) moves to (row + dr, column + dc), split over four neighbours.
              const double dc = border_columns - (1 - tau) * (c.x - u.centre_m(ci)) / lattice.ds_m;
              const double dr = border_rows + (1 - tau) * (c.y - v.centre_m(cj)) / lattice.dt_m;
              const int column0 = static_cast<int>(std::floor(dc)),
                        row0 = static_cast<int>(std::floor(dr));
              const double fc = dc - column0, fr = dr - row0;
              const auto image = field.image(m, channel);
              for (int row = 0; row < lattice.height; ++row)
                for (int side = 0; side < 2; ++side) {
                  double* out =
                      sum.data() + std::ptrdiff_t(row + row0 + side) * g.lattice.width + column0;
                  const double w = weight * (side ? fr : 1 - fr);
                  const float* in = image.data() + std::ptrdiff_t(row) * lattice.width;
                  for (int column = 0; column < lattice.width; ++column) {
                    out[column] += w * (1 - fc) * in[column];
                    out[column + 1] += w * fc * in[column];
                  }
                }
            }
            const auto out = merged.image(static_cast<int>(target), channel);
            for (std::size_t k = 0; k < sum.size(); ++k) out[k] = static_cast<float>(sum[k]);
          }
        }
      });
  return merged;
}

LightField Pool(const LightField& field, int k) {
  LuminaireGeometry g = field.geometry;
  g.lattice.width = (g.lattice.width + k - 1) / k;
  g.lattice.height = (g.lattice.height + k - 1) / k;
  g.lattice.ds_m *= k;
  g.lattice.dt_m *= k;
  LightField pooled(g);
  pooled.provenance = field.provenance;
  const auto& fine = field.geometry.lattice;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < g.channels; ++channel) {
      const auto in = field.image(m, channel);
      const auto out = pooled.image(m, channel);
      for (int row = 0; row < g.lattice.height; ++row)
        for (int column = 0; column < g.lattice.width; ++column) {
          double sum = 0;
          for (int r = row * k; r < std::min((row + 1) * k, fine.height); ++r)
            for (int c = column * k; c < std::min((column + 1) * k, fine.width); ++c)
              sum += in[static_cast<std::size_t>(r) * fine.width + c];
          out[static_cast<std::size_t>(row) * g.lattice.width + column] =
              static_cast<float>(sum / (k * k));
        }
    }
  return pooled;
}

LightField Round(const LightField& field, int mantissa_bits) {
  LightField rounded = field;
  const std::uint32_t step = 1u << (23 - mantissa_bits);
  for (float& c : rounded.data) {
    const auto bits =
        std::bit_cast<std::uint32_t>(c) + step / 2;  // to nearest, also over exponents
    const float value = std::bit_cast<float>(bits & ~(step - 1));
    if (std::isfinite(value)) c = value;
  }
  return rounded;
}

// E of every image alone, [m][receiver].
std::vector<std::vector<double>> ImageIrradiances(const LightField& field,
                                                  const std::vector<Receiver>& receivers) {
  std::vector<std::vector<double>> e;
  const auto& grid = field.geometry.grid;
  FieldPart image = FieldPart::All(field.geometry);
  for (int m = 0; m < grid.count(); ++m) {
    const int i = m % grid.width, j = m / grid.width;
    image.i = {i, i + 1};
    image.j = {j, j + 1};
    e.push_back(Irradiances(Crop(field, image), receivers));
  }
  return e;
}

// Carries the reduction from step to step.
class Reducer {
 public:
  Reducer(const LightField& field, const std::vector<Receiver>& receivers, double max_rel_error)
      : field_(field),
        receivers_(receivers),
        max_rel_error_(max_rel_error),
        truth_(Irradiances(field, receivers)) {
    if (!(std::accumulate(truth_.begin(), truth_.end(), 0.0) > 0))
      throw InputError(
          "no surface in the picture gets light of this luminaire; check its place and direction "
          "in the scene, and the camera");
    Note("as given", "");
  }

  void CropStep(const SeenRectangle& seen) {
    field_ = CropToSeen(field_, seen);
    Note("crop", fmt::format("{} x {} texels", field_.geometry.lattice.width,
                             field_.geometry.lattice.height));
  }

  void MergeStep() {
    std::vector<double> z;
    for (const auto& receiver : receivers_) z.push_back(receiver.p.z);
    std::nth_element(z.begin(), z.begin() + std::ptrdiff_t(z.size() / 2), z.end());
    const double tau = field_.geometry.delta_m / z[z.size() / 2];
    if (!Try(Merge(field_, std::nullopt, tau), kMergeShare))
      for (const double factor : kMergeFactors)
        if (Try(Merge(field_, factor, tau), kMergeShare)) break;
    Note("merge",
         fmt::format("{} x {} images", field_.geometry.grid.width, field_.geometry.grid.height));
  }

  void PoolStep() {
    int pooled = 1;
    for (const int k : kPoolFactors)
      if (k < std::max(field_.geometry.lattice.width, field_.geometry.lattice.height) &&
          Try(Pool(field_, k), kPoolShare)) {
        pooled = k;
        break;
      }
    Note("pool", fmt::format("{} x {} texels", pooled, pooled));
  }

  void DropStep() {
    const auto e = ImageIrradiances(field_, receivers_);
    std::vector<int> order(e.size());
    std::iota(order.begin(), order.end(), 0);
    std::vector<double> weights(e.size());
    for (std::size_t m = 0; m < e.size(); ++m)
      weights[m] = std::inner_product(e[m].begin(), e[m].end(), e[m].begin(), 0.0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return weights[a] < weights[b]; });
    auto left = Irradiances(field_, receivers_);
    int dropped = 0;
    for (const int m : order) {
      for (std::size_t k = 0; k < left.size(); ++k) left[k] -= e[m][k];
      if (Compare(left, truth_).relative > kDropShare * max_rel_error_) break;
      for (int channel = 0; channel < field_.geometry.channels; ++channel)
        std::fill(field_.image(m, channel).begin(), field_.image(m, channel).end(), 0.0f);
      ++dropped;
    }
    Note("drop", fmt::format("{} images", dropped));
  }

  void RoundStep() {
    int bits = 23;
    for (int k = 3; k < 23; ++k)
      if (Try(Round(field_, k), kRoundShare)) {
        bits = k;
        break;
      }
    Note("round", fmt::format("mantissa of {} bits", bits));
  }

  LightField& field() { return field_; }
  std::vector<ReductionStep>& steps() { return steps_; }

 private:
  bool Try(std::optional<LightField> candidate, double share) {
    if (!candidate) return false;
    if (Compare(Irradiances(*candidate, receivers_), truth_).relative > share * max_rel_error_)
      return false;
    field_ = std::move(*candidate);
    return true;
  }

  void Note(const std::string& name, const std::string& setting) {
    const auto& g = field_.geometry;
    ReductionStep step;
    step.name = name;
    step.setting = setting;
    step.grid_width = g.grid.width;
    step.grid_height = g.grid.height;
    step.width = g.lattice.width;
    step.height = g.lattice.height;
    for (int m = 0; m < g.grid.count(); ++m) step.images += IsDark(field_, m) ? 0 : 1;
    step.bytes = 4.0 * static_cast<double>(g.value_count()) +
                 8.0 * g.grid.count() * (g.lattice.width + 1.0) * (g.lattice.height + 1.0);
    step.rel_error = Compare(Irradiances(field_, receivers_), truth_).relative;
    for (const auto& receiver : receivers_)
      step.texels_per_receiver +=
          TexelsSeen(g, receiver.p) / static_cast<double>(receivers_.size());
    steps_.push_back(step);
  }

  LightField field_;
  const std::vector<Receiver>& receivers_;
  double max_rel_error_;
  std::vector<double> truth_;
  std::vector<ReductionStep> steps_;
};

}  // namespace

Reduction ReduceLightField(const LightField& field, const SeenRectangle& seen,
                           const std::vector<Receiver>& chosen_by,
                           const std::vector<Receiver>& judged_by, double max_rel_error) {
  if (!(max_rel_error >= 1e-5 && max_rel_error <= 1))
    throw InputError(
        fmt::format("a largest error of {:g} % cannot be asked for; give 0.001 % to "
                    "100 %",
                    100 * max_rel_error));
  if (chosen_by.empty() || judged_by.empty())
    throw InputError(
        "the picture shows no surface in front of the luminaire; check its place and "
        "direction in the scene, and the camera");
  const core::Stopwatch stopwatch;
  const auto truth = Irradiances(field, judged_by);
  Reduction reduction;
  // The settings are chosen by one sample of receivers and judged by another: where the second one
  // says that the first was too kind, a stricter target is tried.
  for (double target = max_rel_error;; target *= 0.7) {
    Reducer reducer(field, chosen_by, target);
    reducer.CropStep(seen);
    reducer.MergeStep();
    reducer.PoolStep();
    reducer.DropStep();
    reducer.RoundStep();
    const auto e = Irradiances(reducer.field(), judged_by);
    const Error error = Compare(e, truth);
    if (error.bound > max_rel_error && target > 0.05 * max_rel_error) continue;
    reduction.field = std::move(reducer.field());
    reduction.steps = std::move(reducer.steps());
    reduction.measured_error = error.relative;
    reduction.error_bound = error.bound;
    break;
  }
  reduction.core_s = stopwatch.CoreSeconds();
  reduction.core_s_per_receiver_before = CoreSecondsPerReceiver(field, judged_by);
  reduction.core_s_per_receiver_after = CoreSecondsPerReceiver(reduction.field, judged_by);
  return reduction;
}

}  // namespace luxfield::preprocess
