#include "luxfield/reconstruct/budget/geometry_uncertainty.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/budget/stage_sensitivity.h"

namespace luxfield::reconstruct {
namespace {

using core::Field;
using core::Json;
using lightfield::Lattice;
using lightfield::Measurements;
using lightfield::Vec2;
using lightfield::Vec3;
using rig::Lens;

// The parameters that merging uses, in either rig's file; the others are passed over.
constexpr std::array<const char*, 14> kCamera = {
    "focal_x", "focal_y",  "centre_x", "centre_y", "k1",         "k2",          "p1",
    "p2",      "camera_s", "camera_t", "camera_z", "camera_pan", "camera_tilt", "camera_roll"};
constexpr std::array<const char*, 3> kSensor = {"sensor_s", "sensor_t", "sensor_turn"};
constexpr std::array<const char*, 5> kBench = {"delta", "stage_scale_u", "stage_scale_v",
                                               "stage_turn", "stage_skew"};

std::array<Vec2, 2> StageAxes(double scale_u, double scale_v, double turn, double skew) {
  return {{{scale_u * std::cos(turn), scale_u * std::sin(turn)},
           {-scale_v * std::sin(turn + skew), scale_v * std::cos(turn + skew)}}};
}

}  // namespace

// values_ and the directions' parameters hold the rig's own first, then those of kBench.
struct GeometryUncertainty::Camera {
  Lens lens;
  std::array<Vec3, 3> image_from_camera;  // columns
  Vec3 at;

  Vec2 PlaceOf(Vec2 pixel) const {
    const Vec2 ray = lens.RayOf(pixel);
    const auto& [x, y, z] = image_from_camera;
    const Vec3 d{ray.x * x.x + ray.y * y.x + z.x, ray.x * x.y + ray.y * y.y + z.y,
                 ray.x * x.z + ray.y * y.z + z.z};
    return {at.x - at.z * d.x / d.z, at.y - at.z * d.y / d.z};
  }

  Vec2 PixelOf(Vec2 place) const {
    const Vec3 d{place.x - at.x, place.y - at.y, -at.z};
    const auto along = [&](const Vec3& axis) { return d.x * axis.x + d.y * axis.y + d.z * axis.z; };
    const double depth = along(image_from_camera[2]);
    return lens.PixelOf({along(image_from_camera[0]) / depth, along(image_from_camera[1]) / depth});
  }
};

GeometryUncertainty::Camera GeometryUncertainty::CameraOf(const std::vector<double>& p) const {
  Camera camera{{{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5], p[6], p[7]}}, {}, {p[8], p[9], p[10]}};
  // Rz(roll) Rx(tilt) Ry(pan) diag(-side, -1, side), image to camera; its rows are the columns
  // back.
  const double side = camera.at.z < 0 ? 1 : -1;
  const double cp = std::cos(p[11]), sp = std::sin(p[11]), ct = std::cos(p[12]),
               st = std::sin(p[12]), cr = std::cos(p[13]), sr = std::sin(p[13]);
  const auto row = [&](double a, double b, double c) { return Vec3{-side * a, -b, side * c}; };
  camera.image_from_camera = {row(cr * cp - sr * st * sp, -sr * ct, cr * sp + sr * st * cp),
                              row(sr * cp + cr * st * sp, cr * ct, sr * sp - cr * st * cp),
                              row(-ct * sp, st, ct * cp)};
  return camera;
}

GeometryUncertainty::GeometryUncertainty(const std::filesystem::path& path) {
  const std::string file = path.string();
  const Json json = core::ReadJson(path);
  reflector_ = Field<std::string>(json, "rig", file) == "reflector";
  std::map<std::string, std::pair<std::size_t, double>> by_name;
  for (const Json& parameter : Field<Json>(json, "parameters", file)) {
    const std::size_t index = by_name.size();
    by_name[Field<std::string>(parameter, "name", file)] = {
        index, Field<double>(parameter, "value", file)};
  }
  const auto covariance = Field<std::vector<double>>(json, "covariance", file);
  if (covariance.size() != by_name.size() * by_name.size())
    throw InputError(file,
                     fmt::format("covariance has {} entries for {} parameters", covariance.size(),
                                 by_name.size()),
                     "calibrate the geometry again");
  std::vector<std::size_t> rows;
  const auto take = [&](const char* name) {
    const auto found = by_name.find(name);
    if (found == by_name.end())
      throw InputError(file, fmt::format("parameters lack '{}'", name),
                       "calibrate the geometry again");
    rows.push_back(found->second.first);
    values_.push_back(found->second.second);
  };
  if (reflector_)
    std::for_each(kCamera.begin(), kCamera.end(), take);
  else
    std::for_each(kSensor.begin(), kSensor.end(), take);
  const std::size_t bench = values_.size();
  std::for_each(kBench.begin(), kBench.end(), take);

  // Factorised as correlations: the parameters' units differ by many orders.
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd spread(count, count);
  for (Eigen::Index r = 0; r < count; ++r)
    for (Eigen::Index c = 0; c < count; ++c)
      spread(r, c) = covariance[rows[static_cast<std::size_t>(r)] * by_name.size() +
                                rows[static_cast<std::size_t>(c)]];
  const Eigen::VectorXd sigma = spread.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse = sigma.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(inverse.asDiagonal() * spread *
                                                             inverse.asDiagonal());
  for (Eigen::Index k = 0; k < count; ++k) {
    if (!(eigen.eigenvalues()[k] > 1e-12)) continue;
    const Eigen::VectorXd step =
        sigma.cwiseProduct(eigen.eigenvectors().col(k)) * std::sqrt(eigen.eigenvalues()[k]);
    GeometryDirection direction;
    direction.parameters.assign(step.data(), step.data() + count);
    direction.delta_m = direction.parameters[bench];
    // Central differences of a tenth of sigma.
    constexpr double kPart = 0.1;
    const auto axes = [&](double part) {
      std::array<double, 4> p;
      for (std::size_t n = 0; n < 4; ++n)
        p[n] = values_[bench + 1 + n] + part * direction.parameters[bench + 1 + n];
      return StageAxes(p[0], p[1], p[2], p[3]);
    };
    const auto above = axes(kPart), below = axes(-kPart);
    for (int n = 0; n < 2; ++n) direction.stage_axes[n] = (0.5 / kPart) * (above[n] - below[n]);
    directions_.push_back(std::move(direction));
  }
}

