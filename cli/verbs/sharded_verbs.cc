#include "luxfield/cli/verbs/sharded_verbs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "luxfield/cli/program.h"
#include "luxfield/cli/verbs/preprocess_task.h"
#include "luxfield/cli/verbs/render_task.h"
#include "luxfield/cli/verbs/verb_merge.h"
#include "luxfield/cli/verbs/verb_preprocess.h"
#include "luxfield/cli/verbs/verb_reconstruct.h"
#include "luxfield/core/error.h"
#include "luxfield/core/nearest.h"
#include "luxfield/shard/merge_task.h"
#include "luxfield/shard/reconstruct_task.h"

namespace luxfield::cli {
namespace {

// What makes a task of a parsed command line.
using Make = std::function<std::unique_ptr<shard::Task>(int threads)>;

struct ShardedVerb {
  std::string name;
  std::set<std::string> paths;                 // options whose values are files
  std::map<std::string, std::string> refused;  // options, and why
  bool several_inputs = false;
  std::function<Make(CLI::App&)> add;  // adds the verb's options
};

Make AddMergeTask(CLI::App& app) {
  auto options = std::make_shared<MergeOptions>();
  AddMergeOptions(app, options);
  return [options](int) {
    if (options->inputs.size() != 1 || !std::filesystem::is_directory(options->inputs[0]))
      throw InputError(options->inputs[0].string(),
                       "is no session's folder, and a stack of pictures is merged as a whole",
                       "run `luxfield merge` itself");
    RequireExtension(options->output, ".meas.exr", "job.output");
    return std::make_unique<shard::MergeTask>(options->inputs[0], options->output,
                                              HowToMerge(*options));
  };
}

Make AddReconstructTask(CLI::App& app) {
  auto options = std::make_shared<ReconstructVerbOptions>();
  AddReconstructOptions(app, options);
  return [options](int) {
    RequireExtension(options->output, ".lf.exr", "job.output");
    if (!options->sigma.empty()) RequireExtension(options->sigma, ".lf.exr", "options.sigma");
    const reconstruct::ReconstructOptions how = HowToReconstruct(*options);
    if (how.non_negative && how.metric == reconstruct::NonNegativeMetric::kIrradiance)
      throw InputError(
          "options.non-negative-metric = irradiance takes sums over all texels and cannot be cut "
          "into rows; leave it out, or run `luxfield reconstruct` itself");
    return std::make_unique<shard::ReconstructTask>(FilesOf(*options), how);
  };
}

Make AddPreprocessTask(CLI::App& app) {
  auto options = std::make_shared<PreprocessOptions>();
  AddPreprocessOptions(app, options);
  return [options](int) {
    RequireExtension(options->output, ".tab.exr", "job.output");
    return std::make_unique<PreprocessTask>(options->light_field, options->output);
  };
}

Make AddRenderTask(CLI::App& app) {
  auto options = std::make_shared<RenderVerbOptions>();
  auto seed = std::make_shared<std::uint64_t>(1);
  AddRenderOptions(app, options);
  app.add_option("--seed", *seed, "Of the samples");
  return [options, seed](int threads) {
    return std::make_unique<RenderTask>(SetUpRender(*options, *seed), threads);
  };
}

const std::vector<ShardedVerb>& ShardedVerbs() {
  constexpr const char* kSums = "takes sums over all texels";
  constexpr const char* kOneMachine = "is for one machine, and a shard is small by itself";
  constexpr const char* kOnePicture = "is for one picture";
  static const std::vector<ShardedVerb> verbs = {
      {"merge",
       {"calibration", "flat-field"},
       {{"exposure", "is for pictures, which are merged as a whole"}, {"memory", kOneMachine}},
       false,
       AddMergeTask},
      {"reconstruct",
       {"filter", "sigma"},
       {{"regularise", kSums}, {"memory", kOneMachine}},
       true,
       AddReconstructTask},
      {"preprocess",
       {},
       {{"scene", "reduces the light field as a whole"},
        {"max-error", "is of a reduction, which is of the whole"},
        {"receivers", "are of a reduction, which is of the whole"},
        {"memory", kOneMachine}},
       false,
       AddPreprocessTask},
      {"render",
       {"sequence", "light-field", "tables", "png", "radiance-map", "irradiance-map"},
       {{"error", kOnePicture},
        {"time", kOnePicture},
        {"reference", kOnePicture},
        {"memory", kOnePicture},
        {"display", "shows pictures as they are made"},
        {"resume", "is what shards do anyway"}},
       false,
       AddRenderTask}};
  return verbs;
}

const ShardedVerb* Find(const std::string& name) {
  const auto& verbs = ShardedVerbs();
  const auto verb = std::find_if(verbs.begin(), verbs.end(),
                                 [&](const ShardedVerb& one) { return one.name == name; });
  return verb == verbs.end() ? nullptr : &*verb;
}

// "NAME=FILE" or "FILE", FILE relative to job.toml.
std::string WithPath(const shard::JobFile& job, const std::string& word) {
  const auto equals = word.find('=');
  const std::string before = equals == std::string::npos ? "" : word.substr(0, equals + 1);
  return before + job.Path(word.substr(before.size())).string();
}

// The words of one option of [options].
void AddOption(const shard::JobFile& job, const ShardedVerb& verb, const CLI::Option& option,
               const std::string& name, std::vector<std::string>& words) {
  const std::string field = "options." + name;
  if (const auto why = verb.refused.find(name); why != verb.refused.end())
    job.Fail(field, why->second, "leave it out, or run the verb on one machine");
  const std::vector<std::string>& values = job.options.at(name);
  if (option.get_items_expected_max() == 0) {  // a flag
    if (values != std::vector<std::string>{"true"} && values != std::vector<std::string>{"false"})
      job.Fail(field, "must be true or false");
    if (values[0] == "true") words.push_back("--" + name);
    return;
  }
  const bool together = option.get_items_expected_min() > 1;
  if (together) words.push_back("--" + name);
  for (const std::string& value : values) {
    if (!together) words.push_back("--" + name);
    words.push_back(verb.paths.contains(name) ? WithPath(job, value) : value);
  }
}

// Throws InputError for options that the verb does not have.
void RequireKnown(const shard::JobFile& job, const std::vector<std::string>& known) {
  for (const auto& [name, words] : job.options) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const auto nearest = core::Nearest(name, known);
    job.Fail("options." + name, fmt::format("is no option of {}", job.verb),
             nearest ? fmt::format("did you mean '{}'?", *nearest)
                     : fmt::format("see `luxfield {} --help`", job.verb));
  }
}

}  // namespace

