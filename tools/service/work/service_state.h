// The state of a Service. Functions that throw a Problem run in answer().
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "chain/text.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/backend.h"
#include "tools/service/work/counters.h"
#include "tools/service/work/device_gate.h"
#include "tools/service/work/disk_check.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/job_log.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/previews.h"
#include "tools/service/work/readers.h"
#include "tools/service/work/service.h"

namespace postchain::service {

inline constexpr size_t kMaxThumbnails = 256;  // waiting

template <class Work>
auto answer(const Work& work) -> Answer<std::invoke_result_t<Work>> {
    try {
        return work();
    } catch (const Problem& refused) {
        return refused;
    }
}

template <class T>
T stored(Result<T> found) {
    if (!found.ok())
        throw Problem{Problem::Kind::unavailable, found.status().message(), {}, kRetryAfterS};
    return std::move(*found);
}

template <class T>
T taken(Answer<T> got) {
    if (const auto* refused = std::get_if<Problem>(&got)) throw *refused;
    return std::get<T>(std::move(got));
}

struct Service::State {
    State(const ServiceSettings& s, const PassRegistry& r, const egl::ContextOptions& device,
          std::vector<std::string> folders)
        : settings(s),
          registry(r),
          reader(settings.roots, registry, settings.version, settings.threads),
          readers(reader, *settings.users),
          counters(settings.version),
          thumbnails(1, kMaxThumbnails),
          previews(device, registry, gate),
          disks(std::move(folders)) {}

    const ServiceSettings settings;
    const PassRegistry& registry;
    const JobReader reader;
    const Readers readers;
    Counters counters;
    std::unique_ptr<JobStore> store;
    std::unique_ptr<JobLog> log;
    HelperThreads thumbnails;
    DeviceGate gate;
    Previews previews;
    DiskCheck disks;
    std::unique_ptr<Backend> backend;
    std::atomic<bool> draining = false;
    std::mutex listener_mutex;
    std::function<void(const Event&)> listener;

    // A job of the store with the remaining time of the running job, or its place in the queue.
    Job shown(Job job, const QueuePlaces& places) const;
    Job shown(Job job) const;

    void hear(const Event& event);

    // The following throw a Problem.
    Job known(const std::string& id) const;
    JobFrame known(const std::string& id, int frame) const;
    JobReader reader_of(const User& user) const;

    // Sends an image of a file from another thread. `find` returns the file for a reader.
    using FindFrame = std::function<Answer<ShownFrame>(const JobReader&)>;
    void show(const User& user, const ImageWanted& wanted,
              const std::function<void(Answer<Picture>)>& done, const FindFrame& find);

    // Changes a job that the user may change with `work`, which returns false if its state does not
    // allow it.
    Job change(const User& user, const std::string& id, const std::string& why_not,
               const std::function<bool(const Job&)>& work);
};

}  // namespace postchain::service
