#include "tools/sequence/image/image_scan.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>
#include <vector>

namespace postchain::io {
namespace {

constexpr uint64_t kMaxText = uint64_t(64) << 20;

// libjpeg fills missing pixels with gray and reports no error.
bool jpeg_has_end(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 4096> tail;
    file.seekg(0, std::ios::end);
    const std::streamoff size = file.tellg();
    const std::streamoff count = std::min<std::streamoff>(size, std::streamoff(tail.size()));
    file.seekg(size - count);
    file.read(tail.data(), count);
    for (std::streamoff i = count - 1; i > 0; --i)
        if (tail[size_t(i)] == char(0xd9) && tail[size_t(i - 1)] == char(0xff)) return true;
    return false;
}

// The least size of a DPX file by its header (SMPTE 268M: data offset at 4; packing of the first
// element at 804, encoding at 806). OpenImageIO returns uninitialized memory for missing pixels. 0:
// unknown (run-length encoded).
uint64_t least_dpx_bytes(const std::string& path, const ImageInfo& info) {
    std::ifstream file(path, std::ios::binary);
    std::array<unsigned char, 808> header;
    if (!file.read(reinterpret_cast<char*>(header.data()), std::streamsize(header.size())))
        return header.size();
    const bool big = header[0] == 'S';
    const auto number = [&](size_t at, size_t bytes) {
        uint64_t value = 0;
        for (size_t i = 0; i < bytes; ++i)
            value = value << 8 | header[at + (big ? i : bytes - 1 - i)];
        return value;
    };
    if (number(806, 2) != 0) return 0;
    const uint64_t samples = uint64_t(info.width) * uint64_t(info.channels);
    const bool filled = number(804, 2) != 0;
    const uint64_t row = info.bits == 10 && filled   ? (samples + 2) / 3 * 4
                         : info.bits == 12 && filled ? samples * 2
                                                     : samples * uint64_t(info.bits) / 8;
    return number(4, 4) + row * uint64_t(info.height);
}

uint32_t big_endian(const unsigned char* bytes) {
    return uint32_t(bytes[0]) << 24 | uint32_t(bytes[1]) << 16 | uint32_t(bytes[2]) << 8 | bytes[3];
}

std::string first_bytes(const std::string& path, size_t count) {
    std::ifstream file(path, std::ios::binary);
    std::string bytes(count, '\0');
    file.read(bytes.data(), std::streamsize(count));
    bytes.resize(size_t(std::max<std::streamsize>(file.gcount(), 0)));
    return bytes;
}

// Empty: unknown format.
std::string format_of(std::string_view first) {
    using namespace std::string_view_literals;
    static constexpr std::pair<std::string_view, const char*> kMarks[] = {
        {"\x89PNG\r\n\x1a\n"sv, "png"},
        {"II*\0"sv, "tiff"},
        {"MM\0*"sv, "tiff"},
        {"II+\0"sv, "tiff"},
        {"MM\0+"sv, "tiff"},
        {"SDPX"sv, "dpx"},
        {"XPDS"sv, "dpx"},
        {"\xff\xd8"sv, "jpeg"},
        {"#?"sv, "hdr"}};
    for (const auto& [mark, format] : kMarks)
        if (first.starts_with(mark)) return format;
    return "";
}

// Unpacked size of a zlib stream, counted up to kMaxText, and its first four bytes as a number.
struct Unpacked {
    uint64_t bytes = 0;
    uint32_t first = 0;
};

Unpacked unpacked(std::string_view packed) {
    Unpacked result;
    z_stream stream = {};
    if (inflateInit(&stream) != Z_OK) return result;
    std::vector<unsigned char> part(size_t(1) << 16);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = uInt(packed.size());
    int code = Z_OK;
    while (code == Z_OK && result.bytes <= kMaxText) {
        stream.next_out = part.data();
        stream.avail_out = uInt(part.size());
        code = inflate(&stream, Z_NO_FLUSH);
        const size_t got = part.size() - stream.avail_out;
        if (result.bytes == 0 && got >= 4) result.first = big_endian(part.data());
        result.bytes += got;
        if (got == 0) break;
    }
    inflateEnd(&stream);
    return result;
}

// Offset of the packed bytes of a text or profile; npos: not packed.
size_t packed_at(std::string_view type, std::string_view body) {
    const size_t name = body.find('\0');
    if (name == std::string_view::npos) return name;
    if (type != "iTXt") return name + 2;
    if (name + 2 >= body.size() || body[name + 1] == 0) return std::string_view::npos;
    const size_t language = body.find('\0', name + 3);
    const size_t translated =
        language == std::string_view::npos ? language : body.find('\0', language + 1);
    return translated == std::string_view::npos ? translated : translated + 1;
}

// libpng allocates the stated length of each chunk, and the unpacked texts and profile.
Status check_chunks_of_png(const std::string& path) {
    const uint64_t whole = bytes_in(path);
    std::ifstream file(path, std::ios::binary);
    std::array<unsigned char, 8> head;
    uint64_t texts = 0;
    for (uint64_t at = 8; at + 12 <= whole;) {
        file.seekg(std::streamoff(at));
        if (!file.read(reinterpret_cast<char*>(head.data()), std::streamsize(head.size()))) break;
        const uint64_t length = big_endian(head.data());
        const std::string_view type(reinterpret_cast<const char*>(head.data()) + 4, 4);
        if (length > whole - at - 12)
            return input_error(concat("truncated or damaged: a part of ", length,
                                      " bytes in a file of ", whole,
                                      "; render it again, or wait until it is written"));
        if (type == "zTXt" || type == "iTXt" || type == "iCCP") {
            texts += length;
            if (texts <= kMaxText) {
                std::string body(length, '\0');
                file.read(body.data(), std::streamsize(length));
                if (const size_t from = packed_at(type, body); from < body.size()) {
                    const Unpacked text = unpacked(std::string_view(body).substr(from));
                    texts +=
                        type == "iCCP" ? std::max<uint64_t>(text.bytes, text.first) : text.bytes;
                }
            }
            if (texts > kMaxText)
                return input_error(
                    "has texts or a profile that become more than 64 MiB; write it "
                    "without them");
        }
        at += length + 12;
    }
    return {};
}

// Size of a DPX file's user data after its header (SMPTE 268M: at 32); all ones: none.
uint64_t user_bytes_of_dpx(const std::string& path) {
    const std::string header = first_bytes(path, 36);
    if (header.size() < 36) return 0;
    std::array<unsigned char, 4> size;
    std::copy_n(header.data() + 32, 4, size.begin());
    if (header[0] == 'X') std::reverse(size.begin(), size.end());
    const uint32_t bytes = big_endian(size.data());
    return bytes == 0xffffffff ? 0 : bytes;
}

}  // namespace

Status check_content(const std::string& path, const std::string& format) {
    const std::string found = format_of(first_bytes(path, 8));
    if (found.empty()) return input_error("damaged, or not of the format of its name");
    if (found != format)
        return input_error(concat("holds a picture of the format ", found, ", and its name says ",
                                  format, "; rename it"));
    if (format == "png") return check_chunks_of_png(path);
    if (format == "dpx") {
        const uint64_t user = user_bytes_of_dpx(path);
        if (user > kMaxText || user > bytes_in(path))
            return input_error(concat("states ", user,
                                      " bytes of data of its writer, in a file of ", bytes_in(path),
                                      "; at most 64 MiB are read: damaged or truncated"));
    }
    return {};
}

uint64_t most_stored_bytes(const std::string& format, const std::string& compression,
                           uint64_t file_bytes) {
    uint64_t ratio = 32768;  // Zstandard: a block of 128 KiB in four bytes
    if (format == "png")
        ratio = 1032;  // deflate: 258 bytes in two bits
    else if (format == "hdr")
        ratio = 64;  // a run of 127 takes two bytes
    else if (format == "jpeg")
        ratio = 6144;  // a bit for a block of 64, each component at a quarter of the size, of three
    else if (format == "tiff" && compression == "none")
        ratio = 1;
    else if (format == "tiff" && compression == "packbits")
        ratio = 64;  // a run of 128 takes two bytes
    else if (format == "tiff" && compression == "lzw")
        ratio = 1400;  // strings of up to 3837 bytes in codes of 9 to 12 bits
    else if (format == "tiff" && compression == "zip")
        ratio = 1032;
    return ratio * file_bytes;
}

bool is_cut(const std::string& path, const std::string& format, const ImageInfo& info) {
    if (format == "jpeg") return !jpeg_has_end(path);
    return format == "dpx" && bytes_in(path) < least_dpx_bytes(path, info);
}

uint64_t bytes_in(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    return uint64_t(std::max<std::streamoff>(file.tellg(), 0));
}

}  // namespace postchain::io
