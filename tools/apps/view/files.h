// Files that the viewer opens: lists of folders, and what a file is.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::view {

enum class FileKind { chain, frames, camera, truth };
const char* name_of(FileKind kind);  // "chain", ...

// The files to open; an empty one leaves what is open.
struct OpenRequest {
    std::string chain, input, camera, truth;
    void set(FileKind kind, const std::string& path);
    bool empty() const { return chain.empty() && input.empty() && camera.empty() && truth.empty(); }
};

// The sequence of which a frame's file is one, "shot.####.exr"; the path itself if its name has no
// number, or no other file has the pattern.
std::string pattern_of(const std::string& path);

// The request for files that are dropped on the window: chains (.yaml, .yml), a camera (.json),
// frames (images, folders with one sequence). Errors (usage): other files.
Result<OpenRequest> request_for(const std::vector<std::string>& paths);

struct FileRow {
    std::string name;  // a folder's ends in "/"; a sequence's is its pattern
    int frames = 0;    // of a sequence
    bool is_folder() const { return name.ends_with("/"); }
};
// Folders first, then the files of the kind, by name; without hidden ones. Errors (input): the
// folder cannot be read.
Result<std::vector<FileRow>> list_folder(const std::string& folder, FileKind kind);

}  // namespace postchain::view
