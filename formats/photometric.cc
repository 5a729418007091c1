#include "luxfield/formats/photometric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "luxfield/core/error.h"

namespace luxfield::formats {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSameAngle = 1e-6;  // degrees

double Wrapped(double degrees) {
  const double turn = std::fmod(degrees, 360);
  return turn < 0 ? turn + 360 : turn;
}

// Hat functions on x, against sin or cos of the angle.
std::vector<double> HatIntegrals(const std::vector<double>& degrees, bool sine) {
  std::vector<double> weights(degrees.size(), 0);
  for (std::size_t k = 0; k + 1 < degrees.size(); ++k) {
    // integral of cos from a to b is that of sin from a + pi/2.
    const double shift = sine ? 0 : std::numbers::pi / 2;
    const double a = kDegree * degrees[k] + shift, b = kDegree * degrees[k + 1] + shift;
    const double mean = (std::sin(b) - std::sin(a)) / (b - a);
    weights[k] += std::cos(a) - mean;
    weights[k + 1] += mean - std::cos(b);
  }
  return weights;
}

std::vector<double> Trapezoids(const std::vector<double>& degrees) {
  std::vector<double> weights(degrees.size(), 0);
  for (std::size_t k = 0; k + 1 < degrees.size(); ++k) {
    const double half = kDegree * (degrees[k + 1] - degrees[k]) / 2;
    weights[k] += half;
    weights[k + 1] += half;
  }
  return weights;
}

std::vector<double> TrapezoidsAround(const std::vector<double>& degrees) {
  std::vector<double> weights = Trapezoids(degrees);
  const double half = kDegree * (360 - degrees.back() + degrees.front()) / 2;
  weights.front() += half;
  weights.back() += half;
  return weights;
}

// Where x lies between the entries of an ascending list: the one below, the one above, and how far.
struct Between {
  std::size_t low = 0, high = 0;
  double fraction = 0;
};

std::optional<Between> FindBetween(const std::vector<double>& list, double x) {
  if (x < list.front() - kSameAngle || x > list.back() + kSameAngle) return {};
  const auto above = std::upper_bound(list.begin(), list.end(), x);
  if (above == list.begin()) return Between{};
  const auto low = static_cast<std::size_t>(above - list.begin()) - 1;
  if (low + 1 == list.size()) return Between{low, low, 0};
  return Between{low, low + 1, (x - list[low]) / (list[low + 1] - list[low])};
}

Between FindAround(const std::vector<double>& list, double degrees) {
  const double x = Wrapped(degrees);
  const auto above = std::upper_bound(list.begin(), list.end(), x);
  const std::size_t count = list.size();
  const std::size_t high = static_cast<std::size_t>(above - list.begin()) % count;
  const std::size_t low = (high + count - 1) % count;
  const double step = Wrapped(list[high] - list[low]);
  return {low, high, step > 0 ? Wrapped(x - list[low]) / step : 0};
}

double Bilinear(const Photometry& p, const Between& plane, const Between& angle) {
  const auto along = [&](std::size_t k) {
    return std::lerp(p.at(k, angle.low), p.at(k, angle.high), angle.fraction);
  };
  return std::lerp(along(plane.low), along(plane.high), plane.fraction);
}

struct TableAngles {
  double plane_deg = 0, angle_deg = 0;
};

TableAngles AnglesOf(PhotometryType type, lightfield::Vec3 direction) {
  const auto d = lightfield::Normalized(direction);
  const auto asin = [](double x) { return std::asin(std::clamp(x, -1.0, 1.0)) / kDegree; };
  const auto atan2 = [](double y, double x) { return std::atan2(y, x) / kDegree; };
  switch (type) {
    case PhotometryType::kA:
      return {atan2(d.y, d.x), asin(-d.z)};
    case PhotometryType::kB:
      return {asin(d.y), atan2(d.x, d.z)};
    case PhotometryType::kC:
      break;
  }
  return {atan2(-d.y, d.x), atan2(std::hypot(d.x, d.y), d.z)};
}

std::optional<std::size_t> FindPlane(const std::vector<double>& planes, double degrees) {
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const double apart = Wrapped(planes[k] - degrees);
    if (std::min(apart, 360 - apart) < kSameAngle) return k;
  }
  return {};
}

