#include "luxfield/bridges/pbrt_lamp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "luxfield/bridges/belongs_to.h"
#include "luxfield/bridges/lit_texels.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/version.h"

namespace luxfield::bridges {
namespace {

using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::Vec2;
using lightfield::Vec3;

// Of pbrt's frames, so wide that its bound of the directions that a projector lights, which is found
// before the shear, holds them all.
constexpr double kFovDeg = 170;

// The projectors of a field: columns x rows of knot cells, and the texels of I that the light of any
// of them shines through, as seen from the middle of the cell.
class Projectors {
 public:
  explicit Projectors(const LightField& field) : field_(field) {
    const auto& g = field.geometry;
    along_u_ = SharesAlong(g.lattice.ds_m);
    along_v_ = SharesAlong(g.lattice.dt_m);
    const LitTexels lit = SurveyOf(field).lit;
    if (lit.rows() == 0) return;
    const int beyond_u = static_cast<int>(along_u_[0].size() / 2),
              beyond_v = static_cast<int>(along_v_[0].size() / 2);
    window_ = {lit.first_row - beyond_v, lit.end_row + beyond_v, lit.first_column - beyond_u,
               lit.end_column + beyond_u};
  }

  int columns() const { return field_.geometry.grid.width + field_.geometry.grid.basis.cells - 1; }
  int rows() const { return field_.geometry.grid.height + field_.geometry.grid.basis.cells - 1; }
  const LitTexels& window() const { return window_; }

  Vec2 middle(int k, int l) const {
    const auto& grid = field_.geometry.grid;
    return {grid.u0_m + (k + 0.5) * grid.spacing_m, grid.v0_m + (l + 0.5) * grid.spacing_m};
  }

  // Integral over the cell of sum_ij C_ij(s + u - middle) Phi_ij(u) du by texel s of the window.
  core::Image Fluxes(int k, int l) const {
    const auto& g = field_.geometry;
    const int cells = g.grid.basis.cells;
    core::Image sum(window_.columns(), window_.rows(), g.channels);
    for (int j = std::max(0, l - cells + 1); j <= std::min(l, g.grid.height - 1); ++j)
      for (int i = std::max(0, k - cells + 1); i <= std::min(k, g.grid.width - 1); ++i)
        for (int channel = 0; channel < g.channels; ++channel)
          AddImage(field_.image(g.grid.index(i, j), channel), along_u_[k - i], along_v_[l - j],
                   sum.plane(channel));
    return sum;
  }

  // delta^2 / cos^3, which turns a flux of the picture's texel into an intensity.
  double IntensityOfFlux(int k, int l, int row, int column) const {
    const auto& g = field_.geometry;
    const Vec2 s = g.lattice.centre(window_.first_row + row, window_.first_column + column),
               u = middle(k, l);
    const double tangents = std::hypot(s.x - u.x, s.y - u.y) / g.delta_m;
    return g.delta_m * g.delta_m * std::pow(1 + tangents * tangents, 1.5);
  }

  // field_from_light, pbrt's projection apart: columns of a 4 x 4 matrix.
  std::array<double, 16> Transform(int k, int l) const {
    const auto& g = field_.geometry;
    const Vec2 u = middle(k, l);
    const double s0 = g.lattice.s_of_column(window_.first_column),
                 s1 = g.lattice.s_of_column(window_.end_column),
                 t0 = g.lattice.t_of_row(window_.end_row),
                 t1 = g.lattice.t_of_row(window_.first_row);
    // pbrt's screen is [-a, a] x [-1, 1] of wide pictures and [-1, 1] x [-1/a, 1/a] of others.
    const double aspect = static_cast<double>(window_.columns()) / window_.rows();
    const double screen_x = aspect > 1 ? aspect : 1, screen_y = aspect > 1 ? 1 : 1 / aspect;
    const double half = std::tan(kFovDeg / 2 * std::numbers::pi / 180);
    return {(s1 - s0) / (2 * g.delta_m * screen_x * half),
            0,
            0,
            0,
            0,
            (t1 - t0) / (2 * g.delta_m * screen_y * half),
            0,
            0,
            ((s0 + s1) / 2 - u.x) / g.delta_m,
            ((t0 + t1) / 2 - u.y) / g.delta_m,
            1,
            0,
            u.x,
            u.y,
            0,
            1};
  }

