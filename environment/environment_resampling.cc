#include "luxfield/environment/environment_resampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/environment/disc_layout.h"
#include "luxfield/environment/spherical_polygon.h"

namespace luxfield::environment {
namespace {

constexpr double kOutlineTolerance = 1e-6;
// Small pictures are cut finer, so that no outline comes near a hemisphere.
constexpr int kLeastRectanglesPerSide = 32;

void CheckFaceSize(int face_size) {
  if (face_size < 1 || face_size > 16384)
    throw InputError(
        fmt::format("cube face size {} is out of reach; choose 1 to 16384", face_size));
}

void CheckSizes(EnvironmentLayout layout, int width, int height, int face_size) {
  const auto name = EnvironmentLayoutName(layout);
  if (width < 1 || height < 1)
    throw InputError(
        fmt::format("a {} picture has {} x {} pixels; give at least one", name, width, height));
  if (layout == EnvironmentLayout::kCube && height != 6 * width)
    throw InputError(fmt::format(
        "a cube picture has {} x {} pixels; it must be a strip of six squares, N wide and 6 N high",
        width, height));
  if (FindDisc(layout) && width != height)
    throw InputError(
        fmt::format("a {} picture has {} x {} pixels; it must be square, crop it to the disc", name,
                    width, height));
  CheckFaceSize(face_size);
}

// Each of `edges`' intervals cut into `parts`.
std::vector<double> Divided(const std::vector<double>& edges, int parts) {
  std::vector<double> fine;
  for (std::size_t k = 0; k + 1 < edges.size(); ++k)
    for (int part = 0; part < parts; ++part)
      fine.push_back(edges[k] + (edges[k + 1] - edges[k]) * part / parts);
  fine.push_back(edges.back());
  return fine;
}

}  // namespace

// Shares the solid angle of spherical polygons among the texels of a cube map.
class CubeResampler::Clipper {
 public:
  explicit Clipper(int face_size) : size_(face_size) {}

  // Appends {texel, source, solid angle of the overlap}.
  void Share(std::span<const lightfield::Vec3> outline, std::uint32_t source,
             std::vector<Piece>& pieces) {
    if (outline.size() < 3) return;
    const int face = CubePointFromDirection(outline[0]).face;
    bool one_face = true;
    for (const lightfield::Vec3& vertex : outline)
      one_face &= CubePointFromDirection(vertex).face == face;
    if (one_face) return ShareOnFace(face, outline, source, pieces);
    for (int f = 0; f < 6; ++f) {
      const CubeFace& frame = kCubeFaces[f];
      polygon_.assign(outline.begin(), outline.end());
      for (const lightfield::Vec3& side : {frame.right, frame.up})
        for (const double sign : {1.0, -1.0}) {
          ClipByPlane(polygon_, frame.axis + sign * side, clipped_);
          std::swap(polygon_, clipped_);
        }
      if (polygon_.size() >= 3) ShareOnFace(f, polygon_, source, pieces);
    }
  }

 private:
  // Vertices become (column, row, 1) in texels: clipping by rows and columns is clipping by planes.
  void ShareOnFace(int f, std::span<const lightfield::Vec3> outline, std::uint32_t source,
                   std::vector<Piece>& pieces) {
    const CubeFace& frame = kCubeFaces[f];
    const double half = 0.5 * size_;
    projected_.clear();
    double low_x = size_, high_x = 0, low_y = size_, high_y = 0;
    for (const lightfield::Vec3& v : outline) {
      const double scale = half / lightfield::Dot(v, frame.axis);
      const lightfield::Vec3 p = {std::clamp(half + scale * Dot(v, frame.right), 0.0, 2 * half),
                                  std::clamp(half - scale * Dot(v, frame.up), 0.0, 2 * half), 1};
      projected_.push_back(p);
      low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x);
      low_y = std::min(low_y, p.y), high_y = std::max(high_y, p.y);
    }
    const auto first = [&](double low) { return std::min(static_cast<int>(low), size_ - 1); };
    const auto last = [&](double high) {
      return std::clamp(static_cast<int>(std::ceil(high)) - 1, 0, size_ - 1);
    };
    const int row0 = first(low_y), row1 = last(high_y), column0 = first(low_x),
              column1 = last(high_x);
    for (int row = row0; row <= row1; ++row) {
      const std::span<const lightfield::Vec3> in_row =
          Strip(projected_, row0 == row1, {0, 1, 0}, row, row_);
      for (int column = column0; column <= column1; ++column) {
        const std::span<const lightfield::Vec3> in_texel =
            Strip(in_row, column0 == column1, {1, 0, 0}, column, column_);
        const double solid_angle = std::abs(SolidAngle(in_texel));
        if (solid_angle > 0)
          pieces.push_back({static_cast<std::uint32_t>((f * size_ + row) * size_ + column), source,
                            solid_angle});
      }
    }
  }

