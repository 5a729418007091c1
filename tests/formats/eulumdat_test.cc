// EULUMDAT: all symmetries, unequal planes, lamp sets, what is refused, and round trips.
#include "luxfield/formats/eulumdat.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/formats/lm63.h"
#include "tests/formats/lamps.h"

namespace luxfield::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct Ldt {
  int symmetry = 0;
  std::vector<double> planes = {0, 90, 180, 270};
  std::vector<std::vector<double>> stored;  // one list of two intensities a plane
  std::string sizes = "600\n300\n50\n500\n200\n0\n0\n0\n0\n";
  std::string sets = "1\n2\nLED\n2000\n3000 K\n80\n25\n";
  std::string conversion = "1";

  std::string Text() const {
    std::string text =
        fmt::format("Ulm GmbH\n3\n{}\n{}\n0\n2\n90\nR 1\nL 1\nN 1\nF\n2024\n{}100\n80\n{}\n0\n{}",
                    symmetry, planes.size(), sizes, conversion, sets);
    for (int k = 0; k < 10; ++k) text += "0,5\n";
    for (const double plane : planes) text += fmt::format("{}\n", plane);
    text += "0\n90\n";
    for (const auto& plane : stored) text += fmt::format("{}\n{}\n", plane[0], plane[1]);
    return text;
  }
};

