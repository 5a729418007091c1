#include "luxfield/core/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <set>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/nearest.h"

namespace luxfield::core {

struct Config::Node {
  std::string file;
  std::filesystem::path folder;
  std::string prefix;                       // "camera." inside table camera
  std::shared_ptr<const toml::table> root;  // keeps `table` alive
  const toml::table* table = nullptr;
  std::set<std::string, std::less<>> known;
  std::vector<std::shared_ptr<Node>> children;

  const toml::node* Find(std::string_view key) {
    known.insert(std::string(key));
    return table->get(key);
  }
  // One node per table, so that keys read through either of two handles are known to both.
  std::shared_ptr<Node> Child(const toml::table& child, const std::string& name) {
    for (const auto& existing : children)
      if (existing->table == &child) return existing;
    auto node = std::make_shared<Node>();
    node->file = file;
    node->folder = folder;
    node->prefix = prefix + name + ".";
    node->root = root;
    node->table = &child;
    children.push_back(node);
    return node;
  }
};

namespace {

std::string Show(const toml::node& node) {
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

// toml++ refuses to convert integers that no double holds; here they are rounded.
double AsDouble(const toml::node& number) {
  if (const auto* integer = number.as_integer()) return static_cast<double>(integer->get());
  return number.as_floating_point()->get();
}

}  // namespace

Config Config::FromString(std::string_view text, const std::string& name) {
  auto node = std::make_shared<Node>();
  node->file = name;
  node->folder = std::filesystem::path(name).parent_path();
  try {
    node->root = std::make_shared<const toml::table>(toml::parse(text));
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}: line {}: {}; mend the TOML syntax there", name,
                                 error.source().begin.line, std::string(error.description())));
  }
  node->table = node->root.get();
  return Config(node);
}

Config Config::FromFile(const std::filesystem::path& path) {
  constexpr std::uintmax_t kLongest = std::uintmax_t{16} << 20;  // nobody writes as much by hand
  return FromString(ReadAtMost(path, kLongest), path.string());
}

const std::string& Config::file() const { return node_->file; }

std::string Config::Name(std::string_view key) const { return node_->prefix + std::string(key); }

void Config::Fail(std::string_view key, const std::string& problem,
                  const std::string& remedy) const {
  const toml::node* value = node_->table->get(key);
  const std::string shown =
      value && !value->is_table() && !value->is_array() ? " = " + Show(*value) : std::string();
  throw InputError(node_->file, fmt::format("{}{}{} {}", node_->prefix, key, shown, problem),
                   remedy);
}

void Config::FailMissing(std::string_view key, const std::string& remedy) const {
  std::vector<std::string> unasked;
  for (const auto& [other, value] : *node_->table)
    if (!node_->known.contains(other.str())) unasked.emplace_back(other.str());
  const auto nearest = Nearest(key, unasked);
  Fail(key, "is missing",
       nearest ? fmt::format("{}, or was '{}' to be it?", remedy, *nearest) : remedy);
}

bool Config::Has(std::string_view key) const { return node_->Find(key) != nullptr; }

bool Config::HasText(std::string_view key) const {
  const toml::node* node = node_->Find(key);
  return node && node->is_string();
}

double Config::Number(std::string_view key, Range range) const {
  const toml::node* node = node_->Find(key);
  if (!node) FailMissing(key, "add it");
  if (!node->is_number()) Fail(key, "must be a number");
  const double value = AsDouble(*node);
  if (!range.Holds(value))
    Fail(key, fmt::format("must lie in [{}, {}]", range.min, range.max),
         "choose a value in that range");
  return value;
}

double Config::Number(std::string_view key, double fallback, Range range) const {
  return Has(key) ? Number(key, range) : fallback;
}

int Config::Integer(std::string_view key, int min, int max) const {
  const toml::node* node = node_->Find(key);
  if (!node) FailMissing(key, "add it");
  const auto* integer = node->as_integer();
  if (!integer) Fail(key, "must be a whole number");
  const std::int64_t value = integer->get();
  if (value < min || value > max)
    Fail(key, fmt::format("must lie in [{}, {}]", min, max), "choose a value in that range");
  return static_cast<int>(value);
}

int Config::Integer(std::string_view key, int fallback, int min, int max) const {
  return Has(key) ? Integer(key, min, max) : fallback;
}

bool Config::Boolean(std::string_view key, bool fallback) const {
  const toml::node* node = node_->Find(key);
  if (!node) return fallback;
  const auto* boolean = node->as_boolean();
  if (!boolean) Fail(key, "must be true or false");
  return boolean->get();
}

