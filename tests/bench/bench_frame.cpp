#include "tests/bench/bench_frame.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <glm/gtc/packing.hpp>
#include <thread>

#include "chain/frame/convert.h"
#include "chain/gl/transfers.h"
#include "chain/pass/work_list.h"

namespace postchain::bench {

void require(const Status& status) {
    if (!status.ok()) fail(status.message());
}

namespace {

using Tint = std::array<double, 3>;

// A pixel's surface: inverse depth, 1/m, and motion, pixels per frame.
struct Surface {
    double w = 0, vx = 0, vy = 0;
    Tint tint = {0.3, 0.5, 0.9};
};

struct Lens {
    double focal_length_mm, f_stop, focus_distance;
};

// `surface_at(x, y)`: of each pixel.
template <class SurfaceAt>
BenchFrame paint(int width, int height, const Lens& lens, const SurfaceAt& surface_at) {
    ImageF color(width, height, 4, 1), inverse_depth(width, height, 1), motion(width, height, 2);
    size_t still = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double wave = 0.5 + 0.3 * std::sin(0.05 * x + 0.02 * y) * std::cos(0.07 * y);
            const bool bar = (x + 2 * y) % 47 < 9;
            const Surface s = surface_at(x, y);
            for (int c = 0; c < 3; ++c) {
                const double value = s.tint[size_t(c)] * wave * (bar && s.w > 0 ? 0.2 : 1);
                color.at(x, y, c) = glm::unpackHalf1x16(glm::packHalf1x16(float(value)));
            }
            inverse_depth.at(x, y) = float(s.w);
            motion.at(x, y, 0) = float(s.vx);
            motion.at(x, y, 1) = float(s.vy);
            still += s.vx == 0 && s.vy == 0;
        }
    }
    BenchFrame frame;
    frame.still = double(still) / double(color.pixels());
    frame.planes[Role::color] = std::move(color);
    frame.planes[Role::inverse_depth] = std::move(inverse_depth);
    frame.planes[Role::motion] = std::move(motion);
    FrameDescription& d = frame.description;
    d.display_width = width;
    d.display_height = height;
    d.camera.focal_length_mm = lens.focal_length_mm;
    d.camera.sensor_width_mm = 36;
    d.camera.f_stop = lens.f_stop;
    d.camera.focus_distance = lens.focus_distance;
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    require(convert_frame(frame.planes, d, options));
    return frame;
}

constexpr Tint kGround = {0.8, 0.6, 0.3}, kFigure = {0.7, 0.3, 0.2}, kWall = {0.4, 0.4, 0.5};

bool in_ellipse(double u, double v, double middle_u, double middle_v, double ru, double rv) {
    return std::hypot((u - middle_u) / ru, (v - middle_v) / rv) < 1;
}

// Places are fractions of the frame, u from the left and v from the top; motion is for 1920 pixels.
Surface third_person_at(double u, double v) {
    const double pan = 6;
    if (in_ellipse(u, v, 0.5, 0.42, 0.025, 0.05) || in_ellipse(u, v, 0.5, 0.62, 0.05, 0.17))
        return {0.25, 0, 0, kFigure};
    if (in_ellipse(u, v, 0.48, 0.82, 0.02, 0.13)) return {0.25, 8, 1, kFigure};
    if (in_ellipse(u, v, 0.52, 0.82, 0.02, 0.13)) return {0.25, -8, 1, kFigure};
    for (const double tree : {0.1, 0.27, 0.7, 0.93})
        if (std::abs(u - tree) < 0.012 && v < 0.55) return {1.0 / 12, pan, 0, kWall};
    if (v > 0.42) {
        const double w = 0.33 * (v - 0.42) / 0.58;
        return {w, pan + 20 * (u - 0.5) * w, 20 * (v - 0.42) * w, kGround};
    }
    if (v > 0.3 + 0.05 * std::sin(9 * u)) return {1.0 / 200, pan, 0, kWall};
    return {0, pan, 0};
}

Surface race_at(double u, double v) {
    const double focal_px = 1400, speed = 0.5;  // meters per frame
    const double x = 1920 * (u - 0.5), y = 1080 * (v - 0.45);
    if (std::abs(u - 0.5) < 0.1 && v > 0.58 && v < 0.85) {
        const bool wheel = std::abs(std::abs(u - 0.5) - 0.08) < 0.015 && v > 0.75;
        return {1.0 / 6, 0, wheel ? 30.0 : 0.0, kFigure};
    }
    const double ground = y / (focal_px * 1.2), wall = std::abs(x) / (focal_px * 8);
    const bool is_ground = ground > wall, is_wall = !is_ground && v > 0.25 && wall > 1.0 / 150;
    if (!is_ground && !is_wall) return {};
    const double w = std::max(ground, wall), part = speed * w;
    return {w, x * part, y * part, is_ground ? kGround : kWall};
}

Surface dialog_at(double u, double v) {
    if (in_ellipse(u, v, 0.06, 0.62, 0.17, 0.5)) return {1.1, 0.5, 0, kGround};
    const bool head = in_ellipse(u, v, 0.58, 0.42, 0.12, 0.3);
    if (head || in_ellipse(u, v, 0.58, 1, 0.28, 0.35))
        return {0.5 + 0.02 * std::cos(8 * (u - 0.58)), 0.5, head && v > 0.5 ? 1.5 : 0.3, kFigure};
    return {u > 0.8 ? 0.25 : 1.0 / 6, 0.5, 0, kWall};
}

