#include "tools/sequence/exr/exr_header_scan.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sequence/exr/deep_reader.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {
namespace {

// The fields of one header that memory depends on, unchecked.
struct PartSizes {
    struct Channel {
        int bytes;  // bytes of a sample
        int32_t x_sampling, y_sampling;
    };
    struct Tile {
        uint32_t width, height;
        uint32_t levels;  // low four bits: 0 one, 1 mip, 2 rip; high: 1 rounds their sizes up
    };
    std::optional<Window> data_window;
    std::vector<Channel> channels;
    bool known = true;  // OpenEXR reads this type; for others only chunk_count is known
    bool tiled = false;
    bool deep = false;
    std::optional<Tile> tile;
    int compression = 0;
    std::optional<int32_t> chunk_count;
    std::optional<std::string> type;  // optional in a single flat part
};

struct PartNeeds {
    uint64_t chunks = 0;            // chunks of all levels
    uint64_t pixel_bytes = 0;       // decoded, without smaller levels and deep samples
    uint64_t least_file_bytes = 0;  // pixel_bytes at the compression's highest ratio
};

struct Compression {
    uint64_t lines;        // lines of a chunk
    uint64_t most_packed;  // derived in exr_header_scan.h
};

// Indexed by ExrMethod, which has the file's numbers.
constexpr Compression kCompressions[] = {{1, 1},      {1, 64},     {1, 1032}, {16, 1032},
                                         {32, 454},   {16, 1376},  {32, 11},  {32, 11},
                                         {32, 66048}, {256, 66048}};

const Compression* compression_of(int number) {
    const bool known = number >= 0 && size_t(number) < std::size(kCompressions);
    return known ? &kCompressions[number] : nullptr;
}

std::string mebibytes(uint64_t bytes) {
    return std::to_string(bytes >> 20) + " MiB";
}

Status check_chunk(const std::string& what, uint64_t bytes, const ReadLimits& limits,
                   const char* remedy) {
    if (bytes <= limits.max_chunk_bytes) return {};
    return input_error(concat(what, " takes ", mebibytes(bytes), "; the limit is ",
                              mebibytes(limits.max_chunk_bytes), "; ", remedy));
}

uint64_t up(uint64_t a, uint64_t b) {
    return (a + b - 1) / b;
}

// Tiles along one side of a level.
uint64_t tiles_of_level(uint64_t side, uint64_t tile, int level, bool up_sizes) {
    const uint64_t divisor = uint64_t(1) << level;
    const uint64_t size = up_sizes ? up(side, divisor) : side / divisor;
    return up(std::max<uint64_t>(size, 1), tile);
}

int levels_of(uint64_t side, bool up_sizes) {
    return (up_sizes ? std::bit_width(side - 1) : std::bit_width(side) - 1) + 1;
}

// The number of levels, as in ImfTiledMisc.cpp.
uint64_t count_tiles(uint64_t width, uint64_t height, const PartSizes::Tile& tile) {
    const bool up_sizes = (tile.levels >> 4) == 1;
    const uint32_t mode = tile.levels & 0xf;
    const auto across = [&](int level) {
        return tiles_of_level(width, tile.width, level, up_sizes);
    };
    const auto down = [&](int level) {
        return tiles_of_level(height, tile.height, level, up_sizes);
    };
    if (mode == 0) return across(0) * down(0);
    uint64_t sum = 0;
    if (mode == 1) {
        const int levels = levels_of(std::max(width, height), up_sizes);
        for (int level = 0; level < levels; ++level) sum += across(level) * down(level);
        return sum;
    }
    uint64_t columns = 0;
    for (int level = 0; level < levels_of(width, up_sizes); ++level) columns += across(level);
    for (int level = 0; level < levels_of(height, up_sizes); ++level) sum += columns * down(level);
    return sum;
}

Status check_chunk_count(const PartSizes& part, PartNeeds& needs) {
    if (part.known && part.chunk_count.value_or(int32_t(needs.chunks)) == int32_t(needs.chunks))
        return {};
    if (!part.known && part.chunk_count.value_or(-1) >= 0) {
        needs.chunks = uint64_t(*part.chunk_count);
        return {};
    }
    return damaged_header("a wrong number of chunks");
}

// Errors (input): no data window, no channels, sizes above the limits, levels of unknown kind, a
// number of chunks that contradicts the sizes.
Result<PartNeeds> check_part(const PartSizes& part, const ReadLimits& limits) {
    if (!part.data_window || part.channels.empty())
        return damaged_header("no data window or no channels");
    const Window& w = *part.data_window;
    const int64_t signed_width = int64_t(w.max_x) - w.min_x + 1;
    const int64_t signed_height = int64_t(w.max_y) - w.min_y + 1;
    if (signed_width < 1 || signed_height < 1) return damaged_header("empty data window");
    if (signed_width > limits.max_side || signed_height > limits.max_side) {
        return input_error(concat("the data window is ", std::to_string(signed_width), "x",
                                  std::to_string(signed_height), " pixels; the limit is ",
                                  std::to_string(limits.max_side),
                                  " a side; render or crop it smaller"));
    }
    const uint64_t width = uint64_t(signed_width), height = uint64_t(signed_height);
    PartNeeds needs;
    uint64_t bytes = 0;  // bytes of one pixel
    for (const PartSizes::Channel& c : part.channels) {
        bytes += uint64_t(c.bytes);
        // Rounded down: a subsampled channel may miss its first and last sample.
        needs.pixel_bytes += uint64_t(c.bytes) * (width / uint64_t(c.x_sampling)) *
                             (height / uint64_t(c.y_sampling));
    }
    // A deep pixel may have 0 samples; its sample count takes 4 bytes.
    if (part.deep) needs.pixel_bytes = 4 * width * height;
    if (width * height * bytes > limits.max_bytes) {
        return input_error(concat("the pixels of one part take ", mebibytes(width * height * bytes),
                                  "; the limit is ", mebibytes(limits.max_bytes),
                                  "; render it smaller or with fewer channels"));
    }
    const Compression* compression = compression_of(part.compression);
    if (compression == nullptr) return damaged_header("unknown compression");
    needs.least_file_bytes = up(needs.pixel_bytes, compression->most_packed);
    if (!part.tiled) {
        needs.chunks = up(height, compression->lines);
        // OpenEXR's buffers hold a whole block even if the part has fewer lines.
        RETURN_IF_ERROR(check_chunk(concat("a block of ", std::to_string(compression->lines),
                                           " lines of ", name_of(ExrMethod(part.compression))),
                                    compression->lines * width * bytes, limits,
                                    "write it with fewer channels or as zip"));
        RETURN_IF_ERROR(check_chunk_count(part, needs));
        return needs;
    }
    if (!part.tile || part.tile->width < 1 || part.tile->height < 1)
        return damaged_header("tiles of size 0");
    const auto [tile_width, tile_height, levels] = *part.tile;
    if ((levels & 0xf) > 2 || (levels >> 4) > 1) return damaged_header("unknown kind of levels");
    const std::string tile = concat("a tile of ", std::to_string(tile_width), "x",
                                    std::to_string(tile_height), " pixels");
    if (tile_width > uint32_t(limits.max_side) || tile_height > uint32_t(limits.max_side)) {
        return input_error(concat(tile, " is too large; the limit is ",
                                  std::to_string(limits.max_side),
                                  " a side; write it with smaller tiles"));
    }
    needs.chunks = count_tiles(width, height, *part.tile);
    RETURN_IF_ERROR(check_chunk(tile, uint64_t(tile_width) * tile_height * bytes, limits,
                                "write it with smaller tiles"));
    RETURN_IF_ERROR(check_chunk_count(part, needs));
    return needs;
}

// The error for a part that is too large for a file of `file_bytes`.
Status too_much_packed(const PartSizes& part, const PartNeeds& needs, uint64_t file_bytes) {
    const Compression& compression = *compression_of(part.compression);
    return input_error(concat(
        "truncated or damaged: its header states ", std::to_string(needs.pixel_bytes),
        " bytes of pixels in a file of ", std::to_string(file_bytes), "; ",
        name_of(ExrMethod(part.compression)), " packs at most ",
        std::to_string(compression.most_packed), " bytes into one; copy or render it again"));
}

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kFlagTiled = 0x200;
constexpr uint32_t kFlagNonImage = 0x800;
constexpr uint32_t kFlagMultiPart = 0x1000;
constexpr size_t kMaxNameBytes = 255;
constexpr size_t kMaxParts = 4096;

Status truncated() {
    return input_error("truncated: the file ends inside its header; copy or render it again");
}

// Reads forward through the file; `good` becomes false at its end.
class Cursor {
  public:
    // Reads from `at` on, `ahead` bytes at a time.
    Cursor(int fd, uint64_t file_bytes, uint64_t at = 0, size_t ahead = size_t(1) << 16)
        : fd_(fd), size_(file_bytes), at_(at), ahead_(ahead) {}