  // The part of a polygon with k <= along . v <= k + 1.
  std::span<const lightfield::Vec3> Strip(std::span<const lightfield::Vec3> polygon, bool is_within,
                                          lightfield::Vec3 along, int k,
                                          std::vector<lightfield::Vec3>& result) {
    if (is_within) return polygon;
    ClipByPlane(polygon, along - double(k) * lightfield::Vec3{0, 0, 1}, clipped_);
    ClipByPlane(clipped_, double(k + 1) * lightfield::Vec3{0, 0, 1} - along, result);
    return result;
  }

  double SolidAngle(std::span<const lightfield::Vec3> in_texels) {
    face_.clear();
    for (const lightfield::Vec3& p : in_texels)
      face_.push_back({2 * p.x / size_ - 1, 1 - 2 * p.y / size_, 1});
    return PolygonSolidAngle(face_);
  }

  int size_;
  std::vector<lightfield::Vec3> polygon_, clipped_, projected_, row_, column_, face_;
};

CubeResampler::CubeResampler(EnvironmentLayout layout, TexelRegistration registration, int width,
                             int height, int face_size)
    : width_(width), height_(height), face_size_(face_size) {
  CheckSizes(layout, width, height, face_size);
  const TexelEdges edges = MakeTexelEdges(layout, registration, width, height);
  const int side = layout == EnvironmentLayout::kCube ? width : std::min(width, height);
  const int parts = (kLeastRectanglesPerSide + side - 1) / side;
  const std::vector<double> x = Divided(edges.x, parts), y = Divided(edges.y, parts);

  // Share every texel of the picture among the cube's.
  source_solid_angles_.resize(std::size_t(width) * height);
  std::vector<std::vector<Piece>> rows(height);
  core::ParallelFor(height, 4, [&](std::size_t begin, std::size_t end) {
    Clipper clipper(face_size);
    std::vector<lightfield::Vec3> outline;
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < width; ++column) {
        const std::size_t source = row * width + column, first_piece = rows[row].size();
        const double exact = PictureRectangleSolidAngle(
            layout, edges.x[column], edges.x[column + 1], edges.y[row], edges.y[row + 1]);
        source_solid_angles_[source] = exact;
        for (int v = 0; v < parts; ++v)
          for (int u = 0; u < parts; ++u) {
            const std::size_t i = std::size_t(column) * parts + u, j = row * parts + v;
            PictureRectangleOutline(layout, x[i], x[i + 1], y[j], y[j + 1], kOutlineTolerance,
                                    outline);
            clipper.Share(outline, static_cast<std::uint32_t>(source), rows[row]);
          }
        double shared = 0;
        for (std::size_t k = first_piece; k < rows[row].size(); ++k)
          shared += rows[row][k].solid_angle;
        for (std::size_t k = first_piece; k < rows[row].size(); ++k)
          rows[row][k].solid_angle *= exact / shared;
      }
  });

  Sort(rows);
  for (std::size_t t = 0; t < coverage_.size(); ++t)
    if (IsCovered(layout, t))
      partition_error_ = std::max(partition_error_, std::abs(double(coverage_[t]) - 1));
}

