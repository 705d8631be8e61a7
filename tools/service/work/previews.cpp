#include "tools/service/work/previews.h"

#include <future>

#include "tools/service/work/preview_process.h"

namespace postchain::service {
namespace {

constexpr size_t kMaxWaiting = 64;
constexpr auto kTestPatience = std::chrono::seconds(1);

Problem too_many_previews() {
    return {Problem::Kind::busy, "too many previews are waiting; try again", {}, 1};
}

}  // namespace

Previews::Previews(const ServiceSettings& settings, uint64_t memory)
    : process_(std::make_unique<PreviewProcess>(settings, memory, ends_)),
      threads_(1, kMaxWaiting) {}

Previews::~Previews() {
    end();
}

Status Previews::begin() {
    RETURN_IF_ERROR(threads_.begin());
    std::promise<void> made;
    if (threads_.run([&] {
            (void)process_->test();
            made.set_value();
        }))
        made.get_future().get();
    return Status();
}

void Previews::run(const std::string& body, JobRequest request, const Roots& roots,
                   const PreviewWanted& wanted, std::function<void(Answer<Picture>)> done) {
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
    const auto work = [this, body, request = std::move(request), roots, type = wanted.type, ticket,
                       done] {
        const auto over = [&] { return ends_ || *ticket->stop; };
        auto made = [&]() -> Answer<std::string> {
            try {
                if (over()) return Problem{Problem::Kind::unavailable, "the preview was canceled"};
                return process_->preview(body, request, roots, type, over);
            } catch (...) {
                return problem_of(status_of_exception("the preview"), roots);
            }
        }();
        if (ticket->replaced)
            done(Problem{Problem::Kind::conflict,
                         "a later preview of this session has replaced this one"});
        else if (auto* problem = std::get_if<Problem>(&made))
            done(std::move(*problem));
        else
            done(Picture{type, std::get<std::string>(std::move(made))});
    };
    if (!threads_.run(work, {wanted.share, [done] { done(too_many_previews()); }}))
        throw too_many_previews();
}

std::optional<Result<std::string>> Previews::test() {
    const auto promise = std::make_shared<std::promise<Result<std::string>>>();
    auto tested = promise->get_future();
    const bool taken = threads_.run([this, promise] { promise->set_value(process_->test()); });
    if (!taken || tested.wait_for(kTestPatience) != std::future_status::ready) return std::nullopt;
    return tested.get();
}

size_t Previews::end() {
    ends_ = true;
    return threads_.end();
}

}  // namespace postchain::service
