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

constexpr auto kKeepInterval = std::chrono::seconds(1);  // of edits that are not saved
constexpr auto kWatchInterval = std::chrono::milliseconds(500);
constexpr auto kRest = std::chrono::milliseconds(120);  // without changes, until a picture refines
constexpr double kDraftMs = 60;                         // time of a draft that is aimed at
constexpr double kMinScale = 1.0 / 8;
constexpr uint64_t kManyPixels = 1'000'000;
constexpr size_t kMessages = 50;
constexpr size_t kMissingListed = 10'000;
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

Session::Session(SessionSettings settings, std::function<void()> wake)
    : settings_(std::move(settings)),
      wake_(std::move(wake)),
      document_(builtin_passes(), settings_.chain.clone()),
      recovery_(settings_.recovery_folder, settings_.chain_name) {
    if (settings_.other) other_ = std::make_shared<const Chain>(settings_.other->clone());
    chain_text_ = settings_.chain_text;
    if (settings_.chain_is_file) chain_stamp_ = io::FileStamp::of(settings_.chain_name);
    if (!settings_.shaders.empty()) shader_stamp_ = stamp_of_folder(settings_.shaders);
    view_.display.view = settings_.run.view;
    kept_revision_ = document_.revision();
    const std::string left = recovery_.left();
    if (left.empty()) return;
    auto state = state_of_recovery(left, document_.registry());
    if (!state.ok()) {
        say(state.status().message(), true);
        return;
    }
    document_.restore(std::move(*state));
    say("restored edits of a viewer that ended before they were saved; undo leads back to the "
        "file");
}

Result<std::unique_ptr<Session>> Session::open(SessionSettings settings,
                                               std::function<void()> wake) {
    std::unique_ptr<Session> session(new Session(std::move(settings), wake));
    const SessionSettings& given = session->settings_;
    ASSIGN_OR_RETURN(session->worker_, FilterWorker::start(given.context, given.run.plan, wake));
    const uint64_t memory = given.memory > 0 ? given.memory : sequence::default_memory_limit() / 4;
    session->store_ = std::make_unique<FrameStore>(given.run, memory, wake);
    if (given.truth) session->truth_ = std::make_unique<FrameStore>(*given.truth, memory / 4, wake);
    session->painter_ = std::make_unique<Painter>(wake);
    if (!session->settings_.result_memory)
        session->settings_.result_memory = sequence::default_memory_limit() / 4;
    const auto frames = session->frames();
    if (frames.empty())
        session->say(concat(given.run.input.color().text(), ": ",
                            io::why_none(given.run.input.color()),
                            "; it is opened when its first frame exists"));
    session->frame_ = given.frame.value_or(frames.empty() ? 0 : frames.front());
    return session;
}

void Session::say(const std::string& words, bool error) {
    const std::string text = in_words_of_window(words);
    std::erase_if(messages_, [&](const Message& message) { return message.text == text; });
    messages_.push_back({error, text});
    if (messages_.size() > kMessages) messages_.pop_front();
}

std::string Session::trouble() const {
    if (!source_) {
        const Status status = store_->failure(frame_);
        return status.ok() ? "" : status.message();
    }
    return filter_status_.message();
}

std::string Session::picture_state() const {
    if (!trouble().empty()) {
        if (!shown_.color) return "";
        return shown_.frame == frame_ ? "as before" : concat("of frame ", shown_.frame);
    }
    if (at_rest()) return "refined";
    return shown_.draft ? "draft" : "...";
}

std::string Session::title() const {
    const auto name = [](const std::string& path) { return path.substr(path.rfind('/') + 1); };
    const bool edited = document_.changed() || document_.keys_changed();
    return concat(name(settings_.chain_name), edited ? "*" : "", "  ",
                  name(settings_.run.input.color().format(frame_)));
}

void Session::go_to(int frame) {
    const auto list = frames();
    if (list.empty()) return;
    const auto nearest = std::min_element(list.begin(), list.end(), [&](int a, int b) {
        return std::abs(a - frame) < std::abs(b - frame);
    });
    if (*nearest == frame_) return;
    direction_ = *nearest < frame_ ? -1 : 1;
    frame_ = *nearest;
}

void Session::step(int by) {
    const auto list = frames();
    if (list.empty()) return;
    auto at = std::lower_bound(list.begin(), list.end(), frame_) - list.begin();
    const auto count = std::ptrdiff_t(list.size());
    at = ((at + by) % count + count) % count;
    direction_ = by < 0 ? -1 : 1;
    frame_ = list[size_t(at)];
}

void Session::play(int direction) {
    playing_ = direction;
    filling_ = false;
    played_at_ = Clock::now();
}

