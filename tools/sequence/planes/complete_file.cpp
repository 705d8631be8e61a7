#include "tools/sequence/planes/complete_file.h"

#include <unistd.h>

#include <array>
#include <cerrno>

#include "chain/base/readable_file.h"
#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {
namespace {

Status not_whole(std::string why) {
    return Status(StatusCode::input, std::move(why));
}

// A little-endian number of four bytes; empty if the file ends too early.
std::optional<uint32_t> uint32_at(int fd, uint64_t at) {
    std::array<uint8_t, 4> bytes = {};
    ssize_t read;
    do read = ::pread(fd, bytes.data(), bytes.size(), off_t(at));
    while (read < 0 && errno == EINTR);
    if (read != ssize_t(bytes.size())) return std::nullopt;
    uint32_t value = 0;
    for (size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
    return value;
}

// Size of a flat chunk in the file, by its own header: part number in a multi-part file, line or
// tile, then the size of its pixels. Source: "OpenEXR File Layout" (openexr.com).
std::optional<uint64_t> chunk_bytes(int fd, uint64_t offset, const HeaderFacts& facts,
                                    ChunkForm form) {
    const uint64_t place = (facts.multi_part ? 4 : 0) + (form.tiled ? 16 : 4);
    const auto size = uint32_at(fd, offset + place);
    if (!size || *size > INT32_MAX) return std::nullopt;
    return place + 4 + *size;
}

Status check_exr(int fd, uint64_t file_bytes) {
    ASSIGN_OR_RETURN(const auto facts, scan_header(fd, file_bytes, ReadLimits()));
    for (size_t part = 0; part < facts.chunks.size(); ++part) {
        const std::vector<uint64_t>& chunks = facts.chunks[part];
        const std::string place =
            facts.chunks.size() > 1 ? concat(" of part ", part) : std::string();
        size_t absent = 0;
        for (const uint64_t offset : chunks) absent += offset == 0;
        if (absent > 0)
            return not_whole(
                concat(absent, " of ", chunks.size(), " chunks", place, " are not written"));
        const ChunkForm form = facts.forms[part];
        if (!form.known || form.deep) continue;  // scan_header() has checked deep chunks
        for (const uint64_t offset : chunks) {
            const auto bytes = chunk_bytes(fd, offset, facts, form);
            if (!bytes || *bytes > file_bytes - offset)
                return not_whole(concat("a chunk", place, " ends behind the file's end"));
        }
    }
    return Status();
}

Status check_image(const std::string& path, const ImageFormat& format) {
    ASSIGN_OR_RETURN(const auto calls, image_module(StatusCode::input));
    ASSIGN_OR_RETURN(const auto info, calls->describe(path, format.name));
    return calls->read_stored(path, info).status();
}

}  // namespace

Status check_complete(const std::string& path) try {
    const ReadableFile file(path);
    if (!file.ok()) return not_whole(concat(path, ": ", file.fault()));
    Status status;
    if (file.bytes() == 0)
        status = not_whole("the file is empty (zero bytes)");
    else if (const ImageFormat* format = image_format_of(path))
        status = check_image(file.path(), *format);
    else
        status = check_exr(file.fd(), file.bytes());
    return status.ok() ? status : status.at(path);
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