 private:
  // By cell a of a basis function's support: what of its integral over the cell looks through the
  // texels -M .. M beside that which the middle looks through, in m.
  std::vector<std::vector<double>> SharesAlong(double texel_m) const {
    const auto& grid = field_.geometry.grid;
    const double texels = grid.spacing_m / texel_m;  // that the cell spans
    const int beyond = static_cast<int>(std::ceil(texels / 2 - 0.5));
    std::vector<std::vector<double>> shares(grid.basis.cells);
    for (int a = 0; a < grid.basis.cells; ++a)
      for (int m = -beyond; m <= beyond; ++m) {
        const auto edge = [&](double at) { return std::clamp(0.5 + at / texels, 0.0, 1.0); };
        shares[a].push_back(grid.spacing_m *
                            grid.basis.Integral(a + edge(m - 0.5), a + edge(m + 0.5)));
      }
    return shares;
  }

  // Adds an image weighed along both axes; v and t point to smaller rows.
  void AddImage(std::span<const float> image, const std::vector<double>& along_u,
                const std::vector<double>& along_v, std::span<float> sum) const {
    const auto& lattice = field_.geometry.lattice;
    const int beyond_u = static_cast<int>(along_u.size() / 2),
              beyond_v = static_cast<int>(along_v.size() / 2), width = window_.columns();
    std::vector<double> line(width);
    for (int row = std::max(window_.first_row, 0); row < std::min(window_.end_row, lattice.height);
         ++row) {
      const float* texels = &image[static_cast<std::size_t>(row) * lattice.width];
      for (int x = 0; x < width; ++x) {
        line[x] = 0;
        for (int m = -beyond_u; m <= beyond_u; ++m)
          if (const int column = window_.first_column + x + m;
              column >= 0 && column < lattice.width)
            line[x] += along_u[m + beyond_u] * texels[column];
      }
      for (int q = -beyond_v; q <= beyond_v; ++q) {
        const int y = row + q - window_.first_row;
        if (y < 0 || y >= window_.rows()) continue;
        float* to = &sum[static_cast<std::size_t>(y) * width];
        for (int x = 0; x < width; ++x)
          to[x] += static_cast<float>(along_v[q + beyond_v] * line[x]);
      }
    }
  }

