#include "luxfield/reconstruct/solve/irradiance_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/simd.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisGrid;
using lightfield::LightField;

// Gauss-Legendre on [0, 1] (Abramowitz, Stegun 1964, table 25.4).
constexpr int kPlanes = 6;
constexpr std::array<double, kPlanes> kSlope{0.033765242898424, 0.169395306766868,
                                             0.380690406958402, 0.619309593041598,
                                             0.830604693233132, 0.966234757101576};
constexpr std::array<double, kPlanes> kWeight{0.085662246189585, 0.180380786524069,
                                              0.233956967286346, 0.233956967286346,
                                              0.180380786524069, 0.085662246189585};

// What the texel `first` + t from a line's has of one function of an axis: the integral of B over
// the part of the line within it, in units of h.
struct Taps {
  int first = 0;
  std::vector<float> weight;
};

// The lines of one axis: taps of every plane and function, and the texels before and behind the
// lattice whose lines reach into it.
struct Axis {
  int functions = 0, texels = 0;
  int before = 0, extended = 0;
  std::vector<Taps> taps;    // [plane][function]
  std::vector<double> gram;  // G / h

  const Taps& Of(int plane, int function) const {
    return taps[static_cast<std::size_t>(plane) * functions + function];
  }
};

// u from u0_m; `step_m` is the width of a texel, below 0 where texels run against the axis.
Axis MakeAxis(const lightfield::Basis& basis, int functions, double u0_m, double spacing_m,
              int texels, double step_m) {
  Axis axis;
  axis.functions = functions;
  axis.texels = texels;
  axis.gram = lightfield::GramMatrix(basis, functions, 1.0);
  int least = 0, most = 0;
  for (const double slope : kSlope)
    for (int i = 0; i < functions; ++i) {
      // Texels from the line's own to where it crosses the support's ends.
      const double scale = slope / step_m, low = (u0_m + i * spacing_m) * scale,
                   high = (u0_m + (i + basis.cells) * spacing_m) * scale;
      Taps taps;
      taps.first = static_cast<int>(std::floor(std::min(low, high) + 0.5));
      const int last = static_cast<int>(std::floor(std::max(low, high) + 0.5));
      for (int t = taps.first; t <= last; ++t) {
        const auto x = [&](double edge) { return (edge / scale - u0_m) / spacing_m - i; };
        const auto [x0, x1] = std::minmax({x(t - 0.5), x(t + 0.5)});
        taps.weight.push_back(static_cast<float>(basis.Integral(x0, x1)));
      }
      least = std::min(least, taps.first);
      most = std::max(most, last);
      axis.taps.push_back(std::move(taps));
    }
  axis.before = most;
  axis.extended = texels + most - least;
  return axis;
}

LUXFIELD_SIMD_CLONES void AddTimes(float factor, const float* in, int count, float* out) {
  LUXFIELD_INDEPENDENT
  for (int x = 0; x < count; ++x) out[x] += factor * in[x];
}

// The thresholds t with sum_m max(moved_m - t, 0) = flux, pixel by pixel: Newton's method on a
// convex piecewise linear function, from below its root on without overshooting. moved[m][x].
LUXFIELD_SIMD_CLONES void FindThresholds(const float* moved, int images, int pixels,
                                         const float* flux, float* threshold, float* sum,
                                         float* above) {
  constexpr int kMaxSteps = 40;
  constexpr float kNear = 1e-4f;  // before a step, which leaves the square of that or nothing
  for (int step = 0; step < kMaxSteps; ++step) {
    std::fill(sum, sum + pixels, 0.0f);
    std::fill(above, above + pixels, 0.0f);
    for (int m = 0; m < images; ++m) {
      const float* row = moved + static_cast<std::size_t>(m) * pixels;
      LUXFIELD_INDEPENDENT
      for (int x = 0; x < pixels; ++x) {
        const float over = row[x] - threshold[x];
        sum[x] += over > 0 ? over : 0.0f;
        above[x] += over > 0 ? 1.0f : 0.0f;
      }
    }
    bool far = false;
    for (int x = 0; x < pixels; ++x) {
      if (!(flux[x] > 0)) continue;
      if (above[x] > 0) {
        far |= !(std::abs(sum[x] - flux[x]) <= kNear * flux[x]);
        threshold[x] += (sum[x] - flux[x]) / above[x];
      } else {  // to where one entry could hold all
        float largest = moved[x];
        for (int m = 1; m < images; ++m)
          largest = std::max(largest, moved[static_cast<std::size_t>(m) * pixels + x]);
        threshold[x] = largest - flux[x];
        far = true;
      }
    }
    if (!far) return;
  }
}

