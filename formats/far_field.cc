#include "luxfield/formats/far_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/linear_functional.h"

namespace luxfield::formats {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::Vec3;

constexpr double kMostInterpolationError = 1e-3, kMostFluxError = 1e-4;
constexpr double kFirstPlaneStep = 5, kFirstAngleStep = 1;
constexpr double kLeastPlaneStep = 1.25, kLeastAngleStep = 0.25;

// Luminance of one image's integral over I.
double SumOfImage(const LightField& field, int m) {
  std::array<double, 3> sum{};
  const int channels = field.geometry.channels;
  for (int channel = 0; channel < channels; ++channel)
    for (const float c : field.image(m, channel)) sum[std::size_t(channel)] += c;
  return channels == 1 ? sum[0] : core::Luminance(sum);
}

// Corners of basis function (i, j)'s support, in the luminaire's frame.
std::array<Vec3, 4> CornersOf(const PosedLightField& posed, int i, int j) {
  const auto& grid = posed.field.geometry.grid;
  const double u = grid.u0_m + i * grid.spacing_m, v = grid.v0_m + j * grid.spacing_m;
  const double size = grid.basis.cells * grid.spacing_m;
  const auto at = [&](double x, double y) { return posed.luminaire_from_field.Point({x, y, 0}); };
  return {at(u, v), at(u + size, v), at(u, v + size), at(u + size, v + size)};
}

struct Box {
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void Add(Vec3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
};

Box BoxOfLight(std::span<const PosedLightField> fields) {
  constexpr double kShare = 1e-3;
  std::vector<std::vector<double>> flux;
  double most = 0;
  for (const auto& [name, pose, field] : fields) {
    const auto& g = field.geometry;
    const double one = g.lattice.texel_area_m2() * g.grid.PhiIntegral();
    flux.emplace_back();
    for (int m = 0; m < g.grid.count(); ++m) flux.back().push_back(one * SumOfImage(field, m));
    most = std::max(most, *std::max_element(flux.back().begin(), flux.back().end()));
  }
  Box box;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const auto& grid = fields[k].field.geometry.grid;
    for (int j = 0; j < grid.height; ++j)
      for (int i = 0; i < grid.width; ++i)
        if (flux[k][std::size_t(grid.index(i, j))] > kShare * most)
          for (const Vec3 corner : CornersOf(fields[k], i, j)) box.Add(corner);
  }
  return box;
}

// Number of steps in 90 degrees, next to the one given, that are whole thousandths of a degree.
int StepsInQuarter(double step) {
  const auto wanted = static_cast<int>(std::max(1L, std::lround(90 / step)));
  for (int off = 0;; ++off)
    for (const int steps : {wanted - off, wanted + off})
      if (steps > 0 && 90000 % steps == 0) return steps;
}

// 0, step, ...
std::vector<double> EvenAngles(double last, double step, bool with_last) {
  const int per_quarter = StepsInQuarter(step);
  const int count = per_quarter * static_cast<int>(std::lround(last / 90));
  std::vector<double> list;
  for (int k = 0; k < count + with_last; ++k) list.push_back(last * k / count);
  return list;
}

bool ShinesBackward(std::span<const PosedLightField> fields, bool near) {
  return std::any_of(fields.begin(), fields.end(), [&](const auto& posed) {
    const auto& pose = posed.luminaire_from_field;
    // Seen from nearby, light of a filter plane behind the origin crosses the plane z = 0 there.
    return pose.Direction({0, 0, 1}).z < 1 - 1e-9 || (near && pose.translation_m.z < 0);
  });
}

// What the table is sampled from.
struct Source {
  std::span<const PosedLightField> fields;
  std::optional<double> distance_m;

  double At(double plane_deg, double angle_deg) const {
    const bool pole = angle_deg == 0 || angle_deg == 180;  // one direction in all planes
    return IntensityOf(fields, Direction(PhotometryType::kC, pole ? 0 : plane_deg, angle_deg),
                       distance_m);
  }

  // Of all angles in all planes, [plane][angle].
  std::vector<double> Table(const std::vector<double>& planes,
                            const std::vector<double>& angles) const {
    std::vector<double> values(planes.size() * angles.size());
    core::ParallelFor(values.size(), 64, [&](std::size_t begin, std::size_t end) {
      core::ThrowIfInterrupted();
      for (std::size_t k = begin; k < end; ++k)
        values[k] = At(planes[k / angles.size()], angles[k % angles.size()]);
    });
    return values;
  }
};

// A table of half the step, and how far off the middles of the old one's intervals are.
struct Halved {
  Photometry table;
  double error = 0;  // cd
};

Halved HalvedAngles(const Photometry& p, const Source& source) {
  std::vector<double> middles;
  for (std::size_t j = 0; j + 1 < p.angles_deg.size(); ++j)
    middles.push_back((p.angles_deg[j] + p.angles_deg[j + 1]) / 2);
  const std::vector<double> between = source.Table(p.planes_deg, middles);
  Halved halved{p, 0};
  std::vector<double>&angles = halved.table.angles_deg, &values = halved.table.intensity_cd;
  angles.clear();
  values.clear();
  for (std::size_t j = 0; j < p.angles_deg.size(); ++j) {
    angles.push_back(p.angles_deg[j]);
    if (j < middles.size()) angles.push_back(middles[j]);
  }
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j) {
      values.push_back(p.at(k, j));
      if (j == middles.size()) continue;
      const double middle = between[k * middles.size() + j];
      halved.error = std::max(halved.error, std::abs(middle - (p.at(k, j) + p.at(k, j + 1)) / 2));
      values.push_back(middle);
    }
  return halved;
}

