// Compares files before and after write_filtered().
#pragma once

#include <string>
#include <vector>

#include "tests/io/exr_files.h"
#include "tools/sequence/frame/frame_writer.h"

namespace postchain::io {

inline const std::vector<std::string> kRgba = {"R", "G", "B", "A"};

InputFrame read_ok(const std::string& path, int part = 0,
                   const std::vector<std::string>& color = kRgba);

// An image unlike any input: each pixel and channel has its own value, exact in half.
ImageF new_color(const InputFrame& frame);

WriteReport write_ok(const std::string& path, InputFrame& frame, const ImageF& color,
                     WriteOptions options = {});

// Expects all channels of `out` to equal those of `in`, except for `replaced`, which hold `color`.
void expect_only_color_changed(const std::string& in, const std::string& out, int part,
                               const std::vector<std::string>& replaced, const ImageF& color);

// Attributes that differ between `in` and `out`: first the removed ones, then the new ones.
std::vector<std::string> attribute_changes(const std::string& in, const std::string& out,
                                           int part = 0);

// A part with channels of every type, windows of its own and attributes.
test::FilePart every_type(const std::string& name = {});

}  // namespace postchain::io
