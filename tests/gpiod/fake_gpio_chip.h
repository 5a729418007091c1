// A GPIO chip that exists under umockdev only: the kernel's side of both versions of its interface,
// for the real libgpiod, in this process or in a child of it. Answers come from umockdev's own
// thread. Run the test program under umockdev-wrapper.
#pragma once

#include <umockdev.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace luxfield::hal::gpiod {

class FakeGpioChip {
 public:
  explicit FakeGpioChip(std::vector<std::string> names);
  // On a testbed with other devices. Programs in other processes have line_descriptors.cc
  // preloaded, before umockdev's own library.
  enum class Users { kThisProcess, kOtherProcesses };
  FakeGpioChip(UMockdevTestbed* testbed, std::vector<std::string> names, Users users);
  ~FakeGpioChip();
  FakeGpioChip(const FakeGpioChip&) = delete;
  FakeGpioChip& operator=(const FakeGpioChip&) = delete;

  static constexpr const char* kPath = "/dev/gpiochip0";

  // Drives an input pin; queues an edge where the level changes, as the kernel does: 16 at most.
  void SetPin(const std::string& line, bool high);
  bool Pin(const std::string& line);
  // Waits until a pin has a level; false if it does not within 10 s.
  bool AwaitPin(const std::string& line, bool high);
  // Levels that an output pin was set to, in order, its first value included.
  std::vector<bool> History(const std::string& line);

  // What the outputs drive: `sensor` follows `output` at once.
  void Couple(const std::string& output, const std::string& sensor);
  // Told of every output that is set, before the program that sets it goes on. It must not call
  // this chip.
  void OnOutput(std::function<void(const std::string& line, bool high)> action);

  void HoldElsewhere(const std::string& line);  // as if gpiomon had requested it
  void StickPin(const std::string& line);       // an output that does not follow
  void FailReads(int error);                    // every read of levels from now on; 0: none

 private:
  struct Request {
    std::vector<unsigned> offsets;
    bool active_low = false;
    bool version2 = false;
    std::string fifo;  // of its edges
    unsigned queued = 0;
  };

  static gboolean OnChip(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  static gboolean OnRequest(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self);
  gboolean AnswerChip(UMockdevIoctlClient* client);
  gboolean AnswerRequest(UMockdevIoctlClient* client, Request& request);
  // A descriptor of this process, or for others the number of a node, -2 - number.
  int Open(Request request, bool edges);
  void Drive(unsigned offset, bool high);
  int CheckFree(unsigned offset) const;
  unsigned OffsetOf(const std::string& line) const;
  void WriteOutput(unsigned offset, bool high);
  int ReadError() const { return read_error_; }

  std::vector<std::string> names_;
  UMockdevTestbed* testbed_;
  Users users_;
  std::vector<UMockdevIoctlBase*> handlers_;

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::vector<bool> pins_, held_, stuck_;
  std::vector<std::vector<bool>> history_;
  std::map<unsigned, unsigned> coupled_;
  std::function<void(const std::string&, bool)> on_output_;
  std::deque<Request> requests_;
  std::map<UMockdevIoctlBase*, std::size_t> request_of_;
  int read_error_ = 0;
};

}  // namespace luxfield::hal::gpiod
