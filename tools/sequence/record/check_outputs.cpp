#include "tools/sequence/record/check_outputs.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "chain/base/readable_file.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/record/record.h"
#include "tools/sequence/record/sidecar.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using io::Json;

// "postchain VERSION chain HASH work HASH strict" without the hash of the work, which differs from
// frame to frame.
std::string settings_of_provenance(const std::string& provenance) {
    const size_t at = provenance.find(" work ");
    if (!provenance.starts_with("postchain ") || at == std::string::npos) return "";
    return provenance.substr(0, at) + (provenance.ends_with(" strict") ? " strict" : "");
}

// The settings that decide pixels or the file, from a record.
std::string settings_of_record(const Record& record) {
    static const std::vector<std::string> free = {
        "input",   "output", "frames",     "chunk", "on_existing", "on_error", "missing",
        "sidecar", "png",    "max_memory", "mkdir", "watch",       "idle",     "dump_stages"};
    std::string text;
    for (const auto& [key, value] : record.settings)
        if (std::find(free.begin(), free.end(), key) == free.end() && key != "camera")
            text += concat(" ", key, "=", text_of(value));
    if (!record.camera_hash.empty()) text += " camera " + record.camera_hash;
    return text;
}

Json sidecar_beside(const std::string& path) {
    const std::string sidecar = sidecar_path(path);
    const auto json = io::read_json(text_of_file(sidecar), sidecar);
    return json.ok() && json->is_object() ? *json : Json();
}

// Empty if the sidecar has none, or one that is no text: anyone may have written the file.
std::string work_of(const Json& sidecar) {
    const auto at = sidecar.is_object() ? sidecar.find("work") : sidecar.end();
    return at != sidecar.end() && at->is_string() ? at->get<std::string>() : "";
}

bool has_size(const Json& sidecar, uint64_t bytes) {
    const auto at = sidecar.find("output_bytes");
    return at != sidecar.end() && at->is_number_unsigned() && *at == bytes;
}

// Everything but the comparison with the other frames.
CheckedOutput looked_at(int frame, const std::string& path) {
    CheckedOutput found{.frame = frame, .path = path, .why = "is not on disk"};
    std::error_code error;
    if (!fs::exists(path, error)) return found;
    if (const auto bytes = fs::file_size(path, error); !error) found.bytes = bytes;
    const Json sidecar = sidecar_beside(path);
    std::string provenance;
    found.state = OutputState::damaged;
    if (io::image_format_of(path)) {
        // Not every format can hold an attribute, so the sidecar says what made it.
        provenance = work_of(sidecar);
        found.why = "no sidecar says how it was made";
        if (!provenance.empty() && !has_size(sidecar, found.bytes)) {
            found.why = "has another size than its sidecar says";
            return found;
        }
    } else {
        auto file = io::ExrFile::open(path);
        if (!file.ok()) {
            found.why = file.status().message();
            return found;
        }
        if (Status status = check_whole(*file); !status.ok()) {
            found.why = status.message();
            return found;
        }
        for (const auto& part : file->parts())
            if (const auto at = part.attributes.find("postchain"); at != part.attributes.end())
                provenance = at->second;
        found.why = "has no attribute that says how it was made";
    }
    found.settings = settings_of_provenance(provenance);
    if (found.settings.empty()) {
        found.state = OutputState::foreign;
        return found;
    }
    if (work_of(sidecar) == provenance) found.sidecar = sidecar;
    if (const auto at = found.sidecar.find("frame");
        at != found.sidecar.end() && at->is_number_integer())
        found.made_as = at->get<int>();
    if (!io::image_format_of(path))
        if (const auto record = read_record(path); record.ok()) {
            found.settings += settings_of_record(*record);
            found.made_as = record->frame;
        }
    found.state = OutputState::whole;
    found.why.clear();
    return found;
}

