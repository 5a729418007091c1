#include "luxfield/planning/traced_lamp.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"

namespace luxfield::planning {
namespace {

using lightfield::Dot;
using lightfield::LightField;
using lightfield::Vec2;
using lightfield::Vec3;

// Random numbers of different uses.
enum Stream : std::uint64_t {
  kFields = 0x6669656C6473,
  kFilters = 0x66696C74657273,
  kFlux = 0x666C7578
};

Rectangle SupportsOf(const lightfield::BasisGrid& grid) {
  return {grid.u0_m, grid.u0_m + (grid.width + grid.basis.cells - 1) * grid.spacing_m, grid.v0_m,
          grid.v0_m + (grid.height + grid.basis.cells - 1) * grid.spacing_m};
}

Rectangle Around(const Rectangle& a, const Rectangle& b) {
  return {std::min(a.x0, b.x0), std::max(a.x1, b.x1), std::min(a.y0, b.y0), std::max(a.y1, b.y1)};
}

Vec2 Within(const Rectangle& r, Vec2 share) {
  return {r.x0 + share.x * (r.x1 - r.x0), r.y0 + share.y * (r.y1 - r.y0)};
}

double AreaOf(const Rectangle& r) { return (r.x1 - r.x0) * (r.y1 - r.y0); }

double FractionOf(double x) { return x - std::floor(x); }

Vec2 Shift(core::Random& random) {
  const double x = random.Uniform();
  return {x, random.Uniform()};
}

// Sums of a comparison, in whose squares a and b stand for the truth.
struct Sums {
  double square = 0, truth = 0, power = 0;

