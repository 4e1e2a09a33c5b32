#include "core/system/huge_pages.h"

#include <sys/mman.h>

#include <cstdlib>
#include <limits>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace scarp {

void* allocate_huge_pages(std::size_t bytes) {
  constexpr std::size_t page = std::size_t{2} << 20;
  void* const memory = std::aligned_alloc(page, (bytes + page - 1) / page * page);
  if (memory == nullptr) throw std::bad_alloc();
  // A wish, which may be refused. The rest would fill a page only in part.
  madvise(memory, bytes / page * page, MADV_HUGEPAGE);
  return memory;
}

void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int largest_kept = 32 << 20;
  mallopt(M_MMAP_THRESHOLD, largest_kept);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

void free_huge_pages(void* memory) { std::free(memory); }

}  // namespace scarp
