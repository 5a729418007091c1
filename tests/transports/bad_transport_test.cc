// Whole captures over transports that drop, delay, duplicate, truncate, garble and hang: the real
// drivers of stage and instruments in a lab that is simulated otherwise. A capture that fails is
// resumed; what comes of it in the end is the light field of an undisturbed one.
//
//   LUXFIELD_FAULTS=1000 umockdev-wrapper build/release/transports_test
//
// runs 1000 sessions in place of 50.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "luxfield/capture/take/capture.h"
#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/drivers/grbl/grbl_stage.h"
#include "luxfield/hal/drivers/scpi/scpi.h"
#include "luxfield/hal/drivers/usbtmc/usbtmc.h"
#include "luxfield/hal/drivers/zaber/zaber_stage.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/hal/sim/simulated_lab.h"
#include "luxfield/hal/transport/faulty_stream.h"
#include "luxfield/hal/transport/open_port.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "luxfield/reconstruct/solve/reconstruct.h"
#include "luxfield/session/session_store.h"
#include "tests/e2e/field_agreement.h"
#include "tests/e2e/frames_as_seen.h"
#include "tests/e2e/tiny_session.h"
#include "tests/fakes/exposure_log.h"
#include "tests/fakes/grbl_machine.h"
#include "tests/fakes/pty_host.h"
#include "tests/fakes/zaber_chain.h"
#include "tests/usbtmc/fake_instrument.h"
#include "tests/usbtmc/fake_supply.h"

namespace luxfield {
namespace {

namespace fs = std::filesystem;
using hal::Vec2;

constexpr std::uint64_t kSeed = 20261122;
constexpr int kWorkers = 8;      // most of a session is waiting
constexpr double kSpeedUp = 20;  // of the stages
constexpr double kStage_s = 4;   // deadlines, short: the fakes are quick
constexpr double kInstrument_s = 0.3;
// The scatter of chi-squared over that of as many independent values, which those of a pixel are
// not: 400 undisturbed sessions of other noise gave 0.95 +- 0.10, at most 1.34.
constexpr double kCorrelated = 1.45;
constexpr int kDisturbed = 6;  // runs of a session; the next one has a good line

enum class Kind { kDrop, kDelay, kDuplicate, kTruncate, kGarble, kHang };
constexpr std::array kKindNames = {"drop", "delay", "duplicate", "truncate", "garble", "hang"};
enum class Transport { kGrbl, kZaber, kUsbTmc };
constexpr std::array kTransportNames = {"grbl", "zaber", "usbtmc"};

// About one a run: the Zaber driver asks while it waits, and many more bytes pass.
hal::LineFaults LineFaultsOf(Transport transport, Kind kind) {
  const double share = transport == Transport::kZaber ? 0.1 : 1;
  hal::LineFaults faults;
  switch (kind) {
    case Kind::kDrop:
      faults.drop = 5e-4 * share;
      break;
    case Kind::kDelay:
      faults.delay = 0.5;
      faults.longest_delay_s = 0.05;
      break;
    case Kind::kDuplicate:
      faults.duplicate = 5e-4 * share;
      break;
    case Kind::kTruncate:
      faults.truncate = 0.01 * share;
      break;
    case Kind::kGarble:
      faults.garble = 5e-4 * share;
      break;
    case Kind::kHang:
      faults.hang = 0.003 * share;
      break;
  }
  return faults;
}

// A real stage, whose carriage the simulated one follows: wherever it stands, not where the
// controller believes it does.
class FollowedStage : public hal::Stage {
 public:
  using Carriage = std::function<Vec2()>;
  FollowedStage(std::unique_ptr<hal::Stage> real, std::unique_ptr<hal::Stage> simulated,
                Carriage carriage)
      : real_(std::move(real)), simulated_(std::move(simulated)), carriage_(std::move(carriage)) {}

  std::string identity() const override { return real_->identity(); }
  hal::StageLimits limits() const override { return real_->limits(); }
  void Home(double deadline_s) override {
    real_->Home(clock_.MonotonicSeconds() + kStage_s);
    simulated_->Home(deadline_s);
  }
  void MoveTo(Vec2 centre, double deadline_s) override {
    real_->MoveTo(centre, clock_.MonotonicSeconds() + kStage_s);
    simulated_->MoveTo(carriage_(), deadline_s);
  }
  hal::StagePosition Where() override { return real_->Where(); }
  void Stop() override { real_->Stop(); }