std::vector<std::string> WordsOf(const shard::JobFile& job) {
  const ShardedVerb* verb = Find(job.verb);
  std::vector<std::string> names;
  for (const ShardedVerb& one : ShardedVerbs()) names.push_back(one.name);
  if (!verb)
    job.Fail(fmt::format("job.verb = '{}'", job.verb),
             "cannot be cut into shards whose whole is what the verb writes",
             fmt::format("use one of {}", fmt::join(names, ", ")));
  if (job.inputs.size() > 1 && !verb->several_inputs)
    job.Fail("job.input",
             fmt::format("names {} files where {} takes one", job.inputs.size(), verb->name));
  std::vector<std::string> words;
  for (const auto& input : job.inputs) words.push_back(input.string());
  words.insert(words.end(), {"--output", job.output.string()});
  CLI::App app;
  verb->add(app);
  std::vector<std::string> known;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty() || option->get_positional()) continue;
    const std::string name = option->get_lnames().front();
    if (name == "help" || name == "output") continue;
    known.push_back(name);
    if (job.options.contains(name)) AddOption(job, *verb, *option, name, words);
  }
  RequireKnown(job, known);
  return words;
}

std::unique_ptr<shard::Task> MakeTask(const std::string& name,
                                      const std::vector<std::string>& words, int threads) {
  const ShardedVerb* verb = Find(name);
  if (!verb)
    throw InputError(
        fmt::format("the job's verb '{}' cannot be cut into shards; plan it anew", name));
  CLI::App app;
  app.set_help_flag();  // not among a job's words
  app.option_defaults()->always_capture_default();
  const Make make = verb->add(app);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    throw InputError(
        fmt::format("[options] of {}: {}; see `luxfield {} --help`", name, error.what(), name));
  }
  return make(threads);
}

}  // namespace luxfield::cli
