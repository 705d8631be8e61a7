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

BenchFrame make_frame(int width, int height, double pan_px) {
    ImageF color(width, height, 4, 1), inverse_depth(width, height, 1), motion(width, height, 2);
    const double radius = 0.3 * height, turn = 60 / radius;
    size_t still = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double dx = x - 0.5 * width, dy = y - 0.55 * height;
            const double wave = 0.5 + 0.3 * std::sin(0.05 * x + 0.02 * y) * std::cos(0.07 * y);
            const bool bar = (x + 2 * y) % 47 < 9;
            double w = 0, vx = pan_px, vy = 0;
            std::array<double, 3> tint = {0.3, 0.5, 0.9};
            if (std::hypot(dx, dy) < radius) {
                const bool spoke = std::fmod(std::atan2(dy, dx) + 7, 0.5) < 0.2;
                w = 0.5;
                vx += -turn * dy;
                vy = turn * dx;
                tint = spoke ? std::array<double, 3>{0.1, 0.9, 0.2} : tint;
            } else if (y > height / 4) {
                w = 0.1 * y / height;
                vx += x > width / 2 ? 24 : 0;
                tint = {0.8, 0.6, 0.3};
            }
            for (int c = 0; c < 3; ++c) {
                const double value = tint[size_t(c)] * wave * (bar && w > 0 ? 0.2 : 1);
                color.at(x, y, c) = glm::unpackHalf1x16(glm::packHalf1x16(float(value)));
            }
            inverse_depth.at(x, y) = float(w);
            motion.at(x, y, 0) = float(vx);
            motion.at(x, y, 1) = float(vy);
            still += vx == 0 && vy == 0;
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
    d.camera.focal_length_mm = 50;
    d.camera.sensor_width_mm = 36;
    d.camera.f_stop = 1.8;
    d.camera.focus_distance = 2;  // on the disc
    ConvertOptions options;
    options.depth = DepthEncoding::inverse;
    require(convert_frame(frame.planes, d, options));
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