  const LightField& field_;
  LitTexels window_;
  std::vector<std::vector<double>> along_u_, along_v_;
};

// Intensities; what is negative becomes 0. Adds the cell's flux, and what of it is negative.
core::Image PictureOf(const Projectors& projectors, int k, int l, double& positive,
                      double& negative) {
  core::Image picture = projectors.Fluxes(k, l);
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column) {
      const double factor = projectors.IntensityOfFlux(k, l, row, column);
      for (int channel = 0; channel < picture.channels; ++channel) {
        float& value = picture.at(channel, row, column);
        (value > 0 ? positive : negative) += std::abs(value);
        value = static_cast<float>(std::max(0.0, factor * value));
      }
    }
  return picture;
}

core::Image WithThreeChannels(core::Image picture) {
  if (picture.channels == 3) return picture;
  core::Image three(picture.width, picture.height, 3);
  for (int channel = 0; channel < 3; ++channel)
    std::copy_n(picture.plane(0).begin(), picture.plane(0).size(), three.plane(channel).begin());
  return three;
}

bool IsDark(const core::Image& picture) {
  return std::all_of(picture.data.begin(), picture.data.end(), [](float i) { return i == 0; });
}

std::string Matrix(const std::array<double, 16>& columns) {
  std::string text;
  for (const double value : columns) text += fmt::format(" {:.9g}", value);
  return text;
}

std::string PoseMatrix(const lightfield::RigidPose& pose) {
  const auto& r = pose.rotation;
  const Vec3 t = pose.translation_m;
  return Matrix({r[0], r[3], r[6], 0, r[1], r[4], r[7], 0, r[2], r[5], r[8], 0, t.x, t.y, t.z, 1});
}

// A picture that belongs to `path`, and says so.
void WritePicture(const std::filesystem::path& file, const std::filesystem::path& path,
                  const core::Image& picture) {
  core::RequireOwn(file, path, kBelongsTo);
  core::WriteExrImage(file, picture, {{kBelongsTo, path.filename().string()}});
}

void WriteProjectors(const std::filesystem::path& path, std::span<const PosedLightField> fields,
                     PbrtLamp& written) {
  const std::string stem = path.stem().string(), pictures = path.filename().string() + ".pictures";
  core::MakeFolder(path.parent_path() / pictures);
  std::string text =
      fmt::format("# {}, a measured lamp, by luxfield " LUXFIELD_VERSION ". It shines along +z.\n",
                  core::OnOneLine(stem));
  double positive = 0, negative = 0;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const Projectors projectors(fields[f].field);
    if (projectors.window().rows() == 0) continue;
    for (int l = 0; l < projectors.rows(); ++l)
      for (int k = 0; k < projectors.columns(); ++k) {
        const core::Image picture = PictureOf(projectors, k, l, positive, negative);
        if (IsDark(picture)) continue;
        const std::string name = fields.size() == 1
                                     ? fmt::format("{}/{:02}.{:02}.exr", pictures, l, k)
                                     : fmt::format("{}/{}.{:02}.{:02}.exr", pictures, f, l, k);
        WritePicture(path.parent_path() / name, path, WithThreeChannels(picture));
        written.files.push_back(path.parent_path() / name);
        ++written.projectors;
        text += fmt::format(
            "AttributeBegin\n  ConcatTransform [{} ]\n  ConcatTransform [{} ]\n"
            "  LightSource \"projection\" \"string filename\" \"{}\" \"float fov\" {}\n"
            "AttributeEnd\n",
            PoseMatrix(fields[f].luminaire_from_field), Matrix(projectors.Transform(k, l)), name,
            kFovDeg);
      }
  }
  written.negative_share = positive > negative ? negative / (positive - negative) : 0;
  core::WriteFileAtomically(path, text);
}

// The projectors of a lamp of one channel, to be asked for illuminance.
class ProjectedLamp {
 public:
  explicit ProjectedLamp(std::span<const PosedLightField> fields) : fields_(fields) {
    double ignored = 0;
    for (const PosedLightField& posed : fields) {
      projectors_.emplace_back(posed.field);
      const Projectors& field = projectors_.back();
      pictures_.emplace_back();
      if (field.window().rows() == 0) continue;
      for (int l = 0; l < field.rows(); ++l)
        for (int k = 0; k < field.columns(); ++k)
          pictures_.back().push_back(PictureOf(field, k, l, ignored, ignored));
    }
  }

  // At p on a surface with the unit normal n.
  double Illuminance(Vec3 p, Vec3 n) const {
    double sum = 0;
    for (std::size_t f = 0; f < fields_.size(); ++f) {
      const auto field_from_luminaire = fields_[f].luminaire_from_field.Inverse();
      const Vec3 at = field_from_luminaire.Point(p), normal = field_from_luminaire.Direction(n);
      if (at.z > 0 && !pictures_[f].empty()) sum += OfField(f, at, normal);
    }
    return sum;
  }

