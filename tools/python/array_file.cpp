#include "tools/python/array_file.h"

#include <cstring>

#include "tools/python/errors.h"
#include "tools/python/values.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

[[noreturn]] void wrong(const std::string& argument, const std::string& what) {
    raise_usage(argument, ": ", what);
}

std::string shape_text(const py::array& array) {
    std::string text;
    for (py::ssize_t i = 0; i < array.ndim(); ++i) text += concat(i ? "x" : "", array.shape(i));
    return text.empty() ? "no dimensions" : text;
}

// An array of floats of two or three dimensions; two if it has one channel.
py::array float_array(const std::string& argument, const py::object& object) {
    if (!py::isinstance<py::array>(object))
        wrong(argument, concat("is a ", type_of(object),
                               ", not a NumPy array; convert it with numpy.asarray()"));
    const auto array = py::reinterpret_borrow<py::array>(object);
    const py::dtype type = array.dtype();
    if (type.kind() != 'f' || (type.itemsize() != 2 && type.itemsize() != 4))
        wrong(argument,
              concat("has the type ", std::string(py::str(py::handle(type))), "; convert it with ",
                     type.kind() == 'u' && type.itemsize() <= 2
                         ? concat("(x / ", type.itemsize() == 1 ? 255 : 65535,
                                  ").astype(numpy.float32), and to linear light")
                         : std::string(".astype(numpy.float32)")));
    if (!type.attr("isnative").cast<bool>())
        wrong(argument,
              "has the byte order of another machine; convert it with "
              ".astype(numpy.float32)");
    if (array.ndim() != 2 && array.ndim() != 3)
        wrong(argument,
              concat("has the shape ", shape_text(array), "; give height x width x channels"));
    if (array.size() == 0)
        wrong(argument, concat("has no pixels: ", shape_text(array), "; give at least one"));
    if (array.shape(0) > io::kMaxSide || array.shape(1) > io::kMaxSide)
        wrong(argument, concat("is ", shape_text(array), "; at most ", io::kMaxSide,
                               " pixels a side can be filtered"));
    return array;
}

py::ssize_t channels_in(const py::array& array) {
    return array.ndim() == 2 ? 1 : array.shape(2);
}

// Entries of a dict of arrays, with the name of each for messages: "aovs['diffuse']".
struct NamedArray {
    std::string name, argument;
    py::object value;
};
std::vector<NamedArray> named_arrays(const char* argument, const py::object& object) {
    std::vector<NamedArray> arrays;
    if (object.is_none()) return arrays;
    if (!py::isinstance<py::dict>(object))
        wrong(argument, concat("is a ", type_of(object), "; give a dict of arrays by name"));
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(object)) {
        const std::string name = py::isinstance<py::str>(key) ? std::string(py::str(key)) : "";
        if (name.empty() || name.find_first_of(":,") != std::string::npos)
            wrong(argument, concat(std::string(py::repr(key)),
                                   " is not a name; give a string without : and ,"));
        arrays.push_back(
            {name, concat(argument, "['", name, "']"), py::reinterpret_borrow<py::object>(value)});
    }
    return arrays;
}

std::vector<std::string> with_prefix(const std::string& name, const std::string& letters) {
    std::vector<std::string> names;
    for (const char letter : letters) names.push_back(concat(name, ".", letter));
    return names;
}

py::array array_over(const ImageF& image, const py::capsule& owner) {
    const py::ssize_t channels = image.channels;
    std::vector<py::ssize_t> shape = {image.height, image.width};
    if (channels > 1) shape.push_back(channels);
    return py::array_t<float>(shape, image.data.data(), owner);
}

}  // namespace

ArrayFile::ArrayFile(const FrameArrays& arrays, double pixel_aspect, const std::string& path) {
    path_ = path;
    io::ExrPart& part = parts_.emplace_back();
    part.type = part.compression = "array";
    part.pixel_aspect = float(pixel_aspect);
    const py::array color = float_array("color", arrays.color);
    if (channels_in(color) != 3 && channels_in(color) != 4)
        wrong("color", concat("has the shape ", shape_text(color),
                              "; give height x width x 3 (RGB) or 4 (RGBA, premultiplied)"));
    part.data_window = {0, 0, int(color.shape(1)) - 1, int(color.shape(0)) - 1};
    part.display_window = part.data_window;
    const bool alpha = channels_in(color) == 4;
    add("color", arrays.color,
        alpha ? std::vector<std::string>{"R", "G", "B", "A"}
              : std::vector<std::string>{"R", "G", "B"});
    add("depth", arrays.depth, {"Z"});
    add("motion", arrays.motion, {"motion.x", "motion.y"});
    add("motion_back", arrays.motion_back, {"motion_back.x", "motion_back.y"});
    for (const auto& [name, argument, value] : named_arrays("aovs", arrays.aovs)) {
        const py::array layer = float_array(argument, value);
        if (channels_in(layer) != 3 && channels_in(layer) != 4)
            wrong(argument, concat("has the shape ", shape_text(layer),
                                   "; give height x width x 3 (RGB) or 4 (RGBA)"));
        add(argument, layer, with_prefix(name, channels_in(layer) == 4 ? "RGBA" : "RGB"));
    }
    for (const auto& [name, argument, value] : named_arrays("mattes", arrays.mattes))
        add(argument, value, {name});
    for (const auto& [name, argument, value] : named_arrays("cryptomattes", arrays.cryptomattes))
        add_cryptomatte(argument, name, value);
}

