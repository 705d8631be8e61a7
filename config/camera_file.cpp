#include "config/camera_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <new>
#include <unordered_set>

#include "config/reporter.h"
#include "config/scalar.h"
#include "config/text_tree.h"

namespace postchain {
namespace {

// Room for a matrix per frame of about ten thousand frames.
constexpr TextLimits kCameraLimits = {
    .bytes = size_t(64) << 20, .nodes = 250'000, .frame_keys = true};

// The letters and digits of a key, in lower case: "focalLength_mm" -> "focallengthmm".
std::string letters_of(const std::string& key) {
    std::string letters;
    for (const unsigned char c : key)
        if (std::isalnum(c)) letters += char(std::tolower(c));
    return letters;
}

// Number of letters that only one of the two words has; 0 if two letters are swapped.
size_t letters_apart(const std::string& a, const std::string& b) {
    std::array<int, 256> count = {};
    for (unsigned char c : a) ++count[c];
    for (unsigned char c : b) --count[c];
    size_t apart = 0;
    for (int n : count) apart += size_t(std::abs(n));
    return apart;
}

// The known key that a user may have meant: misspelt, or in another form or unit. Empty if none:
// other programs' keys may be near, but have other letters (fov and fps).
std::string meant_key(const std::string& key, const std::vector<std::string>& known) {
    std::vector<std::string> forms;
    for (const std::string& one : known) forms.push_back(letters_of(one));
    const std::string given = letters_of(key), near = nearest_word(given, forms);
    if (near.empty() || letters_apart(given, near) > given.size() / 3) return "";
    return known[size_t(std::ranges::find(forms, near) - forms.begin())];
}

constexpr const char* kShutterAngle = "shutter_angle_deg";
constexpr const char* kShutterPosition = "shutter_position";

// Keys whose values change what a camera sees, and that no pass supports: what is missing without
// them. A value that has no effect (0, false, an empty list) is not reported.
struct UnsupportedKey {
    const char* key;
    const char* lost;
};
constexpr const char* kNotShifted =
    "vectors from the camera's matrices, ray distances and the cat's eye are those of a lens that "
    "is "
    "not shifted";
constexpr UnsupportedKey kUnsupportedKeys[] = {
    {"shutter_offset", "the shutter is placed by shutter_position: start, center or end"},
    {"shutter_curve", "the shutter opens and closes at once"},
    {"shutter_efficiency", "the shutter opens and closes at once"},
    {"rolling_shutter", "every row is exposed at the same time"},
    {"rolling_shutter_type", "every row is exposed at the same time"},
    {"lens_shift", kNotShifted},
    {"shift_x", kNotShifted},
    {"shift_y", kNotShifted},
};

bool has_effect(const TextNode& node) {
    if (node.is_list()) return std::any_of(node.items.begin(), node.items.end(), has_effect);
    if (node.is_map()) return !node.entries.empty();
    if (node.is_null() || node.text == "false" || node.text == "NONE" || node.text == "none")
        return false;
    const auto number = number_of(node);
    return !number.ok() || *number != 0;
}

// "Centre on Frame" -> "center": the words of renderers' interfaces.
std::string position_word(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (text.ends_with(" on frame")) text.resize(text.size() - std::string(" on frame").size());
    return text == "centre" || text == "centered" || text == "centred" ? "center" : text;
}

const std::vector<std::string> kFitNames = {"horizontal", "vertical", "auto"};

class CameraParser {
  public:
    explicit CameraParser(CameraFile& file)
        : file_(file), reporter_(file.file_name, StatusCode::input, file.diagnostics) {}

    void parse(const TextNode& root) {
        if (!root.is_map())
            return reporter_.error(
                root, "", "a camera file is a map of camera values, not " + root.describe());
        for (const auto& [key, value] : root.entries) {
            if (lens(key, key.text, value, file_.camera, file_.sensor_fit, file_.origins)) continue;
            if (key.text == "resolution")
                resolution(value);
            else if (key.text == "fps")
                fps(value);
            else if (key.text == "frames")
                frames(value);
            else if (key.text == "camera_matrix_world")
                matrices(value);
            else
                unknown(key, value, key.text);
        }
        complete(root, "", file_.camera);
        report_empty(root);
        report_ignored();
    }

  private:
    // Reads a key that a single frame may override too. False for other keys.
    bool lens(const TextNode& name, const std::string& path, const TextNode& node, Camera& camera,
              std::optional<SensorFit>& fit, Origins& origins) {
        const std::string& key = name.text;
        if (key == "sensor_fit") {
            const auto found = std::find(kFitNames.begin(), kFitNames.end(), node.text);
            if (!node.is_scalar() || found == kFitNames.end())
                reporter_.error(node, path,
                                node.describe() + "; sensor_fit is one of " + joined(kFitNames));
            else
                fit = SensorFit(found - kFitNames.begin());
            return true;
        }
        const bool angle = key == kShutterAngle;
        const Parameter* row = camera_parameters().find(angle ? "shutter_frames" : key);
        if (!row) return false;
        TextNode value = node;
        if (key == kShutterPosition) value.text = position_word(value.text);
        const Status status = angle ? shutter_angle(*row, node, camera)
                                    : set_row(camera_parameters(), &camera, *row, value);
        if (!status.ok()) reporter_.error(node, path, status.message());
        if (row->get(&camera) == ParameterValue()) return true;  // null
        const Origin origin = {kFromCameraFile, concat(file_.file_name, ":", name.line)};
        if (!origins.emplace(row->key, origin).second)
            reporter_.error(
                name, path,
                "shutter_frames and shutter_angle_deg are both given; give one of them");
        return true;
    }

    static Status shutter_angle(const Parameter& row, const TextNode& node, Camera& camera) {
        ASSIGN_OR_RETURN(const double degrees, number_of(node));
        if (Status status = row.check(degrees / 360); !status.ok())
            return status.at(concat(degrees, " degrees are ", degrees / 360, " frames"));
        row.set(&camera, degrees / 360);
        return Status();
    }

    // After all values of one object have been read.
    void complete(const TextNode& node, const std::string& path, Camera& camera) {
        if (Status status = camera_parameters().check(&camera); !status.ok())
            reporter_.error(node, path, status.message());
        resolve_files(camera, file_.file_name);
    }

    static Result<int> integer(const TextNode& node) {
        return integer_of(node, std::numeric_limits<int>::min(), std::numeric_limits<int>::max());
    }
    // A key spells a frame number. JSON quotes every key.
    static Result<int> frame_number(TextNode key) {
        key.quoted = false;
        return integer(key);
    }

    void resolution(const TextNode& node) {
        std::array<int, 2> size = {0, 0};
        bool good = node.is_list() && node.items.size() == 2;
        for (size_t i = 0; good && i < 2; ++i) {
            const Result<int> side = integer(node.items[i]);
            good = side.ok() && *side > 0;
            if (good) size[i] = *side;
        }
        if (!good)
            return reporter_.error(node, "resolution",
                                   "resolution is a list of two integers >= 1, width and height");
        file_.resolution = size;
    }

    void fps(const TextNode& node) {
        const Result<double> value = number_of(node);
        if (!value.ok() || !(*value > 0))
            return reporter_.error(node, "fps", node.describe() + "; fps is a number > 0");
        file_.fps = *value;
    }

    void frames(const TextNode& node) {
        if (node.is_list()) {  // informative
            for (size_t i = 0; i < node.items.size(); ++i)
                if (!integer(node.items[i]).ok())
                    reporter_.error(node.items[i], concat("frames[", i, "]"),
                                    node.items[i].describe() + " is not a frame number");
            return;
        }
        if (!node.is_map())
            return reporter_.error(node, "frames",
                                   node.describe() +
                                       "; frames is a list of frame numbers, or a "
                                       "map from frame number to values");
        std::unordered_set<int> given;
        for (const auto& [key, value] : node.entries) {
            const std::string path = "frames." + key.text;
            const Result<int> number = frame_number(key);
            if (!number.ok()) {
                reporter_.error(key, path, "'" + key.text + "' is not a frame number");
            } else if (!given.insert(*number).second) {
                reporter_.error(key, path, concat("frame ", *number, " is already given"));
            } else if (!value.is_map()) {
                reporter_.error(value, path, value.describe() + "; a frame is a map of values");
            } else if (!value.entries.empty()) {
                CameraFile::Frame& frame = file_.frames[*number];
                for (const auto& [name, v] : value.entries)
                    if (!lens(name, path + "." + name.text, v, frame.camera, frame.sensor_fit,
                              frame.origins))
                        unknown(name, v, path + "." + name.text);
                complete(value, path, frame.camera);
            }
        }
    }

    // An unreadable matrix is not an error: other programs use this key too.
    void matrices(const TextNode& node) {
        const auto ignored = [&](const TextNode& at, const std::string& why) {
            reporter_.warning(at, "camera_matrix_world", "ignored: " + why);
        };
        if (!node.is_map()) return ignored(node, "not a map from frame numbers to matrices");
        for (const auto& [key, value] : node.entries) {
            const Result<int> frame = frame_number(key);
            const std::optional<Rotation> found = rotation(value);
            if (!frame.ok())
                ignored(key, "'" + key.text + "' is not a frame number");
            else if (!found)
                ignored(value, concat("the matrix of frame ", *frame,
                                      " does not consist of rotation, scale and translation: three "
                                      "rows of three or four numbers, then [0, 0, 0, 1] or "
                                      "nothing"));
            else
                file_.rotations[*frame] = *found;
            if (!frame.ok() || !found) continue;
            if (const auto at = place(value)) file_.places[*frame] = *at;
        }
    }

    // The fourth column of a matrix with a rotation: the camera's position.
    static std::optional<std::array<double, 3>> place(const TextNode& node) {
        std::array<double, 3> at;
        for (size_t row = 0; row < 3; ++row) {
            if (node.items[row].items.size() < 4) return std::nullopt;
            const auto value = number_of(node.items[row].items[3]);
            if (!value.ok()) return std::nullopt;
            at[row] = *value;
        }
        return at;
    }

    static bool is_last_row(const TextNode& node) {
        for (size_t column = 0; column < 4; ++column)
            if (const auto value = number_of(node.items[column]);
                !value.ok() || *value != (column == 3 ? 1 : 0))
                return false;
        return true;
    }

    // 3 x 3, 3 x 4 or 4 x 4 numbers. Removes the scale of the columns.
    static std::optional<Rotation> rotation(const TextNode& node) {
        const size_t rows = node.is_list() ? node.items.size() : 0;
        if (rows != 3 && rows != 4) return std::nullopt;
        const size_t columns = node.items[0].items.size();
        if (columns != 4 && (columns != 3 || rows == 4)) return std::nullopt;
        for (const TextNode& row : node.items)
            if (row.items.size() != columns) return std::nullopt;
        // A transposed matrix has the position here.
        if (rows == 4 && !is_last_row(node.items[3])) return std::nullopt;
        Rotation r;
        for (size_t row = 0; row < 3; ++row) {
            const TextNode& values = node.items[row];
            for (size_t column = 0; column < 3; ++column) {
                const auto value = number_of(values.items[column]);
                if (!value.ok()) return std::nullopt;
                r[row][column] = *value;
            }
        }
        return without_scale(r).empty() ? std::optional(r) : std::nullopt;
    }

    // Keys of other programs are ignored. A key close to a known one gets a warning; so does a
    // known one among the values of a frame.
    void unknown(const TextNode& key, const TextNode& value, const std::string& path) {
        std::vector<std::string> known = {
            "resolution", "fps", "frames", "sensor_fit", "camera_matrix_world", kShutterAngle};
        for (const auto& row : camera_parameters().rows()) known.push_back(row.key);
        if (std::ranges::find(known, key.text) != known.end())
            return reporter_.warning(key, path, "ignored: belongs at the top of the file");
        for (const auto& one : kUnsupportedKeys)
            if (key.text == one.key) {
                if (has_effect(value))
                    reporter_.warning(
                        key, path, concat("ignored: ", key.text, " is not supported: ", one.lost));
                return;
            }
        if (const std::string meant = meant_key(key.text, known); !meant.empty())
            return reporter_.warning(
                key, path,
                "ignored: unknown key '" + key.text + "' (did you mean '" + meant + "'?)");
        if (ignored_.empty()) first_ignored_ = key;
        if (std::find(ignored_.begin(), ignored_.end(), key.text) == ignored_.end())
            ignored_.push_back(key.text);
    }

    // A file without any camera value is probably the wrong file.
    void report_empty(const TextNode& root) {
        if (!file_.diagnostics.empty()) return;  // a wrong key or value has been reported
        bool any = file_.camera != Camera() || !file_.rotations.empty();
        for (const auto& [number, frame] : file_.frames) any = any || frame.camera != Camera();
        if (any) return;
        std::vector<std::string> keys;
        for (const auto& row : camera_parameters().rows()) keys.push_back(row.key);
        reporter_.warning(root, "", "no camera value in this file; known are " + joined(keys));
    }

    void report_ignored() {
        if (ignored_.empty()) return;
        constexpr size_t kShown = 20;
        const size_t more = ignored_.size() > kShown ? ignored_.size() - kShown : 0;
        if (more > 0) ignored_.resize(kShown);
        reporter_.note(first_ignored_, "",
                       "ignored keys: " + joined(ignored_) +
                           (more > 0 ? concat(" and ", more, " more") : std::string()));
    }

    CameraFile& file_;
    Reporter reporter_;
    std::vector<std::string> ignored_;
    TextNode first_ignored_;
};

}  // namespace

void resolve_files(Camera& camera, const std::string& file_name) {
    namespace fs = std::filesystem;
    if (camera.aperture_image.is_read() || camera.aperture_image.file().empty()) return;
    std::error_code failed;
    const fs::path named = fs::path(file_name).parent_path() / camera.aperture_image.file();
    const fs::path whole = fs::absolute(named, failed);
    camera.aperture_image = BokehKernel((failed ? named : whole).lexically_normal().string());
}

double horizontal_sensor_width_mm(double sensor_mm, SensorFit fit, const Display& display) {
    const double width = display.width * display.pixel_aspect;  // in heights of a pixel
    const double height = display.height;
    if (!(width > 0) || !(height > 0)) return sensor_mm;
    const bool spans_height =
        fit == SensorFit::vertical || (fit == SensorFit::larger_side && height > width);
    return spans_height ? sensor_mm * width / height : sensor_mm;
}

bool CameraFile::zooms() const {
    return std::any_of(frames.begin(), frames.end(), [](const auto& one) {
        return one.second.camera.focal_length_mm.has_value();
    });
}

Camera CameraFile::camera_for(int frame, const Display& display) const {
    Camera result = camera;
    SensorFit fit = sensor_fit.value_or(SensorFit::horizontal);
    if (const auto found = frames.find(frame); found != frames.end()) {
        result = result.overlaid_by(found->second.camera);
        fit = found->second.sensor_fit.value_or(fit);
    }
    if (result.sensor_width_mm)
        result.sensor_width_mm = horizontal_sensor_width_mm(*result.sensor_width_mm, fit, display);
    return result;
}

Origins CameraFile::origins_for(int frame) const {
    Origins all = origins;
    if (const auto found = frames.find(frame); found != frames.end())
        for (const auto& [key, origin] : found->second.origins) all[key] = origin;
    return all;
}

std::optional<Diagnostic> CameraFile::check_resolution(const Display& display) const {
    if (!resolution || (*resolution == std::array<int, 2>{display.width, display.height}))
        return std::nullopt;
    return Diagnostic{
        file_name,
        0,
        0,
        Severity::warning,
        "resolution",
        concat((*resolution)[0], "x", (*resolution)[1], " is not the display size ", display.width,
               "x", display.height, " of the frames; check that this is their camera file"),
        StatusCode::input};
}

namespace {

// As parse_camera(), but throws if memory runs out.
CameraFile read_camera(std::string_view text, const std::string& file_name) {
    CameraFile file;
    file.file_name = file_name;
    file.text_hash = hash_text(std::string(text));
    TextTree tree = read_text_tree(text, file_name, StatusCode::input, kCameraLimits);
    file.diagnostics = std::move(tree.diagnostics);
    if (!tree.root.is_null()) CameraParser(file).parse(tree.root);
    sort_by_place(file.diagnostics);
    return file;
}

}  // namespace

std::string without_scale(Rotation& rotation) {
    const auto dot = [&](size_t i, size_t j) {
        double sum = 0;
        for (const auto& row : rotation) sum += row[i] * row[j];
        return sum;
    };
    for (size_t i = 0; i < 3; ++i) {
        const double length = std::sqrt(dot(i, i));
        if (!(length > 0) || !std::isfinite(length)) return "singular";
        for (auto& row : rotation) row[i] /= length;
    }
    constexpr double kSquare = 1e-3;
    const bool square = std::abs(dot(0, 1)) <= kSquare && std::abs(dot(0, 2)) <= kSquare &&
                        std::abs(dot(1, 2)) <= kSquare;
    return square ? "" : "its axes are not at right angles";
}

CameraFile parse_camera(std::string_view text, const std::string& file_name) {
    try {
        return read_camera(text, file_name);
    } catch (const std::bad_alloc&) {
        CameraFile file;
        file.file_name = file_name;
        file.diagnostics = out_of_memory_in(file_name);
        return file;
    }
}

Result<CameraFile> load_camera(const std::string& path) try {
    ASSIGN_OR_RETURN(const std::string text,
                     read_text_file(path, StatusCode::input, kCameraLimits));
    return parse_camera(text, path);
} catch (...) {
    return status_of_exception(path);
}

Camera frame_camera(const Camera& metadata, const CameraFile* file, int frame,
                    const Display& display) {
    return file ? metadata.overlaid_by(file->camera_for(frame, display)) : metadata;
}

}  // namespace postchain
