#include "tools/service/preview/frame_images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "chain/pass/planner.h"
#include "tools/page/encode.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/reduced_lengths.h"
#include "tools/sequence/source/sequence_reader.h"
#include "tools/sequence/source/sequence_survey.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

constexpr uint64_t kFramesAtOnce = 4;  // that the memory for images has room for
constexpr int kStrips = 4;  // at a time: color is a fraction of what strip_rows() expects
// A pixel of an image in a reply: its color, half floats, and both packed, here and in the service.
constexpr uint64_t kShownBytes = 4 * sizeof(float) + 3 * 3 * sizeof(uint16_t);

// The frame that a request names, and the settings to read it.
struct NamedFrame {
    sequence::RunSettings settings;
    std::map<Role, std::string> files;
};
Result<NamedFrame> named_frame(const PreviewRequest& request, sequence::RunSettings settings) {
    settings.frames = io::FrameRange{{request.frame}};
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    const auto files = list.files.find(request.frame);
    if (files == list.files.end()) return sequence::absent_frame(request.frame, settings);
    return NamedFrame{std::move(settings), files->second};
}

struct PreparedPreview {
    Plan plan;
    SharedPlanes planes;
};

// Reads the request's frame with its neighbors and the chain's mattes, and reduces it: color and
// mattes by mean, depth and motion vectors by center pixel. Scales motion vectors and the passes'
// lengths in pixels. Errors: those of reading and planning.
Result<PreparedPreview> prepare_preview(PreviewRequest& request) {
    Chain& chain = request.chain;
    ASSIGN_OR_RETURN(const auto named,
                     named_frame(request, sequence::settings_for(request.run, {&chain})));
    const sequence::RunSettings& settings = named.settings;
    sequence::SequenceReader reader(
        settings.source, settings.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.source, header, settings.plan);
        });
    ASSIGN_OR_RETURN(auto opened, reader.open(request.frame, named.files));
    ASSIGN_OR_RETURN(auto source, reader.read(opened));
    source.description.frame_number = request.frame;
    if (request.scale < 1) {
        sequence::reduce_frame(source, request.scale);
        sequence::reduce_lengths(chain, request.scale);
    }
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, source, settings.plan));
    return PreparedPreview{std::move(plan), std::move(source.planes)};
}

// The distance to the surface at each pixel of the request's frame, scene units, reduced like the
// preview; infinity in the sky. Errors (input): those of reading, or the frame has no depth.
Result<ImageF> distances_of(const PreviewRequest& request) {
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

// A PNG, an EXR, or the values for a page (kPictureType).
Result<std::string> bytes_of(const ImageF& color, const std::string& type) {
    if (type == page::kPictureType) return page::picture_file(color);
    if (type == kExrType)
        return color.channels == 1 ? io::planes_exr_bytes(color, {"Z"})
                                   : io::planes_exr_bytes(color, {"R", "G", "B", "A"});
    return io::encode_png_preview(color);
}

}  // namespace

Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageForm& form,
                             const std::function<void(uint64_t bytes)>& enter) {
    ASSIGN_OR_RETURN(auto header,
                     sequence::open_source_frame(settings, {{Role::color, path}}, frame));
    const int width = header.window.width(), height = header.window.height();
    const double scale = std::min(1.0, double(form.side) / std::max(width, height));
    const int shown_width = sequence::reduced_side(width, scale);
    const int shown_height = sequence::reduced_side(height, scale);
    const auto bytes_of_rows = [&](int rows) {
        return sequence::frame_bytes(header, {Role::color}, io::Keep::nothing, rows) +
               kShownBytes * uint64_t(shown_width) * uint64_t(shown_height);
    };
    // Larger frames are read in strips, so that others have room beside them.
    const bool in_strips = scale < 1 && bytes_of_rows(height) > settings.max_memory / kFramesAtOnce;
    const int rows = in_strips ? std::min(height, kStrips * sequence::strip_rows(header)) : height;
    const uint64_t bytes = bytes_of_rows(rows);
    if (bytes > settings.max_memory && settings.max_memory > 0)
        return Status(StatusCode::memory, concat(path, ": needs ", sequence::bytes_text(bytes),
                                                 " of memory; images of this service may need ",
                                                 sequence::bytes_text(settings.max_memory),
                                                 "; request a smaller side, or render smaller"));
    enter(bytes);
    if (scale == 1) {
        ASSIGN_OR_RETURN(auto source, sequence::read_source_frame(settings, std::move(header), {},
                                                                  io::Keep::nothing));
        return bytes_of(*source.planes.at(Role::color), form.type);
    }
    std::optional<io::RowShrinker> small;
    RETURN_IF_ERROR(sequence::scan_source_frame(settings, header, {}, rows,
                                                [&](const FramePlanes& planes, int) {
                                                    const ImageF& color = planes.at(Role::color);
                                                    if (!small)
                                                        small.emplace(width, height, color.channels,
                                                                      shown_width, shown_height);
                                                    small->add(color);
                                                })
                        .status());
    return bytes_of(small->image(), form.type);
}

