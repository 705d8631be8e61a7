#include "tools/apps/view/playback.h"

namespace postchain::view {
namespace {

constexpr size_t kMissingListed = 10'000;

}  // namespace

Playback::Playback(const FrameStore& store, std::optional<int> frame) : store_(store) {
    const auto list = frames();
    frame_ = frame.value_or(list.empty() ? 0 : list.front());
}

void Playback::go_to(int frame) {
    const auto list = frames();
    if (list.empty()) return;
    const auto nearest = std::min_element(list.begin(), list.end(), [&](int a, int b) {
        return std::abs(a - frame) < std::abs(b - frame);
    });
    if (*nearest == frame_) return;
    direction_ = *nearest < frame_ ? -1 : 1;
    frame_ = *nearest;
}

void Playback::step(int by) {
    const auto list = frames();
    if (list.empty()) return;
    auto at = std::lower_bound(list.begin(), list.end(), frame_) - list.begin();
    const auto count = std::ptrdiff_t(list.size());
    at = ((at + by) % count + count) % count;
    direction_ = by < 0 ? -1 : 1;
    frame_ = list[size_t(at)];
}

void Playback::play(int direction) {
    playing_ = direction;
    filling_ = false;
    played_at_ = Clock::now();
}

void Playback::set_range(std::optional<std::array<int, 2>> range) {
    if (range && (*range)[0] > (*range)[1]) std::swap((*range)[0], (*range)[1]);
    range_ = range;
}

std::vector<int> Playback::frames_in_range() const {
    std::vector<int> list = frames();
    if (range_)
        std::erase_if(list,
                      [&](int frame) { return frame < (*range_)[0] || frame > (*range_)[1]; });
    return list;
}

std::vector<int> Playback::missing_frames() const {
    const auto list = frames();
    std::vector<int> missing;
    for (size_t i = 1; i < list.size(); ++i)
        for (int frame = list[i - 1] + 1; frame < list[i] && missing.size() < kMissingListed;
             ++frame)
            missing.push_back(frame);
    return missing;
}

void Playback::fill_results(bool on) {
    if (on == filling_) return;
    const auto list = frames_in_range();
    filling_ = on && !list.empty();
    playing_ = 0;
    if (!filling_) return;
    filled_from_ = frame_;
    frame_ = list.front();
}

void Playback::play_on(Clock::time_point now) {
    const std::chrono::duration<double> since = now - played_at_;
    if (playing_ == 0 || since.count() < 1 / fps_) return;
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

bool Playback::fill_on(const std::set<int>& kept, bool room) {
    const auto list = frames_in_range();
    const auto next = std::find_if(std::upper_bound(list.begin(), list.end(), frame_), list.end(),
                                   [&](int frame) { return !kept.contains(frame); });
    filling_ = next != list.end() && room;
    if (filling_) direction_ = 1;
    frame_ = filling_ ? *next : filled_from_;
    return filling_ || next == list.end();
}

}  // namespace postchain::view