CubeResampler::CubeResampler(int width, int height, int face_size, const Outline& outline)
    : width_(width), height_(height), face_size_(face_size) {
  CheckFaceSize(face_size);
  source_solid_angles_.resize(std::size_t(width) * height);
  std::vector<std::vector<Piece>> rows(height);
  core::ParallelFor(height, 4, [&](std::size_t begin, std::size_t end) {
    Clipper clipper(face_size);
    std::vector<lightfield::Vec3> polygon;
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < width; ++column) {
        const std::size_t source = row * width + column;
        polygon.clear();
        outline(static_cast<int>(row), column, polygon);
        source_solid_angles_[source] = std::abs(PolygonSolidAngle(polygon));
        clipper.Share(polygon, static_cast<std::uint32_t>(source), rows[row]);
      }
  });
  Sort(rows);
}

// By target, sources in their order within it: counting sort.
void CubeResampler::Sort(std::vector<std::vector<Piece>>& rows) {
  const std::vector<double> texel_angles = TexelSolidAngles(face_size_);
  first_.assign(std::size_t{6} * texel_angles.size() + 1, 0);
  for (const auto& row : rows)
    for (const Piece& piece : row) ++first_[piece.target + 1];
  for (std::size_t t = 1; t < first_.size(); ++t) first_[t] += first_[t - 1];
  overlaps_.resize(first_.back());
  std::vector<std::size_t> next = first_;
  std::vector<double> covered(std::size_t{6} * texel_angles.size());
  for (auto& row : rows) {
    for (const Piece& piece : row) {
      const double weight = piece.solid_angle / texel_angles[piece.target % texel_angles.size()];
      overlaps_[next[piece.target]++] = {piece.source, static_cast<float>(weight)};
      covered[piece.target] += weight;
    }
    std::vector<Piece>().swap(row);
  }
  coverage_.assign(covered.begin(), covered.end());
}

// A fisheye covers the texels above the horizon.
bool CubeResampler::IsCovered(EnvironmentLayout layout, std::size_t texel) const {
  const std::size_t face = texel / face_size_ / face_size_, row = texel / face_size_ % face_size_;
  return layout != EnvironmentLayout::kFisheyeHemisphere || face == 4 ||
         (face < 4 && 2 * (row + 1) <= std::size_t(face_size_));
}

template <typename Weight>
CubeMap CubeResampler::Sum(const core::Image& picture, Weight weight_of) const {
  if (picture.width != width_ || picture.height != height_ ||
      (picture.channels != 1 && picture.channels != 3))
    throw InputError(
        fmt::format("a frame has {} x {} pixels and {} channels; this map takes {} x {} and 1 or 3",
                    picture.width, picture.height, picture.channels, width_, height_));
  CubeMap cube(face_size_);
  const auto red = picture.plane(0), green = picture.plane(picture.channels == 3 ? 1 : 0),
             blue = picture.plane(picture.channels == 3 ? 2 : 0);
  core::ParallelFor(cube.texel_count(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      double r = 0, g = 0, b = 0;
      for (std::size_t k = first_[t]; k < first_[t + 1]; ++k) {
        const double weight = weight_of(overlaps_[k].weight);
        const std::uint32_t source = overlaps_[k].source;
        r += weight * red[source];
        g += weight * green[source];
        b += weight * blue[source];
      }
      cube.data[3 * t] = static_cast<float>(r);
      cube.data[3 * t + 1] = static_cast<float>(g);
      cube.data[3 * t + 2] = static_cast<float>(b);
    }
  });
  return cube;
}

CubeMap CubeResampler::operator()(const core::Image& picture) const {
  return Sum(picture, [](double weight) { return weight; });
}

CubeMap CubeResampler::Variance(const core::Image& variance) const {
  return Sum(variance, [](double weight) { return weight * weight; });
}

int DefaultFaceSize(EnvironmentLayout layout, int width) {
  switch (layout) {
    case EnvironmentLayout::kCube:
      return width;
    case EnvironmentLayout::kMirrorBall:
    case EnvironmentLayout::kFisheyeHemisphere:
      return std::max(1, width / 2);
    case EnvironmentLayout::kLatitudeLongitude:
    case EnvironmentLayout::kAngularMap:
      break;
  }
  return std::max(1, width / 4);
}

}  // namespace luxfield::environment
