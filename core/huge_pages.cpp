#include "core/huge_pages.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace scarp {

void* allocate_huge_pages(std::size_t bytes) {
  constexpr std::size_t page = std::size_t{2} << 20;
  constexpr std::size_t line = 64;
  const std::size_t alignment = bytes < page ? line : page;
  const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  void* const memory = std::aligned_alloc(alignment, whole);
  if (memory == nullptr) throw std::bad_alloc();
  // A wish, which may be refused. The rest would fill a page only in part.
  if (bytes >= page) madvise(memory, bytes / page * page, MADV_HUGEPAGE);
  return memory;
}

void free_huge_pages(void* memory) { std::free(memory); }

}  // namespace scarp
