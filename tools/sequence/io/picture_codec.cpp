#include "tools/sequence/io/picture_codec.h"

#include <OpenImageIO/imageio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>

namespace postchain::io {
namespace {

Status refuse(const std::string& why) {
    return Status(StatusCode::input, why);
}

// Color as it is stored: OpenImageIO would multiply it by alpha in the file's own bits.
std::unique_ptr<OIIO::ImageInput> open_as_stored(const std::string& path) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return OIIO::ImageInput::open(path, &config);
}

// libjpeg fills what is missing of a file with gray, and says nothing.
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

// Bytes that the pixels of a DPX file take at least and where they begin, by its header (SMPTE
// 268M: data offset at 4; of the first element packing at 804, encoding at 806); OpenImageIO gives
// what is missing as it finds it in memory. 0: the header does not tell (run-length encoded).
uint64_t least_dpx_bytes(const std::string& path, const PictureInfo& info) {
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

uint64_t bytes_in(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    return uint64_t(std::max<std::streamoff>(file.tellg(), 0));
}

// What OpenImageIO does not say of a file that ends too early.
bool is_cut(const std::string& path, const std::string& format, const PictureInfo& info) {
    if (format == "jpeg") return !jpeg_has_end(path);
    return format == "dpx" && bytes_in(path) < least_dpx_bytes(path, info);
}

// Integers of `bits` as OpenImageIO gives them: spread over 8 or 16 bits.
float unit_value(uint32_t stored, uint32_t whole, int bits) {
    const double largest = double((1 << bits) - 1);
    return float(std::round(double(stored) / whole * largest) / largest);
}

// Of another format: what describes how its file was packed.
bool is_of_format(const std::string& name) {
    for (const char* prefix : {"tiff:", "png:", "dpx:", "jpeg:", "hdr:", "openexr:"})
        if (name.starts_with(prefix)) return true;
    return name == "compression" || name == "Compression";
}

// What was true of the file that was read alone, or is said anew.
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
                                             "planarconfig",
                                             "tiff:PlanarConfiguration",
                                             "tiff:PhotometricInterpretation",
                                             "Exif:ColorSpace",
                                             "dpx:ImageDescriptor",
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
Status add_metadata(const PictureToWrite& picture, OIIO::ImageSpec& spec) {
    if (picture.metadata_of.empty()) return {};
    const auto from = OIIO::ImageInput::open(picture.metadata_of);
    if (!from) return Status(StatusCode::output, "no metadata of " + OIIO::geterror());
    const OIIO::ImageSpec there = from->spec(picture.metadata_part);
    const bool same_format = picture.format == from->format_name();
    for (const OIIO::ParamValue& attribute : there.extra_attribs) {
        const std::string name = attribute.name().string();
        if (is_stale(name) || (!same_format && is_of_format(name))) continue;
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

OIIO::TypeDesc type_of(const PictureInfo& info) {
    return info.is_float    ? OIIO::TypeDesc::FLOAT
           : info.bits <= 8 ? OIIO::TypeDesc::UINT8
                            : OIIO::TypeDesc::UINT16;
}

}  // namespace

Result<PictureInfo> describe_picture(const std::string& path, const std::string& format) {
    const auto file = open_as_stored(path);
    if (!file) return refuse("damaged, or no picture of its name: " + OIIO::geterror());
    if (format != file->format_name())
        return refuse(concat("holds a picture of the format ", file->format_name(),
                             ", and its name says ", format, "; rename it"));
    const OIIO::ImageSpec& spec = file->spec();
    if (spec.deep || spec.depth > 1) return refuse("is deep or a volume; flatten it");
    if (spec.nchannels < 3 || spec.nchannels > 4)
        return refuse(concat("has ", spec.nchannels,
                             " channels; color has three, or four with alpha: write it as RGB"));
    PictureInfo info;
    info.width = spec.width;
    info.height = spec.height;
    info.x = spec.x;
    info.y = spec.y;
    info.display_x = spec.full_x;
    info.display_y = spec.full_y;
    info.display_width = spec.full_width;
    info.display_height = spec.full_height;
    info.pixel_aspect = spec.get_float_attribute("PixelAspectRatio", 1);
    info.channels = spec.nchannels;
    info.is_float = spec.format.is_floating_point();
    info.bits = info.is_float
                    ? 32
                    : spec.get_int_attribute("oiio:BitsPerSample", int(spec.format.size()) * 8);
    if (!info.is_float && info.bits < 8) info.bits = 8;
    const bool integer =
        spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16;
    if ((!info.is_float && !integer) || (info.is_float && spec.format.size() > 4))
        return refuse(concat("has values of the type ", spec.format.c_str(),
                             "; 8 to 16 bits, half or float are read"));
    info.unassociated =
        spec.nchannels == 4 &&
        (format == "png" || spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0);
    info.color_space = spec.get_string_attribute("oiio:ColorSpace");
    for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
        const std::string text = spec.metadata_val(attribute, false);
        info.attributes[attribute.name().string()] = text.substr(0, 1000);
    }
    return info;
}

Result<ImageF> read_stored_picture(const std::string& path, const PictureInfo& info) {
    const auto file = open_as_stored(path);
    if (!file) return refuse("cannot be read: " + OIIO::geterror());
    const OIIO::ImageSpec& spec = file->spec();
    if (spec.width != info.width || spec.height != info.height || spec.nchannels != info.channels)
        return refuse("has changed while it was read");
    if (is_cut(path, file->format_name(), info))
        return refuse("truncated: it ends too early; render it again, or wait until it is written");
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
        return refuse(concat("damaged or truncated: ", said.empty() ? "no pixels" : said,
                             "; render it again, or wait until it is written"));
    return image;
}

Result<std::string> encode_picture(const PictureToWrite& picture) {
    const PictureInfo& info = picture.info;
    OIIO::ImageSpec spec(info.width, info.height, info.channels, type_of(info));
    if (Status s = add_metadata(picture, spec); !s.ok()) return s;
    if (info.channels == 4) spec.alpha_channel = 3;
    if (!info.is_float) spec.attribute("oiio:BitsPerSample", info.bits);
    if (info.unassociated) spec.attribute("oiio:UnassociatedAlpha", 1);
    if (!info.color_space.empty()) spec.attribute("oiio:ColorSpace", info.color_space);
    if (info.pixel_aspect != 1) spec.attribute("PixelAspectRatio", info.pixel_aspect);
    for (const auto& [name, text] : picture.attributes) spec.attribute(name, text);
    const MemoryFile memory;
    const auto out = OIIO::ImageOutput::create(picture.format);
    const OIIO::TypeDesc given = info.is_float ? OIIO::TypeDesc(OIIO::TypeDesc::FLOAT)
                                               : OIIO::TypeDesc(OIIO::TypeDesc::UINT16);
    if (!out || !out->open(memory.path(), spec) || !out->write_image(given, picture.values) ||
        !out->close())
        return Status(StatusCode::output,
                      "cannot be encoded: " + (out ? out->geterror() : OIIO::geterror()));
    return memory.bytes();
}

}  // namespace postchain::io
