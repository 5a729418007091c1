#include "luxfield/hal/drivers/grbl/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/hal/drivers/grbl/codes.h"
#include "tests/fuzz/grbl_message.h"
#include "tests/fuzz/seeded.h"

namespace luxfield::hal::grbl {
namespace {

using testing::ElementsAre;

template <typename Kind>
Kind Parsed(const std::string& line) {
  const Message message = ParseMessage(line);
  if (!std::holds_alternative<Kind>(message)) {
    ADD_FAILURE() << line << " is taken for another kind of message";
    return {};
  }
  return std::get<Kind>(message);
}

TEST(GrblMessage, ResponsesAreOnlyOkAndError) {
  Parsed<Ok>("ok");
  EXPECT_EQ(Parsed<ErrorReply>("error:9").code, 9);
  EXPECT_EQ(Parsed<Alarm>("ALARM:1").code, 1);
  EXPECT_EQ(Parsed<Feedback>("[MSG:'$H'|'$X' to unlock]").text, "MSG:'$H'|'$X' to unlock");
  EXPECT_EQ(Parsed<Feedback>("[VER:1.1h.20190825:]").text, "VER:1.1h.20190825:");
  // interface.md: executed startup lines answer nothing that was sent.
  for (const char* line : {">G54G20:ok", ">:error:7", "", "OK", "ok ", "error:", "error:x",
                           "error:-1", "ALARM:", "ALARM:1x", "Grbl", "hello", "<", ">", "[", "<>"})
    Parsed<Other>(line);
}

// interface.md; report.c of grblHAL; Report.cpp and SettingsDefinitions.cpp of FluidNC.
TEST(GrblMessage, TheFirmwareIsNamedByItsWelcomeAndItsVersionLine) {
  const auto named = [](const Firmware& firmware) {
    return firmware.name + " " + firmware.version;
  };
  const auto welcomed = [&](const std::string& line) {
    return named(Parsed<Welcome>(line).firmware);
  };
  EXPECT_EQ(welcomed("Grbl 1.1h ['$' for help]"), "Grbl 1.1h");
  EXPECT_EQ(welcomed("GrblHAL 1.1f ['$' or '$HELP' for help]"), "grblHAL 1.1f");
  EXPECT_EQ(welcomed("Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]"), "FluidNC v3.9.1");
  EXPECT_EQ(named(ParseVersion("VER:1.1h.20190825:my machine")), "Grbl 1.1h.20190825");
  EXPECT_EQ(named(ParseVersion("VER:3.9 FluidNC v3.9.1 (esp32-wifi) :")), "FluidNC v3.9.1");
  for (const char* line : {"Grbl 1.1h", "Marlin 2.1 ['$' for help]", "GrblX 1 ['$' for help]"})
    Parsed<Other>(line);
}

TEST(GrblMessage, Settings) {
  EXPECT_EQ(Parsed<Setting>("$110=500.000").number, 110);
  EXPECT_EQ(Parsed<Setting>("$110=500.000").value, 500);
  // Before 1.1, and from some senders' firmware: with a description (arkypita/LaserGRBL#317).
  EXPECT_EQ(Parsed<Setting>("$110=7650.000 (x max rate, mm/min)").value, 7650);
  for (const char* line : {"$N0=G54", "$=1", "$1=", "$1=abc", "$-1=2", "$1=nan", "$1=inf", "$"})
    Parsed<Other>(line);
}

// interface.md, and lines other people recorded: gnea/grbl#376 and #757, the README of the npm
// package grbl-parser, a notebook with a machine's log.
TEST(GrblMessage, StatusReports) {
  const auto hold = Parsed<Status>(
      "<Hold:0|MPos:0.000,0.000,0.000|Bf:15,128|FS:675.5,24000|Ov:120,100,100|WCO:0.000,-5.200,"
      "306.351|A:SFM>");
  EXPECT_EQ(hold.state, State::kHold);
  EXPECT_EQ(hold.substate, 0);
  EXPECT_THAT(*hold.work_offset, ElementsAre(0, -5.2, 306.351));
  const auto logged =
      Parsed<Status>("<Hold:1|MPos:-128.925,0.000,0.800|Bf:15,125|FS:0,0|WCO:0.000,0.000,0.000>");
  EXPECT_EQ(logged.substate, 1);
  EXPECT_THAT(logged.position, ElementsAre(-128.925, 0, 0.8));
  const auto locked = Parsed<Status>("<Alarm|WPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>");
  EXPECT_EQ(locked.state, State::kAlarm);
  EXPECT_TRUE(locked.work_position);
  const auto pins = Parsed<Status>("<Idle|MPos:10.172,14.476,3.000|FS:0,0|Pn:PXYZRHS>");
  EXPECT_EQ(pins.pins, "PXYZRHS");
  EXPECT_FALSE(pins.work_position);
  EXPECT_FALSE(pins.work_offset);
  EXPECT_THAT(Parsed<Status>("<Alarm:3|MPos:10.172,14.476,3.000|FS:0,0>").substate, 3);
  EXPECT_THAT(Parsed<Status>("<Run|MPos:1,2,3,4|FS:1,0>").position, ElementsAre(1, 2, 3));
}

// A damaged report is no report: a wrong position would be worse than none.
TEST(GrblMessage, DamagedReportsAreRefused) {
  for (const char* line :
       {"<Idle|MPos:0.000,0.000|FS:0,0>", "<Idle|MPos:0.000,0.0f0,0.000|FS:0,0>",
        "<Idle|MPos:,,|FS:0,0>", "<Idle|FS:0,0>", "<Idel|MPos:0,0,0>", "<|MPos:0,0,0>",
        "<Idle:x|MPos:0,0,0>", "<Idle|MPos:nan,0,0>", "<Idle|MPos:0,0,0|WCO:0,0>",
        "<Idle|MPos:0.000,0.000,0.000|FS:0,0", "Idle|MPos:0,0,0>", "<Idle|MPos:1e999,0,0>"})
    Parsed<Other>(line);
}

TEST(GrblMessage, EveryDocumentedCodeHasAMeaningAndARemedy) {
  for (const char* firmware : {"Grbl", "grblHAL", "FluidNC"})
    for (int code = 1; code <= 9; ++code) {
      EXPECT_THAT(std::string(AlarmMeaning(code, firmware).problem),
                  testing::Not(testing::HasSubstr("no known")));
      EXPECT_FALSE(AlarmMeaning(code, firmware).remedy.empty());
    }
  // From 10 on a number means another thing to each.
  EXPECT_EQ(AlarmMeaning(11, "grblHAL").fault, Fault::kNotHomed);
  EXPECT_EQ(AlarmMeaning(11, "FluidNC").fault, Fault::kStopped);
  EXPECT_EQ(AlarmMeaning(14, "grblHAL").fault, Fault::kStopped);
  EXPECT_EQ(AlarmMeaning(14, "FluidNC").fault, Fault::kNotHomed);
  EXPECT_EQ(ErrorMeaning(9).fault, Fault::kNotHomed);
  EXPECT_FALSE(AlarmMeaning(98, "Grbl").remedy.empty());
  EXPECT_FALSE(ErrorMeaning(79).remedy.empty());
}

TEST(GrblMessage, SurvivesASampleOfFuzzing) {
  fuzz::Seeded(fuzz::GrblMessage,
               {"<Hold:0|MPos:-128.925,0.000,0.800|Bf:15,125|FS:0,0|WCO:0.000,0.000,0.000>\r\n",
                "ok\nerror:9\nALARM:1\n[MSG:Reset to continue]\n", "$110=500.000\n",
                "Grbl 1.1h ['$' for help]\n>G54:ok\n", "GrblHAL 1.1f ['$' or '$HELP' for help]\n",
                "Grbl 3.9 [FluidNC v3.9.1 (esp32-wifi) '$' for help]\n"});
}

}  // namespace
}  // namespace luxfield::hal::grbl
