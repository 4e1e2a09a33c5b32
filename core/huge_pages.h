#pragma once

#include <cstddef>

namespace scarp {

/// Memory at the start of a huge page, as far as the system has any: random access to large arrays
/// then does not wait for page tables. Throws: std::bad_alloc.
void* allocate_huge_pages(std::size_t bytes);
void free_huge_pages(void* memory);

/// Allocator of containers that are read in random order.
template <class T>
struct HugePages {
  using value_type = T;

  HugePages() = default;
  template <class U>
  explicit HugePages(const HugePages<U>&) {}

  T* allocate(std::size_t count) { return static_cast<T*>(allocate_huge_pages(count * sizeof(T))); }
  void deallocate(T* memory, std::size_t) { free_huge_pages(memory); }

  friend bool operator==(const HugePages&, const HugePages&) { return true; }
};

}  // namespace scarp
