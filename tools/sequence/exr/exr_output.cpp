#include "tools/sequence/exr/exr_output.h"

#include <ImfDeepScanLineInputPart.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfDeepTiledInputPart.h>
#include <ImfDeepTiledOutputPart.h>
#include <ImfInputPart.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <ImfTiledOutputFile.h>
#include <ImfTiledOutputPart.h>
#include <fcntl.h>

#include <cerrno>
#include <cstring>

#include "tools/sequence/exr/exr_chunk_writer.h"

namespace postchain::io {

namespace {

void copy_part(Imf::MultiPartInputFile& in, int part, Imf::MultiPartOutputFile& out, int to) {
    const Imf::Header& header = in.header(part);
    const std::string type = header.hasType()              ? header.type()
                             : header.hasTileDescription() ? Imf::TILEDIMAGE
                                                           : Imf::SCANLINEIMAGE;
    if (type == Imf::DEEPSCANLINE) {
        Imf::DeepScanLineInputPart from(in, part);
        Imf::DeepScanLineOutputPart(out, to).copyPixels(from);
    } else if (type == Imf::DEEPTILE) {
        Imf::DeepTiledInputPart from(in, part);
        Imf::DeepTiledOutputPart(out, to).copyPixels(from);
    } else if (type == Imf::TILEDIMAGE) {
        Imf::TiledInputPart from(in, part);
        Imf::TiledOutputPart(out, to).copyPixels(from);
    } else {
        Imf::InputPart from(in, part);
        Imf::OutputPart(out, to).copyPixels(from);
    }
}

void write_tiles(auto&& to, const Imf::FrameBuffer& buffer) {
    to.setFrameBuffer(buffer);
    to.writeTiles(0, to.numXTiles(0) - 1, 0, to.numYTiles(0) - 1, 0, 0);
}

void write_lines(auto&& to, const Imf::FrameBuffer& buffer) {
    to.setFrameBuffer(buffer);
    const IMATH_NAMESPACE::Box2i& window = to.header().dataWindow();
    to.writePixels(window.max.y - window.min.y + 1);
}

// Appends the chunks of a part and fills in its table, which OpenEXR left empty.
Status append_chunks(Imf::OStream& stream, const ChunkLayout& layout, const PartPlanes& planes,
                     std::optional<int> part, int level, uint64_t table) {
    ASSIGN_OR_RETURN(const auto offsets, write_chunks(stream, layout, planes, part, level));
    const uint64_t end = stream.tellp();
    stream.seekp(table);
    // A ChunkLayout exists only on little-endian machines.
    stream.write(reinterpret_cast<const char*>(offsets.data()),
                 int(offsets.size() * sizeof(uint64_t)));
    stream.seekp(end);
    return {};
}

}  // namespace

Result<Packer> write_single_part(Imf::OStream& stream, const Imf::Header& header,
                                 const PartPlanes& planes) {
    const bool tiled = header.hasTileDescription();
    const int threads = Imf::globalThreadCount();
    // MultiPartOutputFile would add a "type" attribute to a file that has none.
    const auto layout = ChunkLayout::of(header);
    if (!layout) {
        const Imf::FrameBuffer buffer = frame_buffer_of(planes);
        if (tiled)
            write_tiles(Imf::TiledOutputFile(stream, header, threads), buffer);
        else
            write_lines(Imf::OutputFile(stream, header, threads), buffer);
        return Packer::openexr;
    }
    if (tiled)
        Imf::TiledOutputFile(stream, header, 0);
    else
        Imf::OutputFile(stream, header, 0);
    const uint64_t table = stream.tellp() - layout->count() * sizeof(uint64_t);
    RETURN_IF_ERROR(
        append_chunks(stream, *layout, planes, {}, header.zipCompressionLevel(), table));
    return Packer::own;
}

Result<Packer> copy_single_part(Imf::OStream& stream, const Imf::Header& header,
                                Imf::MultiPartInputFile& input) {
    Imf::InputPart from(input, 0);
    Imf::OutputFile(stream, header, Imf::globalThreadCount()).copyPixels(from);
    return Packer::openexr;
}

Result<Packer> write_multi_part(Imf::OStream& stream, const std::vector<Imf::Header>& headers,
                                const std::map<int, PartPlanes>& planes,
                                Imf::MultiPartInputFile& input, const std::vector<int>& from) {
    struct Own {
        ChunkLayout layout;
        uint64_t table;  // file offset
    };
    std::map<int, Own> own;
    {
        Imf::MultiPartOutputFile out(stream, headers.data(), int(headers.size()), false,
                                     Imf::globalThreadCount());
        // The tables of all parts follow the headers.
        uint64_t table = stream.tellp();
        for (int i = out.parts() - 1; i >= 0; --i) {
            table -= uint64_t(out.header(i).chunkCount()) * sizeof(uint64_t);
            if (!planes.contains(i)) continue;
            if (auto layout = ChunkLayout::of(headers[size_t(i)]))
                own.emplace(i, Own{*layout, table});
        }
        for (int i = 0; i < out.parts(); ++i) {
            const auto anew = planes.find(i);
            if (anew == planes.end())
                copy_part(input, from[size_t(i)], out, i);
            else if (own.contains(i))
                continue;
            else if (headers[size_t(i)].hasTileDescription())
                write_tiles(Imf::TiledOutputPart(out, i), frame_buffer_of(anew->second));
            else
                write_lines(Imf::OutputPart(out, i), frame_buffer_of(anew->second));
        }
    }
    for (const auto& [part, how] : own) {
        // OpenEXR writes one part as a single-part file, whose chunks have no part number.
        const std::optional<int> number =
            headers.size() > 1 ? std::optional<int>(part) : std::nullopt;
        RETURN_IF_ERROR(append_chunks(stream, how.layout, planes.at(part), number,
                                      headers[size_t(part)].zipCompressionLevel(), how.table));
    }
    return Packer::openexr;
}

namespace {

// Opens the file again and checks that every chunk has been written: if memory runs out while
// OpenEXR 3.1 compresses lines, it skips them without an error. Errors (memory), (output). Passes
// on OpenEXR's exceptions.
Status check_complete(AtomicFile& file) {
    RETURN_IF_ERROR(file.flush());
    FdIStream stream(file.temporary());
    const int fd = ::open(file.temporary().c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return Status(StatusCode::output,
                      concat(file.path(), ": cannot be read again: ", std::strerror(errno)));
    stream.take(fd, file.size());
    const Imf::MultiPartInputFile written(stream, 0, false);
    for (int part = 0; part < written.parts(); ++part)
        if (!written.partComplete(part))
            return Status(
                StatusCode::memory,
                concat(file.path(), ": not enough memory: OpenEXR could not compress every line"));
    return {};
}

}  // namespace

Status write_exr_file(const std::string& path, const WriteOptions& options, WriteReport& report,
                      const std::function<Result<Packer>(Imf::OStream&)>& write) {
    ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::create(path));
    AtomicOStream stream(file);
    try {
        const Result<Packer> packer = write(stream);
        if (!packer.ok()) return packer.status().at(path);
        if (*packer == Packer::openexr) RETURN_IF_ERROR(check_complete(file));
        // The file keeps write errors that OpenEXR's destructors dropped.
        RETURN_IF_ERROR(file.flush());
    } catch (...) {
        if (!stream.status.ok()) return stream.status;
        return status_of_exr_exception(StatusCode::output, path);
    }
    report.bytes = file.size();
    if (options.before_commit) RETURN_IF_ERROR(options.before_commit());
    ASSIGN_OR_RETURN(bool written, file.commit(options.on_existing));
    report.skipped = !written;
    return {};
}

}  // namespace postchain::io
