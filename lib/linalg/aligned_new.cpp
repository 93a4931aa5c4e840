// Memory from `new` starts on a cache line. Eigen sums a vector from its first aligned entry on, so that the rounding
// of a sum depends on where its storage begins; with one alignment for all of it the same run gives the same bytes.
// The line is found within what malloc gives, and where that began stands before it: the library's aligned_alloc keeps
// no lists of what was freed, and takes five times as long.

#include <cstdint>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t line = 64;  // bytes, also the widest vector register
static_assert(alignof(std::max_align_t) >= sizeof(void*));

void* try_to_allocate(std::size_t size) noexcept {
  void* begin = size > SIZE_MAX - line ? nullptr : std::malloc(size + line);
  if (begin == nullptr) return nullptr;
  // At least alignof(max_align_t) behind the beginning.
  char* memory = static_cast<char*>(begin) + line - reinterpret_cast<std::uintptr_t>(begin) % line;
  reinterpret_cast<void**>(memory)[-1] = begin;
  return memory;
}

void* allocate(std::size_t size) {
  void* memory = try_to_allocate(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  if (memory != nullptr) std::free(static_cast<void**>(memory)[-1]);
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
void operator delete(void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { release(memory); }
