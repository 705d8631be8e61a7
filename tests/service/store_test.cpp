// The store: states of jobs and frames, and crashes (simulated by closing it during work).
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <set>
#include <tuple>
#include <utility>

#include "tests/service/store_fixture.h"
#include "tools/service/http/job_json.h"

namespace postchain::service {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(StoreTest, WhatWasEnteredIsThereAgainAndCountsOnce) {
    const std::string id = running(3);
    begin(id, 2);
    for (int i = 0; i < 2; ++i) write(id, 2, 70);
    EXPECT_EQ(std::ranges::count(types(id), "frame"), 1);
    open();
    EXPECT_EQ(job(id).state, JobState::queued);
    EXPECT_EQ(job(id).frames, 3);
    EXPECT_EQ(job(id).done, 1);
    EXPECT_EQ(job(id).bytes, 70);
    EXPECT_EQ(frame(id, 2).state, FrameState::written);
    EXPECT_EQ(frame(id, 2).filter_ms, 1.5);
    EXPECT_EQ(frame(id, 2).message, "note");
    ASSERT_EQ(to_do(id).size(), 2u);
    EXPECT_EQ(to_do(id)[1].frame, 3);
    EXPECT_TRUE(job(id).begun);
}

// Each field of a job and of a frame has a value of its own: one that is lost, or taken from
// another column, shows.
TEST_F(StoreTest, EveryFieldIsThereAgain) {
    const NewJob made{JobKind::ab, R"({"input": "i"})", 7,  "key", 0,
                      "to",        R"({"chain": "c"})", "w"};
    const std::string id = test::must(store_->add(made, 100, user_of("ann"))).job.id;
    ASSERT_TRUE(*store_->start(id));
    std::vector<JobFrame> entered(6);
    for (int i = 0; i < 6; ++i) {
        entered[size_t(i)].frame = 20 + i;
        entered[size_t(i)].output = concat("o", i);
    }
    ASSERT_TRUE(store_->enter_frames(id, entered).ok());
    begin(id, 21);
    for (const auto& end :
         {FrameEnd{20, FrameState::written, "note", false, 1.5, 70},
          FrameEnd{21, FrameState::skipped, "", false, 0, 0}, FrameEnd{22, FrameState::written},
          FrameEnd{23, FrameState::missing, "is not there", false, 2.5, 0}})
        ASSERT_TRUE(store_->frame_ends(id, end).ok());
    begin(id, 24);
    ASSERT_TRUE(store_->frame_fails(id, 24, "a fault").ok());
    Job ended = job(id);
    std::tie(ended.state, ended.message, ended.exit_code, ended.verdict) =
        std::tuple(JobState::failed, "why", 4, "B is closer");
    ASSERT_TRUE(store_->end(ended).ok());
    open();
    const Job again = job(id);
    const auto json_of_jobs = [](const Job& job, std::vector<Field<Job>> fields) {
        std::erase_if(fields, [](const auto& field) {
            return std::set<std::string>{"created", "started", "ended"}.contains(field.name);
        });
        return json_of(job, fields);
    };
    io::Json expected = {{"id", id},
                         {"kind", "ab"},
                         {"state", "failed"},
                         {"owner", "ann"},
                         {"priority", 7},
                         {"message", "why"},
                         {"frames", 6},
                         {"done", 3},
                         {"failed", 1},
                         {"bytes", 70},
                         {"place", 0},
                         {"remaining_s", 0.0},
                         {"exit_code", 4},
                         {"verdict", "B is closer"},
                         {"about", {{"chain", "c"}}}};
    for (const Job& listed : {**store_->listed(id), (*store_->jobs("", "", 9))[0]})
        EXPECT_EQ(json_of_jobs(listed, listed_job_fields()), expected);
    expected["request"] = {{"input", "i"}};
    for (const Job& whole : {again, **store_->job_of_key("key")})
        EXPECT_EQ(json_of_jobs(whole, job_fields()), expected);
    EXPECT_GT(again.created_ms, 0);
    EXPECT_LE(again.created_ms, again.started_ms);
    EXPECT_LE(again.started_ms, again.ended_ms);
    const std::vector<std::tuple<FrameState, int, std::string, double>> states = {
        {FrameState::written, 0, "note", 1.5},  {FrameState::skipped, 1, "", 0},
        {FrameState::written, 0, "", 0},        {FrameState::missing, 0, "is not there", 2.5},
        {FrameState::waiting, 1, "a fault", 0}, {FrameState::waiting, 0, "", 0}};
    const std::vector<JobFrame> frames = *store_->frames(id);
    ASSERT_EQ(frames.size(), states.size());
    for (size_t i = 0; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].frame, 20 + int(i));
        EXPECT_EQ(frames[i].output, concat("o", i));
        EXPECT_EQ(
            std::tuple(frames[i].state, frames[i].attempts, frames[i].message, frames[i].filter_ms),
            states[i])
            << i;
        EXPECT_EQ(json_of(frame(id, 20 + int(i)), frame_fields()),
                  json_of(frames[i], frame_fields()));
        EXPECT_EQ(json_of(store_->frames(id, i, 1)->at(0), frame_fields()),
                  json_of(frames[i], frame_fields()));
    }
}

