// *.lf.exr and *.meas.exr: what is written comes back bit by bit.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/lightfield/file_pieces.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "support.h"

namespace luxfield::lightfield {
namespace {

void ExpectSameBits(std::span<const float> a, std::span<const float> b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    ASSERT_EQ(std::bit_cast<std::uint32_t>(a[k]), std::bit_cast<std::uint32_t>(b[k])) << k;
}

Measurements RandomMeasurements(const LuminaireGeometry& geometry, std::uint64_t seed) {
  Measurements measurements;
  measurements.geometry = geometry;
  measurements.filter_scale = 16.0 / 9;
  measurements.provenance = {{"session", "abc"}};
  core::Random random(seed, 0);
  for (int m = 0; m < geometry.grid.count(); ++m) {
    Measurement position;
    for (std::size_t k = 0; k < geometry.plane_size(); ++k) {
      position.count.push_back(random.UniformFloat() * 5);
      position.mask.push_back(random() % 16);
    }
    for (std::size_t k = 0; k < geometry.plane_size() * geometry.channels; ++k) {
      const bool unknown = position.mask[k % geometry.plane_size()] & kUnknownMask;
      position.irradiance.push_back(unknown ? 0 : static_cast<float>(random.Normal()));
      position.sigma.push_back(random.UniformFloat());
    }
    measurements.positions.push_back(position);
  }
  return measurements;
}

TEST(LightFieldFile, RoundTripIsBitExactForEveryBasisAndChannelCount) {
  for (const Basis& basis :
       {Basis::Make(BasisKind::kBox), Basis::Make(BasisKind::kBilinear),
        Basis::Make(BasisKind::kQuadratic, -0.25), Basis::Make(BasisKind::kBspline2)})
    for (const int channels : {1, 3}) {
      LightField field = RandomField(SmallGeometry(basis, channels), 31, -1, 1);
      field.data[0] = -0.0f;
      field.data[1] = 1e-42f;  // denormal
      field.data[2] = 3.4e38f;
      field.provenance = {{"input.sha256", "00ff"}, {"verb", "reconstruct --non-negative"}};
      const auto path = UniquePath(".lf.exr");
      WriteLightField(path, field);
      const LightField back = ReadLightField(path);
      EXPECT_EQ(back.geometry, field.geometry);
      EXPECT_EQ(back.provenance, field.provenance);
      ExpectSameBits(back.data, field.data);
    }
}

// No reader would take it: nothing is written.
TEST(LightFieldFile, ValuesThatAreNotFiniteAreNotWritten) {
  LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2), 3), 32);
  for (const float bad : {std::numeric_limits<float>::infinity(), std::nanf("")}) {
    field.data.back() = bad;
    const auto path = UniquePath(".lf.exr");
    EXPECT_THAT([&] { WriteLightField(path, field); },
                testing::ThrowsMessage<InputError>(
                    testing::AllOf(testing::HasSubstr(path.string()), testing::HasSubstr("C = "))));
    EXPECT_FALSE(std::filesystem::exists(path));
  }
}

TEST(LightFieldFile, EqualInputsGiveEqualBytes) {
  const LightField field = RandomField(SmallGeometry(Basis::Make(BasisKind::kBspline2), 3), 32);
  const auto a = UniquePath(".lf.exr"), b = UniquePath(".lf.exr");
  WriteLightField(a, field);
  WriteLightField(b, field);
  EXPECT_EQ(core::ReadFile(a), core::ReadFile(b));
}

TEST(LightFieldFile, OneImageOfOneTexelIsLegal) {
  LuminaireGeometry g = SmallGeometry(Basis::Make(BasisKind::kBox));
  g.grid.width = g.grid.height = g.lattice.width = g.lattice.height = 1;
  const LightField field = RandomField(g, 33);
  const auto path = UniquePath(".lf.exr");
  WriteLightField(path, field);
  EXPECT_EQ(ReadLightField(path).data, field.data);
}

