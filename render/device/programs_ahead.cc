#include "luxfield/render/device/programs_ahead.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/render/device/program_cache.h"

namespace luxfield::render {
namespace {

// A line for each: the path, a blank, the options.
std::string Text(const std::set<ProgramName>& names) {
  std::string text;
  for (const auto& [path, options] : names) text += fmt::format("{} {}\n", path, options);
  return text;
}

std::vector<ProgramName> Names(std::string_view text) {
  std::vector<ProgramName> names;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const auto blank = line.find(' ');
    if (blank != std::string_view::npos)
      names.push_back({std::string(line.substr(0, blank)), std::string(line.substr(blank + 1))});
  }
  return names;
}

}  // namespace

ProgramsAhead::ProgramsAhead(const Device& device, const std::string& work) : device_(device) {
  if (!KeepsKernelsItself(device.info())) return;
  key_ = core::KeyOfThisBuild("programs", fmt::format("{}\n{}", device.info().name, work));
  if (key_) kept_ = core::FindInCache(*key_).value_or("");
  if (kept_.empty()) return;
  thread_ = std::jthread([device, names = Names(kept_)](const std::stop_token& stop) {
    for (const ProgramName& name : names) {
      if (stop.stop_requested()) return;
      try {
        Program::BuildText(device, EmbeddedSource(name.path), name.path, name.options);
      } catch (const std::exception&) {
        return;  // who asks for it meets the same
      }
    }
  });
}

ProgramsAhead::~ProgramsAhead() {
  if (!key_ || std::uncaught_exceptions() > running_exceptions_) return;
  const std::string asked = Text(device_.programs().Asked());
  if (asked != kept_) core::PutIntoCache(*key_, asked);
}

}  // namespace luxfield::render
