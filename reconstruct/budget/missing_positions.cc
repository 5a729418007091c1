#include "luxfield/reconstruct/budget/missing_positions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/missing_data.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::BasisGrid;
using lightfield::LightField;
using lightfield::Measurements;
using lightfield::Weights;

using Known = std::vector<bool>;     // per filter
using Values = std::vector<double>;  // per filter

// The system A of one texel that knows all positions.
class System {
 public:
  System(const Measurements& measurements, const FilterSystem* system)
      : grid_(measurements.geometry.grid) {
    if (system)
      dense_ = system->Dense();
    else if (measurements.filter == lightfield::FilterKind::kBasis)
      gram_.emplace(grid_);
  }

  // A x, A^T x.
  Values Forward(const Values& x) const { return Times(x, false); }
  Values Transposed(const Values& x) const { return Times(x, true); }

  // P A 1 and the diagonal of P A.
  std::pair<Values, Values> Projection(const Known& known) const {
    const std::size_t count = known.size();
    if (dense_.empty() && !gram_) {
      const Values of_known(known.begin(), known.end());
      return {of_known, of_known};
    }
    const PixelWeights p = gram_ ? MinimumNormWeights(GramSystem(*gram_), known).Dense()
                                 : MinimumNorm(dense_, static_cast<int>(count), known);
    const Values seen = Forward(Values(count, 1.0));
    Values ones(count), diagonal(count);
    for (std::size_t m = 0; m < count; ++m) {
      for (std::size_t k = 0; k < p.known.size(); ++k)
        ones[m] += p.weights[m * p.known.size() + k] * seen[static_cast<std::size_t>(p.known[k])];
      diagonal[m] = 1 - p.prior_share[m];
    }
    return {ones, diagonal};
  }

 private:
  Values Times(const Values& x, bool transposed) const {
    Values out(x.size());
    if (gram_) {  // symmetric
      gram_->Forward(x.data(), out.data());
    } else if (dense_.empty()) {
      for (std::size_t m = 0; m < x.size(); ++m) out[m] = grid_.spacing_m * grid_.spacing_m * x[m];
    } else {
      for (std::size_t r = 0; r < x.size(); ++r)
        for (std::size_t m = 0; m < x.size(); ++m)
          (transposed ? out[m] : out[r]) += dense_[r * x.size() + m] * (transposed ? x[r] : x[m]);
    }
    return out;
  }

  const BasisGrid& grid_;
  std::optional<GramSolver> gram_;
  std::vector<double> dense_;
};

// Coefficients of one texel, as far as they are determined.
struct Texel {
  Values c, ones, diagonal;  // C, P A 1, diag(P A)
};

struct Usual {
  double mean = 0, deviation = 0, of_mean = 0;  // of_mean: the mean's own standard deviation
};

// What the filters within `reach` of (i, j) say.
template <typename Weight>
std::optional<Usual> UsualBy(const BasisGrid& grid, const Texel& texel, int i, int j, int reach,
                             const Weight& weight) {
  constexpr double kEnough = 0.1;  // coefficients
  double sum = 0, sum2 = 0, hc = 0, hh = 0, cc = 0, determined = 0;
  for (int b = std::max(0, j - reach); b < std::min(grid.height, j + reach + 1); ++b)
    for (int a = std::max(0, i - reach); a < std::min(grid.width, i + reach + 1); ++a) {
      const auto k = static_cast<std::size_t>(grid.index(a, b));
      const double v = weight((a - i) * (a - i) + (b - j) * (b - j)), c = texel.c[k],
                   h = texel.ones[k];
      sum += v;
      sum2 += v * v;
      hc += v * h * c;
      hh += v * h * h;
      cc += v * c * c;
      determined += v * texel.diagonal[k];
    }
  if (!(determined > kEnough && hh > 0)) return {};
  Usual usual;
  usual.mean = hc / hh;
  const double share = sum2 / (sum * sum);  // 1 / n
  if (share < 1)
    usual.deviation = std::sqrt(std::max(0.0, cc - usual.mean * hc) / ((1 - share) * determined));
  usual.of_mean = std::sqrt(share) * usual.deviation;
  return usual;
}

// At filter m: by what is near, or by all alike.
Usual UsualAt(const BasisGrid& grid, int m, const Texel& texel) {
  constexpr int kReach = 3;
  const int i = m % grid.width, j = m / grid.width;
  const auto near = UsualBy(grid, texel, i, j, kReach, [](int d2) { return std::exp(-0.5 * d2); });
  return near ? *near
              : UsualBy(grid, texel, i, j, grid.count(), [](int) { return 1.0; }).value_or(Usual{});
}

