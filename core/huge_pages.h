#pragma once

#include <cstddef>
#include <vector>

namespace scarp {

/// Memory on huge pages, as far as the system has any and it fills them: random access to large
/// arrays then does not wait for page tables. Throws: std::bad_alloc.
void* allocate_huge_pages(std::size_t bytes);
void free_huge_pages(void* memory);

/// Allocator of LargeVector.
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

/// An array that is read in random order.
template <class T>
using LargeVector = std::vector<T, HugePages<T>>;

}  // namespace scarp
