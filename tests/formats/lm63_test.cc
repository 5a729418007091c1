// LM-63: every version, what is met in the wild, what is refused, and our files read back.
#include "luxfield/formats/lm63.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "tests/formats/lamps.h"

namespace luxfield::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Three angles of one plane unless told.
std::string File(const std::string& version, const std::string& sizes = "0 0 0",
                 const std::string& tail = "1 1 50\n0 45 90\n0\n100 50 10\n") {
  return version + "\n[TEST] 1\n[MANUFAC] M\n[MORE] of Ulm\nTILT=NONE\n1 1000 1 3 1 1 2 " + sizes +
         "\n" + tail;
}

std::string Refusal(const std::string& text) {
  try {
    ParseLm63(text, "x.ies");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(Lm63, ReadsEveryVersion) {
  for (const auto& [mark, format] :
       {std::pair{"IESNA91", "LM-63-1991"}, std::pair{"IESNA:LM-63-1995", "LM-63-1995"},
        std::pair{"IESNA:LM-63-2002", "LM-63-2002"}, std::pair{"IES:LM-63-2019", "LM-63-2019"}}) {
    const Photometry p = ParseLm63(File(mark), "x.ies");
    EXPECT_EQ(p.format, format);
    EXPECT_THAT(p.intensity_cd, ElementsAre(100, 50, 10));
    EXPECT_EQ(p.keyword("MANUFAC"), "M\nof Ulm");
    EXPECT_EQ(p.lamp_flux_lm, 1000);
    EXPECT_EQ(p.input_watts, 50);
    EXPECT_FALSE(p.absolute);
    EXPECT_THAT(p.odd, ElementsAre());
  }
  const Photometry old = ParseLm63(
      "Some lamp\nof 1986\nTILT=NONE\n2 500 2 3 1 1 1 1 2 0 .5 .5 40\n0 45 90\n0\n100 50 10\n",
      "x");
  EXPECT_EQ(old.format, "LM-63-1986");
  EXPECT_EQ(old.keywords.front().second, "Some lamp");
  // Multiplier 2, ballast factor 0.5, ballast-lamp factor 0.5; feet.
  EXPECT_THAT(old.intensity_cd, ElementsAre(50, 25, 5));
  EXPECT_EQ(old.lamp_flux_lm, 1000);
  EXPECT_DOUBLE_EQ(old.opening.c0_m, 2 * 0.3048);
  EXPECT_DOUBLE_EQ(old.opening.c90_m, 0.3048);
}

// Since 1995 what stands in the ballast-lamp factor's place is none: never a factor.
TEST(Lm63, ThirdFactorCountsUpTo1991Only) {
  const std::string tail = "1 1.0001 50\n0 45 90\n0\n100 50 10\n";
  EXPECT_EQ(ParseLm63(File("IES:LM-63-2019", "0 0 0", tail), "x").at(0, 0), 100);
  EXPECT_EQ(ParseLm63(File("IESNA:LM-63-1995", "0 0 0", tail), "x").at(0, 0), 100);
  EXPECT_DOUBLE_EQ(ParseLm63(File("IESNA91", "0 0 0", tail), "x").at(0, 0), 100.01);
}

TEST(Lm63, OpeningsFollowTheVersion) {
  using enum Opening::Shape;
  struct Case {
    int year;
    const char* sizes;  // width, length, height
    Opening wanted;
  };
  const Case cases[] = {
      {1995, "0 0 0", {kPoint, 0, 0, 0}},
      {1995, "1 2 3", {kBox, 2, 1, 3}},
      {1995, "1 2 0", {kBox, 2, 1, 0}},
      {1995, "-1 0 0", {kEllipse, 1, 1, 0}},
      {1995, "-1 0 3", {kEllipse, 1, 1, 3}},
      {1995, "-1 0 -1", {kEllipsoid, 1, 1, 1}},
      {2002, "-1 0 -1", {kVerticalDisc, 0, 1, 1}},
      {2019, "-1 0 -1", {kVerticalDisc, 0, 1, 1}},
      {1995, "0 2 -1", {kCylinderAlongC0, 2, 1, 1}},
      {1995, "2 0 -1", {kCylinderAlongC90, 1, 2, 1}},
      {1995, "-1 2 3", {kEllipse, 2, 1, 3}},
      {1995, "1 -2 3", {kEllipse, 2, 1, 3}},
      {1995, "-1 2 -3", {kEllipsoid, 2, 1, 3}},
      {2002, "-1 -1 0", {kEllipse, 1, 1, 0}},
      {2019, "-1 -1 3", {kEllipse, 1, 1, 3}},
      {2019, "-1 -1 -1", {kEllipsoid, 1, 1, 1}},
      {2019, "-1 2 -1", {kCylinderAlongC0, 2, 1, 1}},
      {2019, "2 -1 -1", {kCylinderAlongC90, 1, 2, 1}},
  };
  for (const auto& [year, sizes, wanted] : cases) {
    const std::string mark =
        year == 2019 ? "IES:LM-63-2019" : "IESNA:LM-63-" + std::to_string(year);
    const Opening o = ParseLm63(File(mark, sizes), "x").opening;
    EXPECT_EQ(o.shape, wanted.shape) << year << " " << sizes;
    EXPECT_THAT((std::array{o.c0_m, o.c90_m, o.height_m}),
                ElementsAre(wanted.c0_m, wanted.c90_m, wanted.height_m))
        << year << " " << sizes;
  }
}

TEST(Lm63, ReadsWhatIsMetInTheWild) {
  // Commas, CR LF and CR, ISO-8859-1, numbers over several lines, a DOS end-of-file mark.
  const Photometry p = ParseLm63(
      "IESNA:LM-63-1995\r\n[MANUFAC] Ulm \xE4\r\nTILT=NONE\r\n1,-1,1,3,\r1,1,2,0,0,0\r\n"
      "1 1\r\n 50\r\n0,45 , 90\r\n0\r\n+100 5e1,1.0E1\r\n\x1a",
      "x");
  EXPECT_EQ(p.keyword("MANUFAC"), "Ulm \xC3\xA4");
  EXPECT_THAT(p.intensity_cd, ElementsAre(100, 50, 10));
  EXPECT_TRUE(p.absolute);
  EXPECT_EQ(p.lamp_flux_lm, std::nullopt);

  const auto planes = [](const std::string& list, int count) {
    std::string text = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 " + std::to_string(count) +
                       " 1 2 0 0 0\n1 1 1\n0 90\n" + list + "\n";
    for (int k = 0; k < count; ++k) text += "5 " + std::to_string(k) + "\n";
    return text;
  };
  EXPECT_THAT(ParseLm63(planes("0 90 180 270", 4), "x").odd,
              ElementsAre(HasSubstr("end at C270 without C360")));
  EXPECT_EQ(ParseLm63(planes("0 90 180 270 360", 5), "x").planes_deg.size(), 4);
  EXPECT_THAT(ParseLm63(planes("0 90 180 270 360", 5), "x").odd,
              ElementsAre(HasSubstr("plane C360 is not C0 (at gamma 90: 4 and 0 cd)")));
  EXPECT_THAT(ParseLm63(planes("90 180 270", 3), "x").planes_deg, ElementsAre(0, 90, 180, 270));
  EXPECT_THAT(ParseLm63(planes("0 45 90", 3), "x").planes_deg,
              ElementsAre(0, 45, 90, 135, 180, 225, 270, 315));
  EXPECT_THAT(Refusal(planes("0 90 181", 3)), HasSubstr("planes go from C0 to C181"));
}

TEST(Lm63, ReadsTilt) {
  std::string text = File("IESNA:LM-63-2002");
  text.replace(text.find("TILT=NONE"), 9, "TILT=INCLUDE\n1\n3\n0 45 90\n1 .95 .9");
  const Photometry p = ParseLm63(text, "x");
  ASSERT_TRUE(p.tilt);
  EXPECT_THAT(p.tilt->factors, ElementsAre(1, 0.95, 0.9));
  const Photometry again = ParseLm63(FormatLm63(p, Lm63Version::k2002, "x"), "x");
  EXPECT_EQ(again.tilt->angles_deg, p.tilt->angles_deg);
  text = File("IESNA:LM-63-2002");
  text.replace(text.find("TILT=NONE"), 9, "TILT=other.tlt");
  EXPECT_THAT(ParseLm63(text, "x").odd, ElementsAre(HasSubstr("other.tlt")));
}

TEST(Lm63, RefusalsNameLineAndField) {
  EXPECT_THAT(Refusal(""), HasSubstr("x.ies: ends at line 0, before its first line"));
  EXPECT_THAT(Refusal("IESNA91\n[TEST]\n"), HasSubstr("without a line that begins with TILT="));
  const std::string good = File("IESNA91");
  EXPECT_THAT(Refusal(good.substr(0, good.size() - 4)), HasSubstr("before its candela values"));
  EXPECT_THAT(Refusal(File("IESNA91", "0 0 x")), HasSubstr("line 6: height 'x' is no number"));
  EXPECT_THAT(Refusal(File("IESNA91", "0 0 0", "0 1 50\n0 45 90\n0\n1 2 3\n")),
              HasSubstr("line 7: ballast factor = 0 must be above 0"));
  EXPECT_THAT(Refusal(File("IESNA91", "0 0 0", "1 1 50\n0 90 45\n0\n1 2 3\n")),
              HasSubstr("gamma angle 3 = 45 degrees does not lie above"));
  EXPECT_THAT(Refusal(File("IESNA91", "0 0 0", "1 1 50\n0 45 90\n0\n1 nan 3\n")),
              HasSubstr("candela values 'nan' is no number"));
  EXPECT_THAT(Refusal("TILT=NONE\n1 -1 1 99999 99999 1 2 0 0 0 1 1 1\n"),
              HasSubstr("99999 planes of 99999 angles do not fit"));
  EXPECT_THAT(Refusal("TILT=NONE\n1 -1 1 3 1 4 2 0 0 0 1 1 1\n"),
              HasSubstr("photometric type = 4 is no whole number from 1 to 3"));
}

// Six digits of a value are within 5e-6 of it.
TEST(Lm63, OurFilesReadBackTheSame) {
  for (const PhotometryType type : {PhotometryType::kC, PhotometryType::kB, PhotometryType::kA})
    for (const Lm63Version version : {Lm63Version::k2002, Lm63Version::k2019}) {
      const Photometry p = RandomLamp(type, 21);
      const std::string text = FormatLm63(p, version, "x");
      const Photometry q = ParseLm63(text, "x");
      EXPECT_EQ(q.planes_deg, p.planes_deg);
      EXPECT_EQ(q.angles_deg, p.angles_deg);
      EXPECT_LT(LargestDifference(q, p), 5.1e-6);
      EXPECT_NEAR(Flux(q) / Flux(p), 1, 5e-6);
      EXPECT_TRUE(q.absolute);
      EXPECT_EQ(q.opening.c90_m, 0.6);
      EXPECT_THAT(q.odd, ElementsAre());
      for (std::size_t at = 0; at < text.size();) {
        const auto end = text.find("\r\n", at);
        EXPECT_LE(end - at, 132u);
        at = end + 2;
      }
    }
}

TEST(Lm63, OpeningsAreWrittenAsTheyAreRead) {
  using enum Opening::Shape;
  for (const Opening& o :
       {Opening{}, Opening{kBox, 2, 1, 3}, Opening{kEllipse, 1, 1, 0}, Opening{kEllipse, 2, 1, 0.5},
        Opening{kEllipsoid, 1, 1, 1}, Opening{kEllipsoid, 2, 1, 3}, Opening{kVerticalDisc, 0, 1, 1},
        Opening{kCylinderAlongC0, 2, 1, 1}, Opening{kCylinderAlongC90, 1, 2, 1}}) {
    Photometry p = RandomLamp(PhotometryType::kC, 1);
    p.opening = o;
    const Opening q = ParseLm63(FormatLm63(p, Lm63Version::k2019, "x"), "x").opening;
    EXPECT_EQ(Describe(q), Describe(o));
  }
}

TEST(Lm63, SymmetryShortensTheTable) {
  const Photometry whole = RandomLamp(PhotometryType::kC, 1);
  Photometry half = whole;
  half.planes_deg = Steps(90, 270, 15);
  half.intensity_cd.resize(half.planes_deg.size() * half.angles_deg.size());
  MirrorPlanes(half, 90, "x");
  const std::string text = FormatLm63(half, Lm63Version::k2002, "x");
  // 13 planes of the 25 that the whole turn takes.
  EXPECT_LT(double(text.size()), 0.6 * double(FormatLm63(whole, Lm63Version::k2002, "x").size()));
  const Photometry again = ParseLm63(text, "x");
  EXPECT_EQ(again.planes_deg, half.planes_deg);
  EXPECT_LT(LargestDifference(again, half), 5.1e-6);
}

}  // namespace
}  // namespace luxfield::formats
