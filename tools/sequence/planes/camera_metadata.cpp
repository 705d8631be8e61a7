#include "tools/sequence/planes/camera_metadata.h"

#include <ImathMatrix.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "config/camera_file.h"

namespace postchain::io {
namespace {

// For row vectors: a world point is multiplied from the left.
using Matrix4 = IMATH_NAMESPACE::M44d;

// Larger distances mean "no limit".
constexpr double kNoLimit = 1e9;

// By priority: of two that give the same value, the first is used. docs/profiles.md names the
// sources.
using Row = CameraAttribute;
constexpr Row kAttributes[] = {
    {"aperture", "OpenEXR", "f-number", "f_stop", ""},
    {"cameraFNumber", "V-Ray", "f-number", "f_stop", ""},
    {"tStop", "OpenEXR", "T-stop", "", "with the loss in the lens: it is not the f-number"},
    {"focus", "OpenEXR", "m", "focus_distance", "divided by meters_per_unit"},
    {"cameraTargetDistance", "V-Ray", "scene units", "",
     "the camera's target, which may be out of focus"},
    {"pinholeFocalLength", "OpenEXR", "mm", "focal_length_mm", ""},
    {"effectiveFocalLength", "OpenEXR", "mm", "focal_length_mm", ""},
    {"nominalFocalLength", "OpenEXR", "mm", "focal_length_mm", ""},
    {"cameraFocalLength", "V-Ray", "mm", "focal_length_mm", ""},
    {"nuke/camera/focal", "Nuke", "mm", "focal_length_mm", ""},
    {"Lens", "Blender", "mm", "focal_length_mm", "stamp, rounded to 0.01 mm"},
    {"cameraFov", "V-Ray", "degrees", "sensor_width_mm",
     "2 f tan(fov / 2): horizontal angle of the image"},
    {"cameraAperture", "V-Ray", "mm", "sensor_width_mm",
     "without cameraFov: the film's width, which may differ from the image's"},
    {"nuke/camera/haperture", "Nuke", "mm", "sensor_width_mm", ""},
    {"sensorAcquisitionRectangle", "OpenEXR", "photosites", "sensor_width_mm",
     "its width times sensorPhotositePitch"},
    {"sensorPhotositePitch", "OpenEXR", "micrometers", "", "only with sensorAcquisitionRectangle"},
    {"sensorOverallDimensions", "OpenEXR", "mm", "sensor_width_mm",
     "its width, without sensorAcquisitionRectangle: the whole sensor"},
    {"shutterAngle", "OpenEXR", "degrees", "shutter_frames", "divided by 360"},
    {"expTime", "OpenEXR", "s", "shutter_frames", "times captureRate, otherwise framesPerSecond"},
    {"captureRate", "OpenEXR", "frames per second", "", "only with expTime"},
    {"framesPerSecond", "OpenEXR", "frames per second", "",
     "only with expTime; without captureRate the playback rate"},
    {"cameraNearClip", "V-Ray", "scene units", "near_clip", "0: none"},
    {"cameraFarClip", "V-Ray", "scene units", "far_clip", "from 1e9 on: none"},
    {"worldToCamera", "OpenEXR, Arnold, RenderMan", "row vectors, scene units", "camera matrix",
     "x right, y up, looks along +z, left-handed"},
    {"worldToNDC", "OpenEXR, Arnold, RenderMan", "row vectors", "camera matrix",
     "with worldToCamera: focal length over image width, from 0..1 as documented, or from -1..1 "
     "if the center is 0; sensor_width_mm if a focal length is known"},
    {"cameraTransform", "V-Ray", "scene units", "camera matrix",
     "camera to world; x right, y up, looks along -z; of V-Ray for Maya x right, y back, z down"},
    {"nuke/camera/matrix", "Nuke", "rows, scene units", "camera matrix",
     "camera to world; x right, y up, looks along -z"},
};

// All numbers of a text, separated by spaces, brackets or commas; empty if it contains anything
// else.
std::vector<double> numbers_in(std::string_view text) {
    std::vector<double> values;
    while (!text.empty()) {
        if (const size_t skip = text.find_first_not_of(" ,[](){}\t\n"); skip > 0) {
            text.remove_prefix(std::min(skip, text.size()));
            continue;
        }
        if (text.starts_with("-(")) {  // between the corners of a box
            text.remove_prefix(1);
            continue;
        }
        double value = 0;
        const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
        if (read.ec != std::errc()) return {};
        text.remove_prefix(size_t(read.ptr - text.data()));
        // A rational is written as "24/1".
        if (text.starts_with('/')) {
            double divisor = 0;
            const auto below = std::from_chars(text.data() + 1, text.data() + text.size(), divisor);
            if (below.ec != std::errc()) return {};
            text.remove_prefix(size_t(below.ptr - text.data()));
            value /= divisor;
        }
        values.push_back(value);
    }
    return values;
}

// The matrix's inverse; empty if it is singular or not finite.
std::optional<Matrix4> inverse(const Matrix4& matrix) try {
    const Matrix4 m = matrix.gjInverse(true);
    const bool finite =
        std::all_of(m[0], m[0] + 16, [](double value) { return std::isfinite(value); });
    return finite ? std::optional(m) : std::nullopt;
} catch (const std::exception&) {
    return std::nullopt;
}

bool is_zero_row(const double* row) {
    return row[0] == 0 && row[1] == 0 && row[2] == 0;
}

// Sixteen finite numbers, or why not.
std::optional<Matrix4> matrix_in(const std::string& text, std::string& why) {
    const std::vector<double> values = numbers_in(text);
    if (values.size() != 16) {
        why = "not 16 numbers";
        return std::nullopt;
    }
    Matrix4 m;
    for (size_t i = 0; i < 16; ++i) {
        if (!std::isfinite(values[i])) {
            why = "not finite";
            return std::nullopt;
        }
        m[int(i / 4)][i % 4] = values[i];
    }
    return m;
}

class Reader {
  public:
    explicit Reader(const ExrPart& part) : part_(part) {}

