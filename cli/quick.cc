#include "luxfield/cli/quick.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
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

// As the verbs' files say it; tests/e2e/quick_start_test.cc holds both programs' help to each
// other.
constexpr std::array<VerbName, 20> kVerbs = {{
    {"devices", "List drivers, ports, a lab's devices and OpenCL devices; test a device"},
    {"simulate", "Write the true light field of a simulated lab, to judge a measurement by"},
    {"sky",
     "The sun and the sky, clear or with clouds, of a place and time as an environment map, or of "
     "a day as a sequence"},
    {"plan",
     "Expand a plan against a lab: positions, exposures, time, bytes; or find the plan that a "
     "scene needs for an error"},
    {"capture",
     "Measure a plan into a session folder; Ctrl-Z pauses a light field and goes on, Ctrl-C ends, "
     "--resume continues"},
    {"verify", "Check every byte of a session; --salvage keeps what is whole of a damaged one"},
    {"report",
     "How a session went, as a page: what is whole, drift, exposures, re-shoots, temperatures, "
     "stage, lamp supply"},
    {"calibrate", "Calibrate parts of a lab: sensor, response, geometry, flat field, glare"},
    {"filter", "Print optical filters, and measure them"},
    {"probe", "A bracketed photograph of a mirroring ball or a fisheye sky as an environment map"},
    {"merge",
     "Merge the exposure brackets of a session into irradiance, or a stack of pictures into "
     "radiance, with error bars"},
    {"reconstruct", "Solve measurements for the coefficient images of the light field"},
    {"budget",
     "Where the uncertainty of radiance, flux and irradiance comes from: noise, exposure, drift, "
     "stage, geometry, filter, stray light, missing positions, light meter, basis"},
    {"import", "Turn a ray file into light fields"},
    {"preprocess", "Build the sampling tables of a light field"},
    {"render", "Light a scene with measured luminaires and environment maps"},
    {"relight", "Scale lights of a picture of 'render --light-groups'"},
    {"info", "What a file or session is, and whether it is whole"},
    {"compare", "How far picture (or light field) A is from the reference B"},
    {"demo", "The whole chain on a simulated headlight, with a report"},
}};

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
  std::vector<VerbName> verbs(kVerbs.begin(), kVerbs.end());
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
        program.AddVerb(std::string(verb.name), std::string(verb.description), {});
  });
}

}  // namespace luxfield::cli
