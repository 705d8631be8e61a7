#include "tools/apps/view/session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "passes/registry.h"
#include "tools/apps/view/chain_text.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/session_values.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/source/memory.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;

constexpr auto kWatchInterval = std::chrono::milliseconds(500);
constexpr auto kRest = std::chrono::milliseconds(120);  // without changes, until a picture refines
constexpr double kDraftMs = 60;                         // time of a draft that is aimed at
constexpr double kMinScale = 1.0 / 8;
constexpr uint64_t kManyPixels = 1'000'000;
constexpr size_t kLatencies = 200;

// Changes with the names, sizes and times of the files in a folder and below.
uint64_t stamp_of_folder(const std::string& folder) {
    uint64_t stamp = 1;
    std::error_code error;
    for (auto it = fs::recursive_directory_iterator(folder, error);
         !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
        if (!it->is_regular_file(error)) continue;
        const io::FileStamp file = io::FileStamp::of(it->path().string());
        // Independent of the order.
        stamp += hash_text(concat(file.path, " ", file.bytes, " ", file.time));
    }
    return stamp;
}

double ms_between(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
}

void keep(std::deque<double>& list, double value) {
    list.push_back(value);
    if (list.size() > kLatencies) list.pop_front();
}

}  // namespace

Session::Session(SessionSettings settings, std::unique_ptr<FilterWorker> worker,
                 const std::function<void()>& wake)
    : settings_(std::move(settings)),
      open_(std::move(settings_.open), settings_.run, messages_),
      store_(settings_.run, settings_.memory, wake),
      worker_(std::move(worker)),
      painter_(wake),
      playback_(store_, settings_.frame),
      results_(*settings_.result_memory) {
    if (settings_.truth)
        truth_ = std::make_unique<FrameStore>(*settings_.truth, settings_.memory / 4, wake);
    if (settings_.other) other_ = std::make_shared<const Chain>(settings_.other->clone());
    if (!settings_.shaders.empty()) shader_stamp_ = stamp_of_folder(settings_.shaders);
    view_.display.view = settings_.run.view;
    const io::PathPattern& color = settings_.run.input.color();
    if (playback_.frames().empty())
        messages_.say(concat(color.text(), ": ", io::why_none(color),
                             "; it is opened when its first frame exists"));
}

Result<std::unique_ptr<Session>> Session::open(SessionSettings settings,
                                               std::function<void()> wake) {
    ASSIGN_OR_RETURN(auto worker, FilterWorker::start(settings.context, settings.run.plan, wake));
    const uint64_t quarter = sequence::default_memory_limit() / 4;
    if (settings.memory == 0) settings.memory = quarter;
    if (!settings.result_memory) settings.result_memory = quarter;
    return std::unique_ptr<Session>(new Session(std::move(settings), std::move(worker), wake));
}

std::string Session::trouble() const {
    if (!source_) {
        const Status status = store_.failure(playback_.frame());
        return status.ok() ? "" : in_words_of_window(status.message());
    }
    return in_words_of_window(filter_status_.message());
}

std::string Session::picture_state() const {
    if (!trouble().empty()) {
        if (!shown_.color) return "";
        return shown_.frame == playback_.frame() ? "as before" : concat("of frame ", shown_.frame);
    }
    if (at_rest()) return "refined";
    return shown_.draft ? "draft" : "...";
}

std::string Session::title() const {
    const auto name = [](const std::string& path) { return path.substr(path.rfind('/') + 1); };
    return concat(name(open_.name()), document().unsaved() ? "*" : "", "  ",
                  name(settings_.run.input.color().format(playback_.frame())));
}

// The next frame is due if this one is shown.
void Session::advance(Clock::time_point now) {
    if (!playback_.filling() && playback_.playing() == 0) return;
    const bool failed = source_ ? !filter_status_.ok() : !store_.failure(playback_.frame()).ok();
    const bool is_shown = shown_.frame == playback_.frame() && shown_key_ == wanted_;
    if (!failed && !(is_shown && !(playback_.filling() && shown_.draft))) return;
    if (!playback_.filling()) return playback_.play_on(now);
    const std::set<int> kept = frames_with_result();
    const uint64_t each = kept.empty() ? 0 : results_.bytes() / kept.size();
    if (!playback_.fill_on(kept, results_.bytes() + each <= results_.budget()))
        messages_.say(concat("memory holds ", kept.size(), " filtered frames"));
}

ResultKey Session::result_key() const {
    const int frame = playback_.frame();
    return {frame, store_.version(frame), document().hash_at(frame), shaders_};
}

std::set<int> Session::frames_with_result() const {
    std::set<int> found;
    for (const ResultKey& key : results_.keys())
        if (key.chain == document().hash_at(key.frame) && key.shaders == shaders_)
            found.insert(key.frame);
    return found;
}

