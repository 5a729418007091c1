#include "luxfield/preprocess/sampler.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "luxfield/lightfield/light_vector.h"

namespace luxfield::preprocess {
namespace {

using lightfield::Vec2;
using lightfield::Vec3;

// Windows narrower than this part of a texel are taken to lie in one.
constexpr double kNarrow = 1e-9;

// Texels first .. last - 1 of one axis that an interval meets, and the interval clipped to them.
struct Span {
  int first = 0, last = 0;
  double lo = 0, hi = 0;
  bool point = false;  // no extent: the one texel

  bool empty() const { return first >= last; }
};

Span SpanOf(double origin, double size, int texels) {
  Span span;
  if (std::abs(size) < kNarrow) {
    // On a texel's border the one with the larger column or row.
    const double at = std::floor(origin + 0.5 * size);
    if (!(at >= 0 && at < texels)) return span;
    span.first = static_cast<int>(at);
    span.last = span.first + 1;
    span.point = true;
    return span;
  }
  span.lo = std::max(std::min(origin, origin + size), 0.0);
  span.hi = std::min(std::max(origin, origin + size), double(texels));
  if (!(span.lo < span.hi)) return span;
  span.first = static_cast<int>(std::floor(span.lo));
  span.last = std::min(texels, static_cast<int>(std::ceil(span.hi)));
  return span;
}

// The sums of one cell over rectangles, counted from the first texel of a window so that small
// windows of bright images keep their digits.
class WindowSums {
 public:
  WindowSums(const CellTables& tables, int cell, const Span& columns, const Span& rows)
      : sat_(tables.cell(cell)),
        stride_(static_cast<std::size_t>(tables.width) + 1),
        columns_(columns),
        rows_(rows) {}

  // Of rows first .. r - 1 and columns first .. c - 1, units.
  double Corner(int r, int c) const {
    const auto at = [&](int row, int column) { return sat_[row * stride_ + column]; };
    return static_cast<double>(at(r, c) - at(r, columns_.first) - at(rows_.first, c) +
                               at(rows_.first, columns_.first));
  }
  // One texel.
  double Texel(int r, int c) const {
    const auto at = [&](int row, int column) { return sat_[row * stride_ + column]; };
    return static_cast<double>(at(r + 1, c + 1) - at(r + 1, c) - at(r, c + 1) + at(r, c));
  }
  // Rows of the span (clipped to it), columns first .. c - 1.
  double RowsUpTo(int c) const {
    if (rows_.point) return Corner(rows_.last, c);
    // Of whole rows less what lies outside of the interval at both ends.
    const double above = rows_.lo - rows_.first, below = rows_.last - rows_.hi;
    const double all = Corner(rows_.last, c), top = Corner(rows_.first + 1, c);
    if (rows_.last == rows_.first + 1) return (1 - above - below) * all;
    const double inner = Corner(rows_.last - 1, c);
    return (1 - above) * top + (inner - top) + (1 - below) * (all - inner);
  }
  // Both clipped: the integral over the window, in texels times units.
  double Mass() const {
    if (columns_.point) return RowsUpTo(columns_.last);
    const double left = columns_.lo - columns_.first, right = columns_.last - columns_.hi;
    const double all = RowsUpTo(columns_.last);
    if (columns_.last == columns_.first + 1) return (1 - left - right) * all;
    const double first = RowsUpTo(columns_.first + 1), inner = RowsUpTo(columns_.last - 1);
    return (1 - left) * first + (inner - first) + (1 - right) * (all - inner);
  }
  // Sum of the clipped rows over columns lo .. c, c a column edge within the span.
  double UpToColumn(int c) const {
    if (c <= columns_.first) return 0;
    if (c >= columns_.last) return Mass();
    const double left = columns_.lo - columns_.first, first = RowsUpTo(columns_.first + 1);
    return (1 - left) * first + (RowsUpTo(c) - first);
  }
  // In one column, rows lo .. r, r a row edge within the span.
  double UpToRow(int column, int r) const {
    const auto sum = [&](int row) { return Corner(row, column + 1) - Corner(row, column); };
    if (r <= rows_.first) return 0;
    const double above = rows_.lo - rows_.first, top = sum(rows_.first + 1);
    if (r < rows_.last) return (1 - above) * top + (sum(r) - top);
    const double below = rows_.last - rows_.hi, all = sum(rows_.last);
    if (rows_.last == rows_.first + 1) return (1 - above - below) * all;
    const double inner = sum(rows_.last - 1);
    return (1 - above) * top + (inner - top) + (1 - below) * (all - inner);
  }

