// Values of a session: under the cursor, of the lens, saved.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tools/apps/view/chain_text.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/session.h"

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

std::vector<std::pair<std::string, std::string>> Session::values_at(int x, int y) const {
    std::vector<std::pair<std::string, std::string>> values;
    if (!source_ || x < 0 || y < 0 || x >= source_->description.width ||
        y >= source_->description.height)
        return values;
    const auto add = [&](const std::string& name, const ImageF& image) {
        const int at_x = x * image.width / source_->description.width;
        const int at_y = y * image.height / source_->description.height;
        values.emplace_back(name, numbers_text(image.pixel(at_x, at_y), image.channels));
    };
    if (shown_.color && shown_.frame == frame_)
        add(shown_.draft ? "result (draft)" : "result", *shown_.color);
    for (const auto& [role, plane] : source_->planes) {
        if (!is_own(role)) continue;
        if (role != Role::inverse_depth) {
            add(name_of(role), *plane);
        } else if (const auto distance = distance_at(x, y)) {
            const auto value = float(*distance);
            values.emplace_back("depth", numbers_text(&value, 1));
        } else {
            values.emplace_back("depth", "sky");
        }
    }
    if (shown_.texture) add(shown_.texture_name, *shown_.texture);
    return values;
}

std::vector<std::string> Session::planes() const {
    std::vector<std::string> names;
    if (!source_) return names;
    for (const auto& [role, plane] : source_->planes)
        if (!is_stacked(role)) names.push_back(name_of(role));
    return names;
}

Camera Session::camera() const {
    if (!source_) return document_.chain().camera;
    return source_->description.camera.overlaid_by(chain_ ? chain_->camera
                                                          : document_.chain().camera);
}

std::optional<double> Session::distance_at(int x, int y) const {
    if (!source_) return {};
    const auto depth = source_->planes.find(Role::inverse_depth);
    if (depth == source_->planes.end() || !depth->second->inside(x, y)) return {};
    const float w = depth->second->at(x, y);
    if (is_infinitely_far(w) || !std::isfinite(w)) return {};
    return 1 / double(w);
}

Status Session::focus_at_pixel(int x, int y) {
    const auto distance = distance_at(x, y);
    if (!distance)
        return Status(StatusCode::input,
                      concat("pixel ", x, ", ", y,
                             " has no distance: it is the sky, or the frame has no depth"));
    if (!document_.state().focus_keys.empty()) return document_.set_focus_key(frame_, *distance);
    return document_.set_camera("focus_distance", *distance);
}

Status Session::focus_pull(std::array<int, 2> from, std::array<int, 2> to) {
    const auto first = distance_at(from[0], from[1]), last = distance_at(to[0], to[1]);
    const auto list = frames();
    if (!first || !last || list.size() < 2)
        return Status(StatusCode::input,
                      "a focus pull needs two frames, and two pixels with a distance");
    document_.begin_gesture();
    Status status = document_.set_focus_key(list.front(), *first);
    if (status.ok()) status = document_.set_focus_key(list.back(), *last);
    document_.end_gesture();
    return status;
}

std::optional<std::array<double, 2>> Session::sharp_limits() const {
    const auto* from = resolved_value(shown_.resolved, "sharp_from");
    const auto* to = resolved_value(shown_.resolved, "sharp_to");
    if (!from || !to) return {};
    const auto distance = [](const sequence::ResolvedValue& value) {
        const auto* number = std::get_if<double>(&value.value);
        return number ? *number : std::numeric_limits<double>::infinity();
    };
    return std::array<double, 2>{distance(*from), distance(*to)};
}

std::vector<std::array<double, 2>> Session::motion_path(int x, int y) const {
    if (!source_) return {};
    const auto motion = source_->planes.find(Role::motion);
    if (motion == source_->planes.end() || !motion->second->inside(x, y)) return {};
    const auto back = source_->planes.find(Role::motion_back);
    double shutter = camera().shutter_frames.value_or(kDefaultShutterFrames);
    if (const auto* used = resolved_value(shown_.resolved, "shutter_frames"))
        if (const auto* frames = std::get_if<double>(&used->value)) shutter = *frames;
    std::vector<std::array<double, 2>> path;
    for (int i = 0; i < kPathPoints; ++i) {
        const double t = shutter * (double(i) / (kPathPoints - 1) - 0.5);
        const ImageF& vectors =
            t < 0 && back != source_->planes.end() ? *back->second : *motion->second;
        path.push_back(
            {x + 0.5 + t * double(vectors.at(x, y, 0)), y + 0.5 + t * double(vectors.at(x, y, 1))});
    }
    return path;
}

Status Session::save_chain(const std::string& path, bool replace) {
    if (path.ends_with(".json"))
        return Status(StatusCode::output, path + ": chains are saved as YAML; name a .yaml file");
    const ChainFileText saved = chain_file_text(chain_text_, document_);
    sequence::RunSettings settings = settings_.run;
    // The open chain file is the only input that is replaced by its own new text.
    std::erase_if(settings.other_inputs,
                  [&](const io::InputFile& file) { return file.path == settings_.chain_name; });
    const bool own = settings_.chain_is_file && path == settings_.chain_name;
    if (Status status = save_text(settings, path, saved.text, "the chain file", replace || own);
        !status.ok())
        return status;
    chain_text_ = saved.text;
    settings_.chain_name = path;
    settings_.chain_is_file = true;
    chain_stamp_ = io::FileStamp::of(path);
    document_.saved(true);
    say(path + (saved.kept ? ": saved" : ": saved, written anew below its first comments"));
    if (!document_.state().focus_keys.empty())
        say("the focus keys are not in the chain file: save the camera file too");
    return Status();
}

Status Session::save_camera(const std::string& path, bool replace) const {
    if (document_.state().focus_keys.empty())
        return Status(StatusCode::usage,
                      "there are no focus keys to save; set one, or drag a focus pull");
    std::map<int, double> focus;
    for (const int frame : frames()) focus[frame] = focus_at(document_.state().focus_keys, frame);
    std::string text;
    if (const auto& file = settings_.run.source.camera; file && !file->file_name.empty()) {
        auto read = read_text_file(file->file_name, StatusCode::input);
        if (!read.ok()) return read.status();
        text = std::move(*read);
    }
    const auto json = camera_with_focus(text, camera(), focus);
    if (!json.ok()) return json.status();
    return save_text(settings_.run, path, *json, "the camera file", replace);
}

}  // namespace postchain::view
