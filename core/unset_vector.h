// Vectors that are written as a whole before they are read, and not filled with zeros first.
#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace luxfield::core {

template <typename T>
struct UnsetAllocator : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };

  template <typename U>
  void construct(U* element) noexcept {
    ::new (static_cast<void*>(element)) U;
  }
  template <typename U, typename... Values>
  void construct(U* element, Values&&... values) {
    std::construct_at(element, std::forward<Values>(values)...);
  }
};

// UnsetVector<float> values(n) and values.resize(n) leave new elements as the memory was.
template <typename T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace luxfield::core
