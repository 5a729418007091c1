// What a camera sees of the other devices of a bench: a small file that all their processes map.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

namespace luxfield::fakes {

struct BenchState {
  static constexpr double kOff = -1;

  std::atomic<double> u_m{0}, v_m{0};  // of the filter's centre, as it really stands
  std::atomic<bool> shutter_open{false};
  std::atomic<int> print{0};
  std::atomic<double> lamp_on_since_s{kOff};  // on the steady clock
  std::atomic<std::uint64_t> exposures{0};    // of the camera, all its lives together
};
static_assert(std::atomic<double>::is_always_lock_free &&
              std::atomic<std::uint64_t>::is_always_lock_free);

// Maps the file; `create` makes it anew.
class SharedBenchState {
 public:
  SharedBenchState(const std::filesystem::path& file, bool create);
  ~SharedBenchState();
  SharedBenchState(const SharedBenchState&) = delete;
  SharedBenchState& operator=(const SharedBenchState&) = delete;

  BenchState& operator*() const { return *state_; }
  BenchState* operator->() const { return state_; }

 private:
  BenchState* state_;
};

double SteadySeconds();

}  // namespace luxfield::fakes
