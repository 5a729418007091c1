// Every photometric format into every other: flux, intensities, orientation and the opening stay,
// whatever the lamp's symmetry; so do the files of others. Openings are rectangles, which all
// formats hold: of others EULUMDAT has no ellipses, and TM-33 no heights.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/tm33.h"
#include "tests/formats/lamps.h"
#include "tests/seed.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

struct Format {
  const char* name;
  std::function<std::string(const Photometry&)> write;
  std::function<Photometry(const std::string&)> read;
};

const std::vector<Format>& Formats() {
  static const std::vector<Format> formats = {
      {"LM-63-2002", [](const Photometry& p) { return FormatLm63(p, Lm63Version::k2002, "x"); },
       [](const std::string& text) { return ParseLm63(text, "x"); }},
      {"LM-63-2019", [](const Photometry& p) { return FormatLm63(p, Lm63Version::k2019, "x"); },
       [](const std::string& text) { return ParseLm63(text, "x"); }},
      {"EULUMDAT", [](const Photometry& p) { return FormatEulumdat(p, "x"); },
       [](const std::string& text) { return ParseEulumdat(text, "x"); }},
      {"TM-33-23", [](const Photometry& p) { return FormatTm33(p, "x"); },
       [](const std::string& text) { return ParseTm33(text, "x"); }},
      {"GLDF", [](const Photometry& p) { return FormatGldf(p, {}, "test", "x"); },
       [](const std::string& bytes) { return ParseGldf(bytes, "x"); }}};
  return formats;
}

// Seven digits of EULUMDAT and TM-33 and six of LM-63 are within 5e-6; two conversions add theirs.
constexpr double kDigits = 1.2e-5;

void ExpectSame(const Photometry& a, const Photometry& b) {
  ASSERT_EQ(a.planes_deg, b.planes_deg);
  ASSERT_EQ(a.angles_deg, b.angles_deg);
  for (std::size_t k = 0; k < a.intensity_cd.size(); ++k)
    ASSERT_NEAR(a.intensity_cd[k], b.intensity_cd[k], kDigits * std::abs(b.intensity_cd[k])) << k;
  EXPECT_NEAR(Flux(a), Flux(b), kDigits * Flux(b));
  EXPECT_EQ(Describe(FindSymmetry(a)), Describe(FindSymmetry(b)));
}

void ThroughAllPairs(const Photometry& lamp) {
  for (const Format& first : Formats())
    for (const Format& second : Formats()) {
      SCOPED_TRACE(std::string(first.name) + " to " + second.name);
      const Photometry once = first.read(first.write(lamp));
      const Photometry twice = second.read(second.write(once));
      ExpectSame(twice, lamp);
      EXPECT_EQ(Describe(twice.opening), Describe(lamp.opening));
    }
}

// Planes of a random lamp that lie from C0 to `last`, mirrored about `mirrors`.
Photometry Mirrored(unsigned seed, double first, double last, const std::vector<double>& mirrors) {
  Photometry p = RandomLamp(PhotometryType::kC, seed);
  Photometry part = p;
  part.planes_deg.clear();
  part.intensity_cd.clear();
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    if (p.planes_deg[k] >= first && p.planes_deg[k] <= last) {
      part.planes_deg.push_back(p.planes_deg[k]);
      for (std::size_t j = 0; j < p.angles_deg.size(); ++j) part.intensity_cd.push_back(p.at(k, j));
    }
  for (const double about : mirrors) MirrorPlanes(part, about, "x");
  ClosePlanes(part);
  return part;
}

TEST(PhotometricRoundTrip, EverySymmetryThroughEveryPairOfFormats) {
  const auto seed = static_cast<unsigned>(TestSeed(61));
  const std::pair<const char*, Photometry> lamps[] = {
      {"none", RandomLamp(PhotometryType::kC, seed)},
      {"about the vertical axis", Mirrored(seed, 0, 0, {})},
      {"to the plane C0-C180", Mirrored(seed, 0, 180, {0})},
      {"to the plane C90-C270", Mirrored(seed, 90, 270, {90})},
      {"to the planes C0-C180 and C90-C270", Mirrored(seed, 0, 90, {90, 0})}};
  for (const auto& [symmetry, lamp] : lamps) {
    SCOPED_TRACE(symmetry);
    EXPECT_EQ(Describe(FindSymmetry(lamp)), symmetry);
    Photometry flat = lamp;
    flat.opening.height_m = 0;
    ThroughAllPairs(flat);
  }
}

TEST(PhotometricRoundTrip, FilesOfOthersThroughEveryPairOfFormats) {
  const auto folder = testdata::Folder();
  LUXFIELD_NEEDS_DATA(folder / "ldt");
  int files = 0;
  for (const char* kind : {"ies", "ldt"})
    for (const auto& entry : std::filesystem::directory_iterator(folder / kind)) {
      if (entry.path().extension() == ".csv") continue;
      SCOPED_TRACE(entry.path().filename().string());
      Photometry lamp = ReadPhotometry(entry.path());
      lamp.opening = {Opening::Shape::kBox, 0.1, 0.2, 0};
      ThroughAllPairs(lamp);
      ++files;
    }
  EXPECT_GE(files, 49);
}

}  // namespace
}  // namespace luxfield::formats
