#include "tests/command/frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "tools/sequence/exr/exr_reader.h"

namespace postchain::test {

Planes make_planes(int width, int height, int frame) {
    Planes planes{ImageF(width, height, 4, 1), ImageF(width, height, 1), ImageF(width, height, 2),
                  ImageF(width, height, 2)};
    const int left = width / 4 + 6 * (frame - 1), top = height / 4 + 3 * (frame - 1);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const bool square =
                x >= left && x < left + width / 3 && y >= top && y < top + height / 3;
            const double stripes = std::sin(0.9 * x + 0.3 * y) * std::cos(0.5 * y - 0.2 * x);
            planes.color.at(x, y, 0) = float(square ? 0.9 : 0.3 + 0.25 * stripes);
            planes.color.at(x, y, 1) = float(square ? 0.5 + 0.4 * stripes : 0.2);
            planes.color.at(x, y, 2) = float(square ? 0.1 : 0.4 - 0.25 * stripes);
            planes.depth.at(x, y) = square ? 2 : 6;
            planes.motion.at(x, y, 0) = square ? 6 : -2;
            planes.motion.at(x, y, 1) = square ? 3 : 1;
            planes.back.at(x, y, 0) = square ? 5 : -3;
            planes.back.at(x, y, 1) = square ? 2 : 1.5f;
        }
    }
    return planes;
}

void write_frame(const std::string& path, const Planes& planes, const FrameFile& file) {
    const bool cycles = file.convention == "cycles", nuke = file.convention == "nuke";
    const std::string layer = cycles ? "ViewLayer.Combined." : "";
    io::PlanesFile exr;
    for (int c = 0; c < 4; ++c)
        exr.channels.push_back({layer + "RGBA"[c], file.color_type, &planes.color, c});

    ImageF depth = planes.depth;
    if (nuke)
        for (float& value : depth.data) value = 1 / value;
    if (file.depth)
        exr.channels.push_back({cycles ? "ViewLayer.Depth.Z"
                                : nuke ? "depth.Z"
                                       : "Z",
                                file.depth_type, &depth, 0});

    // Stored = canonical times these signs, by the table of docs/profiles.md.
    ImageF motion = planes.motion, back = planes.back;
    const auto sign = [](ImageF& plane, float x, float y) {
        for (size_t i = 0; i < plane.pixels(); ++i) {
            plane.data[2 * i] *= x;
            plane.data[2 * i + 1] *= y;
        }
    };
    std::vector<std::string> names, back_names;
    if (cycles) {
        names = {"ViewLayer.Vector.Z", "ViewLayer.Vector.W"};
        back_names = {"ViewLayer.Vector.X", "ViewLayer.Vector.Y"};
        sign(motion, -1, 1);
        sign(back, -1, 1);
    } else if (nuke) {
        names = {"forward.u", "forward.v"};
        back_names = {"backward.u", "backward.v"};
        sign(motion, 1, -1);
        sign(back, -1, 1);
    } else if (file.convention == "arnold") {
        names = {"motionvector.R", "motionvector.G"};
        sign(motion, 1, -1);
    } else if (file.convention == "vray") {
        names = {"velocity.R", "velocity.G"};
        sign(motion, 1, -1);
    } else {
        names = {"motion.x", "motion.y"};
        back_names = {"motion_back.x", "motion_back.y"};
    }
    if (file.motion) {
        for (size_t i = 0; i < names.size(); ++i)
            exr.channels.push_back({names[i], io::PixelType::float32, &motion, int(i)});
        for (size_t i = 0; i < back_names.size(); ++i)
            exr.channels.push_back({back_names[i], io::PixelType::float32, &back, int(i)});
    }
    ImageF ids(planes.color.width, planes.color.height, 1);
    for (size_t i = 0; i < ids.pixels(); ++i) ids.data[i] = float(i % 251);
    if (file.object_ids) exr.channels.push_back({"id", io::PixelType::uint32, &ids, 0});
    for (const auto& [name, matte] : file.mattes)
        exr.channels.push_back({name, io::PixelType::float32, &matte, 0});

    exr.attributes = file.attributes;
    exr.origin_x = file.origin_x;
    exr.origin_y = file.origin_y;
    exr.display_window = file.display;
    io::WriteOptions options;
    options.on_existing = io::OnExisting::overwrite;
    if (file.method != io::ExrMethod::zip) options.exr.compression = {file.method, {}};
    const auto written = io::write_planes_exr(path, exr, options);
    ASSERT_TRUE(written.ok()) << written.status().message();
}

void write_sequence(const std::string& folder, const std::vector<int>& frames, int width,
                    int height, const FrameFile& file) {
    for (int frame : frames) {
        char name[32];
        std::snprintf(name, sizeof(name), "/in.%04d.exr", frame);
        write_frame(folder + name, make_planes(width, height, frame), file);
    }
}

void write_rgb(const std::string& path, const ImageF& rgb) {
    const auto written =
        io::write_planes_exr(path, rgb, {"R", "G", "B"}, io::OnExisting::overwrite);
    EXPECT_TRUE(written.ok()) << path;
}

ImageF read_color(const std::string& path) {
    auto file = io::ExrFile::open(path);
    if (!file.ok()) {
        ADD_FAILURE() << file.status().message();
        return {};
    }
    for (size_t part = 0; part < file->parts().size(); ++part) {
        std::vector<std::string> names;
        for (const char* end : {"R", "G", "B", "A"}) {
            for (const auto& channel : file->parts()[part].channels) {
                const bool named =
                    channel.name == end || channel.name == std::string("ViewLayer.Combined.") + end;
                if (named) names.push_back(channel.name);
            }
        }
        if (names.size() < 3) continue;
        auto image = file->read_channels(int(part), names);
        if (image.ok()) return std::move(*image);
        ADD_FAILURE() << image.status().message();
    }
    ADD_FAILURE() << path << ": no color";
    return {};
}

std::map<std::string, std::string> other_channels(const std::string& path) {
    std::map<std::string, std::string> channels;
    auto file = io::ExrFile::open(path);
    if (!file.ok()) {
        ADD_FAILURE() << file.status().message();
        return channels;
    }
    auto pixels = file->read_part(0);
    if (!pixels.ok()) {
        ADD_FAILURE() << pixels.status().message();
        return channels;
    }
    for (const auto& plane : pixels->planes) {
        const std::string& name = plane.channel.name;
        const std::string last = name.substr(name.rfind('.') + 1);
        const bool color = name == last || name == "ViewLayer.Combined." + last;
        if (color && (last == "R" || last == "G" || last == "B" || last == "A")) continue;
        channels[name] =
            std::string(reinterpret_cast<const char*>(plane.bytes.get()), plane.total_bytes());
    }
    return channels;
}

double largest_difference(const ImageF& a, const ImageF& b) {
    if (a.width != b.width || a.height != b.height || a.channels != b.channels)
        return std::numeric_limits<double>::infinity();
    double largest = 0;
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double difference = std::abs(double(a.data[i]) - double(b.data[i]));
        // NaN counts as infinitely different.
        largest = difference >= 0 ? std::max(largest, difference)
                                  : std::numeric_limits<double>::infinity();
    }
    return largest;
}

std::vector<std::string> temporaries(const std::string& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with(".")) names.push_back(name);
    }
    return names;
}

}  // namespace postchain::test
