// Previews by a process of their own: a frame that crashes its decoder, or a driver that crashes,
// costs the preview, and the running job is not blamed for it.
//
// The process (helper_process.h) is the service's own program, started with kPreviewHelper. It
// keeps its GL context from one preview to the next, and is started again after it has died.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "chain/pass/pass.h"
#include "tools/service/work/helper_process.h"
#include "tools/service/work/previews.h"

namespace postchain::service {

inline constexpr const char* kPreviewHelper = "preview-helper";
inline constexpr const char* kProgramHelper = "program-helper";

// Used by one thread.
class PreviewHelper {
  public:
    // `ends`: set when the service ends; then the process is killed, whatever it does.
    PreviewHelper(const ServiceSettings& settings, uint64_t memory, const std::atomic<bool>& ends);

    // PreviewMaker::preview() of the request with this body. Errors: as there; (input): the process
    // died; (internal): it cannot be started.
    Result<std::string> preview(const std::string& body, const JobRequest& request,
                                const Roots& roots, const std::string& type,
                                const PreviewCalls& calls);
    // PreviewMaker::test(). Errors (gl), (internal).
    Status test();
    // Starts the process of run_program_helper(), and waits for one that has ended.
    void keep_programs();

  private:
    Result<std::string> exchange(const std::string& task, const PreviewCalls& calls,
                                 const std::string& file);

    const std::string program_;
    const std::string settings_;  // the first line for the process
    const std::atomic<bool>& ends_;
    HelperProcess process_, programs_;
    bool keeps_programs_ = false;  // programs_ was started
};

// The main function of such a process: tasks on stdin, previews on stdout.
int run_preview_helper(const PassRegistry& registry);
// The process that ends by itself: once in a store it makes a preview of a generated frame, so that
// the programs of the page's first chain are kept for the processes for previews. It reads no file
// of a client, and has the lowest priority.
int run_program_helper(const PassRegistry& registry);

}  // namespace postchain::service
