#include "luxfield/cli/quick.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>

#include "luxfield/cli/info.h"
#include "luxfield/cli/run.h"
#include "luxfield/core/error.h"

namespace luxfield::cli {
namespace {

constexpr char kAllVerbs[] = "luxfield-verbs";
constexpr char kInstalledIn[] = "../libexec/luxfield";  // from the folder of this program

// Becomes the program of all verbs; returns what is wrong where it cannot.
std::string HandOver(char** argv) {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const auto beside = folder / kAllVerbs;
  const auto installed = folder / kInstalledIn / kAllVerbs;
  for (const auto& program : {beside, installed}) ::execv(program.c_str(), argv);
  return fmt::format(
      "{}, the program of all verbs, cannot be started from {} or {} ({}); install "
      "luxfield anew",
      kAllVerbs, folder.string(), installed.parent_path().lexically_normal().string(),
      std::strerror(errno));
}

std::vector<VerbName> Listed(const std::vector<VerbName>& more) {
  std::vector<VerbName> verbs(Verbs().begin(), Verbs().end());
  verbs.insert(verbs.end() - 1, more.begin(), more.end());
  return verbs;
}

// Whether the words are answered here: nothing, one option, `info`, or no verb.
bool IsQuick(int argc, char** argv, const std::vector<VerbName>& verbs) {
  if (argc < 2) return true;
  const std::string_view word = argv[1];
  if (word.starts_with("-")) return argc == 2;
  if (word == "info") return true;
  return std::none_of(verbs.begin(), verbs.end(),
                      [&](const VerbName& verb) { return verb.name == word; });
}

}  // namespace

int RunQuick(int argc, char** argv, const std::vector<VerbName>& more) {
  const std::vector<VerbName> verbs = Listed(more);
  if (!IsQuick(argc, argv, verbs)) {
    fmt::print(stderr, "luxfield: {}\n", HandOver(argv));
    return 3;
  }
  return RunProgram(argc, argv, [&](Program& program) {
    for (const VerbName& verb : verbs)
      if (verb.name == "info")
        AddInfo(program,
                [argv](const std::string&) -> core::Json { throw DeviceError(HandOver(argv)); });
      else
        program.AddVerb(verb, {});
  });
}

}  // namespace luxfield::cli
