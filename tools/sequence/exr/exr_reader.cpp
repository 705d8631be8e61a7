#include "tools/sequence/exr/exr_reader.h"

#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiView.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringVectorAttribute.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <new>
#include <numeric>

#include "tools/sequence/exr/exr_attributes.h"
#include "tools/sequence/exr/exr_chunk_reader.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_part_check.h"
#include "tools/sequence/exr/worker_pool.h"

namespace postchain::io {

namespace {

Status input_error(const std::string& path, const std::string& what) {
    return Status(StatusCode::input, concat(path, ": ", what));
}

// The part after the last dot: "BY" of "left.BY".
std::string_view base_name(std::string_view channel) {
    const size_t dot = channel.rfind('.');
    return dot == std::string_view::npos ? channel : channel.substr(dot + 1);
}

std::string joined(const std::vector<ExrChannel>& channels) {
    std::string text;
    for (const ExrChannel& c : channels) text += (text.empty() ? "" : ", ") + c.name;
    return text;
}

ExrPart part_of(const Imf::Header& header) {
    ExrPart part;
    if (header.hasName()) part.name = header.name();
    if (header.hasView()) part.view = header.view();
    part.tiled = header.hasTileDescription();
    part.type = header.hasType() ? header.type()
                : part.tiled     ? Imf::TILEDIMAGE
                                 : Imf::SCANLINEIMAGE;
    part.deep = part.type == Imf::DEEPSCANLINE || part.type == Imf::DEEPTILE;
    part.mip_mapped = part.tiled && header.tileDescription().mode != Imf::ONE_LEVEL;
    part.compression = compression_name(header.compression());
    part.data_window = window_of(header.dataWindow());
    part.display_window = window_of(header.displayWindow());
    part.pixel_aspect = header.pixelAspectRatio();
    part.channels = channels_in(header);
    if (Imf::hasMultiView(header)) part.views = Imf::multiView(header);
    if (Imf::hasChromaticities(header)) {
        const Imf::Chromaticities& c = Imf::chromaticities(header);
        part.chromaticities = {c.red.x,  c.red.y,  c.green.x, c.green.y,
                               c.blue.x, c.blue.y, c.white.x, c.white.y};
    }
    for (auto it = header.begin(); it != header.end(); ++it) {
        part.attributes[it.name()] = attribute_text(it.attribute());
    }
    return part;
}

ChunkSource chunk_source(const ExrFile::Impl& file, int part) {
    ChunkSource source;
    source.fd = file.stream->fd();
    source.offsets = file.facts.chunks[size_t(part)];
    if (file.facts.multi_part) source.part = part;
    return source;
}

PartPixels::Plane make_plane(const ExrChannel& channel, const Window& w) {
    PartPixels::Plane plane;
    plane.channel = channel;
    plane.width = samples_between(w.min_x, w.max_x, channel.x_sampling);
    plane.height = samples_between(w.min_y, w.max_y, channel.y_sampling);
    // Not cleared: pages of a file that turns out damaged are then never touched.
    plane.bytes =
        std::make_unique_for_overwrite<std::byte[]>(std::max<size_t>(plane.total_bytes(), 1));
    return plane;
}

}  // namespace

void set_exr_threads(int count) {
    Imf::setGlobalThreadCount(std::max(count, 0));
    WorkerPool::shared().set_threads(count);
}

const ExrChannel* ExrPart::find(std::string_view channel) const {
    for (const ExrChannel& c : channels) {
        if (c.name == channel) return &c;
    }
    return nullptr;
}

bool ExrPart::luminance_chroma() const {
    return std::any_of(channels.begin(), channels.end(), [](const ExrChannel& c) {
        return base_name(c.name) == "RY" || base_name(c.name) == "BY";
    });
}

// --- ExrFile ------------------------------------------------------------------------------------

ExrFile::ExrFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ExrFile::ExrFile(ExrFile&&) noexcept = default;
ExrFile& ExrFile::operator=(ExrFile&&) noexcept = default;
ExrFile::~ExrFile() = default;

const std::string& ExrFile::path() const {
    return impl_->path;
}
const std::vector<ExrPart>& ExrFile::parts() const {
    return impl_->parts;
}
uint64_t ExrFile::file_bytes() const {
    return impl_->bytes;
}

const PictureFile* ExrFile::picture() const {
    return impl_->picture.get();
}

Result<ExrFile> ExrFile::open(const std::string& path, const ReadLimits& limits,
                              std::optional<Transfer> transfer) try {
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    if (picture_format_of(path)) {
        auto picture = PictureFile::open(path, limits, transfer);
        if (!picture.ok()) return picture.status();
        impl->picture = std::make_unique<PictureFile>(std::move(*picture));
        impl->bytes = std::filesystem::file_size(path);
        impl->parts = {impl->picture->part()};
        return ExrFile(std::move(impl));
    }
    impl->stream = std::make_unique<FdIStream>(path);
    // O_NONBLOCK: a pipe is refused below instead of waiting here for a writer.
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        return input_error(path, errno == ENOENT
                                     ? std::string("no such file")
                                     : concat("cannot be opened: ", std::strerror(errno)));
    }
    struct stat info = {};
    const bool is_file = ::fstat(fd, &info) == 0 && S_ISREG(info.st_mode);
    impl->bytes = uint64_t(info.st_size);
    impl->stream->take(fd, impl->bytes);
    if (!is_file) return input_error(path, "is not a file");
    Result<HeaderFacts> facts = scan_header(fd, impl->bytes, limits);
    if (!facts.ok()) return facts.status().at(path);
    impl->facts = std::move(*facts);
    static std::once_flag once;
    std::call_once(once, [] { Imf::Header::setMaxTileSize(kMaxSide, kMaxSide); });
    // No reconstruction of chunk tables: an incomplete file is refused below.
    impl->file =
        std::make_unique<Imf::MultiPartInputFile>(*impl->stream, Imf::globalThreadCount(), false);
    for (int i = 0; i < impl->file->parts(); ++i) {
        if (!impl->file->partComplete(i)) {
            return input_error(
                path, "incomplete: its writer did not finish; wait for it or render it again");
        }
        impl->parts.push_back(part_of(impl->file->header(i)));
    }
    return ExrFile(std::move(impl));
} catch (...) {
    return status_of_exr_exception(StatusCode::input, path, "damaged or truncated: ");
}