// They died with the service: no attempt has failed.
TEST_F(StoreTest, FramesInFlightAtTheEndOfTheServiceKeepTheirAttempts) {
    const std::string id = running(4);
    for (int frame : {1, 2, 3}) begin(id, frame);
    for (int death = 1; death <= 4; ++death) {
        open();
        for (const FrameToDo& frame : to_do(id)) {
            EXPECT_FALSE(frame.alone) << frame.frame;
            EXPECT_EQ(frame.begun, frame.frame <= 3) << frame.frame;
            EXPECT_EQ(frame.attempts, 0) << frame.frame;
        }
        EXPECT_EQ(told(id).back(), R"(requeued {"why":"the service ended"})");
        ASSERT_TRUE(*store_->start(id));
    }
}

// Any of several frames may have killed the process: the attempt counts for none of them.
TEST_F(StoreTest, FramesInFlightTogetherGoOnAloneAndKeepTheirAttempts) {
    const std::string id = running(3), other = running(1);
    for (int frame : {1, 2}) begin(id, frame);
    begin(other, 1);
    ASSERT_TRUE(store_->interrupted(id, {1, 2}, "it died").ok());
    for (const FrameToDo& frame : to_do(id)) {
        EXPECT_EQ(frame.alone, frame.frame <= 2) << frame.frame;
        EXPECT_EQ(frame.attempts, 0) << frame.frame;
    }
    EXPECT_FALSE(to_do(other)[0].alone);
    EXPECT_EQ(job(id).state, JobState::running);
}

TEST_F(StoreTest, AFrameThatKillsItsProcessAloneIsQuarantined) {
    const std::string id = running(2);
    for (int death = 1; death <= 3; ++death) {
        begin(id, 1);
        ASSERT_TRUE(store_->interrupted(id, {1}, "it died").ok());
        EXPECT_EQ(frame(id, 1).attempts, death);
        EXPECT_EQ(frame(id, 1).state, death < 3 ? FrameState::waiting : FrameState::quarantined);
        EXPECT_EQ(frame(id, 1).message, "it died");
    }
    EXPECT_EQ(job(id).failed, 1);
    const auto end = [](int attempts) {
        return concat(R"( {"frame":1,"attempts":)", attempts, R"(,"message":"it died"})");
    };
    EXPECT_EQ(told(id),
              (std::vector<std::string>{R"(queued {"kind":"run","priority":0})", "started {}",
                                        R"(frames {"frames":2})", "frame_failed" + end(1),
                                        "frame_failed" + end(2), "quarantined" + end(3)}));
}

// Its tasks go on without this process, so that no death is its fault.
TEST_F(StoreTest, AJobInAnotherQueueOutlivesTheProcess) {
    const std::string id = add();
    ASSERT_TRUE(*store_->start(id));
    ASSERT_TRUE(store_->set_remote(id, "17").ok());
    for (int death = 1; death <= 4; ++death) {
        open();
        ASSERT_EQ(job(id).state, JobState::queued) << death;
        ASSERT_TRUE(*store_->start(id));
    }
    EXPECT_EQ(job(id).remote, "17");
}

