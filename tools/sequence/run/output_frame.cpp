#include "tools/sequence/run/output_frame.h"
#include "tools/sequence/source/file_convention.h"

#include <cmath>
#include <deque>
#include <filesystem>

#include "chain/frame/layers.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/record/record.h"
#include "tools/sequence/record/sidecar.h"

namespace postchain::sequence {
namespace {

constexpr const char* kProvenanceAttribute = "postchain";

uint64_t count_nonfinite(const ImageF& image) {
    uint64_t count = 0;
    for (size_t pixel = 0; pixel < image.pixels(); ++pixel) {
        bool bad = false;
        for (int c = 0; c < image.channels; ++c)
            bad |= !std::isfinite(image.data[pixel * size_t(image.channels) + size_t(c)]);
        count += bad;
    }
    return count;
}

// Filtered layers, converted to the file's convention, and ranks. `images` holds their pixels; it
// is a deque so that they stay in place.
std::vector<io::FilteredLayer> layers_to_write(const SourceFrame& source, const FilteredView& view,
                                               std::deque<ImageF>& images) {
    std::vector<io::FilteredLayer> layers;
    const FrameLayers& found = source.header.layers;
    for (size_t i = 0; i < found.filtered.size() && !view.layers.empty(); ++i) {
        images.push_back(plane_of_stack(view.layers, int(i), view.color.height));
        layer_to_file_convention(images.back(), source.header.match.options, view.color);
        const RoleChannels& where = found.filtered[i].channels;
        layers.push_back({where.part, where.channels, &images.back(), false});
    }
    if (!found.fill_mask.empty())
        layers.push_back({.part = color_channels(source.header).part,
                          .channels = fill_mask_channels(found.fill_mask),
                          .image = &view.fill_mask,
                          .added = true});
    for (size_t i = 0; i < view.cryptomattes.size(); ++i) {
        for (size_t level = 0; level < found.cryptomattes[i].levels.size(); ++level) {
            const io::CryptoLevel& where = found.cryptomattes[i].levels[level];
            images.push_back(stored_level(view.cryptomattes[i], int(level)));
            layers.push_back(
                {where.part, {where.channels.begin(), where.channels.end()}, &images.back(), true});
        }
    }
    return layers;
}

// Pixels of an output with NaN or Inf in color or in a layer.
uint64_t count_nonfinite(const ImageF& color, const std::vector<io::FilteredLayer>& layers) {
    uint64_t count = count_nonfinite(color);
    for (const io::FilteredLayer& layer : layers)
        if (!layer.ids) count += count_nonfinite(*layer.image);
    return count;
}

// The images to write: all but the color of the frame's first view.
std::vector<io::FilteredLayer> all_to_write(FrameInFlight& frame, std::deque<ImageF>& images) {
    std::vector<io::FilteredLayer> all = layers_to_write(*frame.source, frame.filtered, images);
    for (size_t i = 0; i < frame.other_views.size(); ++i) {
        const SourceFrame& source = frame.source->other_views[i];
        FilteredView& view = frame.other_views[i];
        const auto layers = layers_to_write(source, view, images);
        all.insert(all.end(), layers.begin(), layers.end());
        if (source.header.match.options.unpremultiplied)
            to_file_convention(view.color, source.header.match.options, stored_color(source));
        const RoleChannels& where = color_channels(source.header);
        all.push_back({.part = where.part, .channels = where.channels, .image = &view.color});
    }
    return all;
}

// RunSettings::overflow; if unset, pictures of a display are clamped: JPEG, and a view of
// OpenColorIO. Light above white is no fault there.
io::HalfOverflow overflow_of(const std::string& path, const RunSettings& settings) {
    if (settings.overflow) return *settings.overflow;
    const io::ImageFormat* format = io::image_format_of(path);
    const auto& transfer = settings.picture.transfer;
    const bool display =
        format && (format->name == std::string_view("jpeg") ||
                   (transfer && std::holds_alternative<io::DisplayView>(*transfer)));
    return display ? io::HalfOverflow::clamp : io::HalfOverflow::refuse;
}

// The value that clamping stores: "the largest half, 65504".
std::string largest_text(const std::string& path) {
    return io::image_format_of(path) ? "the range of the format" : "the largest half, 65504";
}

io::WriteOptions write_options(const FrameReport& report, const RunSettings& settings,
                               const std::string& record) {
    io::WriteOptions options;
    options.overflow = overflow_of(report.output, settings);
    options.exr = settings.exr;
    options.window = report.window;
    options.attributes[kProvenanceAttribute] = report.provenance;
    options.attributes[kRecordAttribute] = record;
    return options;
}

// Writes an EXR with color only; the input has no other channels.
Result<io::WriteReport> write_new_exr(const std::string& path, const SourceFrame& source,
                                      const ImageF& result,
                                      const std::vector<io::FilteredLayer>& added,
                                      const io::WriteOptions& options) {
    io::PlanesFile file;
    const auto& names = color_channels(source.header).channels;
    for (size_t i = 0; i < names.size(); ++i)
        if (options.exr.takes(names[i]))
            file.channels.push_back(
                {names[i], options.exr.half ? io::PixelType::half : io::PixelType::float32, &result,
                 int(i)});
    for (const io::FilteredLayer& layer : added)
        for (size_t i = 0; i < layer.channels.size(); ++i)
            file.channels.push_back({layer.channels[i], io::PixelType::half, layer.image, int(i)});
    file.origin_x = source.header.window.min_x;
    file.origin_y = source.header.window.min_y;
    file.display_window = color_part(source.header).display_window;
    file.attributes["pixelAspectRatio"] = color_part(source.header).pixel_aspect;
    return io::write_planes_exr(path, file, options);
}

// Notes what the output lacks: channels other than the `color_channels` color channels, further
// pages.
Result<io::WriteReport> with_notes(Result<io::WriteReport> report, const io::PixelFile& input,
                                   size_t color_channels) {
    if (!report.ok()) return report;
    size_t channels = 0;
    for (const io::ExrPart& part : input.parts()) channels += part.channels.size();
    if (channels > color_channels)
        report->notes.push_back(concat(channels - color_channels,
                                       " channels other than color are not written to the output"));
    if (picture_of(input) && picture_of(input)->info().has_more)
        report->notes.push_back("the input has several pages; the output contains only the first");
    return report;
}

// Converts the frame's color `result`, of its window, linear and premultiplied, to the convention
// of the file at `path`. Returns its encoding if that is an image other than an EXR.
Result<std::optional<io::ImageEncoding>> to_output_convention(const std::string& path,
                                                              const SourceFrame& source,
                                                              ImageF& result,
                                                              const RunSettings& settings) {
    const io::PixelFile& color_file = source.header.files.color_file();
    const bool stored_unassociated = source.header.match.options.unpremultiplied;
    if (!io::image_format_of(path)) {
        if (stored_unassociated && !picture_of(color_file))
            to_file_convention(result, source.header.match.options, stored_color(source));
        return std::optional<io::ImageEncoding>();
    }
    ASSIGN_OR_RETURN(
        auto encoding,
        io::image_encoding(path, color_file, color_channels(source.header).channels.size(),
                           settings.picture));
    encoding.pixel_aspect = color_part(source.header).pixel_aspect;
    if (encoding.unassociated) {
        ConvertOptions unassociated;
        unassociated.unpremultiplied = true;
        to_file_convention(
            result, unassociated,
            stored_unassociated ? stored_color(source) : ImageF(result.width, result.height, 4));
    }
    return std::optional(std::move(encoding));
}

// Writes color, converted by to_output_convention(), in the format of the path's extension.
// `layers` as in io::write_filtered(); a new EXR can only have added ones.
Result<io::WriteReport> write_image(const std::string& path, const SourceFrame& source,
                                    const ImageF& result,
                                    const std::optional<io::ImageEncoding>& encoding,
                                    const std::vector<io::FilteredLayer>& layers,
                                    const io::OutputFiles& files, io::WriteOptions options) {
    ASSIGN_OR_RETURN(options.on_existing, files.permit(path));
    const FrameHeader& header = source.header;
    io::PixelFile& color_file = header.files.color_file();
    const RoleChannels& color = color_channels(header);
    if (encoding) {
        const ImageF shown = io::placed(result, header.window, color_part(header).display_window);
        auto report =
            io::write_picture(path, shown, *encoding, color_file.path(), color.part, options);
        return with_notes(std::move(report), color_file, color.channels.size());
    }
    if (picture_of(color_file))
        return with_notes(write_new_exr(path, source, result, layers, options), color_file,
                          color.channels.size());
    return io::write_filtered(path, color_file, source.stored,
                              {color.part, color.channels, &result}, options, layers);
}

Status write_preview(FrameReport& report, const RunSettings& settings, const io::OutputFiles& files,
                     const ImageF& color) {
    const std::string path = io::preview_path(report.output);
    ASSIGN_OR_RETURN(const auto permit, files.permit(path));
    io::PreviewOptions options;
    options.on_existing = permit;
    options.view = settings.view;
    options.provenance = report.preview_provenance;
    RETURN_IF_ERROR(io::write_png_preview(path, color, options));
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    report.written_bytes += error ? 0 : bytes;
    return Status();
}

Status write_sidecar(FrameReport& report, const FrameLayers& layers, const RunSettings& settings,
                     const io::OutputFiles& files) {
    const std::string text = sidecar_json(report, layers, settings.version);
    report.written_bytes += text.size();
    return files.put(sidecar_path(report.output), text);
}

}  // namespace

Status check_output(const FrameHeader& header, const FrameReport& report,
                    const RunSettings& settings) {
    const std::string& path = report.output;
    const io::WriteOptions options = write_options(report, settings, "");
    const io::PixelFile& color_file = header.files.color_file();
    if (settings.source.input_transfer && !picture_of(color_file))
        return Status(StatusCode::usage,
                      concat(color_file.path(),
                             ": {input_transfer} applies only to non-EXR inputs; "
                             "an EXR holds scene-linear light; leave it out"_keyed));
    const RoleChannels& color = color_channels(header);
    if (io::image_format_of(path)) {
        if (!header.match.other_views.empty())
            return Status(StatusCode::usage,
                          path +
                              ": {view=all} applies only to EXR outputs, which can hold several "
                              "views; write .exr, or name one view"_keyed);
        if (!header.layers.fill_mask.empty())
            return Status(StatusCode::usage,
                          path +
                              ": {fill_mask} applies only to EXR outputs, which can hold its "
                              "channels; write .exr"_keyed);
        if (!header.layers.filtered.empty() || header.layers.filtered_cryptomattes > 0)
            return Status(StatusCode::usage,
                          path +
                              ": {aovs} and {cryptomatte=filter} apply only to EXR outputs, "
                              "which can hold more than color; write .exr"_keyed);
        if (settings.exr.compression || settings.exr.half || !settings.exr.channels.empty())
            return Status(StatusCode::usage,
                          path +
                              ": {compression}, {half} and {channels} apply only to EXR outputs; "
                              "leave them out, or name an output that ends in .exr"_keyed);
        return io::image_encoding(path, color_file, color.channels.size(), settings.picture)
            .status();
    }
    if (settings.picture.transfer || settings.picture.bits != 0)
        return Status(
            StatusCode::usage,
            concat(path,
                   ": {output_transfer} and {bits} do not apply to EXR outputs, which hold "
                   "scene-linear light; write .tif with {bits=32}, or look at it with "
                   "{png=true}"_keyed));
    if (picture_of(color_file)) return io::check_new_exr(color_file, color, options);
    return io::check_rewritable(header.files.color_file(), color, options);
}

Status write_frame(const Chain& chain, const RunSettings& settings, const io::OutputFiles& files,
                   FrameInFlight& frame) {
    const auto start = Clock::now();
    FrameReport& report = frame.report;
    ImageF& color = frame.filtered.color;
    std::deque<ImageF> images;
    const auto layers = all_to_write(frame, images);
    ASSIGN_OR_RETURN(const auto encoding,
                     to_output_convention(report.output, *frame.source, color, settings));
    report.output_nonfinite = count_nonfinite(color, layers);
    if (report.output_nonfinite > 0 && settings.strict)
        return Status(StatusCode::health,
                      concat(report.output, ": ", report.output_nonfinite,
                             " non-finite output pixels under {strict=true}; not written"_keyed));
    io::WriteOptions options =
        write_options(report, settings, record_text(chain, settings, report));
    // Image, preview and sidecar are replaced together. The old sidecar is set aside first, so
    // that no image is beside another's, even if this process is killed before it writes its
    // own.
    std::optional<io::ReplaceLock> lock;
    options.before_commit = [&]() -> Status {
        RETURN_IF_ERROR(io::check_unchanged(report.stamps));
        ASSIGN_OR_RETURN(auto taken, io::ReplaceLock::take(report.output));
        lock.emplace(std::move(taken));
        if (const std::string sidecar = sidecar_path(report.output);
            settings.on_existing != io::OnExisting::fail && is_sidecar(sidecar))
            return lock->set_aside(sidecar);
        return Status();
    };
    ASSIGN_OR_RETURN(report.write, write_image(report.output, *frame.source, color, encoding,
                                               layers, files, std::move(options)));
    report.written_bytes += report.write.bytes;
    if (const uint64_t clamped = report.write.overflow_pixels)
        report.warnings.push_back(concat(report.output, ": ", clamped, " pixels clamped to ",
                                         largest_text(report.output)));
    if (const uint64_t bad = report.write.nonfinite_pixels)
        report.warnings.push_back(concat(report.output, ": ", bad,
                                         " result pixels are non-finite: Inf clamped to "
                                         "the channel's largest value, NaN to 0"));
    report.write_ms = milliseconds_since(start);
    if (settings.preview) RETURN_IF_ERROR(write_preview(report, settings, files, color));
    return settings.sidecar ? write_sidecar(report, frame.source->header.layers, settings, files)
                            : Status();
}

Result<io::WriteReport> write_view(const std::string& path, const SourceFrame& source,
                                   FilteredView& view, const RunSettings& settings,
                                   const io::OutputFiles& files) {
    FrameReport report;
    report.output = path;
    report.window = source.header.window;
    RETURN_IF_ERROR(check_output(source.header, report, settings));
    std::deque<ImageF> images;
    const auto layers = layers_to_write(source, view, images);
    io::WriteOptions options = write_options(report, settings, "");
    options.attributes.clear();
    ASSIGN_OR_RETURN(const auto encoding, to_output_convention(path, source, view.color, settings));
    return write_image(path, source, view.color, encoding, layers, files, std::move(options));
}

}  // namespace postchain::sequence
