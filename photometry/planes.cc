#include "luxfield/photometry/planes.h"

#include <cmath>
#include <optional>

#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/light_vector_rows.h"
#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::photometry {
namespace {

using lightfield::Dot;
using lightfield::LuminaireGeometry;
using lightfield::PencilAxis;
using lightfield::PosedLightField;
using lightfield::ProjectedTexels;
using lightfield::TexelAxis;
using lightfield::Vec3;

// The plane's points as lines along x of a field's frame, y and z the same all along each.
struct Lines {
  bool by_rows = true;  // lines are the plane's rows; else its columns
  int count = 0, points = 0;
  bool one_height = false;  // z is the same for all lines
  std::vector<Vec3> own;    // [line][point], in the field's frame

  std::span<const Vec3> line(int k) const {
    return std::span(own).subspan(static_cast<std::size_t>(k) * points, points);
  }
  std::vector<double> xs(int k) const {
    std::vector<double> x;
    for (const Vec3& p : line(k)) x.push_back(p.x);
    return x;
  }
  // Where the plane keeps the point.
  std::size_t place(int k, int point) const {
    return by_rows ? static_cast<std::size_t>(k) * points + point
                   : static_cast<std::size_t>(point) * count + k;
  }
};

std::optional<Lines> LinesOf(const PosedLightField& posed, const PlaneAsked& plane) {
  constexpr double kAlong = 1e-12;
  const auto pose = posed.luminaire_from_field.Inverse();
  const Vec3 right = posed.luminaire_from_field.InverseDirection(plane.right),
             up = posed.luminaire_from_field.InverseDirection(plane.up);
  const auto along_x = [](Vec3 d) { return std::hypot(d.y, d.z) < kAlong; };
  if (!along_x(right) && !along_x(up)) return {};
  Lines lines;
  lines.by_rows = along_x(right);
  lines.count = lines.by_rows ? plane.rows : plane.columns;
  lines.points = lines.by_rows ? plane.columns : plane.rows;
  lines.one_height = std::abs((lines.by_rows ? up : right).z) < kAlong;
  for (int k = 0; k < lines.count; ++k)
    for (int point = 0; point < lines.points; ++point)
      lines.own.push_back(
          pose.Point(lines.by_rows ? plane.Point(point, k) : plane.Point(k, point)));
  return lines;
}

void AddLightVectors(const PosedLightField& posed, const PlaneAsked& plane,
                     std::vector<Vec3>* sum) {
  const auto& pose = posed.luminaire_from_field;
  const auto lines = LinesOf(posed, plane);
  if (!lines) {
    core::ParallelFor(sum->size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        (*sum)[k] =
            (*sum)[k] +
            pose.Direction(
                ClosedFormLightVector(posed.field, pose.Inverse().Point(plane.PointAt(k))).j[0]);
    });
    return;
  }
  std::optional<lightfield::LightVectorRows> shared;
  if (lines->one_height) shared.emplace(posed.field, lines->xs(0), lines->own[0].z);
  core::ParallelFor(lines->count, 1, [&](std::size_t begin, std::size_t end) {
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      const Vec3 first = lines->line(k)[0];
      std::optional<lightfield::LightVectorRows> own;
      if (!shared) own.emplace(posed.field, lines->xs(k), first.z);
      const auto row = (shared ? *shared : *own).At(first.y);
      for (int point = 0; point < lines->points; ++point) {
        Vec3& to = (*sum)[lines->place(k, point)];
        to = to + pose.Direction(row[point].j[0]);
      }
    }
  });
}

// Does the horizon of the plane cut any field's support, as seen from this point?
bool IsCut(const Lamp& lamp, Vec3 p, Vec3 n) {
  for (const PosedLightField& posed : lamp.fields)
    if (lightfield::HorizonCutsSupport(posed.field.geometry,
                                       posed.luminaire_from_field.Inverse().Point(p),
                                       posed.luminaire_from_field.InverseDirection(n)))
      return true;
  return false;
}

// Sums over points of what each basis function of an axis sees of each texel.
struct AxisSums {
  int texels = 0;
  std::vector<double> zeroth, moment;  // [function][texel]; m, m^2

  AxisSums(int functions, int texel_count)
      : texels(texel_count),
        zeroth(static_cast<std::size_t>(functions) * texel_count),
        moment(zeroth.size()) {}
  void Add(const std::vector<ProjectedTexels>& seen) {
    for (std::size_t i = 0; i < seen.size(); ++i)
      for (std::size_t k = 0; k < seen[i].size(); ++k) {
        zeroth[i * texels + seen[i].first + k] += seen[i].zeroth[k];
        moment[i * texels + seen[i].first + k] += seen[i].moment[k];
      }
  }
};

std::vector<ProjectedTexels> SeenAlongX(const LuminaireGeometry& g, double x, double z) {
  return ProjectAllTexels(g.grid.basis, g.grid.u0_m, g.grid.spacing_m, g.grid.width,
                          TexelAxis::Columns(g.lattice), PencilAxis::ThroughPoint(x, z, g.delta_m));
}
std::vector<ProjectedTexels> SeenAlongY(const LuminaireGeometry& g, double y, double z) {
  return ProjectAllTexels(g.grid.basis, g.grid.v0_m, g.grid.spacing_m, g.grid.height,
                          TexelAxis::Rows(g.lattice), PencilAxis::ThroughPoint(y, z, g.delta_m));
}

