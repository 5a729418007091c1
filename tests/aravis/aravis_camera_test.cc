// The driver against aravis' own GigE Vision camera, over UDP on the loopback interface.
#include "luxfield/hal/drivers/aravis/aravis_camera.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <vector>

#include "luxfield/hal/error.h"
#include "tests/aravis/camera_answers.h"
#include "tests/fakes/line_input.h"
#include "tests/hal/error_of.h"

extern char** environ;

namespace {
// Answers of the camera's control channel: how many to written registers are lost, and which one to
// a register that is read, from 0, comes with that bit of its value flipped.
std::atomic<int> writes_unanswered = 0;
constexpr int kNone = -1;
std::atomic<int> damaged_reading = kNone;
std::atomic<unsigned> damaged_bit = 0;

// Commands begin with this; what cameras send does not (GigE Vision 2.0, 14.1 and 24).
constexpr unsigned char kCommand = 0x42;
bool IsOfACamera(const msghdr& message) {
  return message.msg_iovlen > 0 && message.msg_iov[0].iov_len > 0 &&
         *static_cast<const unsigned char*>(message.msg_iov[0].iov_base) != kCommand;
}
std::size_t SizeOf(const msghdr& message) {
  std::size_t size = 0;
  for (std::size_t k = 0; k < message.msg_iovlen; ++k) size += message.msg_iov[k].iov_len;
  return size;
}

enum Answer { kReadRegister = 0x0081, kWriteRegister = 0x0083 };  // of GVCP, after the status
bool Is(Answer answer, const msghdr& message) {
  if (message.msg_iovlen != 1 || message.msg_iov[0].iov_len < 8) return false;
  const auto* bytes = static_cast<const unsigned char*>(message.msg_iov[0].iov_base);
  return (bytes[2] << 8 | bytes[3]) == answer;
}
}  // namespace

std::atomic<bool> luxfield::hal::aravis::cameras_are_mute = false;

// Stands before the system's for all that this program sends.
extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  if (luxfield::hal::aravis::cameras_are_mute && IsOfACamera(*message))
    return static_cast<ssize_t>(SizeOf(*message));
  if (writes_unanswered > 0 && Is(kWriteRegister, *message)) {
    --writes_unanswered;
    return static_cast<ssize_t>(message->msg_iov[0].iov_len);
  }
  constexpr std::size_t kHead = 8, kRegister = 4;  // big-endian
  if (damaged_reading > kNone && Is(kReadRegister, *message) && damaged_reading-- == 0 &&
      message->msg_iov[0].iov_len == kHead + kRegister)
    static_cast<char*>(message->msg_iov[0].iov_base)[kHead + 3 - damaged_bit / 8] ^=
        static_cast<char>(1u << damaged_bit % 8);
  return syscall(SYS_sendmsg, socket, message, flags);
}

namespace luxfield::hal::aravis {
namespace {

using testing::HasSubstr;

// DN of a pixel at an exposure in microseconds: a ramp along the row, whole numbers throughout.
unsigned Ramp(std::size_t column, guint32 exposure_us) {
  return static_cast<unsigned>(column + exposure_us / 4);
}

void Fill(ArvBuffer* buffer, void*, guint32 exposure_us, guint32, ArvPixelFormat format) {
  // Within the callback the buffer does not know its size yet.
  std::size_t size = 0;
  auto* out = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const auto width = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)),
             height = static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
  for (std::size_t p = 0; p < width * height; ++p) {
    const unsigned dn = Ramp(p % width, exposure_us);
    if (format == ARV_PIXEL_FORMAT_MONO_16) {
      out[2 * p] = static_cast<std::uint8_t>(dn);
      out[2 * p + 1] = static_cast<std::uint8_t>(dn >> 8);
    } else {
      out[p] = static_cast<std::uint8_t>(dn);
    }
  }
}

