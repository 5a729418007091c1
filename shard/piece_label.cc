#include "luxfield/shard/piece_label.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "luxfield/core/append_file.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::shard {
namespace {

constexpr char kBegin[] = "luxfield-piece ";
constexpr std::streamoff kMostBytes = 512;  // more than any label has

}  // namespace

std::string LabelOf(const Job& job, const PlannedShard& shard, const std::string& name,
                    const core::Json& figures) {
  return fmt::format("{}{} of {}, {} {} to {}, figures {}", kBegin, name, job.verb, job.axis,
                     shard.first, shard.last - 1, core::Sha256(TextOf(figures)).substr(0, 16));
}

void AddLabel(const std::filesystem::path& file, const std::string& label) {
  core::AppendToFile(file, "\n" + label + "\n");
}

std::string FindLabel(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const std::streamoff bytes = in.tellg(), tail = std::clamp<std::streamoff>(bytes, 0, kMostBytes);
  std::string end(static_cast<std::size_t>(tail), '\0');
  in.seekg(bytes - tail);
  if (!in.read(end.data(), tail))
    throw InputError(file.string(), "cannot be read", "check who may read it");
  const std::size_t begin = end.rfind(std::string("\n") + kBegin);
  if (begin == std::string::npos || end.back() != '\n') return "";
  return end.substr(begin + 1, end.size() - begin - 2);
}

void RemoveLabel(const std::filesystem::path& file) {
  const std::string label = FindLabel(file);
  if (label.empty()) return;
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - label.size() - 2);
}

}  // namespace luxfield::shard
