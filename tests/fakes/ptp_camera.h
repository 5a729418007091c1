// A still camera that speaks PTP (PIMA 15740:2000), whatever carries it: answers to operations,
// and events that come in their time.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace luxfield::fakes {

struct PtpOperation {
  std::uint16_t code = 0;
  std::uint32_t transaction = 0;
  std::array<std::uint32_t, 5> parameters{};
  std::string data;  // of the initiator
};
struct PtpReply {
  std::uint16_t code = 0x2001;  // OK
  std::optional<std::string> data;
};
struct PtpEvent {
  std::uint16_t code = 0;
  std::uint32_t parameter = 0;
};

class PtpCamera {
 public:
  // The file of an exposure; the number grows with each.
  using Shoot = std::function<std::string(double exposure_s, int number)>;
  // Shutter speeds in units of 0.1 ms, as PTP counts them.
  PtpCamera(std::vector<std::uint32_t> speeds, Shoot shoot);

  struct Faults {
    int busy = 0;                // triggers answered with DeviceBusy
    int deaf = 0;                // settings that are acknowledged and forgotten
    bool always_deaf = false;    // all of them
    bool again = false;          // the file before is delivered again
    bool lost = false;           // no event of the new file
    bool another_speed = false;  // exposes for the first of its speeds whatever is set
    std::size_t cut = 0;         // bytes missing at a file's end
  };
  void Set(const Faults& faults);
  int exposures() const;
  std::size_t files() const;  // that lie in the camera
  void Leave(int pictures);   // of somebody else's, in the camera

  PtpReply Execute(const PtpOperation& operation);
  // The next event, once its time has come; nothing when none has by `give_up` or Wake() was
  // called.
  std::optional<PtpEvent> WaitEvent(std::chrono::steady_clock::time_point give_up);
  void Wake();

 private:
  struct Due {
    std::chrono::steady_clock::time_point at;
    PtpEvent event;
  };
  PtpReply DeviceInfo() const;
  PtpReply StorageInfo() const;
  PtpReply ObjectInfo(std::uint32_t handle) const;
  PtpReply Property(std::uint32_t property, bool described) const;
  PtpReply SetProperty(std::uint32_t property, const std::string& value);
  PtpReply Capture(std::uint32_t transaction);

  const std::vector<std::uint32_t> speeds_;
  const Shoot shoot_;
  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  Faults faults_;
  std::uint32_t speed_;
  std::uint16_t iso_ = 100;
  int exposures_ = 0;
  std::chrono::steady_clock::time_point free_at_;  // until then it is busy with an exposure
  std::string last_file_;
  std::map<std::uint32_t, std::string> files_;  // by handle
  std::deque<Due> events_;
  bool woken_ = false;
};

}  // namespace luxfield::fakes
