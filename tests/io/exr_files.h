// Writes EXR files with OpenEXR and reads them with OpenImageIO, for tests of tools/sequence.
#pragma once

#include <ImathBox.h>
#include <ImfCompression.h>
#include <ImfHeader.h>
#include <ImfLineOrder.h>
#include <ImfPixelType.h>
#include <ImfTileDescription.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::test {

struct FileChannel {
    std::string name;
    Imf::PixelType type = Imf::HALF;
    int x_sampling = 1, y_sampling = x_sampling;
};

struct FilePart {
    std::string name = {};
    std::vector<FileChannel> channels = {};
    Imath::Box2i data = {{0, 0}, {12, 8}};
    Imath::Box2i display = {{0, 0}, {12, 8}};
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    Imf::LineOrder line_order = Imf::INCREASING_Y;
    int tile = 0;  // side of a tile, 0 = scanlines
    Imf::LevelMode levels = Imf::ONE_LEVEL;
    bool deep = false;
    // Values of a deep pixel's samples in one channel; as many in every channel.
    std::function<std::vector<float>(int x, int y, size_t channel)> samples = {};
    bool special_values = false;  // Inf and NaN with a payload in float channels
    bool repeating = false;       // pixels that every compression makes smaller
    bool black = false;           // every bit is 0
    // Bits of one sample; by default a hash of its position.
    std::function<uint32_t(size_t channel, int x, int y)> bits = {};
    std::function<void(Imf::Header&)> edit = {};
};

// One part without a name makes a single-part file. Pixels are sample_bits() of their position.
void write_file(const std::string& path, const std::vector<FilePart>& parts);
std::string bytes_of_file(const std::vector<FilePart>& parts);

// Opens the file and reads every channel of every part; ok only if all could be read.
Status read_whole(const std::string& path, const io::ReadLimits& limits = {});

// Color as half and depth as float.
FilePart rgba_z(const std::string& name = {});

// Offset of the table of chunks in a file with as many, found by its form: the first chunk follows
// it.
size_t chunk_table_of(const std::string& bytes, size_t chunks);

// The stored bits of one sample: half and float in (-2, 2), uint any.
uint32_t sample_bits(const FilePart& part, size_t channel, int x, int y);
float sample_value(const FilePart& part, size_t channel, int x, int y);

// One sub-image and level as read by OpenImageIO, in the file's own types.
struct OiioChannel {
    std::string name;
    std::string type;
    std::vector<char> bytes;
    bool operator==(const OiioChannel&) const = default;
};
std::vector<OiioChannel> oiio_channels(const std::string& path, int part = 0, int level = 0);
const OiioChannel& named(const std::vector<OiioChannel>& channels, const std::string& name);
// name and value of every attribute, with windows and compression.
std::vector<std::string> oiio_attributes(const std::string& path, int part = 0);
// The flattened channel of a deep part of one file, by ImageBufAlgo::flatten().
std::vector<float> oiio_flattened(const std::string& path, const std::string& channel);
// Sample counts and values of a deep part, as text.
std::string oiio_deep(const std::string& path, int part);

// A file in memory whose content can be replaced quickly.
class MemoryFile {
  public:
    MemoryFile();
    ~MemoryFile();
    MemoryFile(const MemoryFile&) = delete;
    const std::string& path() const { return path_; }
    void set(std::string_view bytes);

  private:
    int fd_ = -1;
    std::string path_;
};

}  // namespace postchain::test