// Of the bootstrap registers.
constexpr guint32 kModelName = 0x0068, kDeviceVersion = 0x0088;

class Aravis : public testing::Test {
 protected:
  // In this process, so that the pixels are ours.
  void StartServer() {
    server_ = arv_gv_fake_camera_new("127.0.0.1", "LUX1");
    ASSERT_TRUE(server_ && arv_gv_fake_camera_is_running(server_));
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(server_), Fill, nullptr);
  }
  // In a process of its own, so that it can lose packets and be killed.
  void StartForeignServer(int lost_per_thousand) {
    const std::string lost = std::to_string(lost_per_thousand);
    const char* arguments[] = {
        "arv-fake-gv-camera-0.8", "-i", "127.0.0.1", "-s", "LUX1", "-r", lost.c_str(), nullptr};
    if (posix_spawnp(&foreign_, arguments[0], nullptr, nullptr, const_cast<char* const*>(arguments),
                     environ) != 0)
      GTEST_SKIP() << "arv-fake-gv-camera-0.8 (package aravis-tools) is not installed";
  }
  void TearDown() override {
    if (server_) g_object_unref(server_);
    if (foreign_ > 0) {
      kill(foreign_, SIGKILL);
      waitpid(foreign_, nullptr, 0);
    }
  }
  AravisOptions Options() const {
    AravisOptions options;
    options.id = "Aravis-Fake-LUX1";
    options.region = Region{0, 0, 96, 64};
    return options;
  }
  double Soon(double seconds) { return clock_->MonotonicSeconds() + seconds; }
  // The foreign server needs a moment until it answers.
  std::unique_ptr<AravisCamera> OpenWhenItAnswers() {
    const double give_up_s = Soon(20);
    for (;;) try {
        return std::make_unique<AravisCamera>(Options(), clock_);
      } catch (const HardwareError&) {
        if (clock_->MonotonicSeconds() > give_up_s) throw;
      }
  }
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
  ArvGvFakeCamera* server_ = nullptr;
  pid_t foreign_ = 0;
};

TEST_F(Aravis, FramesCarryThePixelsOfTheExposureTheyWereAskedWith) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisCamera camera(Options(), clock_);
  EXPECT_THAT(camera.identity(), HasSubstr("LUX1"));
  const CameraCapabilities can = camera.capabilities();
  EXPECT_EQ(can.width, 96);
  EXPECT_EQ(can.height, 64);
  EXPECT_EQ(can.bits, 16);
  std::uint64_t last_id = 0, last_epoch = 0;
  for (const double exposure_s : {0.004, 0.02, 0.001, 0.02}) {
    const AppliedSettings applied = camera.Configure({exposure_s}, Soon(10));
    EXPECT_NEAR(applied.exposure_s, exposure_s, 1e-6);
    EXPECT_GT(applied.settings_epoch, std::exchange(last_epoch, applied.settings_epoch));
    for (int repeat = 0; repeat < 2; ++repeat) {
      const double asked_s = clock_->MonotonicSeconds();
      const Frame frame = camera.Expose(Soon(10));
      EXPECT_GT(frame.frame_id, std::exchange(last_id, frame.frame_id));
      EXPECT_GE(frame.t_start_s, asked_s);
      EXPECT_TRUE(std::isnan(frame.temperature_c) || std::abs(frame.temperature_c) < 100);
      ASSERT_EQ(frame.image.size(), 96u * 64u);
      const auto us = static_cast<guint32>(std::lround(1e6 * exposure_s));
      for (std::size_t p = 0; p < frame.image.size(); ++p)
        ASSERT_EQ(frame.image.dn[p], Ramp(p % 96, us)) << p;
    }
  }
}

TEST_F(Aravis, EightBitsAsWell) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisOptions options = Options();
  options.pixel_format = "Mono8";
  AravisCamera camera(options, clock_);
  EXPECT_EQ(camera.capabilities().bits, 8);
  camera.Configure({100e-6}, Soon(10));
  EXPECT_EQ(camera.Expose(Soon(10)).image.dn[7], Ramp(7, 100));
}

