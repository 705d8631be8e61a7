// One open chain over one sequence: asks the filter for the frame on screen, and paints its result.
// No window; tick() does what is due and never waits.
//
//   OpenChain, Playback --FilterRequest--> FilterWorker --> Shown --PaintJob--> Painter --> Painted
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/apps/view/open_chain.h"
#include "tools/apps/view/paint.h"
#include "tools/apps/view/result_store.h"

namespace postchain::view {

struct SessionSettings {
    ChainToOpen open;
    sequence::RunSettings run;
    std::optional<sequence::RunSettings> truth;
    std::optional<Chain> other;  // compared with the chain
    egl::ContextOptions context;
    std::string shaders;  // folder that is watched; empty: none
    std::optional<int> frame;
    uint64_t memory = 0;                    // bytes for frames; 0: a quarter of the machine's
    std::optional<uint64_t> result_memory;  // for filtered frames; empty: a quarter as well
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

class Session {
  public:
    // Errors: those of FilterWorker::start(). `wake` may be called on any thread.
    static Result<std::unique_ptr<Session>> open(SessionSettings settings,
                                                 std::function<void()> wake);

    // True if something that is shown has changed.
    bool tick(Clock::time_point now = Clock::now());
    // Nothing is under way, and what is shown is refined.
    bool at_rest() const;

    OpenChain& open_chain() { return open_; }
    const OpenChain& open_chain() const { return open_; }
    Document& document() { return open_.document(); }
    const Document& document() const { return open_.document(); }
    Playback& playback() { return playback_; }
    const Playback& playback() const { return playback_; }
    ViewChoice& view() { return view_; }
    const ViewChoice& view() const { return view_; }
    Messages& messages() { return messages_; }
    const Messages& messages() const { return messages_; }

    // The frames whose filtered images are kept, of this chain.
    std::set<int> frames_with_result() const;
    const ResultStore& results() const { return results_; }

    // Null while it is read.
    SharedFrame source() const { return source_; }
    const Shown& shown() const { return shown_; }
    const Painted& painted() const { return painted_; }
    // Grows with painted().
    uint64_t painted_revision() const { return painted_revision_; }
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

    const SessionSettings& settings() const { return settings_; }
    const std::string& renderer() const { return worker_->renderer(); }
    uint64_t frame_bytes() const { return store_.bytes(); }

    // From a change to the paint of its first picture, and of the refined one; ms, the last ones.
    struct Latencies {
        std::deque<double> draft, refined;
    };
    const Latencies& latencies() const { return latencies_; }

  private:
    Session(SessionSettings settings, std::unique_ptr<FilterWorker> worker,
            const std::function<void()>& wake);
    // A request for the same has the same result.
    struct Key {
        SharedFrame source;
        uint64_t revision = 0;  // of the chain
        std::string texture;
        uint64_t shaders = 0;
        bool operator==(const Key&) const = default;
    };
    void watch_files(Clock::time_point now);
    ResultKey result_key() const;
    void show_kept_result();
    void keep_result();
    void advance(Clock::time_point now);
    bool take_results(Clock::time_point now);
    void request(Clock::time_point now);
    void request_other();
    void submit_paint();
    double draft_scale() const;
    std::shared_ptr<const ImageF> plane_image(const std::string& plane) const;
    std::string texture_to_read() const;
    bool compares_with(CompareTarget target) const {
        return view_.compare != Compare::off && view_.target == target;
    }

    SessionSettings settings_;
    Messages messages_;
    OpenChain open_;
    FrameStore store_;
    std::unique_ptr<FrameStore> truth_;
    std::unique_ptr<FilterWorker> worker_;
    Painter painter_;
    Playback playback_;
    ResultStore results_;
    ViewChoice view_;

    SharedFrame source_;
    std::shared_ptr<const Chain> chain_;  // at this frame
    uint64_t chain_of_ = 0;               // the document's revision of `chain_`
    int chain_frame_ = 0;

    Key wanted_;
    uint64_t request_id_ = 0;  // of `wanted_`; 0 is chain B's
    Clock::time_point wanted_since_;
    bool draft_sent_ = false, full_sent_ = false, draft_seen_ = false, full_seen_ = false;
    Shown shown_;
    Key shown_key_;
    Status filter_status_;
    double full_ms_ = 0;  // estimate of a whole frame

    std::shared_ptr<const Chain> other_;
    std::shared_ptr<const ImageF> other_image_;
    SharedFrame other_source_;
    uint64_t other_revision_ = 0, other_seen_ = 0;
    uint64_t other_shaders_ = 0;
    bool other_sent_ = false;

    Painted painted_;
    uint64_t painted_revision_ = 0;
    PaintJob paint_job_;  // the newest
    std::string paint_fault_;
    // The result in the newest paint job, whose latency is measured.
    struct InPaint {
        uint64_t job = 0, request = 0;
        bool draft = true;
        Clock::time_point since;
    };
    InPaint in_paint_;
    uint64_t first_seen_ = 0, refined_seen_ = 0;  // requests whose latency is known
    Latencies latencies_;

    uint64_t shader_stamp_ = 0, shaders_ = 0;
    Clock::time_point watched_at_;
};

}  // namespace postchain::view
