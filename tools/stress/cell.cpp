#include "tools/stress/cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "chain/frame/convert.h"

namespace postchain::stress {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kNearW = 0.5f;  // inverse depth of the object: at 2 units
constexpr float kFarW = 0.1f;   // inverse depth of the ground: at 10 units, in focus

// Smooth waves of unrelated wavelengths under hard bars, in 0..1, four channels: edges without the
// exact ties of noise. `contrast` 1 = full; 0.01 is below every edge threshold.
ImageF picture(int width, int height, double contrast = 1) {
    ImageF image(width, height, 4);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const bool bar = std::sin(0.77 * x + 0.29 * y) > 0.4;
            for (int c = 0; c < 4; ++c) {
                double value = 0.16 * std::sin(0.413 * x + 0.217 * y + 1.7 * c) +
                               0.12 * std::sin(0.131 * x - 0.563 * y + 1.1 * c);
                if (bar) value -= 0.2;
                image.at(x, y, c) = float(0.5 + contrast * value);
            }
        }
    }
    return image;
}

using Vector = std::array<double, 2>;

// A near square in the center third over far ground, each with its half-velocity.
struct Scene {
    int width = 80;
    int height = 40;
    // No tap of any count falls exactly between two pixels, where rounding would be a tie.
    Vector object = {8.033, -5.071};
    Vector ground = {-3.017, 2.029};
    float object_w = kNearW;
    float ground_w = kFarW;
    double contrast = 1;
};

FramePlanes planes_of(const Scene& scene) {
    FramePlanes planes;
    planes[Role::color] = picture(scene.width, scene.height, scene.contrast);
    ImageF depth(scene.width, scene.height, 1, scene.ground_w);
    ImageF motion(scene.width, scene.height, 2);
    const double scale = 2 / kShutterFrames;
    for (int y = 0; y < scene.height; ++y) {
        for (int x = 0; x < scene.width; ++x) {
            const bool object = 3 * x >= scene.width && 3 * x < 2 * scene.width &&
                                3 * y >= scene.height && 3 * y < 2 * scene.height;
            if (object) depth.at(x, y) = scene.object_w;
            const Vector& v = object ? scene.object : scene.ground;
            motion.at(x, y, 0) = float(scale * v[0]);
            motion.at(x, y, 1) = float(scale * v[1]);
        }
    }
    planes[Role::inverse_depth] = std::move(depth);
    planes[Role::motion] = std::move(motion);
    return planes;
}

// Computes bounds and health; adds a 50 mm lens at f/2 for a display at least 640 px wide, so that
// the object's circle of confusion is several pixels even in a small frame.
InputHealth describe(MatrixCell& cell, const ConvertOptions& options) {
    cell.frame.display_width = std::max(640, cell.planes.at(Role::color).width);
    cell.frame.display_height = std::max(360, cell.planes.at(Role::color).height);
    cell.frame.frame_number = 1;
    cell.frame.camera.focal_length_mm = 50;
    cell.frame.camera.sensor_width_mm = 36;
    cell.frame.camera.f_stop = 2;
    cell.frame.camera.focus_distance = 10;
    cell.frame.camera.shutter_frames = kShutterFrames;
    // Cannot fail: the planes have one size and the encodings need no camera. If it did, the plan
    // would fail too, because the size is missing.
    const auto health = convert_frame(cell.planes, cell.frame, options);
    if (!health.ok()) cell.frame.width = 0;
    return health.ok() ? *health : InputHealth();
}

MatrixCell cell_of(std::string row, std::string name, FramePlanes planes, bool reduced) {
    MatrixCell cell;
    cell.row = std::move(row);
    cell.name = std::move(name);
    cell.planes = std::move(planes);
    cell.reduced = reduced;
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    describe(cell, options);
    return cell;
}

void scale_color(ImageF& color, double scale, double offset) {
    for (float& value : color.data) value = float((double(value) + offset) * scale);
}

