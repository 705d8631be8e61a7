// A service for several people: turns, folders, limits, previews and the log.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <set>

#include "tests/command/frames.h"
#include "tests/service/support.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using test::ServiceTest;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kTwoUsers =
    "  ann: {token: aaaaaaaaaaaaaaaa}\n"
    "  bob: {token: bbbbbbbbbbbbbbbb, roots: [bob], max_priority: 5}\n"
    "  ops: {token: oooooooooooooooo, admin: true}\n";

class Team : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        fs::create_directories(root("bob/out"));
    }
    // A body with its files in the folder bob.
    static std::string of_bob(std::string body) {
        body.replace(body.find("in.####"), 0, "bob/");
        return body.replace(body.find("out/"), 0, "bob/");
    }
};

TEST_F(Team, JobsOfTwoUsersInterleave) {
    add_frames(16);
    use(kTwoUsers);
    slice_s_ = 0;
    hold();
    const std::string a = submit(held_body(), "ann");
    ASSERT_TRUE(waits());
    const std::string b = submit(in_folder(held_body(), "ops"), "ops");
    test::HeldPass::held = false;
    EXPECT_EQ(done(a).owner, "ann");
    done(b);
    const auto why_requeued = [&](const std::string& id) {
        std::set<std::string> reasons;
        for (const Event& event : events(id))
            if (event.type == "requeued") reasons.insert(event.data);
        return reasons;
    };
    // Neither has waited for the end of the other.
    for (const std::string& id : {a, b}) {
        EXPECT_THAT(why_requeued(id), testing::ElementsAre(R"({"why":"another job goes first"})"))
            << id;
        for (const JobFrame& frame : frames(id)) EXPECT_LE(frame.attempts, 1) << frame.frame;
    }
    test::HeldPass::held = true;
    test::HeldPass::waits = false;
    const std::string c = submit(in_folder(held_body(), "c"), "ann");
    ASSERT_TRUE(waits());
    const auto drained = std::async(std::launch::async, [&] { service_->drain(); });
    ASSERT_TRUE(wait_for([&] { return service_->health().draining; }));
    test::HeldPass::held = false;
    drained.wait();
    EXPECT_THAT(why_requeued(c), testing::ElementsAre(R"({"why":"stopped"})"));
}

// It would lose what it has measured.
TEST_F(Team, AMeasurementDoesNotMakeWayForAnotherUser) {
    use(kTwoUsers);
    slice_s_ = 0;
    hold();
    for (
        const std::string own :
        {R"("kind": "bench", "output": "bench", "split_frames": 0, "sweep": ["fxaa.preset=12,39"])",
         R"("kind": "ab", "output": "ab", "chain_b": {"postchain": 1, "passes": []}, "page_frames": 1)"}) {
        test::HeldPass::held = true;
        test::HeldPass::waits = false;
        const std::string measures = submit(
            "{" + own + R"(, "chain": {"postchain": 1, "passes": ["fxaa", "held"]}, "repeats": 2,
                              "input": "in.####.exr", "frames": "3-4"})",
            "ann");
        ASSERT_TRUE(waits());
        const std::string other =
            submit(in_folder(body(R"(, "frames": "1")"), own.substr(9, 2)), "ops");
        test::HeldPass::held = false;
        EXPECT_LE(done(measures).ended_ms, done(other).ended_ms);
        EXPECT_THAT(types_of(measures), Not(HasSubstr("requeued"))) << own;
    }
}