// A line to the camera's Line0, which notes what edges found there.
class Wire : public Trigger {
 public:
  explicit Wire(ArvGvFakeCamera* server) : camera_(arv_gv_fake_camera_get_fake_camera(server)) {}
  std::string identity() const override { return "wire"; }
  void Pulse(double) override { answered.push_back(!cut && fakes::RaiseLine0(camera_)); }

  bool cut = false;
  std::vector<bool> answered;

 private:
  ArvFakeCamera* camera_;
};

TEST_F(Aravis, ALineTriggersACameraThatIsArmed) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  const auto wire = std::make_shared<Wire>(server_);
  wire->Pulse(0);
  EXPECT_THAT(wire->answered, testing::ElementsAre(false)) << "nobody has armed it yet";
  AravisOptions options = Options();
  options.line_trigger = LineTrigger{"Line0"};
  AravisCamera camera(options, clock_, wire);
  EXPECT_EQ(wire->answered.size(), 1u) << "opening gives no pulse";
  camera.Configure({0.002}, Soon(10));
  for (std::size_t frames = 1; frames <= 3; ++frames) {
    const double asked_s = clock_->MonotonicSeconds();
    const Frame frame = camera.Expose(Soon(10));
    EXPECT_GE(frame.t_start_s, asked_s);
    EXPECT_EQ(frame.image.dn[7], Ramp(7, 2000));
    ASSERT_EQ(wire->answered.size(), 1 + frames) << "one edge, one frame";
    EXPECT_TRUE(wire->answered.back());
  }
  // A wire that is cut, and mended.
  wire->cut = true;
  const HardwareError error = ErrorOf([&] { camera.Expose(Soon(0.3)); });
  EXPECT_EQ(error.fault, Fault::kTimeout);
  EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("wire"), HasSubstr("camera.trigger_source")));
  wire->cut = false;
  EXPECT_EQ(camera.Expose(Soon(10)).image.dn[7], Ramp(7, 2000));
}

TEST_F(Aravis, ATriggerThatItDoesNotHaveIsRefused) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  const auto wire = std::make_shared<Wire>(server_);
  AravisOptions options = Options();
  for (const LineTrigger& trigger : {LineTrigger{"Line9"}, LineTrigger{"Line0", "FallingEdge"}}) {
    options.line_trigger = trigger;
    const HardwareError error = ErrorOf([&] { AravisCamera(options, clock_, wire); });
    EXPECT_EQ(error.fault, Fault::kRefused) << error.what();
  }
  options.line_trigger = LineTrigger{"Line0"};
  EXPECT_THAT(ErrorOf([&] { AravisCamera(options, clock_); }).what(),
              HasSubstr("line that is to trigger it"));
}

// Pixels that tell what the camera was set to: the ramp from the region's place on the sensor, plus
// the gain.
void FillAsSet(ArvBuffer* buffer, void*, guint32, guint32 gain, ArvPixelFormat) {
  std::size_t size = 0;
  auto* out = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
  const auto width = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)),
             height = static_cast<std::size_t>(arv_buffer_get_image_height(buffer)),
             x = static_cast<std::size_t>(arv_buffer_get_image_x(buffer)),
             y = static_cast<std::size_t>(arv_buffer_get_image_y(buffer));
  for (std::size_t p = 0; p < width * height; ++p)
    out[p] = static_cast<std::uint8_t>(x + p % width + 2 * (y + p / width) + gain);
}

