// Cryptomattes of an EXR: their names, manifests of ids, and the coverage of ids in each pixel.
// Source: Friedman and Jones, Cryptomatte Specification 1.2, Psyop.
//
//   attributes cryptomatte/KEY/name, /hash, /conversion, /manifest or /manif_file
//     --find_cryptomattes--> Cryptomatte (channels of its ranks, manifest)
//   channels NAME00 r g b a, NAME01 ... (id, coverage, id, coverage of two ranks each)
//     --ranks_of--> RankedCoverage --coverage_of--> the matte of some ids
//
// An id is the MurmurHash3 of a name, its bits stored as a float. Docs: docs/layers.md.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {

using CryptoId = uint32_t;  // bits of its float; 0 = nothing

// MurmurHash3_x86_32 with seed 0. Source: Appleby, MurmurHash3, public domain.
uint32_t murmur_hash(std::string_view text);
// A hash made safe as a float: if its exponent is all zeros or all ones (denormals, Inf, NaN), the
// exponent's lowest bit is flipped.
CryptoId id_of_hash(uint32_t hash);
CryptoId id_of_name(std::string_view name);

// Two ranks: id and coverage, twice. Channels of one part.
struct CryptoLevel {
    int part = 0;
    std::array<std::string, 4> channels;
};

struct Cryptomatte {
    std::string key;   // KEY of its attributes
    std::string name;  // prefix of its channels: "ViewLayer.CryptoObject"
    std::vector<CryptoLevel> levels;
    std::map<std::string, CryptoId> manifest;  // by name; may be empty
    std::string no_manifest;                   // why the manifest is missing
    std::string manifest_file;                 // named by its attributes; empty: none
    Status fault;                              // why it cannot be used

    int ranks() const { return 2 * int(levels.size()); }
    // The name after its last dot: "CryptoObject".
    std::string short_name() const;
    bool holds(int part, std::string_view channel) const;
};

// Manifests are needed for mattes that are given by name. With not_read, Cryptomatte::manifest and
// no_manifest stay empty.
enum class Manifests { read, not_read };

// Returns the path to read, without links, for a file that a frame names, or why it must not be
// read. Without a PathCheck every file is read, and links are followed.
using PathCheck = std::function<Result<std::string>(const std::string& path)>;

// The view of a file whose cryptomattes are meant. Empty: every channel, as in a file without
// views.
struct CryptoView {
    std::string name;
    bool is_default = false;  // channels without a view are its own
};

// Sorted by name. An unreadable manifest is not an error: Cryptomatte::no_manifest has the reason.
// An unusable cryptomatte is not an error either: Cryptomatte::fault (input) has the file and the
// reason: a hash or conversion outside the specification, missing ranks (then it has no levels),
// ranks that are not float channels or are in parts of different size.
Result<std::vector<Cryptomatte>> find_cryptomattes(const PixelFile& file,
                                                   Manifests manifests = Manifests::read,
                                                   const PathCheck& check = {},
                                                   const CryptoView& view = {});

// The attributes of `part` that are invalid in a file with only the channels of `written`: those of
// cryptomattes whose ranks are in `parts` (the whole file) but not in the new file.
std::vector<std::string> attributes_without_ranks(const ExrPart& part,
                                                  const std::vector<ExrPart>& parts,
                                                  const ExrSettings& written);

// Ids and coverages of every pixel, ranks together: [(y * width + x) * ranks + rank].
struct RankedCoverage {
    int width = 0;
    int height = 0;
    int ranks = 0;
    std::vector<CryptoId> ids;
    std::vector<float> coverages;
    uint64_t faulty = 0;  // slots that read_ranks() cleared

    RankedCoverage() = default;
    RankedCoverage(int width, int height, int ranks);
    size_t pixels() const { return size_t(width) * size_t(height); }
};

// Reads the pixels of `area`; pixels outside the file have no coverage. Slots whose id or coverage
// is NaN or Inf, or whose coverage is beyond 1.5, are cleared. Errors (input): damaged data.
Result<RankedCoverage> read_ranks(PixelFile& file, const Cryptomatte& cryptomatte,
                                  const Window& area);

// One channel: the sum of the coverages of `ids` (sorted) over the ranks.
ImageF coverage_of(const RankedCoverage& ranks, const std::vector<CryptoId>& ids);

// Ranks coverages that are added one id after another: keeps the largest of each pixel, in
// descending order; ties go to the smaller id.
class Reranking {
  public:
    Reranking(int width, int height, int ranks) : result_(width, height, ranks) {}
    // Adds channel `channel` of `coverage`, from its row `first_row` on, for `id`, which must be
    // new. It covers `area` (x, y from 0).
    void add(CryptoId id, const ImageF& coverage, int channel, const Window& area,
             int first_row = 0);

    const RankedCoverage& result() const { return result_; }
    uint64_t pixels_short() const;                        // pixels with more ids than ranks
    float largest_lost() const { return largest_lost_; }  // largest coverage without a rank

  private:
    void insert(size_t pixel, CryptoId id, float value);
    RankedCoverage result_;
    std::vector<bool> short_;
    float largest_lost_ = 0;
};

}  // namespace postchain::io
