// Ray files of Zemax, LightTools and Speos: twins of other makers, round trips, refusals.
#include "luxfield/formats/ray_formats.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "tests/lightfield/support.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr std::pair<RayFormat, const char*> kFormats[] = {{RayFormat::kTm25, ".tm25ray"},
                                                          {RayFormat::kZemax, ".dat"},
                                                          {RayFormat::kLightTools, ".ltrf"},
                                                          {RayFormat::kLightToolsText, ".txt"},
                                                          {RayFormat::kSpeos, ".ray"}};

RayFile ThreeRays() {
  RayFile file;
  file.flux_is_luminous = true;
  file.header.luminous_flux_lm = 6;
  file.header.texts = {"three rays"};
  file.rays = {{{0.001, -0.002, 0.003}, {0, 0, 1}, 2, {}},
               {{0, 0.5, -0.25}, {0.6, 0, -0.8}, 3, {}},
               {{-0.125, 0, 0}, {0, -1, 0}, 1, {}}};
  return file;
}

fs::path Write(RayFormat format, const char* ending, const RayFile& file) {
  const fs::path path = lightfield::UniquePath(ending);
  RayFileHeader header = file.header;
  header.ray_count = file.rays.size();
  std::size_t at = 0;
  WriteRays(path, format, header, file.flux_is_luminous, false, [&](Ray& ray) {
    if (at == file.rays.size()) return false;
    ray = file.rays[at++];
    return true;
  });
  return path;
}

// float32 holds seven digits.
void ExpectSameRays(const RayFile& a, const RayFile& b, double flux_factor = 1) {
  ASSERT_EQ(a.rays.size(), b.rays.size());
  for (std::size_t k = 0; k < a.rays.size(); ++k) {
    EXPECT_LT(lightfield::Length(a.rays[k].position_m - b.rays[k].position_m), 1e-7) << k;
    EXPECT_LT(lightfield::Length(a.rays[k].direction - b.rays[k].direction), 1e-6) << k;
    EXPECT_NEAR(flux_factor * a.rays[k].flux, b.rays[k].flux, 1e-6 * b.rays[k].flux) << k;
  }
}

TEST(RayFormats, EveryFormatReadsBackTheSame) {
  for (const auto& [format, ending] : kFormats) {
    const fs::path path = Write(format, ending, ThreeRays());
    EXPECT_EQ(RayFormatOf(path), format) << ending;
    const RayFile read = ReadRays(path);
    ExpectSameRays(ThreeRays(), read);
    EXPECT_TRUE(read.flux_is_luminous);
    RayFile streamed;
    const RayFile rest = StreamRays(path, [&](const Ray& ray) { streamed.rays.push_back(ray); });
    ExpectSameRays(read, streamed);
    EXPECT_TRUE(rest.rays.empty());
    EXPECT_TRUE(rest.flux_is_luminous);
    EXPECT_EQ(rest.header.luminous_flux_lm, read.header.luminous_flux_lm);
    EXPECT_NEAR(read.header.luminous_flux_lm.value_or(0), 6, 1e-6);
    const RaySummary summary = SummariseRays(path);
    EXPECT_EQ(summary.header.ray_count, 3u);
    EXPECT_EQ(summary.format, format);
    fs::remove(path);
  }
}

TEST(RayFormats, WattsStayWatts) {
  RayFile file = ThreeRays();
  file.flux_is_luminous = false;
  file.header.radiant_flux_w = 6;
  file.header.luminous_flux_lm.reset();
  for (const auto& [format, ending] : kFormats) {
    if (format == RayFormat::kSpeos) continue;  // states both
    const fs::path path = Write(format, ending, file);
    const RayFile read = ReadRays(path);
    EXPECT_FALSE(read.flux_is_luminous);
    EXPECT_NEAR(read.header.radiant_flux_w.value_or(0), 6, 1e-6);
    fs::remove(path);
  }
}

