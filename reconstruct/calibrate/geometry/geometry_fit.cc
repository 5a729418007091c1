#include "luxfield/reconstruct/calibrate/geometry/geometry_fit.h"

#include <ceres/rotation.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_figures.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_start.h"
#include "luxfield/reconstruct/calibrate/geometry/shadow.h"
#include "luxfield/reconstruct/calibrate/least_squares.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;
using rig::Lens;

constexpr int kRounds = 4;  // of solve, factors of the noise, corners left out
constexpr double kOutlier_sigmas = 5;

// Turns a residual in pixels into one of unit variance, by the corner's own covariance.
struct Whitening {
  double a = 1, b = 0, c = 1;  // lower triangle of the inverse of the covariance's Cholesky factor

  explicit Whitening(const Corner& corner) {
    const double l11 = std::sqrt(corner.variance_x_px2), l21 = corner.covariance_px2 / l11,
                 l22 = std::sqrt(corner.variance_y_px2 - l21 * l21);
    a = 1 / l11;
    c = 1 / l22;
    b = -l21 / (l11 * l22);
  }
  template <typename T>
  void Apply(const T& x, const T& y, double weight, T* residual) const {
    residual[0] = weight * a * x;
    residual[1] = weight * (b * x + c * y);
  }
};

template <typename T>
std::array<T, 2> Project(const T* lens, const T* pose, const T* point) {
  T p[3];
  ceres::AngleAxisRotatePoint(pose, point, p);
  for (int k = 0; k < 3; ++k) p[k] += pose[3 + k];
  const std::array<T, 4> distortion{lens[4], lens[5], lens[6], lens[7]};
  const auto [x, y] = rig::Distort(distortion, T(p[0] / p[2]), T(p[1] / p[2]));
  return {lens[0] * x + lens[2], lens[1] * y + lens[3]};
}

// P from q (geometry_fit.h).
template <typename T>
std::array<T, 2> PlaneFromImage(const T* plane, double side, const std::array<T, 2>& q) {
  using std::cos;
  using std::sin;
  const T c = cos(plane[2]), s = sin(plane[2]), x = q[0] - plane[0], y = q[1] - plane[1];
  return {c * x + s * y, side * (c * y - s * x)};
}

struct BoardCorner {
  double x, y;
  Vec2 at;
  Whitening whitening;
  const double* weight;

  template <typename T>
  bool operator()(const T* lens, const T* pose, T* residual) const {
    const T point[3] = {T(x), T(y), T(0)};
    const auto p = Project(lens, pose, point);
    whitening.Apply(T(at.x - p[0]), T(at.y - p[1]), *weight, residual);
    return true;
  }
};

struct ShadowPlace {
  MaskPoint point;
  double side;

  template <typename T>
  std::array<T, 2> operator()(const T* plane, const T* filter, const T* source, const T* stage,
                              const T* spacer, const T* error) const {
    return PlaneFromImage(plane, side,
                          ShadowOnImage<T>({filter, source, stage, spacer, error}, point));
  }
};

ShadowPlace PlaceOf(const Corner& corner, const ChessboardView& view,
                    const GeometryTargets& targets, double side) {
  const auto& mask = targets.mask;
  return {{(corner.i - 0.5 * (mask.columns - 1)) * mask.pitch_m,
           (corner.j - 0.5 * (mask.rows - 1)) * mask.pitch_m, view.setpoint_m.x, view.setpoint_m.y,
           targets.spacer_m, view.on_spacer},
          side};
}

struct ShadowThroughLens {
  ShadowPlace place;
  Vec2 at;
  Whitening whitening;
  const double* weight;

  template <typename T>
  bool operator()(const T* lens, const T* pose, const T* plane, const T* filter, const T* source,
                  const T* stage, const T* spacer, const T* error, T* residual) const {
    const auto on_plane = place(plane, filter, source, stage, spacer, error);
    const T point[3] = {on_plane[0], on_plane[1], T(0)};
    const auto p = Project(lens, pose, point);
    whitening.Apply(T(at.x - p[0]), T(at.y - p[1]), *weight, residual);
    return true;
  }
};

