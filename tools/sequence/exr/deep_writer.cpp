#include "tools/sequence/exr/deep_writer.h"

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfPartType.h>
#include <ImfThreading.h>

#include <cstring>
#include <numeric>

#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_output.h"
#include "tools/sequence/exr/pixel_encode.h"

namespace postchain::io {
namespace {

// The values as stored, and the index of each pixel's first value.
struct EncodedChannel {
    std::vector<std::byte> bytes;
    std::vector<char*> pixels;
};

EncodedChannel encode(const DeepChannel& channel, const std::vector<uint32_t>& counts) {
    EncodedChannel encoded;
    const size_t size = size_t(bytes_of(channel.type));
    encoded.bytes.resize(channel.values.size() * size);
    if (channel.type == PixelType::half)
        floats_to_halves(channel.values.data(), channel.values.size(),
                         reinterpret_cast<uint16_t*>(encoded.bytes.data()));
    else
        std::memcpy(encoded.bytes.data(), channel.values.data(), encoded.bytes.size());
    char* at = reinterpret_cast<char*>(encoded.bytes.data());
    for (const uint32_t count : counts) {
        encoded.pixels.push_back(at);
        at += count * size;
    }
    return encoded;
}

}  // namespace

Result<WriteReport> write_deep_exr(const std::string& path, const DeepSamples& samples,
                                   const WriteOptions& options) try {
    WriteReport report;
    const size_t count = std::accumulate(samples.counts.begin(), samples.counts.end(), size_t(0));
    bool fits = samples.counts.size() == size_t(samples.width) * size_t(samples.height);
    for (const DeepChannel& channel : samples.channels)
        fits = fits && channel.values.size() == count && channel.type != PixelType::uint32;
    if (!fits) return Status(StatusCode::internal, concat(path, ": the deep samples do not fit"));
    Imf::Header header(samples.width, samples.height);
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    header.zipCompressionLevel() = options.zip_level;
    std::vector<uint32_t> counts = samples.counts;
    const size_t width = size_t(samples.width);
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()),
                                             sizeof(uint32_t), sizeof(uint32_t) * width));
    std::vector<EncodedChannel> encoded;
    encoded.reserve(samples.channels.size());
    for (const DeepChannel& channel : samples.channels) {
        header.channels().insert(channel.name, Imf::Channel(imf_type(channel.type)));
        EncodedChannel& to = encoded.emplace_back(encode(channel, counts));
        buffer.insert(
            channel.name,
            Imf::DeepSlice(imf_type(channel.type), reinterpret_cast<char*>(to.pixels.data()),
                           sizeof(char*), sizeof(char*) * width, size_t(bytes_of(channel.type))));
    }
    const auto write = [&](Imf::OStream& stream) -> Result<Packer> {
        Imf::DeepScanLineOutputFile out(stream, header, Imf::globalThreadCount());
        out.setFrameBuffer(buffer);
        out.writePixels(samples.height);
        return Packer::openexr;
    };
    RETURN_IF_ERROR(write_exr_file(path, options, report, write));
    return report;
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
