#include "tools/sequence/planes/frame_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "config/profile_match.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {

namespace {

constexpr std::array<double, 3> kRec709Luma = {0.2126, 0.7152, 0.0722};

// Channels of a role in a file: color may come without alpha.
bool count_fits(Role role, size_t count) {
    if (role == Role::color) return count == 3 || count == 4;
    return count == size_t(channels_of(role));
}

// A layer with R, G and B, or r, g and b, that is not a cryptomatte's.
bool has_color(const ExrPart& part) {
    return std::any_of(part.channels.begin(), part.channels.end(), [&](const ExrChannel& c) {
        const std::string layer = c.name.substr(0, c.name.rfind('.') + 1);
        const auto has = [&](const char* green, const char* blue) {
            return part.find(layer + green) && part.find(layer + blue);
        };
        return ((c.name == layer + "R" && has("G", "B")) ||
                (c.name == layer + "r" && has("g", "b"))) &&
               layer.find("rypto") == std::string::npos;
    });
}

template <class File>
Result<std::shared_ptr<PixelFile>> shared(Result<File> file) {
    if (!file.ok()) return file.status();
    return std::shared_ptr<PixelFile>(std::make_shared<File>(std::move(*file)));
}

}  // namespace

Result<std::shared_ptr<PixelFile>> open_pixels(const std::string& path, const ReadLimits& limits,
                                               std::optional<Transfer> transfer) {
    if (image_format_of(path)) return shared(ImageFile::open(path, limits, std::move(transfer)));
    return shared(ExrFile::open(path, limits));
}

PixelFile& FrameFiles::file_of(Role role) const {
    const auto it = files.find(role);
    return it != files.end() ? *it->second : color_file();
}

Result<FrameFiles> open_frame(const std::map<Role, std::string>& files, int frame_number,
                              const ReadLimits& limits, std::optional<Transfer> transfer) try {
    FrameFiles frame;
    frame.frame_number = frame_number;
    for (const auto& [role, path] : files) frame.stamps[role] = FileStamp::of(path);
    std::map<std::string, std::shared_ptr<PixelFile>> opened;
    for (const auto& [role, path] : files) {
        std::shared_ptr<PixelFile>& file = opened[path];
        if (file == nullptr) {
            ASSIGN_OR_RETURN(file, open_pixels(path, limits, transfer));
        }
        if (role != Role::color && picture_of(*file))
            return Status(StatusCode::input,
                          concat(path, ": ", name_of(role),
                                 " is read from EXR files, which hold its values as they are; "
                                 "write it as EXR"));
        frame.files[role] = file;
    }
    if (!frame.files.contains(Role::color))
        return Status(StatusCode::internal, "open_frame without a color file");
    return frame;
} catch (...) {
    return status_of_exception("opening a frame");
}

FileChannels channels_of(const PixelFile& file) {
    const auto color_in = [&](bool deep_parts) {
        return std::any_of(file.parts().begin(), file.parts().end(), [&](const ExrPart& part) {
            return part.deep == deep_parts && has_color(part);
        });
    };
    const bool deep = file.flattening.behind ? color_in(true) : !color_in(false);
    FileChannels channels;
    for (const ExrPart& part : file.parts()) {
        PartChannels& p = channels.parts.emplace_back();
        p.name = part.name;
        p.view = part.view;
        if (part.deep ? deep : !(deep && file.flattening.behind))
            for (const ExrChannel& c : part.channels) p.channels.push_back(c.name);
        if (channels.views.empty()) channels.views = part.views;
    }
    return channels;
}

float outside_value(Role role, const ConvertOptions& convention, PixelType type) {
    if (role == Role::motion) return float(convention.motion.bias);
    if (role == Role::motion_back) return float(convention.motion_back.bias);
    if (role != Role::inverse_depth) return 0;
    switch (convention.depth) {
        case DepthEncoding::linear:
        case DepthEncoding::ray_distance:
            // As in Blender; a half cannot hold 1e10.
            return type == PixelType::half ? std::numeric_limits<float>::infinity() : 1e10f;
        case DepthEncoding::forward:
        case DepthEncoding::forward_infinite:
            return 1;
        case DepthEncoding::inverse:
        case DepthEncoding::reverse:
        case DepthEncoding::reverse_infinite:
            return 0;
    }
    return 0;
}

namespace {

// The channels of one part, for all roles that have theirs there.
struct PartRead {
    PixelFile* file;
    int part;
    std::vector<Role> roles;
    std::vector<std::string> channels;

