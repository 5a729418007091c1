#include "luxfield/render/lights/light_tree.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "luxfield/core/colour.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;
using Profile = std::array<double, kProfileBins>;

constexpr double kPi = std::numbers::pi;
constexpr double kFaint = 1e-3;          // of the mean intensity, where a light may shine
constexpr std::size_t kLeastOfKind = 8;  // lights, to have a node of their own
constexpr int kPlaces = 16;              // that a node may be split at, along each axis
constexpr double kRounding = 1 + 1e-5;   // what bounds leave to float32
constexpr int kHalvedDepth = 32;         // from which on lights are halved: 2^31 of them fit below

double Edge(int k) { return kPi * std::pow(static_cast<double>(k) / int{kProfileBins}, 2); }

int BinOf(double angle) {
  return std::clamp(static_cast<int>(int{kProfileBins} * std::sqrt(angle / kPi)), 0,
                    kProfileBins - 1);
}

double RingSolidAngle(int k) { return 2 * kPi * (std::cos(Edge(k)) - std::cos(Edge(k + 1))); }

struct Box {
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void Add(Vec3 p, double reach) {
    low = {std::min(low.x, p.x - reach), std::min(low.y, p.y - reach),
           std::min(low.z, p.z - reach)};
    high = {std::max(high.x, p.x + reach), std::max(high.y, p.y + reach),
            std::max(high.z, p.z + reach)};
  }
  Vec3 Centre() const { return 0.5 * (low + high); }
  double Square() const { return Dot(high - low, high - low); }
};

Vec3 PositionOf(const BoundedLight& light) {
  return {light.light.position[0], light.light.position[1], light.light.position[2]};
}

