// NumPy arrays as the file of a frame, and planes as NumPy arrays.
//
//   arrays --ArrayFile--> the readers of tools/sequence, with the names of the profile `generic`
#pragma once

#include <pybind11/numpy.h>

#include <map>
#include <memory>
#include <vector>

#include "chain/base/image.h"
#include "chain/frame/role.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::python {

// Arrays as they were given; None = no such plane.
struct FrameArrays {
    pybind11::object color, depth, motion, motion_back;
    pybind11::object aovs;          // dict by name: height x width x 3 or 4
    pybind11::object mattes;        // dict by name: height x width
    pybind11::object cryptomattes;  // dict by name: ranks, or (ranks, manifest)
};

// Reads arrays in place, whatever their strides are; they must not change meanwhile.
class ArrayFile final : public io::PixelFile {
  public:
    // The arrays are channels of one part: a layer's NAME.R, .G, .B, .A, a matte's NAME, a
    // cryptomatte's as in a file. Raises UsageError naming the array: not float32 or float16 in
    // this machine's byte order, other shapes than (height, width, channels), different sizes, no
    // pixels, too large; a name that another array has.
    ArrayFile(const FrameArrays& arrays, double pixel_aspect, const std::string& path);

    // The array that has the channel: "color", "aovs['diffuse']".
    const std::string& argument_of(const std::string& channel) const {
        return channels_.at(channel).argument;
    }

    int rows_at_once(int) const override { return parts_[0].data_window.height(); }

  private:
    struct Channel {
        const char* first;
        pybind11::ssize_t row_stride, column_stride;  // bytes
        std::string argument;
    };
    void add(const std::string& argument, const pybind11::object& array,
             const std::vector<std::string>& names);
    void add_cryptomatte(const std::string& argument, const std::string& name,
                         const pybind11::object& given);
    Status read_planes(io::PartPixels& pixels) override;

    std::vector<pybind11::array> arrays_;
    std::map<std::string, Channel, std::less<>> channels_;
};

// Takes the pixels over: nothing is copied.
pybind11::array array_of(ImageF image);
// A view of a shared plane, read-only.
pybind11::array array_of(std::shared_ptr<const ImageF> image);
// The first three channels of four.
ImageF without_alpha(const ImageF& image);

// A copy for metrics: (height, width, 3 or 4), or the three alike of (height, width). Raises
// UsageError naming `argument`.
ImageF image_of(const char* argument, const pybind11::object& array);

}  // namespace postchain::python
