// postchain scene: renders a generated sequence.
#include <charconv>
#include <cstdio>

#include "tools/io/sequence.h"
#include "tools/postchain/log.h"
#include "tools/postchain/verbs.h"
#include "tools/scenes/scene.h"

namespace postchain {
namespace {

bool parse_size(const std::string& text, int& width, int& height) {
    const char* end = text.data() + text.size();
    const auto w = std::from_chars(text.data(), end, width);
    if (w.ec != std::errc() || w.ptr == end || *w.ptr != 'x') return false;
    const auto h = std::from_chars(w.ptr + 1, end, height);
    return h.ec == std::errc() && h.ptr == end && width > 0 && height > 0 &&
           width <= io::kMaxSide && height <= io::kMaxSide;
}

}  // namespace
}  // namespace postchain
