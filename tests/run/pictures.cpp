#include "tests/run/pictures.h"

#include <cmath>
#include <random>

#include "passes/registry.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/job_settings.h"

namespace postchain::test {

Stored noise_of(const Kind& kind, int width, int height) {
    Stored picture{width, height, kind.channels, {}};
    std::mt19937 random(7);
    const int largest = (1 << std::min(kind.bits, 16)) - 1;
    for (int i = 0; i < width * height * kind.channels; ++i) {
        const bool alpha = i % kind.channels == 3;
        if (kind.type != OIIO::TypeDesc::FLOAT)
            picture.values.push_back(float(i < 3 * largest
                                               ? i / 3 % (largest + 1)
                                               : int(random() % unsigned(largest + 1))) /
                                     float(largest));
        else if (alpha)
            picture.values.push_back(float(random() % 5) / 4);
        else
            picture.values.push_back(std::ldexp(float(random() % 1000), int(random() % 20) - 12) *
                                     (std::string(kind.file).ends_with(".hdr") ? 1.f : -1.f));
    }
    return picture;
}

void write_picture(const std::string& path, const Kind& kind, const Stored& picture) {
    auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out) << OIIO::geterror();
    OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, kind.type);
    if (kind.type != OIIO::TypeDesc::FLOAT) spec.attribute("oiio:BitsPerSample", kind.bits);
    if (picture.channels == 4) spec.alpha_channel = 3;
    if (kind.unassociated) spec.attribute("oiio:UnassociatedAlpha", 1);
    if (*kind.space) spec.attribute("oiio:ColorSpace", kind.space);
    spec.attribute("ImageDescription", "a shot");
    ASSERT_TRUE(out->open(path, spec)) << out->geterror();
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, picture.values.data()) && out->close())
        << out->geterror();
}

Stored read_picture(const std::string& path, OIIO::ImageSpec* spec) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto in = OIIO::ImageInput::open(path, &config);
    EXPECT_TRUE(in) << path << ": " << OIIO::geterror();
    if (!in) return {};
    const OIIO::ImageSpec& found = in->spec();
    if (spec) *spec = found;
    Stored picture{found.width, found.height, found.nchannels, {}};
    picture.values.resize(size_t(found.width) * size_t(found.height) * size_t(found.nchannels));
    EXPECT_TRUE(
        in->read_image(0, 0, 0, found.nchannels, OIIO::TypeDesc::FLOAT, picture.values.data()))
        << in->geterror();
    return picture;
}

RunOutcome FormatsTest::run(const Words& words) {
    using namespace sequence;
    static const ParameterTable table = job_parameters(builtin_passes());
    const auto ended = [](const Status& status) {
        return RunOutcome{exit_code(status), status.message()};
    };
    JobSettings job;
    for (size_t i = 0; i < words.size(); ++i) {
        std::string key = words[i].substr(2);
        std::replace(key.begin(), key.end(), '-', '_');
        const bool is_flag = table.find(key)->type == ParameterType::boolean;
        const Status status =
            is_flag ? table.set(&job, key, true) : table.set(&job, key, words[++i]);
        if (!status.ok()) return ended(status);
    }
    Diagnostics notes;
    auto settings = parse_job(job, builtin_passes(), notes);
    if (!settings.ok()) return ended(settings.status());
    settings_ = std::move(*settings);
    settings_.version = "test";
    std::string said;
    const auto summary = go([&](const FrameReport& report, const RunProgress&) {
        for (const std::string& warning : report.warnings) said += warning + "\n";
        for (const std::string& note : report.write.notes) said += note + "\n";
        said += report.status.message() + name_of(report.outcome) + "\n";
    });
    return summary.ok() ? RunOutcome{exit_code(*summary), said} : ended(summary.status());
}

}  // namespace postchain::test