TEST_F(Team, FoldersAndRightsOfAUser) {
    use(kTwoUsers);
    test::write_sequence(root("bob"), {1, 2}, 24, 16);
    open();
    EXPECT_EQ(refused(body(), "bob").kind, Problem::Kind::forbidden);
    done(submit(of_bob(body()), "bob"));
    EXPECT_EQ(refused(body(R"(, "priority": 6)"), "bob").kind, Problem::Kind::forbidden);
    // Without max_priority, only an administrator goes before the others.
    EXPECT_EQ(refused(body(R"(, "priority": 1)"), "ann").kind, Problem::Kind::forbidden);
    EXPECT_EQ(job(submit(in_folder(body(R"(, "priority": 100)"), "first"), "ops")).priority, 100);
    const std::string of_ann = submit(body(R"(, "priority": -1)"), "ann");
    ended(of_ann);
    // Others may look, and not touch. An administrator may.
    EXPECT_EQ(job(of_ann).owner, "ann");
    const User& bob = user("bob");
    const auto forbids = [](auto answer) {
        return test::problem_of(std::move(answer)).kind == Problem::Kind::forbidden;
    };
    EXPECT_TRUE(forbids(service_->forget(bob, of_ann)));
    EXPECT_TRUE(forbids(service_->cancel(bob, of_ann)));
    EXPECT_TRUE(forbids(service_->retry(bob, of_ann)));
    EXPECT_TRUE(forbids(service_->change(bob, of_ann, R"({"priority": 1})")));
    EXPECT_TRUE(forbids(service_->browse(bob, "out")));
    EXPECT_TRUE(forbids(service_->output(bob, of_ann, 1)));
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->frame_image(bob, of_ann, 1, true, {}, done); },
             [&](auto done) { service_->input_image(bob, "out/o.####.exr", 1, {}, done); }})
        EXPECT_EQ(no_picture(ask).kind, Problem::Kind::forbidden);
    EXPECT_EQ(test::got(service_->output(user("ann"), of_ann, 2)).name, "o.0002.exr");
    test::got(service_->forget(user("ops"), of_ann));
    test::problem_of(service_->job(of_ann));
    EXPECT_TRUE(fs::exists(root("out/o.0001.exr"))) << "outputs stay";
}

TEST_F(Team, JobsOfARemovedUserDoNotRun) {
    use(kTwoUsers);
    hold();
    const std::string id = submit(held_body(), "ann");
    ASSERT_TRUE(waits());
    wait_for_done(id, 2);
    test::got(service_->cancel(user("ann"), id));
    test::HeldPass::held = false;
    EXPECT_NE(test::got(service_->frame(id, 1)).sidecar, "");
    close();
    use("  ops: {token: oooooooooooooooo, admin: true}\n");
    open();
    EXPECT_EQ(test::got(service_->frame(id, 1)).sidecar, "");
    test::got(service_->retry(user("ops"), id));
    EXPECT_EQ(ended(id).state, JobState::failed);
    EXPECT_THAT(ended(id).message, HasSubstr("user 'ann' is no longer in the file of users"));
    EXPECT_FALSE(fs::exists(root("out/o.0006.exr")));
}

// The process reads nothing outside the service's folders. A link within them may still leave the
// user's.
TEST_F(Team, FilesThatLinkToOtherFoldersOfTheServiceAreNotRead) {
    use(kTwoUsers);
    test::write_sequence(root("bob"), {1, 2, 3, 4, 5, 6}, 24, 16);
    hold();
    const std::string id = submit(of_bob(held_body()), "bob");
    ASSERT_TRUE(waits());
    fs::remove(root("bob/in.0006.exr"));
    fs::create_symlink(root("in.0006.exr"), root("bob/in.0006.exr"));
    test::HeldPass::held = false;
    EXPECT_EQ(ended(id).state, JobState::failed);
    EXPECT_THAT(frames(id)[5].message, HasSubstr("links outside"));
    EXPECT_FALSE(fs::exists(root("bob/out/o.0006.exr")));
    const std::string next = submit(of_bob(body(R"(, "on_existing": "overwrite")")), "bob");
    EXPECT_THAT(ended(next).message, HasSubstr("links outside")) << "at the beginning of a job";
    const std::string sidecar = root("bob/out/o.0001.exr.json");
    EXPECT_NE(test::got(service_->frame(id, 1)).sidecar, "");
    fs::rename(sidecar, root("out/other.json"));
    fs::create_symlink(root("out/other.json"), sidecar);
    EXPECT_EQ(test::got(service_->frame(id, 1)).sidecar, "");
}

TEST_F(Team, TheNewestPreviewOfASessionWins) {
    hold();
    const auto asked = [&](const std::string& session,
                           const std::shared_ptr<std::atomic<bool>>& left = nullptr) {
        auto promise = std::make_shared<std::promise<Answer<Picture>>>();
        service_->preview(user(),
                          R"({"chain": {"postchain": 1, "passes": ["held"]},
                              "input": "in.####.exr", "frame": 3})",
                          {"image/png", session, "", left},
                          [promise](Answer<Picture> got) { promise->set_value(std::move(got)); });
        return promise->get_future();
    };
    auto first = asked("a");
    ASSERT_TRUE(waits());
    auto second = asked("a"), other = asked("b"), third = asked("a");
    auto gone = asked("", std::make_shared<std::atomic<bool>>(true));
    test::HeldPass::held = false;
    for (auto* replaced : {&first, &second})
        EXPECT_EQ(test::problem_of(replaced->get()).kind, Problem::Kind::conflict);
    test::got(other.get());
    test::got(third.get());
    test::problem_of(gone.get());
}