 private:
  core::SystemClock clock_;
  std::unique_ptr<hal::Stage> real_, simulated_;
  Carriage carriage_;
};

// The lab's camera, which logs what it saw, and where.
class WatchedCamera : public hal::Camera {
 public:
  // To be put in the place of the simulated lab's, before its stage and supply are replaced;
  // `carriage`: where the filter stands.
  WatchedCamera(hal::Devices& lab, std::function<Vec2()> carriage, fs::path log)
      : camera_(std::move(lab.camera)),
        shutter_(*lab.shutter),
        supply_(*lab.supply),
        carriage_(std::move(carriage)),
        log_(std::move(log)) {}

  std::string identity() const override { return camera_->identity(); }
  hal::CameraCapabilities capabilities() const override { return camera_->capabilities(); }
  hal::AppliedSettings Configure(const hal::CameraSettings& settings, double deadline_s) override {
    return camera_->Configure(settings, deadline_s);
  }
  hal::Frame Expose(double deadline_s) override {
    fakes::SeenExposure seen;
    const Vec2 at = carriage_();
    seen.u_m = at.x;
    seen.v_m = at.y;
    seen.shutter_open = shutter_.Current() == "open";
    seen.lamp = supply_.State().output;
    hal::Frame frame = camera_->Expose(deadline_s);
    seen.exposure_s = frame.settings.exposure_s;
    seen.start_s = frame.t_start_s;
    seen.pixels_sha256 = core::Sha256(session::PixelBytes(frame.image));
    fakes::AppendExposure(log_, seen);
    return frame;
  }
  void Abort() override { camera_->Abort(); }

 private:
  std::unique_ptr<hal::Camera> camera_;
  hal::Selector& shutter_;
  hal::Supply& supply_;
  std::function<Vec2()> carriage_;
  fs::path log_;
};

// A controller on a pseudo terminal, which lives as long as its session.
class StageOnALine {
 public:
  explicit StageOnALine(Transport transport)
      : transport_(transport),
        host_(transport == Transport::kGrbl
                  ? std::unique_ptr<fakes::FakeDevice>(
                        std::make_unique<fakes::GrblMachine>(std::map<int, double>{{110, 6000},
                                                                                   {111, 6000},
                                                                                   {120, 2000},
                                                                                   {121, 2000},
                                                                                   {24, 3000},
                                                                                   {25, 6000},
                                                                                   {26, 5}}))
                  : std::make_unique<fakes::ZaberChain>(true),
              kSpeedUp) {}

  std::unique_ptr<hal::Stage> Open(const hal::LineFaults& faults, std::uint64_t seed,
                                   std::unique_ptr<hal::Stage> simulated) {
    const auto clock = std::make_shared<core::SystemClock>();
    const hal::StageLimits limits = simulated->limits();
    auto line = std::make_unique<hal::FaultyStream>(hal::OpenSerialPort(host_.port(), 115200),
                                                    faults, faults, seed);
    std::unique_ptr<hal::Stage> real;
    if (transport_ == Transport::kGrbl)
      real = std::make_unique<hal::grbl::GrblStage>(
          std::move(line),
          hal::grbl::StageSetup{limits,
                                {hal::grbl::Axis{0, 1, -100}, hal::grbl::Axis{1, -1, -100}}},
          clock);
    else
      real = std::make_unique<hal::zaber::ZaberStage>(
          std::move(line),
          hal::zaber::StageSetup{limits,
                                 {hal::zaber::Axis{1, 1, 1, 0.1, kMicrostep_m},
                                  hal::zaber::Axis{2, 1, -1, 0.1, kMicrostep_m}}},
          clock);
    return std::make_unique<FollowedStage>(std::move(real), std::move(simulated),
                                           [this] { return Carriage(); });
  }

  bool Suffer(std::string_view event) { return host_.Suffer(event); }

  Vec2 Carriage() {
    Vec2 at;
    host_.Inspect([&](fakes::FakeDevice& device) {
      if (const auto* grbl = dynamic_cast<fakes::GrblMachine*>(&device)) {
        const auto& carriage = grbl->motion().carriage();
        at = {1e-3 * (carriage[0] + 100), -1e-3 * (carriage[1] + 100)};
      } else {
        const auto& zaber = dynamic_cast<fakes::ZaberChain&>(device);
        at = {kMicrostep_m * zaber.position(0) - 0.1, 0.1 - kMicrostep_m * zaber.position(1)};
      }
    });
    return at;
  }