    const ExrPart& info() const { return file->parts()[size_t(part)]; }
};

// Every part is read once; the first is color's.
Result<std::vector<PartRead>> reads_of(const FrameFiles& files, const FrameChannels& channels,
                                       RoleSet wanted) {
    std::vector<PartRead> reads;
    for (const Role role : kAllRoles) {  // which begins with color
        if (!wanted.has(role)) continue;
        PixelFile& file = files.file_of(role);
        const auto it = channels.find(role);
        if (it == channels.end()) {
            if (role == Role::color) RETURN_IF_ERROR(file.explain_no_color());
            return Status(StatusCode::input, concat(file.path(), ": no channels for ",
                                                    name_of(role), "; name them in a profile"));
        }
        const RoleChannels& source = it->second;
        if (!count_fits(role, source.channels.size())) {
            return Status(StatusCode::input,
                          concat(file.path(), ": ", name_of(role), " cannot be made of ",
                                 source.channels.size(), " channels; correct the profile"));
        }
        RETURN_IF_ERROR(file.check_channels(source.part, source.channels));
        auto read = std::find_if(reads.begin(), reads.end(), [&](const PartRead& known) {
            return known.file == &file && known.part == source.part;
        });
        if (read == reads.end()) read = reads.insert(read, PartRead{&file, source.part, {}, {}});
        read->roles.push_back(role);
        read->channels.insert(read->channels.end(), source.channels.begin(), source.channels.end());
    }
    return reads;
}

// StoredFrame::outside: of the roles in color's file.
std::map<int, std::map<std::string, float>> outside_values(const FrameFiles& files,
                                                           const FrameChannels& channels,
                                                           const ConvertOptions& convention) {
    std::map<int, std::map<std::string, float>> outside;
    const PixelFile& color_file = files.file_of(Role::color);
    for (const auto& [role, source] : channels) {
        if (&files.file_of(role) != &color_file || role == Role::color) continue;
        const ExrPart& part = color_file.parts()[size_t(source.part)];
        for (const std::string& name : source.channels)
            if (const ExrChannel* channel = part.find(name))
                outside[source.part][name] = outside_value(role, convention, channel->type);
    }
    return outside;
}

// Reads the planes of a part into `frame`. `data_window`: color's. `all`: keeps every channel of
// the part for the writer.
Status read_planes(PartRead& read, const FrameChannels& channels, const Window& data_window,
                   bool all, Keep keep, const ConvertOptions& convention, StoredFrame& frame) {
    if (!read.info().data_window.contains(data_window)) {
        return Status(
            StatusCode::input,
            concat(read.file->path(), ": the data window of ", name_of(read.roles[0]), ", ",
                   read.info().data_window.text(), ", does not cover that of color, ",
                   data_window.text(), "; render both with one data window"));
    }
    if (all) read.channels.clear();
    std::optional<Window> rows;
    if (keep == Keep::nothing) rows = frame.window;
    ASSIGN_OR_RETURN(PartPixels pixels, read.file->read_part(read.part, read.channels, rows));
    for (const Role role : read.roles) {
        const std::vector<std::string>& names = channels.at(role).channels;
        const PixelType type = pixels.find(names[0])->channel.type;
        const float outside = outside_value(role, convention, type);
        frame.planes[role] = pixels.interleaved(names, frame.window, channels_of(role), 1, outside);
        if (role == Role::inverse_depth) frame.half_depth = type == PixelType::half;
    }
    if (all) frame.kept = std::make_shared<PartPixels>(std::move(pixels));
    return Status();
}

}  // namespace

Result<StoredFrame> read_frame(const FrameFiles& files, const FrameChannels& channels,
                               RoleSet wanted, Keep keep,
                               const std::optional<PlanesArea>& area) try {
    wanted.add(Role::color);
    ASSIGN_OR_RETURN(auto reads, reads_of(files, channels, wanted));
    const Window& data_window = reads[0].info().data_window;
    const ConvertOptions convention = area ? area->convention : ConvertOptions();
    StoredFrame frame;
    frame.window = area ? area->window : data_window;
    frame.outside = outside_values(files, channels, convention);
    for (PartRead& read : reads)
        RETURN_IF_ERROR(read_planes(read, channels, data_window,
                                    &read == &reads[0] && keep == Keep::all, keep, convention,
                                    frame));
    return frame;
} catch (...) {
    return status_of_exception("reading a frame");
}

std::array<double, 3> luma_weights(const std::optional<std::array<float, 8>>& chromaticities) {
    if (!chromaticities) return kRec709Luma;
    // XYZ of each primary at Y = 1 is (x/y, 1, (1-x-y)/y). The weights S solve
    // sum_i S_i XYZ_i = XYZ of white, so S_i is also primary i's share of Y (RP 177, 3.3).
    double xyz[4][3];
    for (int i = 0; i < 4; ++i) {
        const double x = double((*chromaticities)[size_t(2 * i)]);
        const double y = double((*chromaticities)[size_t(2 * i + 1)]);
        if (!std::isfinite(x) || !std::isfinite(y) || std::abs(y) < 1e-9) return kRec709Luma;
        xyz[i][0] = x / y;
        xyz[i][1] = 1;
        xyz[i][2] = (1 - x - y) / y;
    }
    const auto det = [](const double* a, const double* b, const double* c) {
        return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) +
               c[0] * (a[1] * b[2] - a[2] * b[1]);
    };
    const double whole = det(xyz[0], xyz[1], xyz[2]);
    if (std::abs(whole) < 1e-9) return kRec709Luma;
    return {det(xyz[3], xyz[1], xyz[2]) / whole, det(xyz[0], xyz[3], xyz[2]) / whole,
            det(xyz[0], xyz[1], xyz[3]) / whole};
}

}  // namespace postchain::io
