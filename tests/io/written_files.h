// Files before and after write_filtered(): what to write, and what of it changed.
#pragma once

#include <string>
#include <vector>

#include "tests/io/exr_files.h"
#include "tools/sequence/frame/frame_writer.h"

namespace postchain::io {

inline const std::vector<std::string> kRgba = {"R", "G", "B", "A"};

InputFrame read_ok(const std::string& path, int part = 0,
                   const std::vector<std::string>& color = kRgba);

// A picture no input holds: values of each pixel and channel apart, exact in half.
ImageF new_color(const InputFrame& frame);

WriteReport write_ok(const std::string& path, InputFrame& frame, const ImageF& color,
                     WriteOptions options = {});

// All channels of `out` are those of `in` but for `replaced`, which hold `color`.
void expect_only_color_changed(const std::string& in, const std::string& out, int part,
                               const std::vector<std::string>& replaced, const ImageF& color);

// Attributes of `out` beside those of `in`: first what is gone, then what is new.
std::vector<std::string> attribute_changes(const std::string& in, const std::string& out,
                                           int part = 0);

// A part with channels of every type, windows of its own and attributes.
test::FilePart every_type(const std::string& name = {});

}  // namespace postchain::io