// Whether every plane's mirror image 2 about - C is there and the same.
bool HasMirror(const Photometry& p, double about_deg, double limit) {
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k) {
    const auto mirrored = FindPlane(p.planes_deg, 2 * about_deg - p.planes_deg[k]);
    if (!mirrored) return false;
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j)
      if (std::abs(p.at(k, j) - p.at(*mirrored, j)) > limit) return false;
  }
  return true;
}

double Largest(const Photometry& p) {
  double largest = 0;
  for (const double value : p.intensity_cd) largest = std::max(largest, std::abs(value));
  return largest;
}

void SortPlanes(Photometry& p) {
  const std::size_t angles = p.angles_deg.size();
  std::vector<std::size_t> order(p.planes_deg.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return p.planes_deg[a] < p.planes_deg[b]; });
  std::vector<double> planes, values;
  for (const std::size_t k : order) {
    planes.push_back(p.planes_deg[k]);
    for (std::size_t j = 0; j < angles; ++j) values.push_back(p.at(k, j));
  }
  p.planes_deg = std::move(planes);
  p.intensity_cd = std::move(values);
}

// Whether the last plane, short of 360 by no more than the planes' own step, leaves only C360 out.
bool OnlyLacks360(const std::vector<double>& planes) {
  double widest = 0;
  for (std::size_t k = 1; k < planes.size(); ++k)
    widest = std::max(widest, planes[k] - planes[k - 1]);
  return planes.size() > 2 && 360 - planes.back() <= widest * (1 + 1e-9);
}

}  // namespace

std::string Describe(const Opening& o) {
  const auto mm = [](double metres) { return fmt::format("{:.5g} mm", 1e3 * metres); };
  const std::string high = o.height_m > 0 ? ", " + mm(o.height_m) + " high" : "";
  const std::string sides = mm(o.c0_m) + " (C0) x " + mm(o.c90_m) + " (C90)";
  using enum Opening::Shape;
  switch (o.shape) {
    case kPoint:
      return "a point";
    case kBox:
      return (o.height_m > 0 ? "a box of " : "a rectangle of ") + sides + high;
    case kEllipse:
      if (o.c0_m != o.c90_m) return "an ellipse of " + sides + high;
      return (o.height_m > 0 ? "a vertical cylinder of " : "a disc of ") + mm(o.c0_m) + high;
    case kCylinderAlongC0:
      return fmt::format("a cylinder along C0 of {}, {} long", mm(o.height_m), mm(o.c0_m));
    case kCylinderAlongC90:
      return fmt::format("a cylinder along C90 of {}, {} long", mm(o.height_m), mm(o.c90_m));
    case kEllipsoid:
      if (o.c0_m == o.c90_m && o.c0_m == o.height_m) return "a sphere of " + mm(o.c0_m);
      return "an ellipsoid of " + sides + high;
    case kVerticalDisc:
      return "a vertical disc of " + mm(o.c90_m);
  }
  return {};
}

std::string Describe(const Symmetry& s) {
  if (s.rotational) return "about the vertical axis";
  if (s.about_c0 && s.about_c90) return "to the planes C0-C180 and C90-C270";
  if (s.about_c0) return "to the plane C0-C180";
  if (s.about_c90) return "to the plane C90-C270";
  return "none";
}

std::string Photometry::keyword(const std::string& name) const {
  for (const auto& [key, text] : keywords)
    if (key == name) return text;
  return {};
}