  void Add(double value, double a, double b) {
    square += (value - a) * (value - b);
    truth += 0.5 * (a + b);
    power += a * b;
  }
  Sums& operator+=(const Sums& other) {
    square += other.square;
    truth += other.truth;
    power += other.power;
    return *this;
  }
  StageError Error(double count) const {
    const double least = std::max(square, 0.0);
    return {std::sqrt(least / count) / (truth / count), std::sqrt(least / power)};
  }
};

// Adds the field's flux density at u over a row of texels, [channel * width + column].
void AddRow(const LightField& field, Vec2 u, int row, std::vector<double>* density) {
  const auto& [grid, lattice] = std::tie(field.geometry.grid, field.geometry.lattice);
  const auto width = static_cast<std::size_t>(lattice.width);
  for (int m = 0; m < grid.count(); ++m) {
    const double phi = grid.Phi(m % grid.width, m / grid.width, u);
    if (phi == 0) continue;
    for (int channel = 0; channel < field.geometry.channels; ++channel) {
      const float* texels = field.image(m, channel).data() + static_cast<std::size_t>(row) * width;
      double* out = density->data() + channel * width;
      for (std::size_t k = 0; k < width; ++k) out[k] += phi * texels[k];
    }
  }
}

// use(u, density) for points u of a lattice rule over `region`: the lamp's flux density towards a
// row of texels, [channel * width + column], each time through another place in all of them. Places
// follow a Kronecker sequence from a random start (Niederreiter 1992, "Random number generation and
// quasi-Monte Carlo methods", 3.1).
template <typename Use>
void ForRaysOfRow(const lightfield::Lattice& lattice, int row, const TracedLamp& lamp,
                  const Rectangle& region, int least_points, core::Random& random, const Use& use) {
  const FibonacciLattice points(least_points);
  const auto width = static_cast<std::size_t>(lattice.width);
  std::vector<double> s(width), density(width * static_cast<std::size_t>(lamp.channels()));
  const Vec2 shift = Shift(random), start = Shift(random);
  for (int k = 0; k < points.size(); ++k) {
    const Vec2 u = Within(region, points.Point(k, shift)),
               place{FractionOf(start.x + k * std::sqrt(2.0)),
                     FractionOf(start.y + k * std::sqrt(3.0))};
    for (std::size_t column = 0; column < width; ++column)
      s[column] = lattice.s_of_column(static_cast<double>(column) + place.x);
    lamp.FluxDensity(u, lattice.t_of_row(row + place.y), s, density);
    use(u, density);
  }
}

}  // namespace

FibonacciLattice::FibonacciLattice(int least) : size_(1), step_(1) {
  while (size_ < least) {
    const int next = size_ + step_;
    step_ = size_;
    size_ = next;
  }
}

Vec2 FibonacciLattice::Point(int k, Vec2 shift) const {
  return {FractionOf(shift.x + static_cast<double>(k) / size_),
          FractionOf(shift.y + static_cast<double>(std::int64_t{k} * step_ % size_) / size_)};
}

TracedLamp::TracedLamp(const hal::sim::LabDescription& lab,
                       const lightfield::LuminaireGeometry& geometry)
    : lamp_(lab.lamp), delta_m_(geometry.delta_m), channels_(lab.channels) {
  const Rectangle supports = SupportsOf(geometry.grid);
  const double du = 0.5 * (supports.x1 - supports.x0), dv = 0.5 * (supports.y1 - supports.y0);
  lit_ = {supports.x0 - du, supports.x1 + du, supports.y0 - dv, supports.y1 + dv};
  for (int look = 0; look < 2; ++look)  // the second is finer
    lit_ = LitRectangle(*lamp_, delta_m_, lit_, geometry.lattice);
}

void TracedLamp::FluxDensity(Vec2 u, double t_m, std::span<const double> s_m,
                             std::span<double> density) const {
  const std::size_t count = s_m.size();
  const bool apart = lamp_->traced_channels() > 1;
  if (lamp_->DarkAt(u)) {
    std::fill(density.begin(), density.end(), 0.0);
    return;
  }
  lamp_->Radiance(u, delta_m_, t_m, s_m, density.first(count * lamp_->traced_channels()));
  const double delta2 = delta_m_ * delta_m_, dy = t_m - u.y;
  for (std::size_t k = 0; k < count; ++k) {
    const double dx = s_m[k] - u.x, r2 = delta2 + dx * dx + dy * dy, share = delta2 / (r2 * r2),
                 first = density[k];
    for (int channel = 0; channel < channels_; ++channel) {
      const double radiance = apart ? density[channel * count + k] : first;
      density[channel * count + k] = share * radiance * lamp_->channel_factor(channel);
    }
  }
}

TracedLamp::Light TracedLamp::Irradiance(const preprocess::Receiver& receiver,
                                         const FibonacciLattice& points, Vec2 shift,
                                         const std::function<bool(Vec2)>& visible) const {
  Light light;
  const auto& [p, n] = receiver;
  if (!(p.z > 0)) return light;
  const double k_s = delta_m_ / p.z;
  for (int k = 0; k < points.size(); ++k) {
    const Vec2 u = Within(lit_, points.Point(k, shift));
    const Vec3 way = Vec3{u.x, u.y, 0} - p;
    const double towards = Dot(n, way);
    if (!(towards > 0) || lamp_->DarkAt(u)) continue;
    double radiance[3] = {};
    const double s = u.x - k_s * way.x, t = u.y - k_s * way.y;
    lamp_->Radiance(u, delta_m_, t, std::span(&s, 1),
                    std::span(radiance, lamp_->traced_channels()));
    if (radiance[0] == 0 && radiance[1] == 0 && radiance[2] == 0) continue;
    const double r2 = Dot(way, way), weight = towards * p.z / (r2 * r2);
    const bool seen = visible(u);
    for (int channel = 0; channel < channels_; ++channel) {
      const double e = weight * radiance[lamp_->traced_channels() > 1 ? channel : 0];
      light.open[channel] += e;
      if (seen) light.seen[channel] += e;
    }
  }
  for (auto* sums : {&light.open, &light.seen})
    for (int channel = 0; channel < 3; ++channel)
      (*sums)[channel] = channel < channels_ ? (*sums)[channel] * lamp_->channel_factor(channel) *
                                                   AreaOf(lit_) / points.size()
                                             : (*sums)[0];
  return light;
}

TracedFlux FluxThrough(const lightfield::Lattice& lattice, const TracedLamp& lamp,
                       std::uint64_t seed) {
  constexpr int kPoints = 987;
  const auto width = static_cast<std::size_t>(lattice.width);
  std::vector<std::array<core::Rgb, 2>> rows(static_cast<std::size_t>(lattice.height));
  core::ParallelFor(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      core::Random random(seed, kFlux, static_cast<std::uint32_t>(r));
      rows[r] = {};
      for (core::Rgb& flux : rows[r])
        ForRaysOfRow(lattice, static_cast<int>(r), lamp, lamp.lit(), kPoints, random,
                     [&](Vec2, const std::vector<double>& density) {
                       for (std::size_t v = 0; v < density.size(); ++v)
                         flux[v / width] += density[v];
                     });
    }
  });
  const double of_ray =
      AreaOf(lamp.lit()) * lattice.texel_area_m2() / FibonacciLattice(kPoints).size();
  TracedFlux result;
  double variance = 0;
  for (const auto& row : rows) {
    double flux[2];
    for (int half = 0; half < 2; ++half)
      flux[half] = of_ray * (lamp.channels() == 1 ? row[half][0] : core::Luminance(row[half]));
    result.value += 0.5 * (flux[0] + flux[1]);
    variance += 0.25 * (flux[0] - flux[1]) * (flux[0] - flux[1]);
  }
  result.standard_error = std::sqrt(variance);
  return result;
}

