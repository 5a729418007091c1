// GLDF: containers of ours and of others, and archives that are refused.
#include "luxfield/formats/gldf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/zip.h"
#include "tests/formats/lamps.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

using testing::HasSubstr;

std::string Refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string Product(const std::string& files, const std::string& photometries) {
  return "<Root><GeneralDefinitions><Files>" + files + "</Files><Photometries>" + photometries +
         "</Photometries></GeneralDefinitions></Root>";
}

const std::string kFile = "<File id='f' contentType='ldc/ies' type='localFileName'>a.ldt</File>";
const std::string kPhotometry =
    "<Photometry id='p'><PhotometryFileReference fileId='f'/></Photometry>";

TEST(Gldf, RoundTripsKeepEveryIntensity) {
  const Photometry p = RandomLamp(PhotometryType::kC, 9);
  const std::string bytes = FormatGldf(p, {}, "test <1>", "x.gldf");
  const Photometry read = ParseGldf(bytes, "x.gldf");
  EXPECT_EQ(read.format, "GLDF, EULUMDAT");
  ASSERT_EQ(read.intensity_cd.size(), p.intensity_cd.size());
  EXPECT_LT(LargestDifference(p, read), 1e-6);
  EXPECT_EQ(bytes, FormatGldf(p, {}, "test <1>", "x.gldf"));
  const auto path = std::filesystem::path(testing::TempDir()) / "gldf_test.gldf";
  core::WriteFileAtomically(path, bytes);
  EXPECT_EQ(core::WhatIs(path), core::FileKind::kIntensity);
  EXPECT_EQ(ReadPhotometry(path).format, "GLDF, EULUMDAT");
  std::filesystem::remove(path);
}

TEST(Gldf, ContainersOfOthersAreRead) {
  const auto folder = testdata::Folder() / "gldf";
  const auto whole = folder / "netests__GldfWithFilesComplete.gldf";
  LUXFIELD_NEEDS_DATA(whole);
  const Photometry p = ReadPhotometry(whole);  // deflated
  EXPECT_EQ(p.format, "GLDF, EULUMDAT");
  EXPECT_GT(Flux(p), 0);
  EXPECT_THAT(Refusal([&] { ReadPhotometry(folder / "netests__GldfWithHeaderMandatory.gldf"); }),
              HasSubstr("lies elsewhere, at https://example.org/eulumdat.ldt"));
  EXPECT_THAT(Refusal([&] { ReadPhotometry(folder / "netests__GldfWithMissingProduct.gldf"); }),
              HasSubstr("has no member 'product.xml'"));
}

TEST(Gldf, WhatIsWrongIsNamed) {
  const std::string ldt = FormatEulumdat(RandomLamp(PhotometryType::kC, 3), "x");
  const auto refusal = [](const std::vector<ZipMember>& members) {
    return Refusal([&] { ParseGldf(FormatZip(members), "x.gldf"); });
  };
  EXPECT_EQ(refusal({{"product.xml", Product(kFile, kPhotometry)}, {"ldc/a.ldt", ldt}}), "");
  EXPECT_THAT(refusal({}), HasSubstr("no member 'product.xml'"));
  EXPECT_THAT(refusal({{"product.xml", Product(kFile, kPhotometry)}}),
              HasSubstr("no member 'ldc/a.ldt'"));
  EXPECT_THAT(refusal({{"product.xml", Product("", kPhotometry)}}),
              HasSubstr("names no photometry"));
  EXPECT_THAT(refusal({{"product.xml", "<Root>"}}), HasSubstr("x.gldf: product.xml: line 1"));
  EXPECT_THAT(refusal({{"product.xml", Product(kFile, kPhotometry)}, {"ldc/a.ldt", "dark"}}),
              HasSubstr("x.gldf: ldc/a.ldt: ends at line 1"));
}

TEST(Zip, DamagedAndHostileArchivesAreRefused) {
  const std::string good = FormatZip({{"a", "some text"}, {"b/c", ""}});
  const ZipReader reader(good, "x.zip");
  EXPECT_EQ(reader.Read("a"), "some text");
  EXPECT_EQ(reader.Read("b/c"), "");
  EXPECT_FALSE(reader.Has("d"));
  for (const char* name : {"../a", "/a", "b/../../a", "C:a", "..\\a", ".."})
    EXPECT_THAT(Refusal([&] {
                  ZipReader(FormatZip({{name, "x"}}), "x.zip");
                }),
                HasSubstr("leads out of the archive"))
        << name;
  // Every byte changed: refused, or read without another result than the text.
  for (std::size_t k = 0; k < good.size(); ++k) {
    std::string spoilt = good;
    spoilt[k] = static_cast<char>(~spoilt[k]);
    try {
      const ZipReader spoilt_reader(spoilt, "x.zip");
      if (spoilt_reader.Has("a")) {
        EXPECT_EQ(spoilt_reader.Read("a"), "some text") << k;
      }
    } catch (const InputError&) {
    }
  }
  for (std::size_t length = 0; length < good.size(); ++length)
    EXPECT_THROW(ZipReader(std::string_view(good).substr(0, length), "x.zip"), InputError);
  // A member that says it is longer than any may be.
  std::string bomb = good;
  const std::uint32_t size = 0x7FFFFFFF;
  const auto entry = bomb.find(std::string("PK\x01\x02", 4));
  std::memcpy(bomb.data() + entry + 24, &size, sizeof(size));
  EXPECT_THAT(Refusal([&] { ZipReader(bomb, "x.zip").Read("a"); }),
              HasSubstr("64 MiB are the most"));
}

}  // namespace
}  // namespace luxfield::formats