 private:
  static constexpr double kMicrostep_m = 5e-8;

  Transport transport_;
  fakes::PtyHost host_;
};

// Supply and light meter on USB: the lamp of the simulated lab is switched with the supply.
class InstrumentsOnUsb {
 public:
  InstrumentsOnUsb()
      : testbed_(umockdev_testbed_new()),
        supply_(testbed_, 1, [this](const std::string& message) { return AnswerSupply(message); }),
        meter_(testbed_, 2, [this](const std::string& message) { return AnswerMeter(message); }) {}
  ~InstrumentsOnUsb() { g_object_unref(testbed_); }

  void Open(Kind kind, bool disturbed, std::uint64_t seed, hal::Devices& devices) {
    lamp_ = std::move(devices.supply);
    const auto clock = devices.clock;
    for (auto [instrument, stream] : {std::pair{&supply_, 0u}, std::pair{&meter_, 1u}})
      instrument->SetDamage(disturbed ? Damage(kind, core::Random(seed, stream))
                                      : hal::usbtmc::FakeInstrument::Damage());
    const double soon = clock->MonotonicSeconds() + kInstrument_s;
    const auto on = [](int product) {
      return std::make_unique<hal::usbtmc::UsbTmc>(hal::usbtmc::UsbTmcOptions{
          hal::usbtmc::FakeInstrument::kVendor, static_cast<std::uint16_t>(product), {}});
    };
    devices.supply =
        std::make_unique<HastySupply>(std::make_unique<hal::scpi::ScpiSupply>(
                                          on(1), hal::scpi::SupplyOptions{12, 2}, clock, soon),
                                      clock);
    devices.supply->SetOutput(false, 0);  // as hal::OpenSupply does
    devices.monitor = std::make_unique<HastyMeter>(
        std::make_unique<hal::scpi::ScpiMeter>(on(2), hal::scpi::MeterOptions{}, clock, soon),
        clock);
  }
  void Close() { lamp_.reset(); }

  std::mutex turn;  // of sessions

 private:
  // Drivers with shorter deadlines.
  class HastySupply : public hal::Supply {
   public:
    HastySupply(std::unique_ptr<hal::Supply> device, std::shared_ptr<core::Clock> clock)
        : device_(std::move(device)), clock_(std::move(clock)) {}
    std::string identity() const override { return device_->identity(); }
    hal::SupplyState SetOutput(bool on, double) override {
      return device_->SetOutput(on, clock_->MonotonicSeconds() + kInstrument_s);
    }
    hal::SupplyState State() override { return device_->State(); }

   private:
    std::unique_ptr<hal::Supply> device_;
    std::shared_ptr<core::Clock> clock_;
  };
  class HastyMeter : public hal::Meter {
   public:
    HastyMeter(std::unique_ptr<hal::Meter> device, std::shared_ptr<core::Clock> clock)
        : device_(std::move(device)), clock_(std::move(clock)) {}
    std::string identity() const override { return device_->identity(); }
    hal::Reading Read(double) override {
      return device_->Read(clock_->MonotonicSeconds() + kInstrument_s);
    }

   private:
    std::unique_ptr<hal::Meter> device_;
    std::shared_ptr<core::Clock> clock_;
  };

  static hal::usbtmc::FakeInstrument::Damage Damage(Kind kind, core::Random random) {
    return [kind, random, hung = false,
            before = std::vector<std::uint8_t>()](std::vector<std::uint8_t>& transfer) mutable {
      const bool struck = random.Uniform() < (kind == Kind::kDelay ? 0.3 : 0.01);
      const std::vector<std::uint8_t> whole = transfer;
      if (struck) switch (kind) {
          case Kind::kDrop:
            return false;
          case Kind::kDelay:
            std::this_thread::sleep_for(std::chrono::duration<double>(0.02 * random.Uniform()));
            break;
          case Kind::kDuplicate:  // the one before once more
            if (!before.empty()) transfer = before;
            break;
          case Kind::kTruncate:
            transfer.resize(random() % transfer.size());
            break;
          case Kind::kGarble:
            transfer[random() % transfer.size()] ^= static_cast<std::uint8_t>(1u << (random() % 8));
            break;
          case Kind::kHang:
            hung = true;
        }
      before = whole;
      return !hung;
    };
  }