std::vector<StageError> CompareWithLamp(const std::vector<const LightField*>& fields,
                                        const TracedLamp& lamp, std::uint64_t seed) {
  constexpr int kPoints = 377;
  const auto& lattice = fields.at(0)->geometry.lattice;
  Rectangle region = lamp.lit();
  for (const LightField* field : fields) {
    if (!(field->geometry.lattice == lattice) || field->geometry.channels != lamp.channels())
      throw InputError("light fields of different lattices or channels are not compared together");
    region = Around(region, SupportsOf(field->geometry.grid));
  }
  std::vector<std::vector<Sums>> rows(static_cast<std::size_t>(lattice.height));
  core::ParallelFor(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<double> of_field;
    for (std::size_t r = begin; r < end; ++r) {
      core::Random random(seed, kFields, static_cast<std::uint32_t>(r));
      rows[r].resize(fields.size());
      ForRaysOfRow(lattice, static_cast<int>(r), lamp, region, kPoints, random,
                   [&](Vec2 u, const std::vector<double>& truth) {
                     for (std::size_t f = 0; f < fields.size(); ++f) {
                       of_field.assign(truth.size(), 0.0);
                       AddRow(*fields[f], u, static_cast<int>(r), &of_field);
                       for (std::size_t v = 0; v < truth.size(); ++v)
                         rows[r][f].Add(of_field[v], truth[v], truth[v]);
                     }
                   });
    }
  });
  std::vector<StageError> errors;
  const double count = static_cast<double>(FibonacciLattice(kPoints).size()) * lattice.width *
                       lattice.height * lamp.channels();
  for (std::size_t f = 0; f < fields.size(); ++f) {
    Sums sums;
    for (const auto& row : rows) sums += row[f];
    errors.push_back(sums.Error(count));
  }
  return errors;
}

lightfield::Measurements IdealMeasurements(const lightfield::LuminaireGeometry& geometry,
                                           const std::vector<std::vector<float>>& traced,
                                           const hal::sim::Lamp& lamp) {
  lightfield::Measurements measurements;
  measurements.geometry = geometry;
  const std::size_t plane = geometry.plane_size();
  for (const auto& image : traced) {
    auto& position = measurements.positions.emplace_back();
    position.sigma.assign(plane * geometry.channels, 0.0f);
    position.count.assign(plane, 1.0f);
    position.mask.assign(plane, 0);
    for (int channel = 0; channel < geometry.channels; ++channel) {
      const float* from = image.data() + (lamp.traced_channels() > 1 ? channel * plane : 0);
      const auto factor = static_cast<float>(lamp.channel_factor(channel));
      std::transform(from, from + plane, std::back_inserter(position.irradiance),
                     [factor](float value) { return factor * value; });
    }
  }
  return measurements;
}

double LuminousFlux(const LightField& field) {
  const auto flux = TotalFlux(field);
  return field.geometry.channels == 1 ? flux[0] : core::Luminance(flux);
}

StageError IrradianceAgainstLamp(const lightfield::Measurements& measurements,
                                 const TracedLamp& lamp, int texels, std::uint64_t seed) {
  const auto& [grid, lattice] = std::tie(measurements.geometry.grid, measurements.geometry.lattice);
  const int channels = measurements.geometry.channels;
  const std::size_t plane = measurements.geometry.plane_size();
  const bool dual = measurements.filter == lightfield::FilterKind::kDual;
  const FibonacciLattice points(377);
  const double half = 0.5 * grid.basis.cells;
  const auto filter = [&](double x) {  // x from the middle, in spacings
    return dual ? grid.basis.DualValue(x) : grid.basis.Value(x + half);
  };
  std::vector<Sums> of_texel(static_cast<std::size_t>(texels));
  std::vector<char> known(of_texel.size());
  core::ParallelFor(of_texel.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      core::Random random(seed, kFilters, static_cast<std::uint32_t>(n));
      const auto m = std::min(static_cast<int>(random.Uniform() * grid.count()), grid.count() - 1);
      const auto texel =
          std::min(static_cast<std::size_t>(random.Uniform() * double(plane)), plane - 1);
      const auto& position = measurements.positions[static_cast<std::size_t>(m)];
      if (position.mask[texel] & lightfield::kUnknownMask) continue;
      known[n] = 1;
      const auto row = static_cast<double>(texel / lattice.width),
                 column = static_cast<double>(texel % lattice.width);
      const Vec2 centre = grid.centre(m % grid.width, m / grid.width);
      std::array<std::array<double, 3>, 2> truth{};
      for (auto& e : truth) {
        const Vec2 shift = Shift(random);
        for (int k = 0; k < points.size(); ++k) {
          const Vec2 share = points.Point(k, shift),
                     x{2 * half * (share.x - 0.5), 2 * half * (share.y - 0.5)},
                     within = Shift(random);
          const double s = lattice.s_of_column(column + within.x);
          double density[3] = {};
          lamp.FluxDensity(centre + grid.spacing_m * x, lattice.t_of_row(row + within.y),
                           std::span(&s, 1), std::span(density, 3));
          const double area = std::pow(2 * half * grid.spacing_m, 2) / points.size();
          for (int channel = 0; channel < channels; ++channel)
            e[channel] += density[channel] * filter(x.x) * filter(x.y) * area;
        }
      }
      for (int channel = 0; channel < channels; ++channel)
        of_texel[n].Add(position.irradiance[channel * plane + texel], truth[0][channel],
                        truth[1][channel]);
    }
  });
  Sums sums;
  double count = 0;
  for (std::size_t n = 0; n < of_texel.size(); ++n) {
    sums += of_texel[n];
    count += known[n] ? channels : 0;
  }
  return sums.Error(count);
}

}  // namespace luxfield::planning
