// Memory from `new` starts on a cache line. Eigen sums a vector from its first aligned entry on, so that the rounding
// of a sum depends on where its storage begins; with one alignment for all of it the same run gives the same bytes.
// The C library keeps no lists of aligned memory, and takes five times as long for it: each thread keeps some of what
// it gave back. All of it is the C library's: libraries that have `new` of their own may free it, and theirs is freed.

#include <malloc.h>

#include <cstdint>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t line = 64;  // bytes, also the widest vector register

#if defined(__SANITIZE_ADDRESS__)

void* take(std::size_t) noexcept { return nullptr; }
bool keep(void*) noexcept { return false; }

#else

constexpr std::size_t most_lines = 64;  // longer memory is not kept
constexpr int most_kept = 32;           // of each length

struct Kept {
  struct Block {
    Block* next;
  };
  Block* first[most_lines + 1] = {};  // by whole lines
  int count[most_lines + 1] = {};
  bool ended = false;
  ~Kept() {
    ended = true;  // destructors that come later free at once
    for (Block*& block : first)
      while (block != nullptr) {
        Block* next = block->next;
        std::free(block);
        block = next;
      }
  }
};
thread_local Kept kept;

void* take(std::size_t lines) noexcept {
  if (lines > most_lines || kept.first[lines] == nullptr) return nullptr;
  Kept::Block* block = kept.first[lines];
  kept.first[lines] = block->next;
  --kept.count[lines];
  return block;
}

bool keep(void* memory) noexcept {
  if (reinterpret_cast<std::uintptr_t>(memory) % line != 0) return false;  // another's
  const std::size_t lines = malloc_usable_size(memory) / line;
  if (lines == 0 || lines > most_lines || kept.ended || kept.count[lines] == most_kept) return false;
  kept.first[lines] = new (memory) Kept::Block{kept.first[lines]};
  ++kept.count[lines];
  return true;
}

#endif

void* try_to_allocate(std::size_t size) noexcept {
  if (size > SIZE_MAX - line) return nullptr;
  const std::size_t lines = size == 0 ? 1 : (size + line - 1) / line;
  if (void* memory = take(lines)) return memory;
  return std::aligned_alloc(line, lines * line);
}

void* allocate(std::size_t size) {
  void* memory = try_to_allocate(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  if (memory != nullptr && !keep(memory)) std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
// The library's own call the above; a sanitizer's do not.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return try_to_allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return try_to_allocate(size); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
