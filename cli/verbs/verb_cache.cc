// luxfield cache [--clear] [--size [LIMIT]] [--compile SURFACES]
#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>

#include "luxfield/cli/program.h"
#include "luxfield/core/cache.h"
#include "luxfield/core/error.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/accuracy/pilot_kernels.h"

namespace luxfield::cli {
namespace {

struct Options {
  bool clear = false;
  const CLI::Option* size = nullptr;  // --size, alone or with a limit
  std::string limit;                  // "2GiB"; empty: as it is
  std::string compile, device;        // surfaces; empty: nothing is compiled
};

const std::map<std::string, render::PilotSurfaces> kSurfaces{
    {"lambertian", render::PilotSurfaces::kLambertian}, {"glossy", render::PilotSurfaces::kGlossy}};

double CompileSeconds(const Options& options, int threads) {
  const core::Stopwatch stopwatch;
  const render::Device device = render::Device::Open(options.device, threads);
  const render::PilotSurfaces surfaces = kSurfaces.at(options.compile);
  render::CompilePilotKernels(device, surfaces);
  if (const auto key = render::PilotKernelsKey(device, surfaces)) core::PutIntoCache(*key, "begun");
  return stopwatch.WallSeconds();
}

core::Json ToJson(const core::CacheUse& use) {
  core::Json kinds = core::Json::object();
  for (const auto& [name, kind] : use.kinds)
    kinds[name] = {{"entries", kind.entries}, {"bytes", kind.bytes}};
  return {{"folder", use.folder.string()},
          {"used", use.unused.empty()},
          {"kinds", kinds},
          {"bytes", use.bytes},
          {"limit_bytes", use.limit_bytes}};
}

void Print(const core::CacheUse& use) {
  fmt::print("{}{}\n", use.folder.empty() ? "no folder" : use.folder.string(),
             use.unused.empty() ? std::string() : ", not used: " + use.unused);
  for (const auto& [name, kind] : use.kinds)
    fmt::print("  {:<20}  {:>6} of {}\n", name, kind.entries,
               FormatBytes(static_cast<double>(kind.bytes)));
  fmt::print("  in all                {} of at most {}\n",
             FormatBytes(static_cast<double>(use.bytes)),
             FormatBytes(static_cast<double>(use.limit_bytes)));
}

core::Json Run(const Options& options, const Common& common) {
  if (!options.limit.empty()) {
    const double bytes = ParseQuantity(
        options.limit, "--size", {{"KiB", 0x1p10}, {"MiB", 0x1p20}, {"GiB", 0x1p30}, {"B", 1}});
    if (!(bytes >= 1 && bytes <= 0x1p50))
      throw InputError(
          fmt::format("--size '{}' is no size to keep; give 1B to 1048576GiB, or "
                      "--clear to remove all",
                      options.limit));
    core::LimitCache(static_cast<std::uint64_t>(bytes));
  }
  core::Json json;
  if (options.clear) {
    const std::uint64_t freed = core::ClearCache();
    fmt::print("freed {}\n", FormatBytes(static_cast<double>(freed)));
    json["freed_bytes"] = freed;
  }
  if (!options.compile.empty()) {
    json["compile_s"] = CompileSeconds(options, common.threads);
    fmt::print("compiled in {:.1f} s\n", json["compile_s"].get<double>());
  }
  const core::CacheUse use = core::CacheInUse();
  if (options.size->count() > 0 && options.limit.empty())
    fmt::print("{}\n", use.bytes);
  else if (!options.clear && options.compile.empty())
    Print(use);
  json.update(ToJson(use));
  return json;
}

}  // namespace

void AddCache(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb =
      program.AddVerb("cache", [options, &program] { return Run(*options, program.common()); });
  verb.add_flag("--clear", options->clear, "Remove all that is kept");
  options->size =
      verb.add_option("--size", options->limit,
                      "Bytes that are kept now; with a value, as 2GiB, the most that are kept from "
                      "now on")
          ->expected(0, 1);
  verb.add_option(
          "--compile", options->compile,
          "Compile the kernels that render --error tries for surfaces of this kind, so that the "
          "first picture does not wait for them")
      ->check(CLI::IsMember({"lambertian", "glossy"}));
  verb.add_option("--device", options->device, "OpenCL device (default: the first)");
}

}  // namespace luxfield::cli