// One bright pixel in the center of a black image.
void put_firefly(ImageF& color, float value) {
    std::ranges::fill(color.data, 0.0f);
    std::fill_n(color.pixel(color.width / 2, color.height / 2), 4, value);
}

// Columns of 8 px, alternating between the two values.
void put_columns(ImageF& color, double dark, double bright) {
    for (int y = 0; y < color.height; ++y)
        for (int x = 0; x < color.width; ++x)
            for (int c = 0; c < 4; ++c)
                color.at(x, y, c) = float(double(color.at(x, y, c)) * (x / 8 % 2 ? bright : dark));
}

class Builder {
  public:
    explicit Builder(int tile_px) : tile_(tile_px) {
        base_.width = 2 * tile_px;
        base_.height = tile_px;
    }

    std::vector<MatrixCell> all() {
        nothing();
        paths();
        speeds();
        depths();
        radiances();
        lenses();
        sizes();
        nonfinite();
        denormals();
        crossed();
        return std::move(cells_);
    }

  private:
    MatrixCell& add(const char* row, std::string name, const Scene& scene, bool reduced = false) {
        cells_.push_back(cell_of(row, std::move(name), planes_of(scene), reduced));
        return cells_.back();
    }

    void nothing() {
        Scene scene = base_;
        scene.object = scene.ground = {0, 0};
        scene.object_w = kFarW;
        for (double contrast : {1.0, 0.01}) {
            scene.contrast = contrast;
            MatrixCell& cell =
                add("nothing", contrast == 1 ? "still, in focus" : "still, in focus, no edges",
                    scene, true);
            cell.still = cell.in_focus = true;
            cell.soft = contrast < 1;
        }
    }

    // Difficult cases for the search of the surface at a pixel.
    void paths() {
        Scene flat = base_;
        flat.ground = flat.object;
        flat.ground_w = flat.object_w;
        add("paths", "one motion, one depth", flat, true);
        const auto with_back = [&](std::string name, double part) {
            FramePlanes planes = planes_of(base_);
            planes[Role::motion_back] = planes[Role::motion];
            for (float& v : planes[Role::motion_back].data) v *= float(part);
            cells_.push_back(cell_of("paths", std::move(name), std::move(planes), true));
        };
        with_back("turn back within the shutter", -1);
        with_back("start from rest", 0);
        // Neighbors move so far apart that at most pixels no surface is found.
        FramePlanes planes = planes_of(base_);
        ImageF& motion = planes[Role::motion];
        for (int y = 0; y < motion.height; ++y) {
            for (int x = 0; x < motion.width; ++x) {
                motion.at(x, y, 0) = float(5.03 * (x - 0.37 * motion.width));
                motion.at(x, y, 1) = float(5.03 * (y - 0.61 * motion.height));
            }
        }
        cells_.push_back(cell_of("paths", "apart, nothing found", std::move(planes), true));
    }

    // Along a slanted direction, so that no axis is special; and across it.
    static Vector slant(double v) { return {0.8 * v, 0.6 * v}; }
    static Vector across(double v) { return {-0.6 * v, 0.8 * v}; }

    void speeds() {
        const std::array<double, 9> speeds = {0, 1e-6,          0.499, 0.5, 0.501,
                                              1, double(tile_), 1e3,   1e6};
        for (double v : speeds) {
            const std::string px = concat(v, " px");
            const bool still = v <= 0.5;
            Scene scene = base_;
            scene.object = slant(v);
            scene.ground = {0, 0};
            add("speed", "object " + px + ", ground still", scene,
                v == 0.5 || v == 0.501 || v == tile_ || v == 1e6)
                .still = still;
            scene.ground = slant(v);
            add("speed", "all " + px, scene, v == 1e6).still = still;
            scene.ground = slant(-v);
            add("speed", "antiparallel " + px, scene, v == 1 || v == 1e6).still = still;
            scene.ground = across(1e6);
            add("speed", "object " + px + ", ground 1e6 px across", scene, v == 0.501);
            scene.ground = across(1);
            add("speed", "object " + px + ", ground 1 px across", scene);
        }
        // Large enough to have tiles with and without the object nearby: only then can their grid
        // show.
        for (double v : {1.0, double(tile_), 1e6}) {
            Scene scene = base_;
            scene.width = 6 * tile_;
            scene.object = slant(v);
            add("speed", concat("object ", v, " px, ground 3.6 px, 6 tiles"), scene, v == tile_);
        }
    }

