// A service over a folder of small frames.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "passes/registry.h"
#include "tests/command/frames.h"
#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/service/work/service.h"

namespace postchain::test {

// The value of an answer that must have one, or its problem. The other kind ends the test.
template <class T>
T got(service::Answer<T> answer) {
    if (const auto* problem = std::get_if<service::Problem>(&answer))
        throw std::runtime_error(problem->detail + text_of(problem->diagnostics));
    return std::get<T>(std::move(answer));
}
template <class T>
service::Problem problem_of(service::Answer<T> answer) {
    if (std::holds_alternative<T>(answer)) throw std::runtime_error("it was taken");
    return std::get<service::Problem>(std::move(answer));
}

// FOLDER/root/in.####.exr (frames 1..), FOLDER/root/out/, FOLDER/store.db, FOLDER/outside/.
class ServiceTest : public testing::Test {
  protected:
    void SetUp() override;

    std::string root(const std::string& name = "") const {
        return folder_.path("root" + (name.empty() ? "" : "/" + name));
    }
    std::string outside(const std::string& name = "") const {
        return folder_.path("outside" + (name.empty() ? "" : "/" + name));
    }
    // A run over all frames, with extra members: ", \"strict\": true".
    static std::string body(const std::string& more = "");
    void wait_for_done(const std::string& id, int count) const {
        EXPECT_TRUE(wait_for([&] { return job(id).done == count; })) << job(id).done;
    }

    void open() { service_ = must(service::Service::open(settings(), builtin_passes())); }
    void close() { service_.reset(); }
    service::ServiceSettings settings();

    // The user of this name, or the only one.
    const service::User& user(const std::string& name = "") const { return *users_->named(name); }
    // Users of a text of the file of users, with "token: TOKEN" in place of its hash.
    void use(const std::string& users);
    std::string submit(const std::string& body, const std::string& user = "");  // the id
    service::Problem refused(const std::string& body, const std::string& user = "");
    service::Job job(const std::string& id) const { return got(service_->job(id)); }
    std::vector<service::JobFrame> frames(const std::string& id) const {
        return got(service_->frames(id, 0, 1000));
    }
    service::Job ended(const std::string& id) const;  // waits
    // The end of a job of this body. done() fails the test if its state is another one.
    service::Job ran(const std::string& body) { return ended(submit(body)); }
    service::Job done(const std::string& id) const {
        const service::Job job = ended(id);
        EXPECT_EQ(job.state, service::JobState::done) << job.message;
        return job;
    }
    void retry(const std::string& id) { got(service_->retry(user(), id)); }
    // A body whose outputs go to this folder of the root, which is made.
    std::string in_folder(std::string body, const std::string& folder) const;
    void add_frames(int last) const {  // to the input: 7 to `last`
        for (int frame = 7; frame <= last; ++frame) write_sequence(root(), {frame}, 24, 16);
    }
    std::vector<service::Event> events(const std::string& id) const {
        return got(service_->events(id, 0, 1000));
    }
    std::string types_of(const std::string& id) const;  // of its events
    std::string logged();                               // the messages
    // The answer to a request for an image: ask(done) calls done() later.
    using Ask = std::function<void(std::function<void(service::Answer<service::Picture>)>)>;
    static service::Answer<service::Picture> answer_to(const Ask& ask);
    static service::Picture picture(const Ask& ask) { return got(answer_to(ask)); }
    static service::Problem no_picture(const Ask& ask) { return problem_of(answer_to(ask)); }
    Ask previewing(const std::string& body, const service::PictureWanted& wanted = {}) const;
    // Waits until it is true; false after two minutes.
    static bool wait_for(const std::function<bool()>& what);

    TempFolder folder_;
    int attempts_ = 2;
    double frame_timeout_s_ = 0;
    double slice_s_ = 60;
    std::chrono::milliseconds drain_ = std::chrono::seconds(20);
    std::shared_ptr<service::Users> users_ = std::make_shared<service::Users>();
    std::shared_ptr<service::TaskQueue> queue_;  // null = processes of this machine
    service::QueueSettings remote_;
    std::string program_, preview_program_, version_ = "test";
    std::mutex log_mutex_;
    std::vector<service::LogLine> log_;
    size_t max_queue_ = 100;
    uint64_t max_memory_ = 0;
    std::unique_ptr<service::Service> service_;
};

// How often a part occurs in a text.
inline int count_of(const std::string& text, const std::string& part) {
    int count = 0;
    for (size_t at = text.find(part); at != text.npos; at = text.find(part, at + part.size()))
        ++count;
    return count;
}

}  // namespace postchain::test
