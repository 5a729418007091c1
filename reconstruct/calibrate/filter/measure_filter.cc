#include "luxfield/reconstruct/calibrate/filter/measure_filter.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/bracket/register_images.h"
#include "luxfield/reconstruct/calibrate/filter/disc_centroids.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Lattice;
using lightfield::MeasuredFilter;
using lightfield::Vec2;
using rig::FilterSheet;
using rig::RegistrationMark;

constexpr const char* kFile = "photographs";
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

struct Values {
  std::vector<float> value, sigma;

  Picture View(const MergedFrame& like) const { return {like.width, like.height, value, sigma}; }
};

Values KnownPixels(const MergedFrame& photograph) {
  Values values{photograph.rate_e_per_s, photograph.sigma_e_per_s};
  for (std::size_t p = 0; p < values.value.size(); ++p)
    if (photograph.mask[p] & lightfield::kUnknownMask) values.value[p] = kUnknown;
  return values;
}

double Norm(Vec2 v) { return std::hypot(v.x, v.y); }

// Standard deviations that holes whose coordinates have 1 leave of a coordinate of the axis and of
// an entry of the linear map about it: first-order least squares for a homography seen upright. The
// holder's symmetry makes all entries alike, and independent of each other and of the axis.
struct HolderSigma {
  double axis = 0, stretch_per_m = 0;
};
HolderSigma SigmaOfHolder(const FilterSheet& sheet) {
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
  for (const RegistrationMark& mark : sheet.holder_marks) {
    const double x = mark.centre_m.x / sheet.half_m, y = mark.centre_m.y / sheet.half_m;
    Eigen::Matrix<double, 2, 8> row;
    row << x, y, 1, 0, 0, 0, -x * x, -x * y, 0, 0, 0, x, y, 1, -x * y, -y * y;
    normal += row.transpose() * row;
  }
  const Eigen::Matrix<double, 8, 8> covariance = normal.inverse();
  return {std::sqrt(covariance(2, 2)), std::sqrt(covariance(0, 0)) / sheet.half_m};
}

// The camera's homography from the holder's holes; the second round takes their centroids on the
// plane instead of in the picture, where perspective shifts circles.
rig::Homography HolderFromSensor(const FilterSheet& sheet, const Picture& light,
                                 FilterReadings* readings) {
  const auto found = FindDiscs(light, sheet.half_m, sheet.holder_marks);
  std::vector<Vec2> sensor, plane;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const RegistrationMark& mark = sheet.holder_marks[k];
    if (!found[k])
      throw InputError(kFile,
                       fmt::format("the light shows no hole of the holder near ({:.4g}, {:.4g}) mm",
                                   1e3 * mark.centre_m.x, 1e3 * mark.centre_m.y),
                       "photograph the whole holder, upright, or correct holder_marks");
    sensor.push_back(*found[k]);
    plane.push_back(mark.centre_m);
  }
  rig::Homography h = FitHomography(sensor, plane);
  for (int round = 0; round < 2; ++round) {
    std::vector<Vec2> targets;
    for (std::size_t k = 0; k < sensor.size(); ++k) {
      const RegistrationMark& mark = sheet.holder_marks[k];
      const Vec2 centroid = MeasureDisc(light, h, mark).centre_m;
      targets.push_back(h.Map(sensor[k]) + (mark.centre_m - centroid));
    }
    h = FitHomography(sensor, targets);
  }
  const auto holes = static_cast<double>(sheet.holder_marks.size());
  double square = 0, variance = 0;
  for (const RegistrationMark& mark : sheet.holder_marks) {
    const Centroid hole = MeasureDisc(light, h, mark);
    const double off = Norm(hole.centre_m - mark.centre_m);
    square += off * off / holes;
    variance += hole.sigma_m * hole.sigma_m / holes;
  }
  readings->holder_residual_m = std::sqrt(square);
  // Of a hole's coordinates: noise, unless the holes contradict each other by far more (8 holes
  // leave 8 degrees of freedom, of which chi^2 exceeds 20 once in 100 times).
  const double degrees = 2 * holes - 8;
  const double seen = degrees > 0 ? square * holes / degrees : 0;
  const double hole_sigma_m = std::sqrt(seen > 2.5 * variance ? seen : variance);
  const HolderSigma sigma = SigmaOfHolder(sheet);
  readings->axis_sigma_m = sigma.axis * hole_sigma_m;
  readings->stretch_sigma = sigma.stretch_per_m * hole_sigma_m;
  if (!(readings->holder_residual_m <= kLargestResidual * sheet.spacing_m))
    throw InputError(
        kFile,
        fmt::format("the holes of the holder lie {:.3g} mm rms from their places, at "
                    "most {:.3g} mm are allowed",
                    1e3 * readings->holder_residual_m, 1e3 * kLargestResidual * sheet.spacing_m),
        "use a lens without distortion from farther away, or measure the holder");
  return h;
}

