#include "luxfield/bridges/radiance_source.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <fstream>
#include <limits>

#include "luxfield/bridges/lit_texels.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"
#include "luxfield/core/primaries.h"
#include "luxfield/version.h"

namespace luxfield::bridges {
namespace {

using core::Matrix3;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::PosedLightField;
using lightfield::Vec3;

// Radiance's own primaries (its color.h), white of equal energy.
constexpr core::Primaries kRadiancePrimaries = {
    {0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, {1.0 / 3, 1.0 / 3}};

// In each file that belongs to a scene description.
constexpr char kMark[] = "of a light field (luxfield ";

// Radiance takes no dimension of a single value: a second one, never asked for, is added.
int Nodes(int count) { return std::max(count, 2); }

Matrix3 RadianceFromRec709() {
  const Matrix3 to = core::XyzFromRgb(kRadiancePrimaries), from = core::XyzFromRgb(core::kRec709);
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Rows a, b;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      a(row, column) = to[row][column], b(row, column) = from[row][column];
  const Rows product = a.inverse() * b;
  Matrix3 m;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m[row][column] = product(row, column);
  return m;
}

void Write(std::ofstream& out, const std::string& text) {
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
}

// Writes a text file by pieces, at once or not at all.
template <typename Fill>
void WriteText(const std::filesystem::path& path, Fill&& fill) {
  core::WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    fill(out);
    out.close();
    if (!out) throw DeviceError(fmt::format("{}: cannot be written", path.string()));
  });
}

// C, or one channel of Radiance's of it, over (j, i, row, column).
void WriteData(const std::filesystem::path& path, const LightField& field, const LitTexels& lit,
               const core::Rgb& weights) {
  const auto& g = field.geometry;
  const int width = g.grid.width, height = g.grid.height;
  const int nodes[] = {Nodes(height), Nodes(width), Nodes(lit.rows()), Nodes(lit.columns())};
  WriteText(path, [&](std::ofstream& out) {
    Write(out, fmt::format("# C {}" LUXFIELD_VERSION ")\n4\n", kMark));
    for (const int count : nodes) Write(out, fmt::format("0 {} {}\n", count - 1, count));
    std::string line;
    for (int j = 0; j < nodes[0]; ++j)
      for (int i = 0; i < nodes[1]; ++i)
        for (int row = 0; row < nodes[2]; ++row) {
          line.clear();
          for (int column = 0; column < nodes[3]; ++column) {
            float c = 0;
            if (j < height && i < width && row < lit.rows() && column < lit.columns()) {
              const std::size_t at =
                  static_cast<std::size_t>(lit.first_row + row) * g.lattice.width +
                  lit.first_column + column;
              double sum = 0;
              for (int channel = 0; channel < g.channels; ++channel)
                sum += weights[channel] * field.image(g.grid.index(i, j), channel)[at];
              c = static_cast<float>(sum);
            }
            fmt::format_to(std::back_inserter(line), "{} ", c);
          }
          line.back() = '\n';
          Write(out, line);
        }
  });
}

// Where along an axis C is looked up, in the variables k and f of the axis, and what multiplies it.
struct Lookups {
  std::vector<std::string> places;  // one, or two that are mixed as 1 - f and f
  std::string factor = "1";
};

Lookups LookupsOf(const lightfield::Basis& basis, char axis) {
  const std::string k = fmt::format("k{}", axis), f = fmt::format("f{}", axis);
  switch (basis.kind) {
    case BasisKind::kBox:
      return {{k}};
    case BasisKind::kBilinear:
      return {{fmt::format("{} - 1 + {}", k, f)}};
    case BasisKind::kQuadratic: {
      const std::string sum = fmt::format("(1 - {} * {} * (1 - {}))", 2 * basis.a, f, f);
      return {{fmt::format("{} - 1 + {} * (1 - {} * (1 - {})) / {}", k, f, basis.a, f, sum)}, sum};
    }
    case BasisKind::kBspline2:
      return {{fmt::format("{} - 1.5 + {} / 2", k, f), fmt::format("{} - 1 + {} / 2", k, f)}};
  }
  throw std::logic_error("unknown basis");
}

// The lines that bring Radiance's place and direction into the field's frame.
std::string FrameLines(const lightfield::RigidPose& pose) {
  const auto& r = pose.rotation;
  const Vec3 t = pose.translation_m;
  std::string lines = fmt::format("rx = Px - {}; ry = Py - {}; rz = Pz - {};\n", t.x, t.y, t.z);
  constexpr const char* kNames[] = {"u", "v", "w"};
  for (int axis = 0; axis < 2; ++axis)
    lines += fmt::format("p{} = {} * rx + {} * ry + {} * rz;\n", kNames[axis], r[axis], r[axis + 3],
                         r[axis + 6]);
  for (int axis = 0; axis < 3; ++axis)
    lines += fmt::format("d{} = {} * Dx + {} * Dy + {} * Dz;\n", kNames[axis], r[axis], r[axis + 3],
                         r[axis + 6]);
  return lines;
}

std::string Functions(const PosedLightField& posed, const LitTexels& lit, const std::string& name) {
  const auto& g = posed.field.geometry;
  const auto& grid = g.grid;
  const double scale = g.unit == lightfield::FluxUnit::kLumen ? 1 / kRadianceEfficacy : 1;
  std::string text =
      fmt::format("{{ {}: radiance {}" LUXFIELD_VERSION
                  "), as\n"
                  "  L = delta^2 / cos^4 sum C_ij(s) Phi_ij(u), C over (j, i, row, column) }}\n\n",
                  name, kMark);
  text += FrameLines(posed.luminaire_from_field);
  text += fmt::format(
      "cosine = max(-dw, 1e-6);\n"
      "level = {} / cosine^4;\n\n"
      "{{ u on F: knot cell and the way through it }}\n"
      "ku = bound(0, floor((pu - {}) / {}), {});\n"
      "kv = bound(0, floor((pv - {}) / {}), {});\n"
      "fu = bound(0, (pu - {}) / {} - ku, 1);\n"
      "fv = bound(0, (pv - {}) / {} - kv, 1);\n\n",
      scale * g.delta_m * g.delta_m, grid.u0_m, grid.spacing_m, grid.width + grid.basis.cells - 2,
      grid.v0_m, grid.spacing_m, grid.height + grid.basis.cells - 2, grid.u0_m, grid.spacing_m,
      grid.v0_m, grid.spacing_m);
  text += fmt::format(
      "{{ s on I: column and row of the texel }}\n"
      "column = floor((pu - {} * du / cosine - {}) / {});\n"
      "row = floor(({} - pv + {} * dv / cosine) / {});\n"
      "lit = if(and(and(column + .5, {} - column), and(row + .5, {} - row)), 1, 0);\n"
      "c = bound(0, column, {});\n"
      "r = bound(0, row, {});\n\n",
      g.delta_m, g.lattice.s_of_column(lit.first_column), g.lattice.ds_m,
      g.lattice.t_of_row(lit.first_row), g.delta_m, g.lattice.dt_m, lit.columns() - 0.5,
      lit.rows() - 0.5, lit.columns() - 1, lit.rows() - 1);
  text +=
      "{ the part of a linear interpolation between n values at 0 .. n - 1, and 0 beyond, that "
      "the\n"
      "  nearest place within them leaves }\n"
      "ramp(y, n) = bound(0, 1 + y, 1) * bound(0, n - y, 1);\n"
      "place(y, n) = bound(0, y, n - 1);\n\n";
  const Lookups along[] = {LookupsOf(grid.basis, 'u'), LookupsOf(grid.basis, 'v')};
  for (std::size_t b = 0; b < along[1].places.size(); ++b)
    for (std::size_t a = 0; a < along[0].places.size(); ++a)
      text += fmt::format(
          "i{0}{1} = place({2}, {3});\n"
          "j{0}{1} = place({4}, {5});\n"
          "value{0}{1}(x) = x * level * lit * ramp({2}, {3}) * ramp({4}, {5}) * {6} * {7};\n",
          a, b, along[0].places[a], grid.width, along[1].places[b], grid.height, along[0].factor,
          along[1].factor);
  return text;
}

// The patterns and the light that the polygons of a field have; `files` is how the names of its files
// begin.
std::string Material(const std::string& name, const std::string& files, int channels, int places) {
  const auto pattern = [&](int a, int b) {
    const std::string id = fmt::format("{}{}", a, b);
    if (channels == 1)
      return fmt::format(
          "void brightdata {0}.C{1}\n7 value{1} {2}.dat {2}.cal j{1} i{1} r c\n0\n0\n", name, id,
          files);
    return fmt::format(
        "void colordata {0}.C{1}\n11 value{1} value{1} value{1} {2}.r.dat {2}.g.dat {2}.b.dat "
        "{2}.cal j{1} i{1} r c\n0\n0\n",
        name, id, files);
  };
  const auto mixture = [&](const char* id, const char* at_1, const char* at_0, const char* share) {
    return fmt::format("void mixfunc {0}.{1}\n4 {0}.{2} {0}.{3} {4} {5}.cal\n0\n0\n", name, id,
                       at_1, at_0, share, files);
  };
  std::string text;
  for (int b = 0; b < places; ++b)
    for (int a = 0; a < places; ++a) text += pattern(a, b);
  if (places == 2)
    text += mixture("C0", "C10", "C00", "fu") + mixture("C1", "C11", "C01", "fu") +
            mixture("C", "C1", "C0", "fv");
  return text +
         fmt::format("{0}.C{1} light {0}.light\n0\n0\n3 1 1 1\n", name, places == 2 ? "" : "00");
}

// A polygon for each knot cell that an image with light reaches.
std::string Polygons(const std::string& name, const PosedLightField& posed, const Survey& survey,
                     int& count) {
  const BasisGrid& grid = posed.field.geometry.grid;
  const int n = grid.basis.cells;
  std::string text;
  const auto shines = [&](int ku, int kv) {
    for (int j = std::max(0, kv - n + 1); j <= std::min(kv, grid.height - 1); ++j)
      for (int i = std::max(0, ku - n + 1); i <= std::min(ku, grid.width - 1); ++i)
        if (survey.shines[static_cast<std::size_t>(grid.index(i, j))]) return true;
    return false;
  };
  for (int kv = 0; kv < grid.height + n - 1; ++kv)
    for (int ku = 0; ku < grid.width + n - 1; ++ku) {
      if (!shines(ku, kv)) continue;
      text += fmt::format("{0}.light polygon {0}.{1}_{2}\n0\n0\n12\n", name, ku, kv);
      constexpr int kCorners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      for (const auto& corner : kCorners) {
        const Vec3 p =
            posed.luminaire_from_field.Point({grid.u0_m + (ku + corner[0]) * grid.spacing_m,
                                              grid.v0_m + (kv + corner[1]) * grid.spacing_m, 0});
        text += fmt::format("  {:.12g} {:.12g} {:.12g}\n", p.x, p.y, p.z);
      }
      ++count;
    }
  return text;
}

void RequireName(const std::filesystem::path& path, const std::string& stem) {
  const bool good = std::all_of(stem.begin(), stem.end(), [](unsigned char c) {
    return c < 128 && (std::isalnum(c) || c == '.' || c == '_' || c == '-');
  });
  if (!good || stem.empty())
    throw InputError(path.string(), "is no name that Radiance's files can name",
                     "use letters, digits, '.', '_' and '-'");
}

void RequireCountable(const LightField& field, const LitTexels& lit, const std::string& source) {
  const auto& grid = field.geometry.grid;
  const double values =
      double(Nodes(grid.width)) * Nodes(grid.height) * Nodes(lit.rows()) * Nodes(lit.columns());
  if (values > std::numeric_limits<std::int32_t>::max())
    throw InputError(source,
                     fmt::format("has {:.3g} coefficients, and a data file of Radiance holds {}",
                                 values, std::numeric_limits<std::int32_t>::max()),
                     "reconstruct it with larger texels");
}

}  // namespace