TEST_F(StoreTest, WhatWasGivenUpWaitsAsBefore) {
    const std::string id = running(2);
    begin(id, 1);
    EXPECT_EQ(frame(id, 1).attempts, 1);
    ASSERT_TRUE(store_->release(id).ok());
    EXPECT_EQ(frame(id, 1).attempts, 0);
    ASSERT_TRUE(store_->requeue(id, "stopped").ok());
    open();
    EXPECT_FALSE(to_do(id)[0].alone);
}

TEST_F(StoreTest, FailuresCountUntilTheFrameIsQuarantined) {
    open(2);
    const std::string id = running(1);
    for (int attempt = 1; attempt <= 2; ++attempt) {
        begin(id, 1);
        ASSERT_TRUE(store_->frame_fails(id, 1, "why").ok());
        EXPECT_EQ(frame(id, 1).state, attempt < 2 ? FrameState::waiting : FrameState::quarantined);
    }
    EXPECT_EQ(frame(id, 1).message, "why");
    end(id, JobState::failed);
    ASSERT_TRUE(store_->retry(id)->done);
    EXPECT_EQ(frame(id, 1).state, FrameState::waiting);
    EXPECT_EQ(frame(id, 1).attempts, 0);
    EXPECT_EQ(job(id).failed, 0);
    EXPECT_EQ(job(id).ended_ms, 0);
    // A frame that is written does not fail afterward.
    write(id, 1);
    ASSERT_TRUE(store_->frame_fails(id, 1, "late").ok());
    EXPECT_EQ(frame(id, 1).state, FrameState::written);
    EXPECT_EQ(types(id).back(), "frame");
}

TEST_F(StoreTest, OneKeyIsOneJob) {
    const auto add_with_key = [&](const char* body) {
        return *store_->add({JobKind::run, body, 0, "key"}, 100);
    };
    const Added first = add_with_key("{}"), same = add_with_key("{}");
    EXPECT_EQ(first.result, Added::Result::made);
    EXPECT_EQ(same.result, Added::Result::same);
    EXPECT_EQ(same.job.id, first.job.id);
    EXPECT_EQ(add_with_key("{ }").result, Added::Result::other_body);
    EXPECT_EQ(try_add(User(), 0, 1).result, Added::Result::full);
    EXPECT_EQ(job_count(), 1u);
}

TEST_F(StoreTest, CanceledWorkDoesNotEndOtherwise) {
    const std::string id = running(1);
    ASSERT_TRUE(*store_->cancel(id));
    EXPECT_FALSE(*store_->cancel(id));
    end(id, JobState::done);
    ASSERT_TRUE(store_->requeue(id, "").ok());
    EXPECT_EQ(job(id).state, JobState::canceled);
    EXPECT_FALSE(*store_->start(id));
}

TEST_F(StoreTest, EventsGrowOverRestartsAndAreReadOnFromAnyOfThem) {
    const std::string a = add(), b = add();
    const int64_t last = events("").back().id;
    open();
    ASSERT_TRUE(*store_->cancel(a));
    const auto later = *store_->events("", last, 100);
    ASSERT_EQ(later.size(), 1u);
    EXPECT_GT(later[0].id, last);
    EXPECT_EQ(later[0].type + later[0].job, "canceled" + a);
    EXPECT_EQ(events(b).size(), 1u);
    EXPECT_EQ(store_->events("", 0, 1)->size(), 1u);
}

TEST_F(StoreTest, JobsAreReadOnFromAnyOfThem) {
    for (int i = 0; i < 5; ++i) add();
    const auto newest = store_->jobs("", "", 2);
    ASSERT_EQ(newest->size(), 2u);
    EXPECT_EQ((*newest)[0].id, "5");
    EXPECT_EQ((*store_->jobs("", "4", 2))[0].id, "3");
    EXPECT_TRUE(store_->jobs("done", "", 9)->empty());
    EXPECT_EQ(store_->jobs("queued", "", 9)->size(), 5u);
    for (const char* no_id : {"0", "-1", "x", "1 OR 1=1", "99999999999999999999", "01"})
        EXPECT_FALSE(*store_->job(no_id)) << no_id;
}

