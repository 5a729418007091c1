#include "tests/fakes/pty_host.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <system_error>

namespace luxfield::fakes {
namespace {

int Checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

}  // namespace

PtyHost::PtyHost(std::unique_ptr<FakeDevice> device, double speed_up, Look after_step)
    : device_(std::move(device)), speed_up_(speed_up), after_step_(std::move(after_step)) {
  master_ = Checked(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC), "posix_openpt");
  Checked(::grantpt(master_), "grantpt");
  Checked(::unlockpt(master_), "unlockpt");
  std::array<char, 128> name{};
  if (::ptsname_r(master_, name.data(), name.size()) != 0)
    throw std::system_error(errno, std::generic_category(), "ptsname_r");
  port_ = name.data();
  // Held open here too: a line without anybody at the other end is an error to its master.
  slave_ = Checked(::open(port_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open");
  termios settings{};
  Checked(::tcgetattr(slave_, &settings), "tcgetattr");
  ::cfmakeraw(&settings);
  Checked(::tcsetattr(slave_, TCSANOW, &settings), "tcsetattr");
  wake_ = Checked(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd");
  thread_ = std::thread([this] { Run(); });
}

PtyHost::~PtyHost() {
  ending_ = true;
  Wake();
  thread_.join();
  for (const int descriptor : {master_, slave_, wake_}) ::close(descriptor);
}

void PtyHost::Wake() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t put = ::write(wake_, &one, sizeof one);
}

bool PtyHost::Suffer(std::string_view event) {
  const std::lock_guard lock(mutex_);
  const bool known = device_->Suffer(event);
  Wake();
  return known;
}

void PtyHost::Freeze(bool frozen) {
  const std::lock_guard lock(mutex_);
  frozen_ = frozen;
  Wake();
}

void PtyHost::Delay(double each_way_s) {
  const std::lock_guard lock(mutex_);
  each_way_ =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(each_way_s));
}

void PtyHost::Inspect(const Look& look) {
  const std::lock_guard lock(mutex_);
  look(*device_);
}

void PtyHost::Way::Put(std::string bytes, Clock::time_point arrival) {
  if (!bytes.empty()) under_way_.emplace_back(arrival, std::move(bytes));
}

std::string PtyHost::Way::Take(Clock::time_point now) {
  std::string arrived;
  for (; !under_way_.empty() && under_way_.front().first <= now; under_way_.pop_front())
    arrived += under_way_.front().second;
  return arrived;
}

void PtyHost::Run() {
  constexpr int kTick_ms = 1;
  auto last = Clock::now();
  bool active = true;
  Way there, back;
  std::string out;
  while (!ending_) {
    const bool ticking = active || !out.empty() || !there.empty() || !back.empty();
    std::array<pollfd, 2> waits{pollfd{master_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    ::poll(waits.data(), waits.size(), ticking ? kTick_ms : -1);
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t woken = ::read(wake_, &count, sizeof count);
    std::array<char, 512> bytes;
    const ssize_t got = ::read(master_, bytes.data(), bytes.size());

    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (active) device_->Advance(speed_up_ * std::chrono::duration<double>(now - last).count());
    last = now;
    if (got > 0) there.Put({bytes.data(), static_cast<std::size_t>(got)}, now + each_way_);
    if (const std::string arrived = there.Take(now); !frozen_) device_->Receive(arrived);
    device_->Advance(0);
    if (after_step_) after_step_(*device_);
    std::string said = device_->Transmit();
    if (frozen_) said.clear();
    back.Put(std::move(said), now + each_way_);
    out += back.Take(now);
    const ssize_t put = ::write(master_, out.data(), out.size());
    if (put > 0) out.erase(0, static_cast<std::size_t>(put));
    active = device_->active();
  }
}

}  // namespace luxfield::fakes
