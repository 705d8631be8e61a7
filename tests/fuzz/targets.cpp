#include "targets.h"
#include "config/profile_match.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/profile.h"
#include "guarantees.h"
#include "passes/registry.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/planes/camera_metadata.h"
#include "tools/sequence/planes/frame_reader.h"
#include "tools/sequence/planes/frame_writer.h"

namespace postchain::fuzz {

namespace {

// Frames per range; the program's own limit, a million, takes a second with sanitizers.
constexpr size_t kMaxRange = 2000;

void require_finite(const Camera& camera) {
    for (const std::optional<double>& value :
         {camera.focal_length_mm, camera.sensor_width_mm, camera.f_stop, camera.focus_distance,
          camera.near_clip, camera.far_clip, camera.shutter_frames, camera.meters_per_unit}) {
        require(!value || std::isfinite(*value), "a camera value is finite");
    }
}

// Channels as named by various renderers, to match profiles with.
const FileChannels& some_channels() {
    static const FileChannels file = {
        {{"", "", {"R", "G", "B", "A", "Z", "diffuse.R", "diffuse.G", "diffuse.B"}},
         {"ViewLayer",
          "left",
          {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
           "ViewLayer.Combined.A", "ViewLayer.Depth.Z", "ViewLayer.Vector.X", "ViewLayer.Vector.Y",
           "ViewLayer.Vector.Z", "ViewLayer.Vector.W"}},
         {"", "right", {"forward.u", "forward.v", "motionvector.X", "motionvector.Y", ""}}},
        {"left", "right"}};
    return file;
}

void ask_pattern(const io::PathPattern& pattern) {
    require(!pattern.text().empty() && !pattern.folder().empty(), "a pattern names a file");
    pattern.literal_frame();
    for (const int frame : {0, 7, 1234, io::kMaxFrameNumber, -5, -io::kMaxFrameNumber}) {
        const std::string path = pattern.format(frame);
        if (!pattern.has_token()) {
            require(path == pattern.text(), "a path without a token stays as it is");
            continue;
        }
        // Names of temporary files are not frames.
        const std::optional<int> found = pattern.match(path.substr(path.rfind('/') + 1));
        require(!found || *found == frame, "a pattern finds the frame it has written");
    }
}

void ask_part(io::PixelFile& file, int index) {
    const io::ExrPart& part = file.parts()[size_t(index)];
    std::vector<std::string> full;  // full-resolution channels
    for (const io::ExrChannel& channel : part.channels) {
        const Status status = file.check_channels(index, {channel.name});
        require_reason(status);
        require(part.find(channel.name) != nullptr, "a part finds its channels");
        if (channel.x_sampling == 1 && channel.y_sampling == 1 && full.size() < 4) {
            full.push_back(channel.name);
        }
    }
    if (part.deep) {
        file.flattening.behind = true;
        require_reason(file.read_part(index).status());
        file.flattening.behind = false;
    }
    const Result<io::PartPixels> pixels = file.read_part(index);
    require_reason(pixels.status());
    if (!pixels.ok()) return;
    require(pixels->planes.size() == part.channels.size(), "every channel is read");
    const ImageF image = pixels->interleaved(full, pixels->window);
    require(image.width == part.data_window.width() && image.height == part.data_window.height(),
            "pixels fill the data window");
}

// The file as `run` writes it: color through floats, every other part chunk by chunk.
void ask_copy(const std::string& path, const io::FrameChannels& roles) {
    Result<io::FrameFiles> open = io::open_frame({{Role::color, path}}, 1, kLimits);
    require(open.ok(), "a file that was opened once can be opened again");
    const size_t parts = open->color_file().parts().size();
    const Result<io::StoredFrame> frame =
        io::read_frame(*open, roles, {Role::color}, io::Keep::all);
    require_reason(frame.status());
    if (!frame.ok()) return;
    const OutputFolder folder;
    const std::string copy = folder.path("copy.exr");
    const ImageF color = frame->planes.at(Role::color);
    const RoleChannels& where = roles.at(Role::color);
    const auto report = io::write_filtered(
        copy, open->color_file(), *frame, {where.part, where.channels, &color},
        {.on_existing = io::OnExisting::overwrite, .overflow = io::HalfOverflow::clamp});
    require_reason(report.status());
    if (!report.ok()) return;
    const Result<io::ExrFile> again = io::ExrFile::open(copy);
    require(again.ok() && again->parts().size() == parts, "a copy can be read and has every part");
}

// A file in memory, reused for every input.
const std::string& memory_path(std::string_view bytes) {
    static const int fd = ::memfd_create("postchain_fuzz", MFD_CLOEXEC);
    static const std::string path = "/proc/self/fd/" + std::to_string(fd);
    require(::ftruncate(fd, off_t(bytes.size())) == 0 &&
                ::pwrite(fd, bytes.data(), bytes.size(), 0) == ssize_t(bytes.size()),
            "a file can be made in memory");
    return path;
}

}  // namespace

bool chain(std::string_view bytes) {
    const size_t end = bytes.find('\0');
    std::vector<std::string> overrides;
    for (size_t at = end; at != std::string_view::npos;) {
        const size_t next = bytes.find('\0', at + 1);
        overrides.emplace_back(bytes.substr(at + 1, next - at - 1));
        at = next;
    }
    const ChainFile file =
        parse_chain(bytes.substr(0, end), "chain.yaml", builtin_passes(), overrides);
    require_reason(file.status());
    text_of(file.diagnostics);
    if (!file.status().ok()) return false;
    const ChainFile again = parse_chain(write_chain(file.chain), "again.yaml", builtin_passes());
    require(again.status().ok(), "a written chain can be read");
    require(again.chain.hash() == file.chain.hash(), "a written chain is the same chain");
    return true;
}

bool camera(std::string_view bytes) {
    const CameraFile file = parse_camera(bytes, "camera.json");
    require_reason(file.status());
    text_of(file.diagnostics);
    if (!file.status().ok()) return false;
    for (const Display& display : {Display{1920, 1080, 1}, Display{3, 4096, 0.5}}) {
        file.check_resolution(display);
        require_finite(file.camera_for(1, display));
        for (const auto& [frame, values] : file.frames) {
            require_finite(file.camera_for(frame, display));
            require_finite(frame_camera(Camera(), &file, frame, display));
        }
    }
    return true;
}

bool profile(std::string_view bytes) {
    const ProfileFile file = parse_profile(bytes, "profile.yaml");
    require_reason(file.status());
    text_of(file.diagnostics);
    if (!file.status().ok()) return false;
    for (const char* layer : {"", "diffuse"}) {
        for (const char* view : {"", "right"}) {
            const auto match = match_profile(file.profile, some_channels(), layer, view);
            require_reason(match.status());
            if (match.ok()) match->text();
        }
    }
    require_reason(detect_profile({file.profile}, some_channels()).status());
    return true;
}

bool sequence(std::string_view bytes) {
    const Result<io::FrameRange> range = io::FrameRange::parse(bytes, kMaxRange);
    require_reason(range.status());
    if (range.ok()) {
        const std::vector<int>& frames = range->frames;
        require(!frames.empty() && frames.size() <= kMaxRange, "a range has frames, not many");
        const std::set<int> different(frames.begin(), frames.end());
        require(different.size() == frames.size(), "a range names each frame once");
    }
    const Result<io::PathPattern> pattern = io::PathPattern::parse(bytes);
    require_reason(pattern.status());
    if (pattern.ok()) ask_pattern(*pattern);
    const Result<io::InputSpec> input = io::InputSpec::parse(bytes);
    require_reason(input.status());
    if (input.ok()) {
        ask_pattern(input->color());
        for (const auto& [role, plane] : input->patterns) ask_pattern(plane);
    }
    return range.ok() || input.ok();
}

bool exr(std::string_view bytes) {
    Result<io::ExrFile> file = io::ExrFile::open(memory_path(bytes), kLimits);
    require_reason(file.status());
    require(file.ok() || file.status().code() == StatusCode::input, "a bad file is bad input");
    if (!file.ok()) return false;
    require(!file->parts().empty() && file->file_bytes() == bytes.size(), "an open file has parts");
    require_reason(file->explain_no_color());
    const auto match = detect_profile(builtin_profiles(), io::channels_of(*file));
    require_reason(match.status());
    if (match.ok()) {
        match->text();
        ask_copy(memory_path(bytes), match->roles);
    }
    for (size_t i = 0; i < file->parts().size(); ++i) {
        const io::ExrPart& part = file->parts()[i];
        require(part.data_window.width() >= 1 && part.data_window.width() <= kLimits.max_side &&
                    part.data_window.height() >= 1 && part.data_window.height() <= kLimits.max_side,
                "a side is within its limit");
        io::camera_metadata(part);
        io::luma_weights(part.chromaticities);
        ask_part(*file, int(i));
    }
    return true;
}

const std::vector<Target>& targets() {
    static const std::vector<Target> list = {
        {"chain", chain},
        {"camera", camera},
        {"profile", profile},
        {"sequence", sequence},
        {"exr", exr},
        {"picture", picture},
#if POSTCHAIN_SERVE
        {"request", request},
#endif
    };
    return list;
}

}  // namespace postchain::fuzz