Status ExrFile::check_channels(int part, const std::vector<std::string>& channels) const try {
    if (part < 0 || size_t(part) >= parts().size()) {
        return input_error(path(), concat("has no part ", part));
    }
    const ExrPart& p = parts()[size_t(part)];
    const std::string place =
        p.name.empty() ? path() : concat(path(), ": part ", part, " '", p.name, "'");
    if (p.deep) {
        return input_error(place, "is deep (many samples per pixel); flatten it before filtering");
    }
    for (const std::string& name : channels) {
        const ExrChannel* c = p.find(name);
        if (c == nullptr) {
            return input_error(place,
                               concat("has no channel ", name, "; it has: ", joined(p.channels)));
        }
        if (p.luminance_chroma() &&
            (base_name(name) == "Y" || base_name(name) == "RY" || base_name(name) == "BY")) {
            return input_error(place,
                               concat("channel ", name,
                                      " is luminance-chroma (Y, RY, BY); convert it to R, G, B"));
        }
        if (c->x_sampling != 1 || c->y_sampling != 1) {
            return input_error(place, concat("channel ", name, " is subsampled ", c->x_sampling,
                                             "x", c->y_sampling, "; write it at full size"));
        }
    }
    return {};
} catch (...) {
    return status_of_exception(path());
}