Halved HalvedPlanes(const Photometry& p, const Source& source) {
  const std::size_t planes = p.planes_deg.size(), angles = p.angles_deg.size();
  std::vector<double> middles;
  for (std::size_t k = 0; k < planes; ++k)
    middles.push_back((p.planes_deg[k] + (k + 1 < planes ? p.planes_deg[k + 1] : 360)) / 2);
  const std::vector<double> between = source.Table(middles, p.angles_deg);
  Halved halved{p, 0};
  halved.table.planes_deg.clear();
  halved.table.intensity_cd.clear();
  for (std::size_t k = 0; k < planes; ++k) {
    halved.table.planes_deg.insert(halved.table.planes_deg.end(), {p.planes_deg[k], middles[k]});
    for (std::size_t j = 0; j < angles; ++j) halved.table.intensity_cd.push_back(p.at(k, j));
    for (std::size_t j = 0; j < angles; ++j) {
      const double middle = between[k * angles + j];
      halved.error =
          std::max(halved.error, std::abs(middle - (p.at(k, j) + p.at((k + 1) % planes, j)) / 2));
      halved.table.intensity_cd.push_back(middle);
    }
  }
  return halved;
}

// Text of the keyword _UNIT; empty for lm.
std::string UnitKeyword(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kWatt:
      return "intensities are in W/sr";
    case lightfield::FluxUnit::kRelative:
      return "intensities are relative";
    default:
      return "";
  }
}

void AddKeywords(Photometry& p, std::span<const PosedLightField> fields, const Box& box,
                 std::optional<double> distance_m) {
  p.keywords = {{"TEST", "computed from a light field"}};
  if (distance_m)
    p.keywords.emplace_back("NEARFIELD", fmt::format("{0:.6g} {0:.6g} {0:.6g}", *distance_m));
  const Vec3 middle = 500.0 * (box.low + box.high);
  if (lightfield::Length(middle) > 1e-6)
    p.keywords.emplace_back(
        "_OPENING_MIDDLE",
        fmt::format("{:.6g} {:.6g} {:.6g} mm along C0, C270 and nadir from the photometric centre",
                    middle.x, middle.y, middle.z));
  const auto& first = fields.front().field;
  if (const std::string unit = UnitKeyword(first.geometry.unit); !unit.empty())
    p.keywords.emplace_back("_UNIT", unit);
  for (const auto& [key, value] : first.provenance) p.keywords.emplace_back("_" + key, value);
}

}  // namespace

std::vector<PosedLightField> LuminanceOf(std::span<const PosedLightField> fields) {
  std::vector<PosedLightField> out;
  for (const auto& posed : fields) {
    if (posed.field.geometry.channels == 1) {
      out.push_back(posed);
      continue;
    }
    lightfield::LuminaireGeometry g = posed.field.geometry;
    g.channels = 1;
    LightField field(g);
    field.provenance = posed.field.provenance;
    for (int m = 0; m < g.grid.count(); ++m) {
      const auto r = posed.field.image(m, 0), green = posed.field.image(m, 1),
                 b = posed.field.image(m, 2);
      const auto y = field.image(m, 0);
      for (std::size_t k = 0; k < y.size(); ++k)
        y[k] = static_cast<float>(core::Luminance({r[k], green[k], b[k]}));
    }
    out.push_back({posed.name, posed.luminaire_from_field, std::move(field)});
  }
  return out;
}

double IntensityOf(std::span<const PosedLightField> fields, Vec3 direction,
                   std::optional<double> distance_m) {
  if (!distance_m) return core::Luminance(lightfield::FarFieldIntensity(fields, direction));
  double sum = 0;
  for (const auto& posed : fields) {
    const lightfield::RigidPose field_from_luminaire = posed.luminaire_from_field.Inverse();
    sum += core::Luminance(lightfield::ExactIrradiance(
        posed.field, field_from_luminaire.Point(*distance_m * direction),
        field_from_luminaire.Direction(-1.0 * direction)));
  }
  return sum * *distance_m * *distance_m;
}

double ReachOfSupports(std::span<const PosedLightField> fields) {
  double reach = 0;
  for (const auto& posed : fields) {
    const auto& grid = posed.field.geometry.grid;
    for (const int i : {0, grid.width - 1})
      for (const int j : {0, grid.height - 1})
        for (const Vec3 corner : CornersOf(posed, i, j))
          reach = std::max(reach, lightfield::Length(corner));
  }
  return reach;
}

