// Several light fields with frames of their own: their sums, and the file that holds them.
#include "luxfield/lightfield/posed_light_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "support.h"

namespace luxfield::lightfield {
namespace {

using testing::HasSubstr;

// Axes permuted and shifted: field z along luminaire -x.
const RigidPose kTowardsMinusX{{0, 0, -1, 0, 1, 0, 1, 0, 0}, {0.3, -0.2, 0.05}};

std::vector<PosedLightField> TwoFields(int channels = 1) {
  LuminaireGeometry other = SmallGeometry(Basis::Make(BasisKind::kBilinear), channels);
  other.lattice.width = 12;
  other.lattice.s0_m = -0.05;
  other.grid.width = 2;
  std::vector<PosedLightField> fields{
      {"+z", {}, RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2), channels), 51)},
      {"-x", kTowardsMinusX, RandomField(other, 52, -1, 1)}};
  fields[1].field.provenance = {{"rays_sha256", "ab"}};
  return fields;
}

TEST(RigidPose, MapsPointsAndBack) {
  const Vec3 p{0.7, 0.11, -0.4};
  const Vec3 q = kTowardsMinusX.Point(p);  // by hand: (-z + 0.3, y - 0.2, x + 0.05)
  EXPECT_DOUBLE_EQ(q.x, 0.7);
  EXPECT_DOUBLE_EQ(q.y, 0.11 - 0.2);
  EXPECT_DOUBLE_EQ(q.z, 0.75);
  const Vec3 back = kTowardsMinusX.Inverse().Point(q);
  EXPECT_NEAR(Length(back - p), 0, 1e-15);
  const Vec3 d = kTowardsMinusX.InverseDirection({-1, 0, 0});
  EXPECT_EQ(d.z, 1);
  const Vec3 composed = (kTowardsMinusX * kTowardsMinusX).Point(p);
  EXPECT_NEAR(Length(composed - kTowardsMinusX.Point(q)), 0, 1e-15);
}

TEST(RigidPose, RefusesWhatIsNoRotation) {
  RigidPose{}.Validate("x");
  kTowardsMinusX.Validate("x");
  for (const auto& rotation : {std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, -1},       // a mirror
                               std::array<double, 9>{1, 0, 0, 0, 1.00001, 0, 0, 0, 1},  // a stretch
                               std::array<double, 9>{1, 1e-5, 0, 0, 1, 0, 0, 0, 1},     // a shear
                               std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, NAN}})
    EXPECT_THROW((RigidPose{rotation, {}}.Validate("x")), InputError);
  EXPECT_THROW((RigidPose{RigidPose{}.rotation, {0, 2e6, 0}}.Validate("x")), InputError);
  EXPECT_THROW((RigidPose{RigidPose{}.rotation, {0, NAN, 0}}.Validate("x")), InputError);
}

TEST(PosedLightFields, AddUp) {
  const auto fields = TwoFields(3);
  const auto flux = TotalFlux(fields);
  for (int channel = 0; channel < 3; ++channel)
    EXPECT_DOUBLE_EQ(flux[channel],
                     TotalFlux(fields[0].field)[channel] + TotalFlux(fields[1].field)[channel]);
  // To the second field luminaire (x, y, z) is (z, y, -x); the first direction goes backwards in
  // the first field, the other forwards in both.
  const auto side = FarFieldIntensity(fields, {-1, 0.1, -0.2});
  const auto front = FarFieldIntensity(fields, {-0.5, 0.1, 0.4});
  for (int channel = 0; channel < 3; ++channel) {
    const double behind = FarFieldIntensity(fields[1].field, {-0.2, 0.1, 1})[channel],
                 first = FarFieldIntensity(fields[0].field, {-0.5, 0.1, 0.4})[channel],
                 second = FarFieldIntensity(fields[1].field, {0.4, 0.1, 0.5})[channel];
    EXPECT_NE(behind, 0);
    EXPECT_NE(first, 0);
    EXPECT_NE(second, 0);
    EXPECT_DOUBLE_EQ(side[channel], behind);
    EXPECT_DOUBLE_EQ(front[channel], first + second);
  }
}

TEST(PosedLightFields, ComeBackBitByBit) {
  for (const int channels : {1, 3}) {
    const auto fields = TwoFields(channels);
    const auto path = UniquePath(".lf.exr"), again = UniquePath(".lf.exr");
    WriteLightFields(path, fields);
    WriteLightFields(again, fields);
    EXPECT_EQ(core::ReadFile(path), core::ReadFile(again));
    const auto back = ReadLightFields(path);
    ASSERT_EQ(back.size(), 2u);
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(back[k].name, fields[k].name);
      EXPECT_EQ(back[k].luminaire_from_field, fields[k].luminaire_from_field);
      EXPECT_EQ(back[k].field.geometry, fields[k].field.geometry);
      EXPECT_EQ(back[k].field.provenance, fields[k].field.provenance);
      EXPECT_EQ(back[k].field.data, fields[k].field.data);
    }
  }
}

TEST(PosedLightFields, OneFieldInItsOwnFrameIsThePlainFile) {
  const auto fields = TwoFields();
  const auto plain = UniquePath(".lf.exr"), posed = UniquePath(".lf.exr");
  WriteLightField(plain, fields[0].field);
  WriteLightFields(posed, std::span(fields).first(1));
  EXPECT_EQ(core::ReadFile(plain), core::ReadFile(posed));
  const auto back = ReadLightFields(plain);
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back[0].luminaire_from_field, RigidPose{});
  EXPECT_EQ(back[0].field.data, fields[0].field.data);
  // One that is turned is not.
  WriteLightFields(posed, std::span(fields).last(1));
  EXPECT_EQ(ReadLightFields(posed).at(0).luminaire_from_field, kTowardsMinusX);
  EXPECT_THROW(ReadLightField(posed), InputError);
}

