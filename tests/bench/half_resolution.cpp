// PSNR of the tiers of the C interface at full and at half resolution (PC_HALF_RESOLUTION), against
// ground truth, and the ratio of their times.
//
//   half_resolution CAMERA.json SHARP.exr TRUTH.exr [TIER...]
//
// SHARP: one frame of Blender, with Depth and Vector (both/0010.exr of the scenes of
// tests/cycles). Times are the wall clock around glFinish, the median of five frames each in turn.
#include <OpenImageIO/imageio.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <postchain/postchain.hpp>
#include <string>
#include <vector>

namespace {

constexpr int kRuns = 5;

[[noreturn]] void stop(const std::string& text) {
    std::fprintf(stderr, "half_resolution: %s\n", text.c_str());
    std::exit(1);
}

struct Picture {
    int width = 0, height = 0;
    std::vector<std::string> channels;
    std::vector<float> values;

    explicit Picture(const std::string& file) {
        const auto input = OIIO::ImageInput::open(file);
        if (!input) stop(file + ": " + OIIO::geterror());
        const auto& spec = input->spec();
        width = spec.width;
        height = spec.height;
        channels = spec.channelnames;
        values.resize(size_t(width) * size_t(height) * channels.size());
        if (!input->read_image(0, 0, 0, int(channels.size()), OIIO::TypeDesc::FLOAT, values.data()))
            stop(file + ": " + input->geterror());
    }
    // The channels of these names, the part before the last dots left out, one beside another.
    std::vector<float> plane(const std::vector<std::string>& names) const {
        std::vector<float> result(size_t(width) * size_t(height) * names.size());
        for (size_t n = 0; n < names.size(); ++n) {
            const auto found = std::find_if(
                channels.begin(), channels.end(),
                [&](const std::string& channel) { return channel.ends_with(names[n]); });
            if (found == channels.end()) stop("no channel " + names[n]);
            const auto c = size_t(found - channels.begin());
            for (size_t i = 0; i < size_t(width) * size_t(height); ++i)
                result[i * names.size() + n] = values[i * channels.size() + c];
        }
        return result;
    }
};

pc_texture texture(unsigned format, int width, int height, unsigned external = 0,
                   const float* pixels = nullptr) {
    pc_texture made = {0, format, width, height, 0, 0};
    glCreateTextures(GL_TEXTURE_2D, 1, &made.name);
    glTextureStorage2D(made.name, 1, format, width, height);
    if (pixels) glTextureSubImage2D(made.name, 0, 0, 0, width, height, external, GL_FLOAT, pixels);
    return made;
}

double shown(float x) {
    const double light = std::max(double(x), 0.0);
    return std::pow(light / (1 + light), 1 / 2.2);
}

// PSNR of RGB, as a display shows it.
double psnr(const pc_texture& output, const std::vector<float>& truth) {
    std::vector<float> rgb(truth.size());
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glGetTextureImage(output.name, 0, GL_RGB, GL_FLOAT, GLsizei(rgb.size() * sizeof(float)),
                      rgb.data());
    double sum = 0;
    for (size_t i = 0; i < rgb.size(); ++i) sum += std::pow(shown(rgb[i]) - shown(truth[i]), 2);
    return -10 * std::log10(sum / double(rgb.size()));
}

double seconds_of(pc_instance* guest, pc_chain* chain, const pc_frame& frame) {
    const auto start = std::chrono::steady_clock::now();
    if (pc_run(guest, chain, &frame, nullptr) != PC_OK) stop(pc_error());
    glFinish();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::array<double, kRuns> values) {
    std::sort(values.begin(), values.end());
    return values[kRuns / 2];
}

}  // namespace

int main(int count, char** words) {
    if (count < 4) stop("CAMERA.json SHARP.exr TRUTH.exr [TIER...]");
    std::ifstream camera_file(words[1]);
    const auto camera = nlohmann::json::parse(camera_file, nullptr, false);
    if (camera.is_discarded()) stop(std::string(words[1]) + ": cannot be read");
    const Picture sharp(words[2]);
    const std::vector<float> truth = Picture(words[3]).plane({"R", "G", "B"});
    std::vector<std::string> tiers(words + 4, words + count);
    if (tiers.empty()) tiers = {"realtime", "fast", "balanced", "best"};

    auto info = pc::create_info();
    info.flags = PC_OWN_CONTEXT;
    const pc::Instance guest = pc::create(info);
    if (!guest) stop(pc_error());
    const int w = sharp.width, h = sharp.height;
    auto frame = pc::make<pc_frame>();
    frame.flags = PC_TOP_LEFT | PC_MOTION_TO_NEXT;
    frame.color =
        texture(GL_RGBA32F, w, h, GL_RGBA,
                sharp.plane({"Combined.R", "Combined.G", "Combined.B", "Combined.A"}).data());
    frame.depth = texture(GL_R32F, w, h, GL_RED, sharp.plane({"Depth.Z"}).data());
    frame.motion = texture(GL_RG32F, w, h, GL_RG, sharp.plane({"Vector.Z", "Vector.W"}).data());
    frame.motion_scale[0] = -1;  // Blender: this minus next, y up
    frame.output = texture(GL_RGBA32F, w, h);
    frame.depth_encoding = PC_DEPTH_LINEAR;
    frame.focal_length_mm = camera.value("focal_length_mm", 50.0f);
    frame.sensor_width_mm = camera.value("sensor_width_mm", 36.0f);
    frame.f_stop = camera.value("f_stop", 2.0f);
    frame.focus_distance = camera.value("focus_distance", 10.0f);
    frame.shutter_frames = camera.value("shutter_frames", 0.5f);

    std::printf("%-10s  full dB  half dB  time of half / full\n", "tier");
    for (const std::string& tier : tiers) {
        const pc::Chain chain = pc::chain(("tier:" + tier).c_str());
        if (!chain) stop(pc_error());
        pc_frame half = frame;
        half.flags |= PC_HALF_RESOLUTION;
        std::array<std::array<double, kRuns>, 2> times;
        std::array<double, 2> quality;
        for (const pc_frame* of : {&frame, &half})
            if (pc_prepare(guest.get(), chain.get(), of, 1) != PC_OK) stop(pc_error());
        for (size_t i = 0; i < kRuns; ++i)
            for (const pc_frame* of : {&frame, &half}) {
                const size_t which = of == &half;
                times[which][i] = seconds_of(guest.get(), chain.get(), *of);
                quality[which] = psnr(frame.output, truth);
            }
        std::printf("%-10s  %7.2f  %7.2f  %.2f\n", tier.c_str(), quality[0], quality[1],
                    median(times[1]) / median(times[0]));
    }
    return 0;
}
