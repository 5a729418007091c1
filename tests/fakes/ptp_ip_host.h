// Serves a fake camera over PTP/IP (CIPA DC-005) on 127.0.0.1, one initiator after another.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "tests/fakes/ptp_camera.h"

namespace luxfield::fakes {

class PtpIpHost {
 public:
  explicit PtpIpHost(PtpCamera& camera);
  ~PtpIpHost();
  PtpIpHost(const PtpIpHost&) = delete;
  PtpIpHost& operator=(const PtpIpHost&) = delete;

  const std::string& port() const { return port_; }  // as libgphoto2 names it
  void Mute(bool mute) { mute_ = mute; }             // takes operations and answers none
  void Drop();                                       // cuts the connection
  // Changes packets on their way to the initiator; one that it empties resets the connection in its
  // place. With damage set, the host hangs up when it is
  // asked nothing for half a second: an initiator may wait for what does not come.
  using Damage = std::function<void(std::string& packet)>;
  void SetDamage(Damage damage);

 private:
  void Run();
  void Acknowledge(int commands);
  void Serve(int commands, int events);
  void SendEvents(int socket);
  bool Send(int socket, std::uint32_t kind, const std::string& body);
  bool SendReply(int socket, std::uint32_t transaction, const PtpReply& reply);

  PtpCamera& camera_;
  int listener_ = -1;
  std::string port_;
  std::atomic<bool> mute_ = false, ending_ = false, over_ = false;
  std::atomic<int> commands_ = -1;
  std::mutex damage_mutex_;
  Damage damage_;
  std::thread thread_;
};

}  // namespace luxfield::fakes
