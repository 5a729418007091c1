#include "luxfield/bench/bench_classical.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/lightfield/light_vector.h"

namespace luxfield::bench {
namespace {

using formats::Photometry;
using lightfield::LightField;
using lightfield::Vec3;

constexpr int kAlong = 64, kAcross = 24;  // nodes of an extent along x and y
constexpr double kLitShare = 0.1;         // of the peak intensity

// A rectangle in the plane z = 0 or one parallel to it; of no width, a line or a point.
struct Rectangle {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;

  Vec3 At(double x, double y) const { return {std::lerp(x0, x1, x), std::lerp(y0, y1, y), 0}; }
};

struct Lamp {
  std::string name;
  LightField field;
  Photometry far_field;
  Rectangle opening;
};

// Illuminance of a receiver that faces the lamp, open and behind the edge.
struct Illuminance {
  double open = 0, edge = 0;
};

struct Receiver {
  Vec3 p;
  double weight = 1;  // area that it stands for
};

// Sums from(u) over the midpoints of an extent, in light per area; and its part past the edge
// half way at x = edge_x: (u + p) / 2 lies beyond it.
template <typename From>
Illuminance Sum(const Rectangle& extent, Vec3 p, double edge_x, const From& from) {
  const int columns = extent.x1 > extent.x0 ? kAlong : 1,
            rows = extent.y1 > extent.y0 ? kAcross : 1;
  const double width = (extent.x1 - extent.x0) / columns;
  Illuminance sum;
  for (int i = 0; i < columns; ++i) {
    const double u = extent.At((i + 0.5) / columns, 0).x, past = u + p.x - 2 * edge_x;
    const double visible =
        width > 0 ? std::clamp(past / width + 0.5, 0.0, 1.0) : static_cast<double>(past > 0);
    for (int j = 0; j < rows; ++j) {
      const double light =
          from(extent.At((i + 0.5) / columns, (j + 0.5) / rows)) / (double{1} * columns * rows);
      sum.open += light;
      sum.edge += visible * light;
    }
  }
  return sum;
}

// Of a classical light.
Illuminance OfModel(const Photometry& far_field, const Rectangle& extent, Vec3 p, double edge_x) {
  return Sum(extent, p, edge_x, [&](Vec3 u) {
    const Vec3 away = p - u;
    const double square = Dot(away, away);
    return formats::Intensity(far_field, away) * away.z / (square * std::sqrt(square));
  });
}

// Of the light field: the closed form, and the share of it that passes the edge.
Illuminance OfField(const LightField& field, const Rectangle& supports, Vec3 p, double edge_x) {
  const double open = core::Luminance(lightfield::ExactIrradiance(field, p, {0, 0, -1}));
  const Illuminance sum = Sum(supports, p, edge_x, [&](Vec3 u) {
    const double part = field.geometry.delta_m / p.z;
    const Vec3 away = p - u;
    const double square = Dot(away, away);
    return core::Luminance(lightfield::Radiance(
               field, {u.x, u.y}, {std::lerp(u.x, p.x, part), std::lerp(u.y, p.y, part)})) *
           away.z * away.z / (square * square);
  });
  return {open, sum.open != 0 ? open * sum.edge / sum.open : 0};
}

Rectangle SupportsOf(const LightField& field) {
  const auto& grid = field.geometry.grid;
  const double cells = grid.basis.cells - 1;
  return {grid.u0_m, grid.u0_m + (grid.width + cells) * grid.spacing_m, grid.v0_m,
          grid.v0_m + (grid.height + cells) * grid.spacing_m};
}

Lamp ReadLamp(const std::filesystem::path& file) {
  auto fields = lightfield::ReadLightFields(file);
  if (fields.size() != 1 || !fields.front().name.empty())
    throw InputError(file.string(), "holds light fields of several planes",
                     "name one of a single filter plane");
  const auto found = formats::SampleFarField(fields, {}, {}, file.string());
  const Vec3 middle = found.opening_middle_m;
  const double x = found.table.opening.c0_m / 2, y = found.table.opening.c90_m / 2;
  std::string name = file.filename().string();
  return {name.substr(0, name.find('.')),
          std::move(fields.front().field),
          found.table,
          {middle.x - x, middle.x + x, middle.y - y, middle.y + y}};
}

// Tangents of the directions that the lamp shines in.
Rectangle LitTangents(const Photometry& far_field) {
  const double least = kLitShare * formats::FindPeak(far_field).intensity_cd;
  Rectangle lit{1e9, -1e9, 1e9, -1e9};
  for (std::size_t plane = 0; plane < far_field.planes_deg.size(); ++plane)
    for (std::size_t angle = 0; angle < far_field.angles_deg.size(); ++angle) {
      const Vec3 d = formats::Direction(far_field.type, far_field.planes_deg[plane],
                                        far_field.angles_deg[angle]);
      if (far_field.at(plane, angle) < least || d.z < 0.1) continue;
      lit.x0 = std::min(lit.x0, d.x / d.z);
      lit.x1 = std::max(lit.x1, d.x / d.z);
      lit.y0 = std::min(lit.y0, d.y / d.z);
      lit.y1 = std::max(lit.y1, d.y / d.z);
    }
  return lit;
}

// Of three strips of the plane, before, in and behind the edge's half shadow, which is as wide as
// the supports.
std::vector<Receiver> ReceiversAt(const Lamp& lamp, double distance_m, int count) {
  const Rectangle tangents = LitTangents(lamp.far_field), supports = SupportsOf(lamp.field);
  const Rectangle plane{
      lamp.opening.x0 + distance_m * tangents.x0, lamp.opening.x1 + distance_m * tangents.x1,
      lamp.opening.y0 + distance_m * tangents.y0, lamp.opening.y1 + distance_m * tangents.y1};
  const double edge_x = (lamp.opening.x0 + lamp.opening.x1) / 2;
  const double borders[] = {plane.x0, std::clamp(2 * edge_x - supports.x1, plane.x0, plane.x1),
                            std::clamp(2 * edge_x - supports.x0, plane.x0, plane.x1), plane.x1};
  std::vector<Receiver> receivers;
  for (int strip = 0; strip < 3; ++strip) {
    const Rectangle part{borders[strip], borders[strip + 1], plane.y0, plane.y1};
    if (!(part.x1 > part.x0)) continue;
    const int columns = std::max(1, count / 2);
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < count; ++j) {
        Vec3 p = part.At((i + 0.5) / columns, (j + 0.5) / count);
        p.z = distance_m;
        receivers.push_back({p, (part.x1 - part.x0) / columns});
      }
  }
  return receivers;
}

struct Model {
  std::string name;
  Rectangle extent;
};

std::vector<Model> ModelsOf(const Rectangle& opening) {
  const Vec3 middle = opening.At(0.5, 0.5);
  const Rectangle point{middle.x, middle.x, middle.y, middle.y};
  Rectangle line = point;
  if (opening.x1 - opening.x0 >= opening.y1 - opening.y0) {
    line.x0 = opening.x0;
    line.x1 = opening.x1;
  } else {
    line.y0 = opening.y0;
    line.y1 = opening.y1;
  }
  return {{"point", point}, {"linear", line}, {"area", opening}};
}

// Of the models, in their order, open and behind the edge.
std::vector<Illuminance> ErrorsAt(const Lamp& lamp, const std::vector<Model>& models,
                                  double distance_m, int count) {
  const std::vector<Receiver> receivers = ReceiversAt(lamp, distance_m, count);
  const Rectangle supports = SupportsOf(lamp.field);
  const double edge_x = (lamp.opening.x0 + lamp.opening.x1) / 2;
  std::vector<Illuminance> truth(receivers.size()), of_models(receivers.size() * models.size());
  core::ParallelFor(receivers.size(), 8, [&](std::size_t begin, std::size_t end) {
    core::ThrowIfInterrupted();
    for (std::size_t k = begin; k < end; ++k) {
      truth[k] = OfField(lamp.field, supports, receivers[k].p, edge_x);
      for (std::size_t m = 0; m < models.size(); ++m)
        of_models[k * models.size() + m] =
            OfModel(lamp.far_field, models[m].extent, receivers[k].p, edge_x);
    }
  });
  std::vector<Illuminance> errors;
  for (std::size_t m = 0; m < models.size(); ++m) {
    Illuminance off, all;
    for (std::size_t k = 0; k < receivers.size(); ++k) {
      const double weight = receivers[k].weight;
      const Illuminance &is = of_models[k * models.size() + m], &was = truth[k];
      off.open += weight * std::pow(is.open - was.open, 2);
      off.edge += weight * std::pow(is.edge - was.edge, 2);
      all.open += weight * was.open * was.open;
      all.edge += weight * was.edge * was.edge;
    }
    errors.push_back({std::sqrt(off.open / all.open), std::sqrt(off.edge / all.edge)});
  }
  return errors;
}

std::vector<double> DistancesOf(const BenchClassicalOptions& options) {
  if (!(options.nearest_m > 0 && options.farthest_m > options.nearest_m))
    throw InputError(fmt::format("distances from {:g} to {:g} m are none; give two that ascend",
                                 options.nearest_m, options.farthest_m));
  const double decades = std::log10(options.farthest_m / options.nearest_m);
  const int steps = std::max(1, static_cast<int>(std::lround(decades * options.per_decade)));
  std::vector<double> distances;
  for (int k = 0; k <= steps; ++k)
    distances.push_back(options.nearest_m * std::pow(10, decades * k / steps));
  return distances;
}

nlohmann::json OrNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

}  // namespace