Status ExrFile::explain_no_color() const try {
    // Beside flat color neither is what is wrong.
    for (const ExrPart& p : parts()) {
        if (p.deep || p.luminance_chroma()) continue;
        for (const ExrChannel& c : p.channels)
            if (base_name(c.name) == "R") return {};
    }
    for (const ExrPart& p : parts()) {
        if (p.luminance_chroma()) {
            return input_error(path(), concat("is luminance-chroma (", joined(p.channels),
                                              "); convert it to R, G, B before filtering"));
        }
    }
    for (const ExrPart& p : parts()) {
        if (p.deep) {
            return input_error(path(),
                               "is deep (many samples per pixel); flatten it before filtering");
        }
    }
    return {};
} catch (...) {
    return status_of_exception(path());
}

int ExrFile::rows_at_once(int part) const {
    if (impl_->picture) return parts()[0].data_window.height();
    const Imf::Header& header = impl_->file->header(part);
    if (header.hasTileDescription()) return int(header.tileDescription().ySize);
    return lines_of_chunk(int(header.compression()));
}

Result<PartPixels> ExrFile::read_part(int part, const std::vector<std::string>& channels,
                                      const std::optional<Window>& area) try {
    if (part < 0 || size_t(part) >= parts().size() || parts()[size_t(part)].deep) {
        return check_channels(part, {});
    }
    const ExrPart& info = parts()[size_t(part)];
    PartPixels pixels;
    pixels.part = part;
    pixels.window = info.data_window;
    if (area) {
        // Whole tiles, and whole samples of subsampled channels.
        int step = info.tiled ? rows_at_once(part) : 1;
        for (const ExrChannel& c : info.channels) step = std::lcm(step, c.y_sampling);
        const int top = info.data_window.min_y, last = info.data_window.max_y;
        const int first_row = std::clamp(area->min_y, top, last) - top;
        const int last_row = std::clamp(area->max_y, top, last) - top;
        pixels.window.min_y = top + first_row / step * step;
        pixels.window.max_y = std::min(last, top + (last_row / step + 1) * step - 1);
    }
    for (const ExrChannel& c : info.channels) {
        const bool wanted = channels.empty() ||
                            std::find(channels.begin(), channels.end(), c.name) != channels.end();
        if (wanted) pixels.planes.push_back(make_plane(c, pixels.window));
    }
    for (const std::string& name : channels) {
        if (pixels.find(name) == nullptr) return check_channels(part, {name});
    }
    if (impl_->picture) {
        if (Status s = impl_->picture->read(pixels); !s.ok()) return s;
        return pixels;
    }
    if (const auto layout = ChunkLayout::of(impl_->file->header(part))) {
        if (Status s = read_chunks(chunk_source(*impl_, part), *layout, pixels); !s.ok())
            return s.at(parts().size() > 1 ? concat(path(), ": part ", part, " '", info.name, "'")
                                           : path());
        return pixels;
    }
    const Imf::FrameBuffer buffer = frame_buffer_of(planes_of(pixels));
    if (info.tiled) {
        Imf::TiledInputPart in(*impl_->file, part);
        in.setFrameBuffer(buffer);
        const int rows = int(in.tileYSize());
        const int first = (pixels.window.min_y - info.data_window.min_y) / rows;
        const int last = (pixels.window.max_y - info.data_window.min_y) / rows;
        in.readTiles(0, in.numXTiles(0) - 1, first, last, 0, 0);
    } else {
        Imf::InputPart in(*impl_->file, part);
        in.setFrameBuffer(buffer);
        in.readPixels(pixels.window.min_y, pixels.window.max_y);
    }
    return pixels;
} catch (...) {
    return status_of_exr_exception(StatusCode::input, path(), "damaged or truncated: ");
}

Result<ImageF> ExrFile::read_channels(int part, const std::vector<std::string>& channels) try {
    if (Status s = check_channels(part, channels); !s.ok()) return s;
    Result<PartPixels> pixels = read_part(part, channels);
    if (!pixels.ok()) return pixels.status();
    return pixels->interleaved(channels, pixels->window);
} catch (...) {
    return status_of_exception(path());
}

}  // namespace postchain::io