TEST(RayFormats, DamagedFilesAreRefusedByName) {
  for (const auto& [format, ending] : kFormats) {
    const fs::path path = Write(format, ending, ThreeRays());
    const std::string whole = core::ReadFile(path);
    // Every cut is told from a whole file, unless it cuts whole rays off a Speos file, which has no
    // count and no end.
    for (std::size_t cut = 1; cut < 60; ++cut) {
      if (format == RayFormat::kSpeos && cut % 32 == 0) continue;
      if (format == RayFormat::kLightToolsText && cut <= 2) continue;  // the last line's end
      std::ofstream(path, std::ios::binary) << whole.substr(0, whole.size() - cut);
      EXPECT_THROW(ReadRays(path), InputError) << ending << " " << cut;
    }
    fs::remove(path);
  }
  const fs::path path = lightfield::UniquePath(".ray");
  std::ofstream(path) << "rays of something else";
  try {
    ReadRays(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("export TM-25; ASAP's and LucidShape's own layouts"));
  }
  fs::remove(path);
}

TEST(RayFormats, BadRaysAreRefusedByNumber) {
  const fs::path path = Write(RayFormat::kZemax, ".dat", ThreeRays());
  std::string bytes = core::ReadFile(path);
  const float two = 2;
  std::memcpy(bytes.data() + 208 + 28 + 12, &two, 4);  // l of the second ray
  std::ofstream(path, std::ios::binary) << bytes;
  try {
    ReadRays(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("ray 1: direction 2 0 -0.8 is not of unit length"));
  }
  fs::remove(path);
}

// Positions are the origin's and the ray's together: neither may be infinite.
TEST(RayFormats, OriginsAreFinite) {
  const fs::path path = Write(RayFormat::kLightToolsText, ".txt", ThreeRays());
  std::string text = core::ReadFile(path);
  const auto at = text.find("lt_data_origin: 0 0 0");
  ASSERT_NE(at, std::string::npos);
  for (const char* origin : {"inf 0 0", "0 nan 0", "0 0 1e99"}) {
    std::string spoilt = text;
    std::ofstream(path, std::ios::binary) << spoilt.replace(at + 16, 5, origin);
    try {
      ReadRays(path);
      FAIL() << origin;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("line 8: lt_data_origin is not finite"));
    }
  }
  fs::remove(path);
}

// The same rays, written by LightTools (binary and text) and Zemax; files of other makers.
TEST(RayFormats, TwinsOfOtherMakersAgree) {
  const fs::path folder = testdata::Folder() / "rays_tm25";
  LUXFIELD_NEEDS_DATA(folder);
  const RayFile binary = ReadRays(folder / "RayFileConverter__ThreeRays_Wavelength.1.ray");
  const RayFile text = ReadRays(folder / "RayFileConverter__ThreeRays_Wavelength.1.txt");
  const RayFile zemax = ReadRays(folder / "RayFileConverter__ThreeRays_Wavelength_ZMX.ray");
  ExpectSameRays(binary, text);
  ExpectSameRays(binary, zemax);
  EXPECT_NEAR(*binary.header.radiant_flux_w, 0.003106601, 1e-9);
  ExpectSameRays(binary, ReadRays(folder / "RayFileConverter__ThreeRays_PowerOnly.1.ray"));
  // Text of LightTools beside TM-25 of the same ten thousand rays.
  const RayFile many = ReadRays(folder / "Cyl10k.1.ray");
  EXPECT_EQ(RayFormatOf(folder / "Cyl10k.1.ray"), RayFormat::kLightToolsText);
  const RayFile tm25 = ReadRays(folder / "Cyl10k.1.tm25ray");
  EXPECT_TRUE(many.flux_is_luminous);
  EXPECT_EQ(many.rays.size(), tm25.rays.size());
}

// Zemax and Speos of the same eleven rays, converted by Ansys's own script.
TEST(RayFormats, ZemaxAndSpeosTwinsAgree) {
  const fs::path folder = testdata::Folder() / "rays_zemax_speos";
  LUXFIELD_NEEDS_DATA(folder);
  const RayFile zemax = ReadRays(folder / "test_08_dat.DAT");
  const RayFile speos = ReadRays(folder / "test_08_dat_reference.ray");
  EXPECT_EQ(zemax.rays.size(), 11u);
  EXPECT_NEAR(*speos.header.luminous_flux_lm, 679.55, 0.01);  // 1 W of 550 nm
  // The flux of Speos's rays is its header's, shared by their relative energies.
  double sum = 0;
  for (const Ray& ray : speos.rays) sum += ray.flux;
  EXPECT_NEAR(sum, *speos.header.luminous_flux_lm, 1e-3);
  ExpectSameRays(zemax, speos, speos.rays[0].flux / zemax.rays[0].flux);
}

}  // namespace
}  // namespace luxfield::formats
