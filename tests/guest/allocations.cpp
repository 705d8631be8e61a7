#include "tests/guest/allocations.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<uint64_t> count = 0;
thread_local bool refuses = false;
}  // namespace

void* operator new(size_t size) {
    ++count;
    if (refuses) throw std::bad_alloc();
    if (void* memory = std::malloc(size ? size : 1)) return memory;
    throw std::bad_alloc();
}
void* operator new(size_t size, const std::nothrow_t&) noexcept {
    ++count;
    return refuses ? nullptr : std::malloc(size ? size : 1);
}
void* operator new[](size_t size) {
    return operator new(size);
}
// Not inlined: g++ 12 would take free() for a mismatch with the operator new of a caller beside it.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
    operator delete(memory);
}
void operator delete[](void* memory) noexcept {
    operator delete(memory);
}
void operator delete[](void* memory, size_t) noexcept {
    operator delete(memory);
}

namespace postchain::test {

uint64_t allocations() {
    return count;
}

void refuse_memory(bool refuse) {
    refuses = refuse;
}

}  // namespace postchain::test
