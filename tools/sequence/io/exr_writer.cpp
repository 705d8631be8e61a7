#include "tools/sequence/io/exr_writer.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfIntAttribute.h>
#include <ImfPartType.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <numeric>

#include "tools/sequence/io/exr_attributes.h"
#include "tools/sequence/io/exr_internal.h"
#include "tools/sequence/io/exr_output.h"
#include "tools/sequence/io/pixel_encode.h"

namespace postchain::io {

namespace {

bool is_lossy(Imf::Compression c) {
    return c == Imf::PXR24_COMPRESSION || c == Imf::B44_COMPRESSION || c == Imf::B44A_COMPRESSION ||
           c == Imf::DWAA_COMPRESSION || c == Imf::DWAB_COMPRESSION;
}

// Attributes that describe the unfiltered picture and would lie about the filtered one.
constexpr const char* kStaleAttributes[] = {"preview", "oiio:SHA-1", "oiio:AverageColor",
                                            "oiio:ConstantColor"};

// What `fail` and `skip` can say before any work. commit() decides for good.
Result<bool> skipped_already(const std::string& path, OnExisting on_existing) {
    if (on_existing == OnExisting::overwrite || ::access(path.c_str(), F_OK) != 0) return false;
    if (on_existing == OnExisting::skip) return true;
    return Status(StatusCode::output, concat(path, ": exists already, and is not replaced"));
}

Status check_counts(const std::string& path, const EncodeCounts& counts, HalfOverflow policy) {
    if (policy == HalfOverflow::clamp || counts.refused_pixels == 0) return {};
    return Status(StatusCode::output,
                  concat(path, ": ", std::to_string(counts.refused_pixels),
                         " pixels of color do not fit their channels (half holds 65504 at most, "
                         "float 3.4e38), ",
                         std::to_string(counts.nonfinite_pixels),
                         " of them not finite; clamp them (--overflow clamp), or render ",
                         counts.overflow_pixels > 0 ? "color as float" : "it less bright"));
}

// Runs `write` on an OpenEXR output stream into a new file at `path`, then commits.
// `Result<Packer> write(Imf::OStream&)` may throw, and must have closed its OpenEXR objects when it
// returns.
template <class Write>
Status write_file(const std::string& path, const WriteOptions& options, WriteReport& report,
                  Write write) {
    Result<AtomicFile> file = AtomicFile::create(path);
    if (!file.ok()) return file.status();
    AtomicOStream stream(*file);
    try {
        const Result<Packer> packer = write(stream);
        if (!packer.ok()) return packer.status().at(path);
        if (*packer == Packer::openexr)
            if (Status s = check_complete(*file); !s.ok()) return s;
        // A failure that OpenEXR's destructors swallowed has stuck to the file.
        if (Status s = file->flush(); !s.ok()) return s;
    } catch (...) {
        if (!stream.status.ok()) return stream.status;
        return status_of_exr_exception(StatusCode::output, path);
    }
    report.bytes = file->size();
    if (options.before_commit)
        if (Status s = options.before_commit(); !s.ok()) return s;
    Result<bool> written = file->commit(options.on_existing);
    if (!written.ok()) return written.status();
    report.skipped = !*written;
    return {};
}

// Header::erase() of OpenEXR 3.1 leaks the attribute, so this is a copy that never had it.
Imf::Header without(const Imf::Header& from, const std::vector<std::string>& names) {
    Imf::Header header;
    for (auto it = from.begin(); it != from.end(); ++it) {
        if (std::find(names.begin(), names.end(), it.name()) != names.end()) continue;
        header.insert(it.name(), it.attribute());
    }
    return header;
}

// The header of color's part in the output.
Imf::Header color_header(const Imf::Header& from, bool only_color, bool keep_type,
                         const WriteOptions& options, std::vector<std::string>& notes) {
    std::vector<std::string> left_out;
    for (const char* name : kStaleAttributes) {
        if (from.find(name) == from.end()) continue;
        left_out.push_back(name);
        notes.push_back(concat("attribute ", name, " left out: it described the unfiltered file"));
    }
    if (!keep_type) left_out.push_back("type");
    Imf::Header header = without(from, left_out);
    for (const auto& [name, value] : options.attributes) {
        header.insert(name, Imf::StringAttribute(value));
    }
    if (is_lossy(header.compression()) && !only_color) {
        notes.push_back(concat("compression ", compression_name(header.compression()),
                               " replaced by zip: the part holds channels besides color, which "
                               "are only written lossless"));
        header.compression() = Imf::ZIP_COMPRESSION;
    }
    if (header.hasTileDescription() && header.tileDescription().mode != Imf::ONE_LEVEL) {
        Imf::TileDescription tiles = header.tileDescription();
        tiles.mode = Imf::ONE_LEVEL;
        header.setTileDescription(tiles);
        notes.push_back("smaller levels dropped: they showed the unfiltered picture");
    }
    header.zipCompressionLevel() = options.zip_level;
    // The level of DWA is an attribute of the file; a header that was read does not keep it.
    if (const auto* level = header.findTypedAttribute<Imf::FloatAttribute>("dwaCompressionLevel")) {
        header.dwaCompressionLevel() = level->value();
    }
    return header;
}

// The smallest window around `window` in which every channel has whole samples.
Window aligned(Window window, const PartPixels& pixels) {
    int x = 1, y = 1;
    for (const PartPixels::Plane& plane : pixels.planes) {
        x = std::lcm(x, plane.channel.x_sampling);
        y = std::lcm(y, plane.channel.y_sampling);
    }
    const auto down = [](int value, int step) { return value - ((value % step) + step) % step; };
    window.min_x = down(window.min_x, x);
    window.min_y = down(window.min_y, y);
    window.max_x = down(window.max_x, x) + x - 1;
    window.max_y = down(window.max_y, y) + y - 1;
    return window;
}

}  // namespace

Status check_rewritable(ExrFile& file, int color_part,
                        const std::map<std::string, std::string>& attributes) try {
    const Imf::MultiPartInputFile& input = *file.impl().file;
    for (int part = 0; part < input.parts(); ++part) {
        const Imf::Header& header = input.header(part);
        if (part != color_part && header.hasType() && !Imf::isSupportedType(header.type()))
            return Status(StatusCode::input, concat(file.path(), ": part ", part, " '",
                                                    header.hasName() ? header.name() : "",
                                                    "' is of the unknown type '", header.type(),
                                                    "' and cannot be copied; write it without"));
    }
    const Imf::Header& header = input.header(color_part);
    for (const auto& [name, value] : attributes) {
        const auto found = header.find(name);
        if (found == header.end() ||
            dynamic_cast<const Imf::StringAttribute*>(&found.attribute()) != nullptr)
            continue;
        return Status(
            StatusCode::input,
            concat(file.path(), ": its attribute ", name, " is ", found.attribute().typeName(),
                   ", and the output has a text of that name; rename it or leave it out"));
    }
    return {};
} catch (...) {
    return status_of_exception(file.path());
}

namespace {

// A part of the output that is encoded anew.
struct RewrittenPart {
    PartPixels read;   // of a part that the frame does not hold
    PartPixels moved;  // where the data window grows
    PartPixels fresh;  // the channels that are replaced
    std::vector<ImageF> images;
    PartPlanes planes;

