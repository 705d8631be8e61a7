#include "tools/service/work/preview.h"

#include <algorithm>
#include <cmath>

#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/reduced_frame.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::service {
namespace {

constexpr int kThumbnailSide = 320;

}  // namespace

Result<PreparedPreview> prepare_preview(JobRequest& request) {
    Chain& chain = request.chain.chain;
    sequence::RunSettings settings = sequence::settings_for(request.run, {&chain});
    settings.frames = io::FrameRange{{request.frame}};
    auto list = io::find_frames(settings.input, settings.frames);
    if (!list.ok()) return list.status();
    const auto files = list->files.find(request.frame);
    if (files == list->files.end())
        return Status(StatusCode::input,
                      settings.input.color().format(request.frame) + ": frame is not on disk");
    sequence::SequenceReader reader(
        settings.source, settings.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.source, header, settings.plan);
        });
    auto inputs = reader.open(request.frame, files->second);
    if (!inputs.ok()) return inputs.status();
    auto source = reader.read(*inputs);
    if (!source.ok()) return source.status();
    source->description.frame_number = request.frame;
    if (request.scale < 1) {
        sequence::reduce_frame(*source, request.scale);
        sequence::reduce_lengths(chain, request.scale);
    }
    auto plan = sequence::plan_source_frame(chain, *source, settings.plan);
    if (!plan.ok()) return plan.status();
    return PreparedPreview{std::move(*plan), std::move(source->planes)};
}

Result<std::string> thumbnail_png(const std::string& path, int frame,
                                  const sequence::SourceSettings& settings) {
    auto header = sequence::open_source_frame(settings, {{Role::color, path}}, frame);
    if (!header.ok()) return header.status();
    auto source = sequence::read_source_frame(settings, std::move(*header), {}, io::Keep::nothing);
    if (!source.ok()) return source.status();
    const ImageF& color = *source->planes.at(Role::color);
    const double scale =
        std::min(1.0, double(kThumbnailSide) / std::max(color.width, color.height));
    return io::encode_png_preview(
        sequence::mean_reduced(color, sequence::reduced_side(color.width, scale),
                               sequence::reduced_side(color.height, scale)));
}

}  // namespace postchain::service
