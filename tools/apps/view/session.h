// One open chain over one sequence: joins document, frames, filter and paint. No window; tick()
// does what is due and never waits.
//
//   Document, frame --FilterRequest--> FilterWorker --> FilterResult --PaintJob--> Painter -->
//   Painted
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/chain_file.h"
#include "tools/apps/view/document.h"
#include "tools/apps/view/filter_worker.h"
#include "tools/apps/view/frame_store.h"
#include "tools/apps/view/paint.h"
#include "tools/apps/view/recovery.h"

namespace postchain::view {

using Clock = std::chrono::steady_clock;

struct SessionSettings {
    std::string chain_name;  // as given: a file or a shipped chain
    std::string chain_text;
    bool chain_is_file = false;
    std::vector<std::string> sets;  // of --set; hold for the file until it is saved
    Chain chain;
    sequence::RunSettings run;
    std::optional<sequence::RunSettings> truth;
    std::optional<Chain> other;  // compared with the chain
    egl::ContextOptions context;
    std::string shaders;  // folder that is watched; empty: none
    std::optional<int> frame;
    uint64_t memory = 0;                    // bytes for frames; 0: a quarter of the machine's
    std::optional<uint64_t> result_memory;  // for filtered frames; empty: a quarter as well
    std::string recovery_folder;  // for edits that are not saved; empty: they are not kept
};

enum class Compare { off, wipe, flip, difference };
enum class CompareTarget { before, other_chain, truth };

// Choices of what the window shows. Changed directly by the user interface.
struct ViewChoice {
    std::string plane = "result";  // "result", a name of planes(), kFillMask or a plan's texture
    io::PreviewOptions display;
    Compare compare = Compare::off;
    CompareTarget target = CompareTarget::before;
    std::string map = "flip";
    Channel channel = Channel::color;
    bool limits = false;  // of sharpness
    Rect visible;         // the part on screen, pixels of the frame
};

struct Message {
    bool error = false;
    std::string text;
};

// A result on the screen.
struct Shown {
    int frame = 0;
    bool draft = true;
    std::shared_ptr<const ImageF> color;
    std::shared_ptr<const ImageF> texture;
    std::string texture_name;
    std::shared_ptr<const Plan> plan;
    sequence::ResolvedValues resolved;
    std::vector<PassTime> times;
    std::vector<WorkDone> work_done;
    ExecutorCounters counters;
    double milliseconds = 0;
    uint64_t request = 0;
    Clock::time_point since;  // of the change that it answers
};

class Session {
  public:
    // Errors: those of FilterWorker::start(). `wake` may be called on any thread.
    static Result<std::unique_ptr<Session>> open(SessionSettings settings,
                                                 std::function<void()> wake);

    // True if something that is shown has changed.
    bool tick(Clock::time_point now = Clock::now());
    // Nothing is under way, and what is shown is refined.
    bool at_rest() const;

    Document& document() { return document_; }
    const Document& document() const { return document_; }
    ViewChoice& view() { return view_; }
    const ViewChoice& view() const { return view_; }

    int frame() const { return frame_; }
    void go_to(int frame);  // the nearest frame on disk
    void step(int frames);  // forth or back in the list, around its ends
    std::vector<int> frames() const { return store_->frames(); }
    // -1: backward, 0: stands, 1: forward.
    int playing() const { return playing_; }
    void play(int direction);
    // The frames between which play turns, and to which Home and End lead; empty: all.
    const std::optional<std::array<int, 2>>& range() const { return range_; }
    void set_range(std::optional<std::array<int, 2>> range);
    std::vector<int> frames_in_range() const;
    // Frames of the sequence's numbers that are not on disk.
    std::vector<int> missing_frames() const;

    // Filters every frame of the range once, so that play shows it refined; or stops that.
    void fill_results(bool on);
    bool filling() const { return filling_; }
    // The frames whose filtered images are kept, of this chain.
    std::set<int> frames_with_result() const;
    uint64_t result_bytes() const;
    // The steps that playing has taken in this session.
    int frames_played() const { return frames_played_; }
    void set_fps(double fps);  // at least 1
    double fps() const { return fps_; }

    // Null while it is read.
    SharedFrame source() const { return source_; }
    const Shown& shown() const { return shown_; }
    const Painted& painted() const { return painted_; }
    // Grows with painted().
    uint64_t painted_revision() const { return painted_revision_; }
    // The newest last; errors until they are mended or dismissed.
    const std::deque<Message>& messages() const { return messages_; }
    void say(const std::string& words, bool error = false);
    void clear_messages() { messages_.clear(); }
    // Why the picture is not of the current settings; empty: it is.
    std::string trouble() const;
    // The state of the picture: "refined", "draft", "..."; in trouble "of frame 2", or "as before"
    // the change.
    std::string picture_state() const;

    // The title of the window: "balanced.yaml*  shot.0012.exr"; the star: edits are not saved.
    std::string title() const;

