// The frames of a sequence, each with the planes of its neighbors where they are wanted.
//
//   n --open--> FrameInputs   headers of n and of the frames before and after; what is missing, why
//   FrameInputs --read--> SourceFrame   pixels of all three, by role
//
// The last three frames are kept, so that in the order of the numbers each file is opened, decoded
// and converted once. Planes are shared, never copied. Which frames are neighbors follows from
// what is on disk and not from which frames are asked for: a part of a sequence gives what the
// whole gives. The rules: docs/command.md, "Frames before and after".
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// A frame of which no pixel has been read.
struct OpenedFrame {
    int number = 0;
    std::map<Role, std::string> files;  // as in io::FrameList::files
    std::vector<io::FileStamp> stamps;  // of the files, before the first was opened
    FrameHeader header;
    RoleSet planes;  // to read: its own, and those of its neighbors
};

// Frames with their files, those that have one for each plane.
using FramesOnDisk = std::map<int, std::map<Role, std::string>>;

struct FrameInputs {
    std::shared_ptr<const OpenedFrame> frame;
    // Those of which planes are wanted: the frame, or why there is none.
    std::map<Neighbor, std::shared_ptr<const OpenedFrame>> neighbors;
    std::map<Neighbor, std::string> missing;
    std::vector<std::string> warnings;
};

class SequenceReader {
  public:
    // The planes to read of a frame and of its neighbors, from its header alone. Those that it
    // names of a neighbor are also read of the frame itself: it is its neighbors' neighbor.
    using PlanesOf = std::function<RoleSet(const FrameHeader&)>;
    using IsWhole = std::function<bool(int number)>;

    // `whole`: frames that are written back; their files are read with every channel. None: no
    // frame is.
    SequenceReader(const SourceSettings& settings, io::InputSpec input, PlanesOf planes_of,
                   IsWhole whole = {});
    ~SequenceReader();

    // From now on these are the frames on disk; without it they are those that the first frame
    // finds which has a neighbor.
    void see(std::shared_ptr<const FramesOnDisk> on_disk) { on_disk_ = std::move(on_disk); }
    // Of which neighbors a frame reads planes or the camera, were they there; none where its own
    // files cannot be read.
    std::set<Neighbor> reads_with(int number, const std::map<Role, std::string>& files);

    // Errors (input): the frame's own. A neighbor's are a reason and a warning.
    Result<FrameInputs> open(int number, const std::map<Role, std::string>& files);
    // The frame last opened. Color is always read. Errors: as of open().
    Result<SourceFrame> read(const FrameInputs& inputs);

    size_t decoded() const { return decoded_; }  // frames, so far

  private:
    struct Entry;
    Result<std::shared_ptr<Entry>> enter(int number, const std::map<Role, std::string>& files);
    void find_neighbor(Neighbor neighbor, FrameInputs& inputs);
    RoleSet planes_to_read(const FrameHeader& header) const;
    std::string absence(int number, Neighbor neighbor);
    Status decode(Entry& entry);

    SourceSettings settings_;
    io::InputSpec input_;
    PlanesOf planes_of_;
    IsWhole whole_;
    std::map<int, std::shared_ptr<Entry>> window_;  // by number
    std::shared_ptr<const FramesOnDisk> on_disk_;
    size_t decoded_ = 0;
};

}  // namespace postchain::sequence
