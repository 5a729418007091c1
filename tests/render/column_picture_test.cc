// Pictures lit in groups of columns against those of whole light fields, and against the closed form
// in double precision.
#include "luxfield/render/column_picture.h"

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/lightfield/posed_light_field.h"
#include "tests/render/renderer_fixture.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kPlenty = std::uint64_t{1} << 30, kMib = 1 << 20;

// 5 x 3 images, so large that groups of one to four columns can be asked for by memory.
LightField WideLamp(int channels = 1, int side = 256) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.05;
  geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 5, 3, 0.02);
  geometry.grid.u0_m += 0.007;  // off the axis
  const double texel_m = 0.16 / side;
  geometry.lattice = {side, side, -0.08, 0.09, texel_m, texel_m};
  geometry.channels = channels;
  geometry.unit = lightfield::FluxUnit::kLumen;
  LightField field(geometry);
  core::Random random(TestSeed(91), 0);
  const double phase = 6 * random.Uniform();
  for (int m = 0; m < geometry.grid.count(); ++m)
    for (int c = 0; c < channels; ++c)
      for (int row = 0; row < side; ++row)
        for (int column = 0; column < side; ++column) {
          const auto s = geometry.lattice.centre(row, column);
          field.image(m, c)[static_cast<std::size_t>(row) * side + column] =
              static_cast<float>(1e6 * (1 + m) * (1.1 + 0.2 * c + std::sin(40 * s.x + phase + m)) *
                                 std::exp(-150 * (s.x * s.x + s.y * s.y)));
        }
  return field;
}

// What leaves room for so many columns of WideLamp beside what a picture of the floor takes.
std::uint64_t RoomFor(const LightField& field, double columns) {
  const auto& g = field.geometry;
  const double column = g.grid.height * static_cast<double>(LuminaireOnDevice::ImageBytes(g));
  constexpr std::uint64_t kBeside = 48 * kMib;  // for files and drivers, column_picture.cc
  return kBeside + 24 * 16 * 2 * 17 * sizeof(float) +
         static_cast<std::uint64_t>(column * (columns + 2.0 / g.grid.height));
}

// Light that the floor of `scene` gets at each pixel, by closed form in double precision.
core::Image ClosedForm(const scene::Scene& scene, const Frame& frame,
                       const std::vector<lightfield::PosedLightField>& fields) {
  core::Image irradiance(frame.width, frame.height, 3);
  for (const scene::Luminaire& luminaire : scene.luminaires)
    for (const auto& posed : fields) {
      scene::Pose field_pose;
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          field_pose.linear[row][column] = posed.luminaire_from_field.rotation[3 * row + column];
      field_pose.translation = posed.luminaire_from_field.translation_m;
      const scene::Pose to = (luminaire.world_from_luminaire * field_pose).Inverse();
      for (std::size_t k = 0; k < frame.coverage.data.size(); ++k) {
        if (frame.coverage.data[k] == 0) continue;
        const auto at = [&](const core::Image& image) {
          return Vec3{image.plane(0)[k], image.plane(1)[k], image.plane(2)[k]};
        };
        const auto light = lightfield::ExactIrradiance(posed.field, to.Point(at(frame.position)),
                                                       to.Vector(at(frame.normal)));
        for (int c = 0; c < 3; ++c)
          irradiance.plane(c)[k] += static_cast<float>(luminaire.scale * light[c]);
      }
    }
  return irradiance;
}

double RelativeRmse(const core::Image& image, const core::Image& truth) {
  double squares = 0, sum = 0;
  for (std::size_t k = 0; k < image.data.size(); ++k) {
    squares += std::pow(double{image.data[k]} - double{truth.data[k]}, 2);
    sum += truth.data[k];
  }
  return std::sqrt(squares * static_cast<double>(image.data.size())) / sum;
}

