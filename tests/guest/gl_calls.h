// Counts the guest's GL calls. libepoxy calls GL through a variable for each function. Each
// function that the library uses is replaced by one that counts and forwards.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace postchain::test {

// By name, since start(). Calls of the test itself also count.
class GlCalls {
  public:
    static void start();
    static std::map<std::string, uint64_t> stop();
    // The bits of the newest glMemoryBarrier.
    static uint32_t last_barrier();
    // All functions that are counted.
    static std::vector<std::string> names();
};

// From now on these functions are only counted and not forwarded: GL does nothing, and its queries
// leave their output unchanged.
void silence_gl(bool silent);
// Likewise of dispatches alone: everything but the pixels is as it would be.
void silence_dispatches(bool silent);
// Called before each dispatch; null: nothing.
void before_dispatches(std::function<void()> call);
// New textures hold bits that are all 1.
void fill_new_textures(bool fill);
// Makes the next calls of glTextureStorage2D fail as if memory had run out.
void refuse_texture_storage(bool refuse);
// Whether the context claims to report its loss, and whether it is lost.
void report_loss(bool tells, bool lost);

}  // namespace postchain::test
