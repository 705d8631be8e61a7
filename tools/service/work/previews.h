// Previews: one reduced frame through a chain, on a thread with a GL context of its own, so that a
// preview does not wait for the frame of the running job. It holds the gate, at which the job
// waits. And reduced images of files.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "chain/egl/context.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/device_gate.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// Bytes of a gate while this object exists.
class MemoryPlace {
  public:
    MemoryPlace(sequence::MemoryGate& gate, uint64_t bytes) : gate_(gate), bytes_(bytes) {
        gate_.enter(bytes_);
    }
    ~MemoryPlace() { gate_.leave(bytes_); }
    MemoryPlace(const MemoryPlace&) = delete;
    MemoryPlace& operator=(const MemoryPlace&) = delete;

  private:
    sequence::MemoryGate& gate_;
    const uint64_t bytes_;
};

// The color of a file, reduced. `enter` gets the bytes of its frame before they are allocated, and
// returns when there is room. Errors: (input), (output); (memory): over settings.max_memory.
Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageWanted& wanted,
                             const std::function<void(uint64_t bytes)>& enter);

Problem too_many_previews();

class Previews {
  public:
    Previews(const egl::ContextOptions& device, const PassRegistry& registry, DeviceGate& gate);

    // Creates the device, before the worker does: contexts share the threads of a software
    // renderer, and these have the priority of the thread that is first. If this fails, previews
    // fail. Errors (internal): no thread.
    Status begin();
    // False if too many wait. `done` is called once. A later preview of the same session ends this
    // one, as do `wanted.left` and end().
    bool run(JobRequest request, const Roots& roots, const PreviewWanted& wanted,
             std::function<void(Answer<Picture>)> done);
    size_t hanging() const { return threads_.hanging(); }
    bool alive() const { return threads_.alive(); }
    // Runs a test dispatch; nothing if the thread is busy for longer than a second.
    std::optional<Status> test();
    size_t end();  // HelperThreads::end()

  private:
    struct Ticket {
        std::shared_ptr<std::atomic<bool>> stop;
        std::atomic<bool> replaced = false;
    };
    Answer<Picture> picture(JobRequest& request, const Roots& roots, const std::string& type,
                            const Ticket& ticket);
    Result<ImageF> filter(JobRequest& request, const Ticket& ticket);

    const egl::ContextOptions device_;
    const PassRegistry& registry_;
    DeviceGate& gate_;
    std::mutex mutex_;
    std::map<std::string, std::weak_ptr<Ticket>> newest_;  // by session
    std::atomic<bool> ends_ = false;
    HelperThreads threads_;
};

}  // namespace postchain::service
