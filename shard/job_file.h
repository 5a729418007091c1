// job.toml: a verb, its input, its output, its options and into how many shards it is cut
// (docs/formats/job.md).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace luxfield::shard {

constexpr int kMostShards = 100000;

struct JobFile {
  std::filesystem::path file;
  std::string verb;
  std::vector<std::filesystem::path> inputs;  // absolute
  std::filesystem::path output;               // absolute
  int shards = 1;
  // [options] as words of a command line: text as it is, numbers in digits, true or false; of a list
  // each of its entries.
  std::map<std::string, std::vector<std::string>> options;

  // An InputError that names the file and the field.
  [[noreturn]] void Fail(const std::string& field, const std::string& problem,
                         const std::string& remedy = {}) const;
  // A path as it is meant in the file: relative to it.
  std::filesystem::path Path(const std::string& path) const;
};

// Throws InputError naming file and field. Which verbs can be cut, and which options they have, is
// not judged here.
JobFile ReadJobFile(const std::filesystem::path& path);

}  // namespace luxfield::shard