 private:
  const std::uint64_t* sat_;
  std::size_t stride_;
  Span columns_, rows_;
};

struct Drawn {
  int texel = 0;
  double place = 0;  // fraction of the way through the cell
};

// The texel of `span` in which `cumulative` passes target, and the place within what is seen of it;
// cumulative(k) is the sum up to the edge k.
template <typename Cumulative>
Drawn Draw(const Span& span, double origin, double size, double target,
           const Cumulative& cumulative) {
  int lo = span.first, hi = span.last;  // the texel lies in [lo, hi)
  while (hi - lo > 1) {
    const int middle = (lo + hi) / 2;
    (cumulative(middle) <= target ? lo : hi) = middle;
  }
  const double before = cumulative(lo), all = cumulative(lo + 1) - before;
  const double part = all > 0 ? (target - before) / all : 0.5;
  const double from = std::max(double(lo), span.lo), to = std::min(lo + 1.0, span.hi);
  const double place = (from + part * (to - from) - origin) / size;
  return {lo, std::clamp(place, 0.0, 1.0)};
}

// E(u -> s) with s in a texel, of the n^2 images whose supports hold the cell.
std::array<double, 3> FluxDensityIn(const lightfield::LightField& field, int a, int b,
                                    Vec2 fraction, int row, int column) {
  const auto& g = field.geometry;
  const int n = g.grid.basis.cells;
  std::array<double, 3> sum{};
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int i = a - x, j = b - y;
      if (i < 0 || i >= g.grid.width || j < 0 || j >= g.grid.height) continue;
      const double phi =
          g.grid.basis.CellValue(x, fraction.x) * g.grid.basis.CellValue(y, fraction.y);
      const std::size_t texel = static_cast<std::size_t>(row) * g.lattice.width + column;
      for (int c = 0; c < g.channels; ++c)
        sum[c] += phi * field.image(g.grid.index(i, j), c)[texel];
    }
  if (g.channels == 1) sum[1] = sum[2] = sum[0];
  return sum;
}

}  // namespace

LightFieldSampler::LightFieldSampler(lightfield::LightField field, const std::string& name)
    : field_(std::move(field)) {
  field_.geometry.Validate(name);
  tables_ = BuildCellTables(field_, name);
}

ReceiverSampler::Window ReceiverSampler::WindowOf(int a, int b) const {
  const auto& g = sampler_->field().geometry;
  const double h = g.grid.spacing_m;
  const Vec2 corner{g.grid.u0_m + a * h, g.grid.v0_m + b * h};
  const Vec3& p = receiver_.p;
  return {g.lattice.column_of_s(tau_ * p.x + (1 - tau_) * corner.x),
          g.lattice.row_of_t(tau_ * p.y + (1 - tau_) * corner.y), (1 - tau_) * h / g.lattice.ds_m,
          -(1 - tau_) * h / g.lattice.dt_m};
}

double ReceiverSampler::CellWeight(int a, int b) const {
  const auto& g = sampler_->field().geometry;
  const double h = g.grid.spacing_m;
  const Vec3 centre{g.grid.u0_m + (a + 0.5) * h, g.grid.v0_m + (b + 0.5) * h, 0};
  const double middle = Dot(receiver_.n, centre - receiver_.p),
               most = middle + 0.5 * h * (std::abs(receiver_.n.x) + std::abs(receiver_.n.y));
  return most > 0 ? std::max(middle, 0.25 * most) : 0;
}

ReceiverSampler::ReceiverSampler(const LightFieldSampler& sampler, const Receiver& receiver)
    : sampler_(&sampler), receiver_(receiver) {
  if (!(receiver.p.z > 0)) return;
  const CellTables& tables = sampler.tables();
  const auto& lattice = sampler.field().geometry.lattice;
  tau_ = sampler.field().geometry.delta_m / receiver.p.z;
  mass_.assign(tables.count(), 0);
  cumulative_.assign(tables.count(), 0);
  double total = 0;
  for (int cell = 0; cell < tables.count(); ++cell) {
    const int a = cell % tables.grid_width, b = cell / tables.grid_width;
    const double weight = CellWeight(a, b);
    if (weight > 0) {
      const Window window = WindowOf(a, b);
      const Span columns = SpanOf(window.x, window.width, lattice.width),
                 rows = SpanOf(window.y, window.height, lattice.height);
      if (!columns.empty() && !rows.empty()) {
        const double sum = WindowSums(tables, cell, columns, rows).Mass(),
                     texels = (columns.point ? 1 : std::abs(window.width)) *
                              (rows.point ? 1 : std::abs(window.height));
        mass_[cell] = std::ldexp(sum / texels, -tables.exponent[cell]);
      }
      total += weight * mass_[cell];
    }
    cumulative_[cell] = total;
  }
  if (!(total > 0)) {
    cumulative_.clear();
    return;
  }
  for (double& sum : cumulative_) sum /= total;
}

// p(f) of the fraction f in one cell: Q over its mean over the cell.
double ReceiverSampler::DensityOverMass(int cell, Vec2 fraction, const Window& window,
                                        double mass) const {
  const CellTables& tables = sampler_->tables();
  const double x = std::abs(window.width) < kNarrow ? window.x + 0.5 * window.width
                                                    : window.x + fraction.x * window.width,
               y = std::abs(window.height) < kNarrow ? window.y + 0.5 * window.height
                                                     : window.y + fraction.y * window.height;
  if (!(x >= 0 && x < tables.width && y >= 0 && y < tables.height)) return 0;
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  return std::ldexp(WindowSums(tables, cell, {}, {}).Texel(row, column), -tables.exponent[cell]) /
         mass;
}