    void depths() {
        const std::array<double, 9> ratios = {1 + 1e-7, 1 + 1e-4, 1.02, 2,   1e2,
                                              1e4,      1e8,      1e15, 1e30};
        for (double ratio : ratios) {
            Scene scene = base_;
            // Ratios caused by a near object; the ground's inverse depth falls to 1e-30.
            scene.object_w = ratio < 2 ? float(kFarW * ratio) : 1.0f;
            scene.ground_w = ratio < 2 ? kFarW : float(1 / ratio);
            add("depth", concat("ratio ", ratio < 2 ? concat("1+", ratio - 1) : concat(ratio)),
                scene, ratio < 1.00001 || ratio == 1e30);
            std::swap(scene.object_w, scene.ground_w);
            add("depth",
                concat("ratio ", ratio < 2 ? concat("1+", ratio - 1) : concat(ratio),
                       ", object behind"),
                scene);
        }
        Scene scene = base_;
        scene.object_w = scene.ground_w = kFarW;
        add("depth", "equal, in focus", scene, true).in_focus = true;
        scene.object_w = scene.ground_w = kNearW;
        add("depth", "equal, out of focus", scene);
        scene.object_w = 10;  // near plane at 0.1 units
        scene.ground_w = 0;
        add("depth", "near plane before sky", scene, true);
        scene.object_w = 1e30f;
        add("depth", "1e-30 units before sky", scene);
        scene.object_w = 0;
        scene.ground_w = 10;
        add("depth", "sky in near plane", scene);
        scene.ground_w = 0;
        add("depth", "all sky", scene, true);
    }

    void radiances() {
        const auto scaled = [&](std::string name, double scale, double offset, bool reduced) {
            FramePlanes planes = planes_of(base_);
            scale_color(planes[Role::color], scale, offset);
            cells_.push_back(cell_of("radiance", std::move(name), std::move(planes), reduced));
        };
        scaled("0", 0, 0, false);
        scaled("1e-8", 1e-8, 0, true);
        scaled("65504", 65504, 0, true);
        scaled("1e10", 1e10, 0, true);
        scaled("negative", 1, -2, true);
        scaled("both signs", 1, -0.5, false);
        scaled("both signs, 1e10", 1e10, -0.5, false);
        for (float value : {1.0f, 65504.0f, 1e10f}) {
            FramePlanes planes = planes_of(base_);
            put_firefly(planes[Role::color], value);
            cells_.push_back(cell_of(
                "radiance", concat("firefly ", value < 1e9f ? concat(value) : "1e10", " in black"),
                std::move(planes), value > 1e9f));
        }
    }

    void lenses() {
        for (double f_stop : {0.1, 0.7, 2.0, 22.0, 1e3, 1e6}) {
            for (double focus : {0.1, 10.0, 1e30}) {
                Scene scene = base_;
                scene.object_w = 10;  // at the near plane, 0.1 units
                MatrixCell& cell = add("lens",
                                       concat("f/", f_stop, ", focus at ",
                                              focus == 0.1  ? "the near plane"
                                              : focus < 1e3 ? "the ground"
                                                            : "infinity"),
                                       scene, focus == 10 ? f_stop == 1e6 : f_stop == 0.1);
                cell.frame.camera.f_stop = f_stop;
                cell.frame.camera.focus_distance = focus;
                cell.frame.camera.near_clip = 0.1;
                cell.in_focus = f_stop == 1e6;
            }
        }
    }

