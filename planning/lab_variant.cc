#include "luxfield/planning/lab_variant.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::planning {
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

// The variant may lie in another folder.
void Write(toml::table table, const std::filesystem::path& lab,
           const std::filesystem::path& variant) {
  if (toml::table* lamp = table["lamp"].as_table())
    if (const auto file = (*lamp)["file"].value<std::string>())
      lamp->insert_or_assign("file", std::filesystem::absolute(lab.parent_path() / *file).string());
  std::ostringstream text;
  text << kLabVariantMark << '\n' << table << '\n';
  core::WriteFileAtomically(variant, text.str());
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
  Write(std::move(table), lab, variant);
}

void WriteLabWithFilter(const std::filesystem::path& lab, const LabFilter& filter,
                        const std::filesystem::path& variant) {
  constexpr std::int64_t kFewest = 3, kMost = 64;  // what the simulated lab takes
  toml::table table = Parse(lab);
  const double before_m = table["filter"]["spacing_m"].value_or(filter.spacing_m);
  const auto nodes = static_cast<double>(table["sampling"]["u_per_cell"].value_or(kFewest));
  toml::table filters{{"kind", filter.dual ? "dual" : "basis"},
                      {"basis", filter.basis.name()},
                      {"spacing_m", filter.spacing_m}};
  if (filter.basis.kind == lightfield::BasisKind::kQuadratic)
    filters.insert_or_assign("basis_a", filter.basis.a);
  if (!filter.dual) filters.insert_or_assign("scale", filter.scale);
  table.insert_or_assign("filter", std::move(filters));
  toml::table sampling =
      table["sampling"].as_table() ? *table["sampling"].as_table() : toml::table{};
  const auto wanted = static_cast<std::int64_t>(std::ceil(nodes * filter.spacing_m / before_m));
  sampling.insert_or_assign("u_per_cell", std::clamp(wanted, kFewest, kMost));
  table.insert_or_assign("sampling", std::move(sampling));
  Write(std::move(table), lab, variant);
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

}  // namespace luxfield::planning
