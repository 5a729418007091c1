#include "luxfield/reconstruct/calibrate/geometry/geometry_figures.h"

#include <Eigen/Dense>
#include <cmath>
#include <opencv2/calib3d.hpp>

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

using Matrix3 = Eigen::Matrix3d;

Matrix3 RotationOf(const double* angle_axis) {
  cv::Mat r;
  cv::Rodrigues(cv::Vec3d(angle_axis[0], angle_axis[1], angle_axis[2]), r);
  Matrix3 m;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m(row, column) = r.at<double>(row, column);
  return m;
}

// x_image = turn x_plane + shift, of points on the plane and before it.
struct Plane {
  Matrix3 turn;
  Eigen::Vector3d shift;
};

Plane PlaneOf(const GeometryState& s) {
  const double c = std::cos(s.plane[2]), n = std::sin(s.plane[2]);
  Plane plane;
  plane.turn << c, -n * s.side, 0, n, c * s.side, 0, 0, 0, s.side;
  plane.shift << s.plane[0], s.plane[1], 0;
  return plane;
}

Matrix3 ImageFromSensor(const GeometryState& s) {
  const Plane plane = PlaneOf(s);
  Matrix3 image_from_plane;
  image_from_plane << plane.turn(0, 0), plane.turn(0, 1), plane.shift[0], plane.turn(1, 0),
      plane.turn(1, 1), plane.shift[1], 0, 0, 1;
  Matrix3 plane_from_sensor;
  if (s.has_lens) {
    const auto& pose = s.boards.at(0);
    const Matrix3 r = RotationOf(pose.data());
    Matrix3 sensor_from_ray;
    sensor_from_ray << s.lens[0], 0, s.lens[2], 0, s.lens[1], s.lens[3], 0, 0, 1;
    Matrix3 ray_from_plane;
    ray_from_plane << r.col(0), r.col(1), Eigen::Vector3d(pose[3], pose[4], pose[5]);
    plane_from_sensor = (sensor_from_ray * ray_from_plane).inverse();
  } else {
    plane_from_sensor = Eigen::Vector3d(s.pitch_m.x, s.pitch_m.y, 1).asDiagonal();
  }
  const Matrix3 h = image_from_plane * plane_from_sensor;
  return h / h(2, 2);
}

Vec2 Apply(const Matrix3& h, double x, double y) {
  const Eigen::Vector3d q = h * Eigen::Vector3d(x, y, 1);
  return {q[0] / q[2], q[1] / q[2]};
}

struct Figure {
  const char *name, *unit;
  double value;
};

std::vector<Figure> Figures(const GeometryState& s, int width, int height) {
  std::vector<Figure> f;
  if (s.has_lens) {
    const char* names[8] = {"focal_x", "focal_y", "centre_x", "centre_y", "k1", "k2", "p1", "p2"};
    for (int k = 0; k < 8; ++k) f.push_back({names[k], k < 4 ? "px" : "1", s.lens[k]});
    const auto& pose = s.boards.at(0);
    const Plane plane = PlaneOf(s);
    const Matrix3 camera_from_image = RotationOf(pose.data()) * plane.turn.transpose();
    const Eigen::Vector3d at = plane.turn * (-RotationOf(pose.data()).transpose() *
                                             Eigen::Vector3d(pose[3], pose[4], pose[5])) +
                               plane.shift;
    f.push_back({"camera_s", "m", at[0]});
    f.push_back({"camera_t", "m", at[1]});
    f.push_back({"camera_z", "m", at[2]});
    // Against a camera that looks straight at I: Rz(roll) Rx(tilt) Ry(pan).
    const Matrix3 m =
        camera_from_image * Eigen::Vector3d(-s.side, -1, s.side).asDiagonal().toDenseMatrix();
    f.push_back({"camera_pan", "rad", std::atan2(-m(2, 0), m(2, 2))});
    f.push_back({"camera_tilt", "rad", std::asin(std::clamp(m(2, 1), -1.0, 1.0))});
    f.push_back({"camera_roll", "rad", std::atan2(-m(0, 1), m(1, 1))});
  } else {
    const Vec2 middle = Apply(ImageFromSensor(s), 0.5 * width, 0.5 * height);
    f.push_back({"sensor_s", "m", middle.x});
    f.push_back({"sensor_t", "m", middle.y});
    f.push_back({"sensor_turn", "rad", s.plane[2]});
  }
  f.push_back({"delta", "m", s.filter[0]});
  f.push_back({"filter_tilt_s", "rad", s.filter[1]});
  f.push_back({"filter_tilt_t", "rad", s.filter[2]});
  const double* u = s.stage.data();
  const double* v = u + 3;
  const double turn = std::atan2(u[1], u[0]);
  f.push_back({"stage_scale_u", "1", std::hypot(u[0], u[1])});
  f.push_back({"stage_scale_v", "1", std::hypot(v[0], v[1])});
  f.push_back({"stage_turn", "rad", turn});
  f.push_back({"stage_skew", "rad", std::atan2(-v[0], v[1]) - turn});
  f.push_back({"stage_slope_u", "1", u[2]});
  f.push_back({"stage_slope_v", "1", v[2]});
  return f;
}