// The print through the holes over the light alone, and its standard deviation.
std::pair<double, double> LightRatio(const FilterSheet& sheet, const rig::Homography& h,
                                     const Picture& light, const Picture& print) {
  double with = 0, without = 0, with_variance = 0, without_variance = 0;
  for (const RegistrationMark& mark : sheet.holder_marks) {
    const Centroid a = MeasureDisc(print, h, mark), b = MeasureDisc(light, h, mark);
    with += a.light;
    with_variance += a.light_sigma * a.light_sigma;
    without += b.light;
    without_variance += b.light_sigma * b.light_sigma;
  }
  if (!(with > 0.05 * without && with < 20 * without))
    throw InputError(kFile, "the holder's holes are not where the light alone showed them",
                     "leave camera and holder where they are between the photographs");
  const double ratio = with / without;
  return {ratio, ratio * std::hypot(std::sqrt(with_variance) / with,
                                    std::sqrt(without_variance) / without)};
}

// T per pixel, unknown where the light is below a twentieth of its upper level: on the holder.
MergedFrame Transmittance(const MergedFrame& light, const MergedFrame& print, double ratio) {
  std::vector<float> sorted = light.rate_e_per_s;
  const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>(0.95 * double(sorted.size()));
  std::nth_element(sorted.begin(), rank, sorted.end());
  const double least = 0.05 * *rank;
  MergedFrame result = print;
  for (std::size_t p = 0; p < result.mask.size(); ++p) {
    const double l = light.rate_e_per_s[p], f = print.rate_e_per_s[p];
    const std::uint32_t unknown = (light.mask[p] | print.mask[p]) & lightfield::kUnknownMask;
    result.mask[p] = l > least ? unknown : unknown | lightfield::kOffSensor;
    if (result.mask[p]) {
      result.rate_e_per_s[p] = result.sigma_e_per_s[p] = 0;
      continue;
    }
    const double t = f / (l * ratio);
    result.rate_e_per_s[p] = static_cast<float>(t);
    result.sigma_e_per_s[p] = static_cast<float>(
        std::hypot(print.sigma_e_per_s[p] / (l * ratio), t * light.sigma_e_per_s[p] / l));
  }
  return result;
}

// Shift and rotation that take the sheet's marks to where they are seen.
void LocatePrint(const FilterSheet& sheet, const rig::Homography& h, const Picture& transmittance,
                 PrintReading* reading) {
  std::vector<Centroid> seen;
  for (const RegistrationMark& mark : sheet.marks) {
    // Marks may be off by more than their radius: a first look reaches farther.
    const Centroid coarse = MeasureDisc(transmittance, h, {mark.centre_m, 1.5 * mark.radius_m});
    const Centroid fine = MeasureDisc(transmittance, h, {coarse.centre_m, mark.radius_m});
    if (!(fine.light > 0.2))
      throw InputError(
          kFile,
          fmt::format("the print shows no registration mark near ({:.4g}, {:.4g}) mm",
                      1e3 * mark.centre_m.x, 1e3 * mark.centre_m.y),
          "mount the sheet upright, text readable from the receivers' side, and square");
    seen.push_back(fine);
  }
  const double n = static_cast<double>(seen.size());
  Vec2 from, to;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    from = from + (1 / n) * sheet.marks[k].centre_m;
    to = to + (1 / n) * seen[k].centre_m;
  }
  double dot = 0, cross = 0, spread = 0, variance = 0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const Vec2 a = sheet.marks[k].centre_m - from, b = seen[k].centre_m - to;
    dot += a.x * b.x + a.y * b.y;
    cross += a.x * b.y - a.y * b.x;
    spread += a.x * a.x + a.y * a.y;
    variance += seen[k].sigma_m * seen[k].sigma_m / n;
  }
  reading->rotation_rad = std::atan2(cross, dot);
  const double c = std::cos(reading->rotation_rad), s = std::sin(reading->rotation_rad);
  const auto turned = [&](Vec2 p) { return Vec2{c * p.x - s * p.y, s * p.x + c * p.y}; };
  reading->shift_m = to - turned(from);
  double square = 0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const Vec2 off = seen[k].centre_m - turned(sheet.marks[k].centre_m) - reading->shift_m;
    square += (off.x * off.x + off.y * off.y) / n;
  }
  reading->mark_residual_m = std::sqrt(square);
  // Noise of the marks, or what they say of each other where that is more: 2 n - 3 degrees.
  const double per_coordinate = std::max(variance, square * n / (2 * n - 3));
  reading->shift_sigma_m = std::sqrt(per_coordinate / n);
  reading->rotation_sigma_rad = std::sqrt(per_coordinate / spread);
}

