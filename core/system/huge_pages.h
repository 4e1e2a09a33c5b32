#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace scarp {

/// Memory on huge pages, as far as the system has any and it fills them: random access to large
/// arrays then does not wait for page tables. Throws: std::bad_alloc.
void* allocate_huge_pages(std::size_t bytes);
void free_huge_pages(void* memory);

/// For a program's beginning: the standard allocator keeps what is freed, as the next time step
/// asks for as much again, instead of giving it back to the system, which would have to clear it.
/// Arrays above 32 MB are given back as ever. Without effect where the allocator is not the GNU
/// one.
void keep_freed_memory();

/// Allocator of LargeVector.
template <class T>
struct HugePages {
  using value_type = T;

  /// Smaller arrays would leave too much of their pages empty.
  static constexpr std::size_t least_bytes = std::size_t{4} << 20;

  HugePages() = default;
  template <class U>
  explicit HugePages(const HugePages<U>&) {}

  T* allocate(std::size_t count) {
    if (count < least_bytes / sizeof(T)) return std::allocator<T>().allocate(count);
    return static_cast<T*>(allocate_huge_pages(count * sizeof(T)));
  }
  void deallocate(T* memory, std::size_t count) {
    if (count < least_bytes / sizeof(T)) {
      std::allocator<T>().deallocate(memory, count);
    } else {
      free_huge_pages(memory);
    }
  }

  friend bool operator==(const HugePages&, const HugePages&) { return true; }
};

/// Asks for memory that will be read soon.
inline void prefetch(const void* place) { __builtin_prefetch(place); }

/// An array that is read in random order.
template <class T>
using LargeVector = std::vector<T, HugePages<T>>;

}  // namespace scarp