void Validate(const Photometry& p, const std::string& file) {
  const auto fail = [&](const std::string& problem) {
    throw InputError(file, problem, "have it exported anew");
  };
  if (p.planes_deg.empty() || p.angles_deg.size() < 2)
    fail(fmt::format("has {} planes of {} angles; 1 plane and 2 angles are the least",
                     p.planes_deg.size(), p.angles_deg.size()));
  if (p.intensity_cd.size() != p.planes_deg.size() * p.angles_deg.size())
    fail(fmt::format("has {} intensities for {} planes of {} angles", p.intensity_cd.size(),
                     p.planes_deg.size(), p.angles_deg.size()));
  const auto check = [&](const char* name, const std::vector<double>& list, double from,
                         double to) {
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (!(list[k] >= from && list[k] <= to))
        fail(fmt::format("{} {} = {:g} degrees lies outside {} to {}", name, k + 1, list[k], from,
                         to));
      if (k > 0 && !(list[k] - list[k - 1] > kSameAngle))
        fail(fmt::format("{} {} = {:g} degrees does not lie above the one before, {:g}", name,
                         k + 1, list[k], list[k - 1]));
    }
  };
  if (p.type == PhotometryType::kC) {
    check("plane", p.planes_deg, 0, 360 - kSameAngle);
    check("gamma angle", p.angles_deg, 0, 180);
  } else {
    // A plane alone has no width: its flux would be 0.
    if (p.planes_deg.size() < 2) fail("has one horizontal angle; type A and B need two");
    const double around = p.type == PhotometryType::kA ? 180 : 90;
    check("horizontal angle", p.planes_deg, -around, around);
    check("vertical angle", p.angles_deg, -(270 - around), 270 - around);
  }
  for (std::size_t k = 0; k < p.intensity_cd.size(); ++k)
    if (!(std::abs(p.intensity_cd[k]) <= 1e15))
      fail(fmt::format("intensity of plane {}, angle {} = {} cd is none",
                       k / p.angles_deg.size() + 1, k % p.angles_deg.size() + 1,
                       p.intensity_cd[k]));
}

double Intensity(const Photometry& p, lightfield::Vec3 direction) {
  const TableAngles angles = AnglesOf(p.type, direction);
  const auto angle = FindBetween(p.angles_deg, angles.angle_deg);
  if (!angle) return 0;
  if (p.type == PhotometryType::kC)
    return Bilinear(p, FindAround(p.planes_deg, angles.plane_deg), *angle);
  const auto plane = FindBetween(p.planes_deg, angles.plane_deg);
  return plane ? Bilinear(p, *plane, *angle) : 0;
}

lightfield::Vec3 Direction(PhotometryType type, double plane_deg, double angle_deg) {
  const double p = kDegree * plane_deg, a = kDegree * angle_deg;
  switch (type) {
    case PhotometryType::kA:
      return {std::cos(a) * std::cos(p), std::cos(a) * std::sin(p), -std::sin(a)};
    case PhotometryType::kB:
      return {std::cos(p) * std::sin(a), std::sin(p), std::cos(p) * std::cos(a)};
    case PhotometryType::kC:
      break;
  }
  return {std::sin(a) * std::cos(p), -std::sin(a) * std::sin(p), std::cos(a)};
}

double Flux(const Photometry& p) {
  const bool c = p.type == PhotometryType::kC, b = p.type == PhotometryType::kB;
  const auto along_planes = c   ? TrapezoidsAround(p.planes_deg)
                            : b ? HatIntegrals(p.planes_deg, false)
                                : Trapezoids(p.planes_deg);
  const auto along_angles = b ? Trapezoids(p.angles_deg) : HatIntegrals(p.angles_deg, c);
  double flux = 0;
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j)
      flux += along_planes[k] * along_angles[j] * p.at(k, j);
  return flux;
}

Peak FindPeak(const Photometry& p) {
  const auto at = static_cast<std::size_t>(
      std::max_element(p.intensity_cd.begin(), p.intensity_cd.end()) - p.intensity_cd.begin());
  return {p.intensity_cd[at], p.planes_deg[at / p.angles_deg.size()],
          p.angles_deg[at % p.angles_deg.size()]};
}

Symmetry FindSymmetry(const Photometry& p, double tolerance) {
  if (p.type != PhotometryType::kC) return {};
  const double limit = tolerance * Largest(p);
  bool rotational = true;
  for (std::size_t k = 1; k < p.planes_deg.size() && rotational; ++k)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j)
      rotational = rotational && std::abs(p.at(k, j) - p.at(0, j)) <= limit;
  if (rotational) return {true, true, true};
  return {false, HasMirror(p, 0, limit), HasMirror(p, 90, limit)};
}

void MirrorPlanes(Photometry& p, double about_deg, const std::string& file) {
  const std::size_t given = p.planes_deg.size(), angles = p.angles_deg.size();
  int sides = 0;
  for (std::size_t k = 0; k < given; ++k) {
    const double offset = Wrapped(p.planes_deg[k] - about_deg);
    const bool on_mirror = std::min({offset, 360 - offset, std::abs(offset - 180)}) < kSameAngle;
    if (on_mirror) continue;
    sides |= offset < 180 ? 1 : 2;
    p.planes_deg.push_back(Wrapped(2 * about_deg - p.planes_deg[k]));
    for (std::size_t j = 0; j < angles; ++j) p.intensity_cd.push_back(p.at(k, j));
  }
  if (sides == 3)
    throw InputError(file,
                     fmt::format("its planes lie on both sides of the mirror C{:g}", about_deg),
                     "have it exported anew");
  SortPlanes(p);
}

