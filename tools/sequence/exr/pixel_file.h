// A file of pixels: its parts as plain data, and their channels read into planes of the file's own
// number types, so that unfiltered channels can be written back bit for bit. ExrFile is one;
// ImageFile (tools/sequence/image) presents another format as an EXR of one part.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

// How the samples of a deep pixel become one value for each channel.

struct Flattening {
    bool behind = false;      // only the samples behind the pixel's surface (deep_pixel.h)
    std::string depth = "Z";  // the channel that orders samples; "ZBack" is a volume's far end
    std::string alpha = "A";  // without it every sample is opaque
    // Composited channels. In all others a pixel has the value of its surface. Empty: those named
    // R, G, B or A in their layer.
    std::optional<std::set<std::string>> color = {};

    bool is_color(const std::string& channel) const {
        if (color || channel == alpha) return channel == alpha || color->contains(channel);
        const std::string last = channel.substr(channel.rfind('.') + 1);
        return last == "R" || last == "G" || last == "B" || last == "A";
    }
};

inline constexpr int kMaxSide = 16384;  // pixels; llvmpipe's and most GPUs' limit of a texture

// Limits on a header, checked before OpenEXR reads it. In addition, a part must not have more
// pixels than its file can hold (most_packed() in exr_header_scan.h).
struct ReadLimits {
    int max_side = kMaxSide;                        // data windows and tiles, pixels
    uint64_t max_bytes = uint64_t(8) << 30;         // one part, decoded
    uint64_t max_chunk_bytes = uint64_t(1) << 29;   // one tile or block of lines, decoded;
                                                    // OpenEXR keeps two for each of its threads
    uint64_t max_header_bytes = uint64_t(1) << 26;  // all parts, with strings and previews
    int max_channels = 4096;                        // one part
};

struct ExrPart {
    std::string name;         // empty in a single-part file
    std::string view;         // may be empty
    std::string type;         // "scanlineimage", "tiledimage", "deepscanline", "deeptile"
    std::string compression;  // "zip", "dwaa", ...
    std::vector<ExrChannel> channels;
    std::vector<std::string> views;  // views of a single-part multi-view file, the default first
    Window data_window;
    Window display_window;
    float pixel_aspect = 1;
    std::optional<std::array<float, 8>> chromaticities;  // red, green, blue, white x and y
    std::map<std::string, std::string> attributes;       // every attribute as text
    bool deep = false;
    uint64_t flattening_bytes = 0;  // deep part: memory of each thread that reads it
    bool tiled = false;
    bool mip_mapped = false;  // more than one level

    const ExrChannel* find(std::string_view channel) const;
    // Has RY or BY: color stored as luminance and subsampled chroma.
    bool luminance_chroma() const;
};

// Must not be used by two threads at once.
class PixelFile {
  public:
    virtual ~PixelFile() = default;

    const std::string& path() const { return path_; }
    const std::vector<ExrPart>& parts() const { return parts_; }
    uint64_t file_bytes() const { return bytes_; }

    // Why these channels of this part cannot be filtered (luminance-chroma, subsampled, unknown;
    // deep samples without depth, or of a compression or alpha that cannot be read), or ok.
    Status check_channels(int part, const std::vector<std::string>& channels) const;
    // Why the file has no color that can be filtered (luminance-chroma); ok if that is not it.
    Status explain_no_color() const;

    // How deep parts are read as flat ones; changed before the first read.
    Flattening flattening;

    // Reads the named channels of a part, or all if `channels` is empty, in one pass over the part.
    // Subsampled channels stay subsampled, deep parts are flattened. Mip-mapped parts: level 0.
    // With `area`: at least its rows that are in the part, in whole tiles. Errors (input): unknown
    // channel, deep samples as in check_channels(), damaged or truncated data.
    Result<PartPixels> read_part(int part, const std::vector<std::string>& channels = {},
                                 const std::optional<Window>& area = {});
    // Height of a block of lines or a tile, which are decoded as a whole.
    virtual int rows_at_once(int part) const = 0;

    // read_part() of the whole data window, interleaved and as float.
    Result<ImageF> read_channels(int part, const std::vector<std::string>& channels);

  protected:
    PixelFile() = default;
    PixelFile(PixelFile&&) = default;
    PixelFile& operator=(PixelFile&&) = default;

    // Fills the planes: channels of the part, and whole rows of its data window.
    virtual Status read_planes(PartPixels& pixels) = 0;

    std::string path_;
    uint64_t bytes_ = 0;
    std::vector<ExrPart> parts_;
};

}  // namespace postchain::io
