#include "luxfield/hal/lab/safe_state.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <future>
#include <thread>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {
namespace {

constexpr double kInsist_s = 10;
constexpr auto kAgain = std::chrono::milliseconds(20);

// Empty once it has succeeded, else what the last attempt met.
std::string Insist(const std::function<void()>& action, SteadyTime until) {
  for (;;) {
    try {
      action();
      return {};
    } catch (const std::exception& error) {
      if (std::chrono::steady_clock::now() >= until) return error.what();
    }
    // A driver that waits busily may have kept the processor from what it waits for.
    sched_param ordinary{};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
    std::this_thread::sleep_for(kAgain);
  }
}

}  // namespace

std::vector<std::string> MakeSafe(const DeviceLab& lab, double within_s) {
  const auto clock = std::make_shared<core::SystemClock>();
  const SteadyTime until = SecondsFromNow(within_s);
  // Neither waits for the other: a stage that does not answer must not keep the lamp on.
  auto stage = std::async(
      std::launch::async, Insist, [&] { OpenStage(lab.stage, clock); }, until);
  std::string lamp;
  if (lab.supply) lamp = Insist([&] { OpenSupply(*lab.supply, clock); }, until);
  std::vector<std::string> failures;
  for (std::string failure : {lamp, stage.get()})
    if (!failure.empty()) failures.push_back(std::move(failure));
  return failures;
}

std::shared_ptr<Watchdog> StartWatchdog(const DeviceLab& lab) {
  return std::make_shared<Watchdog>([lab, program = ::getpid()](const char* why) {
    const auto failures = MakeSafe(lab, kInsist_s);
    if (failures.empty())
      fmt::print(stderr, "luxfield: process {} {}; its watchdog {} the stage\n", program, why,
                 lab.supply ? "switched the lamp off and stopped"
                            : "has no [supply] to switch the lamp off with; it stopped");
    else
      fmt::print(stderr,
                 "luxfield: process {} {}; press the emergency stop: the watchdog could not "
                 "make the lab safe: {}\n",
                 program, why, fmt::join(failures, "; "));
  });
}

}  // namespace luxfield::hal
