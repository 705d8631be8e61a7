#include "tools/sequence/source/sequence_survey.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "chain/printable.h"
#include "chain/text.h"

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

void Thumbnail::add(const ImageF& color, int first, int height) {
    for (int y = 0; y < color.height; ++y) {
        const int row = std::min(kHeight - 1, int(int64_t(first + y) * kHeight / height));
        for (int x = 0; x < color.width; ++x) {
            const size_t cell = size_t(row * kWidth + int(int64_t(x) * kWidth / color.width));
            const float* pixel =
                &color.data[(size_t(y) * size_t(color.width) + size_t(x)) * size_t(color.channels)];
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
    Glance glance;
    glance.frame = frame;
    glance.size = concat(description.width, "x", description.height);
    if (description.display_width != description.width ||
        description.display_height != description.height)
        glance.size += concat(" of ", description.display_width, "x", description.display_height);
    glance.planes = description.planes;
    glance.nonfinite = source.health.nonfinite();
    glance.motion_all_zero = source.health.motion_all_zero;
    if (description.planes.has(Role::motion)) glance.speed_px = bounds.max_speed_px;
    if (description.planes.has(Role::inverse_depth)) {
        glance.has_sky = is_infinitely_far(float(bounds.min_inverse_depth));
        if (bounds.max_inverse_depth > 0) glance.nearest = 1 / bounds.max_inverse_depth;
        if (!glance.has_sky) glance.farthest = 1 / bounds.min_inverse_depth;
    }
    glance.min_color = *std::min_element(bounds.min_color.begin(), bounds.min_color.begin() + 3);
    glance.max_color = *std::max_element(bounds.max_color.begin(), bounds.max_color.begin() + 3);
    if (last_ && !frames_.empty() && frames_.back().frame == frame - 1)
        glance.change = thumbnail.difference(*last_);
    last_ = thumbnail;
    frames_.push_back(std::move(glance));
}

void SequenceSurvey::add_failed(int frame, const Status& status) {
    Glance glance;
    glance.frame = frame;
    glance.failure = status.message();
    frames_.push_back(std::move(glance));
    last_.reset();
}

size_t SequenceSurvey::readable() const {
    return size_t(std::count_if(frames_.begin(), frames_.end(),
                                [](const Glance& glance) { return glance.failure.empty(); }));
}

std::string SequenceSurvey::usual_size() const {
    std::map<std::string, size_t> sizes;
    for (const Glance& glance : frames_)
        if (glance.failure.empty()) ++sizes[glance.size];
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
    for (const Glance& glance : frames_)
        if (glance.change) changes.push_back(*glance.change);
    const double usual_change = median(changes);
    for (size_t i = 0; i < frames_.size(); ++i) {
        const Glance& glance = frames_[i];
        const auto add = [&](const std::string& what) { found.push_back({glance.frame, what}); };
        if (!glance.failure.empty()) {
            add("cannot be read: " + glance.failure);
            continue;
        }
        if (glance.size != size) add(concat("is ", glance.size, "; most are ", size));
        if (const RoleSet lacking = planes - glance.planes; !lacking.empty())
            add("has no " + lacking.text());
        if (const RoleSet more = glance.planes - planes; !more.empty())
            add(concat("has ", more.text(), ", which most frames lack"));
        if (glance.nonfinite)
            add(concat(glance.nonfinite, glance.nonfinite == 1 ? " pixel" : " pixels",
                       " with NaN or Inf"));
        if (glance.motion_all_zero) add("every motion vector is zero");
        const bool more_follow = i + 1 < frames_.size() && frames_[i + 1].change;
        if (!more_follow) continue;
        const double change = *frames_[i + 1].change;
        if (change > kMinChange && change > kTimesMedian * usual_change)
            add(concat("the image changes ",
                       usual_change > 0 ? number(change / usual_change) + " times as much as usual"
                                        : std::string("unlike elsewhere"),
                       " to frame ", glance.frame + 1, ": a cut? (--cuts ", glance.frame, ")"));
    }
    return found;
}

template <class Value>
std::optional<SequenceSurvey::Range> SequenceSurvey::range(const Value& value) const {
    std::optional<Range> range;
    for (const Glance& glance : frames_) {
        const std::optional<double> one =
            glance.failure.empty() ? std::optional<double>(value(glance)) : std::nullopt;
        if (!one) continue;
        if (!range) range = Range{*one, *one, glance.frame};
        range->least = std::min(range->least, *one);
        if (*one > range->most) {
            range->most = *one;
            range->at_most = glance.frame;
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
    add("max_speed_px", range([](const Glance& g) { return g.speed_px; }));
    add("nearest", range([](const Glance& g) { return g.nearest; }));
    add("farthest", range([](const Glance& g) { return g.farthest; }));
    json["sky_in_frames"] =
        std::count_if(frames_.begin(), frames_.end(), [](const Glance& g) { return g.has_sky; });
    add("min_color", range([](const Glance& g) { return std::optional<double>(g.min_color); }));
    add("max_color", range([](const Glance& g) { return std::optional<double>(g.max_color); }));
    json["findings"] = io::Json::array();
    for (const Finding& finding : findings())
        json["findings"].push_back({{"frame", finding.frame}, {"what", finding.what}});
    return json;
}

std::string SequenceSurvey::text() const {
    if (frames_.empty()) return {};
    std::string text =
        concat(frames_.size(), " frames examined, ", frames_.front().frame, " to ",
               frames_.back().frame, ": ", usual_size(), ", ", usual_planes().text(), "\n");
    const auto add = [&](const char* what, const std::optional<Range>& range, const char* unit) {
        if (!range) return;
        text += concat("  ", what, " ", number(range->least));
        if (number(range->most) != number(range->least))
            text += concat(" to ", number(range->most), " (frame ", range->at_most, ")");
        text += concat(unit, "\n");
    };
    add("largest speed", range([](const Glance& g) { return g.speed_px; }), " px a frame");
    add("nearest distance", range([](const Glance& g) { return g.nearest; }), " scene units");
    add("farthest distance", range([](const Glance& g) { return g.farthest; }), " scene units");
    const auto sky =
        std::count_if(frames_.begin(), frames_.end(), [](const Glance& g) { return g.has_sky; });
    if (sky) text += concat("  sky in ", sky, " of ", readable(), " frames\n");
    add("smallest color value",
        range([](const Glance& g) { return std::optional<double>(g.min_color); }), "");
    add("largest color value",
        range([](const Glance& g) { return std::optional<double>(g.max_color); }), "");
    const auto found = findings();
    if (found.empty()) return text + "no unusual frames\n";
    text += "unusual frames:\n";
    for (const Finding& finding : found)
        text += printable(concat("  frame ", finding.frame, ": ", finding.what)) + "\n";
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