TEST_F(StoreTest, TheOldestEndedJobsGo) {
    for (int i = 0; i < 3; ++i) add_ended();
    add();
    run_sql("UPDATE jobs SET ended_ms = ended_ms - 3 * 86400000 WHERE id <= 2");
    open(3, {.jobs = 1000, .days = 2});
    EXPECT_EQ(job_count(), 2u);
    EXPECT_TRUE(*store_->job("3"));
    EXPECT_TRUE(events("2").empty());
}

// A job that ended while the clock was wrong is not the newest for ever.
TEST_F(StoreTest, JobsGoInTheOrderOfTheirEnds) {
    const std::string first = add_ended(), second = add_ended(), third = add_ended();
    ASSERT_TRUE(store_->retry(first)->done);
    ASSERT_TRUE(*store_->cancel(first));
    run_sql("UPDATE jobs SET ended_ms = ended_ms + 400 * 86400000 WHERE id = 2");
    open(3, {.jobs = 2, .days = 0});
    EXPECT_TRUE(*store_->job(first)) << "it ended last";
    EXPECT_FALSE(*store_->job(second));
    EXPECT_TRUE(*store_->job(third));
}

// The newest job stays, however many frames it has.
TEST_F(StoreTest, EndedJobsOfManyFramesGo) {
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
    const std::string ended = add_ended(), waiting = add();
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
    for (const char* name : {"ann", "ann", "ann", "bob", "bob"}) add(0, user_of(name));
    const std::string urgent = add(1, user_of("ann")), late = add(-5, user_of("bob"));
    EXPECT_FALSE(*store_->next(2));
    std::string order;
    for (int i = 0; i < 7; ++i) {
        const Job next = **store_->next(-kMaxPriority);
        order += next.id == urgent ? "!" : next.id == late ? "." : next.owner.substr(0, 1);
        ASSERT_TRUE(*store_->start(next.id));
        ASSERT_TRUE(*store_->cancel(next.id));
    }
    EXPECT_EQ(order, "!babaa.");
    EXPECT_FALSE(*store_->next(-kMaxPriority));
    EXPECT_EQ(store_->jobs("", "", 100, "bob")->size(), 3u);
}

TEST_F(StoreTest, LimitsOfAUser) {
    User ann = user_of("ann");
    ann.max_jobs = 2;
    const std::string first = try_add(ann, 5).job.id;
    EXPECT_EQ(try_add(ann, 5).result, Added::Result::made);
    EXPECT_THAT(try_add(ann, 5).why, HasSubstr("ann may have 2 unfinished jobs"));
    add();  // of another user
    ann.max_jobs = 0;
    ann.max_frames = 12;
    EXPECT_EQ(try_add(ann, 2).result, Added::Result::made);
    EXPECT_THAT(try_add(ann, 1).why, HasSubstr("may have 12 frames in unfinished jobs, and would"));
    ASSERT_TRUE(*store_->cancel(first));
    EXPECT_EQ(try_add(ann, 1).result, Added::Result::made);
    const auto again = store_->retry(first, ann);
    EXPECT_FALSE(again->done);
    EXPECT_THAT(again->why, HasSubstr("and would have 13"));
    EXPECT_EQ(job(first).state, JobState::canceled);
    ann.max_frames = 0;
    ann.max_bytes = 100;
    ann.max_disk = "100";
    const std::string writes = running(1, ann);
    write(writes, 1, 100);
    EXPECT_THAT(try_add(ann, 1).why, HasSubstr("have written 100 bytes"));
    EXPECT_THAT(*store_->over_disk(ann), HasSubstr("max_disk: the jobs of ann have written 100"));
    EXPECT_EQ(*store_->over_disk(user_of("ann")), "") << "no limit";
    end(writes, JobState::done);
    // A removed job's outputs are still on disk.
    ASSERT_TRUE(*store_->forget(writes));
    EXPECT_THAT(try_add(ann, 1).why, HasSubstr("have written 100 bytes"));
    ASSERT_EQ(store_->ledger("ann")->size(), 1u);
    EXPECT_EQ((*store_->ledger("ann"))[0].writes, "out/a.####.exr");
    ASSERT_TRUE(store_->settle("ann", "out/a.####.exr", 200).ok());
    EXPECT_EQ((*store_->ledger("ann"))[0].bytes, 100) << "others may have written there too";
    ASSERT_TRUE(store_->settle("ann", "out/a.####.exr", 99).ok());
    EXPECT_EQ(try_add(ann, 1).result, Added::Result::made);
    ASSERT_TRUE(store_->settle("ann", "out/a.####.exr", 0).ok());
    EXPECT_TRUE(store_->ledger("ann")->empty());
    // Without a limit of bytes nothing keeps the rows of old outputs.
    const std::string more = running(1, ann);
    write(more, 1, 30);
    end(more, JobState::done);
    ASSERT_TRUE(*store_->forget(more));
    ASSERT_EQ(store_->ledger("ann")->size(), 1u);
    ann.max_bytes = 0;
    EXPECT_EQ(try_add(ann, 1).result, Added::Result::made);
    EXPECT_TRUE(store_->ledger("ann")->empty());
}