void Session::set_fps(double fps) {
    fps_ = std::max(fps, 1.0);
}

void Session::set_range(std::optional<std::array<int, 2>> range) {
    if (range && (*range)[0] > (*range)[1]) std::swap((*range)[0], (*range)[1]);
    range_ = range;
}

std::vector<int> Session::frames_in_range() const {
    std::vector<int> list = frames();
    if (range_)
        std::erase_if(list,
                      [&](int frame) { return frame < (*range_)[0] || frame > (*range_)[1]; });
    return list;
}

std::vector<int> Session::missing_frames() const {
    const auto list = frames();
    std::vector<int> missing;
    for (size_t i = 1; i < list.size(); ++i)
        for (int frame = list[i - 1] + 1; frame < list[i] && missing.size() < kMissingListed;
             ++frame)
            missing.push_back(frame);
    return missing;
}

// The next frame is due if its time has come and this one is shown.
void Session::advance(Clock::time_point now) {
    if (filling_) return advance_filling();
    if (playing_ == 0 || ms_between(played_at_, now) < 1000 / fps_) return;
    const bool failed = source_ ? !filter_status_.ok() : !store_->failure(frame_).ok();
    const bool is_shown = shown_.frame == frame_ && shown_key_ == wanted_;
    if (!is_shown && !failed) return;
    const auto list = frames_in_range();
    if (list.empty()) return;
    played_at_ = now;
    ++frames_played_;
    direction_ = playing_;
    const auto after = std::upper_bound(list.begin(), list.end(), frame_);
    const auto at = std::lower_bound(list.begin(), list.end(), frame_);
    if (playing_ > 0)
        frame_ = after == list.end() ? list.front() : *after;
    else
        frame_ = at == list.begin() ? list.back() : *std::prev(at);
}

void Session::advance_filling() {
    const bool failed = source_ ? !filter_status_.ok() : !store_->failure(frame_).ok();
    const bool is_shown = shown_.frame == frame_ && shown_key_ == wanted_ && !shown_.draft;
    if (!is_shown && !failed) return;
    const std::set<int> kept = frames_with_result();
    const auto list = frames_in_range();
    const auto next = std::find_if(std::upper_bound(list.begin(), list.end(), frame_), list.end(),
                                   [&](int frame) { return !kept.contains(frame); });
    const uint64_t each = kept.empty() ? 0 : result_bytes() / kept.size();
    if (next != list.end() && result_bytes() + each <= *settings_.result_memory) {
        direction_ = 1;
        frame_ = *next;
        return;
    }
    if (next != list.end()) say(concat("memory holds ", kept.size(), " filtered frames"));
    filling_ = false;
    frame_ = filled_from_;
}

void Session::fill_results(bool on) {
    if (on == filling_) return;
    const auto list = frames_in_range();
    filling_ = on && !list.empty();
    playing_ = 0;
    if (!filling_) return;
    filled_from_ = frame_;
    frame_ = list.front();
}

uint64_t Session::chain_hash(int frame) const {
    if (std::exchange(hashed_revision_, document_.revision()) != document_.revision())
        hashes_.clear();
    // Without keys each frame has the same chain.
    const int by = document_.state().focus_keys.empty() ? 0 : frame;
    const auto found = hashes_.find(by);
    if (found != hashes_.end()) return found->second;
    const Chain chain = document_.chain_at(frame);
    return hashes_[by] = hash_text(chain.text(), hash_text(write_chain(chain)));
}

std::set<int> Session::frames_with_result() const {
    std::set<int> found;
    for (const auto& [frame, kept] : results_)
        if (kept.chain == chain_hash(frame) && kept.shaders == shaders_) found.insert(frame);
    return found;
}

uint64_t Session::result_bytes() const {
    uint64_t bytes = 0;
    for (const auto& [frame, kept] : results_) bytes += kept.bytes;
    return bytes;
}

