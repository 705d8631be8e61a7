// Which frame is shown: by the user's choice, by play, and while every frame is filtered once.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <set>
#include <vector>

#include "tools/apps/view/frame_store.h"

namespace postchain::view {

using Clock = std::chrono::steady_clock;

class Playback {
  public:
    // Begins at `frame`; empty: at the first one.
    Playback(const FrameStore& store, std::optional<int> frame);

    int frame() const { return frame_; }
    int direction() const { return direction_; }  // of the last step: -1, 1
    std::vector<int> frames() const { return store_.frames(); }
    void go_to(int frame);  // the nearest frame on disk
    void step(int frames);  // forth or back in the list, around its ends
    // -1: backward, 0: stopped, 1: forward.
    int playing() const { return playing_; }
    void play(int direction);
    // The frames between which play turns, and to which Home and End lead; empty: all.
    const std::optional<std::array<int, 2>>& range() const { return range_; }
    void set_range(std::optional<std::array<int, 2>> range);
    std::vector<int> frames_in_range() const;
    // Frames of the sequence's numbers that are not on disk.
    std::vector<int> missing_frames() const;
    void set_fps(double fps) { fps_ = std::max(fps, 1.0); }
    double fps() const { return fps_; }
    // The steps that playing has taken.
    int frames_played() const { return frames_played_; }

    // Filters every frame of the range once, so that play shows it refined; or stops that.
    void fill_results(bool on);
    bool filling() const { return filling_; }

    // This frame is shown: the next one, if it plays and the time of that one has come.
    void play_on(Clock::time_point now);
    // This frame is filtered: the next one of the range that is not in `kept`, if there is room for
    // it, otherwise back to where filling began. False: room is lacking.
    bool fill_on(const std::set<int>& kept, bool room);

  private:
    const FrameStore& store_;
    int frame_ = 0;
    int direction_ = 1;
    int playing_ = 0;
    std::optional<std::array<int, 2>> range_;
    bool filling_ = false;
    int filled_from_ = 0;
    int frames_played_ = 0;
    double fps_ = 24;
    Clock::time_point played_at_;
};

}  // namespace postchain::view
