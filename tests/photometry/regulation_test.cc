// Files of regulations: those that come with the program, and what is wrong with others.
#include "luxfield/photometry/regulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "luxfield/core/error.h"

namespace luxfield::photometry {
namespace {

namespace fs = std::filesystem;
using Kind = Requirement::Kind;

const Requirement& Named(const Regulation& regulation, const std::string& name) {
  return *std::find_if(regulation.requirements.begin(), regulation.requirements.end(),
                       [&](const Requirement& one) { return one.name == name; });
}

TEST(Regulation, AllThatComeWithTheProgramAreRead) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(LUXFIELD_SOURCE_DIR "/data/regulations")) {
    const Regulation regulation = ReadRegulation(entry.path());
    EXPECT_EQ(regulation.distance_m, 25) << entry.path();
    EXPECT_GE(regulation.requirements.size(), 2u) << entry.path();
    EXPECT_THAT(regulation.source, testing::StartsWith("ECE/TRANS/WP.29/"));
    ++files;
  }
  EXPECT_EQ(files, 6);
}

TEST(Regulation, ClassCHasTheValuesOfTable6) {
  const Regulation c =
      ReadRegulation(LUXFIELD_SOURCE_DIR "/data/regulations/un-r149-01-passing-c.toml");
  EXPECT_EQ(c.aiming.kind, Aiming::Kind::kCutOff);
  EXPECT_EQ(c.aiming.level_v_deg, -0.57);
  EXPECT_EQ(c.aiming.sideways.size(), 3u);
  EXPECT_EQ(c.cut_off->least_gradient, 0.13);
  EXPECT_EQ(c.cut_off->most_gradient, 0.40);
  EXPECT_EQ(*Named(c, "B50L").most->value, 350);
  EXPECT_EQ(Named(c, "B50L").places[0].h_deg, -3.43);
  EXPECT_FALSE(Named(c, "B50L").least);
  EXPECT_EQ(*Named(c, "75R").least->value, 12100);
  EXPECT_EQ(Named(c, "Zone III").places.size(), 8u);
  EXPECT_EQ(Named(c, "Segment 50").kind, Kind::kLine);
  EXPECT_EQ(Named(c, "Segment 10 and below").most->of, "50R");
  EXPECT_EQ(Named(c, "S50LL + S50 + S50RR").places.size(), 3u);
}

TEST(Regulation, TheOtherSideOfTheRoadIsMirrored) {
  const Regulation left =
      Mirrored(ReadRegulation(LUXFIELD_SOURCE_DIR "/data/regulations/un-r149-01-passing-c.toml"));
  EXPECT_EQ(Named(left, "B50R").places[0].h_deg, 3.43);
  EXPECT_EQ(Named(left, "Segment BRR").places[1].h_deg, 8);
  EXPECT_EQ(Named(left, "75L").places[0].h_deg, -1.15);
  EXPECT_EQ(Named(left, "Segment 10 and below").most->of, "50L");
  EXPECT_EQ(Named(left, "S50RR + S50 + S50LL").places[0].h_deg, 8);
  EXPECT_EQ(left.aiming.level.from.h_deg, 2.5);
  EXPECT_EQ(left.cut_off->straight_h_deg[0], 1.5);
  const Regulation driving =
      Mirrored(ReadRegulation(LUXFIELD_SOURCE_DIR "/data/regulations/un-r149-01-driving-b.toml"));
  EXPECT_EQ(Named(driving, "H-3L").places[0].h_deg, -3);
  EXPECT_EQ(Named(driving, "H-V").least->of, "Imax");
}

constexpr const char* kHead =
    "name = \"n\"\nsource = \"s\"\n[receiver]\ndistance_m = 25\nside_m = 0.065\n[aim]\nby = "
    "\"none\"\n";

std::string ErrorOf(const std::string& text) {
  const fs::path file = fs::path(testing::TempDir()) / "regulation.toml";
  std::ofstream(file) << text;
  try {
    ReadRegulation(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Regulation, MistakesAreNamed) {
  const std::string head = kHead, point = "[[point]]\nname = \"a\"\nat_deg = [1, 2]\n";
  EXPECT_EQ(ErrorOf(head + point + "min_cd = 5\n"), "");
  for (const auto& [text, said] : {
           std::pair<std::string, std::string>{head, "point"},
           {head + point, "no limit"},
           {head + point + "min_cd = 5\nmin_share = 2\nmin_share_of = \"b\"\n", "min_share"},
           {head + point + "min_share = 2\nmin_share_of = \"b\"\n", "'b'"},
           {head + point + "min_share = 2\nmin_share_of = \"a\"\n", "'a'"},
           {head + point + "min_cd = 5\n" + point + "min_cd = 5\n", "two requirements"},
           {head + "[[point]]\nname = \"a\"\nat_deg = [1, 200]\nmin_cd = 5\n", "at_deg"},
           {head + "[[zone]]\nname = \"a\"\ncorners_deg = [1, 2, 3, 4]\nmin_cd = 5\n",
            "corners_deg"},
           {head + "[[zone]]\nname = \"a\"\ncorners_deg = [1, 2, 3, 4, 5]\nmin_cd = 5\n",
            "5 numbers"},
           {head + "[cut_off]\nreceiver_side_m = 0.03\n" + point + "min_cd = 5\n", "cut_off"},
           {head + point + "min_lm = 5\n", "no limit"},
           {head + point + "min_cd = 5\nmini_cd = 5\n", "mini_cd"},
       })
    EXPECT_THAT(ErrorOf(text),
                testing::AllOf(testing::HasSubstr("regulation.toml"), testing::HasSubstr(said)))
        << text;
  std::string by = head;
  by.replace(by.find("none"), 4, "cut-off");
  EXPECT_THAT(ErrorOf(by + "[aim.level]\nfrom_deg = [0, 0]\nto_deg = [1, 0]\nv_deg = 0\n" + point +
                      "min_cd = 5\n"),
              testing::HasSubstr("vertical scan"));
}

}  // namespace
}  // namespace luxfield::photometry