double Worst(const core::Image& image, const core::Image& other) {
  double worst = 0, largest = 0;
  for (std::size_t k = 0; k < image.data.size(); ++k) {
    worst = std::max(worst, std::abs(double{image.data[k]} - double{other.data[k]}));
    largest = std::max(largest, std::abs(double{other.data[k]}));
  }
  return worst / largest;
}

Frame InColumns(const scene::Scene& scene, const RenderOptions& options, std::uint64_t bytes,
                int most_columns = 100) {
  return ColumnPicture(Device::Open(), scene, options, most_columns).Render(bytes);
}

// By `exact`, whatever the number of columns that fit: to rounding of sums in another order.
TEST(ColumnPicture, ExactIsTheClosedForm) {
  for (const int channels : {1, 3}) {
    const LightField field = WideLamp(channels);
    const auto file = WriteLamp("wide", field, false);
    const scene::Scene scene = Floor({Above(file, -0.4, 1), Above(file, 0.5, 0.25)});
    const RenderOptions options = Unshadowed("exact");
    const Frame whole = RenderWith(scene, options);
    const core::Image truth = ClosedForm(scene, whole, {{"", {}, field}});
    for (const double columns : {1.5, 2.5, 5.5}) {
      const Frame frame = InColumns(scene, options, RoomFor(field, columns));
      EXPECT_LT(RelativeRmse(frame.irradiance, truth), 2e-6) << columns;
      EXPECT_LT(Worst(frame.irradiance, whole.irradiance), 4e-6) << columns;
      EXPECT_LT(Worst(frame.radiance, whole.radiance), 4e-6) << columns;
      EXPECT_EQ(frame.position.data, whole.position.data);
      EXPECT_EQ(frame.coverage.data, whole.coverage.data);
      EXPECT_EQ(frame.unit, whole.unit);
      EXPECT_EQ(frame.provenance, whole.provenance);
      EXPECT_EQ(SumOf(frame.variance), 0);
      // As many pictures as groups and luminaires: what is asked of memory is what is taken.
      for (const KernelTime& kernel : frame.times.kernels) {
        if (kernel.name != "ExactIrradiance") continue;
        EXPECT_EQ(kernel.launches, 2 * std::ceil(5 / std::floor(columns))) << columns;
      }
    }
  }
}

// Each direction of a lamp of several fields, where several light one point.
TEST(ColumnPicture, LightsByEachFieldOfAFile) {
  lightfield::PosedLightField down{"-z", {}, WideLamp(1, 64)}, aside{"aside", {}, WideLamp(1, 64)};
  for (float& c : aside.field.data) c *= 0.5f;
  aside.luminaire_from_field.rotation = {std::cos(0.3),  0, std::sin(0.3), 0, 1, 0,
                                         -std::sin(0.3), 0, std::cos(0.3)};
  const auto file = Temporary("two.lf.exr");
  WriteLightFields(file, std::vector{down, aside});
  const scene::Scene scene = Floor({Above(file, 0.1, 2)});
  const Frame frame = InColumns(scene, Unshadowed("exact"), kPlenty, 2);
  EXPECT_LT(RelativeRmse(frame.irradiance, ClosedForm(scene, frame, {down, aside})), 2e-6);
}

// The error asked of the table, over the picture, and the table that whole light fields get.
TEST(ColumnPicture, VolumeHasTheErrorAskedFor) {
  const LightField field = WideLamp();
  const auto file = WriteLamp("wide_volume", field, false);
  const scene::Scene scene = Floor({Above(file, -0.4, 1), Above(file, 0.5, 0.25)});
  for (const double error : {2e-3, 2e-4}) {
    RenderOptions options = Unshadowed("volume");
    options.approximation_error = error;
    const Frame whole = RenderWith(scene, options);
    const core::Image truth = ClosedForm(scene, whole, {{"", {}, field}});
    for (const int columns : {1, 3, 5}) {
      const Frame frame = InColumns(scene, options, kPlenty, columns);
      const double measured = RelativeRmse(frame.irradiance, truth);
      std::printf("asked %.1e, measured %.2e by %d columns\n", error, measured, columns);
      EXPECT_LT(measured, 1.5 * error);
      EXPECT_LT(Worst(frame.irradiance, whole.irradiance), 4e-6);
      EXPECT_EQ(frame.provenance, whole.provenance);
    }
  }
}

