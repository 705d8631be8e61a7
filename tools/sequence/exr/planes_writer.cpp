#include "tools/sequence/exr/planes_writer.h"

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfIntAttribute.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>

#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_output.h"
#include "tools/sequence/exr/pixel_encode.h"

namespace postchain::io {
namespace {

// The encoded pixels of a PlanesFile, and how many did not fit.
struct EncodedPlanes {
    PartPixels pixels;
    EncodeCounts counts;
};

// Errors contain `path`.
Result<EncodedPlanes> encode_planes(const std::string& path, const PlanesFile& file,
                                    const WriteOptions& options) {
    if (file.channels.empty())
        return Status(StatusCode::internal, concat(path, ": no channels to write"));
    const ImageF& first = *file.channels[0].image;
    for (const PlaneChannel& c : file.channels) {
        if (c.image->width != first.width || c.image->height != first.height ||
            c.index >= c.image->channels || first.empty()) {
            return Status(StatusCode::internal,
                          concat(path, ": channel ", c.name, " does not fit the others"));
        }
    }
    EncodedPlanes encoded;
    PartPixels& pixels = encoded.pixels;
    pixels.window = {file.origin_x, file.origin_y, file.origin_x + first.width - 1,
                     file.origin_y + first.height - 1};
    std::vector<EncodeTarget> targets;
    for (const PlaneChannel& c : file.channels) {
        PartPixels::Plane& plane =
            pixels.planes.emplace_back(ExrChannel{c.name, c.type}, pixels.window);
        targets.push_back({c.image, c.index, c.type, plane.bytes.get()});
    }
    encoded.counts = encode_channels(targets);
    encoded.counts.narrowed = options.exr.half;
    RETURN_IF_ERROR(check_counts(path, encoded.counts, options.overflow));
    return encoded;
}

Result<Packer> write_encoded(Imf::OStream& stream, const EncodedPlanes& encoded,
                             const PlanesFile& file, const WriteOptions& options) {
    const PartPixels& pixels = encoded.pixels;
    Imf::Header header(box_of(file.display_window.value_or(pixels.window)), box_of(pixels.window));
    header.compression() = Imf::ZIP_COMPRESSION;
    header.zipCompressionLevel() = options.zip_level;
    for (const PlaneChannel& c : file.channels)
        header.channels().insert(c.name, Imf::Channel(imf_type(c.type)));
    const auto insert = [&header](const std::string& name, const AttributeValue& value) {
        if (const auto* s = std::get_if<std::string>(&value))
            header.insert(name, Imf::StringAttribute(*s));
        else if (const auto* f = std::get_if<float>(&value))
            header.insert(name, Imf::FloatAttribute(*f));
        else
            header.insert(name, Imf::IntAttribute(std::get<int>(value)));
    };
    for (const auto& [name, value] : file.attributes) insert(name, value);
    for (const auto& [name, value] : options.attributes) insert(name, value);
    apply_settings(options.exr, {}, header);
    return write_single_part(stream, header, planes_of(pixels));
}

// The channels of one image as float.
PlanesFile file_of(const ImageF& image, const std::vector<std::string>& names) {
    PlanesFile file;
    for (size_t i = 0; i < names.size(); ++i)
        file.channels.push_back({names[i], PixelType::float32, &image, int(i)});
    return file;
}

}  // namespace

Result<WriteReport> write_planes_exr(const std::string& path, const PlanesFile& file,
                                     const WriteOptions& options) try {
    WriteReport report;
    ASSIGN_OR_RETURN(const auto encoded, encode_planes(path, file, options));
    report.overflow_pixels = encoded.counts.overflow_pixels;
    report.nonfinite_pixels = encoded.counts.nonfinite_pixels;
    RETURN_IF_ERROR(write_exr_file(path, options, report, [&](Imf::OStream& stream) {
        return write_encoded(stream, encoded, file, options);
    }));
    return report;
} catch (...) {
    return status_of_exception(path);
}

Result<std::string> planes_exr_bytes(const ImageF& image, const std::vector<std::string>& names) {
    const std::string place = "an EXR in memory";
    try {
        const PlanesFile file = file_of(image, names);
        ASSIGN_OR_RETURN(const auto encoded, encode_planes(place, file, WriteOptions()));
        Imf::StdOSStream stream;
        RETURN_IF_ERROR(write_encoded(stream, encoded, file, {}).status().at(place));
        return stream.str();
    } catch (...) {
        return status_of_exception(place);
    }
}

Result<WriteReport> write_planes_exr(const std::string& path, const ImageF& image,
                                     const std::vector<std::string>& names,
                                     OnExisting on_existing) try {
    WriteOptions options;
    options.on_existing = on_existing;
    return write_planes_exr(path, file_of(image, names), options);
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
