// `luxfield` starts at once: it links none of the large libraries, and hands over to
// `luxfield-verbs` what needs them (cli/quick.h).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>

#include "luxfield/version.h"
#include "tests/e2e/program.h"

namespace luxfield::e2e {
namespace {

using testing::HasSubstr;
using testing::Not;

Outcome RunAllVerbs(const std::vector<std::string>& arguments,
                    const std::filesystem::path& folder) {
  std::vector<std::string> words = {BuiltProgram("luxfield-verbs").string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return RunProgram(words, folder);
}

TEST(QuickStart, LinksNoneOfTheLargeLibraries) {
  const auto folder = FreshFolder("quick_links");
  const Outcome linked = RunProgram({"ldd", BuiltProgram("luxfield").string()}, folder);
  ASSERT_EQ(linked.exit_code, 0) << linked.err;
  EXPECT_THAT(linked.out, HasSubstr("libOpenEXR"));  // that ldd told them
  for (const char* library : {"opencv", "OpenCL", "assimp", "embree", "ceres", "glog", "aravis",
                              "gphoto2", "libraw", "cairo", "gpiod"})
    EXPECT_THAT(linked.out, Not(HasSubstr(library)));
}

// `bench` and `view` are done by programs of their own, luxfield-bench and luxfield-view, which the
// program of all verbs does not list. Their descriptions may take more than one line.
std::string WithoutOthers(const std::string& said) {
  return std::regex_replace(said, std::regex("  (bench|view) .*\n(    .*\n)*"), "");
}

// Both programs say the same of themselves and of words that are no verb; they list the verbs in one
// order.
TEST(QuickStart, SaysWhatTheProgramOfAllVerbsSays) {
  const auto folder = FreshFolder("quick_says");
  const std::vector<std::vector<std::string>> words = {{},
                                                       {"--help"},
                                                       {"-h"},
                                                       {"--version"},
                                                       {"--helpp"},
                                                       {"rendr"},
                                                       {"export"},
                                                       {"info"},
                                                       {"info", "--help"},
                                                       {"info", "none.exr"},
                                                       {"--quiet", "render"}};
  for (const auto& arguments : words) {
    const Outcome quick = RunLuxfield(arguments, folder), all = RunAllVerbs(arguments, folder);
    const std::string said = arguments.empty() ? "nothing" : arguments.back();
    EXPECT_EQ(quick.exit_code, all.exit_code) << said;
    EXPECT_EQ(WithoutOthers(quick.out), all.out) << said;
    EXPECT_EQ(quick.err, all.err) << said;
  }
}

TEST(QuickStart, SaysWhatItIsBuiltOf) {
  const Outcome said = RunLuxfield({"--version"}, FreshFolder("quick_version"));
  EXPECT_EQ(said.exit_code, 0) << said.err;
  EXPECT_THAT(said.out, testing::StartsWith("luxfield " LUXFIELD_VERSION "\ncommit     "));
  EXPECT_THAT(said.out,
              testing::ContainsRegex("\nbuild      [A-Z].*, [A-Za-z]+ [0-9.]+, with .*tests"));
  EXPECT_THAT(said.out, testing::ContainsRegex("\nlibraries  .*OpenEXR [0-9]+\\.[0-9]+"));
  EXPECT_THAT(said.out, testing::Not(testing::ContainsRegex(" \n")));
}

TEST(QuickStart, ListsTheBenchesAndHandsThemOver) {
  const auto folder = FreshFolder("quick_bench");
  EXPECT_THAT(RunLuxfield({"--help"}, folder).out, HasSubstr("\n  bench "));
  const Outcome help = RunLuxfield({"bench", "--help"}, folder);
  EXPECT_EQ(help.exit_code, 0) << help.err;
  EXPECT_THAT(help.out, HasSubstr("stacks"));
}

TEST(QuickStart, HandsOverWhatItDoesNotDo) {
  const auto folder = FreshFolder("quick_hands_over");
  const Outcome help = RunLuxfield({"render", "--help"}, folder);
  EXPECT_EQ(help.exit_code, 0) << help.err;
  EXPECT_THAT(help.out, HasSubstr("--light-groups"));
  const Outcome scene = RunLuxfield({"info", SourceFile("data/plans/small.toml").string()}, folder);
  EXPECT_EQ(scene.exit_code, 0) << scene.err;
  EXPECT_THAT(scene.out, HasSubstr("capture plan"));
}

// A copy without the other program beside it, then with that where an installation has it.
TEST(QuickStart, FindsTheOtherProgramOrSaysThatItIsMissing) {
  const auto folder = FreshFolder("quick_finds");
  std::filesystem::create_directories(folder / "bin");
  std::filesystem::copy_file(BuiltProgram("luxfield"), folder / "bin" / "luxfield");
  const std::vector<std::string> words = {(folder / "bin" / "luxfield").string(), "sky", "--help"};
  const Outcome without = RunProgram(words, folder);
  EXPECT_EQ(without.exit_code, 3);
  EXPECT_THAT(without.err, HasSubstr("luxfield-verbs, the program of `sky`"));
  EXPECT_THAT(without.err, HasSubstr("install luxfield anew"));
  std::filesystem::create_directories(folder / "libexec" / "luxfield");
  std::filesystem::create_symlink(BuiltProgram("luxfield-verbs"),
                                  folder / "libexec" / "luxfield" / "luxfield-verbs");
  const Outcome with = RunProgram(words, folder);
  EXPECT_EQ(with.exit_code, 0) << with.err;
  EXPECT_THAT(with.out, HasSubstr("turbidity"));
}

}  // namespace
}  // namespace luxfield::e2e
