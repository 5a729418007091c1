#include "luxfield/shard/job_file.h"

namespace luxfield::shard {

std::filesystem::path FromJobFile(const std::filesystem::path& job_file, const std::string& path) {
  return (std::filesystem::absolute(job_file).parent_path() / path).lexically_normal();
}

JobFile ReadJobFile(const std::filesystem::path& path) {
  const core::Config file = core::Config::FromFile(path);
  const core::Config job = file.Table("job");
  JobFile result{file, job.Text("verb"), {}, {}, 1, {}};
  for (const std::string& input : job.Words("input"))
    result.inputs.push_back(FromJobFile(path, input));
  if (result.inputs.empty()) job.Fail("input", "names nothing", "name a file or a session");
  result.output = FromJobFile(path, job.Text("output"));
  result.shards = job.Integer("shards", 1, kMostShards);
  result.options = file.OptionalTable("options");
  return result;
}

}  // namespace luxfield::shard
