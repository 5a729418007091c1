#include "luxfield/capture/filter/print_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"

namespace luxfield::capture {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::Vec2;
using rig::FilterSheet;
using rig::ToneTable;

std::filesystem::path Name(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("luxfield_print_" + name);
}

struct Tiff {
  PrintedSheet sheet;
  float dpi = 0;
  std::string description;
};

Tiff ReadBack(const std::filesystem::path& path) {
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(path.c_str(), "r"), &TIFFClose);
  Tiff out;
  std::uint16_t bits = 0, unit = 0;
  char* text = nullptr;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &out.sheet.width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &out.sheet.height);
  TIFFGetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetField(tiff.get(), TIFFTAG_XRESOLUTION, &out.dpi);
  TIFFGetField(tiff.get(), TIFFTAG_RESOLUTIONUNIT, &unit);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, &text);
  EXPECT_EQ(bits, 16);
  EXPECT_EQ(unit, RESUNIT_INCH);
  out.description = text;
  out.sheet.code.resize(static_cast<std::size_t>(out.sheet.width) * out.sheet.height);
  for (int row = 0; row < out.sheet.height; ++row)
    TIFFReadScanline(tiff.get(), out.sheet.code.data() + std::size_t(row) * out.sheet.width, row,
                     0);
  return out;
}

double CodeAt(const PrintedSheet& sheet, double dpi, Vec2 offset) {
  const double per_m = dpi / 0.0254;
  const int column = static_cast<int>(std::floor(offset.x * per_m + 0.5 * sheet.width)),
            row = static_cast<int>(std::floor(0.5 * sheet.height - offset.y * per_m));
  return sheet.code.at(std::size_t(row) * sheet.width + column) / 65535.0;
}

TEST(PrintFilter, TiffHoldsTheFilterInItsPlace) {
  constexpr double kDpi = 600, kSpacing_m = 0.005;
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const auto sheet = FilterSheet::Make(FilterKind::kBasis, basis, kSpacing_m, 16.0 / 9);
  const auto files = PrintFilter(sheet, Name("tiff"), {kDpi, {}});
  ASSERT_EQ(files.size(), 3u);
  const Tiff tiff = ReadBack(files[1]);
  EXPECT_EQ(tiff.dpi, 600);
  EXPECT_EQ(tiff.sheet.width, std::lround(1.4 * 0.015 / 0.0254 * kDpi));
  const auto json = nlohmann::json::parse(tiff.description);
  EXPECT_EQ(json["sheet"]["basis"], "bspline2");
  EXPECT_EQ(json["sheet"]["spacing_m"], kSpacing_m);
  EXPECT_EQ(json["dpi"], kDpi);
  // At pixel centres: the code is Phi's mean over the pixel, which differs from the point by its
  // curvature, (16/9)(pixel / h)^2 / 24 * 2, below 1e-5; rounding is 1/65535.
  const double pixel_m = 0.0254 / kDpi;
  for (int row = 0; row < tiff.sheet.height; row += 7)
    for (int column = 0; column < tiff.sheet.width; column += 5) {
      const double x = (column + 0.5 - 0.5 * tiff.sheet.width) * pixel_m,
                   y = (0.5 * tiff.sheet.height - row - 0.5) * pixel_m;
      if (std::abs(x) > 0.0075 || std::abs(y) > 0.0075) continue;
      EXPECT_NEAR(tiff.sheet.code[std::size_t(row) * tiff.sheet.width + column] / 65535.0,
                  16.0 / 9 * basis.Value(x / kSpacing_m + 1.5) * basis.Value(y / kSpacing_m + 1.5),
                  3e-5);
    }
  // Clear and opaque places, to a quarter of a millimetre.
  const double s = 0.015;
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(CodeAt(tiff.sheet, kDpi, {0.58 * s + sign * 0.8 * s / 50, 0.58 * s}), 1);
    EXPECT_EQ(CodeAt(tiff.sheet, kDpi, {0.58 * s + sign * 1.3 * s / 50, 0.58 * s}), 0);
  }
  EXPECT_EQ(CodeAt(tiff.sheet, kDpi, {-0.48 * s, 0.58 * s}), 1);
  EXPECT_EQ(CodeAt(tiff.sheet, kDpi, {0.48 * s, -0.52 * s}), 0);
  for (int k = 0; k < 21; ++k)
    EXPECT_NEAR(CodeAt(tiff.sheet, kDpi, {(-0.48 + 0.96 * (k + 0.5) / 21) * s, -0.6 * s}),
                std::pow(10, -0.15 * k), 1e-5);
  // The sheet's own file brings the sheet back.
  EXPECT_EQ(rig::SheetText(rig::ReadFilterSheet(files[0])), rig::SheetText(sheet));
}