// The figures, then the places on I of the sensor's corners and its middle.
Eigen::VectorXd Values(const GeometryState& s, int width, int height) {
  std::vector<double> values;
  for (const Figure& figure : Figures(s, width, height)) values.push_back(figure.value);
  const Matrix3 h = ImageFromSensor(s);
  const double w = width, t = height;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, std::pair{w, 0.0}, std::pair{w, t},
                             std::pair{0.0, t}, std::pair{0.5 * w, 0.5 * t}}) {
    Vec2 pixel{x, y};
    if (s.has_lens) {
      pixel = LensOf(s).Straight(pixel);
    }
    const Vec2 q = Apply(h, pixel.x, pixel.y);
    values.push_back(q.x);
    values.push_back(q.y);
  }
  return Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace

void FillFigures(const GeometryState& state, const Eigen::MatrixXd& covariance, Geometry& g) {
  const Eigen::VectorXd values = Values(state, g.width, g.height);
  Eigen::MatrixXd jacobian(values.size(), covariance.cols());
  GeometryState moved = state;
  Eigen::Index column = 0;
  for (const auto& [block, size] : moved.Blocks())
    for (int k = 0; k < size; ++k, ++column) {
      const double value = block[k], step = 0.01 * std::sqrt(covariance(column, column));
      block[k] = value + step;
      const Eigen::VectorXd above = Values(moved, g.width, g.height);
      block[k] = value - step;
      jacobian.col(column) = (above - Values(moved, g.width, g.height)) / (2 * step);
      block[k] = value;
    }
  const Eigen::MatrixXd spread = jacobian * covariance * jacobian.transpose();

  const std::vector<Figure> figures = Figures(state, g.width, g.height);
  const auto count = static_cast<Eigen::Index>(figures.size());
  for (Eigen::Index k = 0; k < count; ++k)
    g.parameters.push_back(
        {figures[k].name, figures[k].unit, figures[k].value, std::sqrt(spread(k, k))});
  for (Eigen::Index row = 0; row < count; ++row)
    for (Eigen::Index k = 0; k < count; ++k) g.covariance.push_back(spread(row, k));
  for (int place = 0; place < 5; ++place) {
    const Eigen::Index k = count + 2 * place;
    g.place_sigma_m[place] = {std::sqrt(spread(k, k)), std::sqrt(spread(k + 1, k + 1))};
  }
  const Matrix3 h = ImageFromSensor(state);
  g.image_from_sensor = rig::Homography(
      {h(0, 0), h(0, 1), h(0, 2), h(1, 0), h(1, 1), h(1, 2), h(2, 0), h(2, 1), h(2, 2)});
  if (state.has_lens) g.lens = LensOf(state);
  g.delta_m = state.filter[0];
  g.filter_tilt_rad = {state.filter[1], state.filter[2]};
  for (int k = 0; k < 2; ++k)
    g.stage_axes[k] = {state.stage[3 * k], state.stage[3 * k + 1], state.stage[3 * k + 2]};
}

}  // namespace luxfield::reconstruct