    bool bytes(void* to, size_t count) {
        if (!good_ || at_ + count > size_) return good_ = false;
        char* out = static_cast<char*>(to);
        while (count > 0) {
            if (at_ < start_ || at_ >= start_ + buffer_.size()) {
                if (!fill()) return good_ = false;
            }
            const size_t offset = size_t(at_ - start_);
            const size_t n = std::min(count, buffer_.size() - offset);
            std::memcpy(out, buffer_.data() + offset, n);
            out += n;
            at_ += n;
            count -= n;
        }
        return true;
    }
    // Little-endian, as every number in the file.
    uint64_t number(int count) {
        uint8_t b[8] = {};
        uint64_t value = 0;
        if (!bytes(b, size_t(count))) return 0;
        for (int i = count - 1; i >= 0; --i) value = value << 8 | b[i];
        return value;
    }
    int32_t int32() { return int32_t(uint32_t(number(4))); }
    // Reads up to the zero byte; fails if the name is too long.
    std::string name() {
        std::string text;
        for (char c = 0; bytes(&c, 1) && c != 0;) {
            text += c;
            if (text.size() > kMaxNameBytes) good_ = false;
        }
        return text;
    }
    void skip(uint64_t count) {
        if (at_ + count > size_) good_ = false;
        at_ += count;
    }
    bool good() const { return good_; }
    uint64_t at() const { return at_; }