    CameraMetadata read() {
        for (const Row& row : kAttributes) {
            const auto it = part_.attributes.find(row.name);
            if (it == part_.attributes.end()) continue;
            FoundAttribute found{&row, it->second, "", ""};
            if (row.gives == std::string_view("camera matrix"))
                matrix(found);
            else if (*row.gives == 0)
                helper(found);
            else
                value(found);
            result_.found.push_back(std::move(found));
        }
        return std::move(result_);
    }

  private:
    std::optional<double> number(const char* name, size_t index = 0) const {
        const auto it = part_.attributes.find(name);
        if (it == part_.attributes.end()) return std::nullopt;
        const std::vector<double> values = numbers_in(it->second);
        if (index >= values.size() || !std::isfinite(values[index])) return std::nullopt;
        return values[index];
    }
    std::optional<double> positive(const char* name, size_t index = 0) const {
        const auto value = number(name, index);
        return value && *value > 0 ? value : std::nullopt;
    }
    bool has(const char* name) const { return part_.attributes.contains(name); }

    void helper(FoundAttribute& found) const {
        const std::string_view name = found.row->name;
        if ((name == "captureRate" || name == "framesPerSecond") &&
            result_.origins.contains("shutter_frames") &&
            result_.origins.at("shutter_frames").where == concat("expTime, ", name))
            found.gives = "shutter_frames, with expTime";
        else if (name == "sensorPhotositePitch" && result_.origins.contains("sensor_width_mm") &&
                 result_.origins.at("sensor_width_mm").where.starts_with("sensorAcq"))
            found.gives = "sensor_width_mm, with sensorAcquisitionRectangle";
        else
            found.why = found.row->how;
    }

    // A row of the camera from one number.
    void value(FoundAttribute& found) {
        const std::string_view name = found.row->name;
        const std::string gives = found.row->gives;
        if (result_.origins.contains(gives)) {
            found.why = concat(result_.origins.at(gives).where, " counts");
            return;
        }
        std::string where = found.row->name;
        std::optional<double> amount = positive(found.row->name);
        if (!amount) {
            found.why = "not a number > 0";
        } else if (name == "cameraFov") {
            const auto& focal = result_.camera.focal_length_mm;
            if (!focal || *amount >= 180) {
                found.why = focal ? "not an angle below 180" : "no focal length is known";
                amount.reset();
            } else {
                amount = 2 * *focal * std::tan(*amount * std::numbers::pi / 360);
            }
        } else if (name == "sensorAcquisitionRectangle") {
            amount.reset();
        } else if (name == "shutterAngle") {
            amount = *amount / 360;
        } else if (name == "expTime") {
            const char* rate = positive("captureRate") ? "captureRate" : "framesPerSecond";
            if (const auto fps = positive(rate)) {
                amount = *amount * *fps;
                where = concat("expTime, ", rate);
            } else {
                found.why = "seconds, and the file has neither captureRate nor framesPerSecond";
                amount.reset();
            }
        } else if (name == "cameraFarClip" && *amount >= kNoLimit) {
            found.why = "no limit";
            amount.reset();
        }
        if (name == "sensorAcquisitionRectangle") {
            const auto from = number(found.row->name, 0), to = number(found.row->name, 2);
            const auto pitch = positive("sensorPhotositePitch");
            found.why.clear();
            if (!pitch)
                found.why = "sensorPhotositePitch is missing";
            else if (!from || !to || !(*to >= *from))
                found.why = "not a rectangle";
            else
                amount = (*to - *from + 1) * *pitch / 1000;
        }
        if (!amount) return;
        set(gives, *amount, where);
        found.gives = concat(gives, " = ", text_of(ParameterValue(*amount)));
        if (gives == "focus_distance") {
            result_.camera.metadata_focus_m = amount;
            found.gives = concat("focus_distance = ", text_of(ParameterValue(*amount)),
                                 " m / meters_per_unit");
        }
    }

    void set(const std::string& row, double amount, const std::string& where) {
        camera_parameters().find(row)->set(&result_.camera, amount);
        result_.origins[row] = {kFromMetadata, where};
    }