FarField SampleFarField(std::span<const PosedLightField> fields, const FarFieldSteps& steps,
                        std::optional<double> distance_m, const std::string& file) {
  if (distance_m && !(*distance_m > ReachOfSupports(fields)))
    throw InputError(
        file,
        fmt::format("the lamp reaches {:.4g} m from its origin, beyond a distance of {:.4g} m",
                    ReachOfSupports(fields), *distance_m),
        "give a larger distance");
  const double flux = core::Luminance(lightfield::TotalFlux(fields));
  if (!(flux > 0)) throw InputError(file, "has no light to export", "name a lamp that shines");
  const Source source{fields, distance_m};
  FarField found;
  Photometry& p = found.table;
  p.format = "light field";
  p.absolute = true;
  p.planes_deg = EvenAngles(360, steps.plane_deg.value_or(kFirstPlaneStep), false);
  p.angles_deg = EvenAngles(ShinesBackward(fields, distance_m.has_value()) ? 180 : 90,
                            steps.angle_deg.value_or(kFirstAngleStep), true);
  p.intensity_cd = source.Table(p.planes_deg, p.angles_deg);

  const auto step = [](const std::vector<double>& list) { return list[1] - list[0]; };
  const auto flux_error = [&] { return Flux(p) / flux - 1; };
  Halved planes = HalvedPlanes(p, source), angles = HalvedAngles(p, source);
  while (true) {
    const double peak = FindPeak(p).intensity_cd;
    if (!(peak > 0)) throw InputError(file, "has no light to export", "name a lamp that shines");
    found.plane_error = planes.error / peak;
    found.angle_error = angles.error / peak;
    found.flux_error = flux_error();
    const bool flux_is_off = std::abs(found.flux_error) > kMostFluxError;
    const auto finer = [&](bool given, double error, double other, double now, double least) {
      // Where only the flux is off, the axis whose interpolation is worse.
      const bool off = error > kMostInterpolationError || (flux_is_off && error >= other);
      return !given && off && now / 2 >= least - 1e-9;
    };
    if (finer(steps.angle_deg.has_value(), found.angle_error, found.plane_error, step(p.angles_deg),
              kLeastAngleStep)) {
      p = std::move(angles.table);
    } else if (finer(steps.plane_deg.has_value(), found.plane_error, found.angle_error,
                     step(p.planes_deg), kLeastPlaneStep)) {
      p = std::move(planes.table);
    } else {
      break;
    }
    planes = HalvedPlanes(p, source);
    angles = HalvedAngles(p, source);
  }
  const Box box = BoxOfLight(fields);
  p.opening = {Opening::Shape::kBox, box.high.x - box.low.x, box.high.y - box.low.y,
               box.high.z - box.low.z};
  found.opening_middle_m = 0.5 * (box.low + box.high);
  AddKeywords(p, fields, box, distance_m);
  return found;
}

lightfield::FluxUnit FluxUnitOf(const Photometry& table) {
  for (const auto unit : {lightfield::FluxUnit::kWatt, lightfield::FluxUnit::kRelative})
    if (table.keyword("_UNIT") == UnitKeyword(unit)) return unit;
  return lightfield::FluxUnit::kLumen;
}

FarFieldUncertainty PropagateSigma(std::span<const PosedLightField> fields,
                                   std::span<const PosedLightField> sigma, const Photometry& table,
                                   std::optional<double> distance_m, const std::string& file) {
  bool same = fields.size() == sigma.size();
  for (std::size_t k = 0; same && k < fields.size(); ++k)
    same = fields[k].field.geometry == sigma[k].field.geometry &&
           fields[k].luminaire_from_field == sigma[k].luminaire_from_field;
  if (!same)
    throw InputError(file, "is not of the light field's geometry",
                     "name the sigma that was written with it");
  const Peak peak = FindPeak(table);
  const Vec3 direction = Direction(PhotometryType::kC, peak.plane_deg, peak.angle_deg);
  const auto variance = [](const lightfield::Weights& weights, const LightField& s) {
    double sum = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const double part = weights[k] * s.data[k];
      sum += part * part;
    }
    return sum;
  };
  double flux = 0, intensity = 0;
  for (const auto& posed : sigma) {
    const auto& g = posed.field.geometry;
    flux += variance(lightfield::FluxWeights(g), posed.field);
    const auto field_from_luminaire = posed.luminaire_from_field.Inverse();
    const Vec3 d = field_from_luminaire.Direction(direction);
    if (!distance_m) {
      intensity += variance(lightfield::IntensityWeights(g, d), posed.field);
      continue;
    }
    const Vec3 p = field_from_luminaire.Point(*distance_m * direction);
    if (!(p.z > 0)) continue;
    const double square = *distance_m * *distance_m;
    intensity +=
        square * square * variance(lightfield::IrradianceWeights(g, p, -1.0 * d), posed.field);
  }
  return {std::sqrt(flux), std::sqrt(intensity)};
}

}  // namespace luxfield::formats
