// luxfield report: a page and figures of a session, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/e2e/html_check.h"
#include "tests/e2e/program.h"
#include "tests/e2e/tiny_session.h"

namespace luxfield::e2e {
namespace {

using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kHostileName = R"(name = "<script>alert(1)</script> & \"more\"")";

class Report : public testing::Test {
 protected:
  void SetUp() override {
    WriteText(folder_ / "lab.toml", TinyLab(0.05, 0.5));
    const std::string plan = TinyPlan(3, 2), table = "[plan]\n";
    WriteText(folder_ / "plan.toml", table + kHostileName + "\n" + plan.substr(table.size()));
    const Outcome captured =
        RunLuxfield({"capture", "plan.toml", "lamp.session", "--lab", "lab.toml"}, folder_);
    ASSERT_EQ(captured.exit_code, 0) << captured.err;
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }
  Outcome Run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"report", "lamp.session", "-o", "r.html", "--json", "r.json"};
    words.insert(words.end(), more.begin(), more.end());
    return RunLuxfield(words, folder_);
  }

  const fs::path folder_ =
      FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Report, IsOnePageThatNeedsNoOtherFile) {
  const Outcome outcome = Run();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Whole and sealed: all 6 positions"));
  const std::string page = ReadText(folder_ / "r.html");
  for (const char* heading : {"Timeline", "Lamp drift", "Exposures", "Re-shoots",
                              "Temperature and dark level", "Stage", "Lamp supply", "Devices"})
    EXPECT_THAT(page, HasSubstr(std::string("<h2>") + heading));
  ExpectSelfContainedPage(page);
  EXPECT_THAT(page, HasSubstr("luxfield verify"));
  const Json json = Json::parse(ReadText(folder_ / "r.json"));
  EXPECT_EQ(json.at("missing"), 0);
  EXPECT_EQ(json.at("positions").size(), 6u);
  for (const Json& judgement : json.at("verdict")) {
    // The tiny grid lies within the lamp, which the report says.
    const bool of_edges = judgement.at("text").get<std::string>().starts_with("Light reaches");
    EXPECT_EQ(judgement.at("verdict"), of_edges ? "look" : "good") << judgement.dump();
  }
  EXPECT_FALSE(json.contains("verify")) << "nobody asked for it";
}

TEST_F(Report, ChecksEveryByteWhereAskedTo) {
  const fs::path frame = fs::directory_iterator(folder_ / "lamp.session" / "frames")->path();
  std::string bytes = ReadText(frame);
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  WriteText(frame, bytes);
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_THAT(ReadText(folder_ / "r.html"), Not(HasSubstr("differs from what was committed")));
  ASSERT_EQ(Run({"--verify"}).exit_code, 0);
  EXPECT_THAT(ReadText(folder_ / "r.html"), HasSubstr("differs from what was committed"));
  EXPECT_FALSE(Json::parse(ReadText(folder_ / "r.json")).at("verify").at("problems").empty());
}

TEST_F(Report, RefusesADamagedJournalInOneSentence) {
  const fs::path journal = folder_ / "lamp.session" / "journal.jsonl";
  std::string text = ReadText(journal);
  text[text.size() / 2] = static_cast<char>(text[text.size() / 2] ^ 1);
  WriteText(journal, text);
  const Outcome outcome = Run();
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("verify --salvage"));
  EXPECT_FALSE(fs::exists(folder_ / "r.html"));
}

}  // namespace
}  // namespace luxfield::e2e