// Sums over texels and channels of what a quantity takes of the unknown.
struct Sums {
  double mean = 0, of_mean = 0;
  Values deviation;  // per filter

  void Add(std::size_t m, double r, const Usual& usual) {
    mean += r * usual.mean;
    of_mean += r * usual.of_mean;
    deviation[m] += r * usual.deviation;
  }
  double Sigma() const {
    double squares = mean * mean + of_mean * of_mean;
    for (const double d : deviation) squares += d * d;
    return std::sqrt(squares);
  }
};

// One texel's part of what is laid out as LightField::data.
template <typename Data>
Values PartAt(const Data& data, const lightfield::LuminaireGeometry& g, int channel,
              std::size_t texel) {
  Values values;
  for (int m = 0; m < g.grid.count(); ++m)
    values.push_back(
        data[(static_cast<std::size_t>(m) * g.channels + channel) * g.plane_size() + texel]);
  return values;
}

// Means over the texels that know a filter.
Texel MeanTexel(const Measurements& measurements, const LightField& field, int channel) {
  Texel mean;
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    const auto image = field.image(m, channel);
    const auto& mask = measurements.positions[static_cast<std::size_t>(m)].mask;
    double sum = 0, count = 0;
    for (std::size_t p = 0; p < image.size(); ++p)
      if (!(mask[p] & lightfield::kUnknownMask)) {
        sum += image[p];
        ++count;
      }
    mean.c.push_back(count > 0 ? sum / count : 0);
    mean.ones.push_back(count > 0 ? 1 : 0);
  }
  mean.diagonal = mean.ones;
  return mean;
}

struct Group {  // of texels that know the same positions, but not all
  Values ones, diagonal;
  bool knows_nothing = false;
  std::vector<std::size_t> texels;
};

std::vector<Group> Groups(const Measurements& measurements, const System& system) {
  std::map<Known, Group> groups;
  for (std::size_t p = 0; p < measurements.geometry.plane_size(); ++p) {
    Known known;
    for (const auto& position : measurements.positions)
      known.push_back(!(position.mask[p] & lightfield::kUnknownMask));
    if (std::find(known.begin(), known.end(), false) != known.end())
      groups[known].texels.push_back(p);
  }
  std::vector<Group> all;
  for (auto& [known, group] : groups) {
    std::tie(group.ones, group.diagonal) = system.Projection(known);
    group.knows_nothing = std::find(known.begin(), known.end(), true) == known.end();
    all.push_back(std::move(group));
  }
  return all;
}

}  // namespace

std::vector<double> MissingSigmas(const Measurements& measurements, const LightField& field,
                                  std::span<const Weights* const> coefficient_weights,
                                  std::span<const Weights* const> irradiance_weights,
                                  const FilterSystem* system) {
  const auto& g = measurements.geometry;
  const System a(measurements, system);
  const std::vector<Group> groups = Groups(measurements, a);
  const std::size_t quantities = coefficient_weights.size();
  if (quantities == 0) return {};
  std::vector<Sums> sums(quantities, Sums{0, 0, Values(static_cast<std::size_t>(g.grid.count()))});
  for (int channel = 0; channel < g.channels; ++channel) {
    const Texel others = MeanTexel(measurements, field, channel);
    for (const Group& group : groups)
      for (const std::size_t p : group.texels) {
        const Texel texel = group.knows_nothing ? others
                                                : Texel{PartAt(field.data, g, channel, p),
                                                        group.ones, group.diagonal};
        std::vector<std::optional<Usual>> usual(sums[0].deviation.size());
        for (std::size_t q = 0; q < quantities; ++q) {
          const Values asked = PartAt(*coefficient_weights[q], g, channel, p);
          if (std::all_of(asked.begin(), asked.end(), [](double x) { return x == 0; })) continue;
          const Values seen = a.Transposed(PartAt(*irradiance_weights[q], g, channel, p));
          for (std::size_t m = 0; m < asked.size(); ++m) {
            if (asked[m] == seen[m]) continue;
            if (!usual[m]) usual[m] = UsualAt(g.grid, static_cast<int>(m), texel);
            sums[q].Add(m, asked[m] - seen[m], *usual[m]);
          }
        }
      }
  }
  std::vector<double> sigmas;
  for (const Sums& sum : sums) sigmas.push_back(sum.Sigma());
  return sigmas;
}

}  // namespace luxfield::reconstruct
