#include "luxfield/reconstruct/calibrate/geometry/geometry_start.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <opencv2/calib3d.hpp>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr std::size_t kFewestCorners = 12;

[[noreturn]] void Refuse(const std::string& problem, const std::string& remedy) {
  throw InputError("calibration", problem, remedy);
}

void StartLens(const GeometryTargets& targets, const std::vector<ChessboardView>& views, int width,
               int height, GeometryState& s) {
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;
  std::vector<int> boards;
  for (const ChessboardView& view : views) {
    if (view.mask || view.corners.size() < kFewestCorners) continue;
    auto& from = object.emplace_back();
    auto& to = image.emplace_back();
    for (const Corner& c : view.corners) {
      from.emplace_back(static_cast<float>(c.i * targets.board->pitch_m),
                        static_cast<float>(c.j * targets.board->pitch_m), 0.0f);
      // OpenCV's pixels have their centres at whole numbers.
      to.emplace_back(static_cast<float>(c.at.x - 0.5), static_cast<float>(c.at.y - 0.5));
    }
    boards.push_back(view.board);
  }
  constexpr int kFewestBoards = 3;
  if (static_cast<int>(boards.size()) < kFewestBoards)
    Refuse(
        fmt::format("the board was found in {} views, {} are needed", boards.size(), kFewestBoards),
        "check its size in the plan, its light and its focus");
  if (std::find(boards.begin(), boards.end(), 0) == boards.end())
    Refuse("the board was not found on the image plane", "check its light, and capture again");
  cv::Mat matrix, distortion;
  std::vector<cv::Mat> rotations, translations;
  cv::calibrateCamera(object, image, {width, height}, matrix, distortion, rotations, translations,
                      cv::CALIB_FIX_K3);
  s.lens = {matrix.at<double>(0, 0),       matrix.at<double>(1, 1),  matrix.at<double>(0, 2) + 0.5,
            matrix.at<double>(1, 2) + 0.5, distortion.at<double>(0), distortion.at<double>(1),
            distortion.at<double>(2),      distortion.at<double>(3)};
  for (std::size_t n = 0; n < boards.size(); ++n) {
    auto& pose = s.boards[boards[n]];
    for (int k = 0; k < 3; ++k) {
      pose[k] = rotations[n].at<double>(k);
      pose[3 + k] = translations[n].at<double>(k);
    }
  }
}

// P on the plane that a pixel sees.
Vec2 PlaneFromPixel(const GeometryState& s, Vec2 pixel) {
  if (!s.has_lens) return {pixel.x * s.pitch_m.x, pixel.y * s.pitch_m.y};
  const Vec2 ray = LensOf(s).RayOf(pixel);
  const auto& pose = s.boards.at(0);
  cv::Mat r;
  cv::Rodrigues(cv::Vec3d(pose[0], pose[1], pose[2]), r);
  Eigen::Matrix3d m;  // columns: the board's axes and its origin
  for (int k = 0; k < 3; ++k) m.row(k) << r.at<double>(k, 0), r.at<double>(k, 1), pose[3 + k];
  const Eigen::Vector3d p = m.inverse() * Eigen::Vector3d(ray.x, ray.y, 1);
  return {p[0] / p[2], p[1] / p[2]};
}

// P' = z m + b, complex numbers for points of the plane.
struct Similarity {
  std::complex<double> z, b;
};

Similarity FitSimilarity(const GeometryTargets& targets, const GeometryState& s,
                         const ChessboardView& view) {
  std::complex<double> mean_m = 0, mean_p = 0;
  std::vector<std::complex<double>> m, p;
  for (const Corner& c : view.corners) {
    m.emplace_back((c.i - 0.5 * (targets.mask.columns - 1)) * targets.mask.pitch_m,
                   (c.j - 0.5 * (targets.mask.rows - 1)) * targets.mask.pitch_m);
    const Vec2 at = PlaneFromPixel(s, c.at);
    p.emplace_back(at.x, s.side * at.y);
    mean_m += m.back();
    mean_p += p.back();
  }
  const auto count = static_cast<double>(m.size());
  mean_m /= count;
  mean_p /= count;
  std::complex<double> above = 0;
  double below = 0;
  for (std::size_t k = 0; k < m.size(); ++k) {
    above += std::conj(m[k] - mean_m) * (p[k] - mean_p);
    below += std::norm(m[k] - mean_m);
  }
  Similarity fit{above / below, 0};
  fit.b = mean_p - fit.z * mean_m;
  return fit;
}