    // Channels of `part` in `layers`, over what `kept` has, placed in `window`. Counts what does
    // not fit its channel.
    EncodeCounts replace(const PartPixels& kept, const Window& window, const InputFrame& frame,
                         const std::vector<const FilteredLayer*>& layers);
};

EncodeCounts RewrittenPart::replace(const PartPixels& kept, const Window& window,
                                    const InputFrame& frame,
                                    const std::vector<const FilteredLayer*>& layers) {
    static const std::map<std::string, float> kNothing;
    const auto outside = frame.outside.find(kept.part);
    const bool same = window == kept.window;
    if (!same)
        moved = kept.placed(window, outside == frame.outside.end() ? kNothing : outside->second);
    const PartPixels& under = same ? kept : moved;
    fresh.part = under.part;
    fresh.window = under.window;
    std::vector<EncodeTarget> targets;
    images.reserve(layers.size());
    for (const FilteredLayer* layer : layers) {
        if (window != frame.window) images.push_back(placed(*layer->image, frame.window, window));
        const ImageF& image = window == frame.window ? *layer->image : images.back();
        for (size_t i = 0; i < layer->channels.size(); ++i) {
            const PartPixels::Plane* old = under.find(layer->channels[i]);
            PartPixels::Plane& plane = fresh.planes.emplace_back();
            plane.channel = old->channel;
            plane.width = old->width;
            plane.height = old->height;
            plane.bytes = std::make_unique_for_overwrite<std::byte[]>(plane.total_bytes());
            targets.push_back({&image, int(i), plane.channel.type, plane.bytes.get(), !layer->ids});
        }
    }
    const EncodeCounts counts = encode_channels(targets);
    planes = planes_of(fresh);
    for (const PartPixels::Plane& plane : under.planes)
        if (fresh.find(plane.channel.name) == nullptr) planes.planes.push_back(&plane);
    return counts;
}

// The layers by their part, color's among them.
Result<std::map<int, std::vector<const FilteredLayer*>>> by_part(
    const std::string& path, const InputFrame& frame, const FilteredLayer& color,
    const std::vector<FilteredLayer>& layers) {
    std::map<int, std::vector<const FilteredLayer*>> parts;
    parts[color.part].push_back(&color);
    const auto& in_file = frame.files.color_file().parts();
    for (const FilteredLayer& layer : layers) {
        const bool fits = layer.part >= 0 && size_t(layer.part) < in_file.size() &&
                          in_file[size_t(layer.part)].data_window == frame.data_window &&
                          layer.image->width == frame.description.width &&
                          layer.image->height == frame.description.height &&
                          size_t(layer.image->channels) >= layer.channels.size();
        if (!fits)
            return Status(StatusCode::internal, concat(path, ": a layer does not fit the frame"));
        parts[layer.part].push_back(&layer);
    }
    return parts;
}

size_t channel_count(const std::vector<const FilteredLayer*>& layers) {
    size_t count = 0;
    for (const FilteredLayer* layer : layers) count += layer->channels.size();
    return count;
}

}  // namespace

Result<WriteReport> write_filtered(const std::string& path, InputFrame& frame, const ImageF& color,
                                   const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers) try {
    WriteReport report;
    if (frame.kept == nullptr || color.width != frame.description.width ||
        color.height != frame.description.height || color.channels != 4) {
        return Status(StatusCode::internal, concat(path, ": color does not fit the frame"));
    }
    Result<bool> skipped = skipped_already(path, options.on_existing);
    if (!skipped.ok()) return skipped.status();
    if (*skipped) {
        report.skipped = true;
        return report;
    }

    const int color_part = frame.kept->part;
    if (Status s = check_rewritable(frame.files.color_file(), color_part, options.attributes);
        !s.ok())
        return s;

    const FilteredLayer own{color_part, frame.assignment.at(Role::color).channels, &color, false};
    const auto replaced = by_part(path, frame, own, layers);
    if (!replaced.ok()) return replaced.status();
    const bool grown = options.window && *options.window != frame.kept->window;
    ExrFile& file = frame.files.color_file();
    ExrFile::Impl& input = file.impl();
    std::vector<Imf::Header> headers;
    for (int i = 0; i < input.file->parts(); ++i) headers.push_back(input.file->header(i));
    std::map<int, RewrittenPart> rewritten;
    EncodeCounts counts;
    for (const auto& [part, of_part] : *replaced) {
        RewrittenPart& next = rewritten[part];
        if (part != color_part) {
            auto read = file.read_part(part);
            if (!read.ok()) return read.status();
            next.read = std::move(*read);
        }
        const PartPixels& kept = part == color_part ? *frame.kept : next.read;
        const Window window = grown ? aligned(*options.window, kept) : kept.window;
        const EncodeCounts found = next.replace(kept, window, frame, of_part);
        counts.overflow_pixels += found.overflow_pixels;
        counts.nonfinite_pixels += found.nonfinite_pixels;
        counts.refused_pixels += found.refused_pixels;
        WriteOptions of_header = options;
        if (part != color_part) of_header.attributes.clear();
        headers[size_t(part)] = color_header(
            headers[size_t(part)], channel_count(of_part) == kept.planes.size(),
            input.facts.multi_part || input.facts.type_attribute, of_header, report.notes);
        if (!grown) continue;
        headers[size_t(part)].dataWindow() = box_of(window);
        report.notes.push_back(concat("data window ", kept.window.text(), " grown to ",
                                      window.text(), ": the chain moves light out of it"));
    }
    if (Status s = check_counts(path, counts, options.overflow); !s.ok()) return s;
    report.overflow_pixels = counts.overflow_pixels;
    report.nonfinite_pixels = counts.nonfinite_pixels;

    const auto write = [&](Imf::OStream& stream) {
        if (!input.facts.multi_part)
            return write_single_part(stream, headers[0], rewritten.at(0).planes);
        std::map<int, PartPlanes> planes;
        for (auto& [part, anew] : rewritten) planes[part] = std::move(anew.planes);
        return write_multi_part(stream, headers, planes, *input.file);
    };
    if (Status s = write_file(path, options, report, write); !s.ok()) return s;
    return report;
} catch (...) {
    return status_of_exception(path);
}

namespace {

// What a file of planes becomes: its pixels, and how it is written.
struct EncodedPlanes {
    PartPixels pixels;
    EncodeCounts counts;
};

// Errors name `path`.
Result<EncodedPlanes> encode_planes(const std::string& path, const PlanesFile& file,
                                    HalfOverflow overflow) {
    if (file.channels.empty()) {
        return Status(StatusCode::internal, concat(path, ": no channels to write"));
    }
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
        PartPixels::Plane& plane = pixels.planes.emplace_back();
        plane.channel = {c.name, c.type, 1, 1};
        plane.width = first.width;
        plane.height = first.height;
        plane.bytes = std::make_unique_for_overwrite<std::byte[]>(plane.total_bytes());
        targets.push_back({c.image, c.index, c.type, plane.bytes.get()});
    }
    encoded.counts = encode_channels(targets);
    if (Status s = check_counts(path, encoded.counts, overflow); !s.ok()) return s;
    return encoded;
}

Result<Packer> write_encoded(Imf::OStream& stream, const EncodedPlanes& encoded,
                             const PlanesFile& file, const WriteOptions& options) {
    const PartPixels& pixels = encoded.pixels;
    Imf::Header header(box_of(file.display_window.value_or(pixels.window)), box_of(pixels.window));
    header.compression() = Imf::ZIP_COMPRESSION;
    header.zipCompressionLevel() = options.zip_level;
    for (const PlaneChannel& c : file.channels) {
        header.channels().insert(c.name, Imf::Channel(imf_type(c.type)));
    }
    const auto insert = [&header](const std::string& name, const AttributeValue& value) {
        if (const auto* s = std::get_if<std::string>(&value)) {
            header.insert(name, Imf::StringAttribute(*s));
        } else if (const auto* f = std::get_if<float>(&value)) {
            header.insert(name, Imf::FloatAttribute(*f));
        } else {
            header.insert(name, Imf::IntAttribute(std::get<int>(value)));
        }
    };
    for (const auto& [name, value] : file.attributes) insert(name, value);
    for (const auto& [name, value] : options.attributes) insert(name, value);
    return write_single_part(stream, header, planes_of(pixels));
}

// The channels of one image as float.
PlanesFile file_of(const ImageF& image, const std::vector<std::string>& names) {
    PlanesFile file;
    for (size_t i = 0; i < names.size(); ++i) {
        file.channels.push_back({names[i], PixelType::float32, &image, int(i)});
    }
    return file;
}

}  // namespace

