// A lab whose stage is a controller behind a serial port, played by another process; all else is
// simulated.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "program.h"

namespace luxfield::e2e {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;
namespace fs = std::filesystem;

// The program fake_device, and what it can be told.
class FakeDevice {
 public:
  explicit FakeDevice(std::vector<std::string> words) {
    words.insert(words.begin(), BuiltProgram("fake_device").string());
    std::array<int, 2> in{}, out{};
    if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0)
      throw std::runtime_error("pipe");
    std::vector<char*> argv;
    for (auto& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ == 0) {
      dup2(in[0], STDIN_FILENO);
      dup2(out[1], STDOUT_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(in[0]);
    close(out[1]);
    commands_ = in[1];
    for (char c = 0; read(out[0], &c, 1) == 1 && c != '\n';) port_ += c;
    close(out[0]);
  }
  ~FakeDevice() {
    close(commands_);
    waitpid(child_, nullptr, 0);
  }
  FakeDevice(const FakeDevice&) = delete;
  FakeDevice& operator=(const FakeDevice&) = delete;

  const std::string& port() const { return port_; }
  void Tell(const std::string& command) {
    const std::string line = command + "\n";
    EXPECT_EQ(write(commands_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }

 private:
  pid_t child_ = -1;
  int commands_ = -1;
  std::string port_;
};

const std::vector<std::string> kGrbl = {"grbl",     "--speed-up", "20",       "110=6000",
                                        "111=6000", "120=1000",   "121=1000", "24=1000",
                                        "25=6000",  "130=300",    "131=300"};

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class RealStage : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
    // Without errors, so that frames can be compared to the bit.
    const std::string lab = ReadText(SourceFile("data/labs/small.toml"));
    lab_ = Replaced(lab.substr(0, lab.find("[errors.")), "seed = 1", "seed = 1\nideal = true");
    const std::string plan = ReadText(SourceFile("data/plans/small.toml"));
    WriteText(folder_ / "plan.toml",
              Replaced(plan, "width = 5\nheight = 4", "width = 3\nheight = 2"));
    WriteText(folder_ / "simulated.toml", lab_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void WriteLab(const std::string& name, const std::string& stage) {
    WriteText(folder_ / name, Replaced(lab_, "[stage]", "[stage]\n" + stage));
  }
  void WriteGrblLab(const std::string& port) {
    WriteLab("real.toml", "driver = \"grbl\"\nport = \"" + port +
                              "\"\nv_axis = \"-y\"\norigin_m = [-0.15, -0.15]");
  }
  Outcome Run(const std::vector<std::string>& arguments) { return RunLuxfield(arguments, folder_); }
  // The light field of a session.
  std::string Reconstruct(const std::string& session) {
    const Outcome merged = Run({"merge", session, "-o", session + ".meas.exr", "--quiet"});
    EXPECT_EQ(merged.exit_code, 0) << merged.err;
    const Outcome solved =
        Run({"reconstruct", session + ".meas.exr", "-o", session + ".lf.exr", "--quiet"});
    EXPECT_EQ(solved.exit_code, 0) << solved.err;
    return ReadText(folder_ / (session + ".lf.exr"));
  }

  fs::path folder_;
  std::string lab_;
};

TEST_F(RealStage, DevicesSayWhoTakesThePort) {
  FakeDevice grbl(kGrbl);
  WriteGrblLab(grbl.port());
  const Outcome listed = Run({"devices", "real.toml"});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, HasSubstr("grbl         takes it: Grbl"));
  EXPECT_THAT(listed.out, HasSubstr("zaber        refuses it: the port speaks Grbl"));
  EXPECT_THAT(listed.out, HasSubstr("Grbl 1.1h.20190825 stage on " + grbl.port()));

  WriteLab("wrong.toml", "driver = \"zaber\"\nport = \"" + grbl.port() +
                             "\"\norigin_m = [0.15, 0.15]\nmicrostep_m = [5e-8, 5e-8]");
  const Outcome wrong = Run({"devices", "wrong.toml"});
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_THAT(wrong.out, HasSubstr("grbl         takes it"));
  EXPECT_THAT(wrong.err, HasSubstr("no answer of device 1"));

  FakeDevice zaber({"zaber"});
  const Outcome asked = Run({"devices", "--port", zaber.port()});
  EXPECT_THAT(asked.out, HasSubstr("zaber        takes it: device 1: id 50001, 2: id 50002"));
  EXPECT_THAT(asked.out, HasSubstr("grbl         refuses it: no status report"));
}

TEST_F(RealStage, IsPartOfTheCaptureBench) {
  FakeDevice grbl(kGrbl);
  WriteGrblLab(grbl.port());
  const std::vector<std::string> bench = {
      "bench",  "capture", "--side",     "32",    "--frames", "20",        "--fps",       "100",
      "--json", "b.json",  "--exposure", "0.002", "--stage",  "real.toml", "--exposures", "10"};
  const Outcome measured = Run(bench);
  EXPECT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_EQ(Json::parse(ReadText(folder_ / "b.json")).at("rows").at(1).at("frames"), 20);
  grbl.Tell("freeze");
  EXPECT_EQ(Run(bench).exit_code, 3);
  std::vector<std::string> simulated = bench;
  std::replace(simulated.begin(), simulated.end(), std::string("real.toml"),
               std::string("simulated.toml"));
  const Outcome refused = Run(simulated);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("names no real stage"));
}

TEST_F(RealStage, TestsStayWithinTheirBounds) {
  FakeDevice grbl(kGrbl);
  WriteGrblLab(grbl.port());
  const Outcome tested =
      Run({"devices", "test", "stage", "real.toml", "--reach", "2mm", "--json", "test.json"});
  EXPECT_EQ(tested.exit_code, 0) << tested.err;
  const Json figures = Json::parse(ReadText(folder_ / "test.json"));
  EXPECT_EQ(figures.at("reach_m"), 0.002);
  EXPECT_EQ(figures.at("rows").size(), 6u);
  for (const Json& row : figures.at("rows")) {
    EXPECT_LE(std::abs(row.at("u_m").get<double>()), 0.002 + 1e-12);
    EXPECT_LE(row.at("off_m").get<double>(), 4e-6);  // a step
  }
  const auto figures_of = [&](const char* device) {
    const Outcome outcome =
        Run({"devices", "test", device, "simulated.toml", "--json", "test.json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(ReadText(folder_ / "test.json"));
  };
  const Json frame = figures_of("camera");
  EXPECT_GT(frame.at("mean_dn"), 0);
  EXPECT_GE(frame.at("brightest_dn"), frame.at("mean_dn"));
  EXPECT_GE(figures_of("supply").at("on_s").get<double>(), 2 - 1e-6) << "long enough to be seen";
  EXPECT_EQ(Run({"devices", "test", "kettle", "simulated.toml"}).exit_code, 2);
}

TEST_F(RealStage, LabsThatMakeNoSense) {
  const auto error_of = [&](const std::string& stage) {
    WriteLab("lab.toml", stage);
    const Outcome outcome = Run({"devices", "lab.toml"});
    EXPECT_EQ(outcome.exit_code, 2) << stage;
    return outcome.err;
  };
  EXPECT_THAT(error_of("driver = \"marlin\""), HasSubstr("stage.driver"));
  EXPECT_THAT(error_of("driver = \"grbl\"\norigin_m = [0, 0]"), HasSubstr("stage.port"));
  const std::string grbl = "driver = \"grbl\"\nport = \"/dev/nothing\"\n";
  EXPECT_THAT(error_of(grbl), HasSubstr("stage.origin_m"));
  EXPECT_THAT(error_of(grbl + "origin_m = [0, 0]\nv_axis = \"-x\""), HasSubstr("stage.v_axis"));
  const std::string zaber = "driver = \"zaber\"\nport = \"/dev/nothing\"\norigin_m = [0, 0]\n";
  EXPECT_THAT(error_of(zaber + "microstep_m = [0, 1e-8]"), HasSubstr("stage.microstep_m"));
  EXPECT_THAT(error_of(zaber + "microstep_m = [1e-8, 1e-8]\nu_axis = \"1\""),
              HasSubstr("stage.u_axis"));
  WriteGrblLab("/dev/nothing");
  const Outcome absent = Run({"capture", "plan.toml", "s", "--lab", "real.toml"});
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_THAT(absent.err, HasSubstr("/dev/nothing"));
  EXPECT_EQ(Run({"simulate", "real.toml", "--plan", "plan.toml", "-o", "t.lf.exr"}).exit_code, 0)
      << "the truth needs no stage";
}

// The controller is sent at the plan's speed; what the plan would widen is said, and not done.
TEST_F(RealStage, PlansTightenWhatTheLabAllows) {
  const std::string plan = ReadText(folder_ / "plan.toml");
  WriteText(folder_ / "slow.toml", plan + "\n[stage]\nmax_m = [5, 0.025]\nspeed_m_per_s = 0.004\n");
  const Outcome dry = Run({"plan", "slow.toml", "--lab", "simulated.toml", "--json", "plan.json"});
  EXPECT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_THAT(dry.err, HasSubstr("slow.toml: stage.max_m = [5, 0.025] allows more than the lab's"));
  EXPECT_THAT(dry.out, HasSubstr("0.025) m, 0.004 m/s"));
  EXPECT_EQ(Json::parse(ReadText(folder_ / "plan.json")).at("stage").at("speed_m_per_s"), 0.004);

  WriteText(folder_ / "narrow.toml", plan + "\n[stage]\nmax_m = [0.001, 0.05]\n");
  for (const char* verb : {"plan", "capture"}) {
    std::vector<std::string> words = {verb, "narrow.toml", "--lab", "simulated.toml"};
    if (words[0] == "capture") words.insert(words.begin() + 2, "none.session");
    const Outcome refused = Run(words);
    EXPECT_EQ(refused.exit_code, 2) << verb;
    EXPECT_THAT(refused.err, HasSubstr("lies beyond stage.max_m = [0.001, 0.05]")) << verb;
  }
  EXPECT_FALSE(fs::exists(folder_ / "none.session"));
}

// The stage reads back what the plan asks for to the nanometre, so the light is the same to the
// bit.
TEST_F(RealStage, CapturesAsTheSimulatedStageDoes) {
  FakeDevice grbl(kGrbl);
  WriteGrblLab(grbl.port());
  for (const char* lab : {"real", "simulated"}) {
    const Outcome outcome = Run({"capture", "plan.toml", std::string(lab) + ".session", "--lab",
                                 std::string(lab) + ".toml", "--quiet"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  int frames = 0;
  for (const char* kind : {"frames", "refs"})
    for (const auto& file : fs::directory_iterator(folder_ / "simulated.session" / kind)) {
      const fs::path other = folder_ / "real.session" / kind / file.path().filename();
      EXPECT_EQ(ReadText(other), ReadText(file.path())) << other;
      ++frames;
    }
  EXPECT_GE(frames, 3 * 2 + 2);
}

// A limit switch ends the capture with the position lost; it resumes with homing, and the light
// field is that of an undisturbed capture.
TEST_F(RealStage, ResumesAfterALimitSwitch) {
  FakeDevice grbl(kGrbl);
  WriteGrblLab(grbl.port());
  const std::vector<std::string> capture = {"capture", "plan.toml", "real.session",
                                            "--lab",   "real.toml", "--quiet"};
  std::atomic<bool> ended = false;
  std::thread accident([&] {
    const fs::path frames = folder_ / "real.session" / "frames";
    const auto count = [&] {
      std::error_code none;
      return std::distance(fs::directory_iterator(frames, none), fs::directory_iterator());
    };
    while (!ended && count() < 4) std::this_thread::yield();
    if (!ended) grbl.Tell("limit switch");
  });
  const Outcome broken = Run(capture);
  ended = true;
  accident.join();
  EXPECT_EQ(broken.exit_code, 3) << broken.err;
  EXPECT_THAT(broken.err, HasSubstr("ALARM:1"));
  std::vector<std::string> resume = capture;
  resume.emplace_back("--resume");
  const Outcome resumed = Run(resume);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(Run({"verify", "real.session"}).exit_code, 0);
  EXPECT_EQ(Run({"capture", "plan.toml", "simulated.session", "--lab", "simulated.toml", "--quiet"})
                .exit_code,
            0);
  EXPECT_EQ(Reconstruct("real.session").size(), Reconstruct("simulated.session").size());
  const Outcome compared =
      Run({"compare", "real.session.lf.exr", "simulated.session.lf.exr", "--json", "compare.json"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_EQ(Json::parse(ReadText(folder_ / "compare.json")).at("rel_rmse"), 0.0);
}

}  // namespace
}  // namespace luxfield::e2e
