// The contract scripts rely on: exit codes, one sentence on stderr, nothing half-written.
#include <gtest/gtest.h>

#include <algorithm>

#include "program.h"

namespace luxfield::e2e {
namespace {

TEST(CommandLine, HelpListsEveryVerbAndExitsZero) {
  const auto folder = FreshFolder("help");
  const Outcome outcome = RunLuxfield({"--help"}, folder);
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* verb :
       {"devices", "plan", "capture", "verify", "report", "simulate", "merge", "reconstruct",
        "import", "preprocess", "render", "info", "compare", "demo", "sky"}) {
    EXPECT_NE(outcome.out.find(verb), std::string::npos) << verb;
    const Outcome help = RunLuxfield({verb, "--help"}, folder);
    EXPECT_EQ(help.exit_code, 0) << verb;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << verb;
  }
}

TEST(CommandLine, EveryBenchHasItsOwnHelpAndOthersAreRefusedByName) {
  const auto folder = FreshFolder("bench_help");
  const Outcome all = RunLuxfield({"bench", "--help"}, folder);
  EXPECT_EQ(all.exit_code, 0);
  const Outcome wrong = RunLuxfield({"bench", "everything", "--spp", "3"}, folder),
                none = RunLuxfield({"bench"}, folder);
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(wrong.err.find("'everything'"), std::string::npos) << wrong.err;
  for (const std::string bench : {"solve", "nearfield", "sampling", "shadows", "errors", "tradeoff",
                                  "calibrate", "accuracy", "scale"}) {
    EXPECT_NE(all.out.find(bench), std::string::npos) << bench;
    EXPECT_NE(wrong.err.find(bench), std::string::npos) << wrong.err;
    EXPECT_NE(none.err.find(bench), std::string::npos) << none.err;
    const Outcome help = RunLuxfield({"bench", bench, "--help"}, folder);
    EXPECT_EQ(help.exit_code, 0) << bench;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << bench;
    EXPECT_EQ(help.out.find("--plan") != std::string::npos, bench == "errors") << bench;
  }
}

TEST(CommandLine, WrongArgumentsExitTwoWithOneLine) {
  const auto folder = FreshFolder("arguments");
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{},
        {"no-such-verb"},
        {"info"},
        {"info", "a.lf.exr", "surplus"},
        {"info", "a.hdr", "--layout", "cross"},
        {"render", "--spp", "many", "x.toml"},
        {"calibrate"},
        {"view", "scene.toml"},
        {"compare", "a.exr"},
        {"report", "s", "-o", "report.txt"},
        {"bench"},
        {"bench", "no-such-bench"},
        {"bench", "solve", "--width", "8"},
        {"merge", "--threads", "-3", "s", "-o", "x.meas.exr"},
        {"sky", "--latitude", "48", "--date", "2024-06-21", "--time", "23:00", "-o", "night.exr"},
        {"sky", "--latitude", "48", "--date", "21.6.2024", "-o", "x.exr"},
        {"sky", "--latitude", "80", "--date", "2024-12-21", "--day", "-o", "night"},
        {"sky", "--latitude", "48", "--date", "2024-06-21", "-o", "x.png"}}) {
    const Outcome outcome = RunLuxfield(arguments, folder);
    EXPECT_EQ(outcome.exit_code, 2)
        << (arguments.empty() ? "" : arguments[0]) << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

// Every verb that reads a file, given files that are not what it wants.
struct Reader {
  std::string name;
  std::vector<std::string> arguments;  // "@" stands for the hostile file
  std::string extension;
};

class HostileFiles : public testing::TestWithParam<Reader> {};

TEST_P(HostileFiles, ExitTwoOneSentenceNoOutput) {
  const Reader& reader = GetParam();
  const auto folder = FreshFolder("hostile_" + reader.name);
  std::string garbage;
  for (int i = 0; i < 5000; ++i) garbage.push_back(static_cast<char>((i * 7919 + 13) >> 3));
  const std::string exr_magic("\x76\x2f\x31\x01\x02\x00\x00\x00", 8);
  const std::vector<std::pair<std::string, std::string>> contents = {
      {"empty", ""},
      {"text", "this is not what you want\n"},
      {"garbage", garbage},
      {"exr_header_only", exr_magic},
      {"exr_then_garbage", exr_magic + garbage},
      {"nul_bytes", std::string(1000, '\0')},
      {"unterminated", "[camera\nx = "},
      {"tm25_magic_only", "TM25"},
      {"tm25_then_garbage", "TM25" + garbage}};
  std::vector<std::string> files = {"missing" + reader.extension};
  for (const auto& [name, content] : contents) {
    files.push_back(name + reader.extension);
    WriteText(folder / files.back(), content);
  }
  std::filesystem::create_directory(folder / ("folder" + reader.extension));
  files.push_back("folder" + reader.extension);
  for (const auto& file : files) {
    auto arguments = reader.arguments;
    std::replace(arguments.begin(), arguments.end(), std::string("@"), file);
    const Outcome outcome = RunLuxfield(arguments, folder);
    EXPECT_EQ(outcome.exit_code, 2) << file << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1)
        << file << ": " << outcome.err;
    EXPECT_NE(outcome.err.find(file), std::string::npos)
        << "the file is not named: " << outcome.err;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      EXPECT_EQ(entry.path().filename().string().find("output"), std::string::npos)
          << file << " left " << entry.path() << " behind";
  }
  std::filesystem::remove_all(folder);
}

