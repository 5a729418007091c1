// `luxfield capture --view`: a window opens on the session, and the session is the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <future>
#include <map>

#include "luxfield/core/file.h"
#include "tests/e2e/program.h"
#include "tests/e2e/tiny_session.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using e2e::Outcome;
using testing::HasSubstr;

// By their names; SHA-256 of whole files.
std::map<std::string, std::string> FramesOf(const fs::path& session) {
  std::map<std::string, std::string> frames;
  for (const auto& entry : fs::recursive_directory_iterator(session / "frames"))
    if (entry.is_regular_file())
      frames[fs::relative(entry.path(), session).string()] = core::Sha256OfFile(entry.path());
  return frames;
}

TEST(CaptureView, AWindowOpensAndTheFramesAreTheSame) {
  const auto display = VirtualDisplay::Start();
  const fs::path folder = e2e::FreshFolder("capture_view");
  if (!display || e2e::RunProgram({"xdotool", "version"}, folder).exit_code != 0)
    GTEST_SKIP() << "SKIPPED: Xvfb or xdotool is missing: no `capture --view` is tested";
  e2e::WriteText(folder / "lab.toml", e2e::TinyLab(100, 0));
  e2e::WriteText(folder / "plan.toml", e2e::TinyPlan(4, 3));
  const auto capture = [&](const std::string& session, const std::vector<std::string>& more) {
    std::vector<std::string> words{"capture", "plan.toml", session, "--lab", "lab.toml"};
    words.insert(words.end(), more.begin(), more.end());
    return e2e::RunLuxfield(words, folder);
  };
  // One whose session never comes to be has closed its window when it ends.
  e2e::WriteText(folder / "wrong.toml", "[lab]\ndriver = \"none\"\n");
  const Outcome refused =
      e2e::RunLuxfield({"capture", "plan.toml", "none", "--lab", "wrong.toml", "--view"}, folder);
  EXPECT_NE(refused.exit_code, 0);
  ASSERT_EQ(capture("plain", {}).exit_code, 0);
  const Outcome watched = capture("watched", {"--view"});
  ASSERT_EQ(watched.exit_code, 0) << watched.err;
  const auto frames = FramesOf(folder / "plain");
  EXPECT_GE(frames.size(), 4u * 3);
  EXPECT_EQ(FramesOf(folder / "watched"), frames);
  EXPECT_EQ(e2e::RunLuxfield({"verify", "watched"}, folder).exit_code, 0);
  // It stays after the capture, and ends when it is closed.
  fs::create_directories(folder / "hand");
  const Outcome found = e2e::RunProgram(
      {"xdotool", "search", "--sync", "--onlyvisible", "--name", "luxfield watched"},
      folder / "hand");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const std::string window = found.out.substr(0, found.out.find('\n'));
  EXPECT_NE(
      e2e::RunProgram({"xdotool", "search", "--name", "luxfield none"}, folder / "hand").exit_code,
      0);
  EXPECT_EQ(e2e::RunProgram({"xdotool", "windowkill", window}, folder / "hand").exit_code, 0);
  fs::remove_all(folder);
}

// As when the X server ends. The library for windows ends the program then.
TEST(CaptureView, ALostDisplayIsSaid) {
  const auto display = VirtualDisplay::Start();
  const fs::path folder = e2e::FreshFolder("view_lost");
  if (!display || e2e::RunProgram({"xdotool", "version"}, folder).exit_code != 0)
    GTEST_SKIP() << "SKIPPED: Xvfb or xdotool is missing: no lost display is tested";
  fs::create_directories(folder / "hand");
  auto viewing = std::async(std::launch::async, [&] {
    return e2e::RunLuxfield({"view", "lost", "--wait", "--size", "300x200"}, folder);
  });
  const Outcome found = e2e::RunProgram(
      {"xdotool", "search", "--sync", "--onlyvisible", "--name", "luxfield lost"}, folder / "hand");
  const std::string window = found.out.substr(0, found.out.find('\n'));
  EXPECT_EQ(e2e::RunProgram({"xdotool", "windowkill", window}, folder / "hand").exit_code, 0);
  const Outcome lost = viewing.get();
  EXPECT_EQ(lost.exit_code, 3);
  EXPECT_THAT(lost.err, HasSubstr("if the display went away, start it again where one is"));
  fs::remove_all(folder);
}

TEST(CaptureView, ASessionThatIsNotThereYetIsWaitedFor) {
  const auto display = VirtualDisplay::Start();
  if (!display) GTEST_SKIP() << "SKIPPED: Xvfb is missing: no `view --wait` is tested";
  const fs::path folder = e2e::FreshFolder("view_wait");
  const Outcome waiting = e2e::RunLuxfield(
      {"view", "s", "--wait", "--screenshot", "w.png", "--frames", "2", "--size", "300x200"},
      folder);
  EXPECT_EQ(waiting.exit_code, 0) << waiting.err;
  EXPECT_TRUE(fs::exists(folder / "w.png"));
  EXPECT_THAT(e2e::RunLuxfield({"view", "s", "--screenshot", "w.png"}, folder).err,
              HasSubstr("is not there"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::view