    void sizes() {
        const int r = tile_;
        const std::vector<std::array<int, 2>> sizes = {
            {1, 1},         {1, 61},        {61, 1},        {41, 31},   {97, 61},   {r - 1, r - 1},
            {r + 1, r + 1}, {r - 1, 2 * r}, {2 * r + 1, r}, {3 * r, r}, {16384, 1}, {16384, 3}};
        for (const auto& [width, height] : sizes) {
            Scene scene = base_;
            scene.width = width;
            scene.height = height;
            add("size", concat(width, "x", height), scene,
                height == 1 || (width == 41 && height == 31) || width == r + 1);
        }
    }

    // The extremes of all rows in one neighborhood: speeds x depths x radiance x lenses; some also
    // at awkward sizes and with bad pixels.
    void crossed() {
        struct Speed {
            const char* name;
            Vector object, ground;
        };
        struct Depth {
            const char* name;
            float object, ground;
        };
        struct Radiance {
            const char* name;
            void (*put)(ImageF&);
        };
        const std::array<Speed, 3> speeds = {{{"1e6 px against 1e6 px", slant(1e6), slant(-1e6)},
                                              {"0.501 px over 1e6 px", slant(0.501), across(1e6)},
                                              {"1e6 px over 1e-6 px", slant(1e6), across(1e-6)}}};
        const std::array<Depth, 3> depths = {{{"near plane before sky", 10, 0},
                                              {"sky in near plane", 0, 10},
                                              {"depth ratio 1e30", 1, 1e-30f}}};
        const std::array<Radiance, 3> radiances = {
            {{"firefly 1e10", [](ImageF& color) { put_firefly(color, 1e10f); }},
             {"1e-8 beside 1e10", [](ImageF& color) { put_columns(color, 1e-8, 1e10); }},
             {"both signs, 65504", [](ImageF& color) { scale_color(color, 65504, -0.5); }}}};
        const std::array<double, 2> focus = {0.1, 1e30};
        const auto cross = [&](size_t v, size_t d, size_t l, size_t f, int width, int height) {
            Scene scene = base_;
            scene.object = speeds[v].object;
            scene.ground = speeds[v].ground;
            scene.object_w = depths[d].object;
            scene.ground_w = depths[d].ground;
            if (width > 0) {
                scene.width = width;
                scene.height = height;
            }
            FramePlanes planes = planes_of(scene);
            radiances[l].put(planes[Role::color]);
            // Each value of each row appears in at least one cell of the reduced set.
            const bool reduced = width == 0 && d == v && l == v && f == v % 2;
            cells_.push_back(
                cell_of("crossed",
                        concat(speeds[v].name, ", ", depths[d].name, ", ", radiances[l].name,
                               ", f/0.1 at ", f == 0 ? "the near plane" : "infinity",
                               width > 0 ? concat(", ", width, "x", height) : ""),
                        std::move(planes), reduced || (height > 1 && width == 41)));
            Camera& camera = cells_.back().frame.camera;
            camera.f_stop = 0.1;
            camera.focus_distance = focus[f];
            camera.near_clip = 0.1;
        };
        for (size_t v = 0; v < speeds.size(); ++v)
            for (size_t d = 0; d < depths.size(); ++d)
                for (size_t l = 0; l < radiances.size(); ++l)
                    for (size_t f = 0; f < focus.size(); ++f) cross(v, d, l, f, 0, 0);
        for (const auto& [width, height] : std::vector<std::array<int, 2>>{
                 {1, 1}, {1, 61}, {61, 1}, {41, 31}, {tile_ - 1, tile_ + 1}, {16384, 3}})
            cross(0, 0, 1, 0, width, height);
        add_nonfinite("crossed", "1e6 px against 1e6 px, nan in every plane",
                      {slant(1e6), slant(-1e6)},
                      {Role::color, Role::inverse_depth, Role::motion, Role::motion_back}, kNan,
                      NonfiniteColor::zero, true);
    }

