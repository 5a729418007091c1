#include "luxfield/reconstruct/budget/stage_sensitivity.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/reconstruct/bracket/mosaic_sites.h"
#include "luxfield/reconstruct/merge/filter_profile.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Lattice;
using lightfield::Vec2;

// (value[ahead] - value[behind]) per_m: a texel's slope from its neighbours, one-sided or 0 where
// they are not known.
struct Difference {
  std::size_t ahead = 0, behind = 0;
  double per_m = 0;
};

template <typename Known>
Difference Across(const Lattice& lattice, int row, int column, int dr, int dc, double step_m,
                  Known&& known) {
  const auto there = [&](int sign) {
    const int r = row + sign * dr, c = column + sign * dc;
    return r >= 0 && r < lattice.height && c >= 0 && c < lattice.width && known(r, c);
  };
  const auto at = [&](int steps) {
    return static_cast<std::size_t>(row + steps * dr) * lattice.width + column + steps * dc;
  };
  const int ahead = there(1), behind = there(-1);
  return {at(ahead), at(-behind), ahead + behind ? 1 / ((ahead + behind) * step_m) : 0};
}

// Light of one channel behind the filter at `centre`, and what it changes by per metre of the
// filter alone along u and v. Of a pair the positive print is in place: T is positive where both
// factors have one sign.
struct ImageBehindFilter {
  std::vector<double> e, du, dv;
};

ImageBehindFilter BehindFilter(const lightfield::LightField& coefficients,
                               lightfield::FilterKind filter, int channel, Vec2 centre) {
  const auto& grid = coefficients.geometry.grid;
  const FilterProfile profile(filter, grid.basis);
  constexpr double kStep = 1e-4;  // spacings
  const std::size_t texels = coefficients.geometry.plane_size();
  ImageBehindFilter image{std::vector<double>(texels), std::vector<double>(texels),
                          std::vector<double>(texels)};
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const Vec2 off = (1 / grid.spacing_m) * (grid.centre(i, j) - centre);
      double g = 0, gu = 0, gv = 0;
      for (const double sign : {1.0, -1.0}) {
        const auto part = [&](double x) { return profile.PartOverlap(sign, x); };
        const auto slope = [&](double x) {
          return -(part(x + kStep) - part(x - kStep)) / (2 * kStep * grid.spacing_m);
        };
        g += part(off.x) * part(off.y);
        gu += slope(off.x) * part(off.y);
        gv += part(off.x) * slope(off.y);
      }
      if (g == 0 && gu == 0 && gv == 0) continue;
      const auto c = coefficients.image(grid.index(i, j), channel);
      for (std::size_t k = 0; k < texels; ++k) {
        image.e[k] += g * c[k];
        image.du[k] += gu * c[k];
        image.dv[k] += gv * c[k];
      }
    }
  return image;
}

}  // namespace

ImageChange ChangeOfImage(const lightfield::Measurements& measurements,
                          const lightfield::Weights& weights, int m,
                          std::span<const Vec2> displacement_m) {
  const auto& geometry = measurements.geometry;
  const Lattice& lattice = geometry.lattice;
  const auto& position = measurements.positions[m];
  const auto known = [&](int row, int column) {
    return !(position.mask[static_cast<std::size_t>(row) * lattice.width + column] &
             lightfield::kUnknownMask);
  };
  // The change as weights of E, so that its noise is known too.
  std::vector<double> change(geometry.plane_size());
  ImageChange result;
  for (int channel = 0; channel < geometry.channels; ++channel) {
    const double* w = weights.data() + (static_cast<std::size_t>(m) * geometry.channels + channel) *
                                           geometry.plane_size();
    std::fill(change.begin(), change.end(), 0.0);
    for (int row = 0; row < lattice.height; ++row)
      for (int column = 0; column < lattice.width; ++column) {
        const std::size_t k = static_cast<std::size_t>(row) * lattice.width + column;
        if (w[k] == 0) continue;
        const auto add = [&](const Difference& d, double by_m) {
          change[d.ahead] += w[k] * d.per_m * by_m;
          change[d.behind] -= w[k] * d.per_m * by_m;
        };
        add(Across(lattice, row, column, 0, 1, lattice.ds_m, known), displacement_m[k].x);
        add(Across(lattice, row, column, -1, 0, lattice.dt_m, known), displacement_m[k].y);
      }
    for (std::size_t k = 0; k < change.size(); ++k) {
      const double sigma = change[k] * position.sigma[channel * change.size() + k];
      result.value += change[k] * position.irradiance[channel * change.size() + k];
      result.variance += sigma * sigma;
    }
  }
  return result;
}

ImageSlope ImageSensitivity(const lightfield::Measurements& measurements,
                            const lightfield::Weights& weights, int m) {
  const std::size_t texels = measurements.geometry.plane_size();
  const ImageChange s = ChangeOfImage(measurements, weights, m, std::vector<Vec2>(texels, {1, 0})),
                    t = ChangeOfImage(measurements, weights, m, std::vector<Vec2>(texels, {0, 1}));
  return {{s.value, t.value}, {s.variance, t.variance}};
}

Vec2 ReferenceSensitivity(const lightfield::LightField& coefficients, const SessionPlan& plan,
                          const MergedReference& reference) {
  const Lattice& lattice = coefficients.geometry.lattice;
  const rig::SensorModel& sensor = plan.sensor;
  const Vec2 centre{reference.record->stage_u_m, reference.record->stage_v_m};
  // Of a colour mosaic all channels, else the frame's own.
  std::vector<ImageBehindFilter> images;
  if (sensor.cfa.empty())
    images.push_back(BehindFilter(coefficients, plan.filter, reference.record->channel, centre));
  else
    for (int channel = 0; channel < coefficients.geometry.channels; ++channel)
      images.push_back(BehindFilter(coefficients, plan.filter, channel, centre));
  double signal = 0;
  Vec2 change;
  for (const std::size_t pixel : *reference.pixels) {
    const auto x = static_cast<double>(pixel % sensor.width) + 0.5,
               y = static_cast<double>(pixel / sensor.width) + 0.5;
    const Vec2 s = centre + plan.image_from_sensor.Map({x, y});
    const double column = std::floor(lattice.column_of_s(s.x)),
                 row = std::floor(lattice.row_of_t(s.y));
    if (!(column >= 0 && column < lattice.width && row >= 0 && row < lattice.height)) continue;
    const auto k = static_cast<std::size_t>(row * lattice.width + column);
    const int seen = sensor.cfa.empty() ? 0 : ChannelOfPixel(sensor, pixel);
    const auto& [e, du, dv] = images[seen];
    const double v = (sensor.vignetting.empty() ? 1 : sensor.vignetting[pixel]) *
                     sensor.responsivity_e_per_s_per_w_m2[seen];
    signal += v * e[k];
    const auto slope = [&, &e = e](int dr, int dc, double step_m) {
      const Difference d = Across(lattice, static_cast<int>(row), static_cast<int>(column), dr, dc,
                                  step_m, [](int, int) { return true; });
      return (e[d.ahead] - e[d.behind]) * d.per_m;
    };
    change =
        change + v * Vec2{du[k] + slope(0, 1, lattice.ds_m), dv[k] + slope(-1, 0, lattice.dt_m)};
  }
  return signal > 0 ? (1 / signal) * change : Vec2{};
}

}  // namespace luxfield::reconstruct
