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

// Becomes the program that does `verb`; returns what is wrong where it cannot.
std::string HandOver(std::string_view verb, std::string_view program, char** argv) {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const auto beside = folder / program;
  const auto installed = folder / kInstalledIn / program;
  for (const auto& path : {beside, installed}) ::execv(path.c_str(), argv);
  return fmt::format(
      "{}, the program of `{}`, cannot be started from {} or {} ({}); install luxfield anew",
      program, verb, folder.string(), installed.parent_path().lexically_normal().string(),
      std::strerror(errno));
}

std::vector<VerbElsewhere> Listed(const std::vector<VerbElsewhere>& more) {
  std::vector<VerbElsewhere> verbs;
  for (const VerbName& verb : Verbs()) verbs.push_back({verb, kAllVerbs});
  verbs.insert(verbs.end() - 1, more.begin(), more.end());
  return verbs;
}

// The verb that another program does: neither nothing nor one option, `info` or a word that is no
// verb.
const VerbElsewhere* DoneElsewhere(int argc, char** argv, const std::vector<VerbElsewhere>& verbs) {
  if (argc < 2) return nullptr;
  const std::string_view word = argv[1];
  if (word.starts_with("-")) return argc == 2 ? nullptr : &verbs.front();  // its parser judges them
  if (word == "info") return nullptr;
  const auto found = std::find_if(verbs.begin(), verbs.end(), [&](const VerbElsewhere& other) {
    return other.verb.name == word;
  });
  return found == verbs.end() ? nullptr : &*found;
}

}  // namespace

int RunQuick(int argc, char** argv, const std::vector<VerbElsewhere>& more) {
  const std::vector<VerbElsewhere> verbs = Listed(more);
  if (const VerbElsewhere* other = DoneElsewhere(argc, argv, verbs)) {
    fmt::print(stderr, "luxfield: {}\n", HandOver(argv[1], other->program, argv));
    return 3;
  }
  return RunProgram(argc, argv, [&](Program& program) {
    for (const VerbElsewhere& other : verbs)
      if (other.verb.name == "info")
        AddInfo(program, [argv](const std::string&) -> core::Json {
          throw DeviceError(HandOver("info", kAllVerbs, argv));
        });
      else
        program.AddVerb(other.verb, {});
  });
}

}  // namespace luxfield::cli
