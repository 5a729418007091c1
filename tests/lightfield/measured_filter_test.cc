#include "luxfield/lightfield/measured_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"

namespace luxfield::lightfield {
namespace {

std::filesystem::path File(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / name;
}

MeasuredFilter Sample(FilterKind kind) {
  MeasuredFilter filter;
  filter.filter = kind;
  filter.basis =
      Basis::Make(kind == FilterKind::kDual ? BasisKind::kQuadratic : BasisKind::kBspline2);
  filter.spacing_m = 0.0165;
  filter.filter_scale = kind == FilterKind::kDual ? 1 : 16.0 / 9;
  filter.lattice = {7, 5, -0.02, 0.015, 0.04 / 7, 0.006};
  for (int print = 0; print < (kind == FilterKind::kDual ? 2 : 1); ++print) {
    MeasuredPrint& p = filter.prints.emplace_back();
    for (int k = 0; k < 35; ++k) {
      p.transmittance.push_back(static_cast<float>(0.02 * k - 0.01 + 0.1 * print));
      p.sigma.push_back(static_cast<float>(0.001 + 1e-5 * k));
    }
  }
  filter.shift_m = {3e-5, -2e-5};
  filter.rotation_rad = 3e-4;
  filter.shift_sigma_m = 1e-7;
  filter.position_sigma_m = 2e-7;
  filter.stretch_sigma = 4e-5;
  filter.level_sigma = 3e-4;
  filter.sum_sigma_ratio = 1.3;
  filter.blur_m = 7e-5;
  filter.rotation_sigma_rad = 2e-6;
  filter.provenance = {{"sheet", "abc"}};
  return filter;
}

void ExpectEqual(const MeasuredFilter& a, const MeasuredFilter& b) {
  EXPECT_EQ(a.filter, b.filter);
  EXPECT_EQ(a.basis, b.basis);
  EXPECT_EQ(a.spacing_m, b.spacing_m);
  EXPECT_EQ(a.filter_scale, b.filter_scale);
  EXPECT_EQ(a.lattice, b.lattice);
  EXPECT_EQ(a.shift_m.x, b.shift_m.x);
  EXPECT_EQ(a.shift_m.y, b.shift_m.y);
  EXPECT_EQ(a.rotation_rad, b.rotation_rad);
  EXPECT_EQ(a.shift_sigma_m, b.shift_sigma_m);
  EXPECT_EQ(a.position_sigma_m, b.position_sigma_m);
  EXPECT_EQ(a.stretch_sigma, b.stretch_sigma);
  EXPECT_EQ(a.level_sigma, b.level_sigma);
  EXPECT_EQ(a.sum_sigma_ratio, b.sum_sigma_ratio);
  EXPECT_EQ(a.blur_m, b.blur_m);
  EXPECT_EQ(a.rotation_sigma_rad, b.rotation_sigma_rad);
  EXPECT_EQ(a.provenance, b.provenance);
  ASSERT_EQ(a.prints.size(), b.prints.size());
  for (std::size_t k = 0; k < a.prints.size(); ++k) {
    EXPECT_EQ(a.prints[k].transmittance, b.prints[k].transmittance);
    EXPECT_EQ(a.prints[k].sigma, b.prints[k].sigma);
  }
}

TEST(MeasuredFilter, FileBringsBackEveryField) {
  for (const FilterKind kind : {FilterKind::kBasis, FilterKind::kDual}) {
    const auto file = File("round_trip.filter.exr");
    const MeasuredFilter filter = Sample(kind);
    WriteMeasuredFilter(file, filter);
    ExpectEqual(ReadMeasuredFilter(file), filter);
    const std::string bytes = core::ReadFile(file);
    WriteMeasuredFilter(file, filter);
    EXPECT_EQ(core::ReadFile(file), bytes);
  }
}

// Phi* of an ideal pair is the dual function itself, of an ideal print Phi.
TEST(MeasuredFilter, FactorsUndoTheScaleOfThePrints) {
  MeasuredFilter filter = Sample(FilterKind::kDual);
  const auto factors = filter.factors();
  ASSERT_EQ(factors.size(), 2u);
  EXPECT_NEAR(factors[0], 9, 1e-12);
  EXPECT_NEAR(factors[1], -0.919, 1e-3);
  filter = Sample(FilterKind::kBasis);
  EXPECT_DOUBLE_EQ(filter.factors().at(0), 9.0 / 16);
}

std::string RefusalOfFile(const std::filesystem::path& file) {
  try {
    ReadMeasuredFilter(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

template <typename Change>
std::string RefusalOf(Change change, FilterKind kind = FilterKind::kBasis) {
  MeasuredFilter filter = Sample(kind);
  change(filter);
  const auto file = File("refused.filter.exr");
  try {
    WriteMeasuredFilter(file, filter);
  } catch (const InputError& error) {
    return error.what();
  }
  return RefusalOfFile(file);
}

TEST(MeasuredFilter, RefusesWhatMakesNoSense) {
  using testing::HasSubstr;
  EXPECT_THAT(RefusalOf([](auto& f) { f.spacing_m = 0; }), HasSubstr("luxfield:spacing_m = 0"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.filter_scale = NAN; }), HasSubstr("filter_scale"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.lattice.ds_m = -1; }), HasSubstr("luxfield:dx_m = -1"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.rotation_sigma_rad = -1; }), HasSubstr("rotation_sigma"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.blur_m = -1; }), HasSubstr("luxfield:blur_m = -1"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.blur_m = 0.2 * f.spacing_m; }), HasSubstr("an eighth"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.prints[0].transmittance[3] = NAN; }),
              HasSubstr("channel 'T' holds nan at row 0, column 3"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.prints[0].sigma[8] = -1; }), HasSubstr("row 1, column 1"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.prints[0].transmittance[3] = 2.5f; }),
              HasSubstr("transmittance 2.5"));
  core::WriteExrImage(File("picture.filter.exr"), core::Image(2, 2, 1));
  EXPECT_THROW(ReadMeasuredFilter(File("picture.filter.exr")), InputError);
}