std::vector<WedgeReading> ReadWedge(const FilterSheet& sheet, const rig::Homography& h,
                                    const MergedFrame& transmittance, const PrintReading& reading) {
  struct Sum {
    double weight = 0, value = 0, variance = 0;
  };
  std::vector<Sum> sums(sheet.wedge.size());
  const double c = std::cos(reading.rotation_rad), s = std::sin(reading.rotation_rad);
  for (int row = 0; row < transmittance.height; ++row)
    for (int column = 0; column < transmittance.width; ++column) {
      const std::size_t p = static_cast<std::size_t>(row) * transmittance.width + column;
      if (transmittance.mask[p] & lightfield::kUnknownMask) continue;
      const Vec2 q = h.Map({column + 0.5, row + 0.5}) - reading.shift_m;
      const Vec2 own{c * q.x + s * q.y, -s * q.x + c * q.y};
      const auto* step = sheet.StepAt(own);
      if (!step) continue;
      const auto inner = [](double x, double low, double high) {
        return std::abs(x - 0.5 * (low + high)) < 0.25 * (high - low);
      };
      if (!inner(own.x, step->low_m.x, step->high_m.x) ||
          !inner(own.y, step->low_m.y, step->high_m.y))
        continue;
      Sum& sum = sums[static_cast<std::size_t>(step - sheet.wedge.data())];
      const double sigma = transmittance.sigma_e_per_s[p];
      sum.weight += 1;
      sum.value += transmittance.rate_e_per_s[p];
      sum.variance += sigma * sigma;
    }
  std::vector<WedgeReading> wedge;
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const Sum& sum = sums[k];
    const double sigma = std::sqrt(sum.variance);
    if (!(sum.value > 3 * sigma)) break;  // darker than the photographs can tell
    wedge.push_back({sheet.wedge[k].code, -std::log10(sum.value / sum.weight),
                     sigma / sum.value / std::log(10)});
  }
  return wedge;
}

Lattice FilterLattice(const FilterSheet& sheet, double pixel_m) {
  const int per_spacing = std::clamp(static_cast<int>(sheet.spacing_m / pixel_m), 1, 64);
  if (per_spacing < 8)
    throw InputError(kFile,
                     fmt::format("a pixel covers {:.3g} mm of the filter, more than an eighth of "
                                 "its spacing of {:.3g} mm",
                                 1e3 * pixel_m, 1e3 * sheet.spacing_m),
                     "photograph it from nearer or with more pixels");
  // The support and 3 % of it on each side for a print off its axis; the marks begin at 6 %.
  const double texel_m = sheet.spacing_m / per_spacing;
  const int half = static_cast<int>(std::ceil(0.53 * sheet.basis.cells * per_spacing));
  return {2 * half, 2 * half, -half * texel_m, half * texel_m, texel_m, texel_m};
}

