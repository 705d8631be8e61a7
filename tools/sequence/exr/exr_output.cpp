#include "tools/sequence/exr/exr_output.h"

#include <ImfChannelList.h>
#include <ImfDeepScanLineInputPart.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfDeepTiledInputPart.h>
#include <ImfDeepTiledOutputPart.h>
#include <ImfFloatAttribute.h>
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

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tools/sequence/exr/exr_chunks.h"

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
    RETURN_IF_ERROR(write_chunks(stream, *layout, planes, {}, header.zipCompressionLevel(), table));
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
        RETURN_IF_ERROR(write_chunks(stream, how.layout, planes.at(part), number,
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
                      concat(file.path(), ": cannot be read again: ", std::strerror(errno),
                             "; write it to another disk"));
    stream.take(fd, file.size());
    const Imf::MultiPartInputFile written(stream, 0, false);
    for (int part = 0; part < written.parts(); ++part)
        if (!written.partComplete(part))
            return Status(StatusCode::memory, concat(file.path(),
                                                     ": not enough memory: OpenEXR could not "
                                                     "compress every line; free some memory"));
    return {};
}

}  // namespace

Status write_exr_file(const std::string& path, const WriteOptions& options, WriteReport& report,
                      const std::function<Result<Packer>(Imf::OStream&)>& write) {
    ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::create(path));
    AtomicOStream stream(file);
    try {
        ASSIGN_OR_RETURN(const Packer packer, write(stream).at(path));
        if (packer == Packer::openexr) RETURN_IF_ERROR(check_complete(file));
        // The file keeps write errors that OpenEXR's destructors dropped.
        RETURN_IF_ERROR(file.flush());
    } catch (...) {
        if (!stream.status.ok()) return stream.status;
        return status_of_exr_exception(StatusCode::output, path);
    }
    report.bytes = file.size();
    if (options.before_commit) RETURN_IF_ERROR(options.before_commit());
    return file.commit(options.on_existing).status();
}

namespace {

bool is_in(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// "Z, Vector.X, ... (9 in all)"
std::string listed(const std::vector<std::string>& names) {
    constexpr size_t kShown = 12;
    std::string text;
    for (size_t i = 0; i < std::min(names.size(), kShown); ++i) text += (i ? ", " : "") + names[i];
    return names.size() > kShown ? concat(text, ", ... (", names.size(), " in all)") : text;
}

template <class... Parts>
Status usage(const Parts&... parts) {
    return Status(StatusCode::usage, concat(parts...));
}

Status check_channels(const std::vector<ExrPart>& parts, int color_part,
                      const std::vector<std::string>& color, const ExrSettings& settings) {
    std::vector<std::string> all;
    for (const ExrPart& part : parts)
        for (const ExrChannel& channel : part.channels) all.push_back(channel.name);
    for (const std::string& pattern : settings.channels)
        if (std::none_of(all.begin(), all.end(),
                         [&](const std::string& name) { return matches(pattern, name); }))
            return usage("{channels}: no channel "_keyed, pattern, "; there are ", listed(all));
    if (std::none_of(color.begin(), color.end(),
                     [&](const std::string& name) { return settings.takes(name); }))
        return usage("{channels} names no channel of color, which alone is filtered; add "_keyed,
                     listed(color));
    for (size_t i = 0; i < parts.size(); ++i) {
        if (int(i) == color_part) continue;
        const auto& channels = parts[i].channels;
        const auto taken =
            std::count_if(channels.begin(), channels.end(),
                          [&](const ExrChannel& c) { return settings.takes(c.name); });
        if (taken != 0 && size_t(taken) != channels.size())
            return usage("{channels} names some channels of part "_keyed, i, " '", parts[i].name,
                         "', which is copied as it is; name all of them or none");
    }
    return {};
}

}  // namespace

Result<std::vector<std::string>> check_settings(const std::vector<ExrPart>& parts, int color_part,
                                                const std::vector<std::string>& color,
                                                const ExrSettings& settings) {
    if (!settings.channels.empty())
        RETURN_IF_ERROR(check_channels(parts, color_part, color, settings));
    std::vector<std::string> notes;
    if (!settings.compression) return notes;
    std::vector<std::string> data, layers;
    for (const ExrChannel& channel : parts[size_t(color_part)].channels) {
        if (is_in(color, channel.name) || !settings.takes(channel.name) ||
            !settings.compression->changes(channel))
            continue;
        (channel.type == PixelType::half ? layers : data).push_back(channel.name);
    }
    const char* name = name_of(settings.compression->method);
    if (!data.empty())
        return usage(setting("compression", name), " would change ", listed(data),
                     ", which may be depth, vectors or ids; use a lossless one (zip, zips, "
                     "piz, rle, none), or leave them out ({channels})"_keyed);
    if (!layers.empty())
        notes.push_back(
            concat("compression ", name, " changes channels besides color: ", listed(layers)));
    return notes;
}

void apply_settings(const ExrSettings& settings, const std::vector<std::string>& color,
                    Imf::Header& header) {
    Imf::ChannelList channels;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        if (!settings.takes(it.name())) continue;
        Imf::Channel channel = it.channel();
        if (settings.half && channel.type == Imf::FLOAT && is_in(color, it.name()))
            channel.type = Imf::HALF;
        channels.insert(it.name(), channel);
    }
    header.channels() = channels;
    if (!settings.compression) return;
    const ExrCompression& compression = *settings.compression;
    header.compression() = Imf::Compression(compression.method);
    if (!compression.level) return;
    if (compression.is_zip()) header.zipCompressionLevel() = int(*compression.level);
    if (compression.is_dwa()) {
        header.dwaCompressionLevel() = *compression.level;
        header.insert("dwaCompressionLevel", Imf::FloatAttribute(*compression.level));
    }
}

std::vector<int> written_parts(const std::vector<ExrPart>& parts, const ExrSettings& settings) {
    std::vector<int> written;
    for (size_t i = 0; i < parts.size(); ++i) {
        const auto& channels = parts[i].channels;
        if (std::any_of(channels.begin(), channels.end(),
                        [&](const ExrChannel& c) { return settings.takes(c.name); }))
            written.push_back(int(i));
    }
    return written;
}

}  // namespace postchain::io