    // Compares from now on with the chain as it is.
    void keep_as_other_chain();
    bool has_other_chain() const { return other_ != nullptr; }
    bool has_truth() const { return truth_ != nullptr; }

    // Writes the chain file, which is the open one from then on. Errors: those of new_file(), also
    // for the open file if another program has changed it.
    Status save_chain(const std::string& path, bool replace);
    // The edits are not wanted: nothing of them is kept.
    void discard_edits();
    const SessionSettings& settings() const { return settings_; }
    const std::string& renderer() const { return worker_->renderer(); }
    uint64_t frame_bytes() const { return store_->bytes(); }

    // From a change to the paint of its first picture, and of the refined one; ms, the last ones.
    struct Latencies {
        std::deque<double> draft, refined;
    };
    const Latencies& latencies() const { return latencies_; }

  private:
    Session(SessionSettings settings, std::function<void()> wake);
    // A request for the same has the same result.
    struct Key {
        SharedFrame source;
        uint64_t revision = 0;  // of the chain
        std::string texture;
        uint64_t shaders = 0;
        bool operator==(const Key&) const = default;
    };
    void watch_files(Clock::time_point now);
    void reload_chain();
    void show_kept_result();
    void keep_result();
    uint64_t chain_hash(int frame) const;
    void keep_edits(Clock::time_point now);
    void advance(Clock::time_point now);
    void advance_filling();
    bool take_results(Clock::time_point now);
    void request(Clock::time_point now);
    void request_other();
    bool paint_due(Clock::time_point now);
    double draft_scale() const;
    std::shared_ptr<const ImageF> plane_image(const std::string& plane) const;
    std::string texture_to_read() const;
    bool compares_with(CompareTarget target) const {
        return view_.compare != Compare::off && view_.target == target;
    }

    SessionSettings settings_;
    std::function<void()> wake_;
    Document document_;
    Recovery recovery_;
    uint64_t kept_revision_ = 0;  // of the document, in the recovery file
    Clock::time_point kept_at_;
    ViewChoice view_;
    std::shared_ptr<const Chain> other_;
    std::unique_ptr<FrameStore> store_, truth_;
    std::unique_ptr<FilterWorker> worker_;
    std::unique_ptr<Painter> painter_;

    int frame_ = 0;
    int direction_ = 1;
    SharedFrame source_;
    std::shared_ptr<const Chain> chain_;  // at this frame
    uint64_t chain_of_ = 0;               // the document's revision of `chain_`
    int chain_frame_ = 0;
    int playing_ = 0;
    std::optional<std::array<int, 2>> range_;
    bool filling_ = false;
    int filled_from_ = 0;
    int frames_played_ = 0;
    double fps_ = 24;
    Clock::time_point played_at_;

    Key wanted_;
    uint64_t request_id_ = 0;  // of `wanted_`; 0 is chain B's
    Clock::time_point wanted_since_;
    bool draft_sent_ = false, full_sent_ = false, draft_seen_ = false, full_seen_ = false;
    Shown shown_;
    Key shown_key_;
    Status filter_status_;
    double full_ms_ = 0;  // estimate of a whole frame

    // Refined images of frames.
    struct KeptResult {
        uint64_t version = 0, chain = 0, shaders = 0;  // FrameStore::version(), chain_hash()
        uint64_t bytes = 0, used = 0;
        Shown shown;
    };
    std::multimap<int, KeptResult> results_;  // by frame
    uint64_t result_clock_ = 0;
    mutable std::map<int, uint64_t> hashes_;  // of chains by frame, at `hashed_revision_`
    mutable uint64_t hashed_revision_ = 0;

    std::shared_ptr<const ImageF> other_image_;
    SharedFrame other_source_;
    uint64_t other_revision_ = 0, other_seen_ = 0;
    uint64_t other_shaders_ = 0;
    bool other_sent_ = false;

    Painted painted_;
    uint64_t painted_revision_ = 0;
    uint64_t paint_id_ = 0;
    struct PaintKey {
        SharedImage image, other, depth;
        Channel channel = Channel::color;
        double exposure = 0, from = 0, to = 0;
        io::ToneCurve curve = {};
        std::optional<io::DisplayView> ocio;
        std::string map;
        Rect visible;
        std::string fault;
        bool operator==(const PaintKey&) const = default;
    };
    PaintKey paint_key_;
    // The result in the newest paint job, whose latency is measured.
    struct InPaint {
        uint64_t job = 0, request = 0;
        bool draft = true;
        Clock::time_point since;
    };
    InPaint in_paint_;
    uint64_t first_seen_ = 0, refined_seen_ = 0;  // requests whose latency is known
    Latencies latencies_;

    std::deque<Message> messages_;
    io::FileStamp chain_stamp_;
    std::string chain_text_;
    uint64_t shader_stamp_ = 0, shaders_ = 0;
    Clock::time_point watched_at_;
};

}  // namespace postchain::view
