#include "chain/gl/device.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "chain/gl/image_reads.h"

namespace postchain::gl {
namespace {

Limits read_limits() {
    Limits limits;
    const auto read = [](GLenum name, int& value) { glGetIntegerv(name, &value); };
    read(GL_MAX_TEXTURE_SIZE, limits.texture_px);
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limits.storage_block_bytes);
    read(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE, limits.shared_memory_bytes);
    read(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS, limits.group_invocations);
    read(GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS, limits.texture_units);
    read(GL_MAX_COMPUTE_IMAGE_UNIFORMS, limits.image_units);
    int down = 0;
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &limits.groups);
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 1, &down);
    limits.groups = std::min(limits.groups, down);
    return limits;
}

}  // namespace

DeviceClass Device::device_class() const {
    const bool room = limits.image_units >= kFirstReadImage + kMaxUnits;
    return software && room ? DeviceClass::software : DeviceClass::gpu;
}

Device describe_current(LogCallback log) {
    const auto text = [](GLenum name) {
        const auto* bytes = reinterpret_cast<const char*>(glGetString(name));
        return std::string(bytes ? bytes : "");
    };
    Device device;
    device.vendor = text(GL_VENDOR);
    device.renderer = text(GL_RENDERER);
    device.version = text(GL_VERSION);
    for (const char* word : {"llvmpipe", "softpipe", "swrast"})
        if (device.renderer.find(word) != std::string::npos) device.software = true;
    device.limits = read_limits();
    device.log = std::move(log);
    return device;
}

}  // namespace postchain::gl
