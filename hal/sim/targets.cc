#include "luxfield/hal/sim/targets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/sim/filter_bench.h"
#include "luxfield/rig/filter_views.h"

namespace luxfield::hal::sim {
namespace {

using rig::Chessboard;

constexpr std::uint64_t kBoardStream = 6, kTrapStream = 8;
constexpr int kPointsPerAxis = 3;
constexpr double kWhite = 0.9, kBlack = 0.04, kSurround = 0.25;  // albedo of the sheet
constexpr double kClear = 0.9, kOpaque = 1e-3;                   // transmittance of the mask

// Step up at 0, smeared by a Gaussian.
double Step(double x, double sigma) {
  if (x > 5 * sigma) return 1;
  if (x < -5 * sigma) return 0;
  return 0.5 * std::erfc(-x / (std::numbers::sqrt2 * sigma));
}

// +1 from 0 to 1, -1 from 1 to 2 and so on, smeared.
double SquareWave(double x, double sigma) {
  const double edge = std::nearbyint(x);
  const double up = 2 * Step(x - edge, sigma) - 1;
  return static_cast<long>(edge) % 2 == 0 ? up : -up;
}

struct Pattern {
  double white;  // share of white
  double inside;
};

// 1 from low to high, smeared.
double Window(double x, double low, double high, double sigma) {
  return Step(x - low, sigma) - Step(x - high, sigma);
}

// A chessboard with its frame, in pitches.
Pattern ChessboardAt(const Chessboard& board, double x, double y, double sigma_x, double sigma_y) {
  const double frame =
      Window(x, -2, board.columns + 1, sigma_x) * Window(y, -2, board.rows + 1, sigma_y);
  if (frame == 0) return {0, 0};
  const double cells = Window(x, -1, board.columns, sigma_x) * Window(y, -1, board.rows, sigma_y);
  const double white = 0.5 * (1 + SquareWave(x, sigma_x) * SquareWave(y, sigma_y));
  return {frame * (1 - cells + cells * white), frame};
}

// Positions freed from distortion at all pixel corners: rays of a camera, or pixels themselves.
std::vector<Vec2> RaysOfCorners(const LabDescription& lab) {
  const int width = lab.camera.sensor.width, height = lab.camera.sensor.height;
  std::vector<Vec2> rays(static_cast<std::size_t>(width + 1) * (height + 1));
  core::ParallelFor(height + 1, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column <= width; ++column) {
        const Vec2 pixel{static_cast<double>(column), static_cast<double>(row)};
        rays[row * (width + 1) + column] =
            lab.geometry.camera ? lab.geometry.camera->lens.RayOf(pixel) : pixel;
      }
  });
  return rays;
}

rig::Homography ImageFromRay(const LabDescription& lab) {
  if (!lab.geometry.camera) return lab.geometry.image_from_sensor;
  const rig::Lens& lens = lab.geometry.camera->lens;
  return lab.geometry.image_from_sensor *
         rig::Homography(
             {lens.focal_px.x, 0, lens.centre_px.x, 0, lens.focal_px.y, lens.centre_px.y, 0, 0, 1});
}

// (x, y) on a plane with the given pose from a ray (x, y, 1).
rig::Homography PlaneFromRay(const BoardPose& pose) {
  const Rotation& r = pose.rotation;
  const Vec3 t = pose.translation, n{r[2], r[5], r[8]}, ex{r[0], r[3], r[6]}, ey{r[1], r[4], r[7]};
  const double distance = Dot(n, t);
  return {{ex.x * distance - Dot(ex, t) * n.x, ex.y * distance - Dot(ex, t) * n.y,
           ex.z * distance - Dot(ex, t) * n.z, ey.x * distance - Dot(ey, t) * n.x,
           ey.y * distance - Dot(ey, t) * n.y, ey.z * distance - Dot(ey, t) * n.z, n.x, n.y, n.z}};
}

struct Mask {
  Vec3 source;
  rig::Homography mask_from_image;
};

// Where the line from the source to q on I crosses the mask.
Mask MaskOf(const LabDescription& lab, const TargetShot& shot, bool on_spacer) {
  const BenchGeometry& g = lab.geometry;
  const Rotation axes = AboutY(g.filter_tilt_rad.y) * AboutX(g.filter_tilt_rad.x);
  const Vec3 ex = axes * Vec3{1, 0, 0}, ey = axes * Vec3{0, 1, 0}, n = axes * Vec3{0, 0, 1};
  Vec3 centre{0, 0, -g.delta_m};
  if (on_spacer)
    centre =
        centre - lab.targets->spacer_m * n + shot.spacer_shift.x * ex + shot.spacer_shift.y * ey;
  Mask mask;
  mask.source = Vec3{0, 0, -g.delta_m} + lab.target_light.source_m + shot.source_shift;
  const double height = Dot(n, centre - mask.source);
  const auto row = [&](Vec3 e) {
    const double offset = Dot(e, mask.source - centre);
    const Vec3 k = offset * n + height * e;
    return std::array{k.x, k.y, -Dot(k, mask.source)};
  };
  const auto x = row(ex), y = row(ey);
  mask.mask_from_image = {{x[0], x[1], x[2], y[0], y[1], y[2], n.x, n.y, -Dot(n, mask.source)}};
  return mask;
}