struct ShadowOnSensor {
  ShadowPlace place;
  Vec2 at, pitch_m;
  Whitening whitening;
  const double* weight;

  template <typename T>
  bool operator()(const T* plane, const T* filter, const T* source, const T* stage, const T* spacer,
                  const T* error, T* residual) const {
    const auto p = place(plane, filter, source, stage, spacer, error);
    whitening.Apply(T(at.x - p[0] / pitch_m.x), T(at.y - p[1] / pitch_m.y), *weight, residual);
    return true;
  }
};

struct Prior {
  double weight;
  template <typename T>
  bool operator()(const T* block, T* residual) const {
    residual[0] = weight * block[0];
    residual[1] = weight * block[1];
    return true;
  }
};

class Fit {
 public:
  Fit(const GeometryTargets& targets, const std::vector<ChessboardView>& views, int width,
      int height, const rig::Homography& stated)
      : targets_(targets),
        views_(views),
        state_(StartGeometry(targets, views, width, height, stated)) {
    width_ = width;
    height_ = height;
    for (const ChessboardView& view : views)
      left_out_.emplace_back(view.corners.size(), static_cast<char>(0));
  }

  Geometry Run() {
    Solve();
    for (int round = 0; round < kRounds; ++round) {
      MeasureNoise();
      if (round + 1 < kRounds) LeaveOut();
      Solve();
    }
    MeasureNoise();
    return Result();
  }

 private:
  struct Term {
    ceres::ResidualBlockId id;
    int view;
    int corner;
  };

  void Build() {
    problem_ = std::make_unique<ceres::Problem>();
    terms_.clear();
    GeometryState& s = state_;
    for (std::size_t n = 0; n < views_.size(); ++n) {
      const ChessboardView& view = views_[n];
      const double* weight = &weight_[view.mask];
      for (std::size_t k = 0; k < view.corners.size(); ++k) {
        if (left_out_[n][k]) continue;
        const Corner& corner = view.corners[k];
        const Whitening whitening(corner);
        ceres::ResidualBlockId id;
        if (!view.mask) {
          const double pitch = targets_.board->pitch_m;
          id = problem_->AddResidualBlock(
              new ceres::AutoDiffCostFunction<BoardCorner, 2, 8, 6>(new BoardCorner{
                  corner.i * pitch, corner.j * pitch, corner.at, whitening, weight}),
              nullptr, s.lens.data(), s.boards.at(view.board).data());
        } else {
          const ShadowPlace place = PlaceOf(corner, view, targets_, s.side);
          double* error = s.arrivals.at(view.arrival).data();
          if (s.has_lens)
            id = problem_->AddResidualBlock(
                new ceres::AutoDiffCostFunction<ShadowThroughLens, 2, 8, 6, 3, 3, 3, 6, 3, 2>(
                    new ShadowThroughLens{place, corner.at, whitening, weight}),
                nullptr, s.lens.data(), s.boards.at(0).data(), s.plane.data(), s.filter.data(),
                s.source.data(), s.stage.data(), s.spacer.data(), error);
          else
            id = problem_->AddResidualBlock(
                new ceres::AutoDiffCostFunction<ShadowOnSensor, 2, 3, 3, 3, 6, 3, 2>(
                    new ShadowOnSensor{place, corner.at, s.pitch_m, whitening, weight}),
                nullptr, s.plane.data(), s.filter.data(), s.source.data(), s.stage.data(),
                s.spacer.data(), error);
        }
        terms_.push_back({id, static_cast<int>(n), static_cast<int>(k)});
      }
    }
    AddPriors();
  }

