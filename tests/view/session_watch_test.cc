// A session is followed by its journal alone.
#include "luxfield/view/session/session_watch.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/session/journal.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using State = PositionState;

// A plan of three positions, and lines that a capture would write.
class SessionWatchTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("luxfield_watch_{}", getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "plan.json") << R"({"name": "three", "positions": [
        {"i": 0, "j": 0, "u_m": 0, "v_m": 0}, {"i": 1, "j": 0, "u_m": 0.1, "v_m": 0},
        {"i": 0, "j": 1, "u_m": 0, "v_m": 0.1}]})";
    std::ofstream(folder_ / "journal.jsonl");
    Append("session_open", {{"format", 1}});
    Append("epoch_start", {{"epoch", 0}});
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const std::string& text) {
    std::ofstream(folder_ / "journal.jsonl", std::ios::app | std::ios::binary) << text;
  }
  std::string Line(const std::string& type, json fields) {
    fields["t_s"] = t_s_ += 10;
    fields["utc"] = fmt::format("2026-01-01T00:00:{:02}Z", lines_);
    return session::FormatJournalLine(lines_++, std::string(64, '0'), type, fields) + "\n";
  }
  void Append(const std::string& type, json fields) { Write(Line(type, std::move(fields))); }
  void Frame(int i, int j, bool flagged = false) {
    Append("frame", {{"kind", "position"},
                     {"i", i},
                     {"j", j},
                     {"flagged", flagged},
                     {"file", fmt::format("frames/i{}_j{}.tif", i, j)},
                     {"exposure_s", 0.25},
                     {"checks", {{"mean_dn", 7.5}, {"temperature_c", 21.5}}}});
  }
  void Complete(int i, int j) { Append("position_complete", {{"i", i}, {"j", j}}); }
  static std::vector<State> StatesOf(const SessionWatch& watch) {
    std::vector<State> states;
    for (const auto& position : watch.session().positions) states.push_back(position.state);
    return states;
  }

  fs::path folder_;
  double t_s_ = 0;
  int lines_ = 0;
};

TEST_F(SessionWatchTest, FollowsPositionsThroughTheirStates) {
  SessionWatch watch(folder_);
  EXPECT_EQ(watch.session().name, "three");
  EXPECT_THAT(StatesOf(watch), testing::Each(State::kWaiting));
  EXPECT_FALSE(watch.Update());
  Frame(0, 0);
  EXPECT_TRUE(watch.Update());
  EXPECT_THAT(StatesOf(watch),
              testing::ElementsAre(State::kExposing, State::kWaiting, State::kWaiting));
  Complete(0, 0);
  Append("frame_rejected", {{"reason", "shaken"}, {"i", 1}, {"j", 0}});
  Frame(1, 0, /*flagged=*/true);
  Complete(1, 0);
  Frame(0, 1);
  watch.Update();
  EXPECT_THAT(StatesOf(watch),
              testing::ElementsAre(State::kDone, State::kFlagged, State::kExposing));
  const WatchedSession& session = watch.session();
  EXPECT_EQ(session.frames, 3);
  EXPECT_EQ(session.flagged, 1);
  EXPECT_EQ(session.rejected, 1);
  EXPECT_EQ(session.positions[1].rejected, 1);
  EXPECT_EQ(session.last_frame.value().file, "frames/i0_j1.tif");
  EXPECT_EQ(session.last_frame.value().mean_dn, 7.5);
  EXPECT_EQ(session.temperature_c.size(), 3);
  EXPECT_FALSE(session.sealed);
}

TEST_F(SessionWatchTest, SaysHowLongTheRestTakes) {
  SessionWatch watch(folder_);
  EXPECT_FALSE(watch.session().eta_s);
  Frame(0, 0);     // 10 s after the epoch's start
  Complete(0, 0);  // 20 s after it
  watch.Update();
  EXPECT_DOUBLE_EQ(watch.session().eta_s.value(), 40);  // two more
  Frame(1, 0);
  Complete(1, 0);
  Frame(0, 1);
  Complete(0, 1);
  watch.Update();
  EXPECT_FALSE(watch.session().eta_s);
}

TEST_F(SessionWatchTest, ALineCountsWhenItIsWhole) {
  SessionWatch watch(folder_);
  const std::string line = Line("frame", {{"kind", "position"}, {"i", 0}, {"j", 0}});
  Write(line.substr(0, 20));
  EXPECT_FALSE(watch.Update());
  Write(line.substr(20));
  EXPECT_TRUE(watch.Update());
  EXPECT_EQ(watch.session().frames, 1);
}

TEST_F(SessionWatchTest, ADriftSendsPositionsBackAndAnEpochDropsUnfinishedOnes) {
  Frame(0, 0);
  Complete(0, 0);
  Append("reference", {{"channel", 0}, {"ratio", 1.0}});
  Append("reference", {{"channel", 0}, {"ratio", 0.8}});
  Append("suspended", {{"reason", "drift"}, {"retake", {{0, 0}}}});
  SessionWatch watch(folder_);
  EXPECT_TRUE(watch.session().suspended);
  EXPECT_TRUE(watch.session().positions[0].retake);
  EXPECT_EQ(watch.session().positions[0].state, State::kWaiting);
  EXPECT_EQ(watch.session().drift.back().value, 0.8);
  Append("epoch_start", {{"epoch", 1}});
  Frame(0, 0);
  Append("epoch_start", {{"epoch", 2}});
  watch.Update();
  EXPECT_FALSE(watch.session().suspended);
  EXPECT_EQ(watch.session().epochs, 3);
  EXPECT_EQ(watch.session().positions[0].state, State::kWaiting);
  Append("sealed", {{"status", "complete"}});
  watch.Update();
  EXPECT_TRUE(watch.session().sealed);
}

TEST_F(SessionWatchTest, AJournalThatBecameShorterIsReadAnew) {
  Frame(0, 0);
  Frame(0, 0);
  SessionWatch watch(folder_);
  EXPECT_EQ(watch.session().frames, 2);
  fs::remove(folder_ / "journal.jsonl");
  Append("epoch_start", {{"epoch", 0}});
  watch.Update();
  EXPECT_EQ(watch.session().frames, 0);
}

TEST_F(SessionWatchTest, DamageAndWhatIsMissingIsSaid) {
  SessionWatch watch(folder_);
  Write("{\"seq\": 3}\n");
  EXPECT_THROW(watch.Update(), InputError);
  fs::remove(folder_ / "journal.jsonl");
  EXPECT_THROW(SessionWatch{folder_}, InputError);
  fs::remove(folder_ / "plan.json");
  EXPECT_THROW(SessionWatch{folder_}, InputError);
}

// Not a byte of the folder changes, and no file appears in it.
TEST_F(SessionWatchTest, LeavesTheFolderAsItIs) {
  Frame(0, 0);
  const auto times = [&] {
    std::map<std::string, fs::file_time_type> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      found[entry.path().string()] = fs::last_write_time(entry);
    return found;
  };
  const auto before = times();
  SessionWatch watch(folder_);
  watch.Update();
  EXPECT_EQ(times(), before);
}

}  // namespace
}  // namespace luxfield::view
