#include "hal/gphoto2/decoder_process.h"

#if LUXFIELD_GPHOTO2

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <new>
#include <optional>

#include "core/printable.h"
#include "hal/error.h"

namespace luxfield::hal::gphoto2 {
namespace {

constexpr char kOperation[] = "read RAW";

// What the child leaves in memory that both see; a picture's pixels follow it.
struct Answer {
  enum Kind { kNone, kPicture, kFault } kind;
  int fault;  // a Fault
  std::array<char, 32> operation;
  std::array<char, 512> problem, remedy;
  int width, height;
  std::array<char, 8> cfa;
  double exposure_s, temperature_c;
};

template <std::size_t N>
void Put(const std::string& text, std::array<char, N>& into) {
  into = {};
  std::copy_n(text.begin(), std::min(text.size(), N - 1), into.begin());
}

// Of a child that may have been damaged before it answered: any bytes.
template <std::size_t N>
std::string Get(const std::array<char, N>& from) {
  return core::Printable({from.data(), ::strnlen(from.data(), N)}, N);
}

class SharedAnswer {
 public:
  explicit SharedAnswer(std::size_t most_pixels)
      : bytes_(sizeof(Answer) + sizeof(std::uint16_t) * most_pixels),
        start_(::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    if (made()) new (start_) Answer{};
  }
  ~SharedAnswer() {
    if (made()) ::munmap(start_, bytes_);
  }
  SharedAnswer(const SharedAnswer&) = delete;
  SharedAnswer& operator=(const SharedAnswer&) = delete;

  bool made() const { return start_ != MAP_FAILED; }
  Answer& answer() { return *static_cast<Answer*>(start_); }
  std::uint16_t* dn() { return reinterpret_cast<std::uint16_t*>(&answer() + 1); }

 private:
  std::size_t bytes_;
  void* start_;
};

// Nothing of the parent's: no device, no terminal, no handlers of signals. The descriptor `end`
// alone stays open, as number 3.
void BeAlone(int end, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGTERM, SIGPIPE})
    ::signal(signal, SIG_DFL);
  const int nothing = ::open("/dev/null", O_RDWR);
  for (const int standard : {0, 1, 2}) ::dup2(nothing, standard);
  ::dup2(end, 3);
  ::close_range(4, ~0u, 0);
}

void AnswerWith(const std::function<RawFile()>& decode, std::size_t most_pixels,
                SharedAnswer& shared) {
  Answer& answer = shared.answer();
  try {
    const RawFile file = decode();
    if (file.image.size() > most_pixels || file.image.dn.size() != file.image.size()) return;
    answer.width = file.image.width;
    answer.height = file.image.height;
    Put(file.cfa, answer.cfa);
    answer.exposure_s = file.exposure_s;
    answer.temperature_c = file.temperature_c;
    std::copy(file.image.dn.begin(), file.image.dn.end(), shared.dn());
    answer.kind = Answer::kPicture;
  } catch (const HardwareError& error) {
    answer.fault = static_cast<int>(error.fault);
    Put(error.operation, answer.operation);
    Put(error.problem, answer.problem);
    Put(error.remedy, answer.remedy);
    answer.kind = Answer::kFault;
  }
}

// Whether the last process that holds the other end let go of it in time.
bool LetGo(int end, double within_s) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::duration<double>(within_s);
  for (;;) {
    const double left_s = std::chrono::duration<double>(until - Clock::now()).count();
    pollfd readable{end, POLLIN, 0};
    const int ready = ::poll(&readable, 1, static_cast<int>(std::clamp(1e3 * left_s, 0.0, 1e9)));
    if (ready > 0) return true;
    if (ready == 0 && left_s <= 0) return false;
    if (ready < 0 && errno != EINTR) return false;
  }
}

RawFile PictureOf(SharedAnswer& shared) {
  const Answer& answer = shared.answer();
  RawFile file;
  file.image.width = answer.width;
  file.image.height = answer.height;
  file.image.dn.assign(shared.dn(), shared.dn() + file.image.size());
  file.cfa = Get(answer.cfa);
  file.exposure_s = answer.exposure_s;
  file.temperature_c = answer.temperature_c;
  return file;
}

}  // namespace

RawFile DecodeApart(const std::function<RawFile()>& decode, const std::string& device,
                    std::size_t most_pixels, double within_s) {
  const auto no_child = [&](const char* what) {
    return HardwareError(Fault::kRefused, device, kOperation,
                         fmt::format("{}: {}", what, std::strerror(errno)),
                         "end other programs, then resume");
  };
  SharedAnswer shared(most_pixels);
  if (!shared.made()) throw no_child("no memory for the picture");
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw no_child("no pipe");
  const pid_t self = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    BeAlone(ends[1], self);
    try {
      AnswerWith(decode, most_pixels, shared);
    } catch (...) {
    }
    ::_exit(0);
  }
  const int fork_error = errno;
  ::close(ends[1]);
  std::optional<bool> done;
  if (child > 0) done = LetGo(ends[0], within_s);
  ::close(ends[0]);
  errno = fork_error;
  if (!done) throw no_child("no process for the decoder");
  if (!*done) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }

  const Answer& answer = shared.answer();
  if (*done && answer.kind == Answer::kFault && answer.fault >= 0 &&
      answer.fault <= static_cast<int>(Fault::kIncomplete))
    throw HardwareError(static_cast<Fault>(answer.fault), device, Get(answer.operation),
                        Get(answer.problem), Get(answer.remedy));
  const auto failed = [&](const std::string& problem) {
    return HardwareError(Fault::kIncomplete, device, kOperation, problem,
                         "check the cable, then resume; set another RAW format if it goes on");
  };
  if (!*done) throw failed(fmt::format("the decoder was not done with the file in {} s", within_s));
  if (WIFSIGNALED(status))
    throw failed(fmt::format("the file brought its decoder down (signal {}, {})", WTERMSIG(status),
                             ::strsignal(WTERMSIG(status))));
  if (answer.kind != Answer::kPicture || answer.width < 1 || answer.height < 1 ||
      std::size_t(answer.width) * std::size_t(answer.height) > most_pixels)
    throw failed("the decoder had no answer to the file");
  return PictureOf(shared);
}

}  // namespace luxfield::hal::gphoto2

#endif