void ArrayFile::add_cryptomatte(const std::string& argument, const std::string& name,
                                const py::object& given) {
    io::ExrPart& part = parts_[0];
    const std::string prefix = concat("cryptomatte/", name, "/");
    py::object ranks = given;
    if (py::isinstance<py::tuple>(given) && py::len(given) == 2) {
        ranks = given.cast<py::tuple>()[0];
        const py::object manifest = given.cast<py::tuple>()[1];
        if (!py::isinstance<py::dict>(manifest))
            wrong(argument, concat("its manifest is a ", type_of(manifest),
                                   "; give a dict of names and their ids as 8 hexadecimal digits"));
        part.attributes[prefix + "manifest"] = json_text_of(manifest);
    }
    const py::array array = float_array(argument, ranks);
    if (array.ndim() != 3 || array.shape(2) % 4 != 0)
        wrong(argument, concat("has the shape ", shape_text(array),
                               "; give height x width x 4, 8, ...: id, coverage, id, coverage"));
    if (array.itemsize() != 4)
        wrong(argument, "is float16, and ids are the bits of floats; give float32");
    part.attributes[prefix + "name"] = name;
    std::vector<std::string> names;
    for (py::ssize_t level = 0; 4 * level < array.shape(2); ++level)
        for (auto& channel : with_prefix(concat(name, level < 10 ? "0" : "", level), "rgba"))
            names.push_back(std::move(channel));
    add(argument, array, names);
}

void ArrayFile::add(const std::string& argument, const py::object& object,
                    const std::vector<std::string>& names) {
    if (object.is_none()) return;
    const py::array array = float_array(argument, object);
    io::ExrPart& part = parts_[0];
    if (channels_in(array) != py::ssize_t(names.size()))
        wrong(argument, concat("has the shape ", shape_text(array), "; give height x width",
                               names.size() == 1 ? "" : " x 2"));
    if (array.shape(0) != part.data_window.height() || array.shape(1) != part.data_window.width())
        wrong(argument, concat("is ", array.shape(1), "x", array.shape(0), " pixels, color ",
                               part.data_window.width(), "x", part.data_window.height(),
                               "; the planes of a frame have one size"));
    const auto type = array.itemsize() == 2 ? io::PixelType::half : io::PixelType::float32;
    const char* first = static_cast<const char*>(array.data());
    for (size_t c = 0; c < names.size(); ++c) {
        if (channels_.contains(names[c]))
            wrong(argument,
                  concat("another array has the channel ", names[c], "; rename this one"));
        const py::ssize_t step = array.ndim() == 3 ? array.strides(2) : 0;
        part.channels.push_back({names[c], type});
        channels_[names[c]] = {first + py::ssize_t(c) * step, array.strides(0), array.strides(1),
                               argument};
    }
    arrays_.push_back(array);
}

// Called without the GIL.
Status ArrayFile::read_planes(io::PartPixels& pixels) {
    for (int y = pixels.window.min_y; y <= pixels.window.max_y; ++y) {
        for (io::PartPixels::Plane& plane : pixels.planes) {
            const Channel& channel = channels_.find(plane.channel.name)->second;
            const char* from = channel.first + y * channel.row_stride;
            std::byte* to = plane.bytes.get() + size_t(y - pixels.window.min_y) * plane.row_bytes();
            const auto copy = [&]<class Value>(Value) {
                for (int x = 0; x < plane.width; ++x, from += channel.column_stride)
                    std::memcpy(to + size_t(x) * sizeof(Value), from, sizeof(Value));
            };
            if (plane.channel.type == io::PixelType::half)
                copy(uint16_t());
            else
                copy(uint32_t());
        }
    }
    return {};
}

py::array array_of(ImageF image) {
    auto* held = new ImageF(std::move(image));
    const py::capsule owner(held, [](void* pointer) { delete static_cast<ImageF*>(pointer); });
    return array_over(*held, owner);
}

py::array array_of(std::shared_ptr<const ImageF> image) {
    using Held = std::shared_ptr<const ImageF>;
    auto* held = new Held(std::move(image));
    const py::capsule owner(held, [](void* pointer) { delete static_cast<Held*>(pointer); });
    py::array array = array_over(**held, owner);
    array.attr("flags").attr("writeable") = false;
    return array;
}

ImageF without_alpha(const ImageF& image) {
    ImageF rgb(image.width, image.height, 3);
    for (size_t i = 0; i < image.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) rgb.data[3 * i + c] = image.data[4 * i + c];
    return rgb;
}

ImageF image_of(const char* argument, const py::object& object) {
    const py::array array = float_array(argument, object);
    const py::ssize_t channels = channels_in(array);
    if (channels != 1 && channels != 3 && channels != 4)
        wrong(argument,
              concat("has the shape ", shape_text(array), "; give height x width, x 3 or x 4"));
    const auto floats =
        py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(array);
    if (!floats) throw py::error_already_set();
    ImageF image(int(array.shape(1)), int(array.shape(0)), channels == 1 ? 3 : int(channels));
    const float* from = floats.data();
    if (channels != 1)
        std::copy_n(from, image.data.size(), image.data.data());
    else
        for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = from[i / 3];
    return image;
}

}  // namespace postchain::python
