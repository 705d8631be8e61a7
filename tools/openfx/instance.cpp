#include "tools/openfx/instance.h"

#include <chrono>

#include "chain/base/text.h"
#include "tools/openfx/device.h"
#include "tools/sequence/source/file_convention.h"

namespace postchain::openfx {
namespace {

Moment moment_of(Properties in) {
    Moment moment;
    moment.time = in.number(kPropTime, 0, 0);
    moment.scale_x = in.number(kPropRenderScale, 0, 1);
    moment.scale_y = in.number(kPropRenderScale, 1, 1);
    return moment;
}

// The reasons why passes and steps are left out, one a line.
std::string elisions_of(const Plan& plan) {
    std::string text;
    for (const Elision& elision : plan.elisions)
        if (elision.kind == ElisionKind::pass)
            text +=
                concat("left out: ", item_text(elision, plan), ": ", text_of(elision.fact), "\n");
    for (const auto& [neighbor, why] : plan.missing_neighbors)
        text += concat("without the frame ", name_of(neighbor), ": ", why, "\n");
    return text;
}

std::string health_of(const InputHealth& health, RoleSet planes) {
    std::string text;
    const auto count = [&](uint64_t pixels, const char* what) {
        if (pixels) text += concat(pixels, " pixels ", what, "\n");
    };
    count(health.nonfinite_color, "with non-finite color were replaced");
    count(health.nonfinite_depth, "with non-finite depth are treated as infinitely far");
    count(health.negative_depth, "with depth <= 0 are treated as infinitely far");
    count(health.nonfinite_motion, "with non-finite motion are treated as static");
    if (planes.has(Role::motion) && health.motion_all_zero)
        text += "every motion vector is zero: there is no motion blur\n";
    return text;
}

bool is_left_out(const Plan& plan) {
    return plan.steps.empty();
}

}  // namespace

void Instance::created() {
    refresh(0);
}

Result<Node> Instance::node_at(Properties in) {
    return node_at(moment_of(in));
}

void Instance::set_status(const std::string& text) {
    const std::lock_guard lock(mutex_);
    report_ = as_keys(text);
}

// A host shows one message on a node.
void Instance::show(const char* type, const std::string& text) {
    const MessageSuite* messages = suites().messages;
    const std::lock_guard lock(mutex_);
    const std::string wanted = text.empty() ? "" : concat(type, ": ", as_keys(text));
    if (!messages || wanted == shown_) return;
    shown_ = wanted;
    if (text.empty())
        messages->clear_persistent(effect_);
    else
        messages->set_persistent(effect_, type, "", "%s", as_keys(text).c_str());
}

HostStatus Instance::conclude(const Status& status) {
    if (status.code() == StatusCode::canceled) return kFailed;
    if (!status.ok()) {
        set_status(status.message());
        show(kMessageError, status.message());
        return status.code() == StatusCode::memory ? kOutOfMemory : kFailed;
    }
    std::string warning;
    {
        const std::lock_guard lock(mutex_);
        warning = warning_;
    }
    show(kMessageWarning, warning);
    return kOk;
}

HostStatus Instance::clip_preferences(Properties out) {
    const auto node = node_at(Moment{});
    out.set(kPropFrameVarying, int(node.ok() && node->varies()));
    return kOk;
}

HostStatus Instance::region_of_definition(Properties in, Properties out) {
    const auto node = node_at(in);
    if (!node.ok()) return kReplyDefault;
    const Region region = node->region();
    out.set(kPropRegionOfDefinition, {region.x1, region.y1, region.x2, region.y2});
    return kOk;
}

// Every pixel may receive light from any other of the frame.
HostStatus Instance::regions_of_interest(Properties in, Properties out) {
    const auto node = node_at(in);
    if (!node.ok()) return kReplyDefault;
    const Region region = node->region();
    for (size_t i = 0; i < kClips; ++i)
        if (type_->has(Clip(i)))
            out.set(std::string(kPropRegionOfClip) + kClipNames[i],
                    {region.x1, region.y1, region.x2, region.y2});
    return kOk;
}

HostStatus Instance::frames_needed(Properties in, Properties out) {
    const auto node = node_at(in);
    if (!node.ok()) return kReplyDefault;
    const double time = moment_of(in).time;
    for (size_t i = 0; i < kClips; ++i) {
        if (!type_->has(Clip(i))) continue;
        double first = time, last = time;
        for (const int offset : node->frames_of(Clip(i))) {
            first = std::min(first, time + offset);
            last = std::max(last, time + offset);
        }
        out.set(std::string(kPropFramesOfClip) + kClipNames[i], {first, last});
    }
    return kOk;
}

// Without pixels: what parameters alone leave out. What the pixels leave out is found when the
// frame is rendered, which then copies Source.
HostStatus Instance::is_identity(Properties in, Properties out) {
    const auto node = node_at(in);
    if (!node.ok()) return kReplyDefault;
    FrameDescription frame = node->description();
    frame.planes = node->wanted();
    for (const ChainLink& link : node->chain().links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0;
    const auto plan = make_plan(node->chain(), frame, {});
    if (!plan.ok() || !is_left_out(*plan)) return kReplyDefault;
    set_status(elisions_of(*plan));
    out.set(kPropName, kSourceClip);
    out.set(kPropTime, moment_of(in).time);
    return conclude(Status());
}

Result<ImageF> Instance::filter(const Node& node, const Node::Frame& frame) {
    PlanOptions options;
    ASSIGN_OR_RETURN(auto plan, node.plan(frame.description, options));
    const auto start = std::chrono::steady_clock::now();
    std::string report = elisions_of(plan);
    ImageF color;
    if (is_left_out(plan)) {
        color = *frame.planes.at(Role::color);
    } else {
        RETURN_IF_ERROR(run_on_device(
            [&](Executor& executor, const gl::Device& device) {
                options.device = executor.device_class();
                if (options.device != DeviceClass::software) {
                    ASSIGN_OR_RETURN(plan, node.plan(frame.description, options));
                }
                ASSIGN_OR_RETURN(auto planes, executor.filter(plan, frame.planes));
                color = std::move(planes.at(Role::color));
                report = concat("filtered on ", device.renderer, "\n") + report;
                return Status();
            },
            [this] { return suites().effects->abort(effect_) != 0; }));
    }
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::steady_clock::now() - start);
    report =
        concat("frame ", frame.description.frame_number, " of ", frame.description.display_width,
               "x", frame.description.display_height, ": ", ms.count(), " ms\n") +
        report + health_of(frame.health, frame.description.planes);
    for (const std::string& note : frame.notes) report += note + "\n";
    const std::lock_guard lock(mutex_);
    report_ = report + signs_;
    return color;
}

void Instance::check_signs_once(const Node& node, const Node::Frame& frame) {
    const Values values(effect_, 0);
    std::string warning, signs;
    if (values.has(kCheckMotion) && values.boolean(kCheckMotion)) {
        const auto next = frame.planes.find(Role::color_after);
        const std::string conventions = node.conventions().text();
        {
            const std::lock_guard lock(mutex_);
            if (checked_ == conventions) return;
        }
        if (next == frame.planes.end() || !frame.planes.contains(Role::motion)) return;
        const SignCheck check = check_signs(PlaneView(frame.planes), *next->second);
        signs = check.candidates.empty()
                    ? concat("signs of the motion vectors: not checked: ", check.why_not, "\n")
                    : concat("signs of the motion vectors: ", name_of(check.verdict()),
                             ", by a factor of ", check.margin(), "\n");
        if (check.verdict() == SignVerdict::contradicted)
            warning = concat("the next frame contradicts the motion vectors: ", check.remedy(),
                             " (here: ", kMotionMeaning, ", ", kMotionChannels, ", ", kMotionScale,
                             "); switch off ", kCheckMotion, " to dismiss this");
        const std::lock_guard lock(mutex_);
        checked_ = check.candidates.empty() ? "" : conventions;
        signs_ = signs;
        warning_ = warning;
        return;
    }
    const std::lock_guard lock(mutex_);
    checked_.clear();
    signs_.clear();
    warning_.clear();
}

Status Instance::render_frame(Properties in) {
    const std::string field = in.text(kPropFieldToRender);
    if (field == kFieldLower || field == kFieldUpper)
        return input_error("fields are not filtered; deinterlace Source");
    ASSIGN_OR_RETURN(const Node node, node_at(in));
    ASSIGN_OR_RETURN(const auto frame, node.read_frame());
    check_signs_once(node, frame);
    ASSIGN_OR_RETURN(ImageF color, filter(node, frame));
    ClipHandle clip = nullptr;
    suites().effects->get_clip(effect_, kOutputClip, &clip, nullptr);
    auto output = HostImage::fetch(clip, moment_of(in).time);
    if (!output) return Status(StatusCode::output, "Output: the host has no image for the result");
    RETURN_IF_ERROR(output->check(kOutputClip));
    if (output->unpremultiplied() && frame.options.unpremultiplied)
        sequence::to_file_convention(color, frame.options, frame.stored);
    const Bounds asked = {in.integer(kPropRenderWindow, 0, 0), in.integer(kPropRenderWindow, 1, 0),
                          in.integer(kPropRenderWindow, 2, 0), in.integer(kPropRenderWindow, 3, 0)};
    const Bounds window = asked.intersected(output->bounds());
    if (window.empty()) return Status();
    const size_t channels = size_t(output->channels());
    std::vector<float> row(size_t(window.width()) * channels);
    const Bounds& filled = node.window();
    for (int y = window.y1; y < window.y2; ++y) {
        std::fill(row.begin(), row.end(), 0.0f);
        for (int x = window.x1; x < window.x2; ++x) {
            if (!filled.contains({x, y, x + 1, y + 1})) continue;
            const float* pixel = color.pixel(x - filled.x1, filled.y2 - 1 - y);
            float* to = row.data() + size_t(x - window.x1) * channels;
            if (channels == 1)
                *to = pixel[3];
            else
                std::copy_n(pixel, channels, to);
        }
        output->write(window.x1, y, window.width(), row.data());
    }
    return Status();
}

HostStatus Instance::render(Properties in) try { return conclude(render_frame(in)); } catch (...) {
    return conclude(status_of_exception("rendering a frame"));
}

Status Instance::check(double time) {
    ASSIGN_OR_RETURN(const Node node, node_at(Moment{time}));
    ASSIGN_OR_RETURN(const auto frame, node.read_frame());
    check_signs_once(node, frame);
    ASSIGN_OR_RETURN(const Plan plan, node.plan(frame.description, {}));
    std::string report = concat("frame ", frame.description.frame_number, "\n", elisions_of(plan),
                                health_of(frame.health, frame.description.planes));
    for (const std::string& note : frame.notes) report += note + "\n";
    const std::lock_guard lock(mutex_);
    report_ = report + signs_;
    return Status();
}

// Grays out rows, and writes the status: parameters may be set in this action alone.
void Instance::refresh(double time) {
    const Values values(effect_, time);
    if (type_->pass) {
        const auto pass = type_->pass->create();
        for (const Parameter& row : type_->pass->parameters->rows()) {
            const auto value = value_of(values, row, {0, 0, 1, 1});
            if (value.ok() && row.check(*value).ok()) row.set(pass->parameters(), *value);
        }
        enable_rows(values, *type_->pass->parameters, pass->parameters());
    }
    for (const Parameter* row : camera_rows(*type_))
        if (values.has("use_" + row->key))
            values.enable(row->key, values.boolean("use_" + row->key));
    std::string status;
    {
        const std::lock_guard lock(mutex_);
        status = report_;
    }
    values.set_text(kStatus, status);
}

void Instance::changed(Properties in) {
    const std::string name = in.text(kPropName);
    const double time = in.number(kPropTime, 0, 0);
    if (name == kStatus) return;
    if (name == kCheck) conclude(check(time));
    if (name == kCheckMotion && !Values(effect_, time).boolean(kCheckMotion)) {
        {
            const std::lock_guard lock(mutex_);
            warning_.clear();
            checked_.clear();
        }
        conclude(Status());
    }
    refresh(time);
}

}  // namespace postchain::openfx
