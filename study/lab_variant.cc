#include "study/lab_variant.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

#include "core/error.h"
#include "core/file.h"

namespace luxfield::study {
namespace {

toml::table Parse(const std::filesystem::path& lab) {
  try {
    return toml::parse(core::ReadFile(lab));
  } catch (const toml::parse_error& error) {
    throw InputError(
        lab.string(),
        fmt::format("line {}: {}", error.source().begin.line, std::string(error.description())),
        "mend the TOML syntax there");
  }
}

}  // namespace

std::vector<std::string> ErrorSources(const std::filesystem::path& lab) {
  const toml::table table = Parse(lab);
  std::vector<std::string> names;
  if (const toml::table* errors = table["errors"].as_table())
    for (const auto& [name, source] : *errors) names.emplace_back(name.str());
  return names;
}

void WriteLabVariant(const std::filesystem::path& lab, const std::vector<std::string>& enabled,
                     bool ideal, const std::filesystem::path& variant,
                     const std::vector<LabNumbers>& numbers) {
  toml::table table = Parse(lab);
  toml::table* errors = table["errors"].as_table();
  for (const auto& name : enabled)
    if (!errors || !errors->contains(name))
      throw InputError(lab.string(), fmt::format("has no table [errors.{}]", name),
                       "add it with its size");
  if (errors)
    for (auto&& [name, source] : *errors)
      if (toml::table* settings = source.as_table())
        settings->insert_or_assign(
            "enabled", std::find(enabled.begin(), enabled.end(), name.str()) != enabled.end());
  for (const auto& [source, key, values] : numbers) {
    toml::table* settings = errors ? (*errors)[source].as_table() : nullptr;
    if (!settings)
      throw InputError(lab.string(), fmt::format("has no table [errors.{}]", source),
                       "add it with its size");
    if (values.size() == 1) {
      settings->insert_or_assign(key, values[0]);
    } else {
      toml::array list;
      for (const double value : values) list.push_back(value);
      settings->insert_or_assign(key, std::move(list));
    }
  }
  if (toml::table* head = table["lab"].as_table()) head->insert_or_assign("ideal", ideal);
  if (toml::table* lamp = table["lamp"].as_table())
    if (const auto file = (*lamp)["file"].value<std::string>())
      lamp->insert_or_assign("file", std::filesystem::absolute(lab.parent_path() / *file).string());
  std::ostringstream text;
  text << table << '\n';
  core::WriteFileAtomically(variant, text.str());
}

std::vector<double> ReadLabNumbers(const std::filesystem::path& lab, const std::string& source,
                                   const std::string& key) {
  const toml::table table = Parse(lab);
  const auto node = table["errors"][source][key];
  if (const auto number = node.value<double>()) return {*number};
  std::vector<double> values;
  if (const toml::array* list = node.as_array())
    for (const auto& element : *list) values.push_back(element.value_or(0.0));
  return values;
}

}  // namespace luxfield::study