TEST(PrintFilter, DualPairIsTwoPrintsThatMakeTheDualFunction) {
  constexpr double kDpi = 300, kSpacing_m = 0.01;
  const Basis basis = Basis::Make(BasisKind::kQuadratic);
  const auto files = PrintFilter(FilterSheet::Make(FilterKind::kDual, basis, kSpacing_m, 1),
                                 Name("dual"), {kDpi, {}});
  ASSERT_EQ(files.size(), 4u);
  const PrintedSheet plus = ReadBack(files[1]).sheet, minus = ReadBack(files[2]).sheet;
  for (const double x : {0.0013, 0.0052, 0.0071, 0.0096})
    for (const double y : {0.0002, -0.0064}) {
      const double wanted = basis.DualValue(x / kSpacing_m) * basis.DualValue(y / kSpacing_m);
      // The point is off its pixel's centre by up to 42 um; |grad| is below 9 * 3 / h.
      EXPECT_NEAR(9 * CodeAt(plus, kDpi, {x, y}) - 0.919 * CodeAt(minus, kDpi, {x, y}), wanted,
                  27 / kSpacing_m * 6e-5);
    }
}

TEST(PrintFilter, ToneTableTurnsTransmittanceIntoTheRightDensity) {
  // A printer with base density 0.05, gain 1.3 and a toe.
  ToneTable tone;
  for (int k = 0; k <= 20; ++k) {
    tone.code.push_back(std::pow(10, -0.15 * k));
    tone.density.push_back(0.05 + 1.3 * 0.15 * k + 0.01 * k * k);
  }
  for (const double t : {1.0, 0.8, 0.33, 0.01, 1e-4, 1e-6}) {
    const double code = tone.Code(t), x = -std::log10(code) / 0.15;
    // What the table's polygon gives at that code.
    const int k = std::min(19, static_cast<int>(x));
    const double density = tone.density[k] + (x - k) * (tone.density[k + 1] - tone.density[k]);
    EXPECT_NEAR(density, 0.05 - std::log10(t), 1e-9) << t;
  }
  EXPECT_EQ(tone.Code(0), 0);
  const auto file = Name("x.tone.toml");
  rig::WriteToneTable(file, tone);
  const ToneTable back = rig::ReadToneTable(file);
  EXPECT_EQ(back.code, tone.code);
  EXPECT_EQ(back.density, tone.density);
  core::WriteFileAtomically(file, "[tone]\ncode = [1, 0.5]\ndensity = [0.3, 0.2]\n");
  EXPECT_THROW(rig::ReadToneTable(file), InputError);
  core::WriteFileAtomically(file, "[tone]\ncode = [1, 0.5]\ndensity = [0.1, 0.4]\ndensty = [1]\n");
  EXPECT_THAT([&] { rig::ReadToneTable(file); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("densty")));
}