std::string Refusal(const std::string& text) {
  try {
    ParseEulumdat(text, "x.ldt");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

// Intensity at C and gamma = 90; the lamps' 2000 lm double the numbers stored.
double At(const Photometry& p, double plane) {
  return Intensity(p, Direction(PhotometryType::kC, plane, 90 - 1e-12)) / 2;
}

TEST(Eulumdat, EverySymmetryIsCompleted) {
  const Ldt none{.symmetry = 0, .stored = {{9, 1}, {9, 2}, {9, 3}, {9, 4}}};
  const Ldt one{.symmetry = 1, .stored = {{9, 1}}};
  const Ldt c0{.symmetry = 2, .stored = {{9, 1}, {9, 2}, {9, 3}}};
  const Ldt c90{.symmetry = 3, .stored = {{9, 1}, {9, 2}, {9, 3}}};  // C270, C0, C90
  const Ldt both{.symmetry = 4, .stored = {{9, 1}, {9, 2}}};
  const std::pair<Ldt, std::array<double, 4>> cases[] = {{none, {1, 2, 3, 4}},
                                                         {one, {1, 1, 1, 1}},
                                                         {c0, {1, 2, 3, 2}},
                                                         {c90, {2, 3, 2, 1}},
                                                         {both, {1, 2, 1, 2}}};
  for (const auto& [file, wanted] : cases) {
    const Photometry p = ParseEulumdat(file.Text(), "x.ldt");
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(At(p, 90 * k), wanted[std::size_t(k)], 1e-9) << file.symmetry << " " << k;
    EXPECT_THAT(p.odd, ElementsAre());
  }
}

TEST(Eulumdat, HeaderIsRead) {
  Ldt file{.symmetry = 1, .stored = {{9, 1}}};
  Photometry p = ParseEulumdat(file.Text(), "x.ldt");
  EXPECT_EQ(p.keyword("MANUFAC"), "Ulm GmbH");
  EXPECT_EQ(p.stated_flux_lm, 1600);  // 80 % of 2000 lm
  EXPECT_EQ(p.lamp_flux_lm, 2000);
  EXPECT_EQ(p.input_watts, 25);
  // Length lies along C90.
  EXPECT_EQ(Describe(p.opening), "a rectangle of 200 mm (C0) x 500 mm (C90)");
  EXPECT_DOUBLE_EQ(p.housing_m[1], 0.6);
  file.sizes = "600,5\n0\n50\n500\n0\n9\n9\n9\n9\n";
  file.sets = "1\n-2\nLED\n2000\n\n\n\n";
  file.conversion = "0,5";
  p = ParseEulumdat(file.Text(), "x.ldt");
  EXPECT_EQ(Describe(p.opening), "a vertical cylinder of 500 mm, 9 mm high");
  EXPECT_DOUBLE_EQ(p.housing_m[0], 0.6005);
  EXPECT_TRUE(p.absolute);
  EXPECT_EQ(p.lamp_flux_lm, std::nullopt);
  EXPECT_EQ(p.at(0, 0), 9);
  file.sets = "2\n1\nA\n1000\n\n\n10\n3\nB\n7000\n\n\n30\n";
  file.conversion = "1";
  p = ParseEulumdat(file.Text(), "x.ldt");
  EXPECT_EQ(p.at(0, 0), 9);
  EXPECT_EQ(p.lamps[1].flux_lm, 7000);
  EXPECT_THAT(p.odd, ElementsAre(HasSubstr("2 lamp sets")));
}

TEST(Eulumdat, UnequalPlanesAreKept) {
  const Ldt file{.planes = {0, 30, 180, 300}, .stored = {{9, 1}, {9, 2}, {9, 3}, {9, 4}}};
  const Photometry p = ParseEulumdat(file.Text(), "x.ldt");
  EXPECT_NEAR(At(p, 15), 1.5, 1e-9);
  EXPECT_NEAR(At(p, 330), 2.5, 1e-9);
}

TEST(Eulumdat, RefusalsNameLineAndField) {
  const Ldt file{.symmetry = 1, .stored = {{9, 1}}};
  const std::string good = file.Text();
  EXPECT_THAT(Refusal(good.substr(0, good.size() - 3)), HasSubstr("before its intensities"));
  EXPECT_THAT(Refusal("x\n9\n"), HasSubstr("x.ldt: line 2: type indicator = 9"));
  EXPECT_THAT(Refusal("x\n1\n1,x\n"), HasSubstr("line 3: symmetry indicator '1.x' is no number"));
  Ldt odd = file;
  odd.symmetry = 4;
  odd.planes = {0, 180};
  EXPECT_THAT(Refusal(odd.Text()), HasSubstr("number of planes = 2 does not have a quarter"));
  odd.planes.assign(99996, 0);
  odd.symmetry = 0;
  EXPECT_THAT(Refusal("x\n1\n0\n99996\n0\n99996\n" + good.substr(good.find("\n90\n") + 1)),
              HasSubstr("99996 planes of 99996 angles do not fit"));
  odd = file;
  odd.sets = "1\n1\nLED\n0\n\n\n\n";
  EXPECT_THAT(Refusal(odd.Text()), HasSubstr("flux of the first lamp set = 0 lm"));
}

// Seven digits of EULUMDAT, six of LM-63, of each intensity.
TEST(Eulumdat, RoundTripsKeepFluxAndIntensities) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Photometry p = RandomLamp(PhotometryType::kC, seed);
    const std::string ldt = FormatEulumdat(p, "x");
    const Photometry q = ParseEulumdat(ldt, "x");
    EXPECT_EQ(q.planes_deg, p.planes_deg);
    EXPECT_LT(LargestDifference(q, p), 1e-6);
    EXPECT_NEAR(*q.stated_flux_lm / Flux(q), 1, 1e-6);
    EXPECT_EQ(Describe(q.opening), Describe(p.opening));
    EXPECT_EQ(q.keyword("MANUFAC"), p.keyword("MANUFAC"));
    const Photometry r = ParseLm63(FormatLm63(q, Lm63Version::k2019, "x"), "x");
    EXPECT_LT(LargestDifference(r, p), 7e-6);
    EXPECT_NEAR(Flux(r) / Flux(p), 1, 7e-6);
    EXPECT_EQ(Describe(r.opening), Describe(p.opening));
  }
}

TEST(Eulumdat, SymmetriesAreWritten) {
  for (const int symmetry : {1, 2, 3, 4}) {
    Ldt file{.symmetry = symmetry, .planes = Steps(0, 345, 15), .stored = {}};
    const std::size_t stored = symmetry == 1 ? 1 : symmetry == 4 ? 7 : 13;
    for (std::size_t k = 0; k < stored; ++k) file.stored.push_back({9, 1.0 + double(k)});
    const Photometry p = ParseEulumdat(file.Text(), "x");
    const std::string text = FormatEulumdat(p, "x");
    EXPECT_THAT(text, HasSubstr(fmt::format("\r\n{}\r\n{}\r\n", symmetry, symmetry == 1 ? 1 : 24)));
    EXPECT_LT(LargestDifference(ParseEulumdat(text, "x"), p), 1e-6);
  }
}

TEST(Eulumdat, TypesAAndBAreRefused) {
  EXPECT_THROW(FormatEulumdat(RandomLamp(PhotometryType::kB, 1), "x"), InputError);
}

}  // namespace
}  // namespace luxfield::formats
