#include "luxfield/photometry/asked.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/photometry/distribution.h"

namespace luxfield::photometry {
namespace {

using core::Config;
using lightfield::Dot;
using lightfield::Vec3;

constexpr double kFarthest_m = 1e6;
constexpr int kMostPoints = 4096;  // along an axis

Vec3 ReadPoint(const Config& table, const char* key) {
  const auto v = table.Numbers(key, 3);
  const Vec3 p{v[0], v[1], v[2]};
  if (!(Length(p) <= kFarthest_m))
    table.Fail(key, "lies more than 1e6 m away", "give metres in the luminaire's frame");
  return p;
}

Vec3 ReadDirection(const Config& table, const char* key, std::vector<double> fallback) {
  const auto v = table.Numbers(key, 3, fallback);
  const Vec3 d{v[0], v[1], v[2]};
  if (!(Length(d) > 0)) table.Fail(key, "has no direction", "give a vector that is not 0");
  return Normalized(d);
}

Vec3 ReadRequiredDirection(const Config& table, const char* key) {
  return ReadDirection(table, key, table.Numbers(key, 3));
}

// Across `axis`, from what is given of it.
Vec3 ReadAcross(const Config& table, const char* key, std::vector<double> fallback, Vec3 axis,
                const char* axis_key) {
  const Vec3 d = ReadDirection(table, key, std::move(fallback));
  const Vec3 across = d - Dot(d, axis) * axis;
  if (!(Length(across) > 1e-3))
    table.Fail(key, fmt::format("points along {}", axis_key), "turn it across");
  return Normalized(across);
}

std::vector<double> Listed(Vec3 v) { return {v.x, v.y, v.z}; }

// "(0, 0, 1) m".
std::string PlaceName(Vec3 p) { return fmt::format("({:.4g}, {:.4g}, {:.4g}) m", p.x, p.y, p.z); }

Weighting ReadWeighting(const Config& table, const std::vector<Weighting>& before) {
  Weighting weighting;
  weighting.name = table.Text("name");
  const auto same = [&](const Weighting& one) { return one.name == weighting.name; };
  if (weighting.name.empty() || std::ranges::any_of(before, same))
    table.Fail("name", "is empty, or another [[weighting]]'s", "give each a name of its own");
  weighting.unit = table.Text("unit");
  weighting.factors = table.Numbers("factors", 0);
  const auto is_zero = [](double factor) { return factor == 0; };
  if (std::ranges::all_of(weighting.factors, is_zero))
    table.Fail("factors", "weighs nothing", "give a factor for each channel, not all of them 0");
  return weighting;
}

std::string ReadWeightingName(const Config& table, const std::vector<Weighting>& weightings) {
  const std::string name = table.Text("weighting", "");
  if (name.empty()) return name;
  const auto same = [&](const Weighting& one) { return one.name == name; };
  if (std::ranges::none_of(weightings, same))
    table.Fail("weighting", "is the name of no [[weighting]]",
               "add a [[weighting]] of that name with its unit and factors");
  return name;
}

// By key `receiver`, with the axis and direction that its shape has.
PointReceiver ReadReceiver(const Config& table, const std::string& fallback) {
  PointReceiver receiver;
  const std::string shape =
      table.Choice("receiver", {"plane", "sphere", "cylinder", "semicylinder"}, fallback);
  if (shape == "plane") return receiver;
  receiver.shape = shape == "sphere"     ? ReceiverShape::kSphere
                   : shape == "cylinder" ? ReceiverShape::kCylinder
                                         : ReceiverShape::kSemicylinder;
  if (receiver.shape == ReceiverShape::kSphere) return receiver;
  receiver.axis = ReadDirection(table, "axis", {0, 0, 1});
  if (receiver.shape == ReceiverShape::kSemicylinder)
    receiver.facing =
        ReadAcross(table, "facing", table.Numbers("facing", 3), receiver.axis, "axis");
  return receiver;
}

PointAsked ReadPointAsked(const Config& table, const std::vector<Weighting>& weightings) {
  PointAsked point;
  point.p_m = ReadPoint(table, "position_m");
  if (!(Length(point.p_m) > 0))
    table.Fail("position_m", "is the origin of the lamp itself", "move it");
  point.normal = ReadDirection(table, "normal", Listed(-1 * point.p_m));
  point.axis = ReadDirection(table, "axis", {0, 0, 1});
  if (table.Has("facing"))
    point.facing = ReadAcross(table, "facing", {1, 0, 0}, point.axis, "axis");
  point.weighting = ReadWeightingName(table, weightings);
  point.name = table.Text("name", PlaceName(point.p_m));
  return point;
}

// All of a plane but its name.
PlaneAsked ReadRectangle(const Config& table, int points, const std::string& receiver,
                         const std::vector<Weighting>& weightings) {
  PlaneAsked plane;
  plane.centre_m = ReadPoint(table, "centre_m");
  plane.right = ReadDirection(table, "right", {1, 0, 0});
  plane.up = ReadAcross(table, "up", {0, 1, 0}, plane.right, "right");
  plane.width_m = table.Number("width_m", {1e-6, kFarthest_m});
  plane.height_m = table.Number("height_m", {1e-6, kFarthest_m});
  plane.columns = table.Integer("columns", points, 1, kMostPoints);
  plane.rows = table.Integer("rows", points, 1, kMostPoints);
  plane.receiver = ReadReceiver(table, receiver);
  plane.weighting = ReadWeightingName(table, weightings);
  return plane;
}

// Between which two times, and how much of the way.
std::pair<std::size_t, double> PlaceOf(const std::vector<double>& times, double time) {
  const auto after = std::upper_bound(times.begin() + 1, times.end() - 1, time);
  const auto k = static_cast<std::size_t>(after - times.begin()) - 1;
  return {k, (time - times[k]) / (times[k + 1] - times[k])};
}

PlaneAsked ReadPlaneAsked(const Config& table, const std::vector<Weighting>& weightings) {
  PlaneAsked plane = ReadRectangle(table, 41, "plane", weightings);
  plane.name = table.Text("name", "plane at " + PlaceName(plane.centre_m));
  return plane;
}

LineAsked ReadLineAsked(const Config& table, const std::vector<Weighting>& weightings) {
  LineAsked line;
  line.from_m = ReadPoint(table, "from_m");
  line.to_m = ReadPoint(table, "to_m");
  line.points = table.Integer("points", 51, 2, kMostPoints);
  if (table.Has("normal")) line.normal = ReadRequiredDirection(table, "normal");
  line.axis = ReadDirection(table, "axis", {0, 0, 1});
  if (table.Has("facing")) line.facing = ReadAcross(table, "facing", {1, 0, 0}, line.axis, "axis");
  line.weighting = ReadWeightingName(table, weightings);
  line.name = table.Text(
      "name", fmt::format("({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) m", line.from_m.x,
                          line.from_m.y, line.from_m.z, line.to_m.x, line.to_m.y, line.to_m.z));
  for (int k = 0; k < line.points; ++k)
    if (!(Length(line.Point(k).p_m) > 0))
      table.Fail("points", "puts one of them on the origin of the lamp itself", "move the line");
  return line;
}

VolumeAsked ReadVolumeAsked(const Config& table, const std::vector<Weighting>& weightings) {
  constexpr std::size_t kMostOfVolume = std::size_t(1) << 24;
  VolumeAsked volume;
  volume.middle = ReadRectangle(table, 11, "sphere", weightings);
  volume.depth_m = table.Number("depth_m", {1e-6, kFarthest_m});
  volume.layers = table.Integer("layers", 11, 1, kMostPoints);
  if (volume.count() > kMostOfVolume)
    table.Fail("layers", fmt::format("makes {} points", volume.count()),
               fmt::format("ask for {} at most, columns x rows x layers", kMostOfVolume));
  volume.middle.name = table.Text("name", "volume at " + PlaceName(volume.middle.centre_m));
  return volume;
}

// One [[path.key]] after the last of the path.
void ReadKey(const Config& key, PathAsked* path) {
  constexpr double kLongest_s = 1e9;
  const double time = key.Number("t_s", {-kLongest_s, kLongest_s});
  if (!path->times_s.empty() && !(time > path->times_s.back()))
    key.Fail("t_s", "is not after the key before", "put keys in order");
  path->times_s.push_back(time);
  path->positions_m.push_back(ReadPoint(key, "position_m"));
  if (!key.Has("normal")) return;
  if (path->receiver.shape != ReceiverShape::kPlane)
    key.Fail("normal", "is of a plane", "drop it, or the path's receiver");
  path->normals.push_back(ReadRequiredDirection(key, "normal"));
  const std::size_t k = path->normals.size() - 1;
  if (k > 0 && !(Length(path->normals[k] + path->normals[k - 1]) > 1e-3))
    key.Fail("normal", "is opposite to that of the key before", "add a key between");
}

PathAsked ReadPathAsked(const Config& table, const std::vector<Weighting>& weightings) {
  PathAsked path;
  path.receiver = ReadReceiver(table, "plane");
  path.weighting = ReadWeightingName(table, weightings);
  for (const Config& key : table.Tables("key")) ReadKey(key, &path);
  if (path.times_s.size() < 2)
    table.Fail("key", fmt::format("has {} keys", path.times_s.size()),
               "give two or more [[path.key]], with t_s and position_m");
  if (!path.normals.empty() && path.normals.size() != path.times_s.size())
    table.Fail("key", "has a normal for some keys alone", "give one to each, or to none");
  path.name = table.Text("name", "path from " + PlaceName(path.positions_m[0]));
  return path;
}

std::optional<std::array<double, 2>> ReadOpening(const Config& table) {
  if (!table.Has("opening_m")) return {};
  const auto sides = table.Numbers("opening_m", 2);
  if (!(sides[0] > 0 && sides[1] > 0))
    table.Fail("opening_m", fmt::format("holds {} and {}", sides[0], sides[1]),
               "give width and height of the luminous opening, metres");
  return std::array{sides[0], sides[1]};
}

EyePicture ReadEyePicture(const Config& table) {
  const std::string picture =
      table.Choice("picture", {"perspective", "fisheye", "none"}, "perspective");
  return picture == "none"      ? EyePicture::kNone
         : picture == "fisheye" ? EyePicture::kFisheye
                                : EyePicture::kPerspective;
}

// Full angles, mrad, of the eye's resolution and of usual luminance meters.
const std::vector<double> kFieldsOfView_mrad = {1.7, 11, 100};
constexpr double kGlaring = 500;  // cd/m^2
constexpr double kAge_years = 23;

EyeAsked ReadEyeAsked(const Config& table) {
  EyeAsked eye;
  eye.eye_m = ReadPoint(table, "eye_m");
  eye.picture = ReadEyePicture(table);
  eye.fields_of_view_mrad = table.Numbers("fields_of_view_mrad", 0, kFieldsOfView_mrad);
  for (const double field : eye.fields_of_view_mrad)
    if (!(field >= 0.01 && field <= 1000))
      table.Fail("fields_of_view_mrad", fmt::format("holds {}", field), "give 0.01 to 1000");
  eye.threshold = table.Number("threshold_cd_per_m2", kGlaring, {0, 1e15});
  eye.age_years = table.Number("age_years", kAge_years, {1, 120});
  eye.opening_m = ReadOpening(table);
  if (table.Has("background_cd_per_m2"))
    eye.background = table.Number("background_cd_per_m2", {1e-6, 1e9});
  if (table.Has("road_luminance_cd_per_m2"))
    eye.road_luminance = table.Number("road_luminance_cd_per_m2", {1e-3, 1e6});
  if (eye.background || eye.road_luminance || table.Has("line_of_sight")) {
    eye.line_of_sight = ReadRequiredDirection(table, "line_of_sight");
    if (eye.background || table.Has("up"))
      eye.up = ReadAcross(table, "up", {0, 0, -1}, *eye.line_of_sight, "line_of_sight");
  } else if (table.Has("up")) {
    eye.up = ReadRequiredDirection(table, "up");
  }
  eye.name = table.Text("name", "eye at " + PlaceName(eye.eye_m));
  return eye;
}

GlareAsked ReadGlareAsked(const Config& table) {
  GlareAsked glare;
  glare.below_m = table.Number("below_m", {1e-3, kFarthest_m});
  glare.distances_m = table.Numbers("distances_m", 0);
  for (const double distance : glare.distances_m)
    if (!(distance > 0 && distance <= kFarthest_m))
      table.Fail("distances_m", fmt::format("holds {}", distance),
                 "give distances above 0 from the lamp's axis");
  glare.c_deg = table.Numbers("c_deg", 0, {0, 90, 180, 270});
  glare.background = table.Number("background_cd_per_m2", {1e-6, 1e9});
  glare.threshold = table.Number("threshold_cd_per_m2", kGlaring, {0, 1e15});
  glare.opening_m = ReadOpening(table);
  glare.name = table.Text("name", fmt::format("eyes {:g} m below the lamp", glare.below_m));
  return glare;
}

HeadlampAsked ReadHeadlampAsked(const Config& table, const RegulationFile& regulation_file) {
  HeadlampAsked headlamp;
  const std::string name = table.Text("regulation");
  const std::filesystem::path file = name.ends_with(".toml")
                                         ? std::filesystem::path(table.Path("regulation"))
                                         : regulation_file(name);
  if (std::error_code error; !std::filesystem::exists(file, error))
    table.Fail("regulation", "names no file",
               "name one of data/regulations without its ending, or a path that ends in .toml");
  headlamp.regulation = ReadRegulation(file);
  if (table.Choice("traffic", {"right", "left"}, "right") == "left")
    headlamp.regulation = Mirrored(headlamp.regulation);
  headlamp.forward = ReadDirection(table, "forward", {0, 0, 1});
  headlamp.up = ReadAcross(table, "up", {0, 1, 0}, headlamp.forward, "forward");
  if (table.Has("aim_deg")) {
    const auto aim = table.Numbers("aim_deg", 2);
    if (!(std::abs(aim[0]) <= 45 && std::abs(aim[1]) <= 45))
      table.Fail("aim_deg", "turns the lamp by more than 45 degrees", "give `forward` instead");
    headlamp.aim = Place{aim[0], aim[1]};
  }
  headlamp.height_m = table.Number("height_m", 0.65, {0.05, 20});
  const auto eye = table.Numbers("eye_m", 3, {0, 1.2, -2});
  if (!(eye[1] >= 0.05 && eye[1] <= 20 && std::abs(eye[0]) <= 20 && std::abs(eye[2]) <= 20))
    table.Fail("eye_m", fmt::format("holds {}, {} and {}", eye[0], eye[1], eye[2]),
               "give metres to the right of the lamp, above the road and ahead of the lamp, of a "
               "driver near it");
  headlamp.eye_m = {eye[0], eye[1], eye[2]};
  headlamp.name = table.Text("name", headlamp.regulation.name);
  return headlamp;
}

QualityAsked ReadQualityAsked(const Config& table) {
  QualityAsked quality;
  const auto read = [&](const char* key, std::filesystem::path* file) {
    if (table.Has(key)) *file = table.Path(key);
  };
  read("responsivity", &quality.responsivity);
  read("lamp_spectrum", &quality.lamp_spectrum);
  read("calibration_spectrum", &quality.calibration_spectrum);
  read("sensor_calibration", &quality.sensor_calibration);
  if (quality.responsivity.empty() &&
      !(quality.lamp_spectrum.empty() && quality.calibration_spectrum.empty()))
    table.Fail("responsivity", "is missing, and spectra of light mean nothing without it",
               "name the file of the camera's responsivity");
  if (quality.lamp_spectrum.empty() && !quality.calibration_spectrum.empty())
    table.Fail("lamp_spectrum", "is missing, which calibration_spectrum is compared with",
               "name the file of the lamp's spectrum");
  return quality;
}

}  // namespace

Vec3 PlaneAsked::Point(int column, int row) const {
  return centre_m + ((column + 0.5) / columns - 0.5) * width_m * right +
         (0.5 - (row + 0.5) / rows) * height_m * up;
}

Vec3 PlaneAsked::PointAt(std::size_t k) const {
  const auto at = static_cast<int>(k);
  return Point(at % columns, at / columns);
}

PointAsked LineAsked::Point(int k) const {
  PointAsked point;
  point.p_m = from_m + (1.0 * k / (points - 1)) * (to_m - from_m);
  point.name = fmt::format("{}, {:.4g} m along it", name, Length(point.p_m - from_m));
  point.normal = normal.value_or(Normalized(-1 * point.p_m));
  point.axis = axis;
  point.facing = facing;
  point.weighting = weighting;
  return point;
}

PlaneAsked VolumeAsked::Layer(int k) const {
  PlaneAsked plane = middle;
  const double along = ((k + 0.5) / layers - 0.5) * depth_m;
  plane.centre_m = middle.centre_m + along * Cross(middle.right, middle.up);
  plane.name = fmt::format("{}, at {}", middle.name, PlaceName(plane.centre_m));
  return plane;
}

Vec3 VolumeAsked::PointAt(std::size_t k) const {
  return Layer(static_cast<int>(k / middle.count())).PointAt(k % middle.count());
}

Vec3 PathAsked::Position(double time_s) const {
  const auto [k, share] = PlaceOf(times_s, time_s);
  return positions_m[k] + share * (positions_m[k + 1] - positions_m[k]);
}

PointReceiver PathAsked::At(double time_s) const {
  PointReceiver turned = receiver;
  if (normals.empty()) return turned;
  const auto [k, share] = PlaceOf(times_s, time_s);
  turned.normal = Normalized(normals[k] + share * (normals[k + 1] - normals[k]));
  return turned;
}

Vec3 PlaneAsked::Normal() const {
  const Vec3 n = Cross(right, up);
  return Dot(n, centre_m) > 0 ? -1 * n : n;
}

EyeAsked GlareAsked::Eye(std::size_t plane, std::size_t distance) const {
  const Vec3 aside = VectorOf({c_deg[plane], 90});
  EyeAsked eye;
  eye.name = fmt::format("C {:g}, {:g} m", c_deg[plane], distances_m[distance]);
  eye.eye_m = distances_m[distance] * aside + Vec3{0, 0, below_m};
  eye.threshold = threshold;
  eye.background = background;
  eye.line_of_sight = -1 * aside;
  eye.up = {0, 0, -1};
  eye.opening_m = opening_m;
  return eye;
}

Asked ReadAsked(const Config& config, const RegulationFile& regulation_file) {
  Asked asked;
  for (const Config& table : config.Tables("weighting"))
    asked.weightings.push_back(ReadWeighting(table, asked.weightings));
  for (const Config& table : config.Tables("point"))
    asked.points.push_back(ReadPointAsked(table, asked.weightings));
  for (const Config& table : config.Tables("line"))
    asked.lines.push_back(ReadLineAsked(table, asked.weightings));
  for (const Config& table : config.Tables("volume"))
    asked.volumes.push_back(ReadVolumeAsked(table, asked.weightings));
  for (const Config& table : config.Tables("path"))
    asked.paths.push_back(ReadPathAsked(table, asked.weightings));
  for (const Config& table : config.Tables("plane"))
    asked.planes.push_back(ReadPlaneAsked(table, asked.weightings));
  for (const Config& table : config.Tables("eye")) asked.eyes.push_back(ReadEyeAsked(table));
  for (const Config& table : config.Tables("glare")) asked.glare.push_back(ReadGlareAsked(table));
  for (const Config& table : config.Tables("headlamp"))
    asked.headlamps.push_back(ReadHeadlampAsked(table, regulation_file));
  if (const auto quality = config.OptionalTable("quality"))
    asked.quality = ReadQualityAsked(*quality);
  if (const auto certificate = config.OptionalTable("certificate"))
    for (const CertificateText& text : kCertificateTexts)
      if (certificate->Has(text.key)) asked.certificate[text.key] = certificate->Text(text.key);
  config.Finish();
  return asked;
}

EyeAsked EyeBefore(double distance_m) {
  EyeAsked eye;
  eye.name = fmt::format("eye {:.4g} m before the lamp", distance_m);
  eye.eye_m = {0, 0, distance_m};
  eye.up = {0, 1, 0};
  eye.fields_of_view_mrad = kFieldsOfView_mrad;
  eye.threshold = kGlaring;
  eye.age_years = kAge_years;
  return eye;
}

PlaneAsked PlaneBefore(double distance_m, double width_m, double height_m, int columns, int rows) {
  return {fmt::format("plane {:.4g} m before the lamp", distance_m),
          {0, 0, distance_m},
          {1, 0, 0},
          {0, 1, 0},
          width_m,
          height_m,
          columns,
          rows};
}

}  // namespace luxfield::photometry