    void nonfinite() {
        struct Plane {
            const char* name;
            Role role;
        };
        const std::array<Plane, 4> planes = {{{"color", Role::color},
                                              {"depth", Role::inverse_depth},
                                              {"motion", Role::motion},
                                              {"motion_back", Role::motion_back}}};
        for (const auto& [name, role] : planes) {
            for (float value : {kNan, kInf, -kInf})
                add_nonfinite("nonfinite", concat(value, " in ", name), {}, {role}, value,
                              NonfiniteColor::zero, std::isnan(value) && role == Role::color);
        }
        const std::vector<Role> every = {Role::color, Role::inverse_depth, Role::motion,
                                         Role::motion_back};
        add_nonfinite("nonfinite", "nan in every plane", {}, every, kNan, NonfiniteColor::zero,
                      true);
        add_nonfinite("nonfinite", "inf in color, clamped", {}, {Role::color}, kInf,
                      NonfiniteColor::clamp, true);
    }

    // Numbers below 1.2e-38, which devices may read as 0.
    void denormals() {
        constexpr double kTiny = 1e-40;
        const auto with = [&](std::string name, const Scene& scene, double color, bool reduced) {
            FramePlanes planes = planes_of(scene);
            scale_color(planes[Role::color], color, 0);
            cells_.push_back(cell_of("denormal", std::move(name), std::move(planes), reduced));
        };
        with("color of 5e-39", base_, 5e-39, true);  // 22 bits are left
        Scene scene = base_;
        scene.ground = slant(kTiny);
        with("motion of 1e-40 px", scene, 1, false);
        scene.ground_w = float(kTiny);
        with("motion and inverse depth of 1e-40", scene, 1, true);
    }

    // Depth is given as linear distance here, as in files; a tenth of all pixels are bad. `moves`:
    // object and ground, if they differ from the usual scene.
    void add_nonfinite(const char* row, std::string name, const std::vector<Vector>& moves,
                       const std::vector<Role>& roles, float value, NonfiniteColor policy,
                       bool reduced) {
        MatrixCell cell;
        cell.row = row;
        cell.name = std::move(name);
        cell.reduced = reduced;
        cell.checks_counts = true;
        Scene scene = base_;
        if (!moves.empty()) {
            scene.object = moves[0];
            scene.ground = moves[1];
        }
        cell.planes = planes_of(scene);
        cell.planes[Role::motion_back] = cell.planes[Role::motion];
        for (float& w : cell.planes[Role::inverse_depth].data) w = 1 / w;
        for (Role role : roles) {
            ImageF& plane = cell.planes[role];
            const size_t channels = size_t(plane.channels);
            for (size_t i = 3; i < plane.pixels(); i += 10) {
                plane.data[i * channels + i % channels] = value;
                // +Inf is a usual distance for sky, not a fault.
                if (role != Role::inverse_depth || value != kInf) ++cell.nonfinite_placed;
            }
        }
        ConvertOptions options;
        options.nonfinite_color = policy;
        cell.nonfinite_counted = describe(cell, options).nonfinite();
        cells_.push_back(std::move(cell));
    }

    int tile_;
    Scene base_;
    std::vector<MatrixCell> cells_;
};

}  // namespace

bool MatrixCell::is_quiet(RoleSet roles) const {
    // A hint is available if something moves.
    const bool moves =
        roles.has(Role::motion) || roles.has(Role::motion_back) || roles.has(Role::hint);
    return (still || !moves) && (in_focus || !roles.has(Role::inverse_depth)) &&
           (soft || !roles.has(Role::color));
}

std::vector<MatrixCell> make_cells(int tile_px, bool reduced) {
    std::vector<MatrixCell> cells = Builder(tile_px).all();
    if (reduced) std::erase_if(cells, [](const MatrixCell& cell) { return !cell.reduced; });
    return cells;
}

}  // namespace postchain::stress
