// The contract scripts rely on: exit codes, one sentence on stderr, nothing half-written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <map>
#include <sstream>

#include "luxfield/cli/program.h"
#include "program.h"

namespace luxfield::e2e {
namespace {

// Names that a --help lists under "Subcommands:", in its order.
std::vector<std::string> Listed(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  bool listing = false;
  for (std::string line; std::getline(lines, line);) {
    if (listing && line.starts_with("  ") && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line.empty()) listing = false;
    if (line == "Subcommands:") listing = true;
  }
  return names;
}

using Names = std::vector<std::string>;

// The verbs as a user knows them: one that gets lost, or that nobody lists here, is a failure.
const Names kVerbs = {"devices",
                      "simulate",
                      "sky",
                      "plan",
                      "capture",
                      "verify",
                      "report",
                      "calibrate",
                      "filter",
                      "probe",
                      "merge",
                      "reconstruct",
                      "budget",
                      "import",
                      "export",
                      "preprocess",
                      "render",
                      "relight",
                      "shard",
                      "info",
                      "compare",
                      "bench",
                      "cache",
                      "demo",
                      "photometry"
#ifdef LUXFIELD_VIEW
                      ,
                      "view"
#endif
};
const std::map<std::string, Names> kGroups = {
    {"shard", {"plan", "run", "status", "gather", "submit"}},
    {"calibrate", {"geometry", "flat-field", "glare", "response", "sensor"}},
    {"filter", {"print", "measure", "photograph"}},
    {"bench",
     {"solve",     "nearfield", "lamps",      "sampling", "shadows",      "environment", "balance",
      "capture",   "errors",    "budget",     "filters",  "conditioning", "stacks",      "merge",
      "exposures", "rigs",      "plan",       "tradeoff", "calibrate",    "accuracy",    "scale",
      "spacing",   "keep",      "signed",     "noise",    "volume",       "all",         "rays",
      "ray-files", "classical", "error-runs", "peers",    "memory",       "pictures"}}};

// Embree and OpenCV have loops of their own on the same threads.
TEST(CommandLine, ThreadsLimitLoopsOfOtherLibraries) {
  std::size_t allowed = 0;
  cli::Program program;
  program.AddVerb("info", [&] {
    allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return core::Json::object();
  });
  std::array<std::string, 4> words = {"luxfield", "info", "--threads", "1"};
  std::array<char*, 4> argv{};
  for (std::size_t k = 0; k < words.size(); ++k) argv[k] = words[k].data();
  EXPECT_EQ(program.Run(4, argv.data()), 0);
  EXPECT_EQ(allowed, 1);
}

TEST(CommandLine, HelpListsEveryVerbAndExitsZero) {
  const auto folder = FreshFolder("help");
  const std::string readme = ReadText(SourceFile("README.md")),
                    page = ReadText(SourceFile("docs/verbs.md"));
  const auto expect_help = [&](Names words) {
    words.push_back("--help");
    const Outcome help = RunLuxfield(words, folder);
    EXPECT_EQ(help.exit_code, 0) << words[0];
    return help.out;
  };
  EXPECT_THAT(Listed(expect_help({})), testing::UnorderedElementsAreArray(kVerbs));
  for (const std::string& verb : kVerbs) {
    EXPECT_NE(readme.find("`" + verb), std::string::npos) << verb << " is not in README.md";
    EXPECT_NE(page.find("`" + verb), std::string::npos) << verb << " is not in docs/verbs.md";
    const std::string help = expect_help({verb});
    const auto group = kGroups.find(verb);
    if (group == kGroups.end()) {
      EXPECT_NE(help.find("--json"), std::string::npos) << verb;
      continue;
    }
    EXPECT_THAT(Listed(help), testing::UnorderedElementsAreArray(group->second)) << verb;
    for (const std::string& name : group->second) {
      const std::string of_name = expect_help({verb, name});
      EXPECT_NE(of_name.find("--json"), std::string::npos) << verb << " " << name;
      // An option belongs to the benches that have a use for it, and to no other.
      if (verb == "bench") {
        EXPECT_EQ(of_name.find("--plan ") != std::string::npos,
                  name == "errors" || name == "filters" || name == "plan" || name == "spacing")
            << name;
      }
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(CommandLine, AGroupNamesWhatItHasWhereTheNameIsWrong) {
  const auto folder = FreshFolder("group_help");
  for (const auto& [group, names] : kGroups) {
    const Outcome wrong = RunLuxfield({group, "everything", "--spp", "3"}, folder),
                  none = RunLuxfield({group}, folder);
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_EQ(none.exit_code, 2);
    EXPECT_NE(wrong.err.find("'everything'"), std::string::npos) << wrong.err;
    for (const std::string& name : names) {
      EXPECT_NE(wrong.err.find(name), std::string::npos) << wrong.err;
      EXPECT_NE(none.err.find(name), std::string::npos) << none.err;
    }
  }
  std::filesystem::remove_all(folder);
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
        {"view"},  // also where it is not built
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

TEST(CommandLine, ReconstructNamesWhatItCanKeep) {
  const auto folder = FreshFolder("keep");
  const Outcome outcome =
      RunLuxfield({"reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--keep", "energy"}, folder);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("--keep 'energy'"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("moments, flux or none"), std::string::npos) << outcome.err;
  const Outcome metric = RunLuxfield({"reconstruct", "x.meas.exr", "-o", "x.lf.exr",
                                      "--non-negative", "--non-negative-metric", "radiance"},
                                     folder);
  EXPECT_EQ(metric.exit_code, 2);
  EXPECT_NE(metric.err.find("coefficients or irradiance"), std::string::npos) << metric.err;
  const Outcome alone = RunLuxfield(
      {"reconstruct", "x.meas.exr", "-o", "x.lf.exr", "--non-negative-metric", "irradiance"},
      folder);
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("requires --non-negative"), std::string::npos) << alone.err;
  std::filesystem::remove_all(folder);
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
        Reader{"photometry", {"photometry", "@", "-o", "output.html"}, ".lf.exr"},
        Reader{"import", {"import", "@", "-o", "output.lf.exr"}, ".tm25ray"},
        Reader{"export", {"export", "@", "-o", "output.ies"}, ".lf.exr"},
        Reader{"preprocess", {"preprocess", "@", "-o", "output.tab.exr"}, ".lf.exr"},
        Reader{"reconstruct", {"reconstruct", "@", "-o", "output.lf.exr"}, ".meas.exr"},
        Reader{"merge", {"merge", "@", "-o", "output.meas.exr"}, ".session"},
        Reader{"verify", {"verify", "@"}, ".session"},
        Reader{"report", {"report", "@", "-o", "output.html"}, ".session"},
        Reader{"calibrate", {"calibrate", "sensor", "@", "-o", "output.cal.json"}, ".session"},
        Reader{"calibrate_geometry",
               {"calibrate", "geometry", "@", "-o", "output.cal.json"},
               ".session"},
        Reader{"calibrate_glare", {"calibrate", "glare", "@", "-o", "output.cal.json"}, ".session"},
        Reader{"calibrate_flat_field",
               {"calibrate", "flat-field", "@", "-o", "output.flat.exr"},
               ".session"},
        Reader{"calibrate_response",
               {"calibrate", "response", "@", "@", "-o", "output.cal.json", "--exposure", "1,2"},
               ".png"},
        Reader{"filter_measure", {"filter", "measure", "@", "-o", "output.filter.exr"}, ".session"},
        Reader{"filter_print", {"filter", "print", "--lab", "@", "-o", "output"}, ".toml"},
        Reader{"filter_tone",
               {"filter", "print", "--spacing", "20mm", "--tone", "@", "-o", "output"},
               ".tone.toml"},
        Reader{"filter_photograph", {"filter", "photograph", "@", "-o", "output"}, ".toml"},
        Reader{"budget", {"budget", "@", "--report", "output.html"}, ".session"},
        Reader{"render", {"render", "@", "-o", "output.exr"}, ".toml"},
        Reader{"render_lf",
               {"render", SourceFile("data/scenes/demo.toml"), "--light-field", "@", "-o",
                "output.exr"},
               ".lf.exr"},
        Reader{"relight", {"relight", "@", "--scale", "lamp=0.5", "-o", "output.exr"}, ".exr"},
        Reader{"plan", {"plan", "@", "--lab", Lab()}, ".toml"},
        Reader{"plan_lab", {"plan", Plan(), "--lab", "@"}, ".toml"},
        Reader{"devices_lab", {"devices", "@"}, ".toml"},
        Reader{"capture", {"capture", "@", "output.session", "--lab", Lab()}, ".toml"},
        Reader{"capture_lab", {"capture", Plan(), "output.session", "--lab", "@"}, ".toml"},
        Reader{"simulate", {"simulate", "@", "--plan", Plan(), "-o", "output.lf.exr"}, ".toml"}),
    [](const auto& reader) { return reader.param.name; });

}  // namespace
}  // namespace luxfield::e2e