Vec2 GeometryUncertainty::PlaceOf(Vec2 pixel) const { return CameraOf(values_).PlaceOf(pixel); }

Vec2 GeometryUncertainty::PlaceError(const GeometryDirection& direction, Vec2 q) const {
  const std::vector<double>& d = direction.parameters;
  if (!reflector_)  // moved, and turned about the sensor's middle
    return {d[0] - d[2] * (q.y - values_[1]), d[1] + d[2] * (q.x - values_[0])};
  constexpr double kPart = 0.1;
  std::vector<double> above = values_, below = values_;
  for (std::size_t n = 0; n < d.size(); ++n) {
    above[n] += kPart * d[n];
    below[n] -= kPart * d[n];
  }
  const Vec2 pixel = CameraOf(values_).PixelOf(q);
  return (0.5 / kPart) * (CameraOf(above).PlaceOf(pixel) - CameraOf(below).PlaceOf(pixel));
}

namespace {

// PlaceError over all that the lattice sees, bilinear between 33 x 33 nodes: 0.3 % off where it
// grows with the third power of the radius, as a lens' does.
class PlaceErrors {
 public:
  PlaceErrors(const GeometryUncertainty& geometry, const GeometryDirection& direction, Vec2 low,
              Vec2 high)
      : low_(low), step_((1.0 / kCells) * (high - low)) {
    for (int row = 0; row <= kCells; ++row)
      for (int column = 0; column <= kCells; ++column)
        nodes_.push_back(
            geometry.PlaceError(direction, low + Vec2{column * step_.x, row * step_.y}));
  }

  Vec2 At(Vec2 q) const {
    const double x = (q.x - low_.x) / step_.x, y = (q.y - low_.y) / step_.y;
    const int column = std::clamp(static_cast<int>(x), 0, kCells - 1),
              row = std::clamp(static_cast<int>(y), 0, kCells - 1);
    const double a = x - column, b = y - row;
    const Vec2* node = nodes_.data() + row * (kCells + 1) + column;
    const Vec2 lower = (1 - a) * node[0] + a * node[1],
               upper = (1 - a) * node[kCells + 1] + a * node[kCells + 2];
    return (1 - b) * lower + b * upper;
  }

 private:
  static constexpr int kCells = 32;
  Vec2 low_, step_;
  std::vector<Vec2> nodes_;
};

}  // namespace

double GeometryVariance(const GeometryUncertainty& geometry, const Measurements& measurements,
                        const lightfield::LightField& coefficients,
                        const lightfield::Weights& weights, const PrintSensitivity& print,
                        double per_delta) {
  const auto& grid = measurements.geometry.grid;
  const Lattice& lattice = measurements.geometry.lattice;
  std::vector<Vec2> by_filter;  // dQ per metre of the filter alone
  for (int m = 0; m < grid.count(); ++m)
    by_filter.push_back(print.Shift(SumLags(coefficients, weights, m)));
  const Vec2 first = grid.centre(0, 0), last = grid.centre(grid.width - 1, grid.height - 1),
             low = lattice.centre(lattice.height - 1, 0) - last,
             high = lattice.centre(0, lattice.width - 1) - first;
  const auto& directions = geometry.directions();
  std::vector<double> squares(directions.size());
  core::ParallelFor(directions.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec2> displacement(measurements.geometry.plane_size());
    for (std::size_t n = begin; n < end; ++n) {
      const GeometryDirection& d = directions[n];
      const PlaceErrors place(geometry, d, low, high);
      double change = per_delta * d.delta_m, noise = 0;
      for (int m = 0; m < grid.count(); ++m) {
        const Vec2 centre = grid.centre(m % grid.width, m / grid.width);
        const Vec2 e = centre.x * d.stage_axes[0] + centre.y * d.stage_axes[1];
        for (int row = 0; row < lattice.height; ++row)
          for (int column = 0; column < lattice.width; ++column)
            displacement[static_cast<std::size_t>(row) * lattice.width + column] =
                e + place.At(lattice.centre(row, column) - centre);
        const ImageChange image = ChangeOfImage(measurements, weights, m, displacement);
        change -= image.value + by_filter[m].x * e.x + by_filter[m].y * e.y;
        noise += image.variance;
      }
      squares[n] = change * change - noise;
    }
  });
  double variance = 0;
  for (const double square : squares) variance += square;
  return std::max(variance, 0.0);
}

}  // namespace luxfield::reconstruct
