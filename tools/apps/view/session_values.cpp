#include "tools/apps/view/session_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "passes/common/shutter.h"
#include "tools/apps/view/save.h"

namespace postchain::view {
namespace {

constexpr int kPathPoints = 17;

std::string numbers_text(const float* values, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) {
        char digits[32];
        std::snprintf(digits, sizeof(digits), "%s%.4g", i ? "  " : "", double(values[i]));
        text += digits;
    }
    return text;
}

// The value that a pass with a lens or shutter works with; empty: no pass has it.
const sequence::ResolvedValue* resolved_value(const sequence::ResolvedValues& resolved,
                                              const std::string& key) {
    for (const auto& pass : resolved.passes)
        for (const auto& value : pass.values)
            if (value.key == key) return &value;
    return nullptr;
}

bool is_own(Role role) {
    return std::find(kFileRoles.begin(), kFileRoles.end(), role) != kFileRoles.end();
}

}  // namespace

std::vector<std::pair<std::string, std::string>> values_at(const Session& session, int x, int y) {
    const SharedFrame source = session.source();
    std::vector<std::pair<std::string, std::string>> values;
    if (!source || x < 0 || y < 0 || x >= source->description.width ||
        y >= source->description.height)
        return values;
    const auto add = [&](const std::string& name, const ImageF& image) {
        const int at_x = x * image.width / source->description.width;
        const int at_y = y * image.height / source->description.height;
        values.emplace_back(name, numbers_text(image.pixel(at_x, at_y), image.channels));
    };
    if (session.shown().color && session.shown().frame == session.playback().frame())
        add(session.shown().draft ? "result (draft)" : "result", *session.shown().color);
    for (const auto& [role, plane] : source->planes) {
        if (!is_own(role)) continue;
        if (role != Role::inverse_depth) {
            add(name_of(role), *plane);
        } else if (const auto distance = distance_at(session, x, y)) {
            const auto value = float(*distance);
            values.emplace_back("depth", numbers_text(&value, 1));
        } else {
            values.emplace_back("depth", "sky");
        }
    }
    if (session.shown().texture) add(session.shown().texture_name, *session.shown().texture);
    return values;
}

std::vector<std::string> planes_of(const Session& session) {
    const SharedFrame source = session.source();
    std::vector<std::string> names;
    if (!source) return names;
    for (const auto& [role, plane] : source->planes)
        if (!is_stacked(role)) names.push_back(name_of(role));
    return names;
}

Camera camera_of(const Session& session) {
    const Camera camera = session.document().camera_at(session.playback().frame());
    const SharedFrame source = session.source();
    return source ? source->description.camera.overlaid_by(camera) : camera;
}

std::optional<Inherited> inherited(const Session& session, size_t link, const Parameter& row) {
    const Document& document = session.document();
    const Camera camera = camera_of(session);
    const double shutter = shutter::open_frames({}, camera);
    const std::string from_shutter = camera.shutter_frames ? "the camera" : "default";
    if (row.key == "shutter_frames") return Inherited{shutter, from_shutter};
    if (row.key == "shutter_angle_deg")
        return Inherited{shutter::kFrameDeg * shutter, from_shutter};
    if (const Parameter* own = camera_parameters().find(row.key); own && own->type == row.type)
        if (const ParameterValue value = own->get(&camera); value != ParameterValue())
            return Inherited{value, "the camera"};
    // As the filter has resolved it. A draft's lengths are of fewer pixels.
    size_t index = 0;
    for (size_t i = 0; i < link; ++i) index += document.state().off[i] ? 0 : 1;
    const auto& passes = session.shown().resolved.passes;
    if (session.shown().draft || document.state().off[link] || index >= passes.size() ||
        passes[index].type != document.chain().links[link].type->name)
        return {};
    for (const auto& value : passes[index].values)
        if (value.key == row.key && value.value != ParameterValue())
            return Inherited{value.value, value.origin.from};
    return {};
}

std::optional<Inherited> inherited_by_camera(const Session& session, const Parameter& row) {
    if (const SharedFrame source = session.source())
        if (const ParameterValue value = row.get(&source->description.camera);
            value != ParameterValue())
            return Inherited{value, "the frame's camera"};
    if (row.key == "shutter_frames") return Inherited{shutter::open_frames({}, {}), "default"};
    return {};
}

ParameterValue first_value(const Parameter& row, const std::optional<Inherited>& inherited) {
    if (inherited && row.check(inherited->value).ok()) return inherited->value;
    const double low = std::isfinite(row.soft_min) ? row.soft_min : row.min;
    const double high = std::isfinite(row.soft_max) ? row.soft_max : row.max;
    const double middle = std::isfinite(low) && std::isfinite(high) ? (low + high) / 2
                          : std::isfinite(low)                      ? std::max(low, 1.0)
                                                                    : 1;
    switch (row.type) {
        case ParameterType::boolean:
            return true;
        case ParameterType::integer: {
            for (auto value = int64_t(middle); value <= int64_t(middle) + 1; ++value)
                if (row.check(value).ok()) return value;
            return row.allowed.empty() ? ParameterValue(int64_t(middle)) : row.allowed.front();
        }
        case ParameterType::number:
            return middle;
        case ParameterType::choice:
            return row.choices.front();
        case ParameterType::text:
            break;
        case ParameterType::point:
            return std::array<double, 2>{0.5, 0.5};
    }
    return {};
}

