#include "luxfield/bench/all/bench_all.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/render/device/device.h"
#include "luxfield/version.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

std::vector<WorkGroup> AllWorks() {
  std::vector<WorkGroup> all;
  for (auto* groups : {RayWorks, LightingWorks, ReconstructionWorks, ProgramWorks})
    for (WorkGroup& group : groups()) all.push_back(std::move(group));
  return all;
}

bool IsAsked(const Work& work, const AllOptions& options) {
  return options.works.empty() ||
         std::any_of(options.works.begin(), options.works.end(), [&](const std::string& part) {
           return work.name.find(part) != std::string::npos;
         });
}

std::vector<Figures> Measured(const WorkGroup& group, const AllOptions& options) {
  try {
    return group.measure(options);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    Figures none;
    none.limit = error.what();
    return std::vector<Figures>(group.works.size(), none);
  }
}

json TextOrNull(const std::string& text) { return text.empty() ? json() : json(text); }
json NumberOrNull(const std::optional<double>& value) { return value ? json(*value) : json(); }

std::string DeviceName(const AllOptions& options) {
  if (render::ListDevices().empty()) return "no OpenCL device";
  return render::Device::Open(options.device, options.threads).info().name;
}

}  // namespace

json RowOf(const Work& work, const Figures& figures) {
  const double target = figures.target.value_or(work.target);
  json value, ratio;
  if (!figures.runs.empty()) {
    const double median = core::Median(figures.runs);
    value = median;
    ratio = work.more_is_better ? target / median : median / target;
  }
  return {{"work", work.name},
          {"value", value},
          {"unit", work.unit},
          {"target", target},
          {"ratio_to_target", ratio},
          {"peer", TextOrNull(figures.peer)},
          {"peer_value", NumberOrNull(figures.peer_value)},
          {"limit", TextOrNull(figures.limit)},
          {"runs", figures.runs},
          {"core_s", NumberOrNull(figures.core_s)}};
}

json BenchAll(const AllOptions& options) {
  if (options.runs < 1) throw InputError("bench all: at least one run is needed");
  std::vector<WorkGroup> groups = AllWorks();
  std::erase_if(groups, [&](const WorkGroup& group) {
    return std::none_of(group.works.begin(), group.works.end(),
                        [&](const Work& work) { return IsAsked(work, options); });
  });
  if (groups.empty()) throw InputError("--work: no work has such a name; leave it out to see all");
  json result{
      {"device", DeviceName(options)}, {"version", LUXFIELD_VERSION}, {"rows", json::array()}};
  core::Progress progress("bench all", groups.size());
  for (const WorkGroup& group : groups) {
    core::ThrowIfInterrupted();
    const std::vector<Figures> figures = Measured(group, options);
    for (std::size_t k = 0; k < group.works.size(); ++k)
      if (IsAsked(group.works[k], options))
        result["rows"].push_back(RowOf(group.works[k], figures.at(k)));
    progress.Advance();
  }
  return result;
}

}  // namespace luxfield::bench