// ------------------------------------------------------------------------------------- previews
Status PreviewMaker::make_device() try {
    executor_.reset();
    ASSIGN_OR_RETURN(context_, egl::Context::create(device_));
    executor_ = std::make_unique<Executor>(context_->device());
    return run_test();
} catch (...) {
    return status_of_exception("the GL context");
}

std::string PreviewMaker::renderer() const {
    return context_ ? sequence::renderer_text(context_->device()) : "";
}

Status PreviewMaker::run_test() try {
    constexpr int kSide = 16;
    constexpr float kValue = 0.25f;
    Chain chain;
    if (!chain.append(registry_, "fxaa")) return Status();
    FrameDescription frame;
    frame.width = frame.height = frame.display_width = frame.display_height = kSide;
    frame.planes = {Role::color};
    PlanOptions options;
    options.elide = false;
    options.device = executor_->device_class();
    ASSIGN_OR_RETURN(auto plan, make_plan(chain, frame, options));
    FramePlanes planes;
    planes.emplace(Role::color, ImageF(kSide, kSide, 4, kValue));
    ASSIGN_OR_RETURN(auto result, executor_->filter(plan, planes));
    // An anti-aliasing filter keeps a uniform image.
    for (const float value : result.at(Role::color).data)
        if (!(std::abs(value - kValue) < 1e-3f))
            return Status(StatusCode::gl, concat("a test dispatch returned ", value, " instead of ",
                                                 kValue, "; the device is not reliable"));
    return Status();
} catch (...) {
    return status_of_exception("the test of the GL device");
}

Status PreviewMaker::test() {
    if (executor_ && run_test().ok()) return Status();
    // After a loss of the context a new one may work.
    const Status made = make_device();
    if (!made.ok()) executor_.reset();
    return made;
}

Result<std::string> PreviewMaker::preview(PreviewRequest& request,
                                          const std::function<bool()>& over) {
    ASSIGN_OR_RETURN(const auto color,
                     request.shows_depth ? distances_of(request) : filter(request, over));
    return bytes_of(color, request.type);
}

Result<ImageF> PreviewMaker::filter(PreviewRequest& request, const std::function<bool()>& over) {
    const Status canceled(StatusCode::canceled, "the preview was canceled");
    if (over()) return canceled;
    if (!executor_) RETURN_IF_ERROR(make_device());
    request.run.plan.device = executor_->device_class();
    ASSIGN_OR_RETURN(auto prepared, prepare_preview(request));
    if (over()) return canceled;
    const ContinueScope stop(*executor_,
                             [&] { return over() ? RunDecision::stop : RunDecision::go_on; });
    auto planes = executor_->filter(prepared.plan, prepared.planes);
    if (planes.ok()) return std::move(planes->at(Role::color));
    return planes.status();
}

}  // namespace postchain::service