TEST(MeasurementsFile, RoundTripIsBitExact) {
  for (const int channels : {1, 3}) {
    Measurements out =
        RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kQuadratic), channels), 34);
    out.filter = FilterKind::kDual;
    out.positions[1].displacement_m = {1e-5, -2.5e-6};
    const auto path = UniquePath(".meas.exr");
    WriteMeasurements(path, out);
    const Measurements back = ReadMeasurements(path);
    EXPECT_EQ(back.geometry, out.geometry);
    EXPECT_EQ(back.provenance, out.provenance);
    EXPECT_EQ(back.filter, out.filter);
    EXPECT_EQ(back.filter_scale, out.filter_scale);
    ASSERT_EQ(back.positions.size(), out.positions.size());
    for (std::size_t m = 0; m < out.positions.size(); ++m) {
      ExpectSameBits(back.positions[m].irradiance, out.positions[m].irradiance);
      ExpectSameBits(back.positions[m].sigma, out.positions[m].sigma);
      ExpectSameBits(back.positions[m].count, out.positions[m].count);
      EXPECT_EQ(back.positions[m].mask, out.positions[m].mask);
      EXPECT_EQ(back.positions[m].displacement_m.x, out.positions[m].displacement_m.x);
      EXPECT_EQ(back.positions[m].displacement_m.y, out.positions[m].displacement_m.y);
    }
  }
}

// Files of some positions, one after the other, have the parts of the whole.
TEST(MeasurementsFile, PositionsOnTheirOwnAreThePartsOfTheWhole) {
  const Measurements out = RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kBspline2)), 35);
  const auto whole = UniquePath(".meas.exr");
  WriteMeasurements(whole, out);
  core::ExrReader reader(whole);
  const int count = out.geometry.grid.count();
  int at = 0;
  for (const auto& [first, last] : {std::pair{0, 5}, std::pair{5, 6}, std::pair{6, count}}) {
    const auto path = UniquePath(".meas.exr");
    WriteMeasurementPositions(path, out, first, last, [&](int m) { return out.positions[m]; });
    core::ExrReader piece(path);
    ASSERT_EQ(piece.parts().size(), static_cast<std::size_t>(last - first));
    for (std::size_t k = 0; k < piece.parts().size(); ++k, ++at) {
      EXPECT_EQ(piece.parts()[k].name, reader.parts()[at].name);
      for (const std::string& channel : reader.parts()[at].channels)
        if (channel != "mask")
          ExpectSameBits(piece.ReadFloat(static_cast<int>(k), channel),
                         reader.ReadFloat(at, channel));
    }
  }
  EXPECT_EQ(at, count);
}

// What a viewer sees: a number only where light was detected.
// Bytes that this process asked the system for, of files.
std::uint64_t BytesRead() {
  std::ifstream stream("/proc/self/io");
  std::string name;
  std::uint64_t bytes = 0;
  stream >> name >> bytes;
  return name == "rchar:" ? bytes : 0;
}

// The headers are read for each band, twice; pixels once, packed or not.
TEST(MeasurementsFile, BandsOfRowsAreReadOnce) {
  if (BytesRead() == 0) GTEST_SKIP() << "the system does not count what is read";
  LuminaireGeometry geometry = SmallGeometry(Basis::Make(BasisKind::kBox), 1);
  geometry.lattice.width = 512;
  geometry.lattice.height = 96;
  constexpr int kBand = 32;
  for (const auto compression : {core::ExrCompression::kNone, core::ExrCompression::kZip}) {
    const auto path = UniquePath(".meas.exr");
    Measurements header;
    header.geometry = geometry;
    header.positions.resize(geometry.grid.count());
    const auto zeros = [&](int) {
      const std::vector<float> plane(geometry.plane_size());
      return Measurement{plane, plane, plane, std::vector<std::uint32_t>(plane.size()), {}};
    };
    WriteMeasurementPositions(path, header, 0, geometry.grid.count(), zeros, compression);
    const std::uint64_t begin = BytesRead();
    ReadMeasurementGeometry(path);
    const std::uint64_t headers = BytesRead() - begin;
    for (int first = 0; first < geometry.lattice.height; first += kBand)
      ReadMeasurementRows(path, first, kBand);
    const std::uint64_t bands = geometry.lattice.height / kBand,
                        read = BytesRead() - begin - headers;
    EXPECT_LT(read, std::filesystem::file_size(path) + 5 * bands * headers / 2);
  }
}

