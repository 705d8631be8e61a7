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

Status status_of_exception(StatusCode code, const std::string& place, const std::string& fault) {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return Status(code, concat(place, ": not enough memory"));
    } catch (const std::exception& e) {
        std::string what = e.what();
        std::replace(what.begin(), what.end(), '\n', ' ');
        return Status(code, concat(place, ": ", fault, what));
    } catch (...) {
        return Status(code, concat(place, ": ", fault, "unknown failure inside OpenEXR"));
    }
}

}  // namespace postchain::io
