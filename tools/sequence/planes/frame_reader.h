// Opens the files of one frame and reads its planes in the files' own convention.
//
//   files --open_frame--> FrameFiles (headers; the profile resolves roles on them)
//   FrameFiles + FrameChannels --read_frame--> StoredFrame --convert.h--> canonical frame
//   FrameFiles + StoredFrame + filtered color --frame_writer.h--> output file
//
// Values are scene-linear and alpha is premultiplied, as EXR demands; profiles of other files set
// ConvertOptions::unpremultiplied.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "chain/base/status.h"
#include "chain/frame/convert.h"
#include "chain/frame/frame.h"
#include "chain/frame/role.h"
#include "config/profile.h"
#include "config/profile_match.h"
#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// Each role's channels in its file, in the order of the plane: R G B [A]; Z; x y
// (ProfileMatch::roles; with separate files, of each role's own file).
using FrameChannels = std::map<Role, RoleChannels>;

// Opens an EXR, or another format by its extension. `transfer`: see ImageFile::open. Errors
// (input): those of ExrFile::open and ImageFile::open.
Result<std::shared_ptr<PixelFile>> open_pixels(const std::string& path,
                                               const ReadLimits& limits = {},
                                               std::optional<Transfer> transfer = {});

// The open files of one frame. With separate files each role has its own.
struct FrameFiles {
    int frame_number = 0;
    std::map<Role, std::shared_ptr<PixelFile>> files;  // always has color
    // By the names that were given; taken before the first file was opened.
    std::map<Role, FileStamp> stamps;

    // The file of a role: its own, otherwise color's.
    PixelFile& file_of(Role role) const;
    PixelFile& color_file() const { return *files.at(Role::color); }
};

// `files` as in FrameList::files, `transfer` as in open_pixels. Errors (input): those of
// open_pixels; a plane other than color in a file that is not an EXR.
Result<FrameFiles> open_frame(const std::map<Role, std::string>& files, int frame_number,
                              const ReadLimits& limits = {}, std::optional<Transfer> transfer = {});

// The names that profiles match. Channels of deep parts are left out if a flat part has color; for
// the layer behind (Flattening::behind) those of flat parts are, if a deep part has color.
FileChannels channels_of(const PixelFile& file);

// A window for planes that differs from color's data window, and the convention for pixels outside
// the file: clear, infinitely far, still.
struct PlanesArea {
    Window window;
    ConvertOptions convention;
};

// The pixels of a frame as its files store them.
struct StoredFrame {
    FramePlanes planes;                // planes of `window`, in the files' convention
    Window window;                     // window of the planes; default: color's data window
    bool half_depth = false;           // depth came as half (warn: relative step 2^-11)
    std::shared_ptr<PartPixels> kept;  // color's part, every channel, for the writer
    // By part of color's file: the value of depth and motion channels for empty pixels; other
    // channels have 0.
    std::map<int, std::map<std::string, float>> outside;
};

// The value of a channel of this role and type for empty pixels: 0; the farthest depth (as a
// distance 1e10, or Inf in half); the value for no motion.
float outside_value(Role role, const ConvertOptions& convention, PixelType type);

enum class Keep {
    all,      // every channel of color's part is read, for write_filtered()
    nothing,  // only the wanted channels (plan, inspect, diff)
};

// Reads color and the wanted roles. A role with another data window is cropped to color's; it is an
// error if it does not cover color's. With `area` the planes cover its window, which contains
// color's data window. Errors (input): a wanted role that is not assigned, check_channels(),
// damaged data, a wrong number of channels (3 or 4 of color, 1 of depth, 2 of motion).
Result<StoredFrame> read_frame(const FrameFiles& files, const FrameChannels& channels,
                               RoleSet wanted, Keep keep,
                               const std::optional<PlanesArea>& area = {});

// Luminance weights of R, G, B for primaries and white point (xy of red, green, blue, white):
// the Y row of the RGB-to-XYZ matrix (SMPTE RP 177). Rec. 709 if there are none, or degenerate
// ones.
std::array<double, 3> luma_weights(const std::optional<std::array<float, 8>>& chromaticities);

}  // namespace postchain::io