// One channel. All arrays of images are [m][row][column].
class Solver {
 public:
  Solver(const LightField& field, int channel, const IrradianceMetricOptions& options)
      : width_(field.geometry.lattice.width),
        height_(field.geometry.lattice.height),
        weight_(options.field_weight) {
    const auto& [basis, columns, rows, u0_m, v0_m, spacing_m] = field.geometry.grid;
    const auto& lattice = field.geometry.lattice;
    u_ = MakeAxis(basis, columns, u0_m, spacing_m, width_, lattice.ds_m);
    v_ = MakeAxis(basis, rows, v0_m, spacing_m, height_, -lattice.dt_m);
    for (int m = 0; m < Images(); ++m) start_.push_back(field.image(m, channel));
    const GramSolver gram(field.geometry.grid);
    const double h2 = spacing_m * spacing_m, integral = basis.TotalIntegral();
    // |L_b|^2 is at most the sum over the images of their whole weights' squares.
    largest_ = Images() * std::pow(integral, 4) +
               weight_ * gram.u().largest_eigenvalue * gram.v().largest_eigenvalue / h2;
    diagonal_ = (1 + weight_) * basis.Gram(0) * basis.Gram(0);
    now_.resize(start_.size() * Plane());
    flux_.resize(Plane());
    threshold_.resize(Plane());
    for (std::size_t p = 0; p < Plane(); ++p) {
      double sum = 0;
      for (const auto& image : start_) sum += image[p];
      flux_[p] = static_cast<float>(sum);
    }
    along_u_.resize(static_cast<std::size_t>(kPlanes) * v_.functions * height_ * u_.extended);
    seen_.resize(static_cast<std::size_t>(kPlanes) * v_.extended * u_.extended);
  }