// Gain, region and mosaic reach the camera, not only its registers' read-back.
TEST_F(Aravis, FramesAreOfTheGainRegionAndMosaicThatWereAskedFor) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(server_), FillAsSet, nullptr);
  constexpr int kX = 33, kY = 18, kWidth = 31, kHeight = 20;
  for (const char* format : {"Mono8", "BayerRG8"})
    for (const double gain_db : {7.0, 3.0, 0.0}) {
      SCOPED_TRACE(fmt::format("{}, {} dB", format, gain_db));
      AravisOptions options = Options();
      options.pixel_format = format;
      options.gain_db = gain_db;
      options.region = Region{kX, kY, kWidth, kHeight};
      AravisCamera camera(options, clock_);
      EXPECT_EQ(camera.capabilities().width, kWidth);
      EXPECT_EQ(camera.capabilities().height, kHeight);
      camera.Configure({0.001}, Soon(10));
      const session::RawFrame image = camera.Expose(Soon(10)).image;
      ASSERT_EQ(image.width, kWidth);
      ASSERT_EQ(image.dn.size(), std::size_t{kWidth} * kHeight);
      for (int row = 0; row < kHeight; ++row)
        for (int column = 0; column < kWidth; ++column)
          ASSERT_EQ(image.dn[static_cast<std::size_t>(row * kWidth + column)],
                    kX + column + 2 * (kY + row) + gain_db)
              << column << ", " << row;
    }
}

TEST_F(Aravis, WhatTheCameraCannotDoIsRefusedBeforeItIsAsked) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisOptions format = Options(), region = Options(), gain = Options();
  format.pixel_format = "Mono24";
  EXPECT_THAT(ErrorOf([&] { AravisCamera(format, clock_); }).what(), HasSubstr("Mono12Packed"));
  region.region = Region{4000, 0, 96, 64};
  EXPECT_EQ(ErrorOf([&] { AravisCamera(region, clock_); }).fault, Fault::kOutOfRange);
  gain.gain_db = 1e6;
  EXPECT_EQ(ErrorOf([&] { AravisCamera(gain, clock_); }).fault, Fault::kOutOfRange);
  AravisCamera camera(Options(), clock_);
  // The fake camera would take it, its stated bounds notwithstanding.
  const CameraCapabilities can = camera.capabilities();
  EXPECT_EQ(ErrorOf([&] { camera.Configure({2 * can.max_exposure_s}, Soon(10)); }).fault,
            Fault::kOutOfRange);
  EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(10)); }).fault, Fault::kRefused);
}

TEST_F(Aravis, ANameThatIsNoTextIsShownWithoutItsBytes) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  const std::string model = "\xd2\xb9\x1b[31m";
  arv_fake_camera_write_memory(arv_gv_fake_camera_get_fake_camera(server_), kModelName,
                               static_cast<guint32>(model.size()), model.data());
  AravisOptions options = Options();
  options.id.clear();  // its id has the name too
  const AravisCamera camera(options, clock_);
  EXPECT_THAT(camera.identity(), HasSubstr(" ???[31m "));
}

// The fake camera's description lacks the feature of the firmware, as those of older cameras do.
TEST_F(Aravis, TheCameraTellsItsVersionAndWhatItCanBeSetTo) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  ArvFakeCamera* fake = arv_gv_fake_camera_get_fake_camera(server_);
  std::array<char, 32> version{};
  ASSERT_TRUE(arv_fake_camera_write_memory(fake, kDeviceVersion, version.size(), version.data()));
  EXPECT_EQ(AravisCamera(Options(), clock_).firmware(), "");
  const std::string text = "2.7\x1b";
  std::copy(text.begin(), text.end(), version.begin());
  ASSERT_TRUE(arv_fake_camera_write_memory(fake, kDeviceVersion, version.size(), version.data()));
  const AravisCamera camera(Options(), clock_);
  EXPECT_EQ(camera.firmware(), "2.7?");
  const CameraCapabilities can = camera.capabilities();
  EXPECT_EQ(can.min_gain_db, 0);
  EXPECT_EQ(can.max_gain_db, 10);
  EXPECT_THAT(can.choices.at("pixel_format"),
              testing::AllOf(testing::Contains("Mono8"), testing::Contains("Mono16"),
                             testing::Not(testing::Contains("RGB8"))));
}

