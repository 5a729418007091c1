#include "luxfield/reconstruct/solve/ray_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace luxfield::reconstruct {
namespace {

using lightfield::RigidPose;
using lightfield::Vec2;
using lightfield::Vec3;

struct Face {
  const char* name;
  RigidPose luminaire_from_face;
};

// Rows: what the luminaire's x, y, z are in the face's frame.
const std::array<Face, kFaces> kCube{{
    {"+z", {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}}},
    {"-z", {{1, 0, 0, 0, -1, 0, 0, 0, -1}, {}}},
    {"+x", {{0, 0, 1, 1, 0, 0, 0, 1, 0}, {}}},
    {"-x", {{0, 0, -1, -1, 0, 0, 0, 1, 0}, {}}},
    {"+y", {{0, 1, 0, 0, 0, 1, 1, 0, 0}, {}}},
    {"-y", {{1, 0, 0, 0, 0, -1, 0, 1, 0}, {}}},
}};

RayWindow FluxWindow(std::vector<std::pair<double, double>>& crossings, double outside) {
  std::sort(crossings.begin(), crossings.end());
  double total = 0;
  for (const auto& [x, flux] : crossings) total += flux;
  RayWindow window{crossings.front().first, crossings.back().first};
  double sum = 0;
  bool below = true;
  for (const auto& [x, flux] : crossings) {
    sum += flux;
    if (below && sum >= outside * total) {
      window.low = x;
      below = false;
    }
    if (sum >= (1 - outside) * total) {
      window.high = x;
      break;
    }
  }
  return window;
}

// All of `place` of the lines with flux, of which there is one.
template <typename Place>
RayWindows WholeWindows(std::span<const RayLine> lines, const Place& place) {
  RayWindows windows{{HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, -HUGE_VAL}};
  for (const RayLine& line : lines) {
    if (!(line.flux > 0)) continue;
    const Vec2 at = place(line);
    windows.x = {std::min(windows.x.low, at.x), std::max(windows.x.high, at.x)};
    windows.y = {std::min(windows.y.low, at.y), std::max(windows.y.high, at.y)};
  }
  return windows;
}

template <typename Place>
RayWindows WindowsOf(std::span<const RayLine> lines, double outside, const Place& place) {
  if (!(outside > 0)) return WholeWindows(lines, place);
  std::vector<std::pair<double, double>> x, y;
  for (const RayLine& line : lines) {
    if (!(line.flux > 0)) continue;
    const Vec2 at = place(line);
    x.emplace_back(at.x, line.flux);
    y.emplace_back(at.y, line.flux);
  }
  return {FluxWindow(x, outside), FluxWindow(y, outside)};
}

}  // namespace

const char* FaceName(int face) { return kCube[static_cast<std::size_t>(face)].name; }

const RigidPose& LuminaireFromFace(int face) {
  return kCube[static_cast<std::size_t>(face)].luminaire_from_face;
}

int FaceOf(Vec3 d) {
  const double x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
  if (z >= x && z >= y) return d.z > 0 ? 0 : 1;
  if (x >= y) return d.x > 0 ? 2 : 3;
  return d.y > 0 ? 4 : 5;
}

std::vector<RayLine> LinesOf(const formats::RayFile& file, const RigidPose& luminaire_from_file,
                             int face, const std::function<bool(Vec3)>& takes) {
  const RigidPose face_from_file = LuminaireFromFace(face).Inverse() * luminaire_from_file;
  std::vector<RayLine> lines;
  for (std::size_t n = 0; n < file.rays.size(); ++n) {
    const auto& ray = file.rays[n];
    if (!takes(luminaire_from_file.Direction(ray.direction))) continue;
    const Vec3 p = face_from_file.Point(ray.position_m);
    const Vec3 d = face_from_file.Direction(ray.direction);
    const Vec2 slope{d.x / d.z, d.y / d.z};
    lines.push_back({Vec2{p.x, p.y} - p.z * slope, slope, ray.flux, d.z / Length(d), n});
  }
  return lines;
}

double NarrowestZ(std::span<const RayLine> lines) {
  double weight = 0;
  Vec2 a, m;
  const auto w = [](const RayLine& line) { return line.flux * std::pow(line.cosine, 4); };
  for (const RayLine& line : lines) {
    weight += w(line);
    a = a + w(line) * line.at_zero;
    m = m + w(line) * line.slope;
  }
  if (!(weight > 0)) return 0;
  a = (1 / weight) * a;
  m = (1 / weight) * m;
  double covariance = 0, variance = 0;
  for (const RayLine& line : lines) {
    const Vec2 da = line.at_zero - a, dm = line.slope - m;
    covariance += w(line) * (da.x * dm.x + da.y * dm.y);
    variance += w(line) * (dm.x * dm.x + dm.y * dm.y);
  }
  return variance > 1e-12 * weight ? 0 - covariance / variance : 0;  // 0 - x: no negative zero
}

RayWindows FluxWindows(std::span<const RayLine> lines, double z, double outside) {
  return WindowsOf(lines, outside, [z](const RayLine& line) { return line.At(z); });
}

RayWindows SlopeWindows(std::span<const RayLine> lines, double outside) {
  return WindowsOf(lines, outside, [](const RayLine& line) { return line.slope; });
}

}  // namespace luxfield::reconstruct