  NonNegativeSummary Run(const IrradianceMetricOptions& options, double scale) {
    core::ParallelFor(height_, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) ProjectStart(static_cast<int>(row));
    });
    before_ = now_;
    NonNegativeSummary summary;
    double momentum = 0, theta = 1;
    while (summary.iterations < options.max_iterations) {
      core::ThrowIfInterrupted();
      const auto [step, uphill] = Step(static_cast<float>(momentum));
      ++summary.iterations;
      summary.worst_residual = step * largest_ / (diagonal_ * scale);
      if (summary.worst_residual <= options.tolerance) break;
      // Uphill, the momentum is spent.
      const double last = uphill ? 1 : theta;
      theta = 0.5 * (1 + std::sqrt(1 + 4 * last * last));
      momentum = (last - 1) / theta;
    }
    return summary;
  }

  // C, with the flux that rounding left it without.
  void Store(int channel, LightField* field) {
    core::ParallelFor(Plane(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        double wanted = 0, found = 0;
        for (int m = 0; m < Images(); ++m) {
          wanted += start_[m][p];
          found += now_[m * Plane() + p];
        }
        const double factor = wanted > 0 && found > 0 ? wanted / found : 0;
        for (int m = 0; m < Images(); ++m)
          field->image(m, channel)[p] = static_cast<float>(factor * now_[m * Plane() + p]);
      }
    });
  }

 private:
  struct Progress {
    double step = 0;      // max |y - C|
    bool uphill = false;  // (y - C) . (C - C before) > 0
  };
  // Of one thread.
  struct Scratch {
    std::vector<float> difference, gradient, moved, along, sum, above;
  };

  int Images() const { return u_.functions * v_.functions; }
  std::size_t Plane() const { return static_cast<std::size_t>(width_) * height_; }
  float* Now(int m, int row) { return now_.data() + m * Plane() + row * width_; }
  float* Before(int m, int row) { return before_.data() + m * Plane() + row * width_; }
  float* AlongU(int plane, int j, int row) {
    return along_u_.data() +
           ((static_cast<std::size_t>(plane) * v_.functions + j) * height_ + row) * u_.extended;
  }
  float* Seen(int plane, int row) {
    return seen_.data() + (static_cast<std::size_t>(plane) * v_.extended + row) * u_.extended;
  }

  // C = P(C_0) of a row.
  void ProjectStart(int row) {
    Scratch work;
    work.moved.resize(static_cast<std::size_t>(Images()) * width_);
    for (int m = 0; m < Images(); ++m)
      std::copy_n(start_[m].data() + static_cast<std::size_t>(row) * width_, width_,
                  work.moved.data() + static_cast<std::size_t>(m) * width_);
    Project(row, &work);
  }

  // C = P(moved) of a row.
  void Project(int row, Scratch* work) {
    work->sum.resize(width_);
    work->above.resize(width_);
    const float* flux = flux_.data() + static_cast<std::size_t>(row) * width_;
    float* threshold = threshold_.data() + static_cast<std::size_t>(row) * width_;
    FindThresholds(work->moved.data(), Images(), width_, flux, threshold, work->sum.data(),
                   work->above.data());
    for (int m = 0; m < Images(); ++m) {
      const float* moved = work->moved.data() + static_cast<std::size_t>(m) * width_;
      float* c = Now(m, row);
      for (int x = 0; x < width_; ++x)
        c[x] = flux[x] > 0 ? std::max(moved[x] - threshold[x], 0.0f) : 0.0f;
    }
  }

  // y = C + momentum (C - C before), C before = C, C = P(y - gradient / largest eigenvalue).
  Progress Step(float momentum) {
    core::ParallelFor(height_, 1, [&](std::size_t begin, std::size_t end) {
      std::vector<float> difference(static_cast<std::size_t>(width_));
      for (std::size_t row = begin; row < end; ++row)
        IntegrateAlongU(static_cast<int>(row), momentum, &difference);
    });
    core::ParallelFor(static_cast<std::size_t>(kPlanes) * v_.extended, 4,
                      [&](std::size_t begin, std::size_t end) {
                        for (std::size_t k = begin; k < end; ++k)
                          IntegrateAlongV(static_cast<int>(k) / v_.extended,
                                          static_cast<int>(k) % v_.extended);
                      });
    std::vector<double> moved(height_), uphill(height_);
    core::ParallelFor(height_, 1, [&](std::size_t begin, std::size_t end) {
      Scratch work;
      for (std::size_t row = begin; row < end; ++row)
        StepRow(static_cast<int>(row), momentum, &work, &moved[row], &uphill[row]);
    });
    Progress progress;
    double along = 0;
    for (int row = 0; row < height_; ++row) {
      progress.step = std::max(progress.step, moved[row]);
      along += uphill[row];
    }
    progress.uphill = along > 0;
    return progress;
  }

  // y - C_0 of an image's row.
  void Difference(int m, int row, float momentum, float* difference) {
    const float *now = Now(m, row), *before = Before(m, row),
                *start = start_[m].data() + static_cast<std::size_t>(row) * width_;
    for (int x = 0; x < width_; ++x)
      difference[x] = now[x] + momentum * (now[x] - before[x]) - start[x];
  }

  // along_u[plane][j][row][a] = sum_i taps_i difference_ij.
  void IntegrateAlongU(int row, float momentum, std::vector<float>* difference) {
    for (int j = 0; j < v_.functions; ++j) {
      for (int plane = 0; plane < kPlanes; ++plane)
        std::fill_n(AlongU(plane, j, row), u_.extended, 0.0f);
      for (int i = 0; i < u_.functions; ++i) {
        Difference(j * u_.functions + i, row, momentum, difference->data());
        for (int plane = 0; plane < kPlanes; ++plane) {
          const Taps& taps = u_.Of(plane, i);
          // A line through `a` has the texel a + t.
          float* out = AlongU(plane, j, row) + u_.before - taps.first;
          for (std::size_t t = 0; t < taps.weight.size(); ++t)
            AddTimes(taps.weight[t], difference->data(), width_, out - t);
        }
      }
    }
  }

  // seen[plane][b][a] = sum_j taps_j along_u_j: L_b of the difference.
  void IntegrateAlongV(int plane, int line) {
    float* out = Seen(plane, line);
    std::fill_n(out, u_.extended, 0.0f);
    for (int j = 0; j < v_.functions; ++j) {
      const Taps& taps = v_.Of(plane, j);
      for (std::size_t t = 0; t < taps.weight.size(); ++t) {
        const int row = line - v_.before + taps.first + static_cast<int>(t);
        if (row >= 0 && row < height_)
          AddTimes(taps.weight[t], AlongU(plane, j, row), u_.extended, out);
      }
    }
  }

  // Adds the transpose of both, of a row, to work->gradient.
  void AddSeen(int row, Scratch* work) {
    work->along.resize(static_cast<std::size_t>(u_.extended));
    for (int j = 0; j < v_.functions; ++j)
      for (int plane = 0; plane < kPlanes; ++plane) {
        std::fill(work->along.begin(), work->along.end(), 0.0f);
        const Taps& of_v = v_.Of(plane, j);
        for (std::size_t t = 0; t < of_v.weight.size(); ++t)
          AddTimes(static_cast<float>(kWeight[plane]) * of_v.weight[t],
                   Seen(plane, row + v_.before - of_v.first - static_cast<int>(t)), u_.extended,
                   work->along.data());
        for (int i = 0; i < u_.functions; ++i) {
          const Taps& taps = u_.Of(plane, i);
          float* out =
              work->gradient.data() + static_cast<std::size_t>(j * u_.functions + i) * width_;
          const float* in = work->along.data() + u_.before - taps.first;
          for (std::size_t t = 0; t < taps.weight.size(); ++t)
            AddTimes(taps.weight[t], in - t, width_, out);
        }
      }
  }

  // Adds weight G / h^2 times the difference, of a row, to work->gradient.
  void AddField(Scratch* work) {
    std::vector<float>& along = work->moved;  // not in use yet
    std::fill(along.begin(), along.end(), 0.0f);
    const int columns = u_.functions, rows = v_.functions;
    constexpr int kBand = lightfield::Basis::kMaxCells - 1;
    const auto at = [&](std::vector<float>& of, int i, int j) {
      return of.data() + static_cast<std::size_t>(j * columns + i) * width_;
    };
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        for (int k = std::max(i - kBand, 0); k <= std::min(i + kBand, columns - 1); ++k)
          AddTimes(static_cast<float>(u_.gram[i * columns + k]), at(work->difference, k, j), width_,
                   at(along, i, j));
    for (int j = 0; j < rows; ++j)
      for (int k = std::max(j - kBand, 0); k <= std::min(j + kBand, rows - 1); ++k)
        for (int i = 0; i < columns; ++i)
          AddTimes(static_cast<float>(weight_ * v_.gram[j * rows + k]), at(along, i, k), width_,
                   at(work->gradient, i, j));
  }

  void StepRow(int row, float momentum, Scratch* work, double* step, double* uphill) {
    const std::size_t size = static_cast<std::size_t>(Images()) * width_;
    work->difference.resize(size);
    work->moved.resize(size);
    work->gradient.assign(size, 0.0f);
    for (int m = 0; m < Images(); ++m)
      Difference(m, row, momentum, work->difference.data() + static_cast<std::size_t>(m) * width_);
    AddSeen(row, work);
    AddField(work);
    const auto rate = static_cast<float>(1 / largest_);
    // y, which C before then makes room for.
    std::vector<float>& point = work->difference;
    for (int m = 0; m < Images(); ++m) {
      const float* start = start_[m].data() + static_cast<std::size_t>(row) * width_;
      for (int x = 0; x < width_; ++x) {
        const std::size_t k = static_cast<std::size_t>(m) * width_ + x;
        point[k] += start[x];
        work->moved[k] = point[k] - rate * work->gradient[k];
      }
      std::copy_n(Now(m, row), width_, Before(m, row));
    }
    Project(row, work);
    double farthest = 0, along = 0;
    for (int m = 0; m < Images(); ++m) {
      const float *now = Now(m, row), *before = Before(m, row);
      for (int x = 0; x < width_; ++x) {
        const double back = point[static_cast<std::size_t>(m) * width_ + x] - now[x];
        farthest = std::max(farthest, std::abs(back));
        along += back * (now[x] - before[x]);
      }
    }
    *step = farthest;
    *uphill = along;
  }

  int width_, height_;
  double weight_, largest_ = 0, diagonal_ = 0;
  Axis u_, v_;
  std::vector<std::span<const float>> start_;  // C_0
  std::vector<float> now_, before_;            // C, C before the last step
  std::vector<float> flux_, threshold_;        // of a texel
  std::vector<float> along_u_;                 // [plane][j][row][a]
  std::vector<float> seen_;                    // [plane][b][a], b and a on the extended lattice
};

}  // namespace

