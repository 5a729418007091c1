#include "luxfield/core/apart.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

using Clock = std::chrono::steady_clock;
using Why = ApartError::Why;

constexpr char kAnswer = 'A', kError = 'E';  // first byte of what the child writes
constexpr int kMemoryRanOut = 77;            // exit status of the child
constexpr int kEnd = 3;                      // the child's descriptor of the pipe
constexpr int kPipeBytes = 1 << 20;
constexpr double kLookEvery_s = 0.1;  // for interrupts

// Nothing of the parent's: no device, no terminal, no handlers of signals. The descriptor `end`
// alone stays open. Interrupts are the parent's, who ends the child.
void BeAlone(int end, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGPIPE, SIGXCPU})
    ::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGTSTP}) ::signal(signal, SIG_IGN);
  const int nothing = ::open("/dev/null", O_RDWR);
  for (const int standard : {0, 1, 2}) ::dup2(nothing, standard);
  ::dup2(end, kEnd);
  ::close_range(kEnd + 1, ~0u, 0);
}

void Limit(__rlimit_resource resource, double value) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return;
  if (limit.rlim_cur != RLIM_INFINITY) value = std::min(value, static_cast<double>(limit.rlim_cur));
  limit.rlim_cur = static_cast<rlim_t>(value);
  ::setrlimit(resource, &limit);
}

// Of the address space, which with a sanitizer's shadow is much more than the memory in use.
double SpaceInUse() {
  double pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lf", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

[[noreturn]] void BeChild(const ApartLimits& limits, int end, pid_t parent,
                          const std::function<void(ApartWriter&)>& work) {
  BeAlone(end, parent);
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_CPU, std::ceil(limits.processor_s));
  Limit(RLIMIT_AS, SpaceInUse() + static_cast<double>(limits.memory_bytes));
  // Libraries turn bad_alloc into words of their own.
  std::set_new_handler([] { ::_exit(kMemoryRanOut); });
  ApartWriter writer(kEnd);
  try {
    work(writer);
    if (!writer.started()) writer.Start(kAnswer);
    ::_exit(0);
  } catch (const Error& error) {
    if (!writer.started()) {
      writer.Start(kError);
      writer(error.exit_code(), std::string(error.what()));
      ::_exit(0);
    }
  } catch (const std::bad_alloc&) {
    ::_exit(kMemoryRanOut);
  } catch (...) {
  }
  ::_exit(1);
}

class Child {
 public:
  Child(const ApartLimits& limits, const std::function<void(ApartWriter&)>& work) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) Fail("no pipe");
    ::fcntl(ends[1], F_SETPIPE_SZ, kPipeBytes);  // where it may: fewer turns of the two
    const pid_t self = ::getpid();
    id_ = ::fork();
    if (id_ == 0) BeChild(limits, ends[1], self, work);
    const int error = errno;
    ::close(ends[1]);
    end_ = ends[0];
    errno = error;
    if (id_ < 0) {
      ::close(end_);
      Fail("no process");
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (id_ > 0) Ended();
    ::close(end_);
  }

  int end() const { return end_; }

  // How it ended, by itself or now.
  int Ended() {
    ::kill(id_, SIGKILL);
    int status = 0;
    while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    return status;
  }

 private:
  [[noreturn]] static void Fail(const char* what) {
    throw ApartError(Why::kNoProcess, fmt::format("{}: {}", what, std::strerror(errno)));
  }

  pid_t id_ = -1;
  int end_ = -1;
};

ApartError NoAnswer() { return {Why::kNoAnswer, "its reader had no answer"}; }

// The child's answer broke off.
ApartError Broken(int status, const ApartLimits& limits) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    return {Why::kTooLong, fmt::format("is not read within {:.0f} s of processor time",
                                       std::ceil(limits.processor_s))};
  if (WIFSIGNALED(status))
    return {Why::kDied, fmt::format("brought its reader down (signal {}, {})", WTERMSIG(status),
                                    ::strsignal(WTERMSIG(status)))};
  if (WIFEXITED(status) && WEXITSTATUS(status) == kMemoryRanOut)
    return {Why::kTooMuchMemory,
            fmt::format("takes more than {} MiB of memory to read", limits.memory_bytes >> 20)};
  return NoAnswer();
}