lightfield::MeasuredPrint ToTexels(const rig::Homography& h, const MergedFrame& transmittance,
                                   const Lattice& lattice) {
  const Registration registration(h, transmittance.width, transmittance.height, lattice);
  const std::vector<float> unity{1};
  RegisteredImage image = registration.Apply(transmittance, unity, {0, 0});
  const auto bad = std::find_if(image.mask.begin(), image.mask.end(), [](std::uint32_t mask) {
    return (mask & lightfield::kUnknownMask) != 0;
  });
  if (bad != image.mask.end()) {
    const auto k = bad - image.mask.begin();
    const Vec2 at =
        lattice.centre(static_cast<int>(k / lattice.width), static_cast<int>(k % lattice.width));
    throw InputError(kFile,
                     fmt::format("pixels of the filter at ({:.4g}, {:.4g}) mm are unknown: "
                                 "saturated, defective or off the picture (flags {})",
                                 1e3 * at.x, 1e3 * at.y, *bad),
                     "photograph the whole filter with a shorter exposure in the bracket");
  }
  return {std::move(image.value), std::move(image.sigma)};
}

// Standard deviation of the integral over the texels by the pixels over that by the texels.
double SumSigmaRatio(const rig::Homography& h, const MergedFrame& transmittance,
                     const Lattice& lattice, const lightfield::MeasuredPrint& print) {
  double by_pixels = 0, by_texels = 0;
  for (int row = 0; row < transmittance.height; ++row)
    for (int column = 0; column < transmittance.width; ++column) {
      const Vec2 q = h.Map({column + 0.5, row + 0.5});
      const double c = lattice.column_of_s(q.x), r = lattice.row_of_t(q.y);
      if (!(c >= 0 && c < lattice.width && r >= 0 && r < lattice.height)) continue;
      const Vec2 right = h.Map({column + 1.5, row + 0.5}) - q,
                 down = h.Map({column + 0.5, row + 1.5}) - q;
      const double area = right.x * down.y - right.y * down.x;
      const double sigma =
          area *
          transmittance.sigma_e_per_s[static_cast<std::size_t>(row) * transmittance.width + column];
      by_pixels += sigma * sigma;
    }
  for (const float sigma : print.sigma) by_texels += std::pow(lattice.texel_area_m2() * sigma, 2);
  return by_texels > 0 ? std::sqrt(by_pixels / by_texels) : 1;
}

// How much a print looks like part `part` of the sheet: its correlation with it, up to a factor.
double Likeness(const FilterSheet& sheet, const Lattice& lattice,
                const lightfield::MeasuredPrint& print, int part) {
  double product = 0, square = 0;
  for (int row = 0; row < lattice.height; ++row)
    for (int column = 0; column < lattice.width; ++column) {
      const double meant = sheet.FilterTransmittance(lattice.centre(row, column), part);
      product +=
          meant * print.transmittance[static_cast<std::size_t>(row) * lattice.width + column];
      square += meant * meant;
    }
  return product / std::sqrt(square);
}

void RequireOrder(const FilterSheet& sheet, const MeasuredFilter& filter) {
  constexpr const char* kParts[] = {"plus", "minus"};
  for (int print = 0; print < sheet.prints(); ++print)
    for (int part = 0; part < sheet.prints(); ++part) {
      const auto& seen = filter.prints[static_cast<std::size_t>(print)];
      if (Likeness(sheet, filter.lattice, seen, part) >
          Likeness(sheet, filter.lattice, seen, print))
        throw InputError(kFile,
                         fmt::format("print {} of the pair looks like its {} part, not like the {} "
                                     "part",
                                     print + 1, kParts[part], kParts[print]),
                         "give the plus part first, then the minus part");
    }
}

}  // namespace

rig::ToneTable FilterReadings::Tone() const {
  rig::ToneTable table;
  double last_sigma = 0;
  for (const WedgeReading& step : prints.at(0).wedge) {
    const double error = std::hypot(step.sigma, last_sigma);
    if (!table.density.empty() && !(step.density > table.density.back() + 3 * error)) continue;
    table.code.push_back(step.code);
    table.density.push_back(step.density);
    last_sigma = step.sigma;
  }
  if (table.code.size() < 2 || table.code[0] != 1)
    throw InputError(kFile, "the step wedge is not seen: fewer than two steps differ",
                     "print the sheet with its wedge, and photograph all of it");
  return table;
}

