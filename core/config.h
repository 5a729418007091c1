// TOML configuration that names file and field when something is wrong.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/core/range.h"

namespace luxfield::core {

// A table of a TOML file. Every getter marks its key as known; Finish() refuses keys nobody asked
// for, so that a misspelt key is an error and not a silent default. All errors are InputErrors of
// the form "lab.toml: camera.gain = -1 must be above 0; ...".
class Config {
 public:
  static Config FromFile(const std::filesystem::path& path);
  static Config FromString(std::string_view text, const std::string& name);

  bool Has(std::string_view key) const;
  bool HasText(std::string_view key) const;

  // Without a fallback the key is required. Numbers must be inside the range; those of a list
  // inside Range's own.
  double Number(std::string_view key, Range range = {}) const;
  double Number(std::string_view key, double fallback, Range range) const;
  int Integer(std::string_view key, int min, int max) const;
  int Integer(std::string_view key, int fallback, int min, int max) const;
  bool Boolean(std::string_view key, bool fallback) const;
  std::string Text(std::string_view key) const;
  std::string Text(std::string_view key, const std::string& fallback) const;
  // Text that must be one of the choices.
  std::string Choice(std::string_view key, const std::vector<std::string>& choices,
                     const std::optional<std::string>& fallback = {}) const;
  std::vector<double> Numbers(std::string_view key,
                              std::size_t count) const;  // count 0: any length
  std::vector<double> Numbers(std::string_view key, std::size_t count,
                              const std::vector<double>& fallback) const;
  // A value as words of a command line: text as it is, numbers and true or false in digits and
  // letters; of a list each of its entries.
  std::vector<std::string> Words(std::string_view key) const;
  // A path relative to the configuration file.
  std::filesystem::path Path(std::string_view key) const;

  Config Table(std::string_view key) const;  // required
  std::optional<Config> OptionalTable(std::string_view key) const;
  std::vector<Config> Tables(std::string_view key) const;  // [[key]]; may be empty

  void Finish() const;  // refuses unknown keys, here and in every table handed out

  const std::string& file() const;
  std::string Name(std::string_view key) const;  // as messages name it: "camera.position"
  // An InputError that names this file and field.
  [[noreturn]] void Fail(std::string_view key, const std::string& problem,
                         const std::string& remedy = {}) const;

 private:
  // Of a key that is required: names one that nobody has asked for and that is spelt like it.
  [[noreturn]] void FailMissing(std::string_view key, const std::string& remedy) const;
  struct Node;
  explicit Config(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

}  // namespace luxfield::core