// Of the fake camera's description: exposures of 10 us to 10 s, in whole microseconds.
TEST_F(Aravis, ExposuresAreStatedInSecondsAndRoundedToWhatTheCameraCountsBy) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisCamera camera(Options(), clock_);
  EXPECT_DOUBLE_EQ(camera.capabilities().min_exposure_s, 10e-6);
  EXPECT_DOUBLE_EQ(camera.capabilities().max_exposure_s, 10);
  EXPECT_DOUBLE_EQ(camera.Configure({12.4e-6}, Soon(10)).exposure_s, 12e-6);
}

TEST_F(Aravis, AGainThatTheCameraSetsByItselfIsTurnedOff) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  constexpr guint32 kGainAuto = ARV_FAKE_CAMERA_REGISTER_GAIN_MODE, kOff = 1, kContinuous = 2;
  ArvFakeCamera* fake = arv_gv_fake_camera_get_fake_camera(server_);
  ASSERT_TRUE(arv_fake_camera_write_register(fake, kGainAuto, kContinuous));
  const AravisCamera camera(Options(), clock_);
  guint32 gain_auto = 0;
  ASSERT_TRUE(arv_fake_camera_read_register(fake, kGainAuto, &gain_auto));
  EXPECT_EQ(gain_auto, kOff);
}

TEST_F(Aravis, NoFrameByTheDeadlineIsATimeout) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisCamera camera(Options(), clock_);
  camera.Configure({0.02}, Soon(10));
  EXPECT_EQ(ErrorOf([&] { camera.Expose(Soon(0.001)); }).fault, Fault::kTimeout);
}

TEST_F(Aravis, ACameraThatIsNotThereIsDisconnected) {
  AravisOptions options = Options();
  options.id = "Aravis-Fake-NOBODY";
  const HardwareError error = ErrorOf([&] { AravisCamera(options, clock_); });
  EXPECT_EQ(error.fault, Fault::kDisconnected);
  // Nor does aravis find one on USB that it may not open.
  EXPECT_THAT(error.what(), HasSubstr("group plugdev"));
}

TEST_F(Aravis, ACameraThatAnotherProgramControlsIsRefused) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisCamera camera(Options(), clock_);
  const HardwareError error = ErrorOf([&] { AravisCamera(Options(), clock_); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(), HasSubstr("another program controls it"));
  camera.Configure({0.002}, Soon(10));
  EXPECT_EQ(camera.Expose(Soon(10)).image.size(), 96u * 64u) << "it is not disturbed";
}

TEST_F(Aravis, LostPacketsNeverMakeAWrongFrame) {
  ASSERT_NO_FATAL_FAILURE(StartForeignServer(40));
  const auto camera = OpenWhenItAnswers();
  camera->Configure({0.002}, Soon(10));
  int whole = 0, incomplete = 0;
  for (int k = 0; k < 20; ++k) try {
      const Frame frame = camera->Expose(Soon(20));
      ++whole;
      ASSERT_EQ(frame.image.size(), 96u * 64u);
      // The foreign camera's pattern is constant along diagonals; a hole would not be.
      for (std::size_t row = 0; row + 1 < 64; ++row)
        for (std::size_t column = 1; column < 96; ++column)
          ASSERT_EQ(frame.image.dn[row * 96 + column], frame.image.dn[(row + 1) * 96 + column - 1]);
    } catch (const HardwareError& error) {
      ASSERT_TRUE(error.fault == Fault::kIncomplete || error.fault == Fault::kTimeout)
          << error.what();
      ++incomplete;
    }
  fmt::print("{} whole frames, {} incomplete ones at 4 % of packets lost\n", whole, incomplete);
  EXPECT_GT(whole, 0);
}