void Session::keep_result() {
    const ResultKey key = result_key();
    // The file may have changed since it was read; then the next scan reads it again.
    if (shown_.frame == key.frame && shown_key_ == wanted_ &&
        wanted_.source == store_.find(key.frame) && wanted_.revision == document().revision() &&
        key.version != 0)
        results_.keep(key, shown_);
}

// In place of filtering again.
void Session::show_kept_result() {
    const Shown* kept = results_.find(result_key());
    if (!kept) return;
    shown_ = *kept;
    shown_.request = request_id_;
    shown_.since = wanted_since_;
    shown_key_ = wanted_;
    draft_sent_ = full_sent_ = draft_seen_ = full_seen_ = true;
}

void Session::watch_files(Clock::time_point now) {
    if (now - watched_at_ < kWatchInterval) return;
    watched_at_ = now;
    open_.reload_if_changed();
    if (settings_.shaders.empty()) return;
    if (const uint64_t stamp = stamp_of_folder(settings_.shaders); stamp != shader_stamp_) {
        shader_stamp_ = stamp;
        ++shaders_;
        messages_.say("shaders changed: " + settings_.shaders);
    }
}

bool Session::tick(Clock::time_point now) {
    watch_files(now);
    open_.keep_edits(now);
    advance(now);
    const auto list = playback_.frames();
    // The first frame of a sequence that had none.
    if (!list.empty() && !shown_.color && !settings_.frame &&
        !std::binary_search(list.begin(), list.end(), playback_.frame()))
        playback_.go_to(list.front());
    const int frame = playback_.frame();
    if (chain_of_ != document().revision() || chain_frame_ != frame || !chain_) {
        chain_ = std::make_shared<const Chain>(document().chain_at(frame));
        chain_of_ = document().revision();
        chain_frame_ = frame;
    }
    source_ = nullptr;
    if (!list.empty()) {
        store_.want(frame, playback_.direction(), chain_);
        if (truth_ && compares_with(CompareTarget::truth))
            truth_->want(frame, playback_.direction(), chain_);
        source_ = store_.find(frame);
    }
    const bool changed = take_results(now);
    request(now);
    submit_paint();
    return changed;
}

bool Session::take_results(Clock::time_point now) {
    bool changed = false;
    for (FilterResult& result : worker_->take()) {
        changed = true;
        for (const std::string& text : result.messages) messages_.say(text, true);
        if (result.request.id == 0) {
            // A result for a former chain B or frame.
            if (result.request.chain != other_ || result.request.source != other_source_) continue;
            other_seen_ = other_revision_;
            other_sent_ = false;
            if (result.status.ok())
                other_image_ = result.color;
            else
                messages_.say("chain B: " + result.status.message(), true);
            continue;
        }
        // During a drag each result is of a former value, and shown nevertheless.
        const bool current = result.request.id == request_id_;
        if (!current && (result.request.id < shown_.request || !result.status.ok())) continue;
        const bool draft = result.request.scale < 1;
        if (current) {
            (draft ? draft_seen_ : full_seen_) = true;
            draft_seen_ = true;
            filter_status_ = result.status;
        }
        if (!result.status.ok()) {
            // Another scale would fail as well.
            full_sent_ = full_seen_ = true;
            messages_.say(result.status.message(), true);
            continue;
        }
        const double scale = result.request.scale;
        full_ms_ = result.milliseconds / (scale * scale);
        shown_key_ = current ? wanted_ : Key();
        shown_ = {std::move(static_cast<Filtered&>(result)),
                  result.request.source->description.frame_number,
                  draft,
                  result.request.texture,
                  result.request.id,
                  result.request.since};
        if (current && !draft) keep_result();
    }
    if (auto painted = painter_.take()) {
        changed = true;
        if (!painted->status.ok()) messages_.say(painted->status.message(), true);
        if (painted->id == in_paint_.job && painted->image) {
            const double ms = ms_between(in_paint_.since, now);
            if (std::exchange(first_seen_, in_paint_.request) != in_paint_.request)
                keep(latencies_.draft, ms);
            if (!in_paint_.draft &&
                std::exchange(refined_seen_, in_paint_.request) != in_paint_.request)
                keep(latencies_.refined, ms);
        }
        if (!painted->image) painted->image = painted_.image;
        painted_ = std::move(*painted);
        ++painted_revision_;
    }
    return changed;
}

double Session::draft_scale() const {
    if (full_ms_ <= 0)  // of an unknown chain
        return source_ && source_->description.pixels() > kManyPixels ? 0.25 : 0.5;
    const double fitting = std::sqrt(kDraftMs / full_ms_);
    double scale = 1;
    while (scale > kMinScale && scale > fitting) scale /= 2;
    return scale;
}

std::string Session::texture_to_read() const {
    const auto names = planes_of(*this);
    if (view_.plane == "result" ||
        std::find(names.begin(), names.end(), view_.plane) != names.end())
        return "";
    return view_.plane;
}

