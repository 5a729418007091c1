// Runs the program again and again without loading it each time: its libraries are here, and each
// run is a fork that begins in main()'s first line.
//
// One request a line on standard input, one answer a line on standard output, both JSON:
//   {"folder": F, "words": ["info", "x.exr"], "stdin": S, "stdout": S, "stderr": S,
//    "limits": {"fsize": N, "nofile": N, "space": N}, "processor_s": N, "wall_s": N, "cache": C}
//   {"exit": N} or {"signal": N}, and {"processor_s": N, "peak_bytes": N, "late": B, "left": B}
// A stream S is a path, or "closed", or "clogged": a pipe that is full and takes no more. "space"
// is the address space beyond what a run begins with; "cache" is a folder for $XDG_CACHE_HOME. The words
// "reload SCENE NAME ..." show a scene and replace its files (reload.h). "late": it had to be ended after wall_s;
// "left": one of its processes outlived it.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "luxfield/bench/verbs/verb_bench.h"
#ifdef LUXFIELD_VIEW
#include "luxfield/view/verbs/verb_view.h"
#include "tests/hostile/reload.h"
#endif
#include "luxfield/cli/run.h"
#include "luxfield/core/json.h"

namespace luxfield::hostile {
namespace {

using core::Json;
using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

void BecomePipeThatIsFull(int stream) {
  int ends[2];
  if (::pipe2(ends, O_NONBLOCK) != 0) std::_Exit(120);
  const std::string block(4096, 'x');
  while (::write(ends[1], block.data(), block.size()) > 0) {
  }
  ::dup2(ends[1], stream);
  ::fcntl(ends[0], F_DUPFD, 100);  // a reader that never reads
  ::close(ends[0]);
  ::close(ends[1]);
}

void OpenStream(int stream, const std::string& how) {
  if (how == "closed") {
    ::close(stream);
  } else if (how == "clogged") {
    BecomePipeThatIsFull(stream);
  } else {
    const int mode = stream == STDIN_FILENO ? O_RDONLY : O_WRONLY | O_CREAT | O_APPEND;
    const int file = ::open(how.c_str(), mode, 0600);
    if (file < 0 || ::dup2(file, stream) < 0) std::_Exit(120);
    ::close(file);
  }
}

rlim_t SpaceInUse() {
  unsigned long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

void Limit(__rlimit_resource resource, rlim_t most) {
  const rlimit limit{most, most};
  if (::setrlimit(resource, &limit) != 0) std::_Exit(121);
}

[[noreturn]] void Run(const Json& request) {
  ::setpgid(0, 0);
  if (::chdir(request.at("folder").get<std::string>().c_str()) != 0) std::_Exit(122);
  std::vector<std::string> words{"luxfield"};
  for (const Json& word : request.at("words")) words.push_back(word.get<std::string>());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const std::string streams[] = {request.at("stdin"), request.at("stdout"), request.at("stderr")};
  const Json limits = request.at("limits");
  Limit(RLIMIT_CORE, 0);
  const auto processor_s = request.at("processor_s").get<rlim_t>();
  const rlimit processor{processor_s, processor_s + 1};
  ::setrlimit(RLIMIT_CPU, &processor);
  for (int stream = 0; stream < 3; ++stream) OpenStream(stream, streams[stream]);
  if (limits.contains("fsize")) Limit(RLIMIT_FSIZE, limits["fsize"]);
  if (limits.contains("nofile")) Limit(RLIMIT_NOFILE, limits["nofile"]);
  if (limits.contains("space")) Limit(RLIMIT_AS, SpaceInUse() + limits["space"].get<rlim_t>());
  if (request.contains("cache"))
    ::setenv("XDG_CACHE_HOME", request["cache"].get<std::string>().c_str(), 1);
#ifdef LUXFIELD_VIEW
  if (words.size() > 2 && words[1] == "reload")
    std::exit(Reload(words[2], {words.begin() + 3, words.end()}));
#endif
  std::exit(cli::Run(static_cast<int>(words.size()), arguments.data(),
                     {bench::AddBench,
#ifdef LUXFIELD_VIEW
                      view::AddView
#endif
                     }));
}

// Whether a process of the group is there yet after a second.
bool IsLeft(pid_t group) {
  const auto until = Clock::now() + std::chrono::seconds(1);
  while (::kill(-group, 0) == 0) {
    if (Clock::now() > until) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

Json Await(pid_t child, double wall_s) {
  const auto until = Clock::now() + std::chrono::duration<double>(wall_s);
  auto pause = std::chrono::microseconds(300);
  int status = 0;
  rusage used{};
  bool late = false;
  while (::wait4(child, &status, WNOHANG, &used) == 0) {
    if (Clock::now() > until) {
      late = true;
      ::kill(-child, SIGKILL);
    }
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::microseconds(20000));
  }
  const bool left = !late && IsLeft(child);
  if (left) ::kill(-child, SIGKILL);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  Json answer{{"processor_s", seconds(used.ru_utime) + seconds(used.ru_stime)},
              {"peak_bytes", 1024 * used.ru_maxrss},
              {"late", late},
              {"left", left}};
  if (WIFSIGNALED(status))
    answer["signal"] = WTERMSIG(status);
  else
    answer["exit"] = WEXITSTATUS(status);
  return answer;
}

}  // namespace
}  // namespace luxfield::hostile

int main() {
  using namespace luxfield::hostile;
  for (std::string line; std::getline(std::cin, line);) {
    const auto request = luxfield::core::Json::parse(line);
    std::cout.flush();
    const pid_t child = ::fork();
    if (child == 0) Run(request);
    std::cout << Await(child, request.at("wall_s").get<double>()).dump() << std::endl;
  }
}