double Coordinate(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// What the choice of a split looks at.
struct Group {
  Box box;
  double power = 0;
  Vec3 axis;  // sum of power axis

  void Add(const BoundedLight& light) {
    box.Add(PositionOf(light), light.reach_m);
    power += light.power;
    axis = axis + light.power * light.axis;
  }
  double Cost() const { return power > 0 ? power * box.Square() * (2 - Length(axis) / power) : 0; }
};

// Numbers luminaires by table and axes: those of a number are alike. Area lights have -1.
std::vector<int> KindsOf(std::span<const BoundedLight> lights) {
  constexpr double kPerAxis = 1 << 20;  // of a rotation's rows: a micrometre on a metre
  std::map<std::array<std::int64_t, 10>, int> numbers;
  std::vector<int> kinds;
  for (const BoundedLight& light : lights) {
    if (light.light.kind != kTreeLuminaire) {
      kinds.push_back(-1);
      continue;
    }
    std::array<std::int64_t, 10> key{light.light.table};
    for (int k = 0; k < 9; ++k) key[k + 1] = std::llround(kPerAxis * light.light.rotation[k]);
    kinds.push_back(numbers.emplace(key, static_cast<int>(numbers.size())).first->second);
  }
  return kinds;
}

class Builder {
 public:
  explicit Builder(std::span<const BoundedLight> lights)
      : lights_(lights), kinds_(KindsOf(lights)), order_(lights.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!lights.empty()) Build(0, lights.size(), 0);
  }

  std::vector<LightNode> Take() { return std::move(nodes_); }

 private:
  Group GroupOf(std::size_t begin, std::size_t end) const {
    Group group;
    for (std::size_t k = begin; k < end; ++k) group.Add(lights_[order_[k]]);
    return group;
  }

  struct Profiles {
    Profile intensity{}, bounds{};
    double bounded_m = 0;
  };

  // Node of order_[begin, end); returns its profiles, which are too fine for float sums.
  Profiles Build(std::size_t begin, std::size_t end, int depth) {
    const std::size_t number = nodes_.size();
    nodes_.emplace_back();
    const Group group = GroupOf(begin, end);
    const Vec3 centre = group.box.Centre();
    Vec3 axis = Length(group.axis) > 1e-9 * group.power ? Normalized(group.axis) : Vec3{0, 0, 1};
    Profiles profiles;
    int right = -1, light = -1;
    if (end - begin == 1) {
      light = static_cast<int>(order_[begin]);
      axis = lights_[light].axis;
      profiles = {lights_[light].profile, lights_[light].bounds, lights_[light].bounded_m};
    } else {
      const std::size_t middle = Split(begin, end, group, depth);
      const Profiles of_left = Build(begin, middle, depth + 1);
      right = static_cast<int>(nodes_.size());
      const Profiles of_right = Build(middle, end, depth + 1);
      AddTurned(of_left, AxisOf(number + 1), axis, profiles);
      AddTurned(of_right, AxisOf(right), axis, profiles);
    }
    LightNode& node = nodes_[number];
    double radius = 0;  // of float positions, rounded up
    for (int k = 0; k < 3; ++k) {
      node.centre[k] = static_cast<float>(Coordinate(centre, k));
      node.axis[k] = static_cast<float>(Coordinate(axis, k));
    }
    for (std::size_t k = begin; k < end; ++k)
      radius = std::max(
          radius, Length(PositionOf(lights_[order_[k]]) - centre) + lights_[order_[k]].reach_m);
    node.radius = static_cast<float>(radius * (1 + 1e-5) + 1e-6 * Length(centre));
    node.power = static_cast<float>(group.power);
    for (int k = 0; k < kProfileBins; ++k) {
      node.profile[k] = static_cast<float>(profiles.intensity[k]);
      node.bounds[k] = static_cast<float>(profiles.bounds[k] * kRounding);
    }
    node.bounded_m = static_cast<float>(profiles.bounded_m * kRounding);
    node.right = right;
    node.light = light;
    BoundAlike(begin, end, node);
    return profiles;
  }

  void BoundAlike(std::size_t begin, std::size_t end, LightNode& node) const {
    const int kind = kinds_[order_[begin]];
    const auto is_kind = [&](std::size_t light) { return kinds_[light] == kind; };
    node.alike = -1;
    if (kind < 0 || !std::all_of(At(begin), At(end), is_kind)) return;
    node.alike = static_cast<int>(order_[begin]);
    const float* rotation = lights_[order_[begin]].light.rotation;
    const auto row = [&](int k) {
      return Vec3{rotation[3 * k], rotation[3 * k + 1], rotation[3 * k + 2]};
    };
    const Vec3 first = PositionOf(lights_[order_[begin]]);
    Box box;
    double scale = 0;
    for (auto k = At(begin); k != At(end); ++k) {
      const TreeLight& light = lights_[*k].light;
      const Vec3 d = PositionOf(lights_[*k]) - first,
                 local{Dot(row(0), d), Dot(row(1), d), Dot(row(2), d)};
      const Vec3 extent{light.extent[0], light.extent[1], 0};
      box.Add(local - extent, 0);
      box.Add(local + extent, 0);
      scale += light.scale;
    }
    const Vec3 centre = box.Centre(), half = 0.5 * (box.high - box.low);
    const Vec3 middle = first + centre.x * row(0) + centre.y * row(1) + centre.z * row(2);
    // Of float positions and nearly the same axes, rounded up.
    const double rounding = 1e-5 * Length(half) + 1e-6 * Length(middle);
    node.scale = static_cast<float>(scale);
    for (int k = 0; k < 3; ++k) {
      node.middle[k] = static_cast<float>(Coordinate(middle, k));
      node.half_box[k] = static_cast<float>(Coordinate(half, k) + rounding);
    }
  }

  std::vector<std::size_t>::const_iterator At(std::size_t k) const {
    return order_.begin() + static_cast<std::ptrdiff_t>(k);
  }

  Vec3 AxisOf(std::size_t node) const {
    const auto& axis = nodes_[node].axis;
    return {axis[0], axis[1], axis[2]};
  }

  // Adds profiles about one axis to those about another: angles differ by at most that between them.
  static void AddTurned(const Profiles& profiles, Vec3 from, Vec3 to, Profiles& sum) {
    // The angle of float axes, without the loss of acos near 1; 0 where they are the same.
    const double turn = std::atan2(Length(Cross(from, to)), Dot(from, to));
    const double wide = turn < 1e-6 ? 0 : turn + 1e-6;
    for (int k = 0; k < kProfileBins; ++k) {
      int first = k, last = k;
      if (wide > 0) {
        first = BinOf(std::max(Edge(k) - wide, 0.0));
        last = BinOf(std::min(Edge(k + 1) + wide, kPi));
      }
      const auto largest = [&](const Profile& profile) {
        return *std::max_element(profile.begin() + first, profile.begin() + last + 1);
      };
      sum.intensity[k] += largest(profiles.intensity);
      sum.bounds[k] += largest(profiles.bounds);
    }
    sum.bounded_m = std::max(sum.bounded_m, profiles.bounded_m);
  }

  // Where some kinds have many lights each, splits by kind: [begin, result) has one kind. `begin`: no
  // kind has.
  std::size_t SplitOffKind(std::size_t begin, std::size_t end) {
    std::map<int, std::size_t> counts;
    for (std::size_t k = begin; k < end; ++k) ++counts[kinds_[order_[k]]];
    if (counts.size() < 2) return begin;
    counts.erase(-1);
    const auto largest =
        std::max_element(counts.begin(), counts.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (largest == counts.end() || largest->second < std::max(kLeastOfKind, (end - begin) / 8))
      return begin;
    const auto middle =
        std::stable_partition(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                              order_.begin() + static_cast<std::ptrdiff_t>(end),
                              [&](std::size_t light) { return kinds_[light] == largest->first; });
    return static_cast<std::size_t>(middle - order_.begin());
  }

  // Reorders [begin, end) into two parts, neither empty; returns where the second begins.
  std::size_t Split(std::size_t begin, std::size_t end, const Group& group, int depth) {
    const auto first = order_.begin() + static_cast<std::ptrdiff_t>(begin),
               last = order_.begin() + static_cast<std::ptrdiff_t>(end);
    if (depth < kHalvedDepth / 2)
      if (const std::size_t middle = SplitOffKind(begin, end); middle != begin) return middle;
    double least = std::numeric_limits<double>::infinity();
    int best_axis = -1, best_place = 0;
    Box centres;
    for (auto k = first; k != last; ++k) centres.Add(PositionOf(lights_[*k]), 0);
    const auto place_of = [&](std::size_t light, int axis) {
      const double low = Coordinate(centres.low, axis), high = Coordinate(centres.high, axis);
      return std::clamp(
          static_cast<int>(kPlaces * (Coordinate(PositionOf(lights_[light]), axis) - low) /
                           (high - low)),
          0, kPlaces - 1);
    };
    for (int axis = 0; axis < 3 && depth < kHalvedDepth; ++axis) {
      if (!(Coordinate(centres.high, axis) > Coordinate(centres.low, axis))) continue;
      std::array<Group, kPlaces> places{};
      std::array<int, kPlaces> counts{};
      for (auto k = first; k != last; ++k) {
        const int place = place_of(*k, axis);
        places[place].Add(lights_[*k]);
        ++counts[place];
      }
      for (int place = 1; place < kPlaces; ++place) {
        Group below, above;
        int count = 0;
        for (int k = 0; k < kPlaces; ++k) {
          if (counts[k] == 0) continue;
          Merge(places[k], k < place ? below : above);
          if (k < place) count += counts[k];
        }
        if (count == 0 || count == static_cast<int>(end - begin)) continue;
        const double cost = below.Cost() + above.Cost();
        if (cost < least) {
          least = cost;
          best_axis = axis;
          best_place = place;
        }
      }
    }
    if (best_axis >= 0) {
      const auto middle = std::stable_partition(
          first, last, [&](std::size_t light) { return place_of(light, best_axis) < best_place; });
      return static_cast<std::size_t>(middle - order_.begin());
    }
    return HalveAlongLongest(begin, end, group);
  }

  static void Merge(const Group& from, Group& to) {
    to.box.Add(from.box.low, 0);
    to.box.Add(from.box.high, 0);
    to.power += from.power;
    to.axis = to.axis + from.axis;
  }

  std::size_t HalveAlongLongest(std::size_t begin, std::size_t end, const Group& group) {
    const Vec3 size = group.box.high - group.box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::stable_sort(at(begin), at(end), [&](std::size_t a, std::size_t b) {
      return Coordinate(PositionOf(lights_[a]), axis) < Coordinate(PositionOf(lights_[b]), axis);
    });
    return begin + (end - begin) / 2;
  }

  std::span<const BoundedLight> lights_;
  std::vector<int> kinds_;
  std::vector<std::size_t> order_;
  std::vector<LightNode> nodes_;
};

void SetPose(const scene::Pose& world_from_light, Vec3 centre, BoundedLight& bounded) {
  const Vec3 position = world_from_light.Point(centre);
  for (int row = 0; row < 3; ++row) {
    bounded.light.position[row] = static_cast<float>(Coordinate(position, row));
    // The inverse of a rotation is its transpose.
    for (int column = 0; column < 3; ++column)
      bounded.light.rotation[3 * row + column] =
          static_cast<float>(world_from_light.linear[column][row]);
  }
  bounded.axis = world_from_light.Vector({0, 0, 1});
}

// To the axis, of all that a table holds.
double WidestAngle(const preprocess::IntensityTable& table) {
  double widest = 0;
  for (const double x : {table.low.x, table.low.x + table.columns * table.bin.x})
    for (const double y : {table.low.y, table.low.y + table.rows * table.bin.y})
      widest = std::max(widest, std::atan(std::hypot(x, y)));
  return widest;
}

// Largest bounds of the intensity over the azimuths.
Profile BoundsOf(const preprocess::IntensityTable& table) {
  Profile bounds{};
  for (int row = 0; row < table.rows; ++row)
    for (int column = 0; column < table.columns; ++column) {
      const double x[] = {table.low.x + column * table.bin.x,
                          table.low.x + (column + 1) * table.bin.x},
                   y[] = {table.low.y + row * table.bin.y, table.low.y + (row + 1) * table.bin.y};
      const double nearest = std::hypot(std::clamp(0.0, x[0], x[1]), std::clamp(0.0, y[0], y[1])),
                   farthest = std::hypot(std::max(std::abs(x[0]), std::abs(x[1])),
                                         std::max(std::abs(y[0]), std::abs(y[1])));
      const double bound = table.bounds[static_cast<std::size_t>(row) * table.columns + column] *
                           std::pow(1 + farthest * farthest, 1.5);
      for (int k = BinOf(std::atan(nearest)); k <= BinOf(std::atan(farthest)); ++k)
        bounds[k] = std::max(bounds[k], bound);
    }
  return bounds;
}

// Means over the azimuths of a table's intensity. Bins are cut into pieces, each at one angle.
Profile ProfileOf(const preprocess::IntensityTable& table) {
  constexpr int kPieces = 4;
  Profile flux{};
  for (int row = 0; row < table.rows; ++row)
    for (int column = 0; column < table.columns; ++column)
      for (int piece = 0; piece < kPieces * kPieces; ++piece) {
        const double x = table.low.x + table.bin.x * (column + (piece % kPieces + 0.5) / kPieces),
                     y = table.low.y +
                         table.bin.y * (row + (std::floor(piece / kPieces) + 0.5) / kPieces);
        flux[BinOf(std::atan(std::hypot(x, y)))] +=
            table.BinFlux(row, column) / (kPieces * kPieces);
      }
  Profile profile{};
  for (int k = 0; k <= BinOf(WidestAngle(table)); ++k)
    profile[k] = std::max(flux[k] / RingSolidAngle(k), kFaint * table.Flux() / (4 * kPi));
  return profile;
}

}  // namespace