 private:
  double OfField(std::size_t f, Vec3 at, Vec3 normal) const {
    const auto& g = fields_[f].field.geometry;
    const Projectors& field = projectors_[f];
    const LitTexels& window = field.window();
    double sum = 0;
    for (int l = 0; l < field.rows(); ++l)
      for (int k = 0; k < field.columns(); ++k) {
        const Vec2 u = field.middle(k, l);
        const Vec3 away{at.x - u.x, at.y - u.y, at.z};
        const double squared = Dot(away, away), cosine = -Dot(away, normal) / std::sqrt(squared);
        const double column = std::floor(g.lattice.column_of_s(u.x + g.delta_m * away.x / away.z)) -
                              window.first_column,
                     row = std::floor(g.lattice.row_of_t(u.y + g.delta_m * away.y / away.z)) -
                           window.first_row;
        if (!(cosine > 0 && column >= 0 && column < window.columns() && row >= 0 &&
              row < window.rows()))
          continue;
        sum += pictures_[f][static_cast<std::size_t>(l) * field.columns() + k].at(
                   0, static_cast<int>(row), static_cast<int>(column)) *
               cosine / squared;
      }
    return sum;
  }

  std::span<const PosedLightField> fields_;
  std::vector<Projectors> projectors_;
  std::vector<std::vector<core::Image>> pictures_;  // by field, all of its cells
};

core::Image FarPicture(const formats::Photometry& table) {
  constexpr int kSide = 1024;
  core::Image picture(kSide, kSide, 1);
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const Vec3 d =
          EqualAreaDirection((2 * column + 1.0) / kSide - 1, (2 * row + 1.0) / kSide - 1);
      picture.at(0, row, column) =
          static_cast<float>(std::max(0.0, Intensity(table, {d.x, d.z, d.y})));
    }
  return picture;
}

}  // namespace

Vec3 EqualAreaDirection(double x, double y) {
  const double ax = std::abs(x), ay = std::abs(y), s = 1 - ax - ay, r = 1 - std::abs(s);
  const double phi = std::numbers::pi / 4 * (r > 0 ? (ay - ax) / r + 1 : 1);
  const double across = r * std::sqrt(2 - r * r);
  return {std::copysign(std::cos(phi) * across, x), std::copysign(std::sin(phi) * across, y),
          std::copysign(1 - r * r, s)};
}

PbrtLamp WritePbrtLamp(const std::filesystem::path& path, std::span<const PosedLightField> fields,
                       const std::string& source) {
  const auto luminance = formats::LuminanceOf(fields);
  const formats::Photometry table = formats::SampleFarField(luminance, {}, {}, source).table;
  PbrtLamp written;
  const std::string far = path.filename().string() + ".far";
  written.files = {path, path.parent_path() / (far + ".pbrt"), path.parent_path() / (far + ".exr")};
  constexpr char kFarMark[] = "a measured lamp's far field, by luxfield";
  core::RequireOwn(written.files[1], path, kFarMark);
  WritePicture(written.files[2], path, FarPicture(table));
  const auto flux = lightfield::TotalFlux(fields);
  const double whole = core::Luminance(flux);
  core::WriteFileAtomically(written.files[1],
                            fmt::format("# {}, {} " LUXFIELD_VERSION ". It shines along +z.\n"
                                        "LightSource \"goniometric\"\n"
                                        "  \"string filename\" \"{}.exr\"\n"
                                        "  \"rgb I\" [ {:.6g} {:.6g} {:.6g} ]\n",
                                        core::OnOneLine(path.stem().string()), kFarMark, far,
                                        flux[0] / whole, flux[1] / whole, flux[2] / whole));
  WriteProjectors(path, fields, written);
  const ProjectedLamp projected(luminance);
  written.near =
      DeviationsOf(luminance, [&](Vec3 p, Vec3 n) { return projected.Illuminance(p, n); });
  written.far = DeviationsOf(luminance, [&](Vec3 p, Vec3 n) {
    const double r = Length(p);
    return Intensity(table, p) * std::max(0.0, -Dot(p, n) / r) / (r * r);
  });
  return written;
}

}  // namespace luxfield::bridges
