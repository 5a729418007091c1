#include "luxfield/shard/job_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include "luxfield/core/config.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::shard {
namespace {

// A value, or each of a list's.
std::vector<std::string> WordsOf(const JobFile& job, const std::string& field,
                                 const toml::node& node) {
  const auto word = [&](const toml::node& value) -> std::string {
    if (const auto* text = value.as_string()) return text->get();
    if (const auto* integer = value.as_integer()) return fmt::format("{}", integer->get());
    if (const auto* number = value.as_floating_point()) return fmt::format("{}", number->get());
    if (const auto* boolean = value.as_boolean()) return boolean->get() ? "true" : "false";
    job.Fail(field, "must be text in quotes, a number, true or false, or a list of these");
  };
  const toml::array* list = node.as_array();
  if (!list) return {word(node)};
  std::vector<std::string> words;
  for (const auto& element : *list) words.push_back(word(element));
  return words;
}

}  // namespace

void JobFile::Fail(const std::string& field, const std::string& problem,
                   const std::string& remedy) const {
  throw InputError(file.string(), fmt::format("{} {}", field, problem), remedy);
}

std::filesystem::path JobFile::Path(const std::string& path) const {
  return (std::filesystem::absolute(file).parent_path() / path).lexically_normal();
}

JobFile ReadJobFile(const std::filesystem::path& path) {
  const std::string text = core::ReadFile(path);
  const core::Config whole = core::Config::FromString(text, path.string());
  const core::Config job = whole.Table("job");
  JobFile result;
  result.file = path;
  result.verb = job.Text("verb");
  result.output = result.Path(job.Text("output"));
  result.shards = job.Integer("shards", 1, kMostShards);
  const bool has_input = job.Has("input");
  if (!has_input) job.Fail("input", "is missing", "name the verb's input");
  job.Finish();

  // The syntax is right: the words that no Config hands out.
  const toml::table table = toml::parse(text);
  for (const std::string& input :
       WordsOf(result, "job.input", *table.get("job")->as_table()->get("input")))
    result.inputs.push_back(result.Path(input));
  if (result.inputs.empty()) result.Fail("job.input", "names nothing", "name a file or a session");
  for (const auto& [key, value] : table) {
    if (key.str() == "job") continue;
    if (key.str() != "options")
      result.Fail(std::string(key.str()), "is not known", "known here: job, options");
    const toml::table* options = value.as_table();
    if (!options) result.Fail("options", "must be a table", "write it as [options]");
    for (const auto& [name, option] : *options)
      result.options[std::string(name.str())] =
          WordsOf(result, fmt::format("options.{}", name.str()), option);
  }
  return result;
}

}  // namespace luxfield::shard
