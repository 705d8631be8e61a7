// The store: states of jobs and frames, and crashes (simulated by closing it during work).
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/service/store_fixture.h"
#include "tools/service/store/upkeep.h"

namespace postchain::service {
namespace {

using testing::HasSubstr;

TEST_F(StoreTest, WhatWasEnteredIsThereAgain) {
    open();
    const std::string id = running(3);
    ASSERT_TRUE(store_->frame_begins(id, 2).ok());
    ASSERT_TRUE(store_->frame_ends(id, {2, FrameState::written, "note", false, 1.5, 70}).ok());
    open();
    EXPECT_EQ(job(id).state, JobState::queued);
    EXPECT_EQ(job(id).frames, 3);
    EXPECT_EQ(job(id).done, 1);
    EXPECT_EQ(frame(id, 2).state, FrameState::written);
    EXPECT_EQ(job(id).bytes, 70);
    EXPECT_EQ(frame(id, 2).filter_ms, 1.5);
    EXPECT_EQ(frame(id, 2).message, "note");
    ASSERT_EQ(store_->to_do(id)->size(), 2u);
    EXPECT_EQ((*store_->to_do(id))[1].frame, 3);
    EXPECT_TRUE(*store_->has_begun(id));
}

TEST_F(StoreTest, EndedTwiceCountsOnce) {
    open();
    const std::string id = running(2);
    for (int i = 0; i < 2; ++i)
        ASSERT_TRUE(store_->frame_ends(id, {1, FrameState::written, "", false, 0, 0}).ok());
    EXPECT_EQ(job(id).done, 1);
    EXPECT_EQ(std::ranges::count(types(id), "frame"), 1);
}

// Any of several frames may have killed the process: the attempt counts for none of them.
TEST_F(StoreTest, FramesInFlightTogetherGoOnAloneAndKeepTheirAttempts) {
    open();
    const std::string id = running(4);
    for (int frame : {1, 2, 3}) ASSERT_TRUE(store_->frame_begins(id, frame).ok());
    open();
    for (const FrameToDo& frame : to_do(id)) {
        EXPECT_EQ(frame.alone, frame.frame <= 3) << frame.frame;
        EXPECT_EQ(frame.begun, frame.frame <= 3) << frame.frame;
        EXPECT_EQ(frame.attempts, 0) << frame.frame;
    }
}

TEST_F(StoreTest, AFrameThatKillsTheProcessAloneIsQuarantined) {
    open();
    const std::string id = running(2);
    for (int death = 1; death <= 3; ++death) {
        if (death > 1) {
            ASSERT_GT(*store_->start(id), 0);
        }
        ASSERT_TRUE(store_->frame_begins(id, 1).ok());
        EXPECT_EQ(frame(id, 1).state, FrameState::waiting);
        open();
        EXPECT_EQ(frame(id, 1).attempts, death);
    }
    EXPECT_EQ(frame(id, 1).state, FrameState::quarantined);
    EXPECT_EQ(job(id).state, JobState::queued) << "the other frame is still to be done";
    EXPECT_EQ(job(id).failed, 1);
    EXPECT_EQ(store_->events(id, 0, 100)->back().type, "requeued");
}

TEST_F(StoreTest, AJobThatKillsTheProcessBeforeItsFirstFrameFails) {
    open();
    const std::string id = add();
    for (int death = 1; death <= 3; ++death) {
        ASSERT_EQ(*store_->start(id), death);
        open();
        EXPECT_EQ(job(id).state, death < 3 ? JobState::queued : JobState::failed);
    }
    EXPECT_THAT(job(id).message, HasSubstr("3 times"));
}

// Its tasks go on without this process, so that no death is its fault.
TEST_F(StoreTest, AJobInAnotherQueueOutlivesTheProcess) {
    open();
    const std::string id = add();
    ASSERT_EQ(*store_->start(id), 1);
    ASSERT_TRUE(store_->set_remote(id, "17").ok());
    for (int death = 1; death <= 4; ++death) {
        open();
        ASSERT_EQ(job(id).state, JobState::queued) << death;
        ASSERT_GT(*store_->start(id), 0);
    }
    EXPECT_EQ(*store_->remote(id), "17");
}

TEST_F(StoreTest, WhatWasGivenUpWaitsAsBefore) {
    open();
    const std::string id = running(2);
    ASSERT_TRUE(store_->frame_begins(id, 1).ok());
    EXPECT_EQ(frame(id, 1).attempts, 1);
    ASSERT_TRUE(store_->release(id).ok());
    EXPECT_EQ(frame(id, 1).attempts, 0);
    ASSERT_TRUE(store_->requeue(id, "stopped", false).ok());
    open();
    EXPECT_FALSE((*store_->to_do(id))[0].alone);
}

TEST_F(StoreTest, FailuresCountUntilTheFrameIsQuarantined) {
    open(2);
    const std::string id = running(1);
    for (int attempt = 1; attempt <= 2; ++attempt) {
        ASSERT_TRUE(store_->frame_begins(id, 1).ok());
        ASSERT_TRUE(store_->frame_fails(id, 1, "why").ok());
        EXPECT_EQ(frame(id, 1).state, attempt < 2 ? FrameState::waiting : FrameState::quarantined);
    }
    EXPECT_EQ(frame(id, 1).message, "why");
    Job end = job(id);
    end.state = JobState::failed;
    ASSERT_TRUE(store_->end(end).ok());
    ASSERT_TRUE(store_->retry(id)->done);
    EXPECT_EQ(frame(id, 1).state, FrameState::waiting);
    EXPECT_EQ(frame(id, 1).attempts, 0);
    EXPECT_EQ(job(id).failed, 0);
    EXPECT_EQ(job(id).ended_ms, 0);
}

TEST_F(StoreTest, ThePriorityThenTheOrderOfArrival) {
    open();
    const std::string low = add(-5), first = add(0), second = add(0), high = add(7);
    for (const std::string& id : {high, first, second, low}) {
        const auto next = store_->next(-100);
        ASSERT_TRUE(*next);
        EXPECT_EQ((*next)->id, id);
        ASSERT_GT(*store_->start(id), 0);
    }
    EXPECT_FALSE(*store_->next(-100));
    EXPECT_FALSE(*store_->next(-100));
    const std::string other = add(1);
    EXPECT_FALSE(*store_->next(2));
    EXPECT_EQ((*store_->next(1))->id, other);
}

TEST_F(StoreTest, OneKeyIsOneJob) {
    open();
    const auto first = store_->add({JobKind::run, "{}", 0, "key"}, 100);
    const auto same = store_->add({JobKind::run, "{}", 0, "key"}, 100);
    const auto other = store_->add({JobKind::run, "{ }", 0, "key"}, 100);
    EXPECT_EQ(first->what, Added::What::made);
    EXPECT_EQ(same->what, Added::What::same);
    EXPECT_EQ(same->job.id, first->job.id);
    EXPECT_EQ(other->what, Added::What::other_body);
    EXPECT_EQ(store_->add({JobKind::run, "{}", 0, ""}, 1)->what, Added::What::full);
    EXPECT_EQ(store_->jobs("", "", 10)->size(), 1u);
}

TEST_F(StoreTest, CanceledWorkDoesNotEndOtherwise) {
    open();
    const std::string id = running(1);
    ASSERT_TRUE(*store_->cancel(id));
    EXPECT_FALSE(*store_->cancel(id));
    Job end = job(id);
    end.state = JobState::done;
    ASSERT_TRUE(store_->end(end).ok());
    ASSERT_TRUE(store_->requeue(id, "", false).ok());
    EXPECT_EQ(job(id).state, JobState::canceled);
    EXPECT_EQ(*store_->start(id), 0);
}

TEST_F(StoreTest, EventsGrowOverRestartsAndAreReadOnFromAnyOfThem) {
    open();
    const std::string a = add(), b = add();
    const int64_t last = store_->events("", 0, 100)->back().id;
    open();
    ASSERT_TRUE(*store_->cancel(a));
    const auto later = store_->events("", last, 100);
    ASSERT_EQ(later->size(), 1u);
    EXPECT_GT((*later)[0].id, last);
    EXPECT_EQ((*later)[0].type, "canceled");
    EXPECT_EQ((*later)[0].job, a);
    EXPECT_EQ(store_->events(b, 0, 100)->size(), 1u);
    EXPECT_EQ(store_->events("", 0, 1)->size(), 1u);
}

TEST_F(StoreTest, JobsAreReadOnFromAnyOfThem) {
    open();
    std::vector<std::string> ids;
    for (int i = 0; i < 5; ++i) ids.push_back(add());
    const auto newest = store_->jobs("", "", 2);
    ASSERT_EQ(newest->size(), 2u);
    EXPECT_EQ((*newest)[0].id, ids[4]);
    EXPECT_EQ((*store_->jobs("", ids[3], 2))[0].id, ids[2]);
    EXPECT_TRUE(store_->jobs("done", "", 9)->empty());
    EXPECT_EQ(store_->jobs("queued", "", 9)->size(), 5u);
    for (const char* no_id : {"0", "-1", "x", "1 OR 1=1", "99999999999999999999", "01"})
        EXPECT_FALSE(*store_->job(no_id)) << no_id;
}

TEST_F(StoreTest, TheOldestEndedJobsGo) {
    open();
    std::vector<std::string> ids;
    for (int i = 0; i < 5; ++i) ids.push_back(add_ended());
    const std::string waiting = add();
    store_.reset();
    run_sql("UPDATE jobs SET ended_ms = ended_ms - 3 * 86400000 WHERE id <= 2");
    open(Retention{.jobs = 1000, .days = 2});
    EXPECT_EQ(job_count(), 4u);
    EXPECT_TRUE(*store_->job(ids[2]));
    open(Retention{.jobs = 2, .days = 0});
    EXPECT_EQ(job_count(), 3u);
    EXPECT_FALSE(*store_->job(ids[2]));
    EXPECT_TRUE(events(ids[2]).empty());
    EXPECT_TRUE(*store_->job(waiting));
}

// The newest job stays, however many frames it has.
TEST_F(StoreTest, EndedJobsOfManyFramesGo) {
    open();
    for (const int frames : {10, kMaxEndedFrames, 5}) add_ended(frames);
    open();
    EXPECT_EQ(job_count(), 1u);
    EXPECT_TRUE(*store_->job("3"));
    add_ended(kMaxEndedFrames - 5);
    open();
    EXPECT_EQ(job_count(), 2u) << "as many as are allowed";
    add_ended(kMaxEndedFrames + 1);
    open();
    EXPECT_EQ(job_count(), 1u);
    EXPECT_TRUE(*store_->job("5"));
}

TEST_F(StoreTest, OldEventsOfEndedJobsGo) {
    open();
    const std::string ended = add_ended(), waiting = add();
    store_.reset();
    run_sql(
        concat("UPDATE sqlite_sequence SET seq = seq + ", kMaxEvents, " WHERE name = 'events'"));
    open();
    const std::string later = add_ended();
    open();
    EXPECT_TRUE(events(ended).empty());
    EXPECT_TRUE(*store_->job(ended));
    EXPECT_EQ(types(waiting), std::vector<std::string>{"queued"});
    EXPECT_EQ(events(later).size(), 2u);
}

TEST_F(StoreTest, OwnersOfOnePriorityTakeTurns) {
    open();
    User ann, bob;
    ann.name = "ann";
    bob.name = "bob";
    for (int i = 0; i < 3; ++i) add(0, ann);
    for (int i = 0; i < 2; ++i) add(0, bob);
    const std::string urgent = add(1, ann);
    std::string order;
    for (int i = 0; i < 6; ++i) {
        const Job next = **store_->next(-kMaxPriority);
        order += next.id == urgent ? "!" : next.owner.substr(0, 1);
        ASSERT_GT(*store_->start(next.id), 0);
        ASSERT_TRUE(*store_->cancel(next.id));
    }
    EXPECT_EQ(order, "!babaa");
    EXPECT_EQ(store_->jobs("", "", 100, "bob")->size(), 2u);
}

TEST_F(StoreTest, LimitsOfAUser) {
    open();
    User ann;
    ann.name = "ann";
    ann.max_jobs = 2;
    const auto add_of = [&](int frames) {
        return *store_->add({JobKind::run, "{}", 0, "", frames}, 100, ann);
    };
    const std::string first = add_of(5).job.id;
    EXPECT_EQ(add_of(5).what, Added::What::made);
    EXPECT_EQ(add_of(5).what, Added::What::over_limit);
    EXPECT_THAT(add_of(5).why, HasSubstr("ann may have 2 unfinished jobs"));
    add();  // of another user
    ann.max_jobs = 0;
    ann.max_frames = 12;
    EXPECT_EQ(add_of(2).what, Added::What::made);
    EXPECT_THAT(add_of(1).why,
                HasSubstr("may have 12 frames in unfinished jobs, and would have 13"));
    ASSERT_TRUE(*store_->cancel(first));
    EXPECT_EQ(add_of(1).what, Added::What::made);
    const auto again = store_->retry(first, ann);
    EXPECT_FALSE(again->done);
    EXPECT_THAT(again->why, HasSubstr("and would have 13"));
    EXPECT_EQ(job(first).state, JobState::canceled);
    ann.max_frames = 0;
    ann.max_bytes = 100;
    ann.max_disk = "100";
    const std::string writes = add_of(1).job.id;
    ASSERT_GT(*store_->start(writes), 0);
    JobFrame frame;
    frame.frame = 1;
    ASSERT_TRUE(store_->enter_frames(writes, {frame}).ok());
    ASSERT_TRUE(store_->frame_ends(writes, {1, FrameState::written, "", false, 1, 100}).ok());
    EXPECT_THAT(add_of(1).why, HasSubstr("have written 100 bytes"));
    Job end = job(writes);
    end.state = JobState::done;
    ASSERT_TRUE(store_->end(end).ok());
    ASSERT_TRUE(*store_->forget(writes));
    EXPECT_EQ(add_of(1).what, Added::What::made);
}

TEST_F(StoreTest, ARetryWaitsInTheQueueLikeAnyJob) {
    open();
    const std::string id = add();
    ASSERT_TRUE(*store_->cancel(id, 143));
    EXPECT_EQ(job(id).exit_code, 143);
    add();
    const auto full = store_->retry(id, User(), 1);
    EXPECT_FALSE(full->done);
    EXPECT_EQ(full->why, "1 jobs are waiting; try again later");
    EXPECT_EQ(job(id).state, JobState::canceled);
    EXPECT_TRUE(store_->retry(id, User(), 2)->done);
    EXPECT_EQ(job(id).exit_code, 0);
}

// A job that has not begun has no frames in the store, only their number from its request.
TEST_F(StoreTest, FramesOfAJobThatHasNotBegunCountAfterARetryAndARestart) {
    open();
    User ann;
    ann.name = "ann";
    ann.max_frames = 5;
    const auto add_of = [&](int frames) {
        return *store_->add({JobKind::run, "{}", 0, "", frames}, 100, ann);
    };
    const std::string id = add_of(5).job.id;
    ASSERT_TRUE(*store_->cancel(id));
    ASSERT_TRUE(store_->retry(id, ann)->done);
    EXPECT_EQ(job(id).frames, 5);
    EXPECT_EQ(add_of(1).what, Added::What::over_limit);
    ASSERT_EQ(*store_->start(id), 1);
    open();
    EXPECT_EQ(job(id).frames, 5);
}

TEST_F(StoreTest, PrioritiesChangeAndEndedJobsAreRemoved) {
    open();
    const std::string a = add(), b = add();
    ASSERT_TRUE(*store_->set_priority(b, 7));
    EXPECT_EQ((**store_->next(-kMaxPriority)).id, b);
    EXPECT_EQ(events(b).back().type, "priority");
    EXPECT_FALSE(*store_->forget(a)) << "it waits";
    ASSERT_TRUE(*store_->cancel(a));
    EXPECT_FALSE(*store_->set_priority(a, 1));
    ASSERT_TRUE(*store_->forget(a));
    EXPECT_FALSE(*store_->job(a));
    EXPECT_TRUE(events(a).empty());
    EXPECT_FALSE(*store_->forget(a));
    // In another queue its tasks would never be canceled.
    ASSERT_TRUE(store_->set_remote(b, "17").ok());
    ASSERT_TRUE(*store_->cancel(b));
    EXPECT_FALSE(*store_->forget(b));
    ASSERT_TRUE(store_->set_remote(b, "").ok());
    EXPECT_TRUE(*store_->forget(b));
}

}  // namespace
}  // namespace postchain::service