  std::string AnswerSupply(const std::string& message) {
    const bool before = model_.on();
    std::string answer = model_.Answer(message);
    if (lamp_ && model_.on() != before) lamp_->SetOutput(model_.on(), HUGE_VAL);
    return answer;
  }
  std::string AnswerMeter(const std::string& message) const {
    if (message.starts_with("*IDN?")) return "ACME,LightMeter,7,1.0\n";
    if (message.starts_with("READ?")) return model_.on() ? "+1.000000E+00\n" : "+0.000000E+00\n";
    return {};
  }

  UMockdevTestbed* testbed_;
  std::unique_ptr<hal::Supply> lamp_;
  hal::scpi::FakeSupply model_;
  hal::usbtmc::FakeInstrument supply_, meter_;
};

e2e::Field FieldOf(const fs::path& session) {
  auto solved =
      reconstruct::Reconstruct(reconstruct::MergeSession(session::SessionReader(session)));
  return {std::move(solved.coefficients), std::move(solved.sigma)};
}

struct Tally {
  int sessions = 0, failures = 0, frames = 0;
  double place_m = 0, meter = 0;                  // worst
  double chi_squared = 0, worst_chi_squared = 0;  // per degree of freedom; the sum, the worst
};

class BadTransport : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    hal::Devices devices = Lab(kSeed).MakeDevices();
    capture::RunCapture(plan_, devices, folder_ / "undisturbed");
    undisturbed_ = FieldOf(folder_ / "undisturbed");
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  // Its noise is that of `seed`.
  static hal::sim::SimulatedLab Lab(std::uint64_t seed) {
    return hal::sim::SimulatedLab(core::Config::FromString(e2e::TinyLab(0.1, 0), "lab.toml"), seed);
  }

  void Session(int number) {
    const auto kind = static_cast<Kind>(number % kKindNames.size());
    const auto transport =
        static_cast<Transport>(number / kKindNames.size() % kTransportNames.size());
    const std::string name = fmt::format(
        "session {} ({} on {}), seed {}", number, kKindNames[static_cast<std::size_t>(kind)],
        kTransportNames[static_cast<std::size_t>(transport)], kSeed);
    SCOPED_TRACE(name);
    const fs::path session = folder_ / fmt::format("session{}", number);
    const fs::path log = fakes::ExposureLogOf(session);
    std::unique_lock<std::mutex> usb;
    std::optional<StageOnALine> stage;
    if (transport == Transport::kUsbTmc)
      usb = std::unique_lock(usb_.turn);
    else
      stage.emplace(transport);
    capture::CaptureOptions options;
    options.resume = true;
    int failures = 0;
    for (;; ++failures) {
      const bool disturbed = failures < kDisturbed;
      ASSERT_LE(failures, kDisturbed) << "it fails on a good line as well";
      const std::uint64_t seed = kSeed + 100 * static_cast<std::uint64_t>(number) + failures + 1;
      try {
        hal::Devices devices = Lab(seed).MakeDevices();
        devices.camera = std::make_unique<WatchedCamera>(
            devices,
            [&, simulated = devices.stage.get()] {
              return stage ? stage->Carriage() : simulated->Where().readback;
            },
            log);
        if (stage)
          devices.stage = stage->Open(disturbed ? LineFaultsOf(transport, kind) : hal::LineFaults(),
                                      seed, std::move(devices.stage));
        else
          usb_.Open(kind, disturbed, seed, devices);
        capture::RunCapture(plan_, devices, session, options);
        break;
      } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("; ")) << "names no remedy";
      }
    }
    if (usb) usb_.Close();
    const auto check = capture::VerifySession(session);
    EXPECT_THAT(check.problems, testing::IsEmpty());
    EXPECT_EQ(check.positions, 6);
    const e2e::FramesAsSeen seen = e2e::ExpectFramesAsSeen(session, fakes::ReadExposures(log));
    const e2e::Agreement agreement = e2e::Compare(FieldOf(session), undisturbed_);
    EXPECT_GT(agreement.degrees, 300);
    EXPECT_LT(agreement.chi_squared, 1 + 5 * kCorrelated * agreement.scatter());
    fs::remove_all(session);
    fs::remove(log);
    const std::lock_guard lock(tally_mutex_);
    Tally& tally = tally_[{transport, kind}];
    ++tally.sessions;
    tally.failures += failures;
    tally.frames += seen.frames;
    tally.place_m = std::max(tally.place_m, seen.place_m);
    tally.meter = std::max(tally.meter, seen.meter);
    tally.chi_squared += agreement.chi_squared;
    tally.worst_chi_squared = std::max(tally.worst_chi_squared, agreement.chi_squared);
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) / fmt::format("luxfield_transports_{}", ::getpid());
  const capture::Plan plan_ =
      capture::ReadPlan(core::Config::FromString(e2e::TinyPlan(3, 2), "plan.toml"));
  e2e::Field undisturbed_;
  InstrumentsOnUsb usb_;
  std::mutex tally_mutex_;
  std::map<std::pair<Transport, Kind>, Tally> tally_;
};

