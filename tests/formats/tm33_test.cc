// TM-33: what files of its versions say, what is refused, hostile XML, and round trips.
#include "luxfield/formats/tm33.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/file_kind.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/formats/xml.h"
#include "tests/formats/lamps.h"

namespace luxfield::formats {
namespace {

using testing::HasSubstr;

std::string Refusal(const std::string& text) {
  try {
    ParseTm33(text, "x.xml");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string Document(const std::string& data, const std::string& root = "IESTM33-22") {
  return fmt::format(
      "<?xml version='1.0'?>\n<!-- a lamp -->\n<{0}><Version>1.1</Version><Header>"
      "<Manufacturer>Ulm &amp; Co</Manufacturer><Description><![CDATA[L <1>]]></Description>"
      "<Comment>c</Comment></Header><Luminaire><Dimensions><Length>1.2</Length><Width>0.6</Width>"
      "<Height>0.1</Height></Dimensions></Luminaire><Emitter><Quantity>1</Quantity>"
      "<InputWattage>35.5</InputWattage>{1}</Emitter></{0}>",
      root, data);
}

std::string Luminous(const std::string& inside) {
  return "<LuminousData><LuminousIntensity>" + inside + "</LuminousIntensity></LuminousData>";
}

std::string Datum(double h, double v, double value) {
  return fmt::format("<IntData h=\"{}\" v=\"{}\">{}</IntData>", h, v, value);
}

// Two angles in each of these planes, the plane's index + 1 at gamma = 90.
std::string Table(const std::vector<double>& planes) {
  std::string text;
  for (std::size_t k = 0; k < planes.size(); ++k)
    text += Datum(planes[k], 0, 9) + Datum(planes[k], 90, double(k + 1));
  return text;
}

double At(const Photometry& p, double plane) {
  return Intensity(p, Direction(PhotometryType::kC, plane, 90 - 1e-12));
}

TEST(Tm33, SaysWhatTheFileSays) {
  const Photometry p = ParseTm33(
      Document("<RatedLumens>900</RatedLumens>" +
               Luminous("<Multiplier>2</Multiplier>" + Table({0})) +
               "<EmissionAreas><BottomFace><BottomArea><Length>1.1</Length><Width>0.5</Width>"
               "</BottomArea></BottomFace></EmissionAreas>"),
      "x.xml");
  EXPECT_EQ(p.format, "TM-33-23");
  EXPECT_EQ(p.keyword("MANUFAC"), "Ulm & Co");
  EXPECT_EQ(p.keyword("LUMINAIRE"), "L <1>");
  EXPECT_EQ(p.keyword("OTHER"), "c");
  EXPECT_TRUE(p.absolute);
  EXPECT_EQ(p.input_watts, 35.5);
  EXPECT_EQ(p.lamps.at(0).flux_lm, 900);
  EXPECT_EQ(p.housing_m[0], 1.2);
  EXPECT_EQ(p.opening.c0_m, 1.1);
  EXPECT_EQ(p.opening.c90_m, 0.5);
  EXPECT_NEAR(At(p, 123), 2, 1e-9);
  EXPECT_TRUE(FindSymmetry(p).rotational);
}

TEST(Tm33, AreasThatAreNotTakenAreTold) {
  const auto odd = [](const std::string& areas) {
    return ParseTm33(
               Document(Luminous(Table({0})) + "<EmissionAreas>" + areas + "</EmissionAreas>"),
               "x.xml")
        .odd;
  };
  const std::string size = "<Length>1.1</Length><Width>0.5</Width>";
  EXPECT_THAT(odd("<BottomFace><BottomArea>" + size +
                  "<LengthOffset>0</LengthOffset><WidthOffset>0</WidthOffset></BottomArea>"
                  "</BottomFace>"),
              testing::IsEmpty());
  EXPECT_THAT(odd("<BottomFace><BottomArea>" + size +
                  "<LengthOffset>-0.3</LengthOffset><WidthOffset>0.4</WidthOffset></BottomArea>"
                  "</BottomFace>"),
              testing::ElementsAre(HasSubstr("lies 0.5 m beside")));
  EXPECT_THAT(odd("<TopFace/><C90Face/>"),
              testing::ElementsAre(HasSubstr("emits from TopFace, C90Face, too")));
}

TEST(Tm33, EveryRangeOfPlanesIsCompleted) {
  const std::pair<std::vector<double>, std::array<double, 4>> cases[] = {
      {{0, 90, 180, 270, 360}, {1, 2, 3, 4}},
      {{0, 90, 180}, {1, 2, 3, 2}},
      {{90, 180, 270}, {2, 1, 2, 3}},
      {{0, 90}, {1, 2, 1, 2}}};
  for (const auto& [planes, expected] : cases) {
    std::string table = Table(planes);
    if (planes.size() == 5) table = Table({0, 90, 180, 270}) + Datum(360, 0, 9) + Datum(360, 90, 1);
    const Photometry p = ParseTm33(Document(Luminous(table)), "x.xml");
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(At(p, 90.0 * double(k)), expected[k], 1e-6) << planes.size() << " " << k;
  }
}

TEST(Tm33, OlderFilesAreRead) {
  const std::string table = Table({0});
  EXPECT_EQ(ParseTm33(Document(Luminous(table), "IESTM33"), "x").format, "TM-33-18");
  EXPECT_EQ(ParseTm33(Document(Luminous(table), "ATLA_S001_A"), "x").format, "ATLA S001");
  const Photometry other = ParseTm33(
      Document("<IntensityDistribution><IntensityData horz='0' vert='0'>3</IntensityData>"
               "<IntensityData horz='0' vert='90'>1</IntensityData></IntensityDistribution>",
               "LuminaireOpticalData"),
      "x");
  EXPECT_NEAR(At(other, 0), 1, 1e-9);
  const Photometry radiant = ParseTm33(
      Document("<RadiantData><RadiantIntensity>" + table + "</RadiantIntensity></RadiantData>"),
      "x");
  EXPECT_THAT(radiant.odd, testing::ElementsAre(HasSubstr("W/sr")));
}

TEST(Tm33, RoundTripsKeepEveryIntensity) {
  for (const auto type : {PhotometryType::kC, PhotometryType::kB, PhotometryType::kA}) {
    Photometry p = RandomLamp(type, 7);
    p.keywords.emplace_back("ISSUEDATE", "2024-06-21");
    p.keywords.emplace_back("_NOTE", "a < b & c");
    const Photometry read = ParseTm33(FormatTm33(p, "x.xml"), "x.xml");
    ASSERT_EQ(read.intensity_cd.size(), p.intensity_cd.size());
    EXPECT_EQ(read.type, type);
    EXPECT_LT(LargestDifference(p, read), 1e-6);
    EXPECT_NEAR(Flux(read) / Flux(p), 1, 1e-6);
    EXPECT_NEAR(read.stated_flux_lm.value_or(0) / Flux(p), 1, 1e-6);
    EXPECT_EQ(read.keyword("ISSUEDATE"), "2024-06-21");
    EXPECT_EQ(read.keyword("OTHER"), "_NOTE: a < b & c");
    EXPECT_NEAR(read.opening.c0_m, p.opening.c0_m, 1e-9);
    EXPECT_NEAR(read.opening.c90_m, p.opening.c90_m, 1e-9);
  }
  // Through LM-63 as well, with six digits.
  const Photometry p = RandomLamp(PhotometryType::kC, 8);
  const Photometry by_lm63 =
      ParseLm63(FormatLm63(ParseTm33(FormatTm33(p, "x"), "x"), Lm63Version::k2019, "x"), "x");
  EXPECT_LT(LargestDifference(p, by_lm63), 1e-5);
}

TEST(Tm33, FilesAreToldByTheirContent) {
  const auto path = std::filesystem::path(testing::TempDir()) / "tm33_test.xml";
  core::WriteFileAtomically(path, Document(Luminous(Table({0}))));
  EXPECT_EQ(core::WhatIs(path), core::FileKind::kIntensity);
  EXPECT_EQ(ReadPhotometry(path).format, "TM-33-23");
  std::filesystem::remove(path);
}

TEST(Tm33, WhatIsWrongIsNamed) {
  EXPECT_THAT(Refusal("<html></html>"), HasSubstr("<html> is none of TM-33"));
  EXPECT_THAT(Refusal(Document("")), HasSubstr("holds no luminous or radiant intensities"));
  EXPECT_THAT(Refusal(Document("<PhotonData/>")), HasSubstr("photon intensities"));
  EXPECT_THAT(Refusal(Document(Luminous(Table({0}) + Datum(90, 0, 1)))),
              HasSubstr("do not fill a table"));
  EXPECT_THAT(Refusal(Document(Luminous(Table({0, 90}) + Datum(90, 90, 1)))),
              HasSubstr("do not fill a table"));
  EXPECT_THAT(Refusal(Document(Luminous(Table({0, 45})))), HasSubstr("from C0 to C45"));
  EXPECT_THAT(Refusal(Document(Luminous("<IntData h='0'>1</IntData>"))),
              HasSubstr("no vertical angle"));
  EXPECT_THAT(Refusal(Document(Luminous("<IntData h='0' v='0'>nan</IntData>"))),
              HasSubstr("'nan' is no number"));
  EXPECT_THAT(Refusal(Document(Luminous("<Multiplier>0</Multiplier>" + Table({0})))),
              HasSubstr("Multiplier = 0 must be above 0"));
}

TEST(Xml, HostileDocumentsAreRefused) {
  const auto refusal = [](const std::string& text) {
    try {
      ParseXml(text, "x.xml");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal("<!DOCTYPE a [<!ENTITY b \"c\">]><a>&b;</a>"), HasSubstr("document type"));
  EXPECT_THAT(refusal("<a>&b;</a>"), HasSubstr("&b; is not known"));
  EXPECT_THAT(refusal("<a>&#x110000;</a>"), HasSubstr("is not known"));
  std::string deep;
  for (int k = 0; k < 100; ++k) deep += "<a>";
  EXPECT_THAT(refusal(deep), HasSubstr("nested more than 64 deep"));
  std::string many = "<a>";
  for (int k = 0; k < (1 << 21); ++k) many += "<b/>";
  EXPECT_THAT(refusal(many), HasSubstr("holds more than 2097152 elements"));
  for (const char* text :
       {"", "a", "<", "<a", "<a>", "<a></b>", "</a>", "<a/><b/>", "<a b></a>", "<a b=c></a>",
        "<a b='c></a>", "<a><!-- </a>", "<a><![CDATA[</a>", "<a>&</a>", "<a/>text", "< a/>"})
    EXPECT_THAT(refusal(text), HasSubstr("x.xml: line 1: ")) << text;
  EXPECT_EQ(ParseXml("\xEF\xBB\xBF<p:a q:b='&lt;&#65;&#x42;'>\n x <c/> y </p:a>", "x").text,
            "x  y");
  const std::string utf16("\xFF\xFE<\0a\0>\0\xE4\0\x3D\xD8\0\xDE<\0/\0a\0>\0", 22);
  EXPECT_EQ(ParseXml(utf16, "x").text, "\xC3\xA4\xF0\x9F\x98\x80");
  EXPECT_EQ(XmlEscaped("<&>\x01"), "&lt;&amp;&gt;\\x01");
}

}  // namespace
}  // namespace luxfield::formats