  private:
    bool fill() {
        buffer_.resize(ahead_);
        ssize_t n;
        do n = ::pread(fd_, buffer_.data(), buffer_.size(), off_t(at_));
        while (n < 0 && errno == EINTR);
        buffer_.resize(n > 0 ? size_t(n) : 0);
        start_ = at_;
        return n > 0;
    }
    int fd_;
    uint64_t size_;
    uint64_t at_;
    size_t ahead_;
    uint64_t start_ = 0;
    std::vector<char> buffer_;
    bool good_ = true;
};

Window read_window(Cursor& in) {
    Window w;
    w.min_x = in.int32();
    w.min_y = in.int32();
    w.max_x = in.int32();
    w.max_y = in.int32();
    return w;
}

// A channel list: name, type, 4 bytes, x and y sampling; ends with an empty name.
Status read_channels(Cursor& in, const ReadLimits& limits, PartSizes& part) {
    while (true) {
        if (in.name().empty()) break;
        if (part.channels.size() >= size_t(limits.max_channels)) {
            return input_error(concat("has more than ", std::to_string(limits.max_channels),
                                      " channels in one part; write fewer, or several files"));
        }
        const int32_t type = in.int32();
        in.skip(4);
        const int32_t x_sampling = in.int32();
        const int32_t y_sampling = in.int32();
        if (!in.good()) break;
        if (type < 0 || type > 2 || x_sampling < 1 || y_sampling < 1)
            return damaged_header("a channel of unknown type or sampling");
        part.channels.push_back({type == 1 ? 2 : 4, x_sampling, y_sampling});
    }
    return {};
}

// Size of a value, if its type has a fixed size. OpenEXR reads such values, and channel lists, by
// their type and ignores the stated size. If the two differ, OpenEXR continues at another place of
// the header than this scan, and reads sizes that were never checked.
std::optional<int32_t> fixed_size(const std::string& type) {
    static const std::map<std::string_view, int32_t> kSizes = {{"box2i", 16},
                                                               {"box2f", 16},
                                                               {"chromaticities", 32},
                                                               {"compression", 1},
                                                               {"double", 8},
                                                               {"envmap", 1},
                                                               {"deepImageState", 1},
                                                               {"float", 4},
                                                               {"int", 4},
                                                               {"keycode", 28},
                                                               {"lineOrder", 1},
                                                               {"m33f", 36},
                                                               {"m33d", 72},
                                                               {"m44f", 64},
                                                               {"m44d", 128},
                                                               {"rational", 8},
                                                               {"tiledesc", 9},
                                                               {"timecode", 8},
                                                               {"v2i", 8},
                                                               {"v2f", 8},
                                                               {"v2d", 16},
                                                               {"v3i", 12},
                                                               {"v3f", 12},
                                                               {"v3d", 24}};
    const auto found = kSizes.find(type);
    if (found == kSizes.end()) return {};
    return found->second;
}

// Reads one header; `empty` if its first attribute name is empty (end of the list of parts).
Status read_header(Cursor& in, const ReadLimits& limits, PartSizes& part, bool& empty) {
    empty = true;
    while (true) {
        const std::string name = in.name();
        if (!in.good()) return truncated();
        if (name.empty()) return {};
        empty = false;
        const std::string type = in.name();
        const int32_t size = in.int32();
        if (!in.good()) return truncated();
        if (size < 0) return damaged_header(concat("attribute ", name, " of negative size"));
        if (fixed_size(type).value_or(size) != size)
            return damaged_header(concat("attribute ", name, " of wrong size"));
        const uint64_t end = in.at() + uint64_t(size);
        if (end > limits.max_header_bytes) {
            return input_error(
                concat("its header is larger than ", std::to_string(limits.max_header_bytes >> 10),
                       " KiB, by attribute ", name, "; write it without that, or with less in it"));
        }
        Status status;
        if (name == "dataWindow" && type == "box2i" && size == 16) {
            part.data_window = read_window(in);
        } else if (type == "chlist") {  // under another name too: see fixed_size()
            PartSizes other;
            status = read_channels(in, limits, name == "channels" ? part : other);
            if (status.ok() && in.good() && in.at() != end)
                status = damaged_header("a list of channels has a wrong size");
        } else if (type == "preview") {  // width, height, 4 bytes a pixel
            const uint64_t width = in.number(4);
            const uint64_t height = in.number(4);
            if (in.good() &&
                (width > 65535 || height > 65535 || 8 + 4 * width * height != uint64_t(size)))
                status = damaged_header("a preview of wrong size");
        } else if (name == "compression" && size == 1) {
            part.compression = int(in.number(1));
        } else if (name == "tiles" && size == 9) {
            const uint32_t width = uint32_t(in.number(4));
            const uint32_t height = uint32_t(in.number(4));
            part.tile = {width, height, uint32_t(in.number(1))};
        } else if (name == "chunkCount" && size == 4) {
            part.chunk_count = in.int32();
        } else if (name == "type" && type == "string" && size < 64) {
            part.type = std::string(size_t(size), ' ');
            in.bytes(part.type->data(), part.type->size());
        }
        if (!status.ok()) return status;
        if (!in.good()) return truncated();
        if (in.at() > end) return damaged_header(concat("attribute ", name));
        in.skip(end - in.at());
        if (!in.good()) return truncated();
    }
}

// Checks the stated size of a deep chunk's samples, and adds its memory.
Status check_deep_chunk(const PartSizes& part, uint64_t packed, uint64_t unpacked,
                        const ReadLimits& limits, uint64_t& flattening) {
    if (unpacked / most_packed(part.compression) > packed)
        return input_error(concat("damaged: a deep chunk states ", std::to_string(unpacked),
                                  " bytes of samples, but has ", std::to_string(packed),
                                  " in the file; copy or render it again"));
    if (unpacked > limits.max_chunk_bytes)
        return input_error(concat("a deep ", part.tiled ? "tile" : "line", " takes ",
                                  std::to_string(unpacked >> 20), " MiB; the limit is ",
                                  std::to_string(limits.max_chunk_bytes >> 20),
                                  " MiB; write it with fewer samples or smaller tiles"));
    uint64_t bytes = 0;
    for (const PartSizes::Channel& channel : part.channels) bytes += uint64_t(channel.bytes);
    flattening = std::max(flattening, flattening_bytes(packed, unpacked, bytes));
    return {};
}

}  // namespace

