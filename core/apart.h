// Work in a process of its own: a library that somebody's bytes bring down, keep busy for good or
// make take all memory takes nothing else with it.
//
// The child begins as a copy of this process with nothing open, and ends with its parent. It may
// take memory, but no lock that another thread of this process may hold. Its answer comes through a
// pipe, as the bytes of values in the order in which they are written; whoever reads them checks
// them, since a damaged child may write anything.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace luxfield::core {

struct ApartLimits {
  double processor_s = 5;
  double wall_s = 40;
  std::size_t memory_bytes = std::size_t{1} << 29;  // beyond what this process holds
  bool interruptible = true;  // ends with Interrupted at the first SIGINT or SIGTERM
};

// For a parser of a file of this length that takes `memory_factor` bytes for one of the file's, and
// less than a second for 1 MiB.
ApartLimits ApartLimitsOf(std::uintmax_t file_bytes, double memory_factor);

// There is no answer. what() is what a sentence about the file says of it, as "brought its reader
// down (signal 11, Segmentation fault)".
class ApartError : public std::runtime_error {
 public:
  enum class Why { kNoProcess, kDied, kTooLong, kTooMuchMemory, kNoAnswer };
  ApartError(Why reason, const std::string& problem) : std::runtime_error(problem), why(reason) {}
  Why why;
};

// What the child answers with: trivially copyable values, texts and arrays of such values.
class ApartWriter {
 public:
  explicit ApartWriter(int end) : end_(end) {}

  template <typename... T>
  void operator()(const T&... values) {
    (Put(values), ...);
  }
  void Bytes(const void* bytes, std::size_t count);
  bool started() const { return started_; }
  void Start(char kind);

 private:
  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    Bytes(&value, sizeof value);
  }
  template <typename T>
  void Put(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    Put(std::uint64_t{values.size()});
    Bytes(values.data(), values.size() * sizeof(T));
  }
  void Put(const std::string& text) {
    Put(std::uint64_t{text.size()});
    Bytes(text.data(), text.size());
  }

  int end_;
  bool started_ = false;
};

// The same values at the other end. Throws ApartError: cut off, too late, or an array that is
// larger than the child's memory may be.
class ApartReader {
 public:
  ApartReader(int end, const ApartLimits& limits);

  template <typename... T>
  void operator()(T&... values) {
    (Get(values), ...);
  }
  template <typename T>
  T Value() {
    T value{};
    Get(value);
    return value;
  }
  void Bytes(void* bytes, std::size_t count);
  const ApartLimits& limits() const { return limits_; }
  void End();  // nothing follows

 private:
  template <typename T>
  void Get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    Bytes(&value, sizeof value);
  }
  template <typename T>
  void Get(std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    values.resize(Count(sizeof(T)));
    Bytes(values.data(), values.size() * sizeof(T));
  }
  void Get(std::string& text) {
    text.resize(Count(1));
    Bytes(text.data(), text.size());
  }
  std::size_t Count(std::size_t element_bytes);
  std::size_t Some(void* bytes, std::size_t count);  // 0 at the end

  int end_;
  ApartLimits limits_;
  std::chrono::steady_clock::time_point until_;
};

// work(writer) in a child, and take(reader) of what it writes here. An Error that `work` throws
// before it writes is thrown here as an InputError or a DeviceError of the same text. Throws
// ApartError where there is no whole answer within the limits, Interrupted as these say, and what
// `take` throws.
void Apart(const ApartLimits& limits, const std::function<void(ApartWriter&)>& work,
           const std::function<void(ApartReader&)>& take);

// The same for the parser of a file: an InputError in the file's name where there is no answer, a
// DeviceError where no process can be made.
void ReadApart(const std::string& file, const std::string& remedy, const ApartLimits& limits,
               const std::function<void(ApartWriter&)>& work,
               const std::function<void(ApartReader&)>& take);

}  // namespace luxfield::core