// The value that most whole outputs have; of equals the first.
template <typename ValueOf>
auto of_most(const std::vector<CheckedOutput>& outputs, const ValueOf& value_of) {
    using Value = std::decay_t<decltype(value_of(outputs[0]))>;
    std::map<Value, int> counts;
    for (const CheckedOutput& one : outputs)
        if (one.state == OutputState::whole) ++counts[value_of(one)];
    Value most{};
    int count = 0;
    for (const CheckedOutput& one : outputs)
        if (one.state == OutputState::whole && counts[value_of(one)] > count) {
            most = value_of(one);
            count = counts[most];
        }
    return most;
}

// How far the frame's number was moved since it was made: equal in a renumbered sequence.
int renumbered_by(const CheckedOutput& one) {
    return one.frame - one.made_as.value_or(one.frame);
}

}  // namespace

const char* name_of(OutputState state) {
    switch (state) {
        case OutputState::whole:
            return "whole";
        case OutputState::missing:
            return "missing";
        case OutputState::damaged:
            return "damaged";
        case OutputState::other:
            return "other settings";
        case OutputState::foreign:
            return "foreign";
    }
    return "";
}

Result<std::vector<CheckedOutput>> check_outputs(const io::PathPattern& pattern,
                                                 const std::optional<io::FrameRange>& frames,
                                                 const std::string& like) {
    const auto on_disk = pattern.discover();
    std::vector<int> numbers;
    if (frames) {
        numbers = frames->frames;
    } else {
        if (on_disk.empty())
            return Status(StatusCode::input, pattern.text() +
                                                 ": no frame is on disk; give the frames with "
                                                 "{frames} to list them as missing"_keyed);
        const int first = on_disk.begin()->first, last = on_disk.rbegin()->first;
        // One stray file, such as a date, may be a billion frames away.
        if (int64_t(last) - first >= int64_t(io::kMaxFrames))
            return Status(StatusCode::usage, concat(pattern.text(), ": from frame ", first, " to ",
                                                    last, " are more than ", io::kMaxFrames,
                                                    " frames; choose some with {frames}"_keyed));
        for (int frame = first; frame <= last; ++frame) numbers.push_back(frame);
    }
    std::vector<CheckedOutput> outputs;
    for (const int frame : numbers) {
        const auto found = on_disk.find(frame);
        outputs.push_back(
            looked_at(frame, found == on_disk.end() ? pattern.format(frame) : found->second));
    }
    std::string settings = of_most(outputs, [](const CheckedOutput& one) { return one.settings; });
    const int most_by = of_most(outputs, renumbered_by);
    if (!like.empty()) {
        const CheckedOutput model = looked_at(0, like);
        if (model.settings.empty())
            return Status(StatusCode::input, "{like}: "_keyed + like + ": " + model.why);
        settings = model.settings;
    }
    for (CheckedOutput& one : outputs) {
        if (one.state != OutputState::whole) continue;
        if (one.settings != settings) {
            one.state = OutputState::other;
            one.why = concat("made by ", one.settings, ", not by ", settings);
        } else if (one.made_as && renumbered_by(one) != most_by) {
            one.state = OutputState::foreign;
            one.why = concat("was made as frame ", *one.made_as, " and copied or renamed");
        }
    }
    return outputs;
}

namespace {

Json json_of(const CheckedOutput& one) {
    Json json = {{"frame", one.frame}, {"output", one.path}, {"state", name_of(one.state)}};
    if (!one.why.empty()) json["why"] = one.why;
    if (one.bytes > 0) json["bytes"] = one.bytes;
    if (!one.settings.empty()) json["settings"] = one.settings;
    if (one.sidecar.is_object())
        for (const char* key : {"outcome", "held_from", "times_ms", "warnings", "renderer"})
            if (const auto found = one.sidecar.find(key); found != one.sidecar.end())
                json[key] = *found;
    return json;
}

}  // namespace

Json checked_json(const std::string& pattern, const std::vector<CheckedOutput>& outputs) {
    Json list = Json::array(), counts = Json::object();
    for (const OutputState state : kOutputStates)
        counts[name_of(state)] = std::ranges::count(outputs, state, &CheckedOutput::state);
    for (const CheckedOutput& one : outputs) list.push_back(json_of(one));
    return {{"output", pattern}, {"counts", counts}, {"frames", list}};
}

}  // namespace postchain::sequence
