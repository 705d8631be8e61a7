#include "tools/sequence/exr/exr_internal.h"

#include <ImfChannelList.h>

#include <algorithm>
#include <new>

namespace postchain::io {

namespace {

PixelType pixel_type(Imf::PixelType type) {
    return type == Imf::HALF    ? PixelType::half
           : type == Imf::FLOAT ? PixelType::float32
                                : PixelType::uint32;
}

}  // namespace

Imf::PixelType imf_type(PixelType type) {
    return type == PixelType::half      ? Imf::HALF
           : type == PixelType::float32 ? Imf::FLOAT
                                        : Imf::UINT;
}

std::vector<ExrChannel> channels_in(const Imf::Header& header) {
    std::vector<ExrChannel> list;
    const Imf::ChannelList& channels = header.channels();
    for (auto it = channels.begin(); it != channels.end(); ++it) {
        const Imf::Channel& c = it.channel();
        list.push_back({it.name(), pixel_type(c.type), c.xSampling, c.ySampling});
    }
    return list;
}

PartPlanes planes_of(const PartPixels& pixels) {
    PartPlanes part{pixels.window, {}};
    for (const PartPixels::Plane& plane : pixels.planes) part.planes.push_back(&plane);
    return part;
}

Imf::FrameBuffer frame_buffer_of(const PartPlanes& part) {
    Imf::FrameBuffer buffer;
    for (const PartPixels::Plane* plane : part.planes) {
        const ExrChannel& c = plane->channel;
        buffer.insert(c.name, Imf::Slice::Make(imf_type(c.type), plane->bytes.get(),
                                               box_of(part.window), size_t(bytes_of(c.type)),
                                               plane->row_bytes(), c.x_sampling, c.y_sampling));
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
        // OpenEXR's threads pass on only the message of an exception.
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