TEST_F(Team, TheLogHasALineForEachStartAndEnd) {
    use(kTwoUsers);
    std::ofstream(root("in.0003.exr"), std::ios::binary) << "no EXR";
    open();
    ended(submit(body(), "ann"));
    ASSERT_TRUE(wait_for([&] { return logged().find("of 6 frames") != std::string::npos; }));
    const std::string text = logged();
    for (const char* part : {"job 1 of ann queued: run, priority 0\n", "job 1 of ann started: run",
                             "job 1 of ann: frame 3 failed, attempt 1: in.0003.exr",
                             "job 1 of ann: frame 3 quarantined", "after its start: 5 of 6 frames"})
        EXPECT_THAT(text, HasSubstr(part)) << part;
    EXPECT_THAT(text, Not(HasSubstr("aaaaaaaa"))) << "a token";
    const std::lock_guard lock(log_mutex_);
    for (const auto& [key, value] : {std::pair{"event", "failed"}, {"user", "ann"}, {"job", "1"}})
        EXPECT_EQ(log_.back().fields[key], value);
    EXPECT_TRUE(log_.back().fields["seconds"].is_number());
    const std::string metrics = service_->metrics();
    for (const char* part : {"postchain_jobs_ended_total{kind=\"run\",state=\"failed\"} 1\n",
                             "postchain_queue_oldest_seconds 0\n"})
        EXPECT_THAT(metrics, HasSubstr(part)) << part;
}

// The outputs of a removed job count until they are deleted.
TEST_F(Team, DiskOfRemovedJobs) {
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"1000\"}\n");
    open();
    const std::string first = body(R"(, "frames": "1")");
    const std::string id = submit(first, "ann");
    EXPECT_GT(done(id).bytes, 1000);
    got(service_->forget(user("ann"), id));
    const std::string again = body(R"(, "frames": "1", "on_existing": "overwrite")");
    EXPECT_THAT(refused(again, "ann").detail, HasSubstr("removed jobs included"));
    EXPECT_THAT(service_->metrics(), HasSubstr("postchain_user_bytes{user=\"ann\"}"));
    for (const auto& file : fs::directory_iterator(root("out"))) fs::remove(file.path());
    done(submit(again, "ann"));
}

TEST_F(Team, ALimitOfTheDiskEndsRunningAndWaitingJobs) {
    add_frames(40);
    use("  ann: {token: aaaaaaaaaaaaaaaa, max_disk: \"1000\"}\n  bob: {token: bbbbbbbbbbbbbbbb}\n");
    hold();
    const std::string of_bob = submit(in_folder(held_body(R"(, "frames": "3")"), "bob"), "bob");
    ASSERT_TRUE(waits());
    const std::string runs = submit(body(), "ann");
    const std::string waiting = submit(in_folder(body(), "w"), "ann");
    test::HeldPass::held = false;
    done(of_bob);
    const Job full = ended(runs), other = ended(waiting);
    EXPECT_EQ(full.state, JobState::failed);
    EXPECT_THAT(full.message, HasSubstr("max_disk: the jobs of ann have written"));
    EXPECT_THAT(full.message, HasSubstr("the limit is 1000"));
    EXPECT_THAT(full.message, HasSubstr("then retry the job"));
    EXPECT_GT(full.done, 0);
    EXPECT_LT(full.done, 20) << "the frames in flight";
    EXPECT_EQ(other.state, JobState::failed);
    EXPECT_EQ(other.done, 0);
    EXPECT_THAT(other.message, HasSubstr("max_disk"));
    // Outputs of a removed job that are deleted make room.
    got(service_->forget(user("ann"), runs));
    fs::remove_all(root("out"));
    got(service_->retry(user("ann"), waiting));
    EXPECT_GT(ended(waiting).done, 0);
}

}  // namespace
}  // namespace postchain::service
