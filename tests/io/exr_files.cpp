#include "tests/io/exr_files.h"

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfDeepTiledOutputPart.h>
#include <ImfFrameBuffer.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfTiledOutputPart.h>
#include <OpenImageIO/deepdata.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <half.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <sstream>

namespace postchain::test {

uint32_t sample_bits(const FilePart& part, size_t channel, int x, int y) {
    if (part.bits) return part.bits(channel, x, y);
    // A hash of the position (Wang's mixing steps).
    uint32_t h = uint32_t(channel) * 0x9e3779b9u + uint32_t(x) * 73856093u +
                 uint32_t(y) * 19349663u + uint32_t(part.name.size()) * 83492791u;
    h = (h ^ 61u) ^ (h >> 16);
    h *= 9u;
    h ^= h >> 4;
    h *= 0x27d4eb2du;
    h ^= h >> 15;
    if (part.repeating) h = uint32_t((x >> 2) + 3 * (y >> 1) + 5 * int(channel)) % 61 * 7919;
    const float value = float(int(h % 4001) - 2000) / 1001.0f;
    switch (part.channels[channel].type) {
        case Imf::HALF:
            return half(value).bits();
        case Imf::FLOAT:
            if (part.special_values && h % 7 == 0) return 0x7fc01234u;  // NaN with a payload
            if (part.special_values && h % 7 == 1) return 0x7f800000u;  // +Inf
            return std::bit_cast<uint32_t>(value);
        default:
            return h;
    }
}

float sample_value(const FilePart& part, size_t channel, int x, int y) {
    const uint32_t bits = sample_bits(part, channel, x, y);
    switch (part.channels[channel].type) {
        case Imf::HALF:
            return float(half(half::FromBits, uint16_t(bits)));
        case Imf::FLOAT:
            return std::bit_cast<float>(bits);
        default:
            return float(bits);
    }
}

namespace {

Imf::Header header_of(const FilePart& part, bool multi) {
    Imf::Header header(part.display, part.data);
    header.compression() = part.compression;
    header.lineOrder() = part.line_order;
    for (const FileChannel& c : part.channels) {
        header.channels().insert(c.name, Imf::Channel(c.type, c.x_sampling, c.y_sampling));
    }
    if (part.tile > 0) {
        header.setTileDescription(
            Imf::TileDescription(unsigned(part.tile), unsigned(part.tile), part.levels));
    }
    if (multi) header.setName(part.name);
    // MultiPartOutputFile demands a type even for a single part.
    header.setType(part.deep ? (part.tile > 0 ? Imf::DEEPTILE : Imf::DEEPSCANLINE)
                             : (part.tile > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE));
    if (part.edit) part.edit(header);
    return header;
}

struct PartPlanes {
    std::vector<std::vector<char>> bytes;
    Imf::FrameBuffer buffer;
};

// All samples of a window, channel by channel.
std::unique_ptr<PartPlanes> planes_of(const FilePart& part, const Imath::Box2i& window) {
    auto planes = std::make_unique<PartPlanes>();
    for (size_t c = 0; c < part.channels.size(); ++c) {
        const FileChannel& channel = part.channels[c];
        const auto& [name, type, step_x, step_y] = channel;
        const size_t size = type == Imf::HALF ? 2 : 4;
        const int width = (window.max.x - window.min.x) / step_x + 1;
        const int height = (window.max.y - window.min.y) / step_y + 1;
        std::vector<char>& bytes = planes->bytes.emplace_back(size_t(width) * height * size);
        for (int y = 0; y < height && !part.black; ++y) {
            for (int x = 0; x < width; ++x) {
                const uint32_t bits =
                    sample_bits(part, c, window.min.x + x * step_x, window.min.y + y * step_y);
                std::memcpy(bytes.data() + (size_t(y) * width + x) * size, &bits, size);
            }
        }
        planes->buffer.insert(name, Imf::Slice::Make(type, bytes.data(), window, size,
                                                     size * size_t(width), step_x, step_y));
    }
    return planes;
}

std::string stored_bytes(Imf::PixelType type, float value) {
    const uint32_t bits = type == Imf::HALF    ? half(value).bits()
                          : type == Imf::FLOAT ? std::bit_cast<uint32_t>(value)
                                               : uint32_t(value);
    return std::string(reinterpret_cast<const char*>(&bits), type == Imf::HALF ? 2 : 4);
}

void write_deep(Imf::MultiPartOutputFile& out, int index, const FilePart& part) {
    const Imath::Box2i& w = part.data;
    const int width = w.max.x - w.min.x + 1;
    const int height = w.max.y - w.min.y + 1;
    const size_t pixels = size_t(width) * height;
    std::vector<unsigned> counts(pixels);
    std::vector<std::string> samples(part.channels.size() * pixels);
    std::vector<std::vector<char*>> pointers(part.channels.size(), std::vector<char*>(pixels));
    for (size_t p = 0; p < pixels; ++p) {
        counts[p] = unsigned(p % 4);
        for (size_t c = 0; c < part.channels.size(); ++c) {
            std::vector<float> values;
            for (unsigned s = 0; s < counts[p]; ++s) values.push_back(float(s * 10 + c));
            if (part.samples)
                values = part.samples(w.min.x + int(p) % width, w.min.y + int(p) / width, c);
            counts[p] = unsigned(values.size());
            std::string& bytes = samples[c * pixels + p];
            for (const float value : values) bytes += stored_bytes(part.channels[c].type, value);
            pointers[c][p] = bytes.data();
        }
    }
    Imf::DeepFrameBuffer buffer;
    const auto origin = [&](auto* base, size_t size) {
        return reinterpret_cast<char*>(base) -
               (ptrdiff_t(w.min.x) + ptrdiff_t(w.min.y) * width) * ptrdiff_t(size);
    };
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, origin(counts.data(), sizeof(unsigned)),
                                             sizeof(unsigned), sizeof(unsigned) * width));
    for (size_t c = 0; c < part.channels.size(); ++c) {
        const auto& [name, type, x_sampling, y_sampling] = part.channels[c];
        buffer.insert(name,
                      Imf::DeepSlice(type, origin(pointers[c].data(), sizeof(char*)), sizeof(char*),
                                     sizeof(char*) * width, type == Imf::HALF ? 2 : 4));
    }
    if (part.tile > 0) {
        Imf::DeepTiledOutputPart to(out, index);
        to.setFrameBuffer(buffer);
        to.writeTiles(0, to.numXTiles(0) - 1, 0, to.numYTiles(0) - 1, 0, 0);
    } else {
        Imf::DeepScanLineOutputPart to(out, index);
        to.setFrameBuffer(buffer);
        to.writePixels(height);
    }
}

