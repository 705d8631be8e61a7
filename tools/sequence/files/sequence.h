// Sequences: frame ranges, file name patterns, what is on disk, and the `IN` of the command.
//
//   "1-10,20-40x2"            --> FrameRange
//   "A.####.exr"              --> PathPattern
//   "color=A.exr,depth=B.exr" --> InputSpec (a PathPattern for each role)
//   InputSpec, FrameRange     --find_frames--> frames requested, frames missing
//
// Syntax: docs/command.md. The runner decides about a missing frame (error, skip, hold).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "chain/frame/role.h"

namespace postchain::io {

inline constexpr size_t kMaxFrames = 1'000'000;      // frames of one range
inline constexpr int kMaxFrameNumber = 999'999'999;  // and its negative

bool is_digit(char c);

// Frames in the order written, each once.
struct FrameRange {
    std::vector<int> frames;

    // Items separated by commas: N, A-B, A-BxSTEP; A, B and N may be negative, STEP >= 1.
    // Errors (usage): a colon (ambiguous), a descending range, more than max_frames frames, any
    // other non-number.
    static Result<FrameRange> parse(std::string_view text, size_t max_frames = kMaxFrames);
};

// "1-6,8,10-20x5", which FrameRange::parse() reads: short for the frames of a long job. `frames`
// ascend.
std::string range_text(std::span<const int> frames);

// "3/8": the third of eight parts of a list of frames. The parts are consecutive runs whose sizes
// differ by at most one. If there are more parts than frames, some are empty.
struct Chunk {
    int index = 1;  // 1..count
    int count = 1;

    // Errors (usage): anything but I/N with 1 <= I <= N <= kMaxFrames.
    static Result<Chunk> parse(std::string_view text);
    // Begin and end (exclusive) of this part in a list of `size` frames.
    std::pair<size_t, size_t> of(size_t size) const;
};

// A path whose file name may hold one frame token: "####" and "@@@@" (one digit each), "%04d",
// "%d", "$F", "$F4". Folder names have no tokens. Numbers are padded as by printf's %0Nd: -5 in
// "####" is "-005".
// The last group of digits before a file name's extension. A minus before it is its sign, unless a
// letter or digit comes before the minus: "a.-0002.exr" is frame -2, "a-0002.exr" is frame 2.
struct NumberPlace {
    size_t begin = 0;  // index of the sign, if there is one
    size_t digits = 0;
    size_t end = 0;  // digits == end: no number
    bool negative() const { return begin < digits; }
};
NumberPlace number_place(std::string_view file_name);

class PathPattern {
  public:
    // Errors (usage): empty, a path that ends in "/", two tokens, "%4d" (padded with blanks).
    static Result<PathPattern> parse(std::string_view path);

    bool has_token() const { return has_token_; }
    std::string format(int frame) const;  // the path itself if it has no token
    // A negative frame with all digits after its sign, "-0005" in "####", as some programs write.
    std::string format_wide(int frame) const;
    // Frame number of a file name (no folder) that matches; empty if it does not match or is a
    // temporary. Also reads "-0005" as -5, which some programs write.
    std::optional<int> match(std::string_view file_name) const;
    // Frame number of a path without a token: number_place(); 0 if there is none or it has more
    // than nine digits (a date).
    int literal_frame() const;
    // Frames on disk and their paths. Without a token: the file, if it exists.
    std::map<int, std::string> discover() const;

    const std::string& text() const { return text_; }
    const std::string& folder() const { return folder_; }  // "." when the path names none

  private:
    std::string path_of(const std::string& number) const;

    std::string text_;
    std::string folder_;
    std::string prefix_;  // parts of the file name before and after the token
    std::string suffix_;
    int digits_ = 0;
    bool has_token_ = false;
};

// IN: one pattern for all planes, or one per plane.
struct InputSpec {
    // Always has color; depth is under Role::inverse_depth. One entry = one file for all planes.
    std::map<Role, PathPattern> patterns;

    bool separate_files() const { return patterns.size() > 1; }
    const PathPattern& color() const { return patterns.at(Role::color); }

    // The word before "=": "color", "depth", "motion", "motion_back", "behind".
    static std::string word_of(Role role);
    // "A.####.exr", or "color=A.####.exr,depth=B.####.exr,motion=C.####.exr" (also motion_back;
    // behind: all planes of the layer behind).
    // Errors (usage): unknown or repeated plane, no color, a bad pattern.
    static Result<InputSpec> parse(std::string_view text);
};

struct FrameList {
    std::vector<int> frames;   // requested, in order
    std::vector<int> missing;  // requested frames without a file for some plane
    std::vector<int> gaps;     // not requested: numbers missing between the frames on disk
    std::map<int, std::map<Role, std::string>> files;  // for each frame that is not missing

    bool is_missing(int frame) const { return !files.contains(frame); }
    // Keeps only the frames, missing frames and gaps of one part.
    void keep(const Chunk& chunk);
};

// Why a pattern has no file on disk: "no such file", "the folder x cannot be read: ...".
std::string why_none(const PathPattern& pattern);

// Frames on disk and their paths, for each plane.
using FilesOnDisk = std::map<Role, std::map<int, std::string>>;
FilesOnDisk files_on_disk(const InputSpec& input);
// The files of one frame. A pattern without a token serves every frame, except for color.
std::map<Role, std::string> files_of(int frame, const InputSpec& input, const FilesOnDisk& on_disk);

// The requested frames, or without a range every frame of color on disk. A pattern without a token
// serves every frame. Errors (input): no range, and no frame found; two files of one frame.
Result<FrameList> find_frames(const InputSpec& input, const std::optional<FrameRange>& range);

}  // namespace postchain::io
