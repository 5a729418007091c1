#include "luxfield/hal/drivers/gphoto2/decoder_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "luxfield/hal/error.h"
#include "tests/fakes/dng.h"

namespace luxfield::hal::gphoto2 {
namespace {

using testing::HasSubstr;

constexpr std::size_t kMostPixels = 1 << 10;
constexpr double kAmple_s = 60;

RawFile Picture(int width, int height) {
  RawFile file;
  file.image.width = width;
  file.image.height = height;
  for (std::size_t k = 0; k < file.image.size(); ++k)
    file.image.dn.push_back(static_cast<std::uint16_t>(40503 * k));
  file.cfa = "GBRG";
  file.exposure_s = 0.125;
  file.temperature_c = std::numeric_limits<double>::quiet_NaN();
  return file;
}

// What DecodeApart says of a child that does this.
std::string ErrorOf(const std::function<void()>& act, double within_s = kAmple_s) {
  try {
    DecodeApart(
        [&] {
          act();
          return Picture(2, 2);
        },
        "camera", kMostPixels, within_s);
  } catch (const HardwareError& error) {
    EXPECT_EQ(error.device, "camera");
    EXPECT_EQ(error.fault, Fault::kIncomplete) << error.what();
    return error.what();
  }
  return "";
}

TEST(DecoderProcess, AnswersWithThePicture) {
  const RawFile wanted = Picture(31, 33);
  const RawFile got = DecodeApart([&] { return wanted; }, "camera", kMostPixels, kAmple_s);
  EXPECT_EQ(got.image.width, 31);
  EXPECT_EQ(got.image.height, 33);
  EXPECT_EQ(got.image.dn, wanted.image.dn);
  EXPECT_EQ(got.cfa, wanted.cfa);
  EXPECT_EQ(got.exposure_s, wanted.exposure_s);
  EXPECT_TRUE(std::isnan(got.temperature_c));
}

TEST(DecoderProcess, AnswersWithTheDecodersError) {
  const HardwareError wanted(Fault::kProtocol, "camera", "read RAW", "it is a JPEG",
                             std::string(200, '.') + "set it");
  try {
    DecodeApart([&]() -> RawFile { throw wanted; }, "camera", kMostPixels, kAmple_s);
    FAIL();
  } catch (const HardwareError& error) {
    EXPECT_STREQ(error.what(), wanted.what());
    EXPECT_EQ(error.fault, wanted.fault);
  }
}

TEST(DecoderProcess, ADecoderThatDiesTakesNothingWithIt) {
  EXPECT_THAT(ErrorOf([] { std::abort(); }), HasSubstr("signal 6"));
  EXPECT_THAT(ErrorOf([] { std::raise(SIGSEGV); }), HasSubstr("signal 11"));
  EXPECT_THAT(ErrorOf([] { std::_Exit(0); }), HasSubstr("no answer"));
  EXPECT_THAT(ErrorOf([] { throw std::runtime_error("not ours"); }), HasSubstr("no answer"));
}

TEST(DecoderProcess, ADecoderThatHangsIsEndedAtTheDeadline) {
  EXPECT_THAT(ErrorOf(
                  [] {
                    for (;;) ::pause();
                  },
                  0.05),
              HasSubstr("not read within"));
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST(DecoderProcess, MorePixelsThanAskedForAreNoAnswer) {
  const auto decode = [](int width) { return [width] { return Picture(width, 32); }; };
  EXPECT_NO_THROW(DecodeApart(decode(32), "camera", kMostPixels, kAmple_s));
  EXPECT_THROW(DecodeApart(decode(33), "camera", kMostPixels, kAmple_s), HardwareError);
}

TEST(DecoderProcess, HoldsNothingThatTheProgramHasOpen) {
  const int first = ::open("/dev/null", O_RDONLY);
  const int held = ::fcntl(first, F_DUPFD, 10);
  const auto closed = [&] {
    if (::fcntl(held, F_GETFD) != -1) throw HardwareError(Fault::kRefused, "", "", "open", "");
    return Picture(1, 1);
  };
  EXPECT_NO_THROW(DecodeApart(closed, "camera", kMostPixels, kAmple_s));
  ::close(held);
  ::close(first);
}

// LibRaw 0.20.2 writes make and model into 64 bytes.
TEST(DecoderProcess, TextsLongerThanLibRawsBuffersLeaveTheProgramAlone) {
  fakes::Negative negative{26, 24, std::vector<std::uint16_t>(26 * 24, 900), "RGGB", 0.1};
  negative.make = "Hasselblad";
  negative.model = std::string(60, 'H');
  const std::string file = fakes::EncodeDng(negative);
  try {
    const RawFile raw = DecodeApart([&] { return DecodeRawFile(file, "camera", kMostPixels); },
                                    "camera", kMostPixels, kAmple_s);
    EXPECT_EQ(raw.image.dn, negative.dn);
  } catch (const HardwareError& error) {
    EXPECT_THAT(error.what(), HasSubstr("brought its reader down"));
  }
}

}  // namespace
}  // namespace luxfield::hal::gphoto2
