// What the frames of a sequence have in common, and which of them stand out.
//
//   SourceFrame, Thumbnail of each frame --SequenceSurvey--> ranges over frames, frames that differ
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/sequence/run/frame_scan.h"

namespace postchain::sequence {

// A picture of 16 x 9 means of RGB, each value after x/(1 + x), gathered strip by strip: enough to
// see that a sequence shows another shot.
class Thumbnail {
  public:
    // Color of the rows from `first` on of a frame of `height` rows.
    void add(const ImageF& color, int first, int height);
    // Mean absolute difference, 0 to 1; both must be complete.
    double difference(const Thumbnail& other) const;

  private:
    static constexpr int kWidth = 16, kHeight = 9;
    std::array<double, size_t(kWidth)* kHeight* 3> sums_ = {};
    std::array<uint64_t, size_t(kWidth)* kHeight> pixels_ = {};
};

class SequenceSurvey {
  public:
    // Frames in the order of their numbers.
    void add(int frame, const SourceFrame& source, const Thumbnail& thumbnail);
    void add_failed(int frame, const Status& status);

    // A frame that is not as most are: "frame 4: no motion".
    struct Finding {
        int frame = 0;
        std::string what;
    };
    // By frame: unreadable, another size or other planes than most frames, NaN or Inf, vectors that
    // are all zero, a cut behind it. A cut is taken for one where the thumbnail changes by more
    // than 0.05 and four times the median of the sequence, between frames with neighboring numbers.
    std::vector<Finding> findings() const;
    bool failed() const { return readable() < frames_.size(); }
    std::string text() const;  // for people, several lines
    io::Json json() const;

  private:
    struct Glance {
        int frame = 0;
        std::string failure;
        std::string size;
        RoleSet planes;
        uint64_t nonfinite = 0;
        bool motion_all_zero = false;
        bool has_sky = false;
        std::optional<double> speed_px, nearest, farthest;
        double min_color = 0, max_color = 0;  // of RGB
        std::optional<double> change;         // from the frame with the number before
    };
    // Smallest and largest over frames, and the frame of the largest.
    struct Range {
        double least = 0, most = 0;
        int at_most = 0;
    };
    template <class Value>
    std::optional<Range> range(const Value& value) const;
    std::string usual_size() const;
    RoleSet usual_planes() const;
    size_t readable() const;

    std::vector<Glance> frames_;
    std::optional<Thumbnail> last_;
};

// Of frames of about `bytes` each, those that a glance over the sequence looks at: all of
// them, or where that is more than 64 GiB as many as fit, at least eight, evenly spread.
std::vector<int> frames_to_survey(const std::vector<int>& frames, uint64_t bytes);

}  // namespace postchain::sequence
