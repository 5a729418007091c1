#include "luxfield/hal/drivers/gpiod/safety_inputs.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <utility>

#include "luxfield/hal/drivers/gpiod/gpio_error.h"
#include "luxfield/hal/real_time.h"

namespace luxfield::hal::gpiod {
namespace {

constexpr double kLook_s = 0.1;

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

SafetyInputs::SafetyInputs(SafetyInputsOptions options) : options_(std::move(options)) {
  std::vector<LineSettings> lines;
  const auto add = [&](const std::optional<LineSettings>& line, Contact contact) {
    if (!line) return;
    lines.push_back(*line);
    contacts_.push_back(contact);
  };
  add(options_.emergency_stop, Contact::kEmergencyStop);
  add(options_.door, Contact::kDoor);
  add(options_.limit, Contact::kLimit);
  lines_.emplace(options_.chip, lines);
  for (const bool active : lines_->Levels())
    debounced_.emplace_back(options_.assert_s, options_.release_s, active);
  Look();
  end_fd_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (end_fd_ < 0) throw GpioError(options_.chip, "watch input lines", errno);
  thread_ = std::thread([this] { Watch(); });
  real_time_ = RaisePriority(thread_.native_handle());
}

SafetyInputs::~SafetyInputs() {
  eventfd_write(end_fd_, 1);
  thread_.join();
  close(end_fd_);
}

std::string SafetyInputs::identity() const { return "safety inputs on " + ChipPath(options_.chip); }

InputState SafetyInputs::State() {
  const std::lock_guard lock(mutex_);
  return state_;
}

void SafetyInputs::OnTrip(Action action) {
  const std::lock_guard action_lock(action_mutex_);
  action_ = std::move(action);
  const InputState state = State();
  if (action_ && !state.safe()) action_(state);
}

void SafetyInputs::Watch() {
  try {
    while (Wait()) Look();
  } catch (const Error& error) {
    InputState state = State();
    state.unreadable = error.what();
    Publish(state);
  }
}

bool SafetyInputs::Wait() const {
  std::vector<pollfd> fds = {{end_fd_, POLLIN, 0}};
  for (const int fd : lines_->edge_fds()) fds.push_back({fd, POLLIN, 0});
  const double now = Now();
  double until = now + kLook_s;
  for (const Debounce& debounce : debounced_)
    until = std::min(until, debounce.Next().value_or(until));
  const double wait_s = std::max(until - now, 0.0);
  const timespec timeout{0, static_cast<long>(std::ceil(wait_s * 1e9))};
  if (ppoll(fds.data(), fds.size(), &timeout, nullptr) < 0 && errno != EINTR)
    throw GpioError(options_.chip, "watch input lines", errno);
  return fds[0].revents == 0;
}

void SafetyInputs::Look() {
  lines_->DrainEdges();
  const std::vector<bool> levels = lines_->Levels();
  const double now = Now();
  InputState state;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const bool active = debounced_[k].Update(levels[k], now);
    switch (contacts_[k]) {
      case Contact::kEmergencyStop:
        state.emergency_stop = active;
        break;
      case Contact::kDoor:
        state.door_open = active;
        break;
      case Contact::kLimit:
        state.limit = active;
        break;
    }
  }
  Publish(state);
}

void SafetyInputs::Publish(const InputState& state) {
  const std::lock_guard action_lock(action_mutex_);
  bool tripped = false;
  {
    const std::lock_guard lock(mutex_);
    tripped = state_.safe() && !state.safe();
    state_ = state;
  }
  if (tripped && action_) action_(state);
}

}  // namespace luxfield::hal::gpiod
