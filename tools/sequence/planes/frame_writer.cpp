#include "tools/sequence/planes/frame_writer.h"

#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "chain/base/text.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_output.h"
#include "tools/sequence/exr/pixel_encode.h"
#include "tools/sequence/planes/cryptomatte.h"

namespace postchain::io {

namespace {

bool is_lossy(Imf::Compression c) {
    return c == Imf::PXR24_COMPRESSION || c == Imf::B44_COMPRESSION || c == Imf::B44A_COMPRESSION ||
           c == Imf::DWAA_COMPRESSION || c == Imf::DWAB_COMPRESSION;
}

// Attributes that describe the unfiltered image and are wrong for the filtered one.
constexpr const char* kStaleAttributes[] = {"preview", "oiio:SHA-1", "oiio:AverageColor",
                                            "oiio:ConstantColor"};

// Copies the header without these attributes, since Header::erase() of OpenEXR 3.1 leaks them.
Imf::Header without(const Imf::Header& from, const std::vector<std::string>& names) {
    Imf::Header header;
    for (auto it = from.begin(); it != from.end(); ++it) {
        if (std::find(names.begin(), names.end(), it.name()) != names.end()) continue;
        header.insert(it.name(), it.attribute());
    }
    return header;
}

// The header of color's part in the output.
Imf::Header color_header(const Imf::Header& from, const std::vector<std::string>& color,
                         bool keep_type, const WriteOptions& options,
                         std::vector<std::string>& notes) {
    std::vector<std::string> left_out;
    for (const char* name : kStaleAttributes) {
        if (from.find(name) == from.end()) continue;
        left_out.push_back(name);
        notes.push_back(concat("attribute ", name, " left out: it described the unfiltered file"));
    }
    const bool deep = from.hasType() && Imf::isDeepData(from.type());
    if (deep) {
        left_out.insert(left_out.end(),
                        {"chunkCount", "version", "maxSamplesPerPixel", "deepImageState"});
        notes.push_back("deep samples flattened: the output has one value for each pixel");
    }
    if (!keep_type || deep) left_out.push_back("type");
    Imf::Header header = without(from, left_out);
    if (keep_type && deep)
        header.setType(from.type() == Imf::DEEPTILE ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    for (const auto& [name, value] : options.attributes)
        header.insert(name, Imf::StringAttribute(value));
    header.zipCompressionLevel() = options.zip_level;
    // The level of DWA is an attribute of the file; OpenEXR does not copy it into a header it
    // reads.
    if (const auto* level = header.findTypedAttribute<Imf::FloatAttribute>("dwaCompressionLevel"))
        header.dwaCompressionLevel() = level->value();
    apply_settings(options.exr, color, header);
    bool only_color = true;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
        only_color &= std::find(color.begin(), color.end(), it.name()) != color.end();
    if (!options.exr.compression && is_lossy(header.compression()) && !only_color) {
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

// Only an EXR is written back.
ExrFile& exr_of(PixelFile& file) {
    return dynamic_cast<ExrFile&>(file);
}

}  // namespace

Status check_rewritable(PixelFile& file, const RoleChannels& color,
                        const WriteOptions& options) try {
    const int color_part = color.part;
    const Imf::MultiPartInputFile& input = *exr_of(file).impl().file;
    for (int part = 0; part < input.parts(); ++part) {
        const Imf::Header& header = input.header(part);
        if (part != color_part && header.hasType() && !Imf::isSupportedType(header.type()))
            return Status(StatusCode::input, concat(file.path(), ": part ", part, " '",
                                                    header.hasName() ? header.name() : "",
                                                    "' is of the unknown type '", header.type(),
                                                    "' and cannot be copied; write it without"));
    }
    const Imf::Header& header = input.header(color_part);
    for (const auto& [name, value] : options.attributes) {
        const auto found = header.find(name);
        if (found == header.end() ||
            dynamic_cast<const Imf::StringAttribute*>(&found.attribute()) != nullptr)
            continue;
        return Status(
            StatusCode::input,
            concat(file.path(), ": its attribute ", name, " is ", found.attribute().typeName(),
                   ", and the output has a text of that name; rename it or leave it out"));
    }
    const auto notes = check_settings(file.parts(), color_part, color.channels, options.exr);
    return notes.ok() ? Status() : notes.status().at(file.path());
} catch (...) {
    return status_of_exception(file.path());
}

Status check_new_exr(const PixelFile& file, const RoleChannels& color,
                     const WriteOptions& options) try {
    const auto notes = check_settings(file.parts(), color.part, color.channels, options.exr);
    return notes.ok() ? Status() : notes.status().at(file.path());
} catch (...) {
    return status_of_exception(file.path());
}

namespace {

// A part of the output that is encoded anew.
struct RewrittenPart {
    PartPixels read;   // pixels of a part other than color's
    PartPixels moved;  // pixels in a larger data window
    PartPixels fresh;  // replaced channels
    std::vector<ImageF> images;
    PartPlanes planes;

    // Channels of `part` in `layers`, over what `kept` has, placed in `window`. Counts what does
    // not fit its channel.
    EncodeCounts replace(const PartPixels& kept, const Window& window, const StoredFrame& frame,
                         const std::vector<const FilteredLayer*>& layers, const ExrSettings& exr);
    // After replace(): no value of the replaced channels has changed.
    bool is_as_read(const PartPixels& kept) const;
};

bool RewrittenPart::is_as_read(const PartPixels& kept) const {
    return planes.window == kept.window &&
           std::all_of(fresh.planes.begin(), fresh.planes.end(), [&](const auto& plane) {
               const PartPixels::Plane* old = kept.find(plane.channel.name);
               return old && plane.channel.type == old->channel.type &&
                      std::memcmp(plane.bytes.get(), old->bytes.get(), old->total_bytes()) == 0;
           });
}

// Whether chunks of one part are valid in the other.
bool chunks_fit(const Imf::Header& from, const Imf::Header& to) {
    const bool tiled = from.hasTileDescription();
    return from.compression() == to.compression() && from.dataWindow() == to.dataWindow() &&
           from.lineOrder() == to.lineOrder() && from.channels() == to.channels() &&
           tiled == to.hasTileDescription() &&
           (!tiled || from.tileDescription() == to.tileDescription());
}

EncodeCounts RewrittenPart::replace(const PartPixels& kept, const Window& window,
                                    const StoredFrame& frame,
                                    const std::vector<const FilteredLayer*>& layers,
                                    const ExrSettings& exr) {
    static const std::map<std::string, float> kNothing;
    const auto outside = frame.outside.find(kept.part);
    const bool same = window == kept.window;
    if (!same)
        moved = kept.placed(window, outside == frame.outside.end() ? kNothing : outside->second);
    const PartPixels& under = same ? kept : moved;
    fresh.part = under.part;
    fresh.window = under.window;
    std::vector<EncodeTarget> targets;
    bool narrowed = false;
    images.reserve(layers.size());
    for (const FilteredLayer* layer : layers) {
        if (window != frame.window) images.push_back(placed(*layer->image, frame.window, window));
        const ImageF& image = window == frame.window ? *layer->image : images.back();
        for (size_t i = 0; i < layer->channels.size(); ++i) {
            if (!layer->added && !exr.takes(layer->channels[i])) continue;
            const PartPixels::Plane* old = under.find(layer->channels[i]);
            ExrChannel channel =
                old ? old->channel : ExrChannel{layer->channels[i], PixelType::half};
            if (exr.half && !layer->ids && channel.type == PixelType::float32) {
                channel.type = PixelType::half;
                narrowed = true;
            }
            PartPixels::Plane& plane = fresh.planes.emplace_back(channel, under.window);
            targets.push_back({&image, int(i), plane.channel.type, plane.bytes.get(), !layer->ids});
        }
    }
    EncodeCounts counts = encode_channels(targets);
    counts.narrowed = narrowed;
    planes.window = fresh.window;
    for (const PartPixels::Plane& plane : fresh.planes) planes.planes.push_back(&plane);
    for (const PartPixels::Plane& plane : under.planes)
        if (exr.takes(plane.channel.name) && fresh.find(plane.channel.name) == nullptr)
            planes.planes.push_back(&plane);
    return counts;
}

using Layers = std::vector<const FilteredLayer*>;

// The layers by their part, color's among them.
Result<std::map<int, Layers>> by_part(const std::string& path, const PixelFile& file,
                                      const StoredFrame& frame, const FilteredLayer& color,
                                      const std::vector<FilteredLayer>& layers) {
    std::map<int, Layers> parts;
    parts[color.part].push_back(&color);
    const auto& in_file = file.parts();
    for (const FilteredLayer& layer : layers) {
        const bool fits =
            layer.part >= 0 && size_t(layer.part) < in_file.size() &&
            in_file[size_t(layer.part)].data_window == in_file[size_t(color.part)].data_window &&
            layer.image->width == frame.window.width() &&
            layer.image->height == frame.window.height() &&
            size_t(layer.image->channels) >= layer.channels.size();
        if (!fits)
            return Status(StatusCode::internal, concat(path, ": a layer does not fit the frame"));
        parts[layer.part].push_back(&layer);
    }
    return parts;
}

// The channels of layers that are color.
std::vector<std::string> color_channels(const Layers& layers) {
    std::vector<std::string> names;
    for (const FilteredLayer* layer : layers)
        if (!layer->ids) names.insert(names.end(), layer->channels.begin(), layer->channels.end());
    return names;
}

// The output in the making: the headers of its parts, and those that are encoded anew.
class FilteredFile {
  public:
    FilteredFile(ExrFile& file, const StoredFrame& frame, const WriteOptions& options,
                 std::vector<std::string> notes)
        : file_(file),
          input_(file.impl()),
          frame_(frame),
          options_(options),
          grown_(options.window && *options.window != frame.kept->window),
          parts_(written_parts(file.parts(), options.exr)),
          notes_(std::move(notes)) {
        for (int i = 0; i < input_.file->parts(); ++i) headers_.push_back(input_.file->header(i));
    }

    // Leaves out the attributes of cryptomattes whose ranks are not written.
    void leave_out_attributes_without_ranks() {
        for (const int part : parts_) {
            const auto lost =
                attributes_without_ranks(file_.parts()[size_t(part)], file_.parts(), options_.exr);
            if (lost.empty()) continue;
            header(part) = without(header(part), lost);
            notes_.push_back(
                concat("attributes left out: their cryptomatte is not written: ", joined(lost)));
        }
    }

    // Replaces channels of a part, unless the output does without it.
    Status replace(int part, const Layers& layers) {
        if (std::find(parts_.begin(), parts_.end(), part) == parts_.end()) return Status();
        RewrittenPart& next = rewritten_[part];
        if (!is_color(part)) {
            ASSIGN_OR_RETURN(next.read, file_.read_part(part));
        }
        const PartPixels& kept = is_color(part) ? *frame_.kept : next.read;
        const Window window = grown_ ? aligned(*options_.window, kept) : kept.window;
        const EncodeCounts found = next.replace(kept, window, frame_, layers, options_.exr);
        counts_.overflow_pixels += found.overflow_pixels;
        counts_.nonfinite_pixels += found.nonfinite_pixels;
        counts_.refused_pixels += found.refused_pixels;
        counts_.narrowed = counts_.narrowed || found.narrowed;
        set_header(part, layers, kept.window, window);
        // Every lossy encoding adds an error.
        if (is_lossy(header(part).compression()) && next.is_as_read(kept)) keep_chunks(part);
        return Status();
    }

    // Errors: those of check_counts() and write_exr_file().
    Status write(const std::string& path, WriteReport& report) {
        RETURN_IF_ERROR(check_counts(path, counts_, options_.overflow));
        report.overflow_pixels = counts_.overflow_pixels;
        report.nonfinite_pixels = counts_.nonfinite_pixels;
        report.notes = std::move(notes_);
        return write_exr_file(path, options_, report,
                              [&](Imf::OStream& stream) { return write_parts(stream); });
    }

  private:
    bool is_color(int part) const { return part == frame_.kept->part; }
    Imf::Header& header(int part) { return headers_[size_t(part)]; }

    // The settings of an output are color's part's.
    WriteOptions options_of(int part) const {
        WriteOptions options = options_;
        if (!is_color(part)) {
            options.attributes.clear();
            options.exr.compression.reset();
        }
        return options;
    }

    void set_header(int part, const Layers& layers, const Window& read, const Window& window) {
        header(part) = color_header(header(part), color_channels(layers),
                                    input_.facts.multi_part || input_.facts.type_attribute,
                                    options_of(part), notes_);
        for (const FilteredLayer* layer : layers)
            for (const std::string& name : layer->channels)
                if (layer->added) header(part).channels().insert(name, Imf::Channel(Imf::HALF));
        if (!grown_) return;
        header(part).dataWindow() = box_of(window);
        notes_.push_back(concat("data window ", read.text(), " grown to ", window.text(),
                                ": the chain moves light out of it"));
    }

    // Copies the chunks of an unchanged part whose compression is lossy, or says why they cannot
    // be.
    void keep_chunks(int part) {
        const Imf::Header& stored = input_.file->header(part);
        if (!is_lossy(stored.compression())) return;
        const bool can_copy = input_.facts.multi_part || !stored.hasTileDescription();
        if (can_copy && !options_of(part).exr.compression && chunks_fit(stored, header(part)))
            rewritten_.erase(part);
        else
            notes_.push_back(concat(
                "color is unchanged, and is packed anew with ",
                compression_name(header(part).compression()), ", which changes it a little: ",
                can_copy ? "it is copied only where compression, channels and tiles are "
                           "the input's (zip would change nothing)"
                         : "tiles of a file of one part are not copied (zip would change "
                           "nothing)"));
    }

    Result<Packer> write_parts(Imf::OStream& stream) {
        std::vector<Imf::Header> written;
        for (const int part : parts_) written.push_back(header(part));
        if (!input_.facts.multi_part)
            return rewritten_.empty()
                       ? copy_single_part(stream, written[0], *input_.file)
                       : write_single_part(stream, written[0], rewritten_.at(0).planes);
        std::map<int, PartPlanes> planes;
        for (size_t i = 0; i < parts_.size(); ++i)
            if (const auto anew = rewritten_.find(parts_[i]); anew != rewritten_.end())
                planes[int(i)] = std::move(anew->second.planes);
        return write_multi_part(stream, written, planes, *input_.file, parts_);
    }

    ExrFile& file_;
    ExrFile::Impl& input_;
    const StoredFrame& frame_;
    const WriteOptions& options_;
    const bool grown_;
    const std::vector<int> parts_;      // that are written, by their index in the input
    std::vector<Imf::Header> headers_;  // of every part of the input
    std::map<int, RewrittenPart> rewritten_;
    EncodeCounts counts_;
    std::vector<std::string> notes_;
};

}  // namespace

Result<WriteReport> write_filtered(const std::string& path, PixelFile& file,
                                   const StoredFrame& frame, const FilteredLayer& color,
                                   const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers) try {
    WriteReport report;
    if (frame.kept == nullptr || frame.kept->part != color.part ||
        color.image->width != frame.window.width() ||
        color.image->height != frame.window.height() || color.image->channels != 4)
        return Status(StatusCode::internal, concat(path, ": color does not fit the frame"));
    RETURN_IF_ERROR(check_rewritable(file, {color.part, color.channels}, options));
    ASSIGN_OR_RETURN(auto notes,
                     check_settings(file.parts(), color.part, color.channels, options.exr));
    ASSIGN_OR_RETURN(const auto replaced, by_part(path, file, frame, color, layers));
    FilteredFile filtered(exr_of(file), frame, options, std::move(notes));
    filtered.leave_out_attributes_without_ranks();
    for (const auto& [part, of_part] : replaced) RETURN_IF_ERROR(filtered.replace(part, of_part));
    RETURN_IF_ERROR(filtered.write(path, report));
    return report;
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