std::string ErrorOf(const std::function<void()>& run) {
  try {
    run();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(PosedLightFields, AreNotTakenForOne) {
  const auto path = UniquePath(".lf.exr");
  WriteLightFields(path, TwoFields());
  EXPECT_THAT(ErrorOf([&] { ReadLightField(path); }),
              testing::AllOf(HasSubstr(path.string()), HasSubstr("several directions"),
                             HasSubstr("--faces one")));
}

TEST(PosedLightFields, MustMakeOneLuminaire) {
  auto fields = TwoFields();
  fields[1].name = "+z";
  EXPECT_THAT(ErrorOf([&] { WriteLightFields(UniquePath(".lf.exr"), fields); }), HasSubstr("'+z'"));
  fields = TwoFields();
  fields[1].field.geometry.unit = FluxUnit::kWatt;
  EXPECT_THAT(ErrorOf([&] { WriteLightFields(UniquePath(".lf.exr"), fields); }),
              HasSubstr("in lm and in W"));
  fields = TwoFields();
  fields[1].luminaire_from_field.rotation[0] = 0.5;
  EXPECT_THAT(ErrorOf([&] { WriteLightFields(UniquePath(".lf.exr"), fields); }),
              HasSubstr("rotation"));
  EXPECT_THROW(WriteLightFields(UniquePath(".lf.exr"), {}), InputError);
}

// A file of two fields, spoiled in one place.
std::string Spoiled(const std::function<void(std::vector<core::ExrPartView>&)>& spoil) {
  const auto path = UniquePath(".lf.exr");
  WriteLightFields(path, TwoFields());
  core::ExrReader reader(path);
  std::vector<std::vector<float>> pixels;
  std::vector<core::ExrPartView> parts;
  for (std::size_t k = 0; k < reader.parts().size(); ++k)
    pixels.push_back(reader.ReadFloat(static_cast<int>(k), "Y"));
  for (std::size_t k = 0; k < reader.parts().size(); ++k) {
    const auto& part = reader.parts()[k];
    core::ExrAttributes ours;  // the others are the library's
    for (const auto& [name, value] : part.attributes)
      if (name.starts_with("luxfield:")) ours[name] = value;
    parts.push_back({part.name,
                     part.width,
                     part.height,
                     {{"Y", std::span<const float>(pixels[k])}},
                     std::move(ours)});
  }
  spoil(parts);
  const auto spoiled = UniquePath(".lf.exr");
  core::WriteExr(spoiled, parts);
  const std::string error = ErrorOf([&] { ReadLightFields(spoiled); });
  EXPECT_TRUE(error == "no error" || error.find(spoiled.string()) != std::string::npos) << error;
  return error;
}

TEST(PosedLightFields, RefuseDamagedFiles) {
  using Parts = std::vector<core::ExrPartView>;
  constexpr std::size_t kSecond = 4 * 3;  // the first part of field 1
  EXPECT_EQ(Spoiled([](Parts&) {}), "no error");
  EXPECT_THAT(Spoiled([](Parts& p) { p[0].attributes["luxfield:fields"] = 3; }),
              HasSubstr("'2.C.00.00'"));
  EXPECT_THAT(Spoiled([](Parts& p) { p[0].attributes["luxfield:fields"] = 1; }),
              HasSubstr("has 18 parts where its 1 light fields have 12"));
  EXPECT_THAT(Spoiled([](Parts& p) { p[0].attributes["luxfield:fields"] = 0; }),
              HasSubstr("luxfield:fields = 0"));
  EXPECT_THAT(Spoiled([](Parts& p) { p[0].attributes.erase("luxfield:fields"); }),
              HasSubstr("luxfield:fields"));
  EXPECT_THAT(Spoiled([](Parts& p) { p[0].attributes["luxfield:kind"] = std::string("measured"); }),
              HasSubstr("'measured'"));
  EXPECT_THAT(
      Spoiled([](Parts& p) { p[kSecond].attributes["luxfield:field_name"] = std::string("+z"); }),
      HasSubstr("'+z'"));
  EXPECT_THAT(
      Spoiled([](Parts& p) { p[kSecond].attributes.erase("luxfield:luminaire_from_field.23"); }),
      HasSubstr("luminaire_from_field.23"));
  EXPECT_THAT(
      Spoiled([](Parts& p) { p[kSecond].attributes["luxfield:luminaire_from_field.02"] = 0.5; }),
      HasSubstr("rotation"));
  EXPECT_THAT(Spoiled([](Parts& p) { p[kSecond].attributes["luxfield:unit"] = std::string("W"); }),
              HasSubstr("in lm and in W"));
  EXPECT_THAT(Spoiled([](Parts& p) { p.erase(p.begin() + kSecond + 1); }),
              HasSubstr("'1.C.00.01'"));
  EXPECT_THAT(Spoiled([](Parts& p) { p.back().name = "2.C.00.00"; }), HasSubstr("'1.C.02.01'"));
}

}  // namespace
}  // namespace luxfield::lightfield
