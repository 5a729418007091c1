// Numbers and arrays as bytes, and back: what core/cache.h keeps of computed values. In the machine's
// own order, for the same build alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace luxfield::core {

class ByteWriter {
 public:
  template <typename... T>
  void operator()(const T&... values) {
    (Put(values), ...);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  void Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <typename T, typename Allocator>
  void Put(const std::vector<T, Allocator>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    Put(std::uint64_t{values.size()});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }

  void Put(const std::string& text) {
    Put(std::uint64_t{text.size()});
    bytes_.append(text);
  }

  std::string bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  // The same values in the same order; as they were from where the bytes end too early.
  template <typename... T>
  void operator()(T&... values) {
    (Get(values), ...);
  }
  // Whether there were all values so far, and nothing follows.
  bool whole() const { return whole_ && rest_.empty(); }

 private:
  // The next bytes; empty where there are fewer.
  std::string_view Take(std::size_t count) {
    if (count > rest_.size()) whole_ = false;
    if (!whole_) return {};
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <typename T>
  void Get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::string_view taken = Take(sizeof value);
    if (whole_) std::memcpy(&value, taken.data(), sizeof value);
  }
  template <typename T, typename Allocator>
  void Get(std::vector<T, Allocator>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::string_view taken = Take(Bytes(sizeof(T)));
    values.resize(taken.size() / sizeof(T));
    if (!taken.empty()) std::memcpy(values.data(), taken.data(), taken.size());
  }
  void Get(std::string& text) { text = Take(Bytes(1)); }
  // Of as many elements as the next number says; no count of bytes where these are too many.
  std::size_t Bytes(std::size_t element) {
    std::uint64_t count = 0;
    Get(count);
    return count <= rest_.size() / element ? count * element : rest_.size() + 1;
  }

  std::string_view rest_;
  bool whole_ = true;
};

}  // namespace luxfield::core
