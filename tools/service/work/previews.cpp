#include "tools/service/work/previews.h"

#include <algorithm>
#include <future>
#include <limits>
#include <optional>

#include "tools/page/encode.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/contact_sheet.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/reduced_lengths.h"
#include "tools/sequence/source/sequence_reader.h"
#include "tools/sequence/source/sequence_survey.h"
#include "tools/service/work/preview_helper.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxWaiting = 64;
constexpr uint64_t kFramesAtOnce = 4;  // that the memory for images has room for
constexpr int kStrips = 4;  // at a time: color is a fraction of what strip_rows() expects
// A pixel of an image in a reply: its color, half floats, and both packed, here and in the service.
constexpr uint64_t kShownBytes = 4 * sizeof(float) + 3 * 3 * sizeof(uint16_t);
constexpr auto kTestPatience = std::chrono::seconds(1);

// The frame that a request names, and the settings to read it.
struct NamedFrame {
    sequence::RunSettings settings;
    std::map<Role, std::string> files;
};
Result<NamedFrame> named_frame(const JobRequest& request, sequence::RunSettings settings) {
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
Result<PreparedPreview> prepare_preview(JobRequest& request) {
    Chain& chain = request.chain.chain;
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

// A PNG, an EXR, or the values for a page (kPictureType).
Result<std::string> bytes_of(const ImageF& color, const std::string& type) {
    if (type == page::kPictureType) return page::picture_file(color);
    if (type == kExrType)
        return color.channels == 1 ? io::planes_exr_bytes(color, {"Z"})
                                   : io::planes_exr_bytes(color, {"R", "G", "B", "A"});
    return io::encode_png_preview(color);
}

}  // namespace

Problem too_many_previews() {
    return {Problem::Kind::busy, "too many previews are waiting; try again", {}, 1};
}

Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageWanted& wanted,
                             const std::function<void(uint64_t bytes)>& enter) {
    ASSIGN_OR_RETURN(auto header,
                     sequence::open_source_frame(settings, {{Role::color, path}}, frame));
    const int width = header.window.width(), height = header.window.height();
    const double scale = std::min(1.0, double(wanted.side) / std::max(width, height));
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
        return bytes_of(*source.planes.at(Role::color), wanted.type);
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
    return bytes_of(small->image(), wanted.type);
}

// -------------------------------------------------------------------------------- making them
Result<GlDevice*> PreviewMaker::device() {
    if (made_) return made_.get();
    ASSIGN_OR_RETURN(made_, GlDevice::create(device_, registry_));
    return made_.get();
}

Status PreviewMaker::test() {
    if (!made_) return device().status();
    if (made_->test().ok()) return Status();
    // After a loss of the context a new one may work.
    made_.reset();
    return device().status();
}

Result<std::string> PreviewMaker::preview(JobRequest& request, const Roots& roots,
                                          const std::string& type, const PreviewCalls& calls) {
    RETURN_IF_ERROR(check_inputs(request.run.input, roots));
    ASSIGN_OR_RETURN(const auto color, request.plane == PreviewPlane::depth
                                           ? distances_of(request)
                                           : filter(request, calls));
    return bytes_of(color, type);
}

Result<ImageF> PreviewMaker::filter(JobRequest& request, const PreviewCalls& calls) {
    const Status canceled(StatusCode::canceled, "the preview was canceled");
    if (calls.over()) return canceled;
    ASSIGN_OR_RETURN(auto device, this->device());
    // A software renderer takes the cores that reading needs.
    if (device->software()) calls.reserved();
    request.run.plan.device = device->executor().device_class();
    ASSIGN_OR_RETURN(auto prepared, prepare_preview(request));
    if (calls.over()) return canceled;
    if (!device->software()) calls.reserved();
    Executor& executor = device->executor();
    const ContinueScope stop(executor,
                             [&] { return calls.over() ? RunDecision::stop : RunDecision::go_on; });
    auto planes = executor.filter(prepared.plan, prepared.planes);
    if (planes.ok()) return std::move(planes->at(Role::color));
    return planes.status();
}

// ---------------------------------------------------------------------------------- their queue
Previews::Previews(const ServiceSettings& settings, uint64_t memory,
                   const egl::ContextOptions& device, const PassRegistry& registry,
                   DeviceGate& gate)
    : gate_(gate), threads_(1, kMaxWaiting) {
    if (settings.program.empty())
        maker_ = std::make_unique<PreviewMaker>(device, registry);
    else
        helper_ = std::make_unique<PreviewHelper>(settings, memory, ends_);
}

Previews::~Previews() {
    end();
}

Status Previews::begin() {
    RETURN_IF_ERROR(threads_.begin());
    std::promise<void> made;
    if (threads_.run([&] {
            (void)(helper_ ? helper_->test() : maker_->test());
            if (helper_) helper_->keep_programs();
            made.set_value();
        }))
        made.get_future().get();
    return Status();
}

bool Previews::run(const std::string& body, JobRequest request, const Roots& roots,
                   const PreviewWanted& wanted, std::function<void(Answer<Picture>)> done) {
    auto ticket = std::make_shared<Ticket>();
    ticket->stop = wanted.left ? wanted.left : std::make_shared<std::atomic<bool>>(false);
    if (!wanted.session.empty()) {
        const std::lock_guard lock(mutex_);
        std::erase_if(newest_, [](const auto& one) { return one.second.expired(); });
        auto& newest = newest_[wanted.session];
        if (const auto former = newest.lock()) {
            former->replaced = true;
            *former->stop = true;
        }
        newest = ticket;
    }
    // std::function must be copyable; a chain is not.
    const auto shared = std::make_shared<JobRequest>(std::move(request));
    const auto work = [this, body, shared, roots, type = wanted.type, ticket, done] {
        std::optional<DeviceGate::Reservation> reservation;
        const PreviewCalls calls = {[&] { return ends_ || *ticket->stop; },
                                    [&] { reservation.emplace(gate_); }};
        const auto made = [&]() -> Result<std::string> {
            try {
                if (calls.over()) return Status(StatusCode::canceled, "the preview was canceled");
                return helper_ ? helper_->preview(body, *shared, roots, type, calls)
                               : maker_->preview(*shared, roots, type, calls);
            } catch (...) {
                return status_of_exception("the preview");
            }
        }();
        if (ticket->replaced)
            done(Problem{Problem::Kind::conflict,
                         "a later preview of this session has replaced this one"});
        else if (made.ok())
            done(Picture{type, *made});
        else
            done(problem_of(made.status(), roots));
    };
    return threads_.run(work, {wanted.share, [done] { done(too_many_previews()); }});
}

std::optional<Status> Previews::test() {
    const auto promise = std::make_shared<std::promise<Status>>();
    auto tested = promise->get_future();
    // Without the gate, which clients without a token could then keep from the job.
    const bool taken = threads_.run([this, promise] {
        if (helper_) helper_->keep_programs();
        promise->set_value(helper_ ? helper_->test() : maker_->test());
    });
    if (!taken || tested.wait_for(kTestPatience) != std::future_status::ready) return std::nullopt;
    return tested.get();
}

size_t Previews::end() {
    ends_ = true;
    // The device's objects are deleted where its context is current.
    if (maker_) (void)threads_.run([this] { maker_->release(); });
    return threads_.end();
}

}  // namespace postchain::service
