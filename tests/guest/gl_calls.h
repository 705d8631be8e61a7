// Counts the library's GL calls. libepoxy calls GL through a variable for each function. Each
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
    // Objects made since start(), less those deleted.
    static int64_t objects();
    // The bits of the newest glMemoryBarrier.
    static uint32_t last_barrier();
    // All functions that are counted.
    static std::vector<std::string> names();
};

// From now on these functions are only counted and not forwarded: GL does nothing, and its queries
// leave their output unchanged.
void silence_gl(bool silent);

// Where these functions differ from GL.
struct GlFaults {
    bool silent_dispatches = false;  // everything but the pixels is as it would be
    std::function<void()> before_dispatch;
    bool fills_textures = false;   // new ones hold bits that are all 1
    bool refuses_storage = false;  // glTextureStorage2D fails as if memory had run out
    bool tells_loss = false;       // the context claims to report its loss
    bool is_lost = false;
    bool late_fences = false;  // none has passed before it is waited for
    unsigned renamed = 0;      // the string of this name, such as GL_VERSION, has a letter more
};
GlFaults& gl_faults();

}  // namespace postchain::test