nlohmann::json ToJson(const FilterReadings& readings) {
  nlohmann::json prints = nlohmann::json::array();
  for (const PrintReading& p : readings.prints) {
    nlohmann::json wedge = nlohmann::json::array();
    for (const WedgeReading& step : p.wedge)
      wedge.push_back({{"code", step.code}, {"density", step.density}, {"sigma", step.sigma}});
    prints.push_back({{"shift_x_m", p.shift_m.x},
                      {"shift_y_m", p.shift_m.y},
                      {"shift_sigma_m", p.shift_sigma_m},
                      {"rotation_rad", p.rotation_rad},
                      {"rotation_sigma_rad", p.rotation_sigma_rad},
                      {"mark_residual_m", p.mark_residual_m},
                      {"light_ratio", p.light_ratio},
                      {"light_ratio_sigma", p.light_ratio_sigma},
                      {"wedge", wedge}});
  }
  return {{"holder_from_sensor", readings.holder_from_sensor.row_major()},
          {"pixel_m", readings.pixel_m},
          {"holder_residual_m", readings.holder_residual_m},
          {"axis_sigma_m", readings.axis_sigma_m},
          {"stretch_sigma", readings.stretch_sigma},
          {"prints", prints}};
}

MeasuredFilter MeasureFilter(const FilterSheet& sheet, const MergedFrame& light,
                             std::span<const MergedFrame> prints, FilterReadings* readings) {
  if (static_cast<int>(prints.size()) != sheet.prints())
    throw InputError(kFile,
                     fmt::format("{} of prints, the sheet has {}", prints.size(), sheet.prints()),
                     "give one of every print");
  for (const MergedFrame& print : prints)
    if (print.width != light.width || print.height != light.height)
      throw InputError(kFile, "differ in size", "take all with one camera in one place");
  FilterReadings own;
  FilterReadings& r = readings ? *readings : own;
  r = {};
  const Values light_values = KnownPixels(light);
  const Picture light_picture = light_values.View(light);
  r.holder_from_sensor = HolderFromSensor(sheet, light_picture, &r);
  const rig::Homography& h = r.holder_from_sensor;
  const Vec2 middle{0.5 * light.width, 0.5 * light.height};
  const Vec2 right = h.Map(middle + Vec2{1, 0}) - h.Map(middle),
             down = h.Map(middle + Vec2{0, 1}) - h.Map(middle);
  r.pixel_m = std::max(Norm(right), Norm(down));

  MeasuredFilter filter;
  filter.filter = sheet.filter;
  filter.basis = sheet.basis;
  filter.spacing_m = sheet.spacing_m;
  filter.filter_scale = sheet.filter_scale;
  filter.lattice = FilterLattice(sheet, r.pixel_m);
  // Means over pixels, spread evenly over them again: two boxes of variance pixel^2 / 12.
  filter.blur_m = r.pixel_m / std::sqrt(6.0);
  for (const MergedFrame& print : prints) {
    PrintReading& reading = r.prints.emplace_back();
    const Values values = KnownPixels(print);
    std::tie(reading.light_ratio, reading.light_ratio_sigma) =
        LightRatio(sheet, h, light_picture, values.View(print));
    filter.level_sigma =
        std::max(filter.level_sigma, reading.light_ratio_sigma / reading.light_ratio);
    const MergedFrame transmittance = Transmittance(light, print, reading.light_ratio);
    const Values known = KnownPixels(transmittance);
    LocatePrint(sheet, h, known.View(transmittance), &reading);
    reading.wedge = ReadWedge(sheet, h, transmittance, reading);
    filter.prints.push_back(ToTexels(h, transmittance, filter.lattice));
    const double ratio = SumSigmaRatio(h, transmittance, filter.lattice, filter.prints.back());
    filter.sum_sigma_ratio =
        filter.prints.size() == 1 ? ratio : std::max(filter.sum_sigma_ratio, ratio);
  }
  RequireOrder(sheet, filter);
  const PrintReading& first = r.prints.front();
  filter.shift_m = first.shift_m;
  filter.rotation_rad = first.rotation_rad;
  filter.shift_sigma_m = first.shift_sigma_m;
  filter.rotation_sigma_rad = first.rotation_sigma_rad;
  filter.position_sigma_m = r.axis_sigma_m;
  filter.stretch_sigma = r.stretch_sigma;
  return filter;
}

}  // namespace luxfield::reconstruct