// Adds factor times the sum over points (x, y) of n . J to the weights of a field; n its own normal.
void AddSeparable(const LuminaireGeometry& g, const AxisSums& x, const AxisSums& y, double z,
                  Vec3 n, double factor, FieldFunctional* to) {
  const double scale = factor * g.delta_m / z * (g.delta_m / z);
  const auto width = static_cast<std::size_t>(g.lattice.width);
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i)
      for (int r = 0; r < g.lattice.height; ++r) {
        const double y_zeroth = y.zeroth[static_cast<std::size_t>(j) * y.texels + r],
                     y_moment = y.moment[static_cast<std::size_t>(j) * y.texels + r];
        if (y_zeroth == 0 && y_moment == 0) continue;
        const double* x_zeroth = &x.zeroth[i * width];
        const double* x_moment = &x.moment[i * width];
        double* w =
            &to->weights[(g.grid.index(i, j) * static_cast<std::size_t>(g.lattice.height) + r) *
                         width];
        const double of_zeroth = scale * (n.y * y_moment / z - n.z * y_zeroth),
                     of_moment = scale * n.x * y_zeroth / z;
        for (std::size_t c = 0; c < width; ++c)
          w[c] += of_zeroth * x_zeroth[c] + of_moment * x_moment[c];
      }
}

void AddLines(const PosedLightField& posed, const Lines& lines, Vec3 n, double factor,
              FieldFunctional* to) {
  const LuminaireGeometry& g = posed.field.geometry;
  const auto along_x = [&](int k) {
    AxisSums sums(g.grid.width, g.lattice.width);
    for (const Vec3& p : lines.line(k)) sums.Add(SeenAlongX(g, p.x, p.z));
    return sums;
  };
  if (lines.one_height) {
    if (!(lines.own[0].z > 0)) return;
    AxisSums y(g.grid.height, g.lattice.height);
    for (int k = 0; k < lines.count; ++k)
      y.Add(SeenAlongY(g, lines.line(k)[0].y, lines.line(k)[0].z));
    AddSeparable(g, along_x(0), y, lines.own[0].z, n, factor, to);
    return;
  }
  for (int k = 0; k < lines.count; ++k) {
    const Vec3 p = lines.line(k)[0];
    if (!(p.z > 0)) continue;
    AxisSums y(g.grid.height, g.lattice.height);
    y.Add(SeenAlongY(g, p.y, p.z));
    AddSeparable(g, along_x(k), y, p.z, n, factor, to);
  }
}

}  // namespace

std::vector<Vec3> LightVectorsOn(const Lamp& lamp, const PlaneAsked& plane) {
  std::vector<Vec3> sum(plane.count());
  for (const PosedLightField& posed : lamp.fields) AddLightVectors(posed, plane, &sum);
  return sum;
}

std::vector<double> IlluminanceOn(const Lamp& lamp, const PlaneAsked& plane) {
  const Vec3 n = plane.Normal();
  const std::vector<Vec3> vectors = LightVectorsOn(lamp, plane);
  std::vector<double> illuminance(vectors.size());
  core::ParallelFor(vectors.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 p = plane.PointAt(k);
      illuminance[k] = IsCut(lamp, p, n) ? IlluminanceValue(lamp, p, n) : Dot(n, vectors[k]);
    }
  });
  for (double& value : illuminance) value += 0.0;  // -0, the cosine times no light, is 0
  return illuminance;
}

PointReceiver ReceiverOn(const PlaneAsked& plane) {
  PointReceiver receiver = plane.receiver;
  if (receiver.shape == ReceiverShape::kPlane) receiver.normal = plane.Normal();
  return receiver;
}

std::vector<double> ReceivedOn(const Lamp& lamp, const PlaneAsked& plane) {
  if (plane.receiver.shape == ReceiverShape::kPlane) return IlluminanceOn(lamp, plane);
  std::vector<double> received(plane.count());
  core::ParallelFor(received.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      received[k] = ReceivedValue(lamp, plane.receiver, plane.PointAt(k));
  });
  return received;
}

Functional MeanReceivedOn(const Lamp& lamp, const PlaneAsked& plane) {
  Functional mean = ZeroOf(lamp);
  const Vec3 n = plane.Normal();
  const std::size_t count = plane.count();
  const double share = 1.0 / static_cast<double>(count);
  bool separable = plane.receiver.shape == ReceiverShape::kPlane;
  std::vector<std::optional<Lines>> lines;
  for (const PosedLightField& posed : lamp.fields) {
    lines.push_back(LinesOf(posed, plane));
    separable = separable && lines.back();
  }
  for (std::size_t k = 0; k < count && separable; ++k)
    separable = !IsCut(lamp, plane.PointAt(k), n);
  if (!separable) {
    const PointReceiver receiver = ReceiverOn(plane);
    for (std::size_t k = 0; k < count; ++k)
      AddReceived(mean, share, lamp, receiver, plane.PointAt(k));
    return mean;
  }
  for (std::size_t k = 0; k < lamp.fields.size(); ++k)
    AddLines(lamp.fields[k], *lines[k], lamp.fields[k].luminaire_from_field.InverseDirection(n),
             share, &mean[k]);
  return mean;
}

}  // namespace luxfield::photometry