TEST(MeasurementsFile, HoldsNoNumberForWhatIsUnknownOrNotDetected) {
  Measurements out = RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kBspline2), 3), 37);
  Measurement& position = out.positions[0];
  const std::size_t plane = out.geometry.plane_size();
  // Texel 0 is bright in R, one photon in G, negative noise in B; texel 1 unknown; texel 2 a signed
  // value of a pair of prints.
  position.mask[0] = kTooDark;
  position.mask[1] = kSaturated;
  position.mask[2] = 0;
  const auto set = [&](std::size_t k, float value) {
    position.irradiance[k] = value;
    position.sigma[k] = 0.5f;
  };
  for (const auto& [channel, value] : {std::pair(0, 7.0f), {1, 0.25f}, {2, -0.75f}}) {
    set(channel * plane, value);
    set(channel * plane + 1, 0);
    set(channel * plane + 2, -3);
  }
  const auto path = UniquePath(".meas.exr");
  WriteMeasurements(path, out);
  core::ExrReader reader(path);
  const auto read = [&](const char* channel) { return reader.ReadFloat(0, channel); };
  EXPECT_EQ(read("E.R")[0], 7);
  EXPECT_TRUE(std::isnan(read("E.G")[0]));
  EXPECT_TRUE(std::isnan(read("E.B")[0]));
  EXPECT_EQ(read("undetected.R")[0], 0);
  EXPECT_EQ(read("undetected.G")[0], 0.25f);
  EXPECT_EQ(read("undetected.B")[0], -0.75f);
  for (const char* channel : {"E.R", "E.G", "E.B"}) {
    EXPECT_TRUE(std::isnan(read(channel)[1]));
    EXPECT_EQ(read(channel)[2], -3);
  }
}

TEST(MeasurementsFile, RefusesNoNumberWithoutAReason) {
  Measurements out = RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kBspline2), 1), 38);
  out.positions[0].mask[3] = 0;
  out.positions[0].irradiance[3] = std::numeric_limits<float>::quiet_NaN();
  const auto path = UniquePath(".meas.exr");
  WriteMeasurements(path, out);
  EXPECT_THROW(ReadMeasurements(path), InputError);
}

// Values are looked at in blocks of 256 and one by one at the end.
TEST(MeasurementsFile, RefusesABadSigmaWhereverItStands) {
  LuminaireGeometry geometry = SmallGeometry(Basis::Make(BasisKind::kBspline2), 1);
  geometry.lattice.width = 20;
  geometry.lattice.height = 15;
  const Measurements good = RandomMeasurements(geometry, 39);
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const auto path = UniquePath(".meas.exr");
  for (const std::size_t k : {0, 255, 256, 299})
    for (const float value : {-1e-40f, -1.0f, kInf, std::nanf(""), -0.0f, 0.0f}) {
      Measurements out = good;
      out.positions[1].mask[k] = 0;
      out.positions[1].sigma[k] = value;
      WriteMeasurements(path, out);
      if (value == 0)
        EXPECT_NO_THROW(ReadMeasurements(path)) << k;
      else
        EXPECT_THAT([&] { ReadMeasurements(path); },
                    testing::ThrowsMessage<InputError>(
                        testing::HasSubstr(fmt::format("at row {}, column {}", k / 20, k % 20))));
    }
}

TEST(MeasurementsFile, RefusesADisplacementOfMoreThanASpacing) {
  Measurements out = RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kBspline2), 1), 36);
  out.positions[2].displacement_m = {1.01 * out.geometry.grid.spacing_m, 0};
  const auto path = UniquePath(".meas.exr");
  WriteMeasurements(path, out);
  EXPECT_THROW(ReadMeasurements(path), InputError);
}

TEST(MeasurementsFile, EqualInputsGiveEqualBytes) {
  const Measurements out =
      RandomMeasurements(SmallGeometry(Basis::Make(BasisKind::kBspline2), 3), 35);
  const auto a = UniquePath(".meas.exr"), b = UniquePath(".meas.exr");
  WriteMeasurements(a, out);
  WriteMeasurements(b, out);
  EXPECT_EQ(core::ReadFile(a), core::ReadFile(b));
}

}  // namespace
}  // namespace luxfield::lightfield