// Thrown by the reader at the pipe's end; its caller knows why.
struct CutOff {};

[[noreturn]] void Rethrow(ApartReader& reader) {
  const auto code = reader.Value<int>();
  const auto text = reader.Value<std::string>();
  if (code == 3) throw DeviceError(text);
  throw InputError(text);
}

}  // namespace

ApartLimits ApartLimitsOf(std::uintmax_t file_bytes, double memory_factor) {
  constexpr double kPerMiB_s = 1;
  const auto bytes = static_cast<double>(file_bytes);
  ApartLimits limits;
  limits.processor_s += kPerMiB_s * bytes / (1 << 20);
  limits.wall_s = 20 + 4 * limits.processor_s;
  limits.memory_bytes += static_cast<std::size_t>(std::min(memory_factor * bytes, 0x1p50));
  return limits;
}

void ApartWriter::Start(char kind) {
  started_ = true;
  Bytes(&kind, 1);
}

void ApartWriter::Bytes(const void* bytes, std::size_t count) {
  if (!started_) Start(kAnswer);
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = ::write(end_, from, count);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(1);
    from += written;
    count -= static_cast<std::size_t>(written);
  }
}

ApartReader::ApartReader(int end, const ApartLimits& limits)
    : end_(end),
      limits_(limits),
      until_(Clock::now() +
             std::chrono::duration_cast<Clock::duration>(
                 std::chrono::duration<double>(std::clamp(limits.wall_s, 0.0, 1e6)))) {}

std::size_t ApartReader::Count(std::size_t element_bytes) {
  const auto count = Value<std::uint64_t>();
  if (count > limits_.memory_bytes / element_bytes) throw NoAnswer();
  return count;
}

void ApartReader::Bytes(void* bytes, std::size_t count) {
  char* to = static_cast<char*>(bytes);
  while (count > 0) {
    const std::size_t read = Some(to, count);
    if (read == 0) throw CutOff{};
    to += read;
    count -= read;
  }
}

void ApartReader::End() {
  char more = 0;
  if (Some(&more, 1) != 0) throw NoAnswer();
}

std::size_t ApartReader::Some(void* bytes, std::size_t count) {
  for (;;) {
    if (limits_.interruptible) ThrowIfInterrupted();
    const double left_s = std::chrono::duration<double>(until_ - Clock::now()).count();
    pollfd readable{end_, POLLIN, 0};
    const int wait_ms = static_cast<int>(1e3 * std::clamp(left_s, 0.0, kLookEvery_s));
    const int ready = ::poll(&readable, 1, wait_ms);
    if (ready == 0 && left_s <= 0)
      throw ApartError(Why::kTooLong, fmt::format("is not read within {:.3g} s", limits_.wall_s));
    if (ready <= 0) continue;
    const ssize_t got = ::read(end_, bytes, count);
    if (got >= 0) return static_cast<std::size_t>(got);
    if (errno != EINTR) throw CutOff{};
  }
}

void Apart(const ApartLimits& limits, const std::function<void(ApartWriter&)>& work,
           const std::function<void(ApartReader&)>& take) {
  Child child(limits, work);
  ApartReader reader(child.end(), limits);
  try {
    const char kind = reader.Value<char>();
    if (kind == kError) Rethrow(reader);
    if (kind != kAnswer) throw NoAnswer();
    take(reader);
    reader.End();
  } catch (const CutOff&) {
    throw Broken(child.Ended(), limits);
  }
  if (const int status = child.Ended(); status != 0) throw Broken(status, limits);
}

void ReadApart(const std::string& file, const std::string& remedy, const ApartLimits& limits,
               const std::function<void(ApartWriter&)>& work,
               const std::function<void(ApartReader&)>& take) {
  try {
    Apart(limits, work, take);
  } catch (const ApartError& error) {
    if (error.why == Why::kNoProcess)
      throw DeviceError(
          fmt::format("{}: cannot be read apart: {}; end other programs", file, error.what()));
    throw InputError(file, error.what(), remedy);
  }
}

}  // namespace luxfield::core
