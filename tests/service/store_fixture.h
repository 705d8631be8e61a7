// A store in a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {

inline User user_of(const std::string& name) {
    User user;
    user.name = name;
    return user;
}

class StoreTest : public testing::Test {
  protected:
    static constexpr const char* kWrites = "out/a.####.exr";

    void SetUp() override { open(); }
    void open(int attempts = 3, const Retention& keep = Retention()) {
        store_.reset();
        store_ = test::must(JobStore::open(path(), attempts, keep));
    }
    // Closes the store. Runs statements of another program in its file.
    void run_sql(const std::string& sql) {
        store_.reset();
        sqlite3* other = nullptr;
        ASSERT_EQ(sqlite3_open(path().c_str(), &other), SQLITE_OK);
        EXPECT_EQ(sqlite3_exec(other, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
        sqlite3_close(other);
    }
    // Puts a file of another program or version in its place.
    void replace(const std::string& sql) {
        store_.reset();
        std::filesystem::remove(path());
        run_sql(sql);
    }
    std::string path() const { return folder_.path("store.db"); }
    std::string refusal() const {
        const auto opened = JobStore::open(path(), 3);
        return opened.ok() ? "opened" : opened.status().message();
    }
    Added try_add(const User& user = User(), int frames = 0, size_t max_queue = 100) {
        return test::must(
            store_->add({JobKind::run, "{}", 0, "", frames, "", "{}", kWrites}, max_queue, user));
    }
    std::string add(int priority = 0, const User& user = User(), const std::string& body = "{}") {
        return test::must(
                   store_->add({JobKind::run, body, priority, "", 0, "", "{}", kWrites}, 100, user))
            .job.id;
    }
    // A job that has ended; `frames` as its request says.
    std::string add_ended(int frames = 0) {
        const std::string id = try_add(User(), frames).job.id;
        EXPECT_TRUE(*store_->cancel(id));
        return id;
    }
    // A running job with the waiting frames 1..count.
    std::string running(int count, const User& user = User()) {
        const std::string id = add(0, user);
        EXPECT_TRUE(*store_->start(id));
        std::vector<JobFrame> frames;
        for (int frame = 1; frame <= count; ++frame) {
            frames.emplace_back();
            frames.back().frame = frame;
            frames.back().output = "o";
        }
        EXPECT_TRUE(store_->enter_frames(id, frames).ok());
        return id;
    }
    void begin(const std::string& id, int frame) {
        ASSERT_TRUE(store_->frame_begins(id, frame).ok());
    }
    void write(const std::string& id, int frame, int64_t bytes = 5) {
        ASSERT_TRUE(
            store_->frame_ends(id, {frame, FrameState::written, "note", false, 1.5, bytes}).ok());
    }
    void end(const std::string& id, JobState state) {
        Job ended = job(id);
        ended.state = state;
        ASSERT_TRUE(store_->end(ended).ok());
    }
    std::vector<Event> events(const std::string& id) { return *store_->events(id, 0, 100); }
    std::vector<FrameToDo> to_do(const std::string& id) { return *store_->to_do(id); }
    std::vector<std::string> types(const std::string& id) {
        std::vector<std::string> types;
        for (const Event& event : events(id)) types.push_back(event.type);
        return types;
    }
    // Each with its data.
    std::vector<std::string> told(const std::string& id) {
        std::vector<std::string> told;
        for (const Event& event : events(id)) told.push_back(event.type + " " + event.data);
        return told;
    }
    size_t job_count() { return store_->jobs("", "", 1000)->size(); }
    JobFrame frame(const std::string& id, int number) { return **store_->frame(id, number); }
    Job job(const std::string& id) { return **store_->job(id); }

    test::TempFolder folder_;
    std::unique_ptr<JobStore> store_;
};

}  // namespace postchain::service