Surface menu_at(double u, double v) {
    if (in_ellipse(u, v, 0.7, 0.55, 0.12, 0.4)) return {0.3, 0, 0, kFigure};
    return {v > 0.8 ? 0.2 : 0.1, 0, 0, v > 0.8 ? kGround : kWall};
}

}  // namespace

BenchFrame make_frame(int width, int height, double pan_px) {
    const double radius = 0.3 * height, turn = 60 / radius;
    const Lens on_the_disc = {50, 1.8, 2};
    return paint(width, height, on_the_disc, [&](int x, int y) -> Surface {
        const double dx = x - 0.5 * width, dy = y - 0.55 * height;
        if (std::hypot(dx, dy) < radius) {
            const bool spoke = std::fmod(std::atan2(dy, dx) + 7, 0.5) < 0.2;
            return {0.5, pan_px - turn * dy, turn * dx,
                    spoke ? Tint{0.1, 0.9, 0.2} : Surface().tint};
        }
        if (y > height / 4)
            return {0.1 * y / height, pan_px + (x > width / 2 ? 24 : 0), 0, kGround};
        return {0, pan_px, 0};
    });
}

BenchFrame make_frame(int width, int height, Scene scene) {
    constexpr double kNoLens = 1000;  // a pinhole
    const Lens lens = scene == Scene::third_person ? Lens{35, 4, 4}
                      : scene == Scene::dialog     ? Lens{85, 2.8, 2}
                                                   : Lens{26, kNoLens, 6};
    const auto surface_at = scene == Scene::third_person ? third_person_at
                            : scene == Scene::race       ? race_at
                            : scene == Scene::dialog     ? dialog_at
                                                         : menu_at;
    const double scale = width / 1920.0;
    BenchFrame frame = paint(width, height, lens, [&](int x, int y) {
        Surface surface = surface_at((x + 0.5) / width, (y + 0.5) / height);
        surface.vx *= scale;
        surface.vy *= scale;
        return surface;
    });
    frame.description.bounds = {};
    return frame;
}

unsigned DevicePlanes::texture(Role role, Format format) {
    unsigned& name = textures_[{role, format}];
    if (name == 0) {
        const ImageF& plane = planes_.at(role);
        gl::Texture* made = require(pool_.acquire({format, plane.width, plane.height}));
        require(gl::Transfers().upload(*made, plane));
        name = made->name;
    }
    return name;
}

std::map<Role, unsigned> DevicePlanes::inputs_of(const Plan& plan) {
    std::map<Role, unsigned> inputs;
    for (const PlanTexture& one : plan.textures)
        if (one.imported && one.first_step >= 0) inputs[one.role] = texture(one.role, one.format);
    return inputs;
}

void add_copy(Plan& plan, int width, int height) {
    const auto add_texture = [&](const char* name, bool imported) {
        PlanTexture texture;
        texture.name = name;
        texture.width = width;
        texture.height = height;
        texture.imported = imported;
        plan.textures.push_back(texture);
        return TextureId(plan.textures.size()) - 1;
    };
    TextureId source = -1;
    for (size_t i = 0; i < plan.textures.size(); ++i)
        if (plan.textures[i].imported && plan.textures[i].role == Role::color) source = int(i);
    if (source < 0) source = add_texture("input.color", true);
    const TextureId target = add_texture("copy.color", false);
    Step step;
    step.pass = int(plan.passes.size());
    step.name = "copy";
    step.program.file = "bench/copy.comp";
    step.bindings = {{0, source, Access::sample_nearest}, {0, target, Access::write}};
    step.groups = groups_for(width, height);
    step.taps = uint64_t(width) * uint64_t(height);
    plan.passes.push_back({"copy", "", false});
    plan.steps.push_back(std::move(step));
    std::vector<TextureId> outputs;
    for (const auto& [role, id] : plan.outputs) outputs.push_back(id);
    find_lifetimes(plan, outputs);
}

std::vector<PassTime> finished_times(Executor& executor) {
    for (;;) {
        auto times = executor.pass_times();
        if (!times.empty()) return times;
        std::this_thread::yield();
    }
}

double cpu_milliseconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e3 * double(time.tv_sec) + 1e-6 * double(time.tv_nsec);
}

double quantile(std::vector<double> values, double q) {
    std::sort(values.begin(), values.end());
    return values[size_t(q * double(values.size() - 1) + 0.5)];
}

std::string device_text(const gl::Device& device) {
    const char* threads = std::getenv("LP_NUM_THREADS");
    return concat(
        "device: ", device.vendor, ", ", device.renderer, ", ", device.version,
        "; threads: ", threads ? threads : std::to_string(std::thread::hardware_concurrency()));
}

Settings take_settings(Arguments& arguments, int iterations) {
    const auto [width, height] = arguments.size(1280, 720);
    return {width, height, arguments.count("--iterations", iterations)};
}

}  // namespace postchain::bench
