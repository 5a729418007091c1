// Photometric files of ours in readers of others (tests/foreign/judge_photometric.py): every plane
// and angle is where we mean it, every intensity the same. Their XML holds to its schemas.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "luxfield/core/json.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/l3d.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/formats/zip.h"
#include "tests/bridges/foreign.h"
#include "tests/formats/lamps.h"
#include "tests/seed.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

using bridges::ForeignProgram;
using bridges::OutputOf;
using bridges::Scratch;

bool HasModule(const char* module) {
  if (ForeignProgram("python").empty() ||
      !OutputOf(fmt::format("{} -c 'import {}' 2>&1", ForeignProgram("python"), module)).empty()) {
    std::printf("SKIPPED: Python's %s is not installed (./run foreign)\n", module);
    return false;
  }
  return true;
}

void Write(const Scratch& folder, const Photometry& p) {
  core::WriteFileAtomically(folder / "lamp.ies", FormatLm63(p, Lm63Version::k2002, "x"));
  core::WriteFileAtomically(folder / "lamp.ldt", FormatEulumdat(p, "x"));
  core::WriteFileAtomically(folder / "lamp.tm33.xml", FormatTm33(p, "x"));
  core::WriteFileAtomically(folder / "lamp.gldf", FormatGldf(p, {}, "test", "x"));
}

// Within the digits that the reader keeps, of the plane itself or of the one that closes the turn.
void ExpectSame(const core::Json& found, const Photometry& p) {
  const auto planes = found.at("planes").get<std::vector<double>>(),
             angles = found.at("angles").get<std::vector<double>>();
  ASSERT_GE(planes.size(), p.planes_deg.size());
  ASSERT_EQ(angles.size(), p.angles_deg.size());
  for (std::size_t j = 0; j < angles.size(); ++j) ASSERT_NEAR(angles[j], p.angles_deg[j], 1e-6);
  Photometry theirs = p;
  const double peak = FindPeak(p).intensity_cd;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const std::size_t plane = k % p.planes_deg.size();
    ASSERT_NEAR(std::fmod(planes[k], 360), p.planes_deg[plane], 1e-6);
    for (std::size_t j = 0; j < angles.size(); ++j) {
      const double cd = found.at("cd").at(k).at(j);
      ASSERT_NEAR(cd, p.at(plane, j), 1e-4 * p.at(plane, j) + 1e-6 * peak) << planes[k] << " " << j;
      theirs.intensity_cd[plane * angles.size() + j] = cd;
    }
  }
  EXPECT_NEAR(Flux(theirs) / Flux(p), 1, 1e-4);
}

TEST(ForeignReaders, FindEveryIntensityWhereItIs) {
  if (!HasModule("numpy")) GTEST_SKIP() << "no Python of `./run foreign`";
  const Scratch folder("readers");
  const Photometry lamps[] = {
      RandomLamp(PhotometryType::kC, static_cast<unsigned>(TestSeed(71))),
      SampleFarField(AsymmetricLamp(), {.plane_deg = 15, .angle_deg = 2.5}, {}, "x").table};
  for (const Photometry& p : lamps) {
    Write(folder, p);
    const std::string said = OutputOf(fmt::format(
        "{} -B {}/tests/foreign/judge_photometric.py {} {} 2>&1", ForeignProgram("python"),
        LUXFIELD_SOURCE_DIR, folder.folder().string(), (folder / "answer.json").string()));
    ASSERT_TRUE(std::filesystem::exists(folder / "answer.json")) << said;
    const core::Json answer =
        core::ParseJson(core::ReadFile(folder / "answer.json"), "answer.json");
    for (const auto& table : answer.at("tables")) {
      SCOPED_TRACE(fmt::format("{} of {}", table.at("file").get<std::string>(),
                               table.at("reader").get<std::string>()));
      ExpectSame(table, p);
    }
    for (const auto& reader : answer.at("missing"))
      std::printf("SKIPPED: Python's %s is not installed (./run foreign): it reads no file\n",
                  reader.get<std::string>().c_str());
    std::filesystem::remove(folder / "answer.json");
  }
}

std::string Violations(const std::filesystem::path& schema, const std::filesystem::path& file) {
  return OutputOf(fmt::format("{} -B {}/tests/foreign/check_xml.py {} {} 2>&1",
                              ForeignProgram("python"), LUXFIELD_SOURCE_DIR, schema.string(),
                              file.string()));
}

TEST(ForeignReaders, Tm33HoldsToItsSchema) {
  if (!HasModule("lxml")) GTEST_SKIP() << "no lxml";
  const Scratch folder("tm33");
  const std::filesystem::path schema = LUXFIELD_SOURCE_DIR "/tests/foreign/tm33.xsd";
  const auto file = folder / "lamp.xml";
  for (const auto type : {PhotometryType::kC, PhotometryType::kB, PhotometryType::kA}) {
    Photometry p = RandomLamp(type, 5);
    for (const auto shape : {Opening::Shape::kBox, Opening::Shape::kEllipse}) {
      p.opening.shape = shape;
      p.keywords.emplace_back("_NOTE", "a < b & c");
      core::WriteFileAtomically(file, FormatTm33(p, "x"));
      EXPECT_EQ(Violations(schema, file), "");
    }
  }
  core::WriteFileAtomically(file, "<IESTM33-22><Version>1.0</Version></IESTM33-22>");
  EXPECT_NE(Violations(schema, file), "");
}

TEST(ForeignReaders, GldfAndL3dHoldToTheirSchemas) {
  const auto schemas = testdata::Folder() / "gldf";
  LUXFIELD_NEEDS_DATA(schemas / "gldf.xsd");
  if (!HasModule("lxml")) GTEST_SKIP() << "no lxml";
  const Scratch folder("gldf");
  Photometry p = RandomLamp(PhotometryType::kC, 6);
  using enum Opening::Shape;
  for (const Opening& opening : {Opening{}, Opening{kBox, 0.3, 0.2, 0}, Opening{kBox, 1, 2, 0.5},
                                 Opening{kEllipse, 0.1, 0.1, 0}}) {
    SCOPED_TRACE(Describe(opening));
    p.opening = opening;
    const std::string gldf = FormatGldf(p, {0.01, 0, 0}, "test <1>", "x");
    core::WriteFileAtomically(folder / "product.xml", ZipReader(gldf, "x").Read("product.xml"));
    EXPECT_EQ(Violations(schemas / "gldf.xsd", folder / "product.xml"), "");
    const auto l3d = FormatL3d(opening, {0.01, 0, 0}, "test <1>");
    if (!l3d) continue;
    core::WriteFileAtomically(folder / "structure.xml", ZipReader(*l3d, "x").Read("structure.xml"));
    EXPECT_EQ(Violations(schemas / "l3d.xsd", folder / "structure.xml"), "");
  }
}

}  // namespace
}  // namespace luxfield::formats