std::string Lab() { return SourceFile("data/labs/small.toml").string(); }
std::string Plan() { return SourceFile("data/plans/small.toml").string(); }

INSTANTIATE_TEST_SUITE_P(
    Readers, HostileFiles,
    testing::Values(
        Reader{"info_lf", {"info", "@"}, ".lf.exr"},
        Reader{"info_meas", {"info", "@"}, ".meas.exr"},
        Reader{"info_tab", {"info", "@"}, ".tab.exr"},
        Reader{"info_rays", {"info", "@"}, ".tm25ray"},
        Reader{"info_scene", {"info", "@"}, ".toml"}, Reader{"info_exr", {"info", "@"}, ".exr"},
        Reader{"info_hdr", {"info", "@"}, ".hdr"},
        Reader{"info_layout", {"info", "@", "--layout", "mirror-ball"}, ".exr"},
        Reader{"compare", {"compare", "@", "@"}, ".exr"},
        Reader{"compare_lf", {"compare", "@", "@"}, ".lf.exr"},
        Reader{"import", {"import", "@", "-o", "output.lf.exr"}, ".tm25ray"},
        Reader{"preprocess", {"preprocess", "@", "-o", "output.tab.exr"}, ".lf.exr"},
        Reader{"reconstruct", {"reconstruct", "@", "-o", "output.lf.exr"}, ".meas.exr"},
        Reader{"merge", {"merge", "@", "-o", "output.meas.exr"}, ".session"},
        Reader{"verify", {"verify", "@"}, ".session"},
        Reader{"report", {"report", "@", "-o", "output.html"}, ".session"},
        Reader{"calibrate", {"calibrate", "sensor", "@", "-o", "output.cal.json"}, ".session"},
        Reader{"render", {"render", "@", "-o", "output.exr"}, ".toml"},
        Reader{"render_lf",
               {"render", SourceFile("data/scenes/demo.toml"), "--light-field", "@", "-o",
                "output.exr"},
               ".lf.exr"},
        Reader{"plan", {"plan", "@", "--lab", Lab()}, ".toml"},
        Reader{"plan_lab", {"plan", Plan(), "--lab", "@"}, ".toml"},
        Reader{"devices_lab", {"devices", "@"}, ".toml"},
        Reader{"capture", {"capture", "@", "output.session", "--lab", Lab()}, ".toml"},
        Reader{"capture_lab", {"capture", Plan(), "output.session", "--lab", "@"}, ".toml"},
        Reader{"simulate", {"simulate", "@", "--plan", Plan(), "-o", "output.lf.exr"}, ".toml"}),
    [](const auto& reader) { return reader.param.name; });

}  // namespace
}  // namespace luxfield::e2e
