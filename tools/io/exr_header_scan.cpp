#include "tools/io/exr_header_scan.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "tools/io/exr_reader.h"

namespace postchain::io {

namespace {

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kFlagTiled = 0x200;
constexpr uint32_t kFlagMultiPart = 0x1000;
constexpr uint64_t kMaxHeaderBytes = uint64_t(256) << 20;  // of all parts, previews included
constexpr size_t kMaxNameBytes = 255;
constexpr size_t kMaxParts = 4096;
constexpr size_t kMaxChannels = 65536;

Status input_error(std::string message) {
    return Status(StatusCode::input, std::move(message));
}

Status truncated() {
    return input_error("truncated: the file ends inside its header; copy or render it again");
}

// Reads forward through the file; `good` turns false at its end.
class Cursor {
  public:
    Cursor(int fd, uint64_t file_bytes) : fd_(fd), size_(file_bytes) {}

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
    // Up to the zero byte; not good when longer than a name may be.
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
        buffer_.resize(size_t(1) << 16);
        ssize_t n;
        do n = ::pread(fd_, buffer_.data(), buffer_.size(), off_t(at_));
        while (n < 0 && errno == EINTR);
        buffer_.resize(n > 0 ? size_t(n) : 0);
        start_ = at_;
        return n > 0;
    }
    int fd_;
    uint64_t size_;
    uint64_t at_ = 0;
    uint64_t start_ = 0;
    std::vector<char> buffer_;
    bool good_ = true;
};

struct PartSizes {
    std::optional<Window> data_window;
    uint64_t pixel_bytes = 0;  // of all channels
    bool channels = false;
    bool tiled = false;
    uint32_t tile_width = 0;
    uint32_t tile_height = 0;
    bool one_level = true;
    int compression = 0;
    std::optional<int32_t> chunk_count;
    bool type_attribute = false;
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
Status read_channels(Cursor& in, PartSizes& part) {
    part.channels = true;
    for (size_t n = 0;; ++n) {
        if (in.name().empty()) break;
        if (n >= kMaxChannels) return input_error("damaged header: too many channels");
        const int32_t type = in.int32();
        in.skip(4);
        const int32_t x_sampling = in.int32();
        const int32_t y_sampling = in.int32();
        if (!in.good()) break;
        if (type < 0 || type > 2 || x_sampling < 1 || y_sampling < 1) {
            return input_error("damaged header: a channel of unknown type or sampling");
        }
        part.pixel_bytes += type == 1 ? 2 : 4;
    }
    return {};
}

// Bytes of a value whose type fixes them, nothing for the others. OpenEXR reads such values, and
// channel lists, by their type and not by the stated size: where the two differ it goes on at
// another place of the header than this scan, and finds sizes there that were never checked.
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

// One header; `empty` when its first attribute name is empty (the end of the list of parts).
Status read_header(Cursor& in, PartSizes& part, bool& empty) {
    empty = true;
    while (true) {
        const std::string name = in.name();
        if (!in.good()) return truncated();
        if (name.empty()) return {};
        empty = false;
        const std::string type = in.name();
        const int32_t size = in.int32();
        if (!in.good()) return truncated();
        if (size < 0) {
            return input_error(concat("damaged header: attribute ", name, " of negative size"));
        }
        if (fixed_size(type).value_or(size) != size) {
            return input_error(concat("damaged header: attribute ", name, " of wrong size"));
        }
        const uint64_t end = in.at() + uint64_t(size);
        if (end > kMaxHeaderBytes) return input_error("damaged header: larger than 256 MiB");
        Status status;
        if (name == "dataWindow" && type == "box2i" && size == 16) {
            part.data_window = read_window(in);
        } else if (type == "chlist") {  // under another name too: see fixed_size()
            PartSizes other;
            status = read_channels(in, name == "channels" ? part : other);
            if (status.ok() && in.good() && in.at() != end) {
                status = input_error("damaged header: a list of channels has a wrong size");
            }
        } else if (type == "preview") {  // width, height, 4 bytes a pixel
            const uint64_t width = in.number(4);
            const uint64_t height = in.number(4);
            if (in.good() &&
                (width > 65535 || height > 65535 || 8 + 4 * width * height != uint64_t(size))) {
                status = input_error("damaged header: a preview of wrong size");
            }
        } else if (name == "compression" && size == 1) {
            part.compression = int(in.number(1));
        } else if (name == "tiles" && size == 9) {
            part.tile_width = uint32_t(in.number(4));
            part.tile_height = uint32_t(in.number(4));
            part.one_level = (in.number(1) & 0xf) == 0;
        } else if (name == "chunkCount" && size == 4) {
            part.chunk_count = in.int32();
        } else if (name == "type" && type == "string" && size < 64) {
            part.type_attribute = true;
            std::string value(size_t(size), ' ');
            in.bytes(value.data(), value.size());
            part.tiled = value == "tiledimage" || value == "deeptile";
        }
        if (!status.ok()) return status;
        if (!in.good()) return truncated();
        if (in.at() > end) return input_error(concat("damaged header: attribute ", name));
        in.skip(end - in.at());
        if (!in.good()) return truncated();
    }
}

int lines_per_chunk(int compression) {
    // none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab
    constexpr int kLines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    return compression >= 0 && compression < 10 ? kLines[compression] : 0;
}

// Checks one part's sizes; `chunks` are those of the full-size level.
Status check_part(const PartSizes& part, const ReadLimits& limits, uint64_t& chunks) {
    if (!part.data_window || !part.channels) {
        return input_error("damaged header: no data window or no channels");
    }
    const Window& w = *part.data_window;
    const int64_t width = int64_t(w.max_x) - w.min_x + 1;
    const int64_t height = int64_t(w.max_y) - w.min_y + 1;
    if (width < 1 || height < 1) return input_error("damaged header: empty data window");
    if (width > limits.max_side || height > limits.max_side) {
        return input_error(concat("the data window is ", std::to_string(width), "x",
                                  std::to_string(height), " pixels; the limit is ",
                                  std::to_string(limits.max_side),
                                  " a side; render or crop it smaller"));
    }
    const uint64_t bytes = uint64_t(width) * uint64_t(height) * part.pixel_bytes;
    if (bytes > limits.max_bytes) {
        return input_error(concat("the pixels of one part take ", std::to_string(bytes >> 20),
                                  " MiB; the limit is ", std::to_string(limits.max_bytes >> 20),
                                  " MiB; render it smaller or with fewer channels"));
    }
    const int lines = lines_per_chunk(part.compression);
    if (lines == 0) return input_error("damaged header: unknown compression");
    if (part.tiled) {
        if (part.tile_width < 1 || part.tile_height < 1) {
            return input_error("damaged header: tiles of no size");
        }
        chunks = ((uint64_t(width) + part.tile_width - 1) / part.tile_width) *
                 ((uint64_t(height) + part.tile_height - 1) / part.tile_height);
    } else {
        chunks = (uint64_t(height) + uint64_t(lines) - 1) / uint64_t(lines);
    }
    return {};
}

}  // namespace

Result<HeaderFacts> scan_header(int fd, uint64_t file_bytes, const ReadLimits& limits) {
    if (file_bytes == 0) return input_error("the file is empty (zero bytes); render it again");
    Cursor in(fd, file_bytes);
    const uint32_t magic = uint32_t(in.number(4));
    if (!in.good() || magic != kMagic) return input_error("not an EXR file");
    const uint32_t version = uint32_t(in.number(4));
    if (!in.good()) return truncated();
    if ((version & 0xff) != 2) {
        return input_error(concat("EXR version ", std::to_string(version & 0xff),
                                  " is unknown; only version 2 can be read"));
    }
    std::vector<PartSizes> parts;
    while (true) {
        PartSizes part;
        part.tiled = (version & kFlagTiled) != 0;
        bool empty = false;
        if (Status s = read_header(in, part, empty); !s.ok()) return s;
        if (empty) break;
        if (parts.size() >= kMaxParts) return input_error("damaged header: too many parts");
        parts.push_back(part);
        if ((version & kFlagMultiPart) == 0) break;
    }
    if (parts.empty()) return input_error("damaged header: no image in the file");
    for (size_t i = 0; i < parts.size(); ++i) {
        const std::string place =
            parts.size() > 1 ? concat("part ", std::to_string(i)) : std::string();
        uint64_t chunks = 0;
        Status status = check_part(parts[i], limits, chunks);
        if (!status.ok()) return place.empty() ? status : status.at(place);
        const bool counted = (version & kFlagMultiPart) != 0 && parts[i].chunk_count.has_value();
        const uint64_t table = counted ? uint64_t(uint32_t(*parts[i].chunk_count)) : chunks;
        if (table < chunks) return input_error("damaged header: too few chunks");
        if (table * 8 > file_bytes) return truncated();
        for (uint64_t c = 0; c < table; ++c) {
            const uint64_t offset = in.number(8);
            if (!in.good()) return truncated();
            if (offset >= file_bytes) {
                return input_error(
                    "truncated: pixels are missing at its end; copy or render it again");
            }
        }
        // Without a count the smaller levels' entries are unknown, and so is the next table.
        if (!counted && !parts[i].one_level) break;
    }
    return HeaderFacts{(version & kFlagMultiPart) != 0, parts[0].type_attribute};
}

}  // namespace postchain::io
