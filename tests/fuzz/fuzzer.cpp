// libFuzzer's entry point; one program per target, whose function is POSTCHAIN_FUZZ_TARGET.
#include <cstddef>
#include <cstdint>

#include "targets.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    postchain::fuzz::POSTCHAIN_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
    return 0;
}