// Walls beside the lamp whose horizons cut its opening, and a floor behind it: what the table leaves
// comes from each group once.
TEST(ColumnPicture, WhatAVolumeLeavesIsLitByEachGroup) {
  const LightField field = WideLamp(1, 96);
  const auto file = WriteLamp("wide_cut", field, false);
  scene::Scene scene =
      Floor({{"lamp", file, {}, scene::LookAt({0, 0, 0.03}, {1, 0, 0.01}, {0, 0, 1}), 1}});
  scene::AppendQuad({0, 0.04, -1}, {2, 0.02, 0}, {0, 0, 2}, 0, scene.geometry);
  scene.camera = scene::Camera::LookAt({1, -2, 1}, {0.6, 0.04, 0.1}, {0, 0, 1}, 50, 48, 32);
  const RenderOptions options = Unshadowed("volume");
  const Frame whole = RenderWith(scene, options);
  const core::Image truth = ClosedForm(scene, whole, {{"", {}, field}});
  const Frame frame = InColumns(scene, options, kPlenty, 2);
  EXPECT_LT(RelativeRmse(frame.irradiance, truth), 3e-3);
  EXPECT_LT(Worst(frame.irradiance, whole.irradiance), 4e-6);
  bool left = false;
  for (const KernelTime& kernel : frame.times.kernels)
    left |= kernel.name == "ExactCutIrradiance" || kernel.name == "VolumeCutIrradiance";
  EXPECT_TRUE(left);
}

// Visibility does not depend on the light, so that each group may have the maps of its own cells.
TEST(ColumnPicture, ShadowMapsOfGroupsAreThoseOfTheWhole) {
  const LightField field = WideLamp();
  const auto file = WriteLamp("wide_maps", field, false);
  scene::Scene scene = Floor({Above(file, 0, 1)});
  scene::AppendBox(scene::Translation({0.2, 0.1, 0.3}) * scene::Scaling({0.2, 0.2, 0.2}), 0,
                   scene.geometry);
  RenderOptions options = Unshadowed("exact");
  options.shadows = Shadows::kMaps;
  options.shadow_map_size = 64;
  const Frame whole = RenderWith(scene, options), lit = RenderWith(scene, Unshadowed("exact"));
  EXPECT_GT(Worst(whole.irradiance, lit.irradiance), 0.1);  // there are shadows
  const Frame frame = InColumns(scene, options, kPlenty, 2);
  EXPECT_LT(Worst(frame.irradiance, whole.irradiance), 4e-6);
}