// Where a camera is told the port that its packets go to (GigE Vision 1.2, bootstrap register
// SCP0).
constexpr guint32 kStreamPort = 0x0d00;
// Bytes of an image's leader, and where aravis' camera begins to count its frames.
constexpr std::size_t kLeaderSize = 44;
constexpr std::uint16_t kFakeCamerasFirstFrame = 65401;
enum Content : std::uint8_t { kLeader = 1, kTrailer = 2, kPayload = 3 };

// Sends datagrams of GVSP to where the camera sends its own.
class Forger {
 public:
  explicit Forger(ArvGvFakeCamera* server) : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    guint32 port = 0;
    ArvFakeCamera* camera = arv_gv_fake_camera_get_fake_camera(server);
    arv_fake_camera_read_register(camera, kStreamPort, &port);
    to_.sin_family = AF_INET;
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to_.sin_port = htons(static_cast<std::uint16_t>(port));
  }
  ~Forger() { close(socket_); }
  Forger(const Forger&) = delete;
  Forger& operator=(const Forger&) = delete;

  // A packet of so many bytes, header included.
  void Send(std::uint16_t frame, Content content, std::uint16_t packet, std::size_t size) const {
    std::vector<std::uint8_t> bytes(std::max<std::size_t>(size, 8), 0xee);
    const std::array<int, 8> head = {0, 0, frame >> 8, frame, content, 0, packet >> 8, packet};
    for (std::size_t k = 0; k < head.size(); ++k) bytes[k] = static_cast<std::uint8_t>(head[k]);
    ASSERT_EQ(
        sendto(socket_, bytes.data(), size, 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_),
        static_cast<ssize_t>(size));
  }

 private:
  int socket_;
  sockaddr_in to_{};
};

// aravis would copy what an earlier frame has left where it receives, or beyond its buffer.
TEST_F(Aravis, DamagedPacketsNeitherCorruptMemoryNorPassForPixels) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  AravisCamera camera(Options(), clock_);
  const Forger forger(server_);
  const auto expect_whole = [&](double exposure_s) {
    camera.Configure({exposure_s}, Soon(10));
    const Frame frame = camera.Expose(Soon(10));
    const auto us = static_cast<guint32>(std::lround(1e6 * exposure_s));
    ASSERT_EQ(frame.image.size(), 96u * 64u);
    for (std::size_t p = 0; p < frame.image.size(); ++p)
      ASSERT_EQ(frame.image.dn[p], Ramp(p % 96, us)) << p;
  };
  std::uint16_t frame = kFakeCamerasFirstFrame;
  const auto expect_whole_after = [&](Content content, std::uint16_t packet, std::size_t size) {
    SCOPED_TRACE(fmt::format("content {}, packet {}, {} bytes", content, packet, size));
    for (const double exposure_s : {0.001, 0.002}) {
      forger.Send(frame++, content, packet, size);
      expect_whole(exposure_s);
    }
  };
  for (const std::size_t size : {0, 4, 5, 7, 8, 500})
    for (const std::uint16_t packet : std::array<std::uint16_t, 3>{0, 1, 4}) {
      expect_whole_after(kPayload, packet, size);
      expect_whole_after(kTrailer, packet, size);
      if (packet != 0 || size < kLeaderSize) expect_whole_after(kLeader, packet, size);
    }
}

