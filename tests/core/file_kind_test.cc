// What files are, by their first bytes; and that nothing that is no such file is taken for one.
#include "luxfield/core/file_kind.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "luxfield/core/exr.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

class FileKindTest : public testing::Test {
 protected:
  FileKindTest() {
    std::string name = testing::TempDir() + "/luxfield-XXXXXX";
    folder_ = ::mkdtemp(name.data());
  }
  ~FileKindTest() override { fs::remove_all(folder_); }

  FileKind Of(const std::string& name, std::string_view bytes) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return WhatIs(folder_ / name);
  }
  FileKind OfExr(const ExrAttributes& attributes) const {
    WriteExrImage(folder_ / "x.exr", Image(2, 2, 1), attributes);
    return WhatIs(folder_ / "x.exr");
  }

  fs::path folder_;
};

TEST_F(FileKindTest, OpenExrFilesSayWhatTheyAre) {
  const auto kind = [](const char* name) {
    return ExrAttributes{{"luxfield:kind", std::string(name)}};
  };
  EXPECT_EQ(OfExr({}), FileKind::kExrPicture);
  EXPECT_EQ(OfExr(kind("light-field")), FileKind::kLightField);
  EXPECT_EQ(OfExr(kind("measurements")), FileKind::kMeasurements);
  EXPECT_EQ(OfExr(kind("tables")), FileKind::kTables);
  EXPECT_EQ(OfExr(kind("filter")), FileKind::kMeasuredFilter);
  EXPECT_EQ(OfExr(kind("merged picture")), FileKind::kExrPicture);
  EXPECT_EQ(OfExr({{"luxfield:format", std::string("luxfield flat field")}}), FileKind::kFlatField);
  EXPECT_EQ(Of("cut.exr", {"\x76\x2f\x31\x01luxfield:kind\0string\0", 25}), FileKind::kExrPicture);
}

TEST_F(FileKindTest, TablesOfTomlTell) {
  EXPECT_EQ(Of("a.toml", "# [lab]\n[plan]\nname = 'x'\n"), FileKind::kPlan);
  EXPECT_EQ(Of("a.toml", "[lab]\ndriver = 'sim'\n[camera]\n"), FileKind::kLab);
  EXPECT_EQ(Of("a.toml", "[camera]\n\n[[luminaire]]\n"), FileKind::kScene);
  EXPECT_EQ(Of("a.toml", "up = [0, 0, 1]\n[[camera]]\nt_s = 0\n"), FileKind::kMotionPath);
  EXPECT_EQ(Of("a.toml", "[[luminaire]]\nname = 'a'\n[[luminaire.key]]\n"), FileKind::kMotionPath);
  EXPECT_EQ(Of("a.toml", "[camera]\n"), FileKind::kUnknown);
  EXPECT_EQ(Of("a.toml", " [plan]\n"), FileKind::kUnknown);
  EXPECT_EQ(Of("a.txt", "[plan]\n"), FileKind::kUnknown);
}

TEST_F(FileKindTest, FormatsOfJsonTell) {
  EXPECT_EQ(Of("a.json", R"({"version": 1, "format": "luxfield glare calibration"})"),
            FileKind::kGlareCalibration);
  EXPECT_EQ(Of("a.json", R"({"format":"luxfield filter sheet"})"), FileKind::kFilterSheet);
  EXPECT_EQ(Of("a.json", R"({"verb": "info", "wall_s": 1})"), FileKind::kFigures);
  EXPECT_EQ(Of("a.json", R"({"format": )"), FileKind::kUnknown);
  EXPECT_EQ(Of("a.json", "{}"), FileKind::kUnknown);
}

TEST_F(FileKindTest, FilesOfOtherPrograms) {
  EXPECT_EQ(Of("a", "TM25...."), FileKind::kRays);
  EXPECT_EQ(Of("a", "LTRF...."), FileKind::kRays);
  EXPECT_EQ(Of("a.txt", "# x\r\nlt_rdf_version: 2.0\r\n"), FileKind::kRays);
  EXPECT_EQ(Of("a.sdf", {"\xf2\x03\0\0", 4}), FileKind::kRays);
  EXPECT_EQ(Of("a.bin", {"\xf2\x03\0\0", 4}), FileKind::kUnknown);
  const std::string speos("\0\0\x80\x3f\0\0\0\x40", 8);
  EXPECT_EQ(Of("a.ray", speos + std::string(52, '\0')), FileKind::kRays);
  EXPECT_EQ(Of("a.ray", speos + std::string(51, '\0')), FileKind::kForeignRays);
  EXPECT_EQ(Of("a.dis", "x"), FileKind::kForeignRays);
  EXPECT_EQ(Of("a", "IESNA:LM-63-2002\n"), FileKind::kIntensity);
  EXPECT_EQ(Of("a.LDT", "Lamps\n"), FileKind::kIntensity);
  EXPECT_EQ(Of("a", "\x89PNG\r\n"), FileKind::kPhotograph);
  EXPECT_EQ(Of("a", {"II*\0", 4}), FileKind::kPhotograph);
  EXPECT_EQ(Of("a", "#?RADIANCE\n"), FileKind::kRadianceHdr);
  EXPECT_EQ(Of("a.gltf", "{}"), FileKind::kMesh);
  EXPECT_EQ(Of("a", ""), FileKind::kUnknown);
  EXPECT_EQ(Of("a", "II*"), FileKind::kUnknown);
  EXPECT_EQ(WhatIs(folder_ / "absent"), FileKind::kUnknown);
  EXPECT_EQ(WhatIs("/dev/null"), FileKind::kUnknown);
}

TEST_F(FileKindTest, FoldersAreSessionsOfTheirPlan) {
  Of("s/plan.json", R"({"geometry": {}, "filter": {"kind": "basis"}})");
  EXPECT_EQ(WhatIs(folder_ / "s"), FileKind::kLightFieldSession);
  Of("s/plan.json", R"({"kind": "glare"})");
  EXPECT_EQ(WhatIs(folder_ / "s"), FileKind::kGlareSession);
  Of("s/plan.json", "damaged");
  EXPECT_EQ(WhatIs(folder_ / "s"), FileKind::kSession);
  Of("lost/journal.jsonl", "");
  EXPECT_EQ(WhatIs(folder_ / "lost"), FileKind::kSession);
  Of("frames/a.HDR", "");
  EXPECT_EQ(WhatIs(folder_ / "frames"), FileKind::kEnvironmentFrames);
  Of("other/a.txt", "");
  EXPECT_EQ(WhatIs(folder_ / "other"), FileKind::kFolder);
}

TEST_F(FileKindTest, EveryKindHasAName) {
  std::vector<std::string> names;
  for (int kind = 0; kind <= static_cast<int>(FileKind::kHtml); ++kind)
    names.push_back(NameOf(static_cast<FileKind>(kind)));
  EXPECT_THAT(names, testing::Each(testing::Ne("")));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
  EXPECT_TRUE(IsSession(FileKind::kFilterSession) && IsSession(FileKind::kSession));
  EXPECT_FALSE(IsSession(FileKind::kFolder) || IsSession(FileKind::kPlan) ||
               IsSession(FileKind::kEnvironmentFrames));
}

}  // namespace
}  // namespace luxfield::core