// The sentence of what `make` throws; empty: it throws none.
template <typename Make>
std::string Refusal(const Make& make) {
  try {
    make();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

int MissingMib(const std::string& sentence) {
  const auto at = sentence.find("give it ");
  return at == std::string::npos ? 0 : std::stoi(sentence.substr(at + 8));
}

// What it asks for does, and a MiB less does not.
TEST(ColumnPicture, SaysWhatWouldDo) {
  const LightField field = WideLamp(1, 512);
  const auto file = WriteLamp("wide_tight", field, false);
  const scene::Scene scene = Floor({Above(file, 0, 1)});
  const RenderOptions options = Unshadowed("exact");
  EXPECT_NE(Refusal([&] { InColumns(scene, options, 1000); }).find("the picture alone"),
            std::string::npos);
  const std::uint64_t little = RoomFor(field, 0.5);
  const std::string column = Refusal([&] { InColumns(scene, options, little); });
  EXPECT_NE(column.find("one column of it, 3 images of 512 x 512 texels"), std::string::npos)
      << column;
  const int missing = MissingMib(column);
  ASSERT_GT(missing, 0) << column;
  EXPECT_EQ(Refusal([&] { InColumns(scene, options, little + missing * kMib); }), "");
  EXPECT_NE(Refusal([&] { InColumns(scene, options, little + (missing - 1) * kMib); }), "");
}

// A table that does not fit is not made coarser.
TEST(ColumnPicture, RefusesACoarserVolume) {
  const LightField field = WideLamp(1, 256);
  const auto file = WriteLamp("wide_coarse", field, false);
  const scene::Scene scene = Floor({Above(file, 0, 1)});
  RenderOptions options = Unshadowed("volume");
  options.approximation_error = 3e-5;
  const std::uint64_t little = 86 * kMib;
  const std::string refusal = Refusal([&] { InColumns(scene, options, little); });
  EXPECT_NE(refusal.find("for the error asked for"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("or use the estimator 'exact'"), std::string::npos) << refusal;
  std::uint64_t bytes = little;
  int refusals = 0;  // what is wanted next is known; what comes after it, only then
  for (std::string again = refusal; !again.empty() && refusals < 4; ++refusals) {
    ASSERT_GT(MissingMib(again), 0) << again;
    bytes += MissingMib(again) * kMib;
    again = Refusal([&] {
      const Frame frame = InColumns(scene, options, bytes);
      EXPECT_LT(RelativeRmse(frame.irradiance, ClosedForm(scene, frame, {{"", {}, field}})), 6e-5);
    });
  }
  std::printf("%d refusals, then done with %d MiB\n", refusals, static_cast<int>(bytes / kMib));
  EXPECT_LT(refusals, 4);
}

TEST(ColumnPicture, RefusesByNameWhatTakesWholeLightFields) {
  const LightField field = WideLamp(1, 32);
  const auto file = WriteLamp("wide_refused", field, false);
  const auto refusal = [&](const auto& change) {
    scene::Scene scene = Floor({Above(file, 0, 1)});
    RenderOptions options = Unshadowed("exact");
    change(scene, options);
    return Refusal([&] { InColumns(scene, options, kPlenty); });
  };
  const auto says = [&](const char* text, const auto& change) {
    const std::string sentence = refusal(change);
    EXPECT_NE(sentence.find(text), std::string::npos) << sentence;
  };
  EXPECT_EQ(refusal([](auto&, auto&) {}), "");
  for (const EstimatorTraits& traits : EstimatorList())
    if (traits.name != "exact" && traits.name != "volume")
      says((traits.name + " with shadows 'none' takes").c_str(),
           [&](auto&, RenderOptions& o) { o.estimator = traits.name; });
  for (const Shadows shadows : {Shadows::kTraced, Shadows::kThesisMaps, Shadows::kSoftMaps})
    says(fmt::format("exact with shadows '{}' takes", ShadowsName(shadows)).c_str(),
         [&](auto&, RenderOptions& o) { o.shadows = shadows; });
  says("volume with shadows 'maps' takes", [](auto&, RenderOptions& o) {
    o.estimator = "volume";
    o.shadows = Shadows::kMaps;
  });
  says("--knob strategies-for",
       [](auto&, RenderOptions& o) { o.knobs.strategies.everywhere = true; });
  says("--light-groups", [](auto&, RenderOptions& o) { o.light_groups = true; });
  says("has area lights", [](scene::Scene& s, auto&) { s.area_lights.emplace_back(); });
  says("has an environment", [](scene::Scene& s, auto&) { s.environment.emplace(); });
  says("has lights of photometric files",
       [](scene::Scene& s, auto&) { s.classical_lights.emplace_back(); });
  says("has surfaces that shine", [](scene::Scene& s, auto&) {
    s.geometry.materials[0].emission = {1, 1, 1};
  });
  says("holds no light field", [](scene::Scene& s, auto&) { s.luminaires.clear(); });
}

}  // namespace
}  // namespace luxfield::render
