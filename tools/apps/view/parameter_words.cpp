#include "tools/apps/view/parameter_words.h"

#include <algorithm>
#include <array>
#include <map>
#include <regex>
#include <string_view>

namespace postchain::view {
namespace {

const char* const kMethod = "Method";
const char* const kShutter = "Shutter";
const char* const kLens = "Lens";
const char* const kAperture = "Aperture";
const char* const kSearch = "Search";
const char* const kEdges = "Edges";
const char* const kNoise = "Noise";
const char* const kTaps = "Taps and tiles";

// Groups by key, and a label if the key's own words are not the field's.
struct Row {
    const char* group;
    const char* label = "";
};
const std::map<std::string_view, Row>& table() {
    static const std::map<std::string_view, Row> rows = {
        {"mode", {kMethod}},
        {"method", {kMethod}},
        {"preset", {kMethod}},
        {"coc", {kMethod, "circle of confusion"}},
        {"samples", {kMethod}},
        {"shutter_frames", {kShutter, "shutter"}},
        {"shutter_angle_deg", {kShutter, "shutter angle"}},
        {"shutter_position", {kShutter}},
        {"max_blur_px", {kShutter, "longest blur"}},
        {"max_blur_fraction", {kShutter, "longest blur, of the height"}},
        {"min_speed_px", {kShutter, "least speed"}},
        {"focal_length_mm", {kLens}},
        {"sensor_width_mm", {kLens}},
        {"f_stop", {kLens, "f-stop"}},
        {"focus_distance", {kLens, "focus"}},
        {"focus_at", {kLens, "focus at a point"}},
        {"breathing", {kLens}},
        {"near_clip", {kLens, "near clip"}},
        {"far_clip", {kLens, "far clip"}},
        {"meters_per_unit", {kLens}},
        {"near_blurry", {kLens}},
        {"near_sharp", {kLens}},
        {"far_sharp", {kLens}},
        {"far_blurry", {kLens}},
        {"max_near_fraction", {kLens, "largest near blur"}},
        {"max_far_fraction", {kLens, "largest far blur"}},
        {"focus", {kLens, "focus of the range"}},
        {"range", {kLens, "range in focus"}},
        {"max_radius_px", {kLens, "largest radius"}},
        {"max_radius_fraction", {kLens, "largest radius, of the height"}},
        {"aperture_blades", {kAperture, "blades"}},
        {"aperture_image", {kAperture, "image"}},
        {"aperture_rotation_deg", {kAperture, "rotation"}},
        {"aperture_curvature", {kAperture, "curvature"}},
        {"aperture_ratio", {kAperture, "anamorphic ratio"}},
        {"cats_eye", {kAperture, "cat's eye"}},
        {"starts", {kSearch, "start surfaces"}},
        {"neighbors", {kSearch, "neighboring frames"}},
        {"path_px_per_time", {kSearch, "path for a time sample"}},
        {"denoise", {kSearch}},
        {"subpix", {kEdges, "sub-pixel strength"}},
        {"edge_threshold", {kEdges, "least contrast"}},
        {"edge_threshold_min", {kEdges, "least contrast, dark"}},
        {"luma", {kEdges}},
        {"exposure_ev", {kEdges, "exposure"}},
        {"blend", {kEdges}},
        {"hint", {kEdges, "hint of motion blur"}},
        {"hint_gate", {kEdges, "where the hint holds"}},
        {"where", {kEdges, "pixels that are filtered"}},
        {"noise", {kNoise, "pattern"}},
        {"seed", {kNoise}},
        {"animate_noise", {kNoise, "changes with the frame"}},
        {"jitter", {kNoise}},
        {"tile_jitter", {kNoise}},
        {"tile_jitter_slope", {kNoise}},
        {"time_jitter", {kNoise}},
        {"center_weight", {kTaps}},
        {"variance_threshold_px", {kTaps, "variance threshold"}},
        {"depth_softness", {kTaps}},
        {"sample_split", {kTaps, "split of samples"}},
        {"border", {kTaps}},
        {"static_direction", {kTaps}},
        {"velocity_storage", {kTaps}},
        {"downsample", {kTaps}},
        {"blur_sigma_px", {kTaps, "width of the Gaussian"}},
        {"leak", {kTaps}},
        {"hdr_weight", {kTaps, "HDR weight"}},
    };
    return rows;
}

std::string label_of(const std::string& key) {
    const auto found = table().find(key);
    if (found != table().end() && *found->second.label) return found->second.label;
    std::string label = key;
    constexpr std::array<std::string_view, 3> kUnits = {"_px", "_mm", "_deg"};
    for (const std::string_view unit : kUnits)
        if (label.ends_with(unit)) label.resize(label.size() - unit.size());
    std::replace(label.begin(), label.end(), '_', ' ');
    return label;
}

// Without keys: "focus_distance decides", "from {camera}".
std::string in_words(const std::string& text) {
    static const std::regex key("[a-z]+(_[a-z]+)+");
    std::string words;
    auto end = text.begin();
    for (std::sregex_iterator one(text.begin(), text.end(), key), last; one != last; ++one) {
        words.append(end, (*one)[0].first);
        words += label_of(one->str());
        end = (*one)[0].second;
    }
    words.append(end, text.end());
    return with_settings(words, [](const std::string& setting, const std::string&) {
        return setting == "camera" ? "the camera" : setting;
    });
}

}  // namespace

const std::vector<ParameterGroup>& parameter_groups() {
    static const std::vector<ParameterGroup> groups = {
        {kMethod, true}, {kShutter, true}, {kLens, true}, {kAperture},
        {kSearch},       {kEdges, true},   {kNoise},      {kTaps}};
    return groups;
}

ParameterWords words_of(const Parameter& row) {
    const auto found = table().find(row.key);
    return {label_of(row.key), found == table().end() ? "" : found->second.group,
            row.unset_means.empty() ? "not set" : in_words(row.unset_means)};
}

}  // namespace postchain::view