void write_tiled(Imf::MultiPartOutputFile& out, int index, const FilePart& part) {
    Imf::TiledOutputPart to(out, index);
    for (int ly = 0; ly < to.numYLevels(); ++ly) {
        for (int lx = 0; lx < to.numXLevels(); ++lx) {
            if (!to.isValidLevel(lx, ly)) continue;
            const auto planes = planes_of(part, to.dataWindowForLevel(lx, ly));
            to.setFrameBuffer(planes->buffer);
            to.writeTiles(0, to.numXTiles(lx) - 1, 0, to.numYTiles(ly) - 1, lx, ly);
        }
    }
}

}  // namespace

void write_file(const std::string& path, const std::vector<FilePart>& parts) {
    const bool multi = parts.size() > 1 || !parts[0].name.empty();
    std::vector<Imf::Header> headers;
    for (const FilePart& part : parts) headers.push_back(header_of(part, multi));
    Imf::MultiPartOutputFile out(path.c_str(), headers.data(), int(headers.size()));
    for (size_t i = 0; i < parts.size(); ++i) {
        const FilePart& part = parts[i];
        if (part.deep) {
            write_deep(out, int(i), part);
        } else if (part.tile > 0) {
            write_tiled(out, int(i), part);
        } else {
            const auto planes = planes_of(part, part.data);
            Imf::OutputPart to(out, int(i));
            to.setFrameBuffer(planes->buffer);
            to.writePixels(part.data.max.y - part.data.min.y + 1);
        }
    }
}

std::string bytes_of_file(const std::vector<FilePart>& parts) {
    const TempFolder folder;
    write_file(folder.path("f.exr"), parts);
    return read_text(folder.path("f.exr"));
}

Status read_whole(const std::string& path, const io::ReadLimits& limits) {
    Result<io::ExrFile> file = io::ExrFile::open(path, limits);
    Status status = file.status();
    for (size_t i = 0; status.ok() && i < file->parts().size(); ++i)
        status = file->read_part(int(i)).status();
    return status;
}

FilePart rgba_z(const std::string& name) {
    return {.name = name, .channels = {{"R"}, {"G"}, {"B"}, {"A"}, {"Z", Imf::FLOAT}}};
}

size_t chunk_table_of(const std::string& bytes, size_t chunks) {
    for (size_t at = 8; at + 8 * chunks <= bytes.size(); ++at) {
        uint64_t first = 0;
        std::memcpy(&first, bytes.data() + at, 8);
        if (first == at + 8 * chunks) return at;
    }
    ADD_FAILURE() << "no table of " << chunks << " chunks";
    return 0;
}

