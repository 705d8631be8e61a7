#include "tools/apps/view/filter_worker.h"

#include <chrono>

#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/reduced_frame.h"
#include "tools/sequence/source/reduced_lengths.h"

namespace postchain::view {
namespace {

// The first plane of an array.
ImageF first_layer(const ImageF& pixels, const PlanTexture& texture) {
    if (texture.slices < 2) return pixels;
    ImageF first(texture.width, texture.height, pixels.channels);
    std::copy_n(pixels.data.begin(), first.data.size(), first.data.begin());
    return first;
}

}  // namespace

FilterWorker::FilterWorker(const PlanOptions& plan, std::function<void()> wake)
    : plan_(plan), wake_(std::move(wake)) {}

Result<std::unique_ptr<FilterWorker>> FilterWorker::start(const egl::ContextOptions& context,
                                                          const PlanOptions& plan,
                                                          std::function<void()> wake) {
    std::unique_ptr<FilterWorker> worker(new FilterWorker(plan, std::move(wake)));
    Status started;
    worker->thread_ =
        std::thread([&, self = worker.get(), options = context] { self->work(options, &started); });
    std::unique_lock lock(worker->mutex_);
    worker->changed_.wait(lock, [&] { return worker->started_; });
    lock.unlock();
    if (!started.ok()) return started;
    return worker;
}

FilterWorker::~FilterWorker() {
    {
        const std::lock_guard lock(mutex_);
        end_ = true;
        stop_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void FilterWorker::submit(FilterRequest request) {
    {
        const std::lock_guard lock(mutex_);
        next_ = std::move(request);
        if (running_ && may_stop_) stop_ = true;
    }
    changed_.notify_all();
}

bool FilterWorker::idle() const {
    const std::lock_guard lock(mutex_);
    return !next_ && !running_;
}

std::vector<FilterResult> FilterWorker::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(results_, {});
}

void FilterWorker::work(const egl::ContextOptions& given, Status* started) {
    // llvmpipe's threads, which this one starts, inherit it.
    give_way();
    egl::ContextOptions options = given;
    options.log = [this, log = given.log](const std::string& text) {
        const std::lock_guard lock(mutex_);
        messages_.push_back(text);
        if (log) log(text);
    };
    auto context = egl::Context::create(options);
    std::unique_lock lock(mutex_);
    *started = context.status();
    if (context.ok()) {
        renderer_ = sequence::renderer_text((*context)->device());
        executor_ = std::make_unique<Executor>((*context)->device());
        executor_->set_timing(true, true);
        plan_.device = executor_->device_class();
    }
    started_ = true;
    changed_.notify_all();
    while (context.ok()) {
        changed_.wait(lock, [&] { return end_ || next_; });
        if (end_) break;
        FilterRequest request = std::move(*next_);
        next_.reset();
        running_ = true;
        may_stop_ = request.may_stop;
        stop_ = false;
        lock.unlock();
        FilterResult result = filter(std::move(request));
        lock.lock();
        running_ = false;
        if (result.status.code() == StatusCode::canceled) continue;
        result.messages = std::exchange(messages_, {});
        results_.push_back(std::move(result));
        lock.unlock();
        wake_();
        lock.lock();
    }
    lock.unlock();
    reduced_from_ = reduced_ = nullptr;
    executor_.reset();
}

SharedFrame FilterWorker::reduced(const FilterRequest& request) {
    if (request.scale >= 1) return request.source;
    if (reduced_from_ != request.source || reduced_by_ != request.scale) {
        auto smaller = std::make_shared<sequence::SourceFrame>(*request.source);
        sequence::reduce_frame(*smaller, request.scale);
        reduced_ = smaller;
        reduced_from_ = request.source;
        reduced_by_ = request.scale;
    }
    return reduced_;
}

FilterResult FilterWorker::filter(FilterRequest request) {
    const auto start = std::chrono::steady_clock::now();
    FilterResult result;
    result.request = std::move(request);
    const StopScope stops(*executor_, &stop_);
    try {
        result.status = filter_into(result);
    } catch (...) {
        result.status = status_of_exception("filter");
    }
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    result.milliseconds = taken.count();
    return result;
}

Status FilterWorker::filter_into(FilterResult& result) {
    const FilterRequest& request = result.request;
    const SharedFrame source = reduced(request);
    Chain smaller;
    if (request.scale < 1) {
        smaller = request.chain->clone();
        sequence::reduce_lengths(smaller, request.scale);
    }
    const Chain& chain = request.scale < 1 ? smaller : *request.chain;
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, *source, plan_));
    result.resolved = sequence::resolve_values(chain, *source, plan);
    StageObserver observer;
    if (!request.texture.empty() && request.texture != kFillMask)
        observer = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
            if (texture.name == request.texture)
                result.texture = std::make_shared<const ImageF>(first_layer(pixels, texture));
            return Status();
        };
    const FrameDescription planned = plan.description;
    result.plan = std::make_shared<const Plan>(std::move(plan));
    ASSIGN_OR_RETURN(auto planes, executor_->filter(*result.plan, source->planes, observer));
    result.color = std::make_shared<const ImageF>(std::move(planes.at(Role::color)));
    result.times = executor_->pass_times();
    result.work_done = executor_->work_done();
    if (request.texture == kFillMask)
        RETURN_IF_ERROR(read_fill_mask(chain, *source, planned, result));
    result.counters = executor_->counters();
    return Status();
}

Status FilterWorker::read_fill_mask(const Chain& chain, const sequence::SourceFrame& source,
                                    const FrameDescription& planned, FilterResult& result) {
    const FrameDescription frame = sequence::with_fill_mask(planned);
    PlanOptions options = plan_;
    options.outputs.add(Role::layers);
    ASSIGN_OR_RETURN(auto plan, make_plan(chain, frame, options));
    ASSIGN_OR_RETURN(auto planes, executor_->filter(plan, sequence::planes_with_fill_mask(
                                                              source.planes, source.description)));
    result.texture = std::make_shared<const ImageF>(
        sequence::take_fill_mask(planes.at(Role::layers), frame.height));
    return Status();
}

}  // namespace postchain::view
