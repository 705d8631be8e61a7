#include "tests/measure/experiment/support.h"

#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/sequence/exr/planes_writer.h"

namespace postchain::test {

const char* const kChainText =
    "postchain: 1\n"
    "passes:\n"
    "  - motion_blur: {mode: guertin, samples: 5, max_blur_px: 8}\n"
    "  - fxaa: {preset: 10, hint: none}\n";
const char* const kOtherOrderText =
    "postchain: 1\n"
    "passes:\n"
    "  - fxaa: {preset: 10, hint: none}\n"
    "  - motion_blur: {mode: guertin, samples: 5, max_blur_px: 8}\n";

namespace {

std::string number(int frame) {
    char text[16];
    std::snprintf(text, sizeof(text), ".%04d.exr", frame);
    return text;
}

constexpr int kWidth = 64, kHeight = 40;

TestFrame frame_of(int frame, int height = kHeight) {
    return layered_frame(kWidth, height, {6, 2}, {-3, 1}, uint32_t(frame));
}

}  // namespace

void write_sequence(const std::string& folder, int count) {
    for (int frame = 1; frame <= count; ++frame) {
        const TestFrame made = frame_of(frame);
        const ImageF& motion = made.planes.at(Role::motion);
        ImageF depth = made.planes.at(Role::inverse_depth);
        for (float& d : depth.data) d = 1 / d;
        // Cycles: Z, W = position(this) - position(next), y up.
        const ImageF vectors = make_image(kWidth, kHeight, 4, [&](int x, int y, int c) {
            return c == 2 ? -motion.at(x, y, 0) : c == 3 ? motion.at(x, y, 1) : 0;
        });
        io::PlanesFile file;
        for (int c = 0; c < 4; ++c) {
            file.channels.push_back({std::string("Combined.") + "RGBA"[c], io::PixelType::float32,
                                     &made.planes.at(Role::color), c});
            file.channels.push_back(
                {std::string("Vector.") + "XYZW"[c], io::PixelType::float32, &vectors, c});
        }
        file.channels.push_back({"Depth.Z", io::PixelType::float32, &depth, 0});
        must(io::write_planes_exr(folder + "/in" + number(frame), file,
                                  {.on_existing = io::OnExisting::overwrite}));
    }
}

void write_truth(const std::string& folder, int first, int count, float offset, int height) {
    for (int frame = first; frame < first + count; ++frame) {
        const ImageF color = frame_of(frame, height).planes.at(Role::color);
        write_rgb(folder + "/truth" + number(frame),
                  make_image(kWidth, height, 3,
                             [&](int x, int y, int c) { return color.at(x, y, c) + offset; }));
    }
}

Chain parse(const std::string& text, const std::vector<std::string>& sets) {
    ChainFile file = parse_chain(text, "test", builtin_passes(), sets);
    EXPECT_TRUE(file.status().ok()) << file.status().message();
    return std::move(file.chain);
}

Result<std::vector<experiment::NamedChain>> sweep(const std::vector<std::string>& texts, int limit,
                                                  const std::vector<std::string>& sets) {
    std::vector<experiment::Sweep> sweeps;
    for (const auto& text : texts) {
        auto sweep = experiment::parse_sweep(text);
        if (!sweep.ok()) return sweep.status();
        sweeps.push_back(*sweep);
    }
    return experiment::sweep_variants({"test.yaml", kChainText, false}, builtin_passes(), sets,
                                      sweeps, limit);
}

size_t expect_same_values(const report::Metrics& some, const report::Metrics& all) {
    size_t compared = 0;
    for (const auto& [name, series] : some) {
        const auto& expected = all.at(name).frames;
        for (size_t i = 0; i < expected.size(); ++i) {
            EXPECT_EQ(series.frames.at(i).has_value(), expected[i].has_value()) << name << i;
            if (!series.frames[i] || !expected[i]) continue;
            EXPECT_NEAR(*series.frames[i], *expected[i], 1e-6) << name << i;
            ++compared;
        }
    }
    return compared;
}

experiment::ExperimentSettings settings_for(const std::string& folder, const std::string& report) {
    experiment::ExperimentSettings settings;
    settings.run.input = must(io::InputSpec::parse(folder + "/in.####.exr"));
    settings.run.version = "test";
    settings.input = folder + "/in.####.exr";
    settings.truth = folder + "/truth.####.exr";
    settings.folder = report;
    settings.renderer = "test";
    settings.repeats = 2;
    settings.flip.threads = 1;
    return settings;
}

}  // namespace postchain::test
