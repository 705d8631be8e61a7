#include "tools/service/work/preview.h"

#include <algorithm>
#include <limits>

#include "tools/measure/report/page/encode.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::service {
namespace {

// The frame that a request names, and the settings to read it.
struct NamedFrame {
    sequence::RunSettings settings;
    std::map<Role, std::string> files;
};
Result<NamedFrame> named_frame(const JobRequest& request, sequence::RunSettings settings) {
    settings.frames = io::FrameRange{{request.frame}};
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    const auto files = list.files.find(request.frame);
    if (files == list.files.end())
        return Status(StatusCode::input,
                      sequence::absent_files(request.frame, settings) + ": frame is not on disk");
    return NamedFrame{std::move(settings), files->second};
}

ImageF first_channels(const ImageF& image, int channels) {
    ImageF part(image.width, image.height, channels);
    for (size_t i = 0; i < image.pixels(); ++i)
        for (int c = 0; c < channels; ++c)
            part.data[i * size_t(channels) + size_t(c)] =
                image.data[i * size_t(image.channels) + size_t(c)];
    return part;
}

}  // namespace

Result<PreparedPreview> prepare_preview(JobRequest& request) {
    Chain& chain = request.chain.chain;
    ASSIGN_OR_RETURN(const auto named,
                     named_frame(request, sequence::settings_for(request.run, {&chain})));
    const sequence::RunSettings& settings = named.settings;
    sequence::SequenceReader reader(
        settings.source, settings.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.source, header, settings.plan);
        });
    ASSIGN_OR_RETURN(auto inputs, reader.open(request.frame, named.files));
    ASSIGN_OR_RETURN(auto source, reader.read(inputs));
    source.description.frame_number = request.frame;
    if (request.scale < 1) {
        sequence::reduce_frame(source, request.scale);
        sequence::reduce_lengths(chain, request.scale);
    }
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, source, settings.plan));
    return PreparedPreview{std::move(plan), std::move(source.planes)};
}

Result<ImageF> distances_of(const JobRequest& request) {
    ASSIGN_OR_RETURN(const auto named, named_frame(request, request.run));
    ASSIGN_OR_RETURN(auto header, sequence::open_source_frame(named.settings.source, named.files,
                                                              request.frame));
    const RoleSet depth = {Role::inverse_depth};
    ASSIGN_OR_RETURN(auto source,
                     sequence::read_source_frame(named.settings.source, std::move(header), depth,
                                                 io::Keep::nothing));
    if (!source.planes.contains(Role::inverse_depth))
        return Status(StatusCode::input, named.settings.input.color().format(request.frame) +
                                             ": the frame has no depth; type the focus distance");
    if (request.scale < 1) sequence::reduce_frame(source, request.scale);
    ImageF distances = *source.planes.at(Role::inverse_depth);
    for (float& v : distances.data)
        v = is_infinitely_far(v) ? std::numeric_limits<float>::infinity() : 1 / v;
    return distances;
}

Result<std::string> bytes_of(const ImageF& color, const std::string& type) {
    if (type == report::kPictureType)
        return report::picture_file(color.channels > 3 ? first_channels(color, 3) : color);
    if (type == kExrType)
        return color.channels == 1 ? io::planes_exr_bytes(color, {"Z"})
                                   : io::planes_exr_bytes(color, {"R", "G", "B", "A"});
    return io::encode_png_preview(color);
}

Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageWanted& wanted) {
    ASSIGN_OR_RETURN(auto header,
                     sequence::open_source_frame(settings, {{Role::color, path}}, frame));
    ASSIGN_OR_RETURN(auto source, sequence::read_source_frame(settings, std::move(header), {},
                                                              io::Keep::nothing));
    const ImageF& color = *source.planes.at(Role::color);
    const double scale = std::min(1.0, double(wanted.side) / std::max(color.width, color.height));
    if (scale == 1) return bytes_of(color, wanted.type);
    return bytes_of(sequence::mean_reduced(color, sequence::reduced_side(color.width, scale),
                                           sequence::reduced_side(color.height, scale)),
                    wanted.type);
}

}  // namespace postchain::service
