#include "luxfield/render/device/program_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <sstream>
#include <stdexcept>

namespace luxfield::render {
namespace {

using Choices = std::vector<std::string>;

const Choices kGlossy = {"-D GLOSSY=0", "-D GLOSSY=1"}, kTasks = {"-D TASKS=0", "-D TASKS=1"},
              kProposals = {"-D PROPOSAL=BASIS", "-D PROPOSAL=UNIFORM", ""},
              kDraws = {"-D DRAWS_ONLY=1", ""};  // `luxfield bench` times draws alone
// COMBINE and SHARES of kernels/mis/mis.clh, as the strategies of estimators/knobs.h need them.
const Choices kStrategies = {"-D COMBINE=0 -D SHARES=0", "-D COMBINE=1 -D SHARES=0",
                             "-D COMBINE=2 -D SHARES=0", "-D COMBINE=3 -D SHARES=0",
                             "-D COMBINE=4 -D SHARES=0", "-D COMBINE=0 -D SHARES=3",
                             "-D COMBINE=1 -D SHARES=2", "-D COMBINE=0 -D SHARES=1"};

// The options with one blank between them.
std::string Plain(const std::string& options) {
  std::istringstream in(options);
  std::string plain;
  for (std::string word; in >> word;) plain += (plain.empty() ? "" : " ") + word;
  return plain;
}

// A file with one of each of `choices`, in every way.
void Add(const std::string& file, std::initializer_list<Choices> choices,
         std::vector<ProgramName>& programs) {
  std::vector<std::string> options = {""};
  for (const Choices& alternatives : choices) {
    std::vector<std::string> longer;
    for (const std::string& begin : options)
      for (const std::string& one : alternatives) longer.push_back(Plain(begin + " " + one));
    options = std::move(longer);
  }
  for (std::string& one : options)
    programs.push_back({fmt::format("kernels/{}", file), std::move(one)});
}

std::vector<ProgramName> MakeList() {
  std::vector<ProgramName> all;
  for (const char* file :
       {"environment/environment_background.cl", "environment/environment_tables.cl",
        "film/film.cl", "lights/select_lights.cl", "lights/significant_lights.cl",
        "luminaire/patch_maps.cl", "luminaire/patch_shares.cl", "luminaire/shadow_maps.cl",
        "luminaire/volume.cl", "mis/environment_shares.cl", "scene/gbuffer.cl", "scene/trace.cl"})
    Add(file, {}, all);
  Add("environment/environment.cl", {kGlossy, {"-D COUNT_USEFUL=1", ""}}, all);
  Add("luminaire/exact.cl", {{"-D SHADOW_MAPS=0", "-D SHADOW_MAPS=1"}}, all);
  Add("luminaire/gloss.cl", {{"-D GLOSSY=1"}}, all);
  Add("luminaire/visible_share.cl", {kGlossy}, all);
  Add("luminaire/window_masses.cl", {kTasks}, all);
  Add("luminaire/cells.cl", {kGlossy, kTasks, kDraws}, all);
  Add("luminaire/precomputed.cl", {kGlossy, kTasks, kDraws}, all);
  Add("luminaire/thesis.cl", {kGlossy, kTasks}, all);
  Add("luminaire/windowed.cl", {kGlossy, kTasks, kProposals, kDraws}, all);
  for (const char* light : {"cells", "classical_area", "rectangle", "sphere"})
    Add(fmt::format("mis/mis_{}.cl", light), {kGlossy, kTasks, kStrategies}, all);
  Add("mis/mis_classical_line.cl", {kGlossy, kTasks, {"-D COMBINE=3 -D SHARES=0"}}, all);
  Add("mis/mis_environment.cl", {kGlossy, {"-D TASKS=0"}, kStrategies}, all);
  Add("mis/pilot_shares.cl", {kGlossy, kTasks}, all);
  Add("sample/visible_light.cl", {kGlossy}, all);
  return all;
}

}  // namespace

const std::vector<ProgramName>& AllPrograms() {
  static const std::vector<ProgramName> all = MakeList();
  return all;
}

void RequireListed(const ProgramName& name) {
  const auto& all = AllPrograms();
  const ProgramName plain{name.path, Plain(name.options)};
  if (std::find(all.begin(), all.end(), plain) == all.end())
    throw std::logic_error(
        fmt::format("AllPrograms() lacks {} with '{}'", plain.path, plain.options));
}

}  // namespace luxfield::render
