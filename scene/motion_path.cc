#include "luxfield/scene/motion_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"

namespace luxfield::scene {
namespace {

using core::Config;
using core::Range;

constexpr double kLongest_s = 86400, kFastest = 1000, kFarthest_m = 1e6, kBrightest = 1e12;
constexpr int kMostFrames = 1000000;

Vec3 VectorOf(const Config& table, const char* key, double bound) {
  const std::vector<double> v = table.Numbers(key, 3);
  for (const double value : v)
    if (!(std::abs(value) <= bound))
      table.Fail(key, fmt::format("= {} is farther than {} from 0", value, bound));
  return {v[0], v[1], v[2]};
}

std::optional<Vec3> OptionalVector(const Config& table, const char* key, double bound) {
  if (!table.Has(key)) return {};
  return VectorOf(table, key, bound);
}

std::optional<double> OptionalNumber(const Config& table, const char* key, Range range) {
  if (!table.Has(key)) return {};
  return table.Number(key, range);
}

template <typename Key>
void RequireRisingTime(const Config& table, const std::vector<Key>& keys, double t_s) {
  if (!keys.empty() && !(t_s > keys.back().t_s))
    table.Fail("t_s",
               fmt::format("= {} is not after the key before it, {} s", t_s, keys.back().t_s));
}

CameraKey ReadCameraKey(const Config& table) {
  return {table.Number("t_s", {0, kLongest_s}), VectorOf(table, "position", kFarthest_m),
          VectorOf(table, "look_at", kFarthest_m),
          OptionalNumber(table, "vertical_fov_deg", {0.01, 170})};
}

LampKey ReadLampKey(const Config& table) {
  LampKey key;
  key.t_s = table.Number("t_s", {0, kLongest_s});
  key.position = VectorOf(table, "position", kFarthest_m);
  key.look_at = OptionalVector(table, "look_at", kFarthest_m);
  key.rotate_deg = OptionalVector(table, "rotate_deg", 1e6);
  key.scale = OptionalNumber(table, "scale", {0, kBrightest});
  if (key.look_at && key.rotate_deg)
    table.Fail("rotate_deg", "contradicts look_at", "drop one of them");
  return key;
}

MovedLamp ReadLamp(const Config& table) {
  MovedLamp lamp{table.Text("name"), {}};
  for (const Config& key_table : table.Tables("key")) {
    const LampKey key = ReadLampKey(key_table);
    RequireRisingTime(key_table, lamp.keys, key.t_s);
    if (!lamp.keys.empty() && (key.look_at.has_value() != lamp.keys[0].look_at.has_value() ||
                               key.rotate_deg.has_value() != lamp.keys[0].rotate_deg.has_value() ||
                               key.scale.has_value() != lamp.keys[0].scale.has_value()))
      key_table.Fail("position", "stands beside other fields than in the lamp's first key",
                     "give look_at, rotate_deg and scale in all of its keys or in none");
    lamp.keys.push_back(key);
  }
  if (lamp.keys.empty())
    table.Fail("name", fmt::format("= \"{}\" has no keys", lamp.name),
               "add a [[luminaire.key]] with t_s and position");
  return lamp;
}

// The derivative at key i, by the parabola of the header.
double Slope(int i, int count, const std::function<double(int)>& time,
             const std::function<double(int)>& value) {
  const auto h = [&](int k) { return time(k + 1) - time(k); };
  const auto d = [&](int k) { return (value(k + 1) - value(k)) / h(k); };
  if (count == 2) return d(0);
  if (i == 0) return ((2 * h(0) + h(1)) * d(0) - h(0) * d(1)) / (h(0) + h(1));
  if (i == count - 1) {
    const int k = count - 2;
    return ((2 * h(k) + h(k - 1)) * d(k) - h(k) * d(k - 1)) / (h(k - 1) + h(k));
  }
  return (h(i - 1) * d(i) + h(i) * d(i - 1)) / (h(i - 1) + h(i));
}

enum class Between { kCubic, kLinear };

// get(key): the value to interpolate.
template <typename Key, typename Get>
double ValueAt(const std::vector<Key>& keys, double t_s, Between between, const Get& get) {
  if (t_s <= keys.front().t_s) return get(keys.front());
  if (t_s >= keys.back().t_s) return get(keys.back());
  const auto after = std::ranges::upper_bound(keys, t_s, {}, &Key::t_s);
  const int i = static_cast<int>(after - keys.begin()) - 1;
  const double h = keys[i + 1].t_s - keys[i].t_s, x = (t_s - keys[i].t_s) / h;
  const double a = get(keys[i]), b = get(keys[i + 1]);
  if (between == Between::kLinear) return a + x * (b - a);
  const int count = static_cast<int>(keys.size());
  const std::function<double(int)> time = [&](int k) { return keys[k].t_s; },
                                   value = [&](int k) { return get(keys[k]); };
  const double m = h * Slope(i, count, time, value), n = h * Slope(i + 1, count, time, value);
  const double y = 1 - x;
  return y * y * ((1 + 2 * x) * a + x * m) + x * x * ((3 - 2 * x) * b - y * n);
}

template <typename Key, typename Get>
Vec3 VectorAt(const std::vector<Key>& keys, double t_s, const Get& get) {
  const auto along = [&](double Vec3::*axis) {
    return ValueAt(keys, t_s, Between::kCubic,
                   [&](const Key& key) -> double { return get(key).*axis; });
  };
  return {along(&Vec3::x), along(&Vec3::y), along(&Vec3::z)};
}

[[noreturn]] void FailToFace(const MotionPath& path, const std::string& what, double t_s) {
  throw InputError(
      path.file,
      fmt::format("at {:.4g} s {} stands at the point that it looks at, or looks along up", t_s,
                  what),
      "move one of the points, or give another up");
}

Camera CameraAt(const MotionPath& path, double t_s, const Camera& of_scene) {
  const Vec3 position =
      VectorAt(path.camera, t_s, [](const CameraKey& key) { return key.position; });
  const Vec3 look_at = VectorAt(path.camera, t_s, [](const CameraKey& key) { return key.look_at; });
  const double fov = ValueAt(path.camera, t_s, Between::kCubic, [&](const CameraKey& key) {
    return key.vertical_fov_deg.value_or(of_scene.vertical_fov_deg);
  });
  if (!Facing(position, look_at, path.up)) FailToFace(path, "the camera", t_s);
  return Camera::LookAt(position, look_at, path.up, std::clamp(fov, 0.01, 170.0), of_scene.width,
                        of_scene.height);
}

void PlaceLamp(const MotionPath& path, const MovedLamp& moved, double t_s, PlacedLamp& lamp) {
  Pose& pose = lamp.world_from_luminaire;
  const LampKey& first = moved.keys.front();
  const Vec3 position = VectorAt(moved.keys, t_s, [](const LampKey& key) { return key.position; });
  if (first.look_at) {
    const auto faced =
        Facing(position, VectorAt(moved.keys, t_s, [](const LampKey& key) { return *key.look_at; }),
               path.up);
    if (!faced) FailToFace(path, "\"" + moved.name + "\"", t_s);
    pose = *faced;
  } else if (first.rotate_deg) {
    pose =
        Translation(position) *
        RotationXyz(VectorAt(moved.keys, t_s, [](const LampKey& key) { return *key.rotate_deg; }));
  } else {
    pose.translation = position;
  }
  if (first.scale)
    lamp.scale =
        ValueAt(moved.keys, t_s, Between::kLinear, [](const LampKey& key) { return *key.scale; });
}

std::size_t NumberOf(const MotionPath& path, const MovedLamp& moved, const Scene& scene) {
  const auto named = [&](const Luminaire& lamp) { return lamp.name == moved.name; };
  const auto found = std::ranges::find_if(scene.luminaires, named);
  if (found == scene.luminaires.end())
    throw InputError(path.file, fmt::format("luminaire \"{}\" is not in the scene", moved.name),
                     "name one of its luminaires");
  if (std::ranges::count_if(scene.luminaires, named) > 1)
    throw InputError(
        path.file,
        fmt::format("luminaire \"{}\" stands in an array, which cannot move", moved.name),
        "name a luminaire without an array");
  return static_cast<std::size_t>(found - scene.luminaires.begin());
}

}  // namespace

std::optional<Pose> Facing(Vec3 position, Vec3 target, Vec3 up) {
  const Vec3 line = target - position;
  if (lightfield::Length(line) <= 1e-9 * (1 + lightfield::Length(position))) return {};
  if (lightfield::Length(up) == 0 ||
      lightfield::Length(
          lightfield::Cross(lightfield::Normalized(up), lightfield::Normalized(line))) < 1e-6)
    return {};
  return LookAt(position, target, up);
}

int MotionPath::frame_count() const {
  return static_cast<int>(std::lround(duration_s * frames_per_s)) + 1;
}

MotionPath ReadMotionPath(const std::filesystem::path& file) {
  const Config config = Config::FromFile(file);
  MotionPath path;
  path.file = file.string();
  path.frames_per_s = config.Number("frames_per_s", 24, {1e-3, kFastest});
  for (const Config& table : config.Tables("camera")) {
    const CameraKey key = ReadCameraKey(table);
    RequireRisingTime(table, path.camera, key.t_s);
    path.camera.push_back(key);
  }
  for (const Config& table : config.Tables("luminaire")) path.lamps.push_back(ReadLamp(table));
  double last_s = path.camera.empty() ? 0 : path.camera.back().t_s;
  for (const MovedLamp& lamp : path.lamps) last_s = std::max(last_s, lamp.keys.back().t_s);
  path.duration_s = config.Number("duration_s", last_s, {0, kLongest_s});
  if (config.Has("up")) path.up = VectorOf(config, "up", 1e6);
  config.Finish();
  if (path.camera.empty() && path.lamps.empty())
    throw InputError(path.file, "moves nothing", "add [[camera]] or [[luminaire]] keys");
  if (path.duration_s * path.frames_per_s > kMostFrames)
    throw InputError(path.file, fmt::format("asks for more than {} frames", kMostFrames),
                     "lower duration_s or frames_per_s");
  return path;
}

Placement PlacementAt(const MotionPath& path, double t_s, const Scene& scene) {
  Placement placement{scene.camera, {}};
  for (const Luminaire& lamp : scene.luminaires)
    placement.lamps.push_back({lamp.world_from_luminaire, lamp.scale, lamp.colour});
  if (!path.camera.empty()) placement.camera = CameraAt(path, t_s, scene.camera);
  for (const MovedLamp& moved : path.lamps)
    PlaceLamp(path, moved, t_s, placement.lamps.at(NumberOf(path, moved, scene)));
  return placement;
}

std::vector<Placement> PlacementsOf(const MotionPath& path, const Scene& scene) {
  std::vector<Placement> all;
  for (int n = 0; n < path.frame_count(); ++n)
    all.push_back(PlacementAt(path, path.time_s(n), scene));
  return all;
}

}  // namespace luxfield::scene