// Share of white and of the target per pixel. `sigma` blurs in pitches beside the camera's.
std::vector<Pattern> Draw(const LabDescription& lab, const Chessboard& board,
                          const rig::Homography& map, Vec2 origin, double sigma) {
  const int width = lab.camera.sensor.width, height = lab.camera.sensor.height;
  const double blur_px = lab.geometry.camera ? lab.target_light.blur_px : 0;
  const std::vector<Vec2> rays = RaysOfCorners(lab);
  std::vector<Pattern> picture(static_cast<std::size_t>(width) * height);
  core::ParallelFor(height, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < width; ++column) {
        const Vec2* top = &rays[row * (width + 1) + column];
        const Vec2* bottom = top + width + 1;
        std::array<Vec2, kPointsPerAxis * kPointsPerAxis> points;
        for (int k = 0; k < kPointsPerAxis * kPointsPerAxis; ++k) {
          const double x = (k % kPointsPerAxis + 0.5) / kPointsPerAxis,
                       y = (k / kPointsPerAxis + 0.5) / kPointsPerAxis;
          const Vec2 ray =
              (1 - y) * ((1 - x) * top[0] + x * top[1]) + y * ((1 - x) * bottom[0] + x * bottom[1]);
          points[k] = (1 / board.pitch_m) * (map.Map(ray) - origin);
        }
        // How much the pattern's coordinates change over a pixel.
        constexpr double kSpan = kPointsPerAxis / (kPointsPerAxis - 1.0);
        const Vec2 right = kSpan * (points[kPointsPerAxis - 1] - points[0]);
        const Vec2 down = kSpan * (points[kPointsPerAxis * (kPointsPerAxis - 1)] - points[0]);
        const double sigma_x = std::hypot(sigma, blur_px * std::hypot(right.x, down.x));
        const double sigma_y = std::hypot(sigma, blur_px * std::hypot(right.y, down.y));
        Pattern sum{0, 0};
        for (const Vec2 p : points) {
          const Pattern at = ChessboardAt(board, p.x, p.y, sigma_x, sigma_y);
          sum.white += at.white;
          sum.inside += at.inside;
        }
        picture[row * width + column] = {sum.white / points.size(), sum.inside / points.size()};
      }
  });
  return picture;
}

std::vector<float> PictureOfBoard(const LabDescription& lab, int board) {
  const std::vector<Pattern> picture =
      Draw(lab, *lab.targets->board, PlaneFromRay(PoseOfBoard(lab, board)), {0, 0}, 0);
  std::vector<float> light(picture.size());
  for (std::size_t k = 0; k < picture.size(); ++k)
    light[k] = static_cast<float>(lab.target_light.room_irradiance *
                                  (picture[k].white * kWhite +
                                   (picture[k].inside - picture[k].white) * kBlack +
                                   (1 - picture[k].inside) * kSurround));
  return light;
}

std::vector<float> PictureOfMask(const LabDescription& lab, const TargetShot& shot,
                                 bool on_spacer) {
  const Chessboard& board = lab.targets->mask;
  const Mask mask = MaskOf(lab, shot, on_spacer);
  const rig::Homography image_from_ray = ImageFromRay(lab);
  const Vec2 origin{-0.5 * (board.columns - 1) * board.pitch_m,
                    -0.5 * (board.rows - 1) * board.pitch_m};
  const double delta = lab.geometry.delta_m + (on_spacer ? lab.targets->spacer_m : 0);
  // The disc of the source seen from I, on the mask.
  const double penumbra = lab.target_light.source_rms_m * delta / -mask.source.z;
  const std::vector<Pattern> picture =
      Draw(lab, board, mask.mask_from_image * image_from_ray, origin, penumbra / board.pitch_m);
  const double albedo = lab.rig == rig::RigKind::kReflector ? lab.albedo : 1;
  std::vector<float> light(picture.size());
  for (std::size_t k = 0; k < picture.size(); ++k) {
    const Vec2 q =
        lab.geometry.ImageFromSensor(static_cast<double>(k % lab.camera.sensor.width) + 0.5,
                                     static_cast<double>(k / lab.camera.sensor.width) + 0.5);
    const Vec3 way = Vec3{q.x, q.y, 0} - mask.source;
    const double length = Length(way);
    light[k] = static_cast<float>(albedo * lab.target_light.source_intensity * way.z /
                                  (length * length * length) *
                                  (kOpaque + (kClear - kOpaque) * picture[k].white));
  }
  return light;
}