void Session::keep_result() {
    const uint64_t version = store_->version(frame_);
    // The file may have changed since it was read; then the next scan reads it again.
    if (shown_.frame != frame_ || shown_key_ != wanted_ || wanted_.source != store_->find(frame_) ||
        wanted_.revision != document_.revision() || version == 0)
        return;
    KeptResult kept{.version = version,
                    .chain = chain_hash(frame_),
                    .shaders = shaders_,
                    .bytes = shown_.color->data.size() * sizeof(float),
                    .used = ++result_clock_,
                    .shown = shown_};
    if (kept.bytes > *settings_.result_memory) return;
    kept.shown.texture = nullptr;
    kept.shown.texture_name.clear();
    std::erase_if(results_, [&](const auto& entry) {
        return entry.first == frame_ &&
               (entry.second.version != version || entry.second.shaders != shaders_ ||
                entry.second.chain == kept.chain);
    });
    uint64_t bytes = result_bytes() + kept.bytes;
    while (bytes > *settings_.result_memory && !results_.empty()) {
        const auto oldest = std::min_element(
            results_.begin(), results_.end(),
            [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
        bytes -= oldest->second.bytes;
        results_.erase(oldest);
    }
    results_.emplace(frame_, std::move(kept));
}

// In place of filtering again.
void Session::show_kept_result() {
    const uint64_t version = store_->version(frame_), chain = chain_hash(frame_);
    const auto [begin, end] = results_.equal_range(frame_);
    const auto found = std::find_if(begin, end, [&](const auto& entry) {
        const KeptResult& kept = entry.second;
        return kept.version == version && kept.chain == chain && kept.shaders == shaders_;
    });
    if (found == end) return;
    found->second.used = ++result_clock_;
    shown_ = found->second.shown;
    shown_.request = request_id_;
    shown_.since = wanted_since_;
    shown_key_ = wanted_;
    draft_sent_ = full_sent_ = draft_seen_ = full_seen_ = true;
}

void Session::watch_files(Clock::time_point now) {
    if (now - watched_at_ < kWatchInterval) return;
    watched_at_ = now;
    if (settings_.chain_is_file) {
        io::FileStamp stamp = io::FileStamp::of(settings_.chain_name);
        if (stamp != chain_stamp_) {
            chain_stamp_ = std::move(stamp);
            reload_chain();
        }
    }
    if (settings_.shaders.empty()) return;
    if (const uint64_t stamp = stamp_of_folder(settings_.shaders); stamp != shader_stamp_) {
        shader_stamp_ = stamp;
        ++shaders_;
        say("shaders changed: " + settings_.shaders);
    }
}

void Session::keep_edits(Clock::time_point now) {
    if (recovery_.path().empty() || kept_revision_ == document_.revision() ||
        document_.in_gesture() || now - kept_at_ < kKeepInterval)
        return;
    kept_at_ = now;
    kept_revision_ = document_.revision();
    if (!document_.changed() && !document_.keys_changed()) return recovery_.discard();
    const Status status = save_text(settings_.run, recovery_.path(),
                                    recovery_text(document_.state()), "the recovery file", true);
    if (!status.ok()) say(status.message(), true);
}

void Session::discard_edits() {
    kept_revision_ = document_.revision();
    recovery_.discard();
}

void Session::reload_chain() {
    const auto text = read_text_file(settings_.chain_name, StatusCode::chain);
    if (!text.ok()) return say(text.status().message(), true);
    if (*text == chain_text_) return;
    ChainFile file = parse_chain(*text, settings_.chain_name, document_.registry(), settings_.sets);
    if (!file.status().ok()) {
        for (const auto& one : file.diagnostics)
            if (one.severity == Severity::error) say(one.text(), true);
        return say(settings_.chain_name + ": the chain stays as it was; mend the file");
    }
    io::ApertureFiles pictures;
    if (const Status status = pictures.read(file.chain.camera); !status.ok())
        return say(status.at("camera.aperture_image").message(), true);
    chain_text_ = *text;
    document_.replace(std::move(file.chain), "reload");
    document_.saved();
    say(settings_.chain_name + ": reloaded");
}

bool Session::tick(Clock::time_point now) {
    watch_files(now);
    keep_edits(now);
    advance(now);
    if (chain_of_ != document_.revision() || chain_frame_ != frame_ || !chain_) {
        chain_ = std::make_shared<const Chain>(document_.chain_at(frame_));
        chain_of_ = document_.revision();
        chain_frame_ = frame_;
    }
    if (const auto list = frames(); list.empty()) {
        source_ = nullptr;
    } else {
        // The first frame of a sequence that had none.
        if (!shown_.color && !settings_.frame &&
            !std::binary_search(list.begin(), list.end(), frame_))
            frame_ = list.front();
        store_->want(frame_, direction_, chain_);
        if (truth_ && compares_with(CompareTarget::truth)) truth_->want(frame_, direction_, chain_);
        source_ = store_->find(frame_);
    }
    bool changed = take_results(now);
    request(now);
    changed = paint_due(now) || changed;
    return changed;
}

bool Session::take_results(Clock::time_point now) {
    bool changed = false;
    for (FilterResult& result : worker_->take()) {
        changed = true;
        for (const std::string& text : result.messages) say(text, true);
        if (result.request.id == 0) {
            // A result for a former chain B or frame.
            if (result.request.chain != other_ || result.request.source != other_source_) continue;
            other_seen_ = other_revision_;
            other_sent_ = false;
            if (result.status.ok())
                other_image_ = result.color;
            else
                say("chain B: " + result.status.message(), true);
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
            say(result.status.message(), true);
            continue;
        }
        const double scale = result.request.scale;
        full_ms_ = result.milliseconds / (scale * scale);
        shown_key_ = current ? wanted_ : Key();
        shown_ = {.frame = result.request.source->description.frame_number,
                  .draft = draft,
                  .color = result.color,
                  .texture = result.texture,
                  .texture_name = result.request.texture,
                  .plan = result.plan,
                  .resolved = std::move(result.resolved),
                  .times = std::move(result.times),
                  .work_done = std::move(result.work_done),
                  .counters = result.counters,
                  .milliseconds = result.milliseconds,
                  .request = result.request.id,
                  .since = result.request.since};
        if (current && !draft) keep_result();
    }
    if (auto painted = painter_->take()) {
        changed = true;
        if (!painted->status.ok()) say(painted->status.message(), true);
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
    const Key key{source_, document_.revision(), texture_to_read(), shaders_};
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
    const double scale = filling_ ? 1 : draft_scale();
    if (!draft_sent_ && scale < 1) {
        draft_sent_ = true;
        return submit(scale);
    }
    const bool rests = !document_.in_gesture() && playing_ == 0 && now - wanted_since_ >= kRest;
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
    other_ = std::make_shared<const Chain>(document_.chain_at(frame_));
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

bool Session::paint_due(Clock::time_point) {
    const bool result = view_.plane == "result";
    SharedImage image = plane_image(view_.plane);
    // Before the first result, and if there is none, the frame as it is.
    if (result && source_ && (!image || !filter_status_.ok()))
        image = source_->planes.at(Role::color);
    if (!image) return false;
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
            const SharedFrame truth = truth_->find(frame_);
            if (truth) job.other = truth->planes.at(Role::color);
            if (const Status status = truth_->failure(frame_); !status.ok())
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
        job.visible = view_.visible;
    }
    if (view_.limits && source_) {
        const auto depth = source_->planes.find(Role::inverse_depth);
        if (const auto limits = sharp_limits(*this); limits && depth != source_->planes.end()) {
            job.inverse_depth = depth->second;
            job.sharp_from = (*limits)[0];
            job.sharp_to = (*limits)[1];
        }
    }
    PaintKey key{job.image,
                 job.other,
                 job.inverse_depth,
                 job.channel,
                 job.view.exposure_stops,
                 job.sharp_from,
                 job.sharp_to,
                 job.view.curve,
                 job.view.view,
                 job.map,
                 job.other ? job.visible : Rect(),
                 fault};
    if (key == paint_key_) return false;
    if (!fault.empty() && fault != paint_key_.fault) say(fault, true);
    paint_key_ = std::move(key);
    job.id = ++paint_id_;
    in_paint_ = {.job = result && image == shown_.color ? job.id : 0,
                 .request = shown_.request,
                 .draft = shown_.draft,
                 .since = shown_.since};
    painter_->submit(std::move(job));
    return false;
}

bool Session::at_rest() const {
    if (playing_ != 0 || filling_ || !painter_->idle() || !worker_->idle()) return false;
    if (!source_) return frames().empty() || !store_->failure(frame_).ok();
    if (!(wanted_.source == source_ && wanted_.revision == document_.revision() && full_seen_))
        return false;
    return !compares_with(CompareTarget::other_chain) || !other_ || other_seen_ == other_revision_;
}

Status Session::save_chain(const std::string& path, bool replace) {
    if (path.ends_with(".json"))
        return Status(StatusCode::output, path + ": chains are saved as YAML; name a .yaml file");
    ChainFileText saved = chain_file_text(chain_text_, document_);
    sequence::RunSettings settings = settings_.run;
    // The open chain file is the only input that is replaced by its own new text.
    std::erase_if(settings.other_inputs,
                  [&](const io::InputFile& file) { return file.path == settings_.chain_name; });
    bool own = settings_.chain_is_file && path == settings_.chain_name;
    if (own && !replace) {
        const auto text = read_text_file(path, StatusCode::chain);
        own = !text.ok() || *text == chain_text_;
    }
    RETURN_IF_ERROR(save_text(settings, path, saved.text, "the chain file", replace || own));
    chain_text_ = saved.text;
    settings_.chain_name = path;
    settings_.chain_is_file = true;
    chain_stamp_ = io::FileStamp::of(path);
    settings_.sets.clear();
    document_.saved(std::move(saved.off));
    say(path + (saved.kept ? ": saved" : ": saved, written anew below its first comments"));
    if (!document_.keys_changed()) discard_edits();
    if (document_.keys_changed())
        say("the focus keys are not in the chain file: save the camera file too");
    return Status();
}

}  // namespace postchain::view