uint64_t most_packed(int compression) {
    const Compression* found = compression_of(compression);
    return found == nullptr ? 0 : found->most_packed;
}

int lines_of_chunk(int compression) {
    const Compression* found = compression_of(compression);
    return found == nullptr ? 1 : int(found->lines);
}

Result<HeaderFacts> scan_header(int fd, uint64_t file_bytes, const ReadLimits& limits) {
    if (file_bytes == 0) return input_error("the file is empty (zero bytes); render it again");
    Cursor in(fd, file_bytes);
    const uint32_t magic = uint32_t(in.number(4));
    if (!in.good() || magic != kMagic)
        return input_error(
            "not an EXR file; name it with the extension of its format, or render it again");
    const uint32_t version = uint32_t(in.number(4));
    if (!in.good()) return truncated();
    if ((version & 0xff) != 2) {
        return input_error(concat("EXR version ", std::to_string(version & 0xff),
                                  " is unknown; only version 2 can be read"));
    }
    const bool multi_part = (version & kFlagMultiPart) != 0;
    std::vector<PartSizes> parts;
    while (true) {
        PartSizes part;
        bool empty = false;
        RETURN_IF_ERROR(read_header(in, limits, part, empty));
        if (empty) break;
        if (parts.size() >= kMaxParts) return damaged_header("too many parts");
        // As in OpenEXR: in a single flat part the flag overrides the type.
        if (!multi_part && (version & kFlagNonImage) == 0) {
            part.tiled = (version & kFlagTiled) != 0;
        } else {
            part.tiled = part.type == "tiledimage" || part.type == "deeptile";
            part.deep = part.type == "deepscanline" || part.type == "deeptile";
            part.known = part.tiled || part.deep || part.type == "scanlineimage";
        }
        parts.push_back(part);
        if (!multi_part) break;
    }
    if (parts.empty()) return damaged_header("no image in the file");
    HeaderFacts facts{multi_part, parts[0].type.has_value(), {}, {}, {}};
    uint64_t least_bytes = 0;
    for (size_t i = 0; i < parts.size(); ++i) {
        const std::string place =
            parts.size() > 1 ? concat("part ", std::to_string(i)) : std::string();
        const auto at_place = [&](const Status& s) { return place.empty() ? s : s.at(place); };
        const Result<PartNeeds> needs = check_part(parts[i], limits);
        if (!needs.ok()) return at_place(needs.status());
        least_bytes += needs->least_file_bytes;
        if (least_bytes > file_bytes)
            return at_place(too_much_packed(parts[i], *needs, file_bytes));
        if (needs->chunks * 8 > file_bytes) return truncated();
        facts.forms.push_back({parts[i].known, parts[i].tiled, parts[i].deep});
        std::vector<uint64_t>& chunks = facts.chunks.emplace_back();
        uint64_t& flattening = facts.flattening.emplace_back(0);
        for (uint64_t c = 0; c < needs->chunks; ++c) {
            const uint64_t offset = in.number(8);
            if (!in.good()) return truncated();
            if (offset >= file_bytes) {
                return input_error(
                    "truncated: pixels are missing at its end; copy or render it again");
            }
            chunks.push_back(offset);
            if (!parts[i].deep || offset == 0) continue;  // 0: never written, refused later
            Cursor chunk(fd, file_bytes, offset, 3 * sizeof(uint64_t));
            // Part, line or tile, then the sizes of sample counts and samples.
            chunk.skip((multi_part ? 4 : 0) + (parts[i].tiled ? 16 : 4));
            const uint64_t counts = chunk.number(8);
            const uint64_t samples = chunk.number(8);
            const uint64_t unpacked = chunk.number(8);
            if (!chunk.good() || counts > file_bytes - chunk.at() ||
                samples > file_bytes - chunk.at() - counts) {
                return at_place(
                    input_error("truncated: a deep chunk is larger than the file; copy or render "
                                "it again"));
            }
            if (Status s = check_deep_chunk(parts[i], samples, unpacked, limits, flattening);
                !s.ok())
                return at_place(s);
        }
    }
    return facts;
}

}  // namespace postchain::io
