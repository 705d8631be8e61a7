#include "tools/python/write_call.h"

#include <pybind11/stl.h>

#include <bit>
#include <deque>
#include <filesystem>

#include "chain/frame/layers.h"
#include "tools/python/errors.h"
#include "tools/python/frame_object.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/image_writer.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/run/output_frame.h"
#include "tools/sequence/source/file_convention.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWrittenFillMask = "fill";

// A result of a chain, taken apart.
struct Parts {
    ImageF color;
    std::map<std::string, ImageF> aovs;
    std::map<std::string, py::object> cryptomattes;
    std::optional<ImageF> fill_mask;
};

Parts parts_of(const py::object& result) {
    Parts parts;
    if (!py::hasattr(result, "aovs")) {
        parts.color = image_of("image", result);
        return parts;
    }
    parts.color = image_of("image.color", result.attr("color"));
    for (const auto& [name, array] : result.attr("aovs").cast<py::dict>())
        parts.aovs[py::str(name)] =
            image_of("image.aovs", py::reinterpret_borrow<py::object>(array));
    parts.cryptomattes = result.attr("cryptomattes").cast<std::map<std::string, py::object>>();
    if (const py::object mask = result.attr("fill_mask"); !mask.is_none())
        parts.fill_mask = image_of("image.fill_mask", mask);
    return parts;
}

// The color as a file, whose kind of values decides how an image of another format has them.
std::unique_ptr<ArrayFile> array_file_of(const py::object& result) {
    FrameArrays arrays{py::none(), py::none(), py::none(), py::none(),
                       py::none(), py::none(), py::none()};
    arrays.color = py::hasattr(result, "aovs") ? result.attr("color") : result;
    return std::make_unique<ArrayFile>(arrays, 1, "the array");
}

// Four channels; alpha 1 if there is none.
ImageF with_alpha(const ImageF& image, float alpha = 1) {
    if (image.channels == 4) return image;
    ImageF rgba(image.width, image.height, 4, alpha);
    for (size_t i = 0; i < image.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) rgba.data[4 * i + c] = image.data[3 * i + c];
    return rgba;
}

// The ranks of an array of height x width x (id, coverage of each rank).
io::RankedCoverage ranks_of(const std::string& name, const py::object& object) {
    const auto array =
        py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(object);
    if (!array || array.ndim() != 3 || array.shape(2) % 2 != 0)
        raise_usage("image.cryptomattes['", name, "']: give height x width x (id, coverage, ...)");
    io::RankedCoverage ranks(int(array.shape(1)), int(array.shape(0)), int(array.shape(2) / 2));
    const float* from = array.data();
    for (size_t i = 0; i < ranks.ids.size(); ++i) {
        ranks.ids[i] = std::bit_cast<io::CryptoId>(from[2 * i]);
        ranks.coverages[i] = from[2 * i + 1];
    }
    return ranks;
}

void expect_size(const std::string& what, int width, int height, const io::Window& window) {
    if (width != window.width() || height != window.height())
        raise_usage(what, ": is ", width, "x", height, " pixels, the frame ", window.width(), "x",
                    window.height(), "; give what was filtered of this frame");
}

// The view of a frame of files: what the result lacks stays as it is in the file.
sequence::FilteredView view_of(Parts& parts, const sequence::FrameHeader& header) {
    sequence::FilteredView view;
    expect_size("image", parts.color.width, parts.color.height, header.window);
    view.color = with_alpha(parts.color);
    std::vector<ImageF> layers;
    for (const FileLayer& layer : header.layers.filtered) {
        const auto found = parts.aovs.find(layer.name);
        if (found == parts.aovs.end())
            raise_usage("image.aovs: has no '", layer.name,
                        "', which the frame filters; give what filter() returned of it");
        expect_size("image.aovs", found->second.width, found->second.height, header.window);
        layers.push_back(with_alpha(found->second, 0));
    }
    if (!layers.empty()) view.layers = stack_planes(layers);
    for (size_t i = 0; i < header.layers.filtered_cryptomattes; ++i) {
        const std::string& name = header.layers.cryptomattes[i].name;
        const auto found = parts.cryptomattes.find(name);
        if (found == parts.cryptomattes.end())
            raise_usage("image.cryptomattes: has no '", name,
                        "', which the frame filters; give what filter() returned of it");
        view.cryptomattes.push_back(ranks_of(name, found->second));
        expect_size("image.cryptomattes", view.cryptomattes.back().width,
                    view.cryptomattes.back().height, header.window);
    }
    return view;
}

