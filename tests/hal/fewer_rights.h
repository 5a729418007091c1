// The rights of an ordinary user, for tests that may run as root.
#pragma once

#include <linux/capability.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <thread>

#include "luxfield/hal/real_time.h"

namespace luxfield::hal {

// While it lives this thread, and those that it makes, lack what the numbers name (CAP_...).
class WithoutCapabilities {
 public:
  explicit WithoutCapabilities(std::initializer_list<int> numbers) {
    ::syscall(SYS_capget, &header_, capabilities_.data());
    auto fewer = capabilities_;
    for (const int number : numbers) fewer[0].effective &= ~(std::uint32_t{1} << number);
    ::syscall(SYS_capset, &header_, fewer.data());
  }
  ~WithoutCapabilities() { ::syscall(SYS_capset, &header_, capabilities_.data()); }
  WithoutCapabilities(const WithoutCapabilities&) = delete;
  WithoutCapabilities& operator=(const WithoutCapabilities&) = delete;

 private:
  __user_cap_header_struct header_{_LINUX_CAPABILITY_VERSION_3, 0};  // of this thread
  std::array<__user_cap_data_struct, 2> capabilities_{};
};

// Nobody may open the device, one of umockdev's where there are such.
class Forbidden {
 public:
  explicit Forbidden(const std::string& device) : path_(Root() + device) {
    struct stat before {};
    ::stat(path_.c_str(), &before);
    mode_ = before.st_mode & 07777;
    ::chmod(path_.c_str(), mode_ & ~mode_t{0777});
  }
  ~Forbidden() { ::chmod(path_.c_str(), mode_); }
  Forbidden(const Forbidden&) = delete;
  Forbidden& operator=(const Forbidden&) = delete;

 private:
  static std::string Root() {
    const char* root = std::getenv("UMOCKDEV_DIR");
    return root ? root : "";
  }

  std::string path_;
  mode_t mode_ = 0;
  const WithoutCapabilities less_{CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH};  // root's
};

// Nobody gets real-time priority.
class NoRealTime {
 public:
  NoRealTime() {
    ::getrlimit(RLIMIT_RTPRIO, &limit_);
    const rlimit none{0, limit_.rlim_max};
    ::setrlimit(RLIMIT_RTPRIO, &none);
  }
  ~NoRealTime() { ::setrlimit(RLIMIT_RTPRIO, &limit_); }
  NoRealTime(const NoRealTime&) = delete;
  NoRealTime& operator=(const NoRealTime&) = delete;

 private:
  const WithoutCapabilities less_{CAP_SYS_NICE};
  rlimit limit_{};
};

// Whether a thread of this one may have it, rights and machine being what they are.
inline bool GrantsRealTime() {
  bool granted = false;
  std::thread([&] { granted = RaisePriority(pthread_self()); }).join();
  return granted;
}

}  // namespace luxfield::hal