BoundedTable::BoundedTable(const preprocess::IntensityTable& of_luminaire, std::size_t its_number)
    : table(&of_luminaire),
      number(its_number),
      widest_angle(WidestAngle(of_luminaire)),
      profile(ProfileOf(of_luminaire)),
      bounds(BoundsOf(of_luminaire)) {}

BoundedLight BoundLuminaire(const lightfield::LuminaireGeometry& geometry,
                            const BoundedTable& bounded_table,
                            const scene::Pose& world_from_luminaire, double scale) {
  const preprocess::IntensityTable& table = *bounded_table.table;
  const auto& grid = geometry.grid;
  const double width = (grid.width + grid.basis.cells - 1) * grid.spacing_m,
               height = (grid.height + grid.basis.cells - 1) * grid.spacing_m;
  BoundedLight bounded;
  SetPose(world_from_luminaire, {grid.u0_m + width / 2, grid.v0_m + height / 2, 0}, bounded);
  TreeLight& light = bounded.light;
  light.kind = kTreeLuminaire;
  light.extent[0] = static_cast<float>(width / 2);
  light.extent[1] = static_cast<float>(height / 2);
  light.scale = static_cast<float>(scale);
  light.table = static_cast<int>(bounded_table.number);
  light.columns = table.columns;
  light.rows = table.rows;
  light.low[0] = static_cast<float>(table.low.x);
  light.low[1] = static_cast<float>(table.low.y);
  light.bin[0] = static_cast<float>(table.bin.x);
  light.bin[1] = static_cast<float>(table.bin.y);
  bounded.reach_m = std::hypot(width, height) / 2;
  bounded.power = scale * table.Flux();
  for (int k = 0; k < kProfileBins; ++k) {
    bounded.profile[k] = scale * bounded_table.profile[k];
    bounded.bounds[k] = scale * bounded_table.bounds[k];
  }
  // Tangents differ by at most 2 extent / z over the supports, and z >= |u - p| cos of the widest.
  bounded.bounded_m =
      std::max(width / table.bin.x, height / table.bin.y) / std::cos(bounded_table.widest_angle);
  return bounded;
}

