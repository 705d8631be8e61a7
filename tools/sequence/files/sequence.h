// Sequences: frame ranges, file name patterns, what is on disk, and the `IN` of the command.
//
//   "1-10,20-40x2"            --> FrameRange
//   "A.####.exr"              --> PathPattern
//   "color=A.exr,depth=B.exr" --> InputSpec (a PathPattern for each role)
//   InputSpec, FrameRange     --find_frames--> frames requested, frames missing
//
// Syntax: docs/command.md. What to do with a missing frame (error, skip, hold) is the runner's.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/role.h"
#include "chain/status.h"

namespace postchain::io {

inline constexpr size_t kMaxFrames = 1'000'000;      // of one range
inline constexpr int kMaxFrameNumber = 999'999'999;  // and its negative

// Frames in the order written, each once.
struct FrameRange {
    std::vector<int> frames;

    // Items separated by commas: N, A-B, A-BxSTEP; A, B and N may be negative, STEP >= 1.
    // Errors (usage): a colon (it means two things), a descending range, more than max_frames
    // frames, anything else that is not a number.
    static Result<FrameRange> parse(std::string_view text, size_t max_frames = kMaxFrames);
};

// "3/8": the third of eight parts of a list of frames. The parts are runs of neighboring frames,
// their sizes differ by at most one, and together they are the list; where there are more parts
// than frames, some are empty.
struct Chunk {
    int index = 1;  // 1..count
    int count = 1;

    // Errors (usage): anything else than I/N with 1 <= I <= N <= kMaxFrames.
    static Result<Chunk> parse(std::string_view text);
    // Of `size` frames: the first that belongs to this part, and the one after the last.
    std::pair<size_t, size_t> of(size_t size) const;
};

// A path whose file name may hold one frame token: "####" and "@@@@" (one digit each), "%04d",
// "%d", "$F", "$F4". Folders are taken as they are. Numbers are padded as printf's %0Nd does:
// -5 in "####" is "-005".
class PathPattern {
  public:
    // Errors (usage): empty, a path that ends in "/", two tokens, "%4d" (padded with blanks).
    static Result<PathPattern> parse(std::string_view path);

    bool has_token() const { return has_token_; }
    std::string format(int frame) const;  // the path itself when there is no token
    // Frame of a file name (no folder) that this pattern could have made. Also takes "-0005" for
    // -5, as some programs write it. Nothing for names that differ, and for temporaries.
    std::optional<int> match(std::string_view file_name) const;
    // Number of a path without a token: the last group of digits before the extension, else 0
    // (also for more than nine digits, which is a date and not a frame).
    int literal_frame() const;
    // Frames on disk and their paths. Without a token: the file, if it exists.
    std::map<int, std::string> discover() const;

    const std::string& text() const { return text_; }
    const std::string& folder() const { return folder_; }  // "." when the path names none

  private:
    std::string text_;
    std::string folder_;
    std::string prefix_;  // of the file name, before and after the token
    std::string suffix_;
    int digits_ = 0;
    bool has_token_ = false;
};

// IN: one pattern that holds every plane, or one per plane.
struct InputSpec {
    // color is always there; depth is under Role::inverse_depth. One entry = one file.
    std::map<Role, PathPattern> patterns;

    bool separate_files() const { return patterns.size() > 1; }
    const PathPattern& color() const { return patterns.at(Role::color); }

    // What stands before "=" in the text: "color", "depth", "motion", "motion_back".
    static std::string word_of(Role role);
    // "A.####.exr", or "color=A.####.exr,depth=B.####.exr,motion=C.####.exr" (also motion_back).
    // Errors (usage): unknown or repeated plane, no color, a bad pattern.
    static Result<InputSpec> parse(std::string_view text);
};

struct FrameList {
    std::vector<int> frames;   // requested, in order
    std::vector<int> missing;  // those for which some plane's file is not on disk
    std::vector<int> gaps;     // not requested: numbers missing on disk between those found
    std::map<int, std::map<Role, std::string>> files;  // of each frame that is not missing

    bool is_missing(int frame) const { return !files.contains(frame); }
    // Leaves the frames of one part, with what is missing among them and the gaps between them.
    void keep(const Chunk& chunk);
};

// Why a pattern has no file on disk: "no such file", "the folder x cannot be read: ...".
std::string why_none(const PathPattern& pattern);

// Frames on disk and their paths, for each plane.
using FilesOnDisk = std::map<Role, std::map<int, std::string>>;
FilesOnDisk files_on_disk(const InputSpec& input);
// Those of one frame; a plane whose pattern has no token serves every frame, color never does.
std::map<Role, std::string> files_of(int frame, const InputSpec& input, const FilesOnDisk& on_disk);

// The frames asked for, or without a range every frame of color on disk. A plane whose pattern
// has no token serves every frame. Errors (input): nothing found and nothing asked for.
Result<FrameList> find_frames(const InputSpec& input, const std::optional<FrameRange>& range);

}  // namespace postchain::io
