#include "tools/sequence/run/output_frame.h"

#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::sequence {
namespace {

// Writes an EXR with color only; the input has no other channels.
Result<io::WriteReport> write_new_exr(const std::string& path, const SourceFrame& source,
                                      const ImageF& result,
                                      const std::vector<io::FilteredLayer>& added,
                                      const io::WriteOptions& options) {
    io::PlanesFile file;
    const auto& names = source.input.assignment.at(Role::color).channels;
    for (size_t i = 0; i < names.size(); ++i)
        if (options.exr.takes(names[i]))
            file.channels.push_back(
                {names[i], options.exr.half ? io::PixelType::half : io::PixelType::float32, &result,
                 int(i)});
    for (const io::FilteredLayer& layer : added)
        for (size_t i = 0; i < layer.channels.size(); ++i)
            file.channels.push_back({layer.channels[i], io::PixelType::half, layer.image, int(i)});
    file.origin_x = source.input.window.min_x;
    file.origin_y = source.input.window.min_y;
    file.display_window = source.input.display_window;
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

}  // namespace

Status check_output(const FrameHeader& header, const std::string& path, const RunSettings& settings,
                    const io::WriteOptions& options) {
    const io::PixelFile& color_file = header.files.color_file();
    if (settings.source.input_transfer && !picture_of(color_file))
        return Status(StatusCode::usage,
                      concat(color_file.path(),
                             ": --input-transfer applies only to non-EXR inputs; "
                             "an EXR holds scene-linear light; leave it "
                             "out"));
    const RoleChannels& color = header.assignment.at(Role::color);
    if (io::image_format_of(path)) {
        if (!header.match.other_views.empty())
            return Status(StatusCode::usage,
                          path +
                              ": --view all applies only to EXR outputs, which can hold several "
                              "views; write .exr, or name one view");
        if (!header.layers.fill_mask.empty())
            return Status(StatusCode::usage,
                          path +
                              ": --fill-mask applies only to EXR outputs, which can hold its "
                              "channels; write .exr");
        if (!header.layers.filtered.empty() || header.layers.filtered_cryptomattes > 0)
            return Status(StatusCode::usage,
                          path +
                              ": --layers and --cryptomatte filter apply only to EXR outputs, "
                              "which can hold more than color; write .exr");
        if (settings.exr.compression || settings.exr.half || !settings.exr.channels.empty())
            return Status(
                StatusCode::usage,
                path + ": --compression, --half and --channels apply only to EXR outputs");
        return io::image_encoding(path, color_file, color.channels.size(), settings.picture)
            .status();
    }
    if (settings.picture.transfer || settings.picture.bits != 0)
        return Status(
            StatusCode::usage,
            concat(path,
                   ": --output-transfer and --bits do not apply to EXR outputs, which hold "
                   "scene-linear light; write .tif with --bits 32, or look at it with "
                   "--png"));
    if (picture_of(color_file)) return io::check_new_exr(color_file, color, options);
    return io::check_rewritable(header.files.color_file(), color, options);
}

Result<io::WriteReport> write_output(const std::string& path, SourceFrame& source, ImageF& result,
                                     const std::vector<io::FilteredLayer>& layers,
                                     const RunSettings& settings, const io::OutputFiles& files,
                                     io::WriteOptions options) {
    ASSIGN_OR_RETURN(options.on_existing, files.permit(path));
    const io::InputFrame& input = source.input;
    const io::PixelFile& color_file = input.files.color_file();
    const bool stored_unassociated = source.conversion.unpremultiplied;
    if (!io::image_format_of(path)) {
        if (picture_of(color_file))
            return with_notes(write_new_exr(path, source, result, layers, options), color_file,
                              source.input.assignment.at(Role::color).channels.size());
        if (stored_unassociated) to_file_convention(result, source.conversion, stored_color(input));
        return io::write_filtered(path, source.input, result, options, layers);
    }
    const RoleChannels& color = input.assignment.at(Role::color);
    ASSIGN_OR_RETURN(const auto encoding,
                     io::image_encoding(path, color_file, color.channels.size(), settings.picture));
    if (encoding.unassociated) {
        ConvertOptions unassociated;
        unassociated.unpremultiplied = true;
        to_file_convention(
            result, unassociated,
            stored_unassociated ? stored_color(input) : ImageF(result.width, result.height, 4));
    }
    const ImageF shown = io::placed(result, input.window, input.display_window);
    auto report = io::write_picture(path, shown, encoding, color_file.path(), color.part, options);
    return with_notes(std::move(report), color_file, color.channels.size());
}

io::HalfOverflow overflow_of(const std::string& path, const RunSettings& settings) {
    if (settings.overflow) return *settings.overflow;
    const io::ImageFormat* format = io::image_format_of(path);
    const auto& transfer = settings.picture.transfer;
    const bool display =
        format && (format->name == std::string_view("jpeg") ||
                   (transfer && std::holds_alternative<io::DisplayView>(*transfer)));
    return display ? io::HalfOverflow::clamp : io::HalfOverflow::refuse;
}

std::string largest_text(const std::string& path) {
    return io::image_format_of(path) ? "the range of the format" : "the largest half, 65504";
}

}  // namespace postchain::sequence