Result<WriteReport> write_planes_exr(const std::string& path, const PlanesFile& file,
                                     const WriteOptions& options) try {
    WriteReport report;
    Result<bool> skipped = skipped_already(path, options.on_existing);
    if (!skipped.ok()) return skipped.status();
    if (*skipped) {
        report.skipped = true;
        return report;
    }
    const auto encoded = encode_planes(path, file, options.overflow);
    if (!encoded.ok()) return encoded.status();
    report.overflow_pixels = encoded->counts.overflow_pixels;
    report.nonfinite_pixels = encoded->counts.nonfinite_pixels;
    const auto write = [&](Imf::OStream& stream) {
        return write_encoded(stream, *encoded, file, options);
    };
    if (Status s = write_file(path, options, report, write); !s.ok()) return s;
    return report;
} catch (...) {
    return status_of_exception(path);
}

Result<std::string> planes_exr_bytes(const ImageF& image, const std::vector<std::string>& names) {
    const std::string place = "an EXR in memory";
    try {
        const PlanesFile file = file_of(image, names);
        const auto encoded = encode_planes(place, file, HalfOverflow::refuse);
        if (!encoded.ok()) return encoded.status();
        Imf::StdOSStream stream;
        const auto packer = write_encoded(stream, *encoded, file, {});
        if (!packer.ok()) return packer.status().at(place);
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