TEST(PrintFilter, PdfIsExactInSizeAndTheSameEveryTime) {
  const auto sheet =
      FilterSheet::Make(FilterKind::kBasis, Basis::Make(BasisKind::kBilinear), 0.01, 1);
  const auto files = PrintFilter(sheet, Name("pdf"), {400, {}});
  const std::string pdf = core::ReadFile(files.back());
  const auto box = pdf.find("/MediaBox [ ");
  ASSERT_NE(box, std::string::npos);
  double width = 0, height = 0;
  ASSERT_EQ(std::sscanf(pdf.c_str() + box, "/MediaBox [ 0 0 %lf %lf ]", &width, &height), 2);
  // 28 mm to the nearest pixel of 400 dpi.
  EXPECT_NEAR(width, std::round(0.028 / 0.0254 * 400) * 72 / 400, 1e-3);
  EXPECT_EQ(width, height);
  EXPECT_EQ(pdf.find("/CreationDate (D:2"), std::string::npos);
  PrintFilter(sheet, Name("pdf"), {400, {}});
  EXPECT_EQ(core::ReadFile(files.back()), pdf);
}

// What the pages draw, and what stands in directories: every stream of the file, inflated (PDF 1.7,
// 7.3.8).
std::string InflatedStreams(const std::string& pdf) {
  std::string out;
  for (std::size_t at = 0; (at = pdf.find("\nstream\n", at)) != std::string::npos;) {
    at += 8;
    std::string text(1 << 20, '\0');
    uLongf size = text.size();
    if (uncompress(reinterpret_cast<Bytef*>(text.data()), &size,
                   reinterpret_cast<const Bytef*>(pdf.data() + at), pdf.size() - at) == Z_OK)
      out += text.substr(0, size) + "\n";
  }
  return out;
}

// The filter is as large as it was calculated: the picture's unit square, which PDF draws an image
// in, is scaled to its pixels at the stated resolution, and so to the whole page.
TEST(PrintFilter, PdfDrawsTheFilterInItsSize) {
  const auto sheet =
      FilterSheet::Make(FilterKind::kBasis, Basis::Make(BasisKind::kBilinear), 0.01, 1);
  const std::string pdf = core::ReadFile(PrintFilter(sheet, Name("size"), {400, {}}).back());
  const double side = std::round(0.028 / 0.0254 * 400) * 72 / 400;
  const std::string text = InflatedStreams(pdf);
  std::vector<std::array<double, 6>> matrices;
  for (std::size_t at = 0; (at = text.find(" cm", at)) != std::string::npos; ++at) {
    const std::size_t line = text.rfind('\n', at) + 1;
    const std::size_t from = std::max(line, text.rfind('q', at) + 1);
    auto& m = matrices.emplace_back();
    ASSERT_EQ(std::sscanf(text.c_str() + from, "%lf %lf %lf %lf %lf %lf cm", &m[0], &m[1], &m[2],
                          &m[3], &m[4], &m[5]),
              6)
        << text;
  }
  // Their product, the last one first: where the corners (0, 0) and (1, 1) of the picture land.
  for (const double corner : {0.0, 1.0}) {
    double x = corner, y = corner;
    for (auto m = matrices.rbegin(); m != matrices.rend(); ++m) {
      const double u = (*m)[0] * x + (*m)[2] * y + (*m)[4];
      y = (*m)[1] * x + (*m)[3] * y + (*m)[5];
      x = u;
    }
    EXPECT_NEAR(x, corner * side, 1e-2) << text;
    EXPECT_NEAR(y, corner * side, 1e-2) << text;
  }
}

TEST(PrintFilter, RefusesWhatCannotBePrinted) {
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  EXPECT_THROW(FilterSheet::Make(FilterKind::kBasis, basis, 0.01, 1.8), InputError);
  EXPECT_THROW(FilterSheet::Make(FilterKind::kBasis, basis, 0, 1), InputError);
  EXPECT_THROW(FilterSheet::Make(FilterKind::kDual, basis, 0.01, 1), InputError);
  const auto sheet = FilterSheet::Make(FilterKind::kBasis, basis, 0.01, 1);
  EXPECT_THROW(RasteriseSheet(sheet, 0, {10, {}}), InputError);
  EXPECT_THROW(RasteriseSheet(sheet, 0, {15000, {}}), InputError);  // 2.4e8 are too many
}

}  // namespace
}  // namespace luxfield::capture