// The writer leaves nothing behind that a reader would refuse.
TEST(MeasuredFilter, EveryNumberIsJudgedBeforeItIsWritten) {
  struct Field {
    const char* name;
    double& (*of)(MeasuredFilter&);
    std::vector<double> refused;
  };
  constexpr double kInf = INFINITY;
  using F = MeasuredFilter;
  const std::vector<double> not_positive = {0, -1, NAN, kInf}, not_finite = {NAN, -kInf, kInf},
                            negative = {-1e-9, NAN, kInf};
  const Field fields[] = {
      {"spacing_m", [](F& f) -> double& { return f.spacing_m; }, not_positive},
      {"filter_scale", [](F& f) -> double& { return f.filter_scale; }, not_positive},
      {"dx_m", [](F& f) -> double& { return f.lattice.ds_m; }, not_positive},
      {"dy_m", [](F& f) -> double& { return f.lattice.dt_m; }, not_positive},
      {"sum_sigma_ratio", [](F& f) -> double& { return f.sum_sigma_ratio; }, not_positive},
      {"x0_m", [](F& f) -> double& { return f.lattice.s0_m; }, not_finite},
      {"y1_m", [](F& f) -> double& { return f.lattice.t1_m; }, not_finite},
      {"shift_x_m", [](F& f) -> double& { return f.shift_m.x; }, not_finite},
      {"shift_y_m", [](F& f) -> double& { return f.shift_m.y; }, not_finite},
      {"rotation_rad", [](F& f) -> double& { return f.rotation_rad; }, not_finite},
      {"shift_sigma_m", [](F& f) -> double& { return f.shift_sigma_m; }, negative},
      {"rotation_sigma_rad", [](F& f) -> double& { return f.rotation_sigma_rad; }, negative},
      {"position_sigma_m", [](F& f) -> double& { return f.position_sigma_m; }, negative},
      {"stretch_sigma", [](F& f) -> double& { return f.stretch_sigma; }, negative},
      {"level_sigma", [](F& f) -> double& { return f.level_sigma; }, negative},
      {"blur_m", [](F& f) -> double& { return f.blur_m; }, negative},
  };
  const auto file = File("never_written.filter.exr");
  for (const Field& field : fields)
    for (const double value : field.refused) {
      MeasuredFilter filter = Sample(FilterKind::kBasis);
      field.of(filter) = value;
      try {
        WriteMeasuredFilter(file, filter);
        ADD_FAILURE() << field.name << " = " << value << " was written";
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr(std::string("luxfield:") + field.name + " = "))
            << value;
      }
      EXPECT_FALSE(std::filesystem::exists(file)) << field.name << " = " << value;
    }
}

// A pair's file whose parts have these names and widths.
std::filesystem::path PairOfParts(const std::vector<std::pair<std::string, int>>& parts) {
  const auto file = File("parts.filter.exr");
  WriteMeasuredFilter(file, Sample(FilterKind::kDual));
  core::ExrAttributes attributes = core::ExrReader(file).parts()[0].attributes;
  std::erase_if(attributes, [](const auto& a) { return !a.first.starts_with("luxfield:"); });
  constexpr int kHeight = 5;
  const std::vector<float> pixels(100, 0.5f);
  std::vector<core::ExrPartView> views;
  for (const auto& [name, width] : parts) {
    const auto plane = std::span(pixels).first(static_cast<std::size_t>(width) * kHeight);
    views.push_back({name, width, kHeight, {{"T", plane}, {"sigma", plane}}, {}});
  }
  views.front().attributes = attributes;
  core::WriteExr(file, views);
  return file;
}

TEST(MeasuredFilter, RefusesPairsThatAreNone) {
  using testing::HasSubstr;
  EXPECT_THAT(
      RefusalOf([](auto& f) { f.basis = Basis::Make(BasisKind::kBspline2); }, FilterKind::kDual),
      HasSubstr("basis 'bspline2' has no dual filter"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.prints[1].transmittance[9] = NAN; }, FilterKind::kDual),
              HasSubstr("part 'T.minus'"));
  EXPECT_THAT(RefusalOf([](auto& f) { f.prints[1].transmittance[9] = -1.5f; }, FilterKind::kDual),
              HasSubstr("part 'T.minus' holds the transmittance -1.5"));
  EXPECT_EQ(RefusalOfFile(PairOfParts({{"T.plus", 7}, {"T.minus", 7}})), "");
  EXPECT_THAT(RefusalOfFile(PairOfParts({{"T.plus", 7}})), HasSubstr("has 1 parts, not 2"));
  EXPECT_THAT(RefusalOfFile(PairOfParts({{"T.plus", 7}, {"T", 7}})), HasSubstr("luxfield:"));
  EXPECT_THAT(RefusalOfFile(PairOfParts({{"T.plus", 7}, {"T.other", 7}})),
              HasSubstr("part 'T.minus' is missing"));
  EXPECT_THAT(RefusalOfFile(PairOfParts({{"T.plus", 7}, {"T.minus", 6}})),
              HasSubstr("part 'T.minus' differs in size"));
}

}  // namespace
}  // namespace luxfield::lightfield