double shortest_double(float value) {
    char digits[32];
    const auto written = std::to_chars(digits, digits + sizeof(digits), value);
    double read = double(value);
    std::from_chars(digits, written.ptr, read);
    return read;
}

std::optional<double> distance_at(const Session& session, int x, int y) {
    const SharedFrame source = session.source();
    if (!source) return {};
    const auto depth = source->planes.find(Role::inverse_depth);
    if (depth == source->planes.end() || !depth->second->inside(x, y)) return {};
    const float w = depth->second->at(x, y);
    if (is_infinitely_far(w) || !std::isfinite(w)) return {};
    // Rounded to six digits, finer than any lens resolves.
    char digits[32];
    std::snprintf(digits, sizeof(digits), "%.6g", 1 / double(w));
    return std::strtod(digits, nullptr);
}

Status focus_at_pixel(Session& session, int x, int y) {
    const auto distance = distance_at(session, x, y);
    if (!distance)
        return Status(
            StatusCode::input,
            concat("pixel ", x, ", ", y,
                   " has no distance: it is the sky, or the frame has no depth; choose a surface"));
    if (!session.document().state().focus_keys.empty())
        return session.document().set_focus_key(session.playback().frame(), *distance);
    return session.document().set_camera("focus_distance", *distance);
}

Status focus_pull(Session& session, std::array<int, 2> from, std::array<int, 2> to) {
    const auto first = distance_at(session, from[0], from[1]),
               last = distance_at(session, to[0], to[1]);
    const auto list = session.playback().frames();
    if (!first || !last || list.size() < 2)
        return Status(StatusCode::input,
                      "a focus pull needs two frames, and two pixels with a distance");
    session.document().begin_gesture();
    Status status = session.document().set_focus_key(list.front(), *first);
    if (status.ok()) status = session.document().set_focus_key(list.back(), *last);
    session.document().end_gesture();
    return status;
}

std::optional<std::array<double, 2>> sharp_limits(const Session& session) {
    const auto* from = resolved_value(session.shown().resolved, "sharp_from");
    const auto* to = resolved_value(session.shown().resolved, "sharp_to");
    if (!from || !to) return {};
    const auto distance = [](const sequence::ResolvedValue& value) {
        const auto* number = std::get_if<double>(&value.value);
        return number ? *number : std::numeric_limits<double>::infinity();
    };
    return std::array<double, 2>{distance(*from), distance(*to)};
}

std::vector<std::array<double, 2>> motion_path(const Session& session, int x, int y) {
    const SharedFrame source = session.source();
    if (!source) return {};
    const auto motion = source->planes.find(Role::motion);
    if (motion == source->planes.end() || !motion->second->inside(x, y)) return {};
    const auto back = source->planes.find(Role::motion_back);
    double shutter = shutter::open_frames({}, camera_of(session));
    if (const auto* used = resolved_value(session.shown().resolved, "shutter_frames"))
        if (const auto* frames = std::get_if<double>(&used->value)) shutter = *frames;
    std::vector<std::array<double, 2>> path;
    for (int i = 0; i < kPathPoints; ++i) {
        const double t = shutter * (double(i) / (kPathPoints - 1) - 0.5);
        const ImageF& vectors =
            t < 0 && back != source->planes.end() ? *back->second : *motion->second;
        path.push_back(
            {x + 0.5 + t * double(vectors.at(x, y, 0)), y + 0.5 + t * double(vectors.at(x, y, 1))});
    }
    return path;
}

Status save_camera(Session& session, const std::string& path, bool replace) {
    const SharedFrame source = session.source();
    if (session.document().state().focus_keys.empty())
        return Status(StatusCode::usage,
                      "there are no focus keys to save; set one, or drag a focus pull");
    std::map<int, double> focus;
    for (const int frame : session.playback().frames())
        focus[frame] = focus_at(session.document().state().focus_keys, frame);
    std::string text;
    if (const auto& file = session.settings().run.source.camera; file && !file->file_name.empty()) {
        ASSIGN_OR_RETURN(text, read_text_file(file->file_name, StatusCode::input));
    }
    ASSIGN_OR_RETURN(const auto json, camera_with_focus(text, camera_of(session), focus));
    sequence::RunSettings settings = session.settings().run;
    if (const auto& file = settings.source.camera; file && file->file_name == path && replace)
        std::erase_if(settings.other_inputs,
                      [&](const io::InputFile& input) { return input.path == path; });
    RETURN_IF_ERROR(save_text(settings, path, json, "the camera file", replace));
    session.document().keys_saved();
    if (!session.document().changed()) session.open_chain().discard_edits();
    return Status();
}

}  // namespace postchain::view
