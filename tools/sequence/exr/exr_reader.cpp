#include "tools/sequence/exr/exr_reader.h"

#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiView.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringVectorAttribute.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <mutex>

#include "chain/base/readable_file.h"
#include "tools/sequence/exr/deep_reader.h"
#include "tools/sequence/exr/exr_chunks.h"
#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/worker_pool.h"

namespace postchain::io {

namespace {

ExrPart part_of(const Imf::Header& header) {
    ExrPart part;
    if (header.hasName()) part.name = header.name();
    if (header.hasView()) part.view = header.view();
    part.tiled = header.hasTileDescription();
    part.type = header.hasType() ? header.type()
                : part.tiled     ? Imf::TILEDIMAGE
                                 : Imf::SCANLINEIMAGE;
    part.deep = part.type == Imf::DEEPSCANLINE || part.type == Imf::DEEPTILE;
    part.mip_mapped = part.tiled && header.tileDescription().mode != Imf::ONE_LEVEL;
    part.compression = compression_name(header.compression());
    part.data_window = window_of(header.dataWindow());
    part.display_window = window_of(header.displayWindow());
    part.pixel_aspect = header.pixelAspectRatio();
    part.channels = channels_in(header);
    if (Imf::hasMultiView(header)) part.views = Imf::multiView(header);
    if (Imf::hasChromaticities(header)) {
        const Imf::Chromaticities& c = Imf::chromaticities(header);
        part.chromaticities = {c.red.x,  c.red.y,  c.green.x, c.green.y,
                               c.blue.x, c.blue.y, c.white.x, c.white.y};
    }
    for (auto it = header.begin(); it != header.end(); ++it)
        part.attributes[it.name()] = attribute_text(it.attribute());
    return part;
}

ChunkSource chunk_source(const ExrFile::Impl& file, int part) {
    ChunkSource source;
    source.fd = file.stream->fd();
    source.offsets = file.facts.chunks[size_t(part)];
    if (file.facts.multi_part) source.part = part;
    return source;
}

}  // namespace

void set_exr_threads(int count) {
    Imf::setGlobalThreadCount(std::max(count, 0));
    WorkerPool::shared().set_threads(count);
}

ExrFile::ExrFile() : impl_(std::make_unique<Impl>()) {}
ExrFile::ExrFile(ExrFile&&) noexcept = default;
ExrFile& ExrFile::operator=(ExrFile&&) noexcept = default;
ExrFile::~ExrFile() = default;

Result<ExrFile> ExrFile::open(const std::string& path, const ReadLimits& limits) try {
    ExrFile file;
    file.path_ = path;
    Impl& impl = *file.impl_;
    impl.stream = std::make_unique<FdIStream>(path);
    ReadableFile opened(path);
    if (!opened.ok())
        return input_error(path,
                           opened.error() == ENOENT ? std::string("no such file") : opened.fault());
    const int fd = opened.release();
    file.bytes_ = opened.bytes();
    impl.stream->take(fd, file.bytes_);
    ASSIGN_OR_RETURN(impl.facts, scan_header(fd, file.bytes_, limits).at(path));
    static std::once_flag once;
    std::call_once(once, [] { Imf::Header::setMaxTileSize(kMaxSide, kMaxSide); });
    // Chunk tables are not reconstructed: an incomplete file is refused below.
    impl.file =
        std::make_unique<Imf::MultiPartInputFile>(*impl.stream, Imf::globalThreadCount(), false);
    for (int i = 0; i < impl.file->parts(); ++i) {
        if (!impl.file->partComplete(i)) {
            return input_error(
                path, "incomplete: its writer did not finish; wait for it or render it again");
        }
        file.parts_.push_back(part_of(impl.file->header(i)));
        file.parts_.back().flattening_bytes = impl.facts.flattening[size_t(i)];
    }
    return file;
} catch (...) {
    return status_of_exr_exception(StatusCode::input, path, "damaged or truncated: ");
}

int ExrFile::rows_at_once(int part) const {
    const Imf::Header& header = impl_->file->header(part);
    if (header.hasTileDescription()) return int(header.tileDescription().ySize);
    return lines_of_chunk(int(header.compression()));
}

Status ExrFile::read_planes(PartPixels& pixels) try {
    const int part = pixels.part;
    const ExrPart& info = parts()[size_t(part)];
    const Imf::Header& header = impl_->file->header(part);
    const auto place = [&](const Status& s) {
        return s.at(parts().size() > 1 ? concat(path(), ": part ", part, " '", info.name, "'")
                                       : path());
    };
    if (info.deep) {
        const Status s = read_deep_part(chunk_source(*impl_, part), ChunkLayout::of_deep(header),
                                        ExrMethod(header.compression()), flattening, pixels);
        return s.ok() ? s : place(s);
    }
    if (const auto layout = ChunkLayout::of(header)) {
        const Status s = read_chunks(chunk_source(*impl_, part), *layout, pixels);
        return s.ok() ? s : place(s);
    }
    const Imf::FrameBuffer buffer = frame_buffer_of(planes_of(pixels));
    if (info.tiled) {
        Imf::TiledInputPart in(*impl_->file, part);
        in.setFrameBuffer(buffer);
        const int rows = int(in.tileYSize());
        const int first = (pixels.window.min_y - info.data_window.min_y) / rows;
        const int last = (pixels.window.max_y - info.data_window.min_y) / rows;
        in.readTiles(0, in.numXTiles(0) - 1, first, last, 0, 0);
    } else {
        Imf::InputPart in(*impl_->file, part);
        in.setFrameBuffer(buffer);
        in.readPixels(pixels.window.min_y, pixels.window.max_y);
    }
    return {};
} catch (...) {
    return status_of_exr_exception(StatusCode::input, path(), "damaged or truncated: ");
}

}  // namespace postchain::io
