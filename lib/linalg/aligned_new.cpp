// Memory from `new` starts on a cache line. Eigen sums a vector from its first aligned entry on, so that the rounding
// of a sum depends on where its storage begins; with one alignment for all of it the same run gives the same bytes.

#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t line = 64;  // bytes, also the widest vector register

void* try_to_allocate(std::size_t size) noexcept {
  return std::aligned_alloc(line, (size + line - 1) / line * line + (size == 0 ? line : 0));
}

void* allocate(std::size_t size) {
  void* memory = try_to_allocate(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
// The library's own call the above; a sanitizer's do not.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return try_to_allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return try_to_allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
