#include "luxfield/hal/drivers/gpiod/gpio_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "luxfield/hal/error.h"
#include "tests/gpiod/fake_gpio_chip.h"
#include "tests/hal/error_of.h"
#include "tests/hal/fewer_rights.h"

namespace luxfield::hal::gpiod {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class GpioLines : public testing::Test {
 protected:
  FakeGpioChip chip_{{"shutter", "lamp", "stop", "door"}};
};

bool Readable(int fd) {
  pollfd ready{fd, POLLIN, 0};
  return poll(&ready, 1, 0) == 1;
}

TEST_F(GpioLines, ReadsLevelsByNameAndByOffset) {
  chip_.SetPin("door", true);
  const InputLines lines("gpiochip0", {{"stop"}, {"3"}});
  EXPECT_THAT(lines.Levels(), ElementsAre(false, true));
  chip_.SetPin("stop", true);
  chip_.SetPin("door", false);
  EXPECT_THAT(lines.Levels(), ElementsAre(true, false));
}

TEST_F(GpioLines, ActiveLowInvertsInputsAndOutputs) {
  const InputLines lines("gpiochip0", {{"stop", true}});
  EXPECT_THAT(lines.Levels(), ElementsAre(true));
  OutputLine lamp("gpiochip0", {"lamp", true}, false);
  EXPECT_TRUE(chip_.Pin("lamp"));
  EXPECT_FALSE(lamp.Get());
  lamp.Set(true);
  EXPECT_FALSE(chip_.Pin("lamp"));
  EXPECT_TRUE(lamp.Get());
}

TEST_F(GpioLines, EdgesWakeAndMoreOfThemThanTheQueueHoldsLoseNoLevel) {
  InputLines lines("gpiochip0", {{"stop"}});
  const int fd = lines.edge_fds().at(0);
  EXPECT_FALSE(Readable(fd));
  for (int k = 0; k < 41; ++k) chip_.SetPin("stop", k % 2 == 0);
  EXPECT_TRUE(Readable(fd));
  lines.DrainEdges();
  EXPECT_FALSE(Readable(fd));
  EXPECT_THAT(lines.Levels(), ElementsAre(true));
}

TEST_F(GpioLines, OutputsBeginAsAskedAndReadBack) {
  OutputLine shutter(FakeGpioChip::kPath, {"shutter"}, true);
  EXPECT_TRUE(chip_.Pin("shutter"));
  shutter.Set(false);
  EXPECT_THAT(chip_.History("shutter"), ElementsAre(true, false));
  EXPECT_FALSE(shutter.Get());
}

TEST_F(GpioLines, RefusalsSayWhyAndWhatToDo) {
  chip_.HoldElsewhere("stop");
  const HardwareError busy = ErrorOf([] { InputLines("gpiochip0", {{"stop"}}); });
  EXPECT_EQ(busy.fault, Fault::kRefused);
  EXPECT_THAT(busy.what(), HasSubstr("request input line"));
  EXPECT_THAT(busy.what(), HasSubstr("line stop is held by \"gpiomon\""));
  EXPECT_THAT(busy.what(), HasSubstr("end the program that holds the line"));
  const HardwareError missing = ErrorOf([] { InputLines("gpiochip0", {{"stopp"}}); });
  EXPECT_THAT(missing.what(), HasSubstr("choose one of shutter, lamp, stop, door"));
  const HardwareError offset = ErrorOf([] { OutputLine("gpiochip0", {"4"}, false); });
  EXPECT_THAT(offset.what(), HasSubstr("no such line"));
  const HardwareError gone = ErrorOf([] { InputLines("gpiochip7", {{"stop"}}); });
  EXPECT_EQ(gone.fault, Fault::kDisconnected);
  EXPECT_THAT(gone.what(), HasSubstr("/dev/gpiochip7"));
}

TEST_F(GpioLines, AChipOfOthersIsRefusedWithTheGroupToJoin) {
  const Forbidden node(FakeGpioChip::kPath);
  const HardwareError error = ErrorOf([] { InputLines("gpiochip0", {{"stop"}}); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(),
              testing::AllOf(HasSubstr("/dev/gpiochip0"), HasSubstr("group gpio"),
                             HasSubstr("udev rule"), HasSubstr("docs/how-to/permissions.md")));
}

TEST_F(GpioLines, AChipThatGoesAwayIsDisconnected) {
  const InputLines lines("gpiochip0", {{"stop"}});
  chip_.FailReads(ENODEV);
  EXPECT_EQ(ErrorOf([&] { lines.Levels(); }).fault, Fault::kDisconnected);
}

}  // namespace
}  // namespace luxfield::hal::gpiod
