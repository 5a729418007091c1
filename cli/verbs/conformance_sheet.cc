#include "luxfield/cli/verbs/conformance_sheet.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "luxfield/cli/shared_file.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

extern char** environ;

namespace luxfield::cli {
namespace {

// Runs a program whose words on stdout go to stderr, where --json leaves room for them.
void RunToItsEnd(std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  pid_t process = -1;
  const int failed =
      posix_spawn(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0)
    throw InputError("--check", fmt::format("cannot start {}: {}", words[0], std::strerror(failed)),
                     "run ./run foreign again");
  while (waitpid(process, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::filesystem::path PythonOfJudges() {
  const char* named = std::getenv("LUXFIELD_FOREIGN");
  const std::filesystem::path folder =
      named && *named ? std::filesystem::path(named) : SharedFile("build/foreign");
  return folder / "bin/python";
}

}  // namespace

ForeignJudge FindJudge(std::string_view name) {
  if (name != "radiance" && name != "blender" && name != "mitsuba")
    throw InputError("--check", fmt::format("has no program that judges exports to {}", name),
                     "drop it: export itself says how far the model that it writes is off");
  const ForeignJudge judge{std::string(name), PythonOfJudges(),
                           SharedFile("bridges/judges/sheet.py")};
  if (std::filesystem::exists(judge.sheet) && std::filesystem::exists(judge.python)) return judge;
  throw InputError(
      "--check",
      fmt::format("asks {} for its illuminances, and {} is not there", name,
                  (std::filesystem::exists(judge.sheet) ? judge.python : judge.sheet).string()),
      "install the judges (./run foreign, or bridges/judges/install FOLDER and "
      "LUXFIELD_FOREIGN=FOLDER), or drop --check");
}

core::Json WriteConformanceSheet(const ForeignJudge& judge, const std::filesystem::path& field,
                                 const std::filesystem::path& output, std::uint64_t seed,
                                 double negative_share) {
  auto folder = output;
  folder.replace_extension(".check");
  std::error_code error;
  std::filesystem::remove(folder / "sheet.json", error);
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  RunToItsEnd({judge.python.string(), "-B", judge.sheet.string(), "--luxfield", program.string(),
               "--program", judge.name, "--seed", fmt::format("{}", seed), "-o", folder.string(),
               "--", field.string()});
  const auto written = folder / "sheet.json";
  if (!std::filesystem::exists(written))
    throw InputError("--check", fmt::format("{} gave no sheet", judge.sheet.string()),
                     "its words stand above");
  const core::Json sheet = core::ParseJson(core::ReadFile(written), written.string());
  const core::Json& facts = sheet.at("lamps").at(0).at("programs").begin().value();
  if (facts.contains("missing"))
    throw InputError("--check", facts.at("missing").get<std::string>(),
                     "run ./run foreign, or drop --check");
  const core::Json& receivers = facts.at("receivers");
  const auto percent = [&](const char* key) { return 100 * receivers.at(key).get<double>(); };
  const auto name = facts.at("program").get<std::string>();
  const int count = receivers.at("receivers").get<int>();
  fmt::print(
      "  check        {}: {:+.3f} +- {:.3f} % off the exact illuminance in the mean of {} "
      "receivers, {:.1f} % of them within 0.5 % and 3 standard errors\n"
      "  sheet        {}\n",
      name, percent("mean"), percent("mean_sigma"), count,
      percent("share_within_half_a_percent_and_3_sigma"), (folder / "sheet.html").string());
  if (!facts.at("agrees").get<bool>())
    throw Error(fmt::format("{}: {} deviates by more than 0.5 % and what its sampling leaves; the "
                            "sheet {} says where{}",
                            output.string(), name, (folder / "sheet.html").string(),
                            negative_share > 0
                                ? fmt::format("; it leaves out negative light, {:.2g} % of the "
                                              "flux: reconstruct --non-negative has none",
                                              100 * negative_share)
                                : std::string()),
                1);
  return {{{"format", judge.name},
           {"judge", name},
           {"receivers", count},
           {"max_rel_error", receivers.at("largest")},
           {"mc_sigma", receivers.at("median_sigma")},
           {"mean_rel_error", receivers.at("mean")},
           {"mean_sigma", receivers.at("mean_sigma")},
           {"stated_error", 0.005},
           {"sheet", (folder / "sheet.html").string()}}};
}

}  // namespace luxfield::cli