RadianceSource WriteRadianceSource(const std::filesystem::path& path,
                                   std::span<const PosedLightField> fields,
                                   const std::string& source) {
  const std::string stem = path.stem().string();
  RequireName(path, stem);
  RadianceSource written;
  written.files = {path};
  std::string scene = fmt::format(
      "# {}, written by luxfield " LUXFIELD_VERSION ". Metres; light goes towards +z.\n", stem);
  double positive = 0, negative = 0;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const LightField& field = fields[k].field;
    const Survey survey = SurveyOf(field);
    positive += survey.positive * FluxOfCoefficient(field.geometry);
    negative += survey.negative * FluxOfCoefficient(field.geometry);
    if (survey.lit.rows() == 0) continue;
    RequireCountable(field, survey.lit, source);
    const std::string name = fields.size() == 1 ? stem : fmt::format("{}_{}", stem, k);
    const std::string file =
        path.filename().string() + (fields.size() == 1 ? "" : fmt::format(".{}", k));
    const auto beside = [&](const std::string& ending) {
      written.files.push_back(path.parent_path() / (file + ending));
      core::RequireOwn(written.files.back(), path, kMark);
      return written.files.back();
    };
    const std::string functions = Functions(fields[k], survey.lit, name);
    WriteText(beside(".cal"), [&](std::ofstream& out) { Write(out, functions); });
    const int channels = field.geometry.channels;
    if (channels == 1) {
      WriteData(beside(".dat"), field, survey.lit, {1, 0, 0});
    } else {
      const Matrix3 m = RadianceFromRec709();
      for (int channel = 0; channel < 3; ++channel)
        WriteData(beside(fmt::format(".{}.dat", "rgb"[channel])), field, survey.lit, m[channel]);
    }
    const bool two = field.geometry.grid.basis.kind == BasisKind::kBspline2;
    scene += Material(name, file, channels, two ? 2 : 1) +
             Polygons(name, fields[k], survey, written.polygons);
  }
  if (!(positive > 0))
    throw InputError(source, "holds no light: no coefficient is above 0",
                     "choose another light field");
  WriteText(path, [&](std::ofstream& out) { Write(out, scene); });
  written.negative_share = negative / positive;
  return written;
}

}  // namespace luxfield::bridges
