// luxfield export --to radiance, blender, mitsuba --check: another program lights with the exported
// lamp, and its illuminances stand beside the exact ones (docs/bridges.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "luxfield/core/json.h"

namespace luxfield::cli {

struct ForeignJudge {
  std::string name;  // of --to
  std::filesystem::path python, sheet;
};

// The Python of the folder that bridges/judges/install filled, $LUXFIELD_FOREIGN or the source tree's
// build/foreign, and the script bridges/judges/sheet.py. Throws InputError where one is not there, or
// where no program judges exports to `name`.
ForeignJudge FindJudge(std::string_view name);

// Writes sheet.html and sheet.json into the folder OUTPUT.check, where OUTPUT stands without its ending,
// prints a summary, and returns the rows of `--check --json`. `field`: the light field that was
// exported, of whose flux the program leaves out `negative_share`. Throws an Error of exit code 1
// where the program deviates by more than docs/bridges.md allows, InputError where it did not answer.
core::Json WriteConformanceSheet(const ForeignJudge& judge, const std::filesystem::path& field,
                                 const std::filesystem::path& output, std::uint64_t seed,
                                 double negative_share);

}  // namespace luxfield::cli