void Session::request(Clock::time_point now) {
    if (!source_) return;
    const Key key{source_, document().revision(), texture_to_read(), shaders_};
    if (key != wanted_) {
        wanted_ = key;
        wanted_since_ = now;
        filter_status_ = Status();
        ++request_id_;
        draft_sent_ = full_sent_ = draft_seen_ = full_seen_ = false;
        if (key.texture.empty()) show_kept_result();
    }
    const auto submit = [&](double scale) {
        worker_->submit({.id = request_id_,
                         .source = source_,
                         .chain = chain_,
                         .scale = scale,
                         .texture = key.texture,
                         .may_stop = scale >= 1 && draft_scale() < 1,
                         .since = wanted_since_});
        other_sent_ = false;
    };
    const double scale = playback_.filling() ? 1 : draft_scale();
    if (!draft_sent_ && scale < 1) {
        draft_sent_ = true;
        return submit(scale);
    }
    const bool rests =
        !document().in_gesture() && playback_.playing() == 0 && now - wanted_since_ >= kRest;
    if (!full_sent_ && (scale >= 1 || (draft_seen_ && rests))) {
        draft_sent_ = full_sent_ = true;
        return submit(1);
    }
    if (full_seen_) request_other();
}

void Session::request_other() {
    if (!other_ || !compares_with(CompareTarget::other_chain)) return;
    if (other_source_ != source_ || other_shaders_ != shaders_) {
        other_source_ = source_;
        other_shaders_ = shaders_;
        ++other_revision_;
        other_image_ = nullptr;
        other_sent_ = false;
    }
    if (other_sent_ || other_seen_ == other_revision_ || !worker_->idle()) return;
    other_sent_ = true;
    worker_->submit(
        {.id = 0, .source = source_, .chain = other_, .scale = 1, .texture = "", .may_stop = true});
}

void Session::keep_as_other_chain() {
    other_ = std::make_shared<const Chain>(document().chain_at(playback_.frame()));
    other_source_ = nullptr;
    other_sent_ = false;
}

std::shared_ptr<const ImageF> Session::plane_image(const std::string& plane) const {
    if (plane == "result") return shown_.color;
    if (source_)
        for (const auto& [role, image] : source_->planes)
            if (name_of(role) == plane) return image;
    return shown_.texture_name == plane ? shown_.texture : nullptr;
}

void Session::submit_paint() {
    const bool result = view_.plane == "result";
    SharedImage image = plane_image(view_.plane);
    // Before the first result, and if there is none, the frame as it is.
    if (result && source_ && (!image || !filter_status_.ok()))
        image = source_->planes.at(Role::color);
    if (!image) return;
    PaintJob job;
    std::string fault;
    job.image = image;
    job.look = view_.plane == kFillMask ? Look::shares : look_of(image->channels);
    job.view = view_.display;
    job.channel = view_.channel;
    if (result && view_.compare != Compare::off && source_) {
        if (view_.target == CompareTarget::before) job.other = source_->planes.at(Role::color);
        if (view_.target == CompareTarget::other_chain) job.other = other_image_;
        if (view_.target == CompareTarget::truth && truth_) {
            const SharedFrame truth = truth_->find(playback_.frame());
            if (truth) job.other = truth->planes.at(Role::color);
            if (const Status status = truth_->failure(playback_.frame()); !status.ok())
                fault = "ground truth: " + status.message();
        }
        const FrameDescription& frame = source_->description;
        if (job.other && (job.other->width != frame.width || job.other->height != frame.height)) {
            fault = concat("ground truth: ", job.other->width, "x", job.other->height,
                           " pixels, the frame has ", frame.width, "x", frame.height,
                           "; give one of the same size");
            job.other = nullptr;
        }
        if (view_.compare == Compare::difference) job.map = view_.map;
        if (job.other) job.visible = view_.visible;
    }
    if (view_.limits && source_) {
        const auto depth = source_->planes.find(Role::inverse_depth);
        if (const auto limits = sharp_limits(*this); limits && depth != source_->planes.end()) {
            job.inverse_depth = depth->second;
            job.sharp_from = (*limits)[0];
            job.sharp_to = (*limits)[1];
        }
    }
    job.id = paint_job_.id;
    if (job == paint_job_ && fault == paint_fault_) return;
    if (!fault.empty() && fault != paint_fault_) messages_.say(fault, true);
    paint_fault_ = std::move(fault);
    ++job.id;
    in_paint_ = {.job = result && image == shown_.color ? job.id : 0,
                 .request = shown_.request,
                 .draft = shown_.draft,
                 .since = shown_.since};
    paint_job_ = job;
    painter_.submit(std::move(job));
}

bool Session::at_rest() const {
    if (playback_.playing() != 0 || playback_.filling() || !painter_.idle() || !worker_->idle())
        return false;
    if (!source_) return playback_.frames().empty() || !store_.failure(playback_.frame()).ok();
    if (!(wanted_.source == source_ && wanted_.revision == document().revision() && full_seen_))
        return false;
    return !compares_with(CompareTarget::other_chain) || !other_ || other_seen_ == other_revision_;
}

}  // namespace postchain::view