NonNegativeSummary ProjectByIrradiance(const IrradianceMetricOptions& options, LightField* field) {
  if (!(options.field_weight > 0) || !(options.tolerance > 0) || options.max_iterations < 1)
    throw InputError(
        "the irradiance metric needs a weight and a tolerance above 0 and at least one iteration");
  const auto& geometry = field->geometry;
  const int images = geometry.grid.count();
  NonNegativeSummary summary;
  summary.metric = NonNegativeMetric::kIrradiance;
  for (int channel = 0; channel < geometry.channels; ++channel) {
    double scale = 0;
    std::vector<char> negative(geometry.plane_size(), 0);
    for (int m = 0; m < images; ++m) {
      const auto image = field->image(m, channel);
      for (std::size_t p = 0; p < image.size(); ++p) {
        if (!std::isfinite(image[p]))
          throw InputError(fmt::format(
              "coefficient image {} has a value that is not finite; no C >= 0 is near it", m));
        scale = std::max(scale, std::abs(double{image[p]}));
        negative[p] |= image[p] < 0;
      }
    }
    const auto pixels = static_cast<std::size_t>(std::count(negative.begin(), negative.end(), 1));
    if (pixels == 0) continue;
    Solver solver(*field, channel, options);
    const NonNegativeSummary one = solver.Run(options, scale);
    summary.pixels += pixels;
    summary.iterations = std::max(summary.iterations, one.iterations);
    summary.worst_residual = std::max(summary.worst_residual, one.worst_residual);
    if (!(one.worst_residual <= options.tolerance)) summary.unconverged += pixels;
    solver.Store(channel, field);
  }
  return summary;
}

}  // namespace luxfield::reconstruct
