// Previews: one reduced frame through a chain, with a GL context of their own, so that a preview
// does not wait for the frame of the running job. It holds the gate, at which the job waits. And
// reduced images of files.
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
#include "tools/service/work/gl_device.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

class PreviewHelper;

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

// The color of a file, reduced. `enter` gets the bytes of its frame and of the reply before they
// are allocated, and returns when there is room. Errors: (input), (output); (memory): over
// settings.max_memory.
Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageWanted& wanted,
                             const std::function<void(uint64_t bytes)>& enter);

// Calls of a preview while it is made.
struct PreviewCalls {
    std::function<bool()> over;      // whether its client has left or it has been replaced
    std::function<void()> reserved;  // returns when the device has been reserved for it
};

// Makes previews, on one thread: its context is current there.
class PreviewMaker {
  public:
    PreviewMaker(const egl::ContextOptions& device, const PassRegistry& registry)
        : device_(device), registry_(registry) {}

    // Errors: those of reading, of planning and of the device; (canceled): it was over.
    Result<std::string> preview(JobRequest& request, const Roots& roots, const std::string& type,
                                const PreviewCalls& calls);
    // Makes the device if there is none, otherwise runs a test dispatch; after a fault of it a new
    // device. Errors (gl).
    Status test();
    void release() { made_.reset(); }
    bool software() const { return made_ && made_->software(); }

  private:
    Result<ImageF> filter(JobRequest& request, const PreviewCalls& calls);
    Result<GlDevice*> device();

    const egl::ContextOptions device_;
    const PassRegistry& registry_;
    std::unique_ptr<GlDevice> made_;
};

Problem too_many_previews();

class Previews {
  public:
    // With settings.program in a process of their own (preview_helper.h). `memory`: bytes of a
    // frame.
    Previews(const ServiceSettings& settings, uint64_t memory, const egl::ContextOptions& device,
             const PassRegistry& registry, DeviceGate& gate);
    ~Previews();

    // Creates the device, before the worker does: contexts share the threads of a software
    // renderer, and these have the priority of the thread that is first. If this fails, previews
    // fail. Errors (internal): no thread.
    Status begin();
    // False if too many wait. `done` is called once. `request` has been read from `body`. A later
    // preview of the same session ends this one, as do `wanted.left` and end().
    bool run(const std::string& body, JobRequest request, const Roots& roots,
             const PreviewWanted& wanted, std::function<void(Answer<Picture>)> done);
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

    DeviceGate& gate_;
    std::atomic<bool> ends_ = false;
    // One of them, used by the thread alone.
    std::unique_ptr<PreviewMaker> maker_;
    std::unique_ptr<PreviewHelper> helper_;
    std::mutex mutex_;
    std::map<std::string, std::weak_ptr<Ticket>> newest_;  // by session
    HelperThreads threads_;
};

}  // namespace postchain::service
