// Compares files before and after write_filtered().
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/io/exr_files.h"
#include "tools/sequence/planes/frame_writer.h"

namespace postchain::io {

inline const std::vector<std::string> kRgba = {"R", "G", "B", "A"};

// A file that was read to be written with another color.
struct ReadFile : StoredFrame {
    FrameFiles files;
    RoleChannels color;
};
ReadFile read_file(const std::string& path, const FrameChannels& channels,
                   RoleSet wanted = {Role::color}, const std::optional<PlanesArea>& area = {});
ReadFile read_ok(const std::string& path, int part = 0,
                 const std::vector<std::string>& color = kRgba);

// A folder with the file that is read and what is written of it.
class InOut : public testing::Test {
  protected:
    // Writes `parts` and new color over one of them: nothing else may change.
    WriteReport expect_new_color(const std::vector<test::FilePart>& parts,
                                 WriteOptions options = {}, int part = 0,
                                 const std::vector<std::string>& channels = kRgba);

    const test::TempFolder folder;
    const std::string in = folder.path("in.exr"), out = folder.path("out.exr");
};
using ExrChunks = InOut;
using ExrWriter = InOut;
using ExrOutputSettings = InOut;

// An image unlike any input: each pixel and channel has its own value, exact in half.
ImageF new_color(const StoredFrame& frame);

Result<WriteReport> write_filtered(const std::string& path, const ReadFile& frame,
                                   const ImageF& color, const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers = {});

WriteReport write_ok(const std::string& path, const ReadFile& frame, const ImageF& color,
                     WriteOptions options = {});

// Expects all channels of `out` to equal those of `in`, except for `replaced`, which hold `color`.
void expect_only_color_changed(const std::string& in, const std::string& out, int part,
                               const std::vector<std::string>& replaced, const ImageF& color);

// Expects the samples of a channel that lie in the window of `made` to have the bits they were made
// from, and all others the bits `outside`.
void expect_channel(const PartPixels& pixels, const test::FilePart& made, size_t channel,
                    uint32_t outside = 0);
// The same of every channel of the part.
void expect_samples(const std::string& path, int part, const test::FilePart& made);

// Attributes that differ between `in` and `out`: first the removed ones, then the new ones.
std::vector<std::string> attribute_changes(const std::string& in, const std::string& out,
                                           int part = 0);

// A part with channels of every type, windows of its own and attributes.
test::FilePart every_type(const std::string& name = {});

}  // namespace postchain::io