void StartFilter(const GeometryTargets& targets, const std::vector<ChessboardView>& views,
                 GeometryState& s) {
  struct Shadow {
    const ChessboardView* view;
    Similarity map;
  };
  std::vector<Shadow> shadows;
  double magnification[2] = {0, 0};
  int count[2] = {0, 0};
  std::complex<double> turn = 0;
  for (const ChessboardView& view : views) {
    if (!view.mask) continue;
    s.arrivals[view.arrival] = {0, 0};
    if (view.corners.size() < kFewestCorners) continue;
    shadows.push_back({&view, FitSimilarity(targets, s, view)});
    const auto z = shadows.back().map.z;
    magnification[view.on_spacer] += std::abs(z);
    ++count[view.on_spacer];
    turn += z / std::abs(z);
  }
  if (count[0] == 0 || count[1] == 0)
    Refuse(fmt::format("the mask's shadow was found in {} views, and in {} on its spacer", count[0],
                       count[1]),
           "check the source and the mask's size in the plan; both are needed");
  const double plain = magnification[0] / count[0], lifted = magnification[1] / count[1];
  const double ratio = lifted / plain;
  if (!(plain > 1 && ratio > 1))
    Refuse(fmt::format("the shadow is {:.4g} times the mask, and {:.4g} times on its spacer", plain,
                       lifted),
           "the spacer has to lift the mask towards the source");
  const double distance = targets.spacer_m * ratio / (ratio - 1);
  s.filter = {distance * (plain - 1), 0, 0};
  s.plane[2] = -std::arg(turn);
  s.stage = {1, 0, 0, 0, 1, 0};
  // In the axes of I the shadow's middle is -(S - c) k - o, k the magnification less 1.
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(2 * static_cast<int>(shadows.size()), 4);
  Eigen::VectorXd right(2 * static_cast<int>(shadows.size()));
  for (std::size_t n = 0; n < shadows.size(); ++n) {
    const ChessboardView& view = *shadows[n].view;
    const double k = (view.on_spacer ? lifted : plain) - 1;
    const auto middle = std::polar(1.0, s.plane[2]) * shadows[n].map.b;
    const auto row = static_cast<Eigen::Index>(2 * n);
    left.row(row) << -k, 0, -1, 0;
    left.row(row + 1) << 0, -k, 0, -1;
    right[row] = middle.real() - k * view.setpoint_m.x;
    right[row + 1] = middle.imag() - k * view.setpoint_m.y;
  }
  const Eigen::VectorXd x = left.colPivHouseholderQr().solve(right);
  s.source = {x[0], x[1], -distance};
  s.plane[0] = x[2];
  s.plane[1] = x[3];
}

void RequireMoves(const std::vector<ChessboardView>& views) {
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  const ChessboardView* first = nullptr;
  for (const ChessboardView& view : views) {
    if (!view.mask) continue;
    if (!first) first = &view;
    const Eigen::Vector2d move(view.setpoint_m.x - first->setpoint_m.x,
                               view.setpoint_m.y - first->setpoint_m.y);
    spread += move * move.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(spread);
  if (!(eigen.eigenvalues()[0] > 1e-6 * eigen.eigenvalues()[1]))
    Refuse("the stage moved along fewer than two directions", "plan moves along u and v");
}

}  // namespace

std::vector<std::pair<double*, int>> GeometryState::Blocks() {
  std::vector<std::pair<double*, int>> blocks;
  if (has_lens) blocks.emplace_back(lens.data(), 8);
  for (auto& [number, pose] : boards) blocks.emplace_back(pose.data(), 6);
  blocks.emplace_back(plane.data(), 3);
  blocks.emplace_back(filter.data(), 3);
  blocks.emplace_back(source.data(), 3);
  blocks.emplace_back(stage.data(), 6);
  blocks.emplace_back(spacer.data(), 3);
  for (auto& [arrival, error] : arrivals) blocks.emplace_back(error.data(), 2);
  return blocks;
}

rig::Lens LensOf(const GeometryState& s) {
  return {
      {s.lens[0], s.lens[1]}, {s.lens[2], s.lens[3]}, {s.lens[4], s.lens[5], s.lens[6], s.lens[7]}};
}

double StatedSide(const rig::Homography& image_from_sensor) {
  return image_from_sensor.AreaFactor({0, 0}) > 0 ? 1 : -1;
}

GeometryState StartGeometry(const GeometryTargets& targets,
                            const std::vector<ChessboardView>& views, int width, int height,
                            const rig::Homography& h) {
  GeometryState s;
  s.has_lens = targets.board.has_value();
  s.side = StatedSide(h);
  RequireMoves(views);
  if (s.has_lens) {
    StartLens(targets, views, width, height, s);
  } else {
    s.pitch_m = {std::hypot(h(0, 0), h(1, 0)) / std::abs(h(2, 2)),
                 std::hypot(h(0, 1), h(1, 1)) / std::abs(h(2, 2))};
    if (!(s.pitch_m.x > 0 && s.pitch_m.y > 0) || h(2, 0) != 0 || h(2, 1) != 0)
      Refuse("image_from_sensor of the session is not that of a bare sensor",
             "state its pixel pitch on the diagonal");
  }
  StartFilter(targets, views, s);
  return s;
}

}  // namespace luxfield::reconstruct