void ClosePlanes(Photometry& p) {
  SortPlanes(p);
  const std::size_t angles = p.angles_deg.size();
  const double limit = 1e-6 * Largest(p);
  if (p.planes_deg.size() > 1 && std::abs(p.planes_deg.back() - 360) < kSameAngle) {
    const std::size_t last = p.planes_deg.size() - 1;
    for (std::size_t j = 0; j < angles && p.planes_deg.front() == 0; ++j)
      if (std::abs(p.at(last, j) - p.at(0, j)) > limit) {
        p.odd.push_back(
            fmt::format("plane C360 is not C0 (at gamma {:g}: {:g} and {:g} cd); C0 is taken",
                        p.angles_deg[j], p.at(last, j), p.at(0, j)));
        break;
      }
    if (p.planes_deg.front() == 0) {
      p.planes_deg.pop_back();
      p.intensity_cd.resize(last * angles);
    } else {
      p.planes_deg.back() = 0;
      SortPlanes(p);
    }
  }
  for (const std::size_t pole : {std::size_t{0}, angles - 1}) {
    const double gamma = p.angles_deg[pole];
    if (gamma > kSameAngle && gamma < 180 - kSameAngle) continue;
    double low = p.at(0, pole), high = low;
    for (std::size_t k = 0; k < p.planes_deg.size(); ++k) {
      low = std::min(low, p.at(k, pole));
      high = std::max(high, p.at(k, pole));
    }
    if (high - low > 1e-3 * Largest(p))
      p.odd.push_back(fmt::format("intensity at gamma {:g} differs between planes: {:g} to {:g} cd",
                                  gamma, low, high));
  }
}

void CompletePlanesOfTypeC(Photometry& p, const std::string& file) {
  const double first = p.planes_deg.front(), last = p.planes_deg.back();
  if (p.planes_deg.size() == 1) {
    if (first != 0) p.odd.push_back(fmt::format("its single plane is C{:g}, not C0", first));
    p.planes_deg[0] = 0;
    return;
  }
  if (first == 0 && last == 90) {
    MirrorPlanes(p, 90, file);
    MirrorPlanes(p, 0, file);
  } else if (first == 0 && last == 180) {
    MirrorPlanes(p, 0, file);
  } else if (first == 90 && last == 270) {
    MirrorPlanes(p, 90, file);
  } else if (first == 0 && last == 360) {
    // Whole.
  } else if (first >= 0 && first + 360 > last && OnlyLacks360(p.planes_deg)) {
    p.odd.push_back(fmt::format("its planes end at C{:g} without C360", last));
  } else {
    throw InputError(file,
                     fmt::format("its planes go from C{:g} to C{:g}, which is no half, quarter or "
                                 "whole turn",
                                 first, last),
                     "have the missing planes measured");
  }
}

PlaneRange StoredRange(const Photometry& p) {
  const Symmetry s = FindSymmetry(p);
  const auto has = [&](double plane) {
    return std::any_of(p.planes_deg.begin(), p.planes_deg.end(),
                       [&](double c) { return std::abs(c - plane) < kSameAngle; });
  };
  if (s.rotational) return {0, 0};
  if (s.about_c0 && s.about_c90 && has(0) && has(90)) return {0, 90};
  if (s.about_c0 && has(0) && has(180)) return {0, 180};
  if (s.about_c90 && has(90) && has(270)) return {90, 270};
  return {};
}

Photometry ResampledToTypeC(const Photometry& p, const std::vector<double>& planes_deg,
                            const std::vector<double>& angles_deg) {
  Photometry out = p;
  out.type = PhotometryType::kC;
  out.planes_deg = planes_deg;
  out.angles_deg = angles_deg;
  out.intensity_cd.clear();
  for (const double plane : planes_deg)
    for (const double angle : angles_deg)
      out.intensity_cd.push_back(Intensity(p, Direction(PhotometryType::kC, plane, angle)));
  return out;
}

}  // namespace luxfield::formats