  // What is known beforehand: the stage's and the spacer's repeatability. A nanometre stands for 0.
  void AddPriors() {
    constexpr double kExact_m = 1e-9;
    GeometryState& s = state_;
    for (auto& [arrival, error] : s.arrivals)
      problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 2, 2>(new Prior{
                                     1 / std::max(kExact_m, targets_.stage_repeatability_m)}),
                                 nullptr, error.data());
    problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 2, 3>(
                                   new Prior{1 / std::max(kExact_m, targets_.spacer_shift_m)}),
                               nullptr, s.spacer.data());
  }

  void Solve() {
    Build();
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-14;
    options.gradient_tolerance = 1e-14;
    options.parameter_tolerance = 1e-13;
    if (SolveLeastSquares(options, problem_.get()) != ceres::CONVERGENCE)
      throw InputError("calibration", "the geometry's fit does not converge",
                       "check that the targets are those that the plan names");
  }

  // Jacobian of all residuals, priors last, and the inverse of its normal matrix.
  void Evaluate() {
    ceres::Problem::EvaluateOptions options;
    for (const auto& [block, size] : state_.Blocks()) options.parameter_blocks.push_back(block);
    for (const Term& term : terms_) options.residual_blocks.push_back(term.id);
    std::vector<ceres::ResidualBlockId> all;
    problem_->GetResidualBlocks(&all);
    const std::set<ceres::ResidualBlockId> corners(options.residual_blocks.begin(),
                                                   options.residual_blocks.end());
    for (const auto& id : all)
      if (!corners.contains(id)) options.residual_blocks.push_back(id);
    ceres::CRSMatrix crs;
    double cost = 0;
    problem_->Evaluate(options, &cost, &residuals_, nullptr, &crs);
    jacobian_ = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
    for (int row = 0; row < crs.num_rows; ++row)
      for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k)
        jacobian_(row, crs.cols[k]) = crs.values[k];
    // Columns to unit length: metres, radians and pixels differ by many decades.
    const Eigen::VectorXd scale = jacobian_.colwise().norm().cwiseMax(1e-300).cwiseInverse();
    const Eigen::MatrixXd scaled = jacobian_ * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled.transpose() * scaled);
    if (!(eigen.eigenvalues().minCoeff() > 1e-13 * eigen.eigenvalues().maxCoeff()))
      throw InputError("calibration", "the views leave a part of the geometry undetermined",
                       "move the stage along both axes, tilt the board, and take the mask with and "
                       "without its spacer");
    covariance_ = scale.asDiagonal() * eigen.eigenvectors() *
                  eigen.eigenvalues().cwiseInverse().asDiagonal() *
                  eigen.eigenvectors().transpose() * scale.asDiagonal();
  }

  // The factor of each kind of target that makes its chi^2 its degrees of freedom.
  void MeasureNoise() {
    Evaluate();
    for (const bool mask : {false, true}) {
      double chi = 0, degrees = 0;
      for (std::size_t t = 0; t < terms_.size(); ++t) {
        if (views_[terms_[t].view].mask != mask) continue;
        for (int axis = 0; axis < 2; ++axis) {
          const auto row = static_cast<Eigen::Index>(2 * t + axis);
          chi += residuals_[row] * residuals_[row];
          degrees += 1 - jacobian_.row(row) * covariance_ * jacobian_.row(row).transpose();
        }
      }
      chi_[mask] = chi;
      degrees_[mask] = degrees;
      if (degrees > 0) weight_[mask] *= std::sqrt(degrees / chi);
    }
  }

  Vec2 ResidualPx(std::size_t view, std::size_t corner) const {
    const ChessboardView& v = views_[view];
    return v.corners[corner].at - Predict(targets_, state_, v, v.corners[corner]);
  }

  void LeaveOut() {
    for (std::size_t n = 0; n < views_.size(); ++n)
      for (std::size_t k = 0; k < views_[n].corners.size(); ++k) {
        const Vec2 off = ResidualPx(n, k);
        double sigmas[2];
        Whitening(views_[n].corners[k]).Apply(off.x, off.y, weight_[views_[n].mask], sigmas);
        left_out_[n][k] = std::hypot(sigmas[0], sigmas[1]) > kOutlier_sigmas;
      }
  }

  Geometry Result() {
    Geometry g;
    g.width = width_;
    g.height = height_;
    FillFigures(state_, covariance_, g);
    for (const bool mask : {false, true}) {
      DetectionNoise& noise = mask ? g.masks : g.boards;
      noise.factor = 1 / weight_[mask];
      noise.degrees = degrees_[mask];
      double squares = 0, variance = 0;
      for (std::size_t n = 0; n < views_.size(); ++n)
        for (std::size_t k = 0; k < views_[n].corners.size(); ++k) {
          if (views_[n].mask != mask) continue;
          if (left_out_[n][k]) {
            ++noise.left_out;
            continue;
          }
          ++noise.corners;
          const Vec2 off = ResidualPx(n, k);
          const Corner& corner = views_[n].corners[k];
          squares += off.x * off.x + off.y * off.y;
          variance += corner.variance_x_px2 + corner.variance_y_px2;
        }
      if (noise.corners == 0) continue;
      noise.rms_px = std::sqrt(squares / (2 * noise.corners));
      noise.predicted = std::sqrt(variance / (2 * noise.corners));
    }
    for (const double r : residuals_) g.chi_squared += r * r;
    g.degrees = static_cast<double>(residuals_.size()) - static_cast<double>(jacobian_.cols());
    for (std::size_t n = 0; n < views_.size(); ++n) {
      auto& rows = g.residuals.emplace_back();
      for (std::size_t k = 0; k < views_[n].corners.size(); ++k) {
        const Corner& corner = views_[n].corners[k];
        const double sigma = std::sqrt(0.5 * (corner.variance_x_px2 + corner.variance_y_px2)) /
                             weight_[views_[n].mask];
        rows.push_back(
            {corner.i, corner.j, corner.at, ResidualPx(n, k), sigma, left_out_[n][k] != 0});
      }
    }
    return g;
  }

  const GeometryTargets& targets_;
  const std::vector<ChessboardView>& views_;
  GeometryState state_;
  int width_ = 0, height_ = 0;
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<Term> terms_;
  std::vector<std::vector<char>> left_out_;
  double weight_[2] = {1, 1};  // of boards and masks
  double chi_[2] = {0, 0}, degrees_[2] = {0, 0};
  std::vector<double> residuals_;
  Eigen::MatrixXd jacobian_, covariance_;
};

}  // namespace

Vec2 Predict(const GeometryTargets& targets, const GeometryState& s, const ChessboardView& view,
             const Corner& corner) {
  std::array<double, 2> p;
  double point[3] = {0, 0, 0};
  if (!view.mask) {
    point[0] = corner.i * targets.board->pitch_m;
    point[1] = corner.j * targets.board->pitch_m;
    p = Project(s.lens.data(), s.boards.at(view.board).data(), point);
    return {p[0], p[1]};
  }
  const ShadowPlace place = PlaceOf(corner, view, targets, s.side);
  p = place(s.plane.data(), s.filter.data(), s.source.data(), s.stage.data(), s.spacer.data(),
            s.arrivals.at(view.arrival).data());
  if (!s.has_lens) return {p[0] / s.pitch_m.x, p[1] / s.pitch_m.y};
  point[0] = p[0];
  point[1] = p[1];
  p = Project(s.lens.data(), s.boards.at(0).data(), point);
  return {p[0], p[1]};
}

Geometry FitGeometry(const GeometryTargets& targets, const std::vector<ChessboardView>& views,
                     int width, int height, const rig::Homography& image_from_sensor) {
  return Fit(targets, views, width, height, image_from_sensor).Run();
}

}  // namespace luxfield::reconstruct
