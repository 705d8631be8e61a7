#include "tools/sequence/source/sequence_survey.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "chain/base/printable.h"
#include "chain/base/text.h"

namespace postchain::sequence {
namespace {

constexpr double kMinChange = 0.05;
constexpr double kTimesMedian = 4;
constexpr uint64_t kSurveyBytes = uint64_t(64) << 30;
constexpr size_t kMinFrames = 8;

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.4g", value);
    return text;
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

Result<SignCheck> scan_signs(const SourceSettings& settings, const FrameHeader& header,
                             const FrameHeader& next) {
    SignCheck none;
    const io::Window &display = color_part(header).display_window,
                     &next_display = color_part(next).display_window;
    if (display != next_display) {
        none.why_not = "the next frame has another display window, " + next_display.text();
        return none;
    }
    if (header.makes_motion) {
        none.why_not = "the motion vectors are made from the camera; none are read from the file";
        return none;
    }
    // Vectors that are made here are right by construction and must not vote.
    FrameHeader stored = header;
    stored.sky.reset();
    ASSIGN_OR_RETURN(const auto frame,
                     read_source_frame(settings, std::move(stored),
                                       {Role::inverse_depth, Role::motion, Role::motion_back},
                                       io::Keep::nothing));
    ASSIGN_OR_RETURN(const auto after, read_source_frame(settings, next, {}, io::Keep::nothing));
    const ImageF color = io::placed(*after.planes.at(Role::color), next.window, header.window);
    SignCheck check = check_signs(frame.planes, color);
    const double fastest_px = frame.findings.health.fastest_stored_px;
    if (!doubt_of_speed(fastest_px, 1).empty())
        if (const std::string doubt =
                doubt_of_speed(fastest_px, color_change(*frame.planes.at(Role::color), color));
            !doubt.empty())
            check.why_not = doubt;
    return check;
}

Thumbnail::Thumbnail(const ImageF& color) {
    for (int y = 0; y < color.height; ++y) {
        const int row = int(int64_t(y) * kHeight / color.height);
        for (int x = 0; x < color.width; ++x) {
            const size_t cell = size_t(row * kWidth + int(int64_t(x) * kWidth / color.width));
            const float* pixel = color.pixel(x, y);
            for (size_t c = 0; c < 3; ++c) {
                const double value = std::max(0.0, double(pixel[c]));
                if (std::isfinite(value)) sums_[cell * 3 + c] += value / (1 + value);
            }
            ++pixels_[cell];
        }
    }
}

double Thumbnail::difference(const Thumbnail& other) const {
    double sum = 0;
    int count = 0;
    for (size_t cell = 0; cell < pixels_.size(); ++cell) {
        if (!pixels_[cell] || !other.pixels_[cell]) continue;  // image smaller than the thumbnail
        for (size_t c = 0; c < 3; ++c)
            sum += std::abs(sums_[cell * 3 + c] / double(pixels_[cell]) -
                            other.sums_[cell * 3 + c] / double(other.pixels_[cell]));
        count += 3;
    }
    return count ? sum / count : 0;
}

void SequenceSurvey::add(int frame, const SourceFrame& source, const Thumbnail& thumbnail) {
    const FrameDescription& description = source.description;
    const FrameBounds& bounds = description.bounds;
    FrameSummary summary;
    summary.frame = frame;
    summary.size = concat(description.width, "x", description.height);
    if (description.display_width != description.width ||
        description.display_height != description.height)
        summary.size += concat(" of ", description.display_width, "x", description.display_height);
    summary.planes = description.planes;
    summary.nonfinite = source.findings.health.nonfinite();
    summary.motion_all_zero = source.findings.health.motion_all_zero;
    if (description.planes.has(Role::motion)) summary.speed_px = bounds.max_speed_px;
    if (description.planes.has(Role::inverse_depth)) {
        summary.has_sky = is_infinitely_far(float(bounds.min_inverse_depth));
        if (bounds.max_inverse_depth > 0) summary.nearest = 1 / bounds.max_inverse_depth;
        if (!summary.has_sky) summary.farthest = 1 / bounds.min_inverse_depth;
    }
    summary.min_color = *std::min_element(bounds.min_color.begin(), bounds.min_color.begin() + 3);
    summary.max_color = *std::max_element(bounds.max_color.begin(), bounds.max_color.begin() + 3);
    if (last_ && !frames_.empty() && frames_.back().frame == frame - 1)
        summary.change = thumbnail.difference(*last_);
    last_ = thumbnail;
    frames_.push_back(std::move(summary));
}

void SequenceSurvey::add_failed(int frame, const Status& status) {
    FrameSummary summary;
    summary.frame = frame;
    summary.failure = status.message();
    frames_.push_back(std::move(summary));
    last_.reset();
}

std::string fault_of(const std::string& message) {
    const size_t end = message.find(": ");
    return end == std::string::npos ? message : message.substr(end + 2);
}

size_t SequenceSurvey::readable() const {
    return size_t(std::count_if(frames_.begin(), frames_.end(), [](const FrameSummary& summary) {
        return summary.failure.empty();
    }));
}

std::string SequenceSurvey::usual_size() const {
    std::map<std::string, size_t> sizes;
    for (const FrameSummary& summary : frames_)
        if (summary.failure.empty()) ++sizes[summary.size];
    const auto most =
        std::max_element(sizes.begin(), sizes.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == sizes.end() ? std::string() : most->first;
}

RoleSet SequenceSurvey::usual_planes() const {
    RoleSet usual;
    for (Role role : kFileRoles) {
        const auto count = size_t(std::count_if(frames_.begin(), frames_.end(), [&](const auto& g) {
            return g.failure.empty() && g.planes.has(role);
        }));
        if (count > 0 && 2 * count >= readable()) usual.add(role);
    }
    return usual;
}

std::vector<SequenceSurvey::Finding> SequenceSurvey::findings() const {
    std::vector<Finding> found;
    const std::string size = usual_size();
    const RoleSet planes = usual_planes();
    std::vector<double> changes;
    for (const FrameSummary& summary : frames_)
        if (summary.change) changes.push_back(*summary.change);
    const double usual_change = median(changes);
    for (size_t i = 0; i < frames_.size(); ++i) {
        const FrameSummary& summary = frames_[i];
        const auto add = [&](const std::string& what) {
            found.push_back({summary.frame, what, ""});
        };
        if (!summary.failure.empty()) {
            add("cannot be read: " + summary.failure);
            found.back().fault = fault_of(summary.failure);
            continue;
        }
        if (summary.size != size) add(concat("is ", summary.size, "; most are ", size));
        if (const RoleSet lacking = planes - summary.planes; !lacking.empty())
            add("has no " + lacking.text());
        if (const RoleSet more = summary.planes - planes; !more.empty())
            add(concat("has ", more.text(), ", which most frames lack"));
        if (summary.nonfinite)
            add(concat(summary.nonfinite, summary.nonfinite == 1 ? " pixel" : " pixels",
                       " with NaN or Inf"));
        if (summary.motion_all_zero) add("every motion vector is zero");
        const bool more_follow = i + 1 < frames_.size() && frames_[i + 1].change;
        if (!more_follow) continue;
        const double change = *frames_[i + 1].change;
        if (change > kMinChange && change > kTimesMedian * usual_change)
            add(concat("the image changes ",
                       usual_change > 0 ? number(change / usual_change) + " times as much as usual"
                                        : std::string("unlike elsewhere"),
                       " to frame ", summary.frame + 1, ": a cut? ({cuts="_keyed, summary.frame,
                       "})"_keyed));
    }
    return found;
}

template <class Value>
std::optional<SequenceSurvey::Range> SequenceSurvey::range(const Value& value) const {
    std::optional<Range> range;
    for (const FrameSummary& summary : frames_) {
        const std::optional<double> one =
            summary.failure.empty() ? std::optional<double>(value(summary)) : std::nullopt;
        if (!one) continue;
        if (!range) range = Range{*one, *one, summary.frame};
        range->least = std::min(range->least, *one);
        if (*one > range->most) {
            range->most = *one;
            range->at_most = summary.frame;
        }
    }
    return range;
}

io::Json SequenceSurvey::json() const {
    io::Json json;
    json["frames"] = frames_.size();
    if (!frames_.empty()) {
        json["first"] = frames_.front().frame;
        json["last"] = frames_.back().frame;
    }
    json["readable"] = readable();
    json["size"] = usual_size();
    json["planes"] = io::Json::array();
    for (Role role : kFileRoles)
        if (usual_planes().has(role)) json["planes"].push_back(name_of(role));
    const auto add = [&](const char* key, const std::optional<Range>& range) {
        if (range)
            json[key] = {
                {"least", range->least}, {"most", range->most}, {"most_in_frame", range->at_most}};
    };
    add("max_speed_px", range([](const FrameSummary& g) { return g.speed_px; }));
    add("nearest", range([](const FrameSummary& g) { return g.nearest; }));
    add("farthest", range([](const FrameSummary& g) { return g.farthest; }));
    json["sky_in_frames"] = std::count_if(frames_.begin(), frames_.end(),
                                          [](const FrameSummary& g) { return g.has_sky; });
    add("min_color",
        range([](const FrameSummary& g) { return std::optional<double>(g.min_color); }));
    add("max_color",
        range([](const FrameSummary& g) { return std::optional<double>(g.max_color); }));
    json["findings"] = io::Json::array();
    for (const Finding& finding : findings())
        json["findings"].push_back({{"frame", finding.frame}, {"what", finding.what}});
    return json;
}

std::string SequenceSurvey::text() const {
    if (frames_.empty()) return {};
    std::string text = concat(
        frames_.size(), " frames examined, ", frames_.front().frame, " to ", frames_.back().frame,
        ": ",
        readable() == 0 ? "none can be read" : concat(usual_size(), ", ", usual_planes().text()),
        "\n");
    const auto add = [&](const char* what, const std::optional<Range>& range, const char* unit) {
        if (!range) return;
        text += concat("  ", what, " ", number(range->least));
        if (number(range->most) != number(range->least))
            text += concat(" to ", number(range->most), " (frame ", range->at_most, ")");
        text += concat(unit, "\n");
    };
    add("largest speed", range([](const FrameSummary& g) { return g.speed_px; }), " px a frame");
    add("nearest distance", range([](const FrameSummary& g) { return g.nearest; }), " scene units");
    add("farthest distance", range([](const FrameSummary& g) { return g.farthest; }),
        " scene units");
    const auto sky = std::count_if(frames_.begin(), frames_.end(),
                                   [](const FrameSummary& g) { return g.has_sky; });
    if (sky) text += concat("  sky in ", sky, " of ", readable(), " frames\n");
    add("smallest color value",
        range([](const FrameSummary& g) { return std::optional<double>(g.min_color); }), "");
    add("largest color value",
        range([](const FrameSummary& g) { return std::optional<double>(g.max_color); }), "");
    const auto found = findings();
    if (found.empty()) return text + "no unusual frames\n";
    text += "unusual frames:\n";
    std::map<std::string, size_t> frames;  // not yet listed, by fault
    for (const Finding& finding : found) ++frames[finding.fault];
    for (const Finding& finding : found) {
        std::string who = concat("  frame ", finding.frame);
        if (!finding.fault.empty()) {
            const size_t same = std::exchange(frames[finding.fault], 0);
            if (same == 0) continue;
            if (same > 1) who += concat(" and ", same - 1, " more");
        }
        text += printable(concat(who, ": ", finding.what)) + "\n";
    }
    return text;
}

std::vector<int> frames_to_survey(const std::vector<int>& frames, uint64_t bytes) {
    const size_t fit =
        std::max<size_t>(kMinFrames, size_t(kSurveyBytes / std::max<uint64_t>(1, bytes)));
    if (fit >= frames.size()) return frames;
    std::vector<int> chosen;
    for (size_t i = 0; i < fit; ++i) chosen.push_back(frames[i * (frames.size() - 1) / (fit - 1)]);
    return chosen;
}

}  // namespace postchain::sequence