TEST_F(BadTransport, EverySessionResumesToTheSameLightField) {
  const char* asked = std::getenv("LUXFIELD_FAULTS");
  const int sessions = asked ? std::atoi(asked) : 50;
  std::vector<std::thread> workers;
  for (int worker = 0; worker < kWorkers; ++worker)
    workers.emplace_back([&, worker] {
      for (int n = worker; n < sessions && !HasFailure(); n += kWorkers) try {
          Session(n);
        } catch (const std::exception& error) {
          ADD_FAILURE() << "session " << n << ", seed " << kSeed << ": " << error.what();
        }
    });
  for (std::thread& worker : workers) worker.join();
  int failures = 0;
  for (const auto& [what, tally] : tally_) {
    fmt::print(
        "{:>7} {:<10} {:4} sessions, {:4} runs ended by an error and resumed, {:6} frames as seen, "
        "at most {:.2f} um beside, monitor {:.1e}, chi-squared {:.3f}, worst {:.3f}\n",
        kTransportNames[static_cast<std::size_t>(what.first)],
        kKindNames[static_cast<std::size_t>(what.second)], tally.sessions, tally.failures,
        tally.frames, 1e6 * tally.place_m, tally.meter, tally.chi_squared / tally.sessions,
        tally.worst_chi_squared);
    failures += tally.failures;
  }
  EXPECT_GT(failures, 0) << "the transports were too good to show anything";
}

// A controller that forgets where it stands while it stands there: its next answers still name the
// place.
TEST_F(BadTransport, AControllerDisturbedAtRestCostsItsBracketAndNothingElse) {
  capture::Plan plan = plan_;
  plan.exposure.repeats = 3;  // so that a bracket has frames left
  for (const Transport transport : {Transport::kGrbl, Transport::kZaber})
    for (const char* event : {"power cycle", "limit switch"}) {
      const std::string name =
          fmt::format("{} of {}", event, kTransportNames[static_cast<std::size_t>(transport)]);
      SCOPED_TRACE(name);
      const fs::path session = folder_ / name;
      StageOnALine stage(transport);
      bool struck = false;  // behind the first frame of the third position
      capture::CaptureOptions options;
      options.on_frame = [&](const capture::CaptureSummary& s) {
        if (s.positions != 2 || std::exchange(struck, true)) return;
        EXPECT_TRUE(stage.Suffer(event));
      };
      try {
        hal::Devices devices = Lab(kSeed + 1).MakeDevices();
        devices.stage = stage.Open({}, kSeed, std::move(devices.stage));
        capture::RunCapture(plan, devices, session, options);
        ADD_FAILURE() << "the bracket went on";
      } catch (const hal::HardwareError& error) {
        EXPECT_EQ(error.fault, hal::Fault::kNotHomed) << error.what();
        EXPECT_TRUE(error.position_lost);
      }
      std::set<std::pair<int, int>> counted;
      const session::SessionReader broken(session);
      for (const session::FrameRecord& record : broken.frames())
        if (record.kind == session::FrameKind::kPosition) counted.insert({record.i, record.j});
      EXPECT_EQ(counted.size(), 2u);
      options.resume = true;
      hal::Devices devices = Lab(kSeed + 2).MakeDevices();
      devices.stage = stage.Open({}, kSeed, std::move(devices.stage));
      capture::RunCapture(plan, devices, session, options);
      EXPECT_THAT(capture::VerifySession(session).problems, testing::IsEmpty());
      const e2e::Agreement agreement = e2e::Compare(FieldOf(session), undisturbed_);
      EXPECT_LT(agreement.chi_squared, 1 + 5 * kCorrelated * agreement.scatter());
    }
}

}  // namespace
}  // namespace luxfield
