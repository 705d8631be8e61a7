#include "tools/sequence/io/exr_internal.h"

#include <algorithm>
#include <new>

namespace postchain::io {

Imf::PixelType imf_type(PixelType type) {
    return type == PixelType::half      ? Imf::HALF
           : type == PixelType::float32 ? Imf::FLOAT
                                        : Imf::UINT;
}

Imf::FrameBuffer frame_buffer_of(const PartPixels& pixels) {
    Imf::FrameBuffer buffer;
    for (const PartPixels::Plane& plane : pixels.planes) {
        const ExrChannel& c = plane.channel;
        buffer.insert(c.name, Imf::Slice::Make(imf_type(c.type), plane.bytes.get(),
                                               box_of(pixels.window), size_t(bytes_of(c.type)),
                                               plane.row_bytes(), c.x_sampling, c.y_sampling));
    }
    return buffer;
}

Status status_of_exr_exception(StatusCode code, const std::string& place,
                               const std::string& fault) try {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return out_of_memory(place);
    } catch (const std::exception& e) {
        std::string what = e.what();
        // OpenEXR's threads hand on the text of what they have caught, and nothing else.
        for (const char* said :
             {"bad_alloc", "Failed to allocate memory", "Cannot allocate memory"})
            if (what.find(said) != std::string::npos) return out_of_memory(place);
        std::replace(what.begin(), what.end(), '\n', ' ');
        return Status(code, concat(place, ": ", fault, what));
    } catch (...) {
        return Status(code, concat(place, ": ", fault, "unknown failure inside OpenEXR"));
    }
} catch (...) {
    return out_of_memory(place);
}

}  // namespace postchain::io
