#include "tools/sequence/image/image_module.h"

#include <dlfcn.h>

#include <cstring>

namespace postchain::io {
namespace {

constexpr const char* kFile = "libpostchain_images.so";

// The module, or why it could not be loaded.
struct Module {
    const ImageCalls* calls;
    std::string fault;
};

Module load() {
    // Lazy binding: most of OpenImageIO's functions are never called.
    void* module = dlopen(kFile, RTLD_LAZY | RTLD_LOCAL);
    if (!module) return {nullptr, dlerror()};
    const auto calls =
        reinterpret_cast<decltype(&postchain_image_calls)>(dlsym(module, "postchain_image_calls"));
    if (!calls) return {nullptr, dlerror()};
    if (std::strcmp(calls()->version, POSTCHAIN_VERSION) != 0)
        return {nullptr, concat(kFile, " is of version ", calls()->version, ", this program of ",
                                POSTCHAIN_VERSION)};
    return {calls(), ""};
}

}  // namespace

Result<const ImageCalls*> image_module(StatusCode code) {
    static const Module module = load();
    if (module.calls) return module.calls;
    return Status(code, concat("formats other than EXR need the module ", kFile,
                               " of postchain, which cannot be loaded: ", module.fault,
                               "; install postchain as a whole, and OpenImageIO"));
}

}  // namespace postchain::io
