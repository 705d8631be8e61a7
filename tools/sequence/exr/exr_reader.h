// Reading EXR: headers as plain data, and the channels of a part in their own number types.
//
//   path --scan_header (sizes, before anything is allocated)--> OpenEXR --open--> ExrFile
//   ExrFile --read_part--> PartPixels (native planes, one pass over the part) --> ImageF
//
// The planes stay in the file's number types, so that what is not filtered can be written back bit
// for bit. Parts without compression, ZIP and ZIPS are unpacked here (exr_chunk_reader.h), the
// others by OpenEXR; threads for both: set_exr_threads(). One ExrFile must not be used by two
// threads at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/exr/part_pixels.h"
#include "tools/sequence/image/transfer.h"

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

// Threads that pack and unpack the pixels of every reader and writer of the process: those of
// OpenEXR's pool, and of WorkerPool with the caller's; 0 = the caller's alone.
void set_exr_threads(int count);

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

class PictureFile;

// An EXR; or a picture of another format by its extension (picture_file.h), as an EXR would have
// it: one part of the float channels R, G, B and A, linear.
class ExrFile {
  public:
    // Errors (input), each naming the file: not there, a folder, unreadable, zero bytes, not an
    // EXR, truncated, header that contradicts itself, a side above the limit, too many bytes.
    // `transfer`: what the values of a picture mean, where the file does not say.
    static Result<ExrFile> open(const std::string& path, const ReadLimits& limits = {},
                                std::optional<Transfer> transfer = {});
    ExrFile(ExrFile&&) noexcept;
    ExrFile& operator=(ExrFile&&) noexcept;
    ~ExrFile();

    const std::string& path() const;
    const std::vector<ExrPart>& parts() const;
    uint64_t file_bytes() const;
    const PictureFile* picture() const;  // null of an EXR

    // Why these channels of this part cannot be filtered (deep, luminance-chroma, subsampled,
    // not there), or ok.
    Status check_channels(int part, const std::vector<std::string>& channels) const;
    // What there is instead when no color was found: says so when the file is luminance-chroma
    // or deep; ok when neither explains it.
    Status explain_no_color() const;

    // Reads the named channels of a flat part, or all of them when `channels` is empty, in one
    // pass over the part. Subsampled channels come as they are. Of a mip-mapped part: level 0.
    // With `area` at least those of its rows that the part has, of a tiled part whole tiles.
    // Errors (input): deep part, unknown channel, damaged or truncated data.
    Result<PartPixels> read_part(int part, const std::vector<std::string>& channels = {},
                                 const std::optional<Window>& area = {});
    // Rows that are decoded together: of a block of lines, or of a tile.
    int rows_at_once(int part) const;

    // The same, interleaved and as float, of the whole data window.
    Result<ImageF> read_channels(int part, const std::vector<std::string>& channels);

    struct Impl;  // tools/sequence/exr/exr_internal.h
    Impl& impl() { return *impl_; }

  private:
    explicit ExrFile(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace postchain::io