TEST_F(StoreTest, LimitsAreOfOneUserAlone) {
    for (const auto& [name, other] : {std::pair("ann", "bob"), std::pair("dan", "cat")}) {
        for (int i = 0; i < 2; ++i) running(9, user_of(other));
        User limited = user_of(other);
        limited.max_bytes = 1000;
        for (const int bytes : {200, 30}) {
            const std::string removed = running(1, limited);
            write(removed, 1, bytes);
            end(removed, JobState::done);
            ASSERT_TRUE(*store_->forget(removed));
        }
        User user = user_of(name);
        user.max_jobs = 1;
        user.max_frames = 5;
        user.max_bytes = 100;
        EXPECT_EQ(try_add(user, 5).result, Added::Result::made);
        // The entries of a user go with the user's limit or outputs.
        add(0, user_of(concat("friend of ", name)));
        ASSERT_TRUE(store_->settle(name, kWrites, 0).ok());
        ASSERT_EQ(store_->ledger(other)->size(), 1u);
        EXPECT_EQ((*store_->ledger(other))[0].bytes, 200 + 30);
    }
}

TEST_F(StoreTest, TwoRunningJobsAreApart) {
    for (const bool second : {false, true}) {
        const std::string a = running(2), b = running(2);
        const std::string released = second ? b : a, other = second ? a : b;
        for (const std::string& id : {a, b}) begin(id, 1);
        ASSERT_TRUE(store_->release(released).ok());
        EXPECT_EQ(frame(released, 1).attempts, 0);
        EXPECT_EQ(frame(other, 1).attempts, 1);
        ASSERT_TRUE(store_->interrupted(other, {1}, "it died").ok());
        for (const std::string& id : {a, b}) {
            EXPECT_EQ(to_do(id)[0].alone, id == other);
            EXPECT_EQ(frame(id, 1).attempts, id == other);
            ASSERT_TRUE(*store_->cancel(id));
        }
    }
}

TEST_F(StoreTest, ARetryIsOfOneJob) {
    open(1);
    for (const bool second : {false, true}) {
        const std::string a = running(1), b = running(1);
        for (const std::string& id : {a, b}) {
            begin(id, 1);
            ASSERT_TRUE(store_->frame_fails(id, 1, "why").ok());
            end(id, JobState::failed);
        }
        const std::string retried = second ? b : a, other = second ? a : b;
        ASSERT_TRUE(store_->retry(retried)->done);
        EXPECT_EQ(frame(retried, 1).state, FrameState::waiting);
        EXPECT_EQ(frame(other, 1).state, FrameState::quarantined);
        EXPECT_EQ(frame(other, 1).message, "why");
        EXPECT_EQ(job(other).failed, 1);
    }
}