std::optional<LightSample> ReceiverSampler::Sample(Vec2 xi) const {
  if (cumulative_.empty()) return std::nullopt;
  const CellTables& tables = sampler_->tables();
  const auto& g = sampler_->field().geometry;
  // The first cell whose sum passes xi.x; the rest of xi.x draws the column.
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), xi.x);
  int cell = static_cast<int>(found - cumulative_.begin());
  while (cell == tables.count() || !(mass_[cell] > 0)) --cell;  // xi.x rounded to 1
  const double before = cell > 0 ? cumulative_[cell - 1] : 0, chosen = cumulative_[cell] - before;
  const double rest = std::clamp((xi.x - before) / chosen, 0.0, 1.0);

  const int a = cell % tables.grid_width, b = cell / tables.grid_width;
  const Window window = WindowOf(a, b);
  const Span columns = SpanOf(window.x, window.width, g.lattice.width),
             rows = SpanOf(window.y, window.height, g.lattice.height);
  const WindowSums sums(tables, cell, columns, rows);
  Drawn column{columns.first, rest}, row{rows.first, xi.y};
  if (!columns.point)
    column = Draw(columns, window.x, window.width, rest * sums.Mass(),
                  [&](int c) { return sums.UpToColumn(c); });
  if (!rows.point)
    row = Draw(rows, window.y, window.height, xi.y * sums.UpToRow(column.texel, rows.last),
               [&](int r) { return sums.UpToRow(column.texel, r); });

  LightSample sample;
  const Vec2 fraction{column.place, row.place};
  const double h = g.grid.spacing_m;
  sample.u = {g.grid.u0_m + (a + fraction.x) * h, g.grid.v0_m + (b + fraction.y) * h};
  const Vec3& p = receiver_.p;
  sample.s = {tau_ * p.x + (1 - tau_) * sample.u.x, tau_ * p.y + (1 - tau_) * sample.u.y};
  const Vec3 to_light{sample.u.x - p.x, sample.u.y - p.y, -p.z};
  const double r = Length(to_light);
  sample.distance_m = r;
  sample.direction = (1 / r) * to_light;
  const double density = chosen *
                         std::ldexp(sums.Texel(row.texel, column.texel), -tables.exponent[cell]) /
                         mass_[cell] / (h * h);
  sample.pdf = density * r * r * r / p.z;
  // cos = p.z / r along the ray.
  const double scale = std::pow(r / p.z, 4) * g.delta_m * g.delta_m,
               cosine = std::max(Dot(receiver_.n, sample.direction), 0.0);
  const auto e = FluxDensityIn(sampler_->field(), a, b, fraction, row.texel, column.texel);
  for (int c = 0; c < 3; ++c) {
    sample.radiance[c] = scale * e[c];
    sample.weight[c] = sample.radiance[c] * cosine / sample.pdf;
  }
  return sample;
}

double ReceiverSampler::Pdf(Vec3 direction) const {
  if (cumulative_.empty() || !(direction.z < 0)) return 0;
  const CellTables& tables = sampler_->tables();
  const auto& g = sampler_->field().geometry;
  const Vec3& p = receiver_.p;
  const double h = g.grid.spacing_m, along = -p.z / direction.z;
  const double x = (p.x + along * direction.x - g.grid.u0_m) / h,
               y = (p.y + along * direction.y - g.grid.v0_m) / h;
  if (!(x >= 0 && x < tables.grid_width && y >= 0 && y < tables.grid_height)) return 0;
  const int a = static_cast<int>(x), b = static_cast<int>(y), cell = b * tables.grid_width + a;
  if (!(mass_[cell] > 0)) return 0;
  const double chosen = cumulative_[cell] - (cell > 0 ? cumulative_[cell - 1] : 0);
  const double r = along * Length(direction);
  return chosen * DensityOverMass(cell, {x - a, y - b}, WindowOf(a, b), mass_[cell]) / (h * h) *
         (r * r * r) / p.z;
}

std::array<double, 3> ReceiverSampler::Radiance(Vec3 direction) const {
  const Vec3& p = receiver_.p;
  if (!(p.z > 0) || !(direction.z < 0)) return {};
  const double along = -p.z / direction.z, tau = sampler_->field().geometry.delta_m / p.z;
  const Vec2 u{p.x + along * direction.x, p.y + along * direction.y};
  return lightfield::Radiance(sampler_->field(), u,
                              {tau * p.x + (1 - tau) * u.x, tau * p.y + (1 - tau) * u.y});
}

std::array<double, 3> ReceiverSampler::Irradiance() const {
  return lightfield::ExactIrradiance(sampler_->field(), receiver_.p, receiver_.n);
}

}  // namespace luxfield::preprocess
