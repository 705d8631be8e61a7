// Renders a sequence by the plugin and by the command's own functions, compares every bit, and
// prints the processor time and the time of a frame of each, and the longest of both from a host's
// abort to the end of the render.
//
//   openfx_compare IN CAMERA FRAMES OUT CHAIN...      IN: shot.####.exr of Cycles; OUT: a folder
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>

#include "chain/gl/half.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/openfx/test_host.h"
#include "tests/support/gpu.h"
#include "tools/sequence/run/run_sequence.h"

namespace postchain::openfx::test {
namespace {

struct Stopwatch {
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    std::clock_t processor = std::clock();
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    double processor_seconds() const { return double(std::clock() - processor) / CLOCKS_PER_SEC; }
};

// The planes of a file as Cycles writes them, by the clip's name.
using Clips = std::map<std::string, ImageF>;
Result<Clips> read_clips(const sequence::SourceSettings& settings, const std::string& path,
                         int frame) {
    ASSIGN_OR_RETURN(auto header,
                     sequence::open_source_frame(settings, {{Role::color, path}}, frame));
    const RoleSet all = {Role::color, Role::inverse_depth, Role::motion, Role::motion_back};
    ASSIGN_OR_RETURN(auto input,
                     io::read_frame(header.files, header.match.roles, all, io::Keep::nothing));
    return Clips{
        {"Source", input.planes.at(Role::color)},
        {"Depth", input.planes.at(Role::inverse_depth)},
        {"Motion", joined(input.planes.at(Role::motion_back), input.planes.at(Role::motion))}};
}

Status compare(const std::string& chain, sequence::RunSettings settings, const std::string& camera,
               Host& host) {
    ASSIGN_OR_RETURN(auto file, load_chain(chain, builtin_passes()));
    const auto run = [&] {
        return sequence::run_sequence(file.chain, settings, postchain::test::executor(), "device",
                                      {})
            .status();
    };
    const auto frames = settings.frames->frames;
    ASSIGN_OR_RETURN(const auto list, io::find_frames(settings.input, std::nullopt));
    ASSIGN_OR_RETURN(
        const auto header,
        sequence::open_source_frame(settings.source,
                                    {{Role::color, list.files.at(frames.front()).at(Role::color)}},
                                    frames.front()));
    const auto& color = header.match.roles.at(Role::color);
    const bool is_half =
        sequence::color_part(header).find(color.channels[0])->type == io::PixelType::half;
    std::map<int, Clips> clips;
    for (const auto& [number, files] : list.files)
        if (number >= frames.front() - 1 && number <= frames.back() + 1) {
            ASSIGN_OR_RETURN(clips[number],
                             read_clips(settings.source, files.at(Role::color), number));
        }
    const ImageF& first = clips.begin()->second.at("Source");
    Node node(host, "postchain.chain", first.width, first.height);
    for (const char* name : {"Source", "Depth", "Motion"})
        node.connect(
            name,
            [&clips, name](double time) -> std::optional<Picture> {
                return Picture{.pixels = clips.at(int(time)).at(name)};
            },
            clips.begin()->first, clips.rbegin()->first);
    node.choose("motion_meaning", "cycles");
    node.choose("chain", chain);
    node.set("camera_file", camera);

    // Programs are compiled before the times are taken.
    RETURN_IF_ERROR(run());
    const Stopwatch of_command;
    RETURN_IF_ERROR(run());
    const double command = of_command.seconds(), command_processor = of_command.processor_seconds();
    for (const int frame : frames)
        if (node.render(frame) != kStatOK) return Status(StatusCode::internal, node.message());
    double plugin = 0, plugin_processor = 0;
    size_t different = 0;
    for (const int frame : frames) {
        const Stopwatch of_plugin;
        if (node.render(frame) != kStatOK) return Status(StatusCode::internal, node.message());
        plugin += of_plugin.seconds();
        plugin_processor += of_plugin.processor_seconds();
        const ImageF written = postchain::test::read_color(settings.output.format(frame));
        const ImageF& rendered = node.object().output.pixels;
        // A file of halves is written as halves.
        std::vector<uint16_t> halves(rendered.data.size());
        gl::to_halves(rendered.data.data(), halves.data(), halves.size());
        std::vector<float> rounded(halves.size());
        gl::from_halves(halves.data(), rounded.data(), halves.size());
        for (size_t i = 0; i < written.data.size(); ++i)
            different +=
                written.data[i] != rendered.data[i] && !(is_half && written.data[i] == rounded[i]);
    }
    const double count = double(frames.size());
    std::printf(
        "%-10s %zu frames of %dx%d: %zu values differ; a frame, command and plugin: "
        "%.3f s %.3f s (%.2f), processor %.3f s %.3f s (%.2f)\n",
        chain.c_str(), frames.size(), first.width, first.height, different, command / count,
        plugin / count, plugin / command, command_processor / count, plugin_processor / count,
        plugin_processor / command_processor);
    if (different > 0) return Status(StatusCode::internal, "the results differ");

    // From the host's first yes to the end of the render.
    double longest = 0, longest_processor = 0;
    int aborted = 0;
    for (int tenth = 1; tenth < 10; ++tenth) {
        const double at = plugin_processor / count * tenth / 10;
        const Stopwatch render;
        std::optional<Stopwatch> yes;
        node.object().abort = [&] {
            if (!yes && render.processor_seconds() >= at) yes.emplace();
            return yes.has_value();
        };
        if (node.render(frames.front()) != kStatFailed) continue;
        longest = std::max(longest, yes->seconds());
        longest_processor = std::max(longest_processor, yes->processor_seconds());
        ++aborted;
    }
    node.object().abort = {};
    std::printf("%-10s %d renders aborted, to their ends at most %.0f ms, processor %.0f ms\n",
                chain.c_str(), aborted, 1000 * longest, 1000 * longest_processor);
    return Status();
}

Status compare_all(int argc, char** argv) {
    if (argc < 6)
        return Status(StatusCode::usage, "usage: openfx_compare IN CAMERA FRAMES OUT CHAIN...");
    const std::string camera = argv[2];
    sequence::RunSettings settings;
    ASSIGN_OR_RETURN(settings.input, io::InputSpec::parse(argv[1]));
    ASSIGN_OR_RETURN(settings.source.camera, load_camera(camera));
    ASSIGN_OR_RETURN(settings.frames, io::FrameRange::parse(argv[3]));
    ASSIGN_OR_RETURN(settings.output,
                     io::PathPattern::parse(std::string(argv[4]) + "/out.####.exr"));
    settings.on_existing = io::OnExisting::overwrite;
    settings.version = "test";
    // Written without compression, as a host keeps its images.
    settings.exr.compression = {io::ExrMethod::none, {}};
    Host host;
    for (int i = 5; i < argc; ++i)
        RETURN_IF_ERROR(compare(argv[i], settings, camera, host).at(argv[i]));
    return Status();
}

}  // namespace
}  // namespace postchain::openfx::test

int main(int argc, char** argv) {
    const postchain::Status status = postchain::openfx::test::compare_all(argc, argv);
    if (!status.ok()) std::fprintf(stderr, "%s\n", status.message().c_str());
    return status.ok() ? 0 : 1;
}
