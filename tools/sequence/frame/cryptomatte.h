// Cryptomattes of an EXR: which there are, whose ids they hold, how much of a pixel an id covers.
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

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {

using CryptoId = uint32_t;  // as its float has it; 0 = nothing

// MurmurHash3_x86_32 with seed 0. Source: Appleby, MurmurHash3, public domain.
uint32_t murmur_hash(std::string_view text);
// A hash as a float can hold it and keep it: an exponent of all zeros or all ones (denormals, Inf,
// NaN) has its lowest bit turned over.
CryptoId id_of_hash(uint32_t hash);
CryptoId id_of_name(std::string_view name);

// Two ranks: id and coverage, twice. Channels of one part.
struct CryptoLevel {
    int part = 0;
    std::array<std::string, 4> channels;
};

struct Cryptomatte {
    std::string key;   // of its attributes
    std::string name;  // that its channels begin with: "ViewLayer.CryptoObject"
    std::vector<CryptoLevel> levels;
    std::map<std::string, CryptoId> manifest;  // by name; empty where there is none
    std::string no_manifest;                   // why there is none
    std::string manifest_file;                 // that its attributes name; empty: none
    Status fault;                              // why it cannot be used

    int ranks() const { return 2 * int(levels.size()); }
    // Without what stands before its last dot: "CryptoObject".
    std::string short_name() const;
    bool holds(int part, std::string_view channel) const;
};

// Names are needed where a matte is asked for by one. Not read, Cryptomatte::manifest and
// no_manifest stay empty.
enum class Manifests { read, not_read };

// Of a file that a frame names the path to read, without links, or why it is not to be read. None:
// every file is read, and links are followed.
using PathHold = std::function<Result<std::string>(const std::string& path)>;

// In the order of their names. A manifest that cannot be read is no error: Cryptomatte::no_manifest
// says why. Nor is a cryptomatte that cannot be used; Cryptomatte::fault (input) names the file: a
// hash or conversion that the specification does not have, ranks that are not there (it has no
// levels then), are no float channels or are of parts of different size.
Result<std::vector<Cryptomatte>> find_cryptomattes(const PixelFile& file,
                                                   Manifests manifests = Manifests::read,
                                                   const PathHold& hold = {});

// The attributes of `part` that would be true no more in a file with the channels that `written`
// takes: those of cryptomattes whose ranks `parts`, the whole file, has, and the new one has not.
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

    RankedCoverage() = default;
    RankedCoverage(int width, int height, int ranks);
    size_t pixels() const { return size_t(width) * size_t(height); }
};

// Reads the pixels of `area`; what the file does not have of it is covered by nothing. Errors
// (input): damaged data.
Result<RankedCoverage> read_ranks(PixelFile& file, const Cryptomatte& cryptomatte,
                                  const Window& area);

// Those with a coverage above 0, sorted. Id 0 is none.
std::vector<CryptoId> ids_in(const RankedCoverage& ranks);

// One channel: the sum of the coverages of `ids` (sorted) over the ranks.
ImageF coverage_of(const RankedCoverage& ranks, const std::vector<CryptoId>& ids);

// Ranks of coverages that come one id after another: of each pixel the largest are kept, the
// largest first; of two as large that with the smaller id.
class Reranking {
  public:
    Reranking(int width, int height, int ranks) : result_(width, height, ranks) {}
    // Channel `channel` of `coverage`, from its row `first_row` on, is that of `id`, which was not
    // added before. Pixels outside `area` (x, y from 0) have none of it.
    void add(CryptoId id, const ImageF& coverage, int channel, const Window& area,
             int first_row = 0);

    const RankedCoverage& result() const { return result_; }
    uint64_t pixels_short() const;  // in which more ids cover than there are ranks
    float largest_lost() const { return largest_lost_; }  // coverage of an id that has no rank

  private:
    void insert(size_t pixel, CryptoId id, float value);
    RankedCoverage result_;
    std::vector<bool> short_;
    float largest_lost_ = 0;
};

}  // namespace postchain::io