// A new EXR with color, AOVs as NAME.R ... and the fill mask.
Result<io::WriteReport> write_new(const std::string& path, const Parts& parts,
                                  const io::WriteOptions& options) {
    io::PlanesFile file;
    const auto type = options.exr.half ? io::PixelType::half : io::PixelType::float32;
    const auto add = [&](const std::string& prefix, const ImageF& image, io::PixelType its) {
        static const char* const letters[] = {"R", "G", "B", "A"};
        for (int c = 0; c < image.channels; ++c)
            if (const std::string name = prefix + letters[c]; options.exr.takes(name))
                file.channels.push_back({name, its, &image, c});
    };
    add("", parts.color, type);
    for (const auto& [name, image] : parts.aovs) add(name + ".", image, type);
    if (parts.fill_mask) {
        const auto names = sequence::fill_mask_channels(kWrittenFillMask);
        for (int c = 0; c < int(names.size()); ++c)
            file.channels.push_back({names[size_t(c)], io::PixelType::half, &*parts.fill_mask, c});
    }
    return io::write_planes_exr(path, file, options);
}

}  // namespace

const std::set<std::string>& write_keys() {
    static const std::set<std::string> keys = {
        "mkdir", "on_existing",     "overflow", "compression",  "half",      "channels",
        "bits",  "output_transfer", "ocio",     "ocio_display", "ocio_view", "ocio_colorspace"};
    return keys;
}

void write_image(const std::string& path, const py::object& result, const py::object& given,
                 const py::kwargs& values) {
    if (!given.is_none() && !py::isinstance<Frame>(given))
        raise_usage("frame: is a ", type_of(given), "; give the Frame that the image was made of");
    const auto frame = given.is_none() ? nullptr : given.cast<std::shared_ptr<Frame>>();
    const bool of_files = frame && frame->is_of_files();
    sequence::RunSettings settings =
        job_settings("write", "frame.exr", path, py::none(), values, write_keys());
    if (settings.on_existing == io::OnExisting::skip)
        raise_usage("on_existing: skip is for runs; give fail or overwrite");
    Parts parts = parts_of(result);
    const auto array = array_file_of(result);
    sequence::FilteredView view;
    if (of_files) view = view_of(parts, frame->header());
    io::OutputFiles files(settings.on_existing);
    if (of_files)
        for (const auto& [role, file] : frame->header().files.files)
            files.read(io::InputFile{file->path(), "the frame"});
    files.write(io::OutputFile{path, "the image", "name another"});
    auto report = in_background("write", [&](Call&) -> Result<io::WriteReport> {
        RETURN_IF_ERROR(files.check());
        files.remove_left_temporaries();
        if (const std::string folder = fs::path(path).parent_path().string();
            settings.make_folder && !folder.empty())
            RETURN_IF_ERROR(io::make_folder(folder));
        if (of_files) {
            ASSIGN_OR_RETURN(
                auto source,
                sequence::read_source_frame(frame->settings(), frame->header(), {}, io::Keep::all));
            return sequence::write_view(path, source, view, settings, files);
        }
        io::WriteOptions options;
        ASSIGN_OR_RETURN(options.on_existing, files.permit(path));
        options.exr = settings.exr;
        options.overflow = settings.overflow.value_or(io::HalfOverflow::refuse);
        if (!io::image_format_of(path)) return write_new(path, parts, options);
        if (!parts.aovs.empty() || parts.fill_mask)
            return Status(StatusCode::usage,
                          path +
                              ": AOVs and a fill mask need an EXR; write .exr, or the color "
                              "alone");
        ASSIGN_OR_RETURN(
            const auto encoding,
            io::image_encoding(path, *array, size_t(parts.color.channels), settings.picture));
        ImageF color = with_alpha(parts.color);
        if (encoding.unassociated) {
            ConvertOptions unassociated;
            unassociated.unpremultiplied = true;
            sequence::to_file_convention(color, unassociated, ImageF(color.width, color.height, 4));
        }
        return io::write_picture(path, color, encoding, "", 0, options);
    });
    if (!report.ok()) raise(report.status());
    std::vector<std::string> warnings = report->notes;
    if (report->overflow_pixels)
        warnings.push_back(concat(path, ": ", report->overflow_pixels,
                                  " pixels clamped to the largest value of the channel's type"));
    warn(warnings);
}

}  // namespace postchain::python
