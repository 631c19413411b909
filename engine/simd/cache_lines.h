#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace ensonify::engine {

/// Allocates memory from the start of a cache line, so that no load of a vector crosses two lines.
template <class T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t line{64};

  CacheLineAllocator() = default;
  template <class Other>
  CacheLineAllocator(const CacheLineAllocator<Other>&) {}

  T* allocate(std::size_t count) {
    if (count > static_cast<std::size_t>(-1) / sizeof(T)) throw std::bad_array_new_length();
    return static_cast<T*>(::operator new(count * sizeof(T), line));
  }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, line); }
  bool operator==(const CacheLineAllocator&) const = default;
};

template <class T>
using CacheLines = std::vector<T, CacheLineAllocator<T>>;

/// Floats in the widest vector register of any target: arrays have this many elements of padding.
inline constexpr std::size_t widest_vector = 64;

}  // namespace ensonify::engine