    void matrix(FoundAttribute& found) {
        const std::string_view name = found.row->name;
        if (name == "worldToNDC") return screen(found);
        if (result_.pose) {
            found.why = "another matrix counts";
            return;
        }
        auto m = matrix_in(found.text, found.why);
        if (!m) return;
        // Rows: the camera's axes in the world, and its place.
        if (name == "worldToCamera") {
            if (!is_zero_row(m->transposed()[3])) {
                found.why = "not an affine matrix of row vectors";
                return;
            }
            m = inverse(*m);
            if (!m) {
                found.why = "singular";
                return;
            }
            for (int k = 0; k < 4; ++k) (*m)[2][k] = -(*m)[2][k];
        } else {
            // Columns as documented; Imath's rows if the last row holds the position.
            if (is_zero_row((*m)[3])) {
                m->transpose();
            } else if (!is_zero_row(m->transposed()[3])) {
                found.why = "not an affine matrix";
                return;
            }
            if (name == "cameraTransform") {
                const auto version = part_.attributes.find("vrayInfo/vrayversion");
                if (version != part_.attributes.end() &&
                    version->second.find("Maya") != std::string::npos) {
                    for (int k = 0; k < 3; ++k) {
                        const double back = (*m)[1][k];
                        (*m)[1][k] = -(*m)[2][k];
                        (*m)[2][k] = back;
                    }
                }
            }
        }
        CameraPose pose;
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) pose.to_world[size_t(k)][size_t(i)] = (*m)[i][k];
            pose.position[size_t(i)] = (*m)[3][i];
        }
        found.why = without_scale(pose.to_world);
        if (!found.why.empty()) return;
        result_.pose = pose;
        found.gives = "camera matrix";
        if (name == "worldToCamera") from_camera_ = m;
    }

    // worldToNDC after worldToCamera: the image position of a point 45 degrees to the right.
    void screen(FoundAttribute& found) {
        const auto m = matrix_in(found.text, found.why);
        if (!m) return;
        if (!from_camera_) {
            found.why = "worldToCamera is missing or not used";
            return;
        }
        const Matrix4& camera = *from_camera_;
        const auto seen = [&](double x, double y) -> std::optional<std::array<double, 2>> {
            const auto world = [&](int k) {
                return camera[3][k] + (x * camera[0][k] + y * camera[1][k] - camera[2][k]);
            };
            const auto at = IMATH_NAMESPACE::V4d(world(0), world(1), world(2), 1) * *m;
            if (!(std::abs(at.w) > 1e-12)) return std::nullopt;
            return std::array{at.x / at.w, at.y / at.w};
        };
        const auto middle = seen(0, 0), right = seen(1, 0);
        if (!middle || !right) {
            found.why = "no perspective";
            return;
        }
        const auto is_at = [&](double place) {
            constexpr double kNear = 1e-3;
            return std::abs((*middle)[0] - place) < kNear && std::abs((*middle)[1] - place) < kNear;
        };
        double widths = 0;
        if (is_at(0.5))
            widths = (*right)[0] - (*middle)[0];
        else if (is_at(0))
            widths = ((*right)[0] - (*middle)[0]) / 2;
        else
            found.why = "the lens is shifted, or this is another picture's";
        if (found.why.empty() && !(widths > 0)) found.why = "no perspective";
        if (!found.why.empty()) return;
        result_.pose->focal_widths = widths;
        found.gives = concat("focal length = ", text_of(ParameterValue(widths)), " picture widths");
        if (result_.camera.focal_length_mm && !result_.camera.sensor_width_mm) {
            set("sensor_width_mm", *result_.camera.focal_length_mm / widths,
                "worldToNDC, worldToCamera");
            found.gives += concat(", sensor_width_mm = ",
                                  text_of(ParameterValue(*result_.camera.sensor_width_mm)));
        }
    }

    const ExrPart& part_;
    CameraMetadata result_;
    std::optional<Matrix4> from_camera_;  // rows: right, up, back, place
};

}  // namespace

std::string camera_attributes_as_markdown() {
    std::vector<std::pair<std::string, std::string>> values;
    for (const Row& row : kAttributes) {
        const std::string gives = *row.gives == 0 ? "not used"
                                  : std::string_view(row.gives) == "camera matrix"
                                      ? row.gives
                                      : concat("`", row.gives, "`");
        auto value = std::find_if(values.begin(), values.end(),
                                  [&](const auto& other) { return other.first == gives; });
        const bool is_first = value == values.end();
        if (is_first) value = values.insert(value, {gives, ""});
        value->second += concat(is_first ? "" : ", ", "`", row.name, "` (", row.writer, ", ",
                                row.unit, *row.how ? "; " : "", row.how, ")");
    }
    std::string text = "| value | attributes: the first has priority |\n|---|---|\n";
    for (const auto& [gives, attributes] : values)
        text += concat("| ", gives, " | ", attributes, " |\n");
    return text;
}

CameraMetadata camera_metadata(const ExrPart& part) {
    return Reader(part).read();
}

}  // namespace postchain::io
