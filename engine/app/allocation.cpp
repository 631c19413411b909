// How the program allocates memory; a library leaves that to the program that uses it. Large arrays
// lie in large pages (2 MB on x86), which the system is asked for: their first use then enters the
// kernel once per large page and not every 4 KB.

#include <malloc.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t large_page_bytes = 2 << 20;

#ifdef M_MMAP_THRESHOLD
// Arrays of 128 KB or more go back to the system when they are freed. That is how the C library
// begins, but it moves the limit up to 32 MB as it frees larger arrays. These then leave gaps in
// its heap, so that a run in parts took more memory with every part.
[[maybe_unused]] const int set = ::mallopt(M_MMAP_THRESHOLD, 128 << 10);
#endif

/// Memory for an array of at least a large page, from the beginning of one; null if there is none.
void* large_block(std::size_t bytes) {
  void* block = nullptr;
  if (::posix_memalign(&block, large_page_bytes, bytes) != 0) return nullptr;
#ifdef MADV_HUGEPAGE
  // Whole large pages only: other blocks may follow in the last one.
  ::madvise(block, bytes / large_page_bytes * large_page_bytes, MADV_HUGEPAGE);
#endif
  return block;
}

/// Memory from `allocate`, or from a large block; asks the handler for memory until there is some.
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

// NOLINTBEGIN(cppcoreguidelines-no-malloc): this is what containers and smart pointers call.
void* operator new(std::size_t bytes) {
  return block_of(bytes, [=] { return std::malloc(std::max(bytes, std::size_t{1})); });
}
void* operator new(std::size_t bytes, std::align_val_t align) {
  const auto to = static_cast<std::size_t>(align);
  return block_of(bytes, [=] {  // whole alignments, as aligned_alloc() asks for
    return std::aligned_alloc(to, (std::max(bytes, to) + to - 1) / to * to);
  });
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { std::free(block); }
// NOLINTEND(cppcoreguidelines-no-malloc)
