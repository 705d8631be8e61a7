// Summarizes the frames of a sequence and finds unusual ones.
//
//   SourceFrame, Thumbnail of each frame --SequenceSurvey--> ranges over frames, frames that differ
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "chain/frame/sign_check.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Checks the sign of a frame's motion vectors against the next frame.
Result<SignCheck> scan_signs(const SourceSettings& settings, const FrameHeader& header,
                             const FrameHeader& next);

// 16 x 9 means of RGB, each value after x/(1 + x): enough to detect a change of shot.
class Thumbnail {
  public:
    Thumbnail() = default;
    explicit Thumbnail(const ImageF& color);
    // Mean absolute difference, 0 to 1.
    double difference(const Thumbnail& other) const;

  private:
    static constexpr int kWidth = 16, kHeight = 9;
    std::array<double, size_t(kWidth)* kHeight* 3> sums_ = {};
    std::array<uint64_t, size_t(kWidth)* kHeight> pixels_ = {};
};

// A message without the path it begins with: the same for every frame with this fault.
std::string fault_of(const std::string& message);

class SequenceSurvey {
  public:
    // Frames are added in numeric order.
    void add(int frame, const SourceFrame& source, const Thumbnail& thumbnail);
    void add_failed(int frame, const Status& status);

    // A difference from most frames: "frame 4: no motion".
    struct Finding {
        int frame = 0;
        std::string what;
        std::string fault;  // why a frame cannot be read, without its path
    };
    // By frame: unreadable, other size or planes than most frames, NaN or Inf, all motion vectors
    // zero, a probable cut after it. A cut is reported if the thumbnail changes by more than 0.05
    // and by more than four times the sequence's median, between frames with consecutive numbers.
    std::vector<Finding> findings() const;
    size_t readable() const;  // frames
    bool failed() const { return readable() < frames_.size(); }
    // Several lines to read; frames that cannot be read for the same fault share one.
    std::string text() const;
    io::Json json() const;

  private:
    struct FrameSummary {
        int frame = 0;
        std::string failure;
        std::string size;
        RoleSet planes;
        uint64_t nonfinite = 0;
        bool motion_all_zero = false;
        bool has_sky = false;
        std::optional<double> speed_px, nearest, farthest;
        double min_color = 0, max_color = 0;  // over R, G and B
        std::optional<double> change;         // from the frame with the previous number
    };
    // Minimum and maximum over frames, and the frame of the maximum.
    struct Range {
        double least = 0, most = 0;
        int at_most = 0;
    };
    template <class Value>
    std::optional<Range> range(const Value& value) const;
    std::string usual_size() const;
    RoleSet usual_planes() const;

    std::vector<FrameSummary> frames_;
    std::optional<Thumbnail> last_;
};

// Frames of about `bytes` each that a survey reads: all, or if that exceeds 64 GiB as many as fit,
// at least eight, evenly spaced.
std::vector<int> frames_to_survey(const std::vector<int>& frames, uint64_t bytes);

}  // namespace postchain::sequence
