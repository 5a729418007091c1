#include "luxfield/shard/job_folder.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/shard/piece_label.h"
#include "luxfield/version.h"

namespace luxfield::shard {
namespace {

using core::Field;

constexpr char kFormat[] = "luxfield-job";
constexpr int kVersion = 1;

std::filesystem::path JobJson(const std::filesystem::path& folder) { return folder / "job.json"; }

struct Stat {
  std::uintmax_t bytes = 0;
  std::int64_t modified_ns = 0;
};

Stat StatOf(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw InputError(file.string(), "cannot be read any more", "put it back, or plan the job anew");
  return {static_cast<std::uintmax_t>(status.st_size),
          std::int64_t{status.st_mtim.tv_sec} * 1000000000 + status.st_mtim.tv_nsec};
}

core::Json ToJson(const Job& job) {
  core::Json inputs = core::Json::array(), shards = core::Json::array();
  for (const PlannedInput& input : job.inputs)
    inputs.push_back({{"file", input.file.string()},
                      {"bytes", input.bytes},
                      {"modified_ns", input.modified_ns},
                      {"sha256", input.sha256}});
  for (const PlannedShard& shard : job.shards)
    shards.push_back({{"name", shard.name}, {"first", shard.first}, {"last", shard.last}});
  return {
      {"format", kFormat}, {"version", kVersion},         {"verb", job.verb}, {"words", job.words},
      {"axis", job.axis},  {"length", job.length},        {"inputs", inputs}, {"whole", job.whole},
      {"shards", shards},  {"luxfield", LUXFIELD_VERSION}};
}

// What a manifest says of its shard: more is a mistake.
constexpr core::Range kSeconds{0, 1e9}, kMebibytes{0, 1e9};

void RequireUtf8(const std::string& text) {
  if (core::Json::parse(TextOf(text)) != text)
    throw InputError(text, "is no UTF-8, in which job.json is written",
                     "rename the file or folder");
}

constexpr char kPlanAnew[] = "plan the job anew in another folder";

// That the shards are the whole axis, each behind the one before it.
void RequireTiling(const Job& job, const std::string& file) {
  int end = 0;
  for (std::size_t n = 0; n < job.shards.size(); ++n) {
    const PlannedShard& shard = job.shards[n];
    if (shard.first != end || shard.last <= end)
      throw InputError(file,
                       fmt::format("shard {} has first = {}, last = {} where {} {} comes next", n,
                                   shard.first, shard.last, job.axis, end),
                       kPlanAnew);
    end = shard.last;
  }
  if (end == 0) throw InputError(file, "shards names none", kPlanAnew);
  if (end != job.length)
    throw InputError(
        file, fmt::format("length = {} where its shards have {} {}", job.length, end, job.axis),
        kPlanAnew);
}

// That the inputs are those which the shards are named after.
void RequireHashes(const Job& job, const std::string& file) {
  std::vector<std::string> hashes;
  hashes.reserve(job.inputs.size());
  for (const PlannedInput& input : job.inputs) hashes.push_back(input.sha256);
  if (Field<std::vector<std::string>>(job.whole, "inputs_sha256", file) != hashes)
    throw InputError(file, "inputs are not those of whole.inputs_sha256", kPlanAnew);
}

// "a, b".
std::string Listed(const std::vector<std::string>& names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

std::string TextOf(const core::Json& json) {
  return json.dump(-1, ' ', false, core::Json::error_handler_t::replace);
}

std::string NameOf(const Job& job, int number, int first, int last) {
  const core::Json content{{"verb", job.verb},   {"words", job.words},
                           {"whole", job.whole}, {"first", first},
                           {"last", last},       {"luxfield", LUXFIELD_VERSION}};
  return fmt::format("{:04}-{}", number, core::Sha256(TextOf(content)).substr(0, 16));
}

Job MakeJob(const std::string& verb, const std::vector<std::string>& words, const Task& task,
            int shards) {
  for (const std::string& word : words) RequireUtf8(word);
  Job job;
  job.verb = verb;
  job.words = words;
  job.axis = task.Axis();
  job.length = task.Length();
  for (const std::filesystem::path& file : task.Inputs()) {
    RequireUtf8(file.string());
    const Stat before = StatOf(file);
    job.inputs.push_back({file, before.bytes, before.modified_ns, core::Sha256OfFile(file)});
  }
  job.whole = task.Whole();
  for (const PlannedInput& input : job.inputs) job.whole["inputs_sha256"].push_back(input.sha256);
  const int grain = task.Grain(), grains = (job.length + grain - 1) / grain,
            count = std::min(shards, grains);
  for (int n = 0; n < count; ++n) {
    const auto begin = [&](int k) {
      return std::min(job.length, static_cast<int>(std::int64_t{grains} * k / count) * grain);
    };
    job.shards.push_back({NameOf(job, n, begin(n), begin(n + 1)), begin(n), begin(n + 1)});
  }
  return job;
}

void RequirePlainPath(const std::filesystem::path& folder) {
  const std::string path = std::filesystem::absolute(folder).string();
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (std::any_of(path.begin(), path.end(), is_control))
    throw InputError(path, "a job's path may have no line breaks or other control characters",
                     "name or rename its folders without them");
}

void WriteJob(const std::filesystem::path& folder, const Job& job) {
  RequirePlainPath(folder);
  const auto file = JobJson(folder);
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    const Job there = ReadJob(folder);
    const auto same = [](const PlannedShard& a, const PlannedShard& b) { return a.name == b.name; };
    if (std::equal(there.shards.begin(), there.shards.end(), job.shards.begin(), job.shards.end(),
                   same))
      return;
    throw InputError(folder.string(),
                     fmt::format("holds another job: `{}` in {} shards, or other inputs or options",
                                 there.verb, there.shards.size()),
                     "choose another folder with -o, or remove this one");
  }
  core::MakeFolder(folder);
  core::MakeFolder(ShardsFolder(folder));
  core::WriteJson(file, ToJson(job));
}

Job ReadJob(const std::filesystem::path& folder) {
  const auto path = JobJson(folder);
  const std::string file = path.string();
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw InputError(folder.string(), "holds no job (job.json)",
                     "make one with `luxfield shard plan JOB.toml -o FOLDER`");
  const core::Json json = core::ReadJson(path);
  if (Field<std::string>(json, "format", file) != kFormat)
    throw InputError(file, "is no job of luxfield", "name the folder of `luxfield shard plan`");
  if (const int version = Field<int>(json, "version", file); version != kVersion)
    throw InputError(file, fmt::format("version = {} where {} is understood", version, kVersion),
                     "plan the job with this luxfield");
  if (const auto by = Field<std::string>(json, "luxfield", file); by != LUXFIELD_VERSION)
    throw InputError(file,
                     fmt::format("was planned by luxfield {} and not {}, whose shards may differ",
                                 by, LUXFIELD_VERSION),
                     "plan the job anew in another folder");
  Job job;
  job.verb = Field<std::string>(json, "verb", file);
  job.words = Field<std::vector<std::string>>(json, "words", file);
  job.axis = Field<std::string>(json, "axis", file);
  job.length = Field<int>(json, "length", file);
  job.whole = Field<core::Json>(json, "whole", file);
  for (const core::Json& input : Field<std::vector<core::Json>>(json, "inputs", file))
    job.inputs.push_back({Field<std::string>(input, "file", file),
                          Field<std::uintmax_t>(input, "bytes", file),
                          Field<std::int64_t>(input, "modified_ns", file),
                          Field<std::string>(input, "sha256", file)});
  for (const core::Json& shard : Field<std::vector<core::Json>>(json, "shards", file)) {
    job.shards.push_back({Field<std::string>(shard, "name", file), Field<int>(shard, "first", file),
                          Field<int>(shard, "last", file)});
    const PlannedShard& one = job.shards.back();
    const int number = static_cast<int>(job.shards.size()) - 1;
    if (one.name != NameOf(job, number, one.first, one.last))
      throw InputError(
          file,
          fmt::format("shard {} is called '{}', which does not follow from its content", number,
                      one.name),
          "the file was changed: plan the job anew in another folder");
  }
  RequireTiling(job, file);
  RequireHashes(job, file);
  return job;
}

void RequireInputs(const Job& job) {
  for (const PlannedInput& input : job.inputs) {
    const Stat now = StatOf(input.file);
    if (now.bytes == input.bytes && now.modified_ns == input.modified_ns) continue;
    if (core::Sha256OfFile(input.file) != input.sha256)
      throw InputError(input.file.string(), "has changed since the job was planned",
                       "put it back, or plan the job anew in another folder");
  }
}

std::filesystem::path ShardsFolder(const std::filesystem::path& folder) {
  return folder / "shards";
}

std::filesystem::path ManifestFile(const std::filesystem::path& folder, const PlannedShard& shard) {
  return ShardsFolder(folder) / (shard.name + ".json");
}

std::filesystem::path FailureFile(const std::filesystem::path& folder, const PlannedShard& shard) {
  return ShardsFolder(folder) / (shard.name + ".failed.json");
}

std::vector<std::filesystem::path> PieceFiles(const std::filesystem::path& folder,
                                              const PlannedShard& shard, const Task& task) {
  std::vector<std::filesystem::path> files;
  for (const std::string& ending : task.Endings(shard.first, shard.last))
    files.push_back(ShardsFolder(folder) / (shard.name + ending));
  return files;
}

void WriteManifest(const std::filesystem::path& folder, const PlannedShard& shard,
                   const Manifest& manifest) {
  core::Json files = core::Json::array();
  for (const Manifest::File& file : manifest.files)
    files.push_back({{"file", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  core::WriteJson(ManifestFile(folder, shard), {{"files", files},
                                                {"figures", manifest.figures},
                                                {"wall_s", manifest.wall_s},
                                                {"core_s", manifest.core_s},
                                                {"peak_mib", manifest.peak_mib},
                                                {"host", manifest.host}});
}

std::optional<Manifest> FindManifest(const std::filesystem::path& folder,
                                     const PlannedShard& shard) {
  const auto path = ManifestFile(folder, shard);
  const std::string file = path.string();
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {};
  try {
    const core::Json json = core::ReadJson(path);
    Manifest manifest;
    for (const core::Json& one : Field<std::vector<core::Json>>(json, "files", file)) {
      const auto name = Field<std::string>(one, "file", file);
      if (!name.starts_with(shard.name + ".") || name.find('/') != std::string::npos) return {};
      manifest.files.push_back({name, Field<std::uintmax_t>(one, "bytes", file),
                                Field<std::string>(one, "sha256", file)});
    }
    manifest.figures = Field<core::Json>(json, "figures", file);
    manifest.wall_s = core::NumberField(json, "wall_s", file, kSeconds);
    manifest.core_s = core::NumberField(json, "core_s", file, kSeconds);
    manifest.peak_mib = core::NumberField(json, "peak_mib", file, kMebibytes);
    manifest.host = Field<std::string>(json, "host", file);
    return manifest;
  } catch (const InputError&) {
    return {};  // a damaged manifest vouches for nothing: the shard is done again
  }
}

std::optional<Failure> FindFailure(const std::filesystem::path& folder, const PlannedShard& shard) {
  const auto path = FailureFile(folder, shard);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {};
  try {
    const core::Json json = core::ReadJson(path);
    const std::string file = path.string();
    return Failure{Field<std::string>(json, "sentence", file),
                   Field<std::string>(json, "host", file), Field<int>(json, "exit_code", file)};
  } catch (const InputError&) {
    return {};
  }
}

std::string WhatIsWrong(const std::filesystem::path& folder, const Job& job,
                        const PlannedShard& shard, const Manifest& manifest, const Task* task) {
  std::vector<std::string> names, pieces;
  for (const Manifest::File& file : manifest.files) names.push_back(file.name);
  if (task)
    for (const auto& file : PieceFiles(folder, shard, *task))
      pieces.push_back(file.filename().string());
  if (task && names != pieces)
    return fmt::format("{}: names {} where the shard has {}", ManifestFile(folder, shard).string(),
                       names.empty() ? "no file" : Listed(names), Listed(pieces));
  for (const Manifest::File& file : manifest.files) {
    const auto path = ShardsFolder(folder) / file.name;
    std::error_code missing;
    const std::uintmax_t bytes = std::filesystem::file_size(path, missing);
    if (missing) return fmt::format("{}: is missing", path.string());
    if (bytes != file.bytes)
      return fmt::format("{}: has {} bytes where its manifest says {}", path.string(), bytes,
                         file.bytes);
    if (!task) continue;
    if (core::Sha256OfFile(path) != file.sha256)
      return fmt::format("{}: is damaged: its SHA-256 is not that of its manifest", path.string());
    const std::string label = FindLabel(path),
                      own = LabelOf(job, shard, file.name, manifest.figures);
    if (label.empty())
      return fmt::format("{}: does not end with the line that a piece of a shard ends with",
                         path.string());
    if (label != own)
      return fmt::format("{}: is not the piece of that name: it ends with '{}' and not with '{}'",
                         path.string(), label, own);
  }
  return "";
}

}  // namespace luxfield::shard