// The screen under even light, with a hole that gives nothing back.
std::vector<float> PictureOfTrap(const LabDescription& lab, int trap) {
  const int width = lab.camera.sensor.width, height = lab.camera.sensor.height;
  core::Random random(lab.seed, kTrapStream, static_cast<std::uint32_t>(trap));
  const double column = (0.2 + 0.6 * random.Uniform()) * width,
               row = (0.2 + 0.6 * random.Uniform()) * height;
  const Vec2 centre = lab.geometry.ImageFromSensor(column, row);
  const double radius = lab.target_light.trap_radius_m;
  const auto light = static_cast<float>(lab.albedo * lab.target_light.room_irradiance);
  std::vector<float> picture(static_cast<std::size_t>(width) * height);
  core::ParallelFor(height, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r)
      for (int c = 0; c < width; ++c) {
        int lit = 0;
        for (int k = 0; k < kPointsPerAxis * kPointsPerAxis; ++k) {
          const Vec2 q = lab.geometry.ImageFromSensor(
              c + (k % kPointsPerAxis + 0.5) / kPointsPerAxis,
              static_cast<double>(r) + (k / kPointsPerAxis + 0.5) / kPointsPerAxis);
          lit += std::hypot(q.x - centre.x, q.y - centre.y) > radius;
        }
        picture[r * width + c] =
            light * static_cast<float>(lit) / (kPointsPerAxis * kPointsPerAxis);
      }
  });
  return picture;
}

}  // namespace

BoardPose PoseOfBoard(const LabDescription& lab, int board_number) {
  const Chessboard& board = *lab.targets->board;
  const PlacedLens& camera = *lab.geometry.camera;
  const int width = lab.camera.sensor.width, height = lab.camera.sensor.height;
  const Vec3 middle{0.5 * (board.columns - 1) * board.pitch_m,
                    0.5 * (board.rows - 1) * board.pitch_m, 0};
  const auto fits = [&](const BoardPose& pose) {
    for (const double x : {-2.0, board.columns + 1.0})
      for (const double y : {-2.0, board.rows + 1.0}) {
        const Vec3 at =
            pose.rotation * Vec3{x * board.pitch_m, y * board.pitch_m, 0} + pose.translation;
        if (!(at.z > 0)) return false;
        const Vec2 p = camera.lens.PixelOf({at.x / at.z, at.y / at.z});
        if (!(p.x > 3 && p.y > 3 && p.x < width - 3 && p.y < height - 3)) return false;
      }
    return true;
  };
  // Where the middle of the picture meets I.
  const Vec2 q = lab.geometry.ImageFromSensor(0.5 * width, 0.5 * height);
  const Vec3 on_image = camera.rotation * Vec3{q.x, q.y, 0} + camera.translation;
  const bool from_lamp = camera.rotation[8] > 0;  // the camera looks along the light
  const Rotation flat =
      camera.rotation * (from_lamp ? AboutZ(std::numbers::pi) : AboutX(std::numbers::pi));
  constexpr double kDegree = std::numbers::pi / 180;
  core::Random random(lab.seed, kBoardStream, static_cast<std::uint32_t>(board_number));
  const auto between = [&](double low, double high) {
    return low + (high - low) * random.Uniform();
  };
  for (int attempt = 0; attempt < 20000; ++attempt) {
    BoardPose pose;
    Vec3 centre;
    if (board_number == 0) {
      pose.rotation = flat * AboutZ(between(-8, 8) * kDegree);
      const Vec3 beside{between(-0.05, 0.05) * on_image.z, between(-0.05, 0.05) * on_image.z, 0};
      centre = on_image + flat * beside;
    } else {
      pose.rotation = AboutX(between(-40, 40) * kDegree) * AboutY(between(-40, 40) * kDegree) *
                      AboutZ(between(-25, 25) * kDegree);
      const double distance = between(0.55, 0.95) * on_image.z;
      const Vec2 ray =
          camera.lens.RayOf({between(0.15, 0.85) * width, between(0.15, 0.85) * height});
      centre = {ray.x * distance, ray.y * distance, distance};
    }
    pose.translation = centre - pose.rotation * middle;
    if (fits(pose)) return pose;
  }
  throw InputError(lab.name, "the calibration board does not fit into the camera's picture",
                   "lower targets.board.pitch_m");
}

std::vector<std::string> TargetPositions(const LabDescription& lab) {
  std::vector<std::string> names{"none"};
  if (lab.targets) names = rig::TargetNames(*lab.targets);
  if (lab.filter_bench_irradiance)
    for (const std::string& view : rig::FilterViewNames(lab.filter.dual)) names.push_back(view);
  return names;
}

std::vector<float> PictureOfTarget(const LabDescription& lab, const TargetShot& shot) {
  const std::string name = TargetPositions(lab)[static_cast<std::size_t>(shot.target)];
  if (name == "filter minus") return PictureOfFilter(lab, FilterBench::View::kMinus);
  if (name.starts_with("filter "))
    return PictureOfFilter(
        lab, name == "filter holder" ? FilterBench::View::kLight : FilterBench::View::kPlus);
  const int boards = lab.targets->board ? lab.targets->board_poses + 1 : 0;
  if (shot.target <= boards) return PictureOfBoard(lab, shot.target - 1);
  if (shot.target > boards + 2) return PictureOfTrap(lab, shot.target - boards - 3);
  return PictureOfMask(lab, shot, shot.target == boards + 2);
}

}  // namespace luxfield::hal::sim
