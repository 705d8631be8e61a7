// Reads the frames of a sequence, each with the neighbor planes that are needed.
//
//   n --open--> FrameToRead   headers of n and of the frames before and after; what is missing, why
//   FrameToRead --read--> SourceFrame   pixels of all three, by role
//
// Keeps the last three frames, so that in numeric order each file is opened, decoded and converted
// once. Planes are shared, never copied. Neighbors depend on what is on disk, not on which frames
// are requested: a part of a sequence gives the same result as the whole. Rules: docs/command.md,
// "Frames before and after".
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Files by frame, for frames with a file for each plane.
using FramesOnDisk = std::map<int, std::map<Role, std::string>>;

struct FrameToRead {
    std::shared_ptr<const FrameHeader> frame;
    // Neighbors with wanted planes: the frame, or why there is none.
    std::map<Neighbor, std::shared_ptr<const FrameHeader>> neighbors;
    std::map<Neighbor, std::string> missing;
    std::shared_ptr<const FrameHeader> behind;  // the layer behind, if it is read
    std::vector<std::string> warnings;

    // Stamps of all files.
    std::vector<io::FileStamp> stamps() const;
};

// Planes to read of a frame of which `wanted` are needed. Planes wanted of a neighbor are also read
// of the frame itself, because it is its neighbors' neighbor.
RoleSet planes_to_read(const FrameHeader& header, RoleSet wanted);

// The files that make a frame a neighbor: all but the layer behind.
io::InputSpec input_of_neighbors(io::InputSpec input);

class SequenceReader {
  public:
    // Planes wanted of a frame and of its neighbors, from its header.
    using PlanesOf = std::function<RoleSet(const FrameHeader&)>;
    using IsWhole = std::function<bool(int number)>;

    // `whole`: frames that are written back; their files are read with every channel. Empty = none.
    SequenceReader(const SourceSettings& settings, io::InputSpec input, PlanesOf planes_of,
                   IsWhole whole = {});
    ~SequenceReader();

    // Called with each file before it is opened. An error is the file's.
    using TryFile = std::function<Status(const std::string& path, int number)>;
    void try_files(TryFile try_file) { try_file_ = std::move(try_file); }

    // Sets the frames on disk, with the files of input_of_neighbors(). Otherwise they are listed
    // when the first frame with a neighbor is opened.
    void see(std::shared_ptr<const FramesOnDisk> on_disk) { on_disk_ = std::move(on_disk); }
    // Neighbors whose planes or camera the frame would read if they existed; none if its own files
    // cannot be read.
    std::set<Neighbor> reads_with(int number, const std::map<Role, std::string>& files);

    // Errors (input): the frame's own. A neighbor's error becomes a reason and a warning.
    Result<FrameToRead> open(int number, const std::map<Role, std::string>& files);
    // Reads the frame last opened, always with color. Errors: those of open().
    Result<SourceFrame> read(const FrameToRead& opened);

    size_t decoded() const { return decoded_; }  // number of frames so far

  private:
    struct Entry;
    Status tried(const std::string& path, int number) const {
        return try_file_ ? try_file_(path, number) : Status();
    }
    static std::shared_ptr<const FrameHeader> header_in(const std::shared_ptr<Entry>& entry);
    Result<std::shared_ptr<Entry>> enter(int number, const std::map<Role, std::string>& files);
    void find_neighbor(Neighbor neighbor, FrameToRead& opened);
    std::string absence(int number, Neighbor neighbor);
    Status decode(Entry& entry);
    void compare_slow_motion(SourceFrame& frame);

    SourceSettings settings_;
    io::InputSpec input_;
    PlanesOf planes_of_;
    IsWhole whole_;
    TryFile try_file_;
    std::map<int, std::shared_ptr<Entry>> window_;  // by number
    std::shared_ptr<const FramesOnDisk> on_disk_;
    size_t decoded_ = 0;
    bool compared_slow_motion_ = false;
};

}  // namespace postchain::sequence