std::optional<double> GoodFrom(std::span<const ErrorAt> curve, double error) {
  std::size_t first = curve.size();
  while (first > 0 && curve[first - 1].error <= error) --first;
  if (first == curve.size()) return {};
  if (first == 0) return curve.front().distance_m;
  const ErrorAt &bad = curve[first - 1], &good = curve[first];
  if (!(good.error > 0)) return good.distance_m;
  const double part = std::log(bad.error / error) / std::log(bad.error / good.error);
  return bad.distance_m * std::pow(good.distance_m / bad.distance_m, part);
}

nlohmann::json BenchClassical(const BenchClassicalOptions& options) {
  nlohmann::json rows = nlohmann::json::array(), good_from = nlohmann::json::array();
  const std::vector<double> distances = DistancesOf(options);
  core::Progress progress("classical", options.lamps.size() * distances.size());
  for (const auto& file : options.lamps) {
    const Lamp lamp = ReadLamp(file);
    const std::vector<Model> models = ModelsOf(lamp.opening);
    std::vector<std::vector<ErrorAt>> open(models.size()), edge(models.size());
    for (const double distance : distances) {
      const std::vector<Illuminance> errors = ErrorsAt(lamp, models, distance, options.receivers);
      for (std::size_t m = 0; m < models.size(); ++m) {
        rows.push_back({{"lamp", lamp.name},
                        {"model", models[m].name},
                        {"distance_m", distance},
                        {"illuminance_error", errors[m].open},
                        {"edge_error", errors[m].edge}});
        open[m].push_back({distance, errors[m].open});
        edge[m].push_back({distance, errors[m].edge});
      }
      progress.Advance(1, lamp.name);
    }
    for (std::size_t m = 0; m < models.size(); ++m)
      for (const double error : options.errors)
        good_from.push_back({{"lamp", lamp.name},
                             {"model", models[m].name},
                             {"error", error},
                             {"illuminance_m", OrNull(GoodFrom(open[m], error))},
                             {"edge_m", OrNull(GoodFrom(edge[m], error))}});
  }
  return {{"rows", rows}, {"good_from", good_from}};
}

}  // namespace luxfield::bench
