// The verbs that jobs are made of: from job.toml to a command line, and from that to a task.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "luxfield/shard/job_file.h"
#include "luxfield/shard/task.h"

namespace luxfield::cli {

// The words that the verb's command line would have, with absolute paths. Throws InputError that
// names job.toml and the field: for a verb or an option that cannot be cut so that the pieces joined
// are equal to the whole, for options that the verb does not have, and for more inputs than it takes.
std::vector<std::string> WordsOf(const shard::JobFile& job);

// The task of `verb` with such words. Throws InputError for values that the verb would not take.
// `threads` are those of a device that renders.
std::unique_ptr<shard::Task> MakeTask(const std::string& verb,
                                      const std::vector<std::string>& words, int threads);

}  // namespace luxfield::cli