std::vector<OiioChannel> oiio_channels(const std::string& path, int part, int level) {
    const auto in = OIIO::ImageInput::open(path);
    if (in == nullptr || !in->seek_subimage(part, level)) {
        ADD_FAILURE() << path << ": " << OIIO::geterror();
        return {};
    }
    const OIIO::ImageSpec spec = in->spec();
    std::vector<char> pixels(spec.image_bytes(true));
    if (!in->read_image(part, level, 0, spec.nchannels, OIIO::TypeDesc::UNKNOWN, pixels.data())) {
        ADD_FAILURE() << path << ": " << in->geterror();
    }
    std::vector<OiioChannel> channels;
    const size_t stride = spec.pixel_bytes(true);
    size_t offset = 0;
    for (int c = 0; c < spec.nchannels; ++c) {
        OiioChannel& channel = channels.emplace_back();
        const OIIO::TypeDesc type = spec.channelformat(c);
        channel.name = spec.channelnames[size_t(c)];
        channel.type = type.c_str();
        for (size_t p = 0; p < spec.image_pixels(); ++p) {
            const char* from = pixels.data() + p * stride + offset;
            channel.bytes.insert(channel.bytes.end(), from, from + type.size());
        }
        offset += type.size();
    }
    return channels;
}

const OiioChannel& named(const std::vector<OiioChannel>& channels, const std::string& name) {
    for (const OiioChannel& c : channels) {
        if (c.name == name) return c;
    }
    static const OiioChannel kNone;
    ADD_FAILURE() << "no channel " << name;
    return kNone;
}

std::vector<std::string> oiio_attributes(const std::string& path, int part) {
    const auto in = OIIO::ImageInput::open(path);
    if (in == nullptr || !in->seek_subimage(part, 0)) {
        ADD_FAILURE() << path << ": " << OIIO::geterror();
        return {};
    }
    const OIIO::ImageSpec& s = in->spec();
    std::vector<std::string> lines;
    for (const auto& a : s.extra_attribs) {
        lines.push_back(a.name().string() + " = " + a.get_string());
    }
    lines.push_back(concat("windows = ", s.x, " ", s.y, " ", s.width, " ", s.height, " of ",
                           s.full_x, " ", s.full_y, " ", s.full_width, " ", s.full_height, " tile ",
                           s.tile_width, " ", s.tile_height));
    std::sort(lines.begin(), lines.end());
    return lines;
}

std::vector<float> oiio_flattened(const std::string& path, const std::string& channel) {
    const OIIO::ImageBuf deep(path);
    const OIIO::ImageBuf flat = OIIO::ImageBufAlgo::flatten(deep);
    const int index = flat.spec().channelindex(channel);
    if (flat.has_error() || index < 0) {
        ADD_FAILURE() << path << ": " << flat.geterror();
        return {};
    }
    std::vector<float> values;
    for (OIIO::ImageBuf::ConstIterator<float> pixel(flat); !pixel.done(); ++pixel)
        values.push_back(pixel[index]);
    OIIO::ImageCache::create()->close_all();
    return values;
}

std::string oiio_deep(const std::string& path, int part) {
    const auto in = OIIO::ImageInput::open(path);
    OIIO::DeepData deep;
    if (in == nullptr || !in->seek_subimage(part, 0) ||
        !in->read_native_deep_image(part, 0, deep)) {
        ADD_FAILURE() << path << ": no deep data";
        return {};
    }
    std::ostringstream text;
    for (int64_t p = 0; p < deep.pixels(); ++p) {
        text << "\n" << deep.samples(p) << ":";
        for (int s = 0; s < deep.samples(p); ++s) {
            for (int c = 0; c < deep.channels(); ++c) text << " " << deep.deep_value(p, c, s);
        }
    }
    return text.str();
}

MemoryFile::MemoryFile() : fd_(::memfd_create("postchain_io", MFD_CLOEXEC)) {
    EXPECT_GE(fd_, 0);
    path_ = "/proc/self/fd/" + std::to_string(fd_);
}

MemoryFile::~MemoryFile() {
    ::close(fd_);
}

void MemoryFile::set(std::string_view bytes) {
    EXPECT_EQ(::ftruncate(fd_, off_t(bytes.size())), 0);
    EXPECT_EQ(::pwrite(fd_, bytes.data(), bytes.size(), 0), ssize_t(bytes.size()));
}

}  // namespace postchain::test
