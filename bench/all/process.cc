#include "luxfield/bench/all/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

// The environment of this process, with some variables of its own.
std::vector<std::string> EnvironmentWith(const Variables& variables) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry; ++entry)
    if (std::none_of(variables.begin(), variables.end(), [&](const auto& variable) {
          return std::string_view(*entry).starts_with(variable.first + "=");
        }))
      all.emplace_back(*entry);
  for (const auto& [name, value] : variables) all.push_back(name + "=" + value);
  return all;
}

std::vector<char*> Pointers(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::string LastLine(const std::filesystem::path& file) {
  std::string text = core::ReadFile(file);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

pid_t Start(std::vector<std::string> words, const std::filesystem::path& output,
            const Variables& variables) {
  std::vector<std::string> environment = EnvironmentWith(variables);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  core::TakePeakMib();  // which Linux would count as the program's own
  pid_t process = 0;
  const int error = posix_spawn(&process, words[0].c_str(), &actions, nullptr,
                                Pointers(words).data(), Pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0)
    throw DeviceError(
        fmt::format("{} cannot be started ({}); build or install it", words[0], strerror(error)));
  return process;
}

}  // namespace

ProcessRun RunProcess(const std::vector<std::string>& words, const std::filesystem::path& folder,
                      const Variables& variables) {
  const auto output = folder / "output.txt";
  const core::Stopwatch stopwatch;
  const pid_t process = Start(words, output, variables);
  int status = 0;
  rusage usage{};
  while (::wait4(process, &status, 0, &usage) < 0)
    if (errno != EINTR)
      throw DeviceError(fmt::format("waiting for {} failed ({})", words[0], strerror(errno)));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw DeviceError(fmt::format("`{}` failed: {}", fmt::join(words, " "), LastLine(output)));
  constexpr double kKibInMib = 1024;
  return {stopwatch.WallSeconds(), Seconds(usage.ru_utime) + Seconds(usage.ru_stime),
          static_cast<double>(usage.ru_maxrss) / kKibInMib};
}

std::filesystem::path LuxfieldProgram() {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const auto& candidate : {folder / "luxfield", folder / "../../bin/luxfield"})
    if (std::filesystem::exists(candidate, error)) return candidate.lexically_normal();
  throw DeviceError(
      fmt::format("the program luxfield is neither in {} nor in bin beside it; build it there",
                  folder.string()));
}

}  // namespace luxfield::bench
