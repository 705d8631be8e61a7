// One frame: the files of an InputSpec opened, and its planes read in the files' own convention.
//
//   files --open_frame--> OpenFrame (headers; the profile resolves roles on them)
//   OpenFrame + ChannelAssignment --read_frame--> InputFrame --chain/convert.h--> canonical frame
//   InputFrame + filtered color --exr_writer.h--> output file
//
// Values are scene-linear and alpha is taken as premultiplied, as EXR demands; a profile that says
// otherwise sets ConvertOptions::unpremultiplied.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/convert.h"
#include "chain/frame.h"
#include "chain/role.h"
#include "chain/status.h"
#include "config/profile.h"
#include "config/profile_match.h"
#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// Where each role's channels are in its file, in the order of the plane: R G B [A]; Z; x y
// (ProfileMatch::roles; with separate files, that of each role's own file).
using ChannelAssignment = std::map<Role, RoleChannels>;

// An EXR, or a picture of another format by its extension. `transfer`: what the values of a picture
// mean, where the file does not say. Errors (input): as ExrFile::open and PictureFile::open.
Result<std::shared_ptr<PixelFile>> open_pixels(const std::string& path,
                                               const ReadLimits& limits = {},
                                               std::optional<Transfer> transfer = {});

// The open files of one frame. With separate files each role has its own.
struct OpenFrame {
    int frame_number = 0;
    std::map<Role, std::shared_ptr<PixelFile>> files;  // color always

    // The file in which a role is to be looked for: its own, else color's.
    PixelFile& file_of(Role role) const;
    PixelFile& color_file() const { return *files.at(Role::color); }
};

// `files` as in FrameList::files, `transfer` as of open_pixels. Errors (input): as open_pixels;
// another plane than color in a picture that is no EXR.
Result<OpenFrame> open_frame(const std::map<Role, std::string>& files, int frame_number,
                             const ReadLimits& limits = {}, std::optional<Transfer> transfer = {});

// What a profile needs to know of a file. A deep part has no color that could be filtered: it
// comes without channels, whose names would only mislead.
FileChannels channels_of(const PixelFile& file);

// The planes' window where it is not the data window of color, and the conventions in which what no
// file has is stored: clear, infinitely far, still.
struct PlanesArea {
    Window window;
    ConvertOptions convention;
};

// A frame as read.
struct InputFrame {
    OpenFrame files;
    ChannelAssignment assignment;
    // Sizes, display window, number, planes and luma weights are filled; camera and facts are not.
    FrameDescription description;
    FramePlanes planes;  // of `window`, in the files' convention
    Window window;       // of the planes: color's data window where no other was asked for
    Window data_window;  // of the color part
    Window display_window;
    bool half_depth = false;           // depth came as half (warn: relative step 2^-11)
    std::shared_ptr<PartPixels> kept;  // color's part, every channel, for the writer
    // By part of color's file: what channels of depth and motion hold where there is nothing; other
    // channels hold 0.
    std::map<int, std::map<std::string, float>> outside;
};

// What a channel of this role and type holds where there is nothing: 0; in depth what is farthest
// (1e10 or, in half, Inf as a distance), in motion what stands for none.
float outside_value(Role role, const ConvertOptions& convention, PixelType type);

enum class Keep {
    all,      // every channel of color's part is read, for write_filtered()
    nothing,  // only what is wanted (plan, inspect, diff)
};

// Reads the wanted roles; color is always read. A role in a part or file with another data window
// is cropped to color's; one that does not cover it is an error. With `area` the planes are those
// of its window: color's data window and what is around it. Errors (input): a wanted role
// that is not assigned, check_channels(), damaged data, 3 or 4 color channels expected, 1 of
// depth, 2 of motion.
Result<InputFrame> read_frame(OpenFrame files, const ChannelAssignment& assignment, RoleSet wanted,
                              Keep keep, const std::optional<PlanesArea>& area = {});

// Luminance weights of R, G, B for primaries and white point (xy of red, green, blue, white):
// the Y row of the RGB-to-XYZ matrix (SMPTE RP 177). Rec. 709 when they are degenerate.
std::array<double, 3> luma_weights(const std::array<float, 8>& chromaticities);

}  // namespace postchain::io
