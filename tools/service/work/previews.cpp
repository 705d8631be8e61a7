#include "tools/service/work/previews.h"

#include <future>

#include "tools/service/work/gl_device.h"
#include "tools/service/work/preview.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxWaiting = 64;
constexpr auto kTestPatience = std::chrono::seconds(1);

// The device of this thread; made when it is first needed, and destroyed with the thread.
Result<GlDevice*> device_of_thread(const egl::ContextOptions& options, const PassRegistry& registry,
                                   bool anew = false) {
    thread_local std::unique_ptr<GlDevice> device;
    if (anew) device.reset();
    if (device) return device.get();
    ASSIGN_OR_RETURN(device, GlDevice::create(options, registry));
    return device.get();
}

}  // namespace

Previews::Previews(const egl::ContextOptions& device, const PassRegistry& registry,
                   DeviceGate& gate)
    : device_(device), registry_(registry), gate_(gate), threads_(1, kMaxWaiting) {}

Status Previews::begin() {
    RETURN_IF_ERROR(threads_.begin());
    std::promise<void> made;
    if (threads_.run([&] {
            (void)device_of_thread(device_, registry_);
            made.set_value();
        }))
        made.get_future().get();
    return Status();
}

bool Previews::run(JobRequest request, const Roots& roots, const PreviewWanted& wanted,
                   std::function<void(Answer<Picture>)> done) {
    auto ticket = std::make_shared<Ticket>();
    ticket->stop = wanted.left ? wanted.left : std::make_shared<std::atomic<bool>>(false);
    if (!wanted.session.empty()) {
        const std::lock_guard lock(mutex_);
        std::erase_if(newest_, [](const auto& one) { return one.second.expired(); });
        auto& newest = newest_[wanted.session];
        if (const auto former = newest.lock()) {
            former->replaced = true;
            *former->stop = true;
        }
        newest = ticket;
    }
    // std::function must be copyable; a chain is not.
    const auto shared = std::make_shared<JobRequest>(std::move(request));
    return threads_.run([this, shared, roots, type = wanted.type, ticket, done = std::move(done)] {
        Answer<Picture> answer = Problem{};
        try {
            answer = picture(*shared, roots, type, *ticket);
        } catch (...) {
            answer = problem_of(status_of_exception("the preview"), roots);
        }
        if (ticket->replaced)
            answer = Problem{Problem::Kind::conflict,
                             "a later preview of this session has replaced this one"};
        done(std::move(answer));
    });
}

Answer<Picture> Previews::picture(JobRequest& request, const Roots& roots, const std::string& type,
                                  const Ticket& ticket) {
    if (Status status = check_inputs(request.run.input, roots); !status.ok())
        return problem_of(status, roots);
    const auto color =
        request.plane == PreviewPlane::depth ? distances_of(request) : filter(request, ticket);
    if (!color.ok()) return problem_of(color.status(), roots);
    auto bytes = bytes_of(*color, type);
    if (!bytes.ok()) return problem_of(bytes.status(), roots);
    return Picture{type, std::move(*bytes)};
}

Result<ImageF> Previews::filter(JobRequest& request, const Ticket& ticket) {
    const auto over = [&] { return ends_ || *ticket.stop; };
    const Status canceled(StatusCode::canceled, "the preview was canceled");
    if (over()) return canceled;
    ASSIGN_OR_RETURN(auto device, device_of_thread(device_, registry_));
    // A software renderer takes the cores that reading needs.
    std::optional<DeviceGate::Hold> hold;
    if (device->software()) hold.emplace(gate_);
    ASSIGN_OR_RETURN(auto prepared, prepare_preview(request));
    if (over()) return canceled;
    if (!hold) hold.emplace(gate_);
    Executor& executor = device->executor();
    const ContinueScope stop(executor,
                             [&] { return over() ? RunDecision::stop : RunDecision::go_on; });
    auto planes = executor.filter(prepared.plan, prepared.planes);
    if (planes.ok()) return std::move(planes->at(Role::color));
    return planes.status();
}

std::optional<Status> Previews::test() {
    const auto promise = std::make_shared<std::promise<Status>>();
    auto tested = promise->get_future();
    // Without the gate, which clients without a token could then keep from the job.
    const bool taken = threads_.run([this, promise] {
        auto device = device_of_thread(device_, registry_);
        Status status = device.ok() ? (*device)->test() : device.status();
        // After a loss of the context a new one may work.
        if (!status.ok()) status = device_of_thread(device_, registry_, true).status();
        promise->set_value(status);
    });
    if (!taken || tested.wait_for(kTestPatience) != std::future_status::ready) return std::nullopt;
    return tested.get();
}

size_t Previews::end() {
    ends_ = true;
    return threads_.end();
}

}  // namespace postchain::service
