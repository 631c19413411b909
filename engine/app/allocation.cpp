// How the program allocates memory; the library leaves this choice to the program that uses it.
// Large arrays are put into large pages (2 MB on x86), which the program requests from the system:
// their first use then enters the kernel once per large page, not once per 4 KB.

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t large_page_bytes = 2 << 20;

#ifdef M_MMAP_THRESHOLD
// Arrays of 128 KB or more are returned to the system when they are freed. The C library begins
// with this limit, but raises it, up to 32 MB, when larger arrays are freed. Such arrays then leave
// gaps in its heap, so that a run in parts would take more memory with each part.
[[maybe_unused]] const int set = ::mallopt(M_MMAP_THRESHOLD, 128 << 10);
#endif

/// Memory for an array of at least one large page. It begins at a page. Null if there is none.
void* large_block(std::size_t bytes) {
  void* block = nullptr;
  if (::posix_memalign(&block, large_page_bytes, bytes) != 0) return nullptr;
#ifdef MADV_HUGEPAGE
  // Only whole large pages: other blocks may follow in the last one.
  ::madvise(block, bytes / large_page_bytes * large_page_bytes, MADV_HUGEPAGE);
#endif
  return block;
}

/// Memory from `allocate`, or a large block. As long as there is none, calls the new-handler.
template <class Allocate>
void* block_of(std::size_t bytes, Allocate allocate) {
  for (;;) {
    void* const block = bytes < large_page_bytes ? allocate() : large_block(bytes);
    if (block) return block;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

}  // namespace

// NOLINTBEGIN(cppcoreguidelines-no-malloc): containers and smart pointers call these functions.
void* operator new(std::size_t bytes) {
  return block_of(bytes, [=] { return std::malloc(std::max(bytes, std::size_t{1})); });
}
void* operator new(std::size_t bytes, std::align_val_t align) {
  const auto to = static_cast<std::size_t>(align);
  return block_of(bytes, [=] {  // aligned_alloc() requires a multiple of the alignment
    return std::aligned_alloc(to, (std::max(bytes, to) + to - 1) / to * to);
  });
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { std::free(block); }
// NOLINTEND(cppcoreguidelines-no-malloc)
