// A file of pixels: its parts as plain data, and their channels read into planes of the file's own
// number types, so that unfiltered channels can be written back bit for bit. ExrFile is one;
// PictureFile (tools/sequence/image) presents another format as an EXR of one part.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

inline constexpr int kMaxSide = 16384;  // pixels; llvmpipe's and most GPUs' limit of a texture

// What a header may ask for; whatever asks for more is refused before OpenEXR sees it. Besides,
// a part's pixels must be such as its file can hold (most_packed() in exr_part_check.h).
struct ReadLimits {
    int max_side = kMaxSide;                        // of data windows and tiles, pixels
    uint64_t max_bytes = uint64_t(8) << 30;         // of one part, decoded
    uint64_t max_chunk_bytes = uint64_t(1) << 29;   // of one tile or block of lines, decoded;
                                                    // OpenEXR keeps two for each of its threads
    uint64_t max_header_bytes = uint64_t(1) << 26;  // of all parts, with texts and previews
    int max_channels = 4096;                        // of one part
};

struct ExrPart {
    std::string name;         // empty in a single-part file
    std::string view;         // empty when there is none
    std::string type;         // "scanlineimage", "tiledimage", "deepscanline", "deeptile"
    std::string compression;  // "zip", "dwaa", ...
    std::vector<ExrChannel> channels;
    std::vector<std::string> views;  // of a single-part multi-view file; the first is the default
    Window data_window;
    Window display_window;
    float pixel_aspect = 1;
    std::optional<std::array<float, 8>> chromaticities;  // red, green, blue, white x and y
    std::map<std::string, std::string> attributes;       // every attribute as text
    bool deep = false;
    bool tiled = false;
    bool mip_mapped = false;  // more than one level

    const ExrChannel* find(std::string_view channel) const;
    // Y with RY or BY: color that is stored as luminance and subsampled chroma.
    bool luminance_chroma() const;
};

// Must not be used by two threads at once.
class PixelFile {
  public:
    virtual ~PixelFile() = default;

    const std::string& path() const { return path_; }
    const std::vector<ExrPart>& parts() const { return parts_; }
    uint64_t file_bytes() const { return bytes_; }

    // Why these channels of this part cannot be filtered (deep, luminance-chroma, subsampled,
    // unknown), or ok.
    Status check_channels(int part, const std::vector<std::string>& channels) const;
    // Why the file has no color that can be filtered (luminance-chroma, deep); ok when neither
    // explains it.
    Status explain_no_color() const;

    // Reads the named channels of a flat part, or all of them when `channels` is empty, in one
    // pass over the part. Subsampled channels come as they are. Of a mip-mapped part: level 0.
    // With `area` at least those of its rows that the part has, of a tiled part whole tiles.
    // Errors (input): deep part, unknown channel, damaged or truncated data.
    Result<PartPixels> read_part(int part, const std::vector<std::string>& channels = {},
                                 const std::optional<Window>& area = {});
    // Rows that are decoded together: those of a block of lines, or of a tile.
    virtual int rows_at_once(int part) const = 0;

    // The same, interleaved and as float, of the whole data window.
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