BoundedLight BoundAreaLight(const AreaLightSource& source) {
  const AreaLightParams& params = source.params;
  BoundedLight bounded;
  TreeLight& light = bounded.light;
  std::copy_n(params.position, 3, light.position);
  std::copy_n(params.rotation, 9, light.rotation);
  const double luminance =
      core::Luminance({params.radiance[0], params.radiance[1], params.radiance[2]});
  light.scale = static_cast<float>(luminance);
  if (source.kind == scene::AreaLightKind::kSphere) {
    const double radius = params.radius;
    light.kind = kTreeSphere;
    light.extent[0] = light.extent[1] = params.radius;
    bounded.reach_m = radius;
    bounded.power = luminance * 4 * kPi * kPi * radius * radius;
    bounded.profile.fill(luminance * kPi * radius * radius);
    return bounded;
  }
  const double area = 4.0 * params.half_size[0] * params.half_size[1];
  light.kind = kTreeRectangle;
  std::copy_n(params.half_size, 2, light.extent);
  bounded.axis = {params.rotation[6], params.rotation[7], params.rotation[8]};
  bounded.reach_m = std::hypot(params.half_size[0], params.half_size[1]);
  bounded.power = luminance * kPi * area;
  for (int k = 0; k < kProfileBins && Edge(k) < kPi / 2; ++k)
    bounded.profile[k] =
        luminance * area * (std::cos(Edge(k)) + std::max(std::cos(Edge(k + 1)), 0.0)) / 2;
  return bounded;
}

