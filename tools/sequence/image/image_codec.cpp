#include "tools/sequence/image/image_codec.h"

#include <OpenImageIO/imageio.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <string_view>
#include <vector>

namespace postchain::io {
namespace {

constexpr uint64_t kMaxText = uint64_t(64) << 20;

uint64_t bytes_in(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    return uint64_t(std::max<std::streamoff>(file.tellg(), 0));
}

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
                                                     : (samples * uint64_t(info.bits) + 7) / 8;
    // Lines of packed samples begin at whole words of 32 bits.
    const bool in_words = !filled && (info.bits == 10 || info.bits == 12);
    const uint64_t line = in_words ? (row + 3) / 4 * 4 : row;
    return number(4, 4) + line * uint64_t(info.height - 1) + row;
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

// Checks that the file's first bytes are those of `format` (OpenImageIO's name), and that strings
// and user data stated by its header are in the file and take at most 64 MiB. Errors (input),
// without the path.
Status check_content(const std::string& path, const std::string& format) {
    const std::string found = format_of(first_bytes(path, 8));
    if (found.empty())
        return input_error(
            "damaged, or not of the format of its name; copy it again, or rename it");
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

// The most bytes of stored values that a file of `file_bytes` can hold, at the highest ratio of its
// compression (`compression`: of TIFF, OpenImageIO's name).
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

// Whether the file ends before its pixels do. OpenImageIO does not report that for JPEG and DPX.
bool is_cut(const std::string& path, const std::string& format, const ImageInfo& info) {
    if (format == "jpeg") return !jpeg_has_end(path);
    return format == "dpx" && bytes_in(path) < least_dpx_bytes(path, info);
}

// Color as it is stored: OpenImageIO would multiply it by alpha in the file's own bits. By the
// reader of this format and no other.
Result<std::unique_ptr<OIIO::ImageInput>> open_as_stored(const std::string& path,
                                                         const std::string& format) {
    OIIO::ImageSpec config, found;
    config.attribute("oiio:UnassociatedAlpha", 1);
    auto file = OIIO::ImageInput::create(format);
    if (!file)
        return input_error("cannot be read: " + OIIO::geterror() + "; copy or write it again");
    if (!file->open(path, found, config))
        return input_error("damaged, or not of the format of its name: " + file->geterror() +
                           "; copy it again, or rename it");
    return file;
}

// A header may state anything.
constexpr int kMaxOffset = 1 << 28;
constexpr size_t kMaxAttribute = size_t(1) << 20;  // longest string; more is cut off
constexpr uint64_t kMaxTileBytes = uint64_t(512) << 20;

// Sizes that the file cannot hold, and what would not fit in a number.
Status check_sizes(const std::string& path, const std::string& format,
                   const OIIO::ImageSpec& spec) {
    for (const int offset : {spec.x, spec.y, spec.full_x, spec.full_y})
        if (std::abs(int64_t(offset)) > kMaxOffset)
            return input_error(concat("its pixels begin at ", offset, "; set their offset to 0"));
    if (spec.width < 1 || spec.height < 1) return input_error("has no pixels; write it again");
    // Whole tiles are decoded, and a tile may be larger than the image.
    const auto whole = [](int side, int tile) {
        return tile > 0 ? (int64_t(side) + tile - 1) / tile * tile : int64_t(side);
    };
    const uint64_t of_pixel = spec.pixel_bytes(true);
    if (spec.tile_width > 0 &&
        uint64_t(spec.tile_width) * uint64_t(spec.tile_height) > kMaxTileBytes / of_pixel)
        return input_error(concat("has tiles of ", spec.tile_width, "x", spec.tile_height,
                                  " pixels, more than 512 MiB each; write it with smaller ones"));
    const uint64_t width = uint64_t(whole(spec.width, spec.tile_width));
    const uint64_t height = uint64_t(whole(spec.height, spec.tile_height));
    const uint64_t most =
        most_stored_bytes(format, spec.get_string_attribute("compression"), bytes_in(path));
    if (width > most / height / of_pixel)
        return input_error(concat("damaged or truncated: ", spec.width, "x", spec.height,
                                  " pixels are more than ", bytes_in(path),
                                  " bytes can hold; render it again, or wait until it is written"));
    return {};
}

// Integers of `bits` as OpenImageIO gives them: spread over 8 or 16 bits.
float unit_value(uint32_t stored, uint32_t whole, int bits) {
    const double largest = double((1 << bits) - 1);
    return float(std::round(double(stored) / whole * largest) / largest);
}

// Attributes of another format that describe its file's packing.
bool is_of_format(const std::string& name) {
    for (const char* prefix : {"tiff:", "png:", "dpx:", "jpeg:", "hdr:", "openexr:"})
        if (name.starts_with(prefix)) return true;
    return false;
}

// Attributes that hold only for the file that was read, or are written anew.
bool is_stale(const std::string& name) {
    static constexpr const char* kNames[] = {"oiio:SHA-1",
                                             "oiio:AverageColor",
                                             "oiio:ConstantColor",
                                             "oiio:ColorSpace",
                                             "oiio:BitsPerSample",
                                             "oiio:UnassociatedAlpha",
                                             "oiio:subimages",
                                             "thumbnail_width",
                                             "thumbnail_height",
                                             "thumbnail_nchannels",
                                             "thumbnail_image",
                                             "compression",
                                             "Compression",
                                             "planarconfig",
                                             "tiff:ColorSpace",
                                             "tiff:Compression",
                                             "tiff:PlanarConfiguration",
                                             "tiff:PhotometricInterpretation",
                                             "Exif:ColorSpace",
                                             "dpx:ImageDescriptor",
                                             "dpx:EndOfLinePadding",
                                             "dpx:EndOfImagePadding",
                                             "PixelAspectRatio",
                                             "openexr:chunkCount",
                                             "screenWindowCenter",
                                             "screenWindowWidth",
                                             "worldtocamera",
                                             "worldtoscreen"};
    return std::any_of(std::begin(kNames), std::end(kNames),
                       [&](const char* one) { return name == one; });
}

// Errors (output), without the path.
Status add_metadata(const ImageToWrite& picture, OIIO::ImageSpec& spec) {
    if (picture.metadata_of.empty()) return {};
    const auto from = OIIO::ImageInput::open(picture.metadata_of);
    if (!from) return Status(StatusCode::output, "no metadata of " + OIIO::geterror());
    const OIIO::ImageSpec there = from->spec(picture.metadata_part);
    const bool same_format = picture.info.format == from->format_name();
    for (const OIIO::ParamValue& attribute : there.extra_attribs) {
        const std::string name = attribute.name().string();
        if (is_stale(name) || (!same_format && is_of_format(name))) continue;
        if (!picture.same_transfer && name.starts_with("ICCProfile")) continue;
        spec.extra_attribs.push_back(attribute);
    }
    return {};
}

// A file without a name: encoders that seek write it, and its bytes are read back.
class MemoryFile {
  public:
    MemoryFile() : fd_(memfd_create("postchain picture", MFD_CLOEXEC)) {}
    ~MemoryFile() {
        if (fd_ >= 0) ::close(fd_);
    }
    MemoryFile(const MemoryFile&) = delete;
    std::string path() const { return concat("/proc/self/fd/", fd_); }
    Result<std::string> bytes() const {
        const off_t size = ::lseek(fd_, 0, SEEK_END);
        std::string bytes(size > 0 ? size_t(size) : 0, '\0');
        for (size_t done = 0; done < bytes.size();) {
            const ssize_t got = ::pread(fd_, bytes.data() + done, bytes.size() - done, off_t(done));
            if (got <= 0) return Status(StatusCode::output, std::strerror(errno));
            done += size_t(got);
        }
        if (bytes.empty()) return Status(StatusCode::output, "nothing was encoded");
        return bytes;
    }

  private:
    int fd_;
};

OIIO::TypeDesc type_of(const ImageInfo& info) {
    return info.is_float    ? OIIO::TypeDesc::FLOAT
           : info.bits <= 8 ? OIIO::TypeDesc::UINT8
                            : OIIO::TypeDesc::UINT16;
}

}  // namespace

Result<ImageInfo> describe_image(const std::string& path, const std::string& format) {
    RETURN_IF_ERROR(check_content(path, format));
    ASSIGN_OR_RETURN(const auto file, open_as_stored(path, format));
    const OIIO::ImageSpec& spec = file->spec();
    if (spec.deep || spec.depth > 1) return input_error("is deep or a volume; flatten it");
    if (spec.nchannels < 3 || spec.nchannels > 4)
        return input_error(
            concat("has ", spec.nchannels,
                   " channels; color has three, or four with alpha: write it as RGB"));
    RETURN_IF_ERROR(check_sizes(path, format, spec));
    std::string space = spec.get_string_attribute("tiff:ColorSpace");
    for (char& c : space) c = c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c;
    if (space.ends_with("LAB") || space.starts_with("LOGL"))
        return input_error(concat("has values of ", space, "; write it as RGB"));
    ImageInfo info;
    info.format = format;
    info.width = spec.width;
    info.height = spec.height;
    info.x = spec.x;
    info.y = spec.y;
    // A place on a page is none in a display window.
    if (spec.full_width == spec.width && spec.full_height == spec.height) {
        info.x = spec.full_x;
        info.y = spec.full_y;
    }
    info.display_x = spec.full_x;
    info.display_y = spec.full_y;
    info.display_width = spec.full_width;
    info.display_height = spec.full_height;
    // The range that OpenEXR accepts; DPX stores NaN or 0 if it is unknown.
    const float aspect = spec.get_float_attribute("PixelAspectRatio", 1);
    if (aspect >= 1e-6f && aspect <= 1e6f) info.pixel_aspect = aspect;
    info.channels = spec.nchannels;
    info.is_float = spec.format.is_floating_point();
    info.bits = info.is_float
                    ? 32
                    : spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
    if (!info.is_float && info.bits < 8) info.bits = 8;
    if (!info.is_float && size_t(info.bits) > spec.format.size() * 8)
        return input_error(concat("says that its values have ", info.bits, " bits, in ",
                                  spec.format.size() * 8, "; write it again"));
    const bool integer =
        spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16;
    if ((!info.is_float && !integer) || (info.is_float && spec.format.size() > 4))
        return input_error(concat("has values of the type ", spec.format.c_str(),
                                  "; 8 to 16 bits, half or float are read"));
    info.unassociated =
        spec.nchannels == 4 &&
        (format == "png" || spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0);
    info.color_space = spec.get_string_attribute("oiio:ColorSpace");
    for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
        // In metadata_val() a text has quotes around it.
        const std::string text = attribute.type() == OIIO::TypeString
                                     ? attribute.get_string()
                                     : spec.metadata_val(attribute, false);
        info.attributes[attribute.name().string()] = text.substr(0, kMaxAttribute);
    }
    info.has_more = file->seek_subimage(1, 0);
    return info;
}

Result<ImageF> read_stored_image(const std::string& path, const ImageInfo& info) {
    ASSIGN_OR_RETURN(const auto opened, open_as_stored(path, info.format));
    OIIO::ImageInput* file = opened.get();
    const OIIO::ImageSpec& spec = file->spec();
    if (spec.width != info.width || spec.height != info.height || spec.nchannels != info.channels)
        return input_error("has changed while it was read; wait until it is complete");
    if (is_cut(path, info.format, info))
        return input_error(
            "truncated: it ends too early; render it again, or wait until it is written");
    ImageF image(info.width, info.height, info.channels);
    bool read = false;
    if (info.is_float) {
        read = file->read_image(0, 0, 0, info.channels, OIIO::TypeDesc::FLOAT, image.data.data());
    } else {
        const auto get = [&](auto whole, OIIO::TypeDesc type) {
            std::vector<decltype(whole)> stored(image.data.size());
            read = file->read_image(0, 0, 0, info.channels, type, stored.data());
            for (size_t i = 0; i < stored.size(); ++i)
                image.data[i] = unit_value(stored[i], whole, info.bits);
        };
        if (info.bits <= 8)
            get(uint8_t(255), OIIO::TypeDesc::UINT8);
        else
            get(uint16_t(65535), OIIO::TypeDesc::UINT16);
    }
    const std::string said = file->geterror();
    if (!read || !said.empty())
        return input_error(concat("damaged or truncated: ", said.empty() ? "no pixels" : said,
                                  "; render it again, or wait until it is written"));
    return image;
}

Result<std::string> encode_image(const ImageToWrite& picture) {
    const ImageInfo& info = picture.info;
    OIIO::ImageSpec spec(info.width, info.height, info.channels, type_of(info));
    RETURN_IF_ERROR(add_metadata(picture, spec));
    if (info.channels == 4) spec.alpha_channel = 3;
    if (!info.is_float) spec.attribute("oiio:BitsPerSample", info.bits);
    if (info.unassociated) spec.attribute("oiio:UnassociatedAlpha", 1);
    if (!info.color_space.empty()) spec.attribute("oiio:ColorSpace", info.color_space);
    // Readers of JPEG disagree on which of its two densities is which.
    if (info.pixel_aspect != 1 && info.format != "jpeg")
        spec.attribute("PixelAspectRatio", info.pixel_aspect);
    if (!picture.compression.empty()) spec.attribute("compression", picture.compression);
    // Without a time, encoders of TIFF and DPX take the time of writing, and no two files would be
    // equal. This is EXIF's word for an unknown time.
    const bool is_timed = info.format == "tiff" || info.format == "dpx";
    if (is_timed && !spec.find_attribute("DateTime"))
        spec.attribute("DateTime", "0000:00:00 00:00:00");
    for (const auto& [name, text] : picture.attributes) spec.attribute(name, text);
    const MemoryFile memory;
    const auto out = OIIO::ImageOutput::create(picture.info.format);
    const OIIO::TypeDesc given = info.is_float ? OIIO::TypeDesc(OIIO::TypeDesc::FLOAT)
                                               : OIIO::TypeDesc(OIIO::TypeDesc::UINT16);
    if (!out || !out->open(memory.path(), spec) || !out->write_image(given, picture.values) ||
        !out->close())
        return Status(StatusCode::output,
                      "cannot be encoded: " + (out ? out->geterror() : OIIO::geterror()));
    return memory.bytes();
}

}  // namespace postchain::io