TEST_F(StoreTest, ARetriedJobIsAsOneThatHasNotEnded) {
    const std::string id = running(4);
    write(id, 1, 70);
    ASSERT_TRUE(store_->frame_ends(id, {2, FrameState::missing, "is not there"}).ok());
    for (int attempt = 1; attempt <= 3; ++attempt) {
        begin(id, 3);
        ASSERT_TRUE(store_->frame_fails(id, 3, "why").ok());
    }
    Job ended = job(id);
    const int64_t started = ended.started_ms;
    std::tie(ended.state, ended.message, ended.exit_code, ended.verdict) =
        std::tuple(JobState::failed, "why", 4, "B is closer");
    ASSERT_TRUE(store_->end(ended).ok());
    EXPECT_EQ(job(id).failed, 2);
    ASSERT_TRUE(store_->retry(id)->done);
    const Job again = job(id);
    EXPECT_EQ(std::tuple(again.state, again.message, again.exit_code, again.verdict, again.ended_ms,
                         again.started_ms),
              std::tuple(JobState::queued, "", 0, "", 0, started));
    EXPECT_EQ(std::tuple(again.frames, again.done, again.failed, again.bytes),
              std::tuple(4, 1, 0, 70));
    for (int number : {2, 3, 4}) {
        const JobFrame one = frame(id, number);
        EXPECT_EQ(std::tuple(one.state, one.attempts, one.message),
                  std::tuple(FrameState::waiting, 0, ""))
            << number;
    }
    EXPECT_TRUE(*store_->start(id));
}

TEST_F(StoreTest, UseOfTheStore) {
    EXPECT_EQ(store_->use().oldest_queued_ms, 0);
    User ann = user_of("ann");
    ann.max_bytes = 1000;
    const std::string id = running(3, ann);
    write(id, 1, 30);
    write(running(1, user_of("bob")), 1, 7);
    add();
    end(id, JobState::failed);
    ASSERT_TRUE(*store_->forget(id));
    write(running(1, ann), 1, 50);
    const StoreUse use = store_->use();
    EXPECT_EQ(use.jobs,
              (std::map<JobState, size_t>{{JobState::queued, 1}, {JobState::running, 2}}));
    EXPECT_EQ(use.bytes, (std::map<std::string, int64_t>{{"ann", 80}, {"bob", 7}}));
    EXPECT_GT(use.oldest_queued_ms, 0);
}

TEST_F(StoreTest, OutputsOfJobsThatAreTooOldCountToo) {
    open(3, {.jobs = 1, .days = 0});
    User ann = user_of("ann");
    for (int i = 0; i < 2; ++i) {
        const std::string id = running(1, ann);
        write(id, 1, 60);
        end(id, JobState::done);
    }
    EXPECT_EQ(job_count(), 1u);
    ann.max_bytes = 120;
    ann.max_disk = "120";
    EXPECT_THAT(try_add(ann, 1).why, HasSubstr("have written 120 bytes"));
    EXPECT_EQ(store_->use().bytes["ann"], 120);
}

TEST_F(StoreTest, ARetryWaitsInTheQueueLikeAnyJob) {
    const std::string id = add();
    ASSERT_TRUE(*store_->cancel(id, 143));
    EXPECT_EQ(job(id).exit_code, 143);
    add();
    const auto full = store_->retry(id, User(), 1);
    EXPECT_FALSE(full->done);
    EXPECT_EQ(full->why, "1 job is waiting; try again later");
    EXPECT_EQ(job(id).state, JobState::canceled);
    EXPECT_TRUE(store_->retry(id, User(), 2)->done);
    EXPECT_EQ(job(id).exit_code, 0);
}

// A job that has not begun has no frames in the store, only their number from its request.
TEST_F(StoreTest, FramesOfAJobThatHasNotBegunCountAfterARetryAndARestart) {
    User ann = user_of("ann");
    ann.max_frames = 5;
    const std::string id = try_add(ann, 5).job.id;
    ASSERT_TRUE(*store_->cancel(id));
    ASSERT_TRUE(store_->retry(id, ann)->done);
    EXPECT_EQ(job(id).frames, 5);
    EXPECT_EQ(try_add(ann, 1).result, Added::Result::over_limit);
    ASSERT_TRUE(*store_->start(id));
    open();
    EXPECT_EQ(job(id).frames, 5);
}

TEST_F(StoreTest, PrioritiesChangeAndEndedJobsAreRemoved) {
    const std::string a = add(), b = add();
    ASSERT_TRUE(*store_->set_priority(b, 7));
    EXPECT_EQ((**store_->next(-kMaxPriority)).id, b);
    EXPECT_EQ(types(b).back(), "priority");
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
