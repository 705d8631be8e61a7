// Parts of OpenEXR's C++ API that reading and writing share. For sources in exr/ and frame/ only.
#pragma once

#include <ImathBox.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPixelType.h>

#include <memory>
#include <string>
#include <vector>

#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_stream.h"

namespace postchain::io {

struct ExrFile::Impl {
    std::unique_ptr<FdIStream> stream;  // outlives `file`
    std::unique_ptr<Imf::MultiPartInputFile> file;
    HeaderFacts facts;
};

inline Window window_of(const IMATH_NAMESPACE::Box2i& box) {
    return {box.min.x, box.min.y, box.max.x, box.max.y};
}
inline IMATH_NAMESPACE::Box2i box_of(const Window& w) {
    return {{w.min_x, w.min_y}, {w.max_x, w.max_y}};
}
Imf::PixelType imf_type(PixelType type);
std::vector<ExrChannel> channels_in(const Imf::Header& header);

// Planes of one part, possibly from several PartPixels; all cover `window`.
struct PartPlanes {
    Window window;
    std::vector<const PartPixels::Plane*> planes;
};
PartPlanes planes_of(const PartPixels& pixels);

// Slices with the planes' own types and samplings; nothing is converted.
Imf::FrameBuffer frame_buffer_of(const PartPlanes& part);

// Status for the exception now being handled: out_of_memory(), otherwise `code` with `fault` before
// OpenEXR's message. Call it in catch blocks only.
Status status_of_exr_exception(StatusCode code, const std::string& place,
                               const std::string& fault = {});

}  // namespace postchain::io
