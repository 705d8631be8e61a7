// Images of files that clients name, decoded in a process of their own: a decoder that a file
// crashes, or that takes too much memory or time, costs that request alone.
//
// The process (helper_process.h) is the service's own program, started with kImageHelper. It has
// limits of memory and time, and reads only the folders of the user.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "chain/pass/pass.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/job_files.h"

namespace postchain::service {

inline constexpr const char* kImageHelper = "image-helper";

// image_of() by `program`, with memory of `gate`. Errors: those of image_of(); (input): the process
// died, or took too long; (canceled): the client has left; (internal): it cannot be started.
Result<std::string> image_by_helper(const std::string& program, const ShownFrame& shown,
                                    const Roots& roots, const ImageWanted& wanted,
                                    sequence::MemoryGate& gate);

// The main function of such a process: a task on stdin, an image on stdout.
int run_image_helper(const PassRegistry& registry);

}  // namespace postchain::service