BoundedLight BoundClassicalLight(const ClassicalLightSource& source, double factor) {
  const ClassicalLightParams& params = source.params;
  const double x = params.half_size[0], y = params.half_size[1];
  const double measure =
      (x > 0 ? 2 * x : 1) * (y > 0 ? 2 * y : 1) * (params.is_ellipse ? kPi / 4 : 1);
  const double scale = factor * measure * params.strength;
  BoundedLight bounded;
  TreeLight& light = bounded.light;
  light.kind = kTreeClassical;
  std::copy_n(params.position, 3, light.position);
  std::copy_n(params.rotation, 9, light.rotation);
  std::copy_n(params.half_size, 2, light.extent);
  light.scale = static_cast<float>(scale);
  bounded.axis = {params.rotation[6], params.rotation[7], params.rotation[8]};
  bounded.reach_m = std::hypot(x, y);
  bounded.power = scale * source.distribution->flux;
  for (int k = 0; k < kProfileBins; ++k)
    bounded.profile[k] = scale * source.distribution->profile[k];
  return bounded;
}

void BoundIntensity(const formats::Photometry& photometry, Profile& profile, double& flux) {
  constexpr int kSlices = 8, kAzimuths = 64;  // of a ring
  flux = 0;
  for (int k = 0; k < kProfileBins; ++k) {
    profile[k] = 0;
    for (int slice = 0; slice < kSlices; ++slice) {
      const double cosine =
                       std::lerp(std::cos(Edge(k)), std::cos(Edge(k + 1)), (slice + 0.5) / kSlices),
                   sine = std::sqrt(1 - cosine * cosine);
      double mean = 0;
      for (int turn = 0; turn < kAzimuths; ++turn) {
        const double azimuth = 2 * kPi * (turn + 0.5) / kAzimuths;
        mean += std::abs(formats::Intensity(
                    photometry, {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine})) /
                kAzimuths;
      }
      profile[k] = std::max(profile[k], mean);
      flux += RingSolidAngle(k) / kSlices * mean;
    }
  }
  double largest = 0;
  for (const double intensity : photometry.intensity_cd)
    largest = std::max(largest, std::abs(intensity));
  // A table of type C ends at its last angles; what the slices may have missed is faint at least.
  const bool is_type_c = photometry.type == formats::PhotometryType::kC;
  for (int k = 0; k < kProfileBins; ++k) {
    const double first = photometry.angles_deg.front() * kPi / 180,
                 last = photometry.angles_deg.back() * kPi / 180;
    const bool is_beyond = is_type_c && (Edge(k) > last + 1e-3 || Edge(k + 1) < first - 1e-3);
    if (!is_beyond) profile[k] = std::max(profile[k], kFaint * largest);
  }
}

std::vector<LightNode> BuildLightTree(std::span<const BoundedLight> lights) {
  return Builder(lights).Take();
}

LightTree UploadLightTree(const Device& device, std::span<const BoundedLight> lights,
                          std::span<const BoundedTable> tables) {
  std::vector<float> sums;
  std::vector<int> places;
  for (const BoundedTable& bounded : tables) {
    const preprocess::IntensityTable& table = *bounded.table;
    places.push_back(static_cast<int>(sums.size()));
    sums.insert(sums.end(), table.sums.begin(), table.sums.end());
    sums.insert(sums.end(), table.bounds.begin(), table.bounds.end());
    sums.push_back(table.largest_bound);
  }
  if (sums.empty()) sums.push_back(0);  // a device allocates no nothing
  std::vector<TreeLight> of_tree;
  for (const BoundedLight& bounded : lights) {
    of_tree.push_back(bounded.light);
    if (bounded.light.kind == kTreeLuminaire) of_tree.back().table = places[bounded.light.table];
  }
  return {Buffer::From(device, BuildLightTree(lights)), Buffer::From(device, of_tree),
          Buffer::From(device, sums)};
}

}  // namespace luxfield::render