std::string Config::Text(std::string_view key) const {
  const toml::node* node = node_->Find(key);
  if (!node) FailMissing(key, "add it");
  const auto* text = node->as_string();
  if (!text) Fail(key, "must be text in quotes");
  return text->get();
}

std::string Config::Text(std::string_view key, const std::string& fallback) const {
  return Has(key) ? Text(key) : fallback;
}

std::string Config::Choice(std::string_view key, const std::vector<std::string>& choices,
                           const std::optional<std::string>& fallback) const {
  if (fallback && !Has(key)) return *fallback;
  std::string text = Text(key);
  if (std::find(choices.begin(), choices.end(), text) == choices.end())
    Fail(key, "is not known", fmt::format("use one of: {}", fmt::join(choices, ", ")));
  return text;
}

std::vector<double> Config::Numbers(std::string_view key, std::size_t count) const {
  const toml::node* node = node_->Find(key);
  if (!node) FailMissing(key, "add it");
  const toml::array* array = node->as_array();
  if (!array) Fail(key, "must be a list of numbers in brackets");
  if (count && array->size() != count)
    Fail(key, fmt::format("has {} entries where {} belong", array->size(), count));
  std::vector<double> values;
  for (const auto& element : *array) {
    if (!element.is_number() || !Range{}.Holds(AsDouble(element)))
      Fail(key, fmt::format("must hold finite numbers only, within {:g}", kLargestNumber));
    values.push_back(AsDouble(element));
  }
  return values;
}

std::vector<double> Config::Numbers(std::string_view key, std::size_t count,
                                    const std::vector<double>& fallback) const {
  return Has(key) ? Numbers(key, count) : fallback;
}

std::vector<std::string> Config::Words(std::string_view key) const {
  const toml::node* node = node_->Find(key);
  if (!node) FailMissing(key, "add it");
  const auto word = [&](const toml::node& value) -> std::string {
    if (const auto* text = value.as_string()) return text->get();
    if (const auto* integer = value.as_integer()) return fmt::format("{}", integer->get());
    if (const auto* number = value.as_floating_point()) return fmt::format("{}", number->get());
    if (const auto* boolean = value.as_boolean()) return boolean->get() ? "true" : "false";
    Fail(key, "must be text in quotes, a number, true or false, or a list of these");
  };
  const toml::array* array = node->as_array();
  if (!array) return {word(*node)};
  std::vector<std::string> words;
  for (const auto& element : *array) words.push_back(word(element));
  return words;
}

std::filesystem::path Config::Path(std::string_view key) const {
  const std::filesystem::path path = Text(key);
  return path.is_absolute() ? path : node_->folder / path;
}

std::optional<Config> Config::OptionalTable(std::string_view key) const {
  const toml::node* node = node_->Find(key);
  if (!node) return {};
  const toml::table* table = node->as_table();
  if (!table) Fail(key, "must be a table", fmt::format("write it as [{}{}]", node_->prefix, key));
  return Config(node_->Child(*table, std::string(key)));
}

Config Config::Table(std::string_view key) const {
  auto table = OptionalTable(key);
  if (!table) FailMissing(key, fmt::format("add a table [{}{}]", node_->prefix, key));
  return *table;
}

std::vector<Config> Config::Tables(std::string_view key) const {
  std::vector<Config> tables;
  const toml::node* node = node_->Find(key);
  if (!node) return tables;
  const toml::array* array = node->as_array();
  if (!array || !array->is_homogeneous(toml::node_type::table))
    if (!array || !array->empty())
      Fail(key, "must be a list of tables",
           fmt::format("write each as [[{}{}]]", node_->prefix, key));
  for (std::size_t i = 0; i < array->size(); ++i)
    tables.push_back(
        Config(node_->Child(*array->get(i)->as_table(), fmt::format("{}[{}]", key, i))));
  return tables;
}

void Config::Finish() const {
  const std::vector<std::string> known(node_->known.begin(), node_->known.end());
  for (const auto& [key, value] : *node_->table) {
    if (node_->known.contains(key.str())) continue;
    const auto nearest = Nearest(key.str(), known);
    throw InputError(
        node_->file, fmt::format("{}{} is not a known key", node_->prefix, key.str()),
        fmt::format("{}known here: {}", nearest ? fmt::format("did you mean '{}'? ", *nearest) : "",
                    fmt::join(known, ", ")));
  }
  for (const auto& child : node_->children) Config(child).Finish();
}

}  // namespace luxfield::core