// aravis gives the trigger again when its answer does not come, and the camera exposes twice: the
// second frame is no answer to the next trigger.
TEST_F(Aravis, ASecondFrameOfARepeatedTriggerIsNotTakenForTheNext) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  std::atomic<int> exposures = 0;
  arv_fake_camera_set_fill_pattern(
      arv_gv_fake_camera_get_fake_camera(server_),
      [](ArvBuffer* buffer, void* count, guint32, guint32, ArvPixelFormat) {
        std::size_t size = 0;
        auto* out = static_cast<char*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
        std::memset(out, ++*static_cast<std::atomic<int>*>(count), 2 * 96 * 64);
      },
      &exposures);
  AravisCamera camera(Options(), clock_);
  camera.Configure({0.001}, Soon(10));
  EXPECT_EQ(camera.Expose(Soon(10)).image.dn[0] & 0xff, 1);
  writes_unanswered = 1;
  const HardwareError error = ErrorOf([&] { camera.Expose(Soon(10)); });
  EXPECT_EQ(error.fault, Fault::kIncomplete);
  EXPECT_THAT(error.what(), HasSubstr("may have exposed twice"));
  const int taken = camera.Expose(Soon(10)).image.dn[0] & 0xff;
  EXPECT_EQ(exposures, 4);
  EXPECT_EQ(taken, 4);
}

// Of all that is read to open the camera and to expose, one answer: an error, or frames as ever.
TEST_F(Aravis, NoDamagedAnswerIsBelieved) {
  ASSERT_NO_FATAL_FAILURE(StartServer());
  constexpr double kExposure_s = 0.0625;
  int errors = 0;
  for (const unsigned bit : {3u, 9u, 17u}) {
    damaged_reading = kNone;
    for (int reading = 0; damaged_reading == kNone; ++reading) {
      SCOPED_TRACE(fmt::format("bit {} of reading {}", bit, reading));
      ASSERT_LT(reading, 1000);
      damaged_bit = bit;
      damaged_reading = reading;
      try {
        AravisCamera camera(Options(), clock_);
        EXPECT_EQ(camera.capabilities().width, 96);
        EXPECT_EQ(camera.capabilities().height, 64);
        EXPECT_NEAR(camera.Configure({kExposure_s}, Soon(10)).exposure_s, kExposure_s, 1e-6);
        const Frame frame = camera.Expose(Soon(1));
        ASSERT_EQ(frame.image.size(), 96u * 64u);
        for (std::size_t p = 0; p < frame.image.size(); ++p)
          ASSERT_EQ(frame.image.dn[p], Ramp(p % 96, 62500)) << p;
      } catch (const HardwareError& error) {
        EXPECT_THAT(error.what(), HasSubstr("; ")) << "names no remedy";
        ++errors;
      }
    }
  }
  EXPECT_GT(errors, 0) << "nothing was damaged";
  damaged_reading = kNone;
}

// The library would end the program by a signal.
TEST_F(Aravis, WithoutDescriptorsNoSearchBegins) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  const int next = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(next, 0);
  ::close(next);
  rlimit few = limit;
  few.rlim_cur = static_cast<rlim_t>(next) + 5;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  const std::string search = ErrorOf([&] { ListAravisDevices(); }).what(),
                    open = ErrorOf([&] { AravisCamera({}, clock_); }).what();
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  for (const std::string& sentence : {search, open})
    EXPECT_THAT(sentence,
                HasSubstr("file descriptors are left, a search takes up to 32 (refused); raise"));
}

TEST_F(Aravis, AKilledCameraEndsByTheDeadline) {
  ASSERT_NO_FATAL_FAILURE(StartForeignServer(0));
  const auto camera = OpenWhenItAnswers();
  camera->Configure({0.002}, Soon(10));
  EXPECT_EQ(camera->Expose(Soon(10)).image.size(), 96u * 64u);
  kill(foreign_, SIGKILL);
  const double begin_s = clock_->MonotonicSeconds();
  const HardwareError error = ErrorOf([&] { camera->Expose(begin_s + 1.5); });
  EXPECT_TRUE(error.fault == Fault::kTimeout || error.fault == Fault::kDisconnected)
      << error.what();
  EXPECT_THAT(error.what(), HasSubstr("LUX1"));
  // A second of grace: what is to be shown is that it ends, on a machine that is busy.
  EXPECT_LT(clock_->MonotonicSeconds(), begin_s + 2.5);
}

}  // namespace
}  // namespace luxfield::hal::aravis
