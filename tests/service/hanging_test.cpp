// Work that hangs, and jobs that leave the device to previews.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <future>

#include "tests/service/support.h"
#include "tools/service/store/job_store.h"
#include "tools/service/work/previews.h"
#include "tools/service/work/worker.h"

namespace postchain::service {
namespace {

using namespace std::chrono_literals;
using test::ServiceTest;
using testing::HasSubstr;

// Planning frame 3, which belongs to its reading, does not end while `g_hangs`.
std::atomic<bool> g_hangs = false;
std::atomic<int> g_hanging = 0;  // threads

class HangingPass final : public test::FakePass {
  public:
    std::optional<Identity> identity(const PlanContext& context) const override {
        if (context.frame.frame_number == 3 && g_hangs) {
            ++g_hanging;
            while (g_hangs) usleep(10'000);
            --g_hanging;
        }
        return FakePass::identity(context);
    }
};

class Hanging : public ServiceTest {
  protected:
    void SetUp() override {
        ServiceTest::SetUp();
        registry_ = &with_hanging_;
        g_hangs = true;
        drain_ = 100ms;
        open();
    }
    void TearDown() override {
        answer();
        close();
        ServiceTest::TearDown();
    }
    // Lets the thread go, and waits until it has.
    bool answer() {
        g_hangs = false;
        return wait_for([&] {
            return service_->metrics().find("postchain_stuck_threads 0") != std::string::npos;
        });
    }
    static std::string hanging(const std::string& more = "") { return body(more, "hanging"); }
    const PassRegistry with_hanging_ = test::with_pass<HangingPass>("hanging");
};

TEST_F(Hanging, AReadThatHangsEndsItsJobAndNotTheService) {
    // The limit is for frames: what is made once is made before.
    done(submit(in_folder(hanging(R"(, "frames": "1-2")"), "warm")));
    const std::string id = submit(hanging(R"(, "frame_timeout": 10)"));
    const Job job = ended(id);
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_EQ(job.exit_code, 4);
    EXPECT_EQ(job.done, 2);
    EXPECT_THAT(job.message, HasSubstr("frame 3 was not read within 10 s: the disk hangs"));
    EXPECT_EQ(frames(id)[2].attempts, 1);
    // Another thread has taken over, with a device of its own.
    done(submit(in_folder(body(R"(, "frames": "1-2,4-6")"), "next")));
    const Health health = service_->health();
    EXPECT_TRUE(health.gl && health.progress) << health.why;
    EXPECT_THAT(health.why, HasSubstr("1 thread hangs"));
    EXPECT_THAT(service_->metrics(), HasSubstr("postchain_stuck_threads 1"));
    // The disk answers again, and the retry makes what is missing.
    ASSERT_TRUE(answer());
    retry(id);
    EXPECT_EQ(done(id).done, 6);
    for (const JobFrame& frame : frames(id)) EXPECT_LE(frame.attempts, 1) << frame.frame;
}

// Each thread that hangs keeps a frame and a device, so that not all of them can be replaced.
TEST_F(Hanging, AfterEightThreadsThatHangItWaitsForOneOfThem) {
    answer();
    close();
    g_hangs = true;
    frame_timeout_s_ = 1;
    open();
    const auto stuck = [&](int count) {
        return service_->metrics().find(concat("postchain_stuck_threads ", count, "\n")) !=
               std::string::npos;
    };
    // On a busy machine a job may also be ended because it is slow.
    for (int i = 1; i <= 40 && g_hanging < 8; ++i)
        ran(in_folder(hanging(R"(, "frames": "3")"), concat("out", i)));
    ASSERT_TRUE(wait_for([&] { return stuck(8); }));
    const std::string waits = submit(body(R"(, "frames": "1", "frame_timeout": 3600)"));
    EXPECT_TRUE(wait_for([&] { return !service_->health().gl || job(waits).ended_ms != 0; }));
    EXPECT_FALSE(service_->health().gl || service_->health().progress) << "a ninth thread";
    EXPECT_THAT(service_->health().why, HasSubstr("restart the service"));
    ASSERT_TRUE(answer());
    done(waits);
    EXPECT_TRUE(service_->health().gl);
}

// The next process makes its frames, without a counted attempt.
TEST_F(Hanging, TheEndDoesNotWaitForAThreadThatHangs) {
    const std::string id = submit(hanging());
    ASSERT_TRUE(wait_for([] { return g_hanging > 0; }));
    EXPECT_EQ(service_->end(), 1u);
    EXPECT_EQ(job(id).state, JobState::queued);
    EXPECT_EQ(frames(id)[2].attempts, 0);
    g_hangs = false;
    ASSERT_TRUE(wait_for([&] { return service_->end() == 0; }));
    EXPECT_FALSE(std::filesystem::exists(root("out/o.0003.exr")));
    close();
    open();
    EXPECT_EQ(done(id).done, 6);
}

TEST(Gates, PreviewsWithoutAPauseLeaveTheJobAFifth) {
    DeviceGate gate(100ms);
    const auto at = [start = DeviceGate::Clock::now()](int ms) { return start + 1ms * ms; };
    const auto waits = [&](int ms) { return gate.ask(at(ms)) == RunDecision::wait; };
    EXPECT_FALSE(waits(0));
    gate.enter(at(0));
    EXPECT_TRUE(waits(0) && waits(99));
    EXPECT_FALSE(waits(100) || waits(124));
    EXPECT_TRUE(waits(125));
    gate.leave(at(0), at(130));
    EXPECT_FALSE(waits(130));
    gate.enter(at(131));
    EXPECT_TRUE(waits(224));
    EXPECT_FALSE(waits(225)) << "no pause";
    gate.leave(at(131), at(226));
    gate.enter(at(251));
    EXPECT_TRUE(waits(251) && waits(350)) << "a pause";
    EXPECT_FALSE(waits(352));
    EXPECT_TRUE(waits(251 + 125 * 479));
    EXPECT_FALSE(waits(251 + 125 * 480)) << "the preview hangs";
    gate.enter(at(251 + 125 * 480));
    EXPECT_TRUE(waits(251 + 125 * 480)) << "another one";
    gate.leave(at(251 + 125 * 480), at(252 + 125 * 480));
    EXPECT_FALSE(waits(253 + 125 * 480)) << "the one that hangs is left";
}

TEST(Gates, AWaitIsNotTheFaultOfAStep) {
    Progress progress;
    const auto at = [start = Progress::Clock::now()](int s) { return start + 1s * s; };
    progress.step(sequence::FrameStep::filter, 1, true, at(0));
    progress.step(sequence::FrameStep::read, 2, true, at(3));
    EXPECT_EQ(progress.waits(false, at(1)), 0);
    EXPECT_EQ(progress.waits(true, at(1)), 0);
    EXPECT_EQ(progress.waits(true, at(5)), 4);
    EXPECT_EQ(progress.waits(false, at(8)), 3);
    EXPECT_EQ(progress.longest(at(9))->what, "frame 2 was not read");
    EXPECT_EQ(progress.longest(at(9))->seconds, 6);
    progress.step(sequence::FrameStep::read, 2, false, at(9));
    EXPECT_EQ(progress.longest(at(9))->seconds, 2);
    // Nor that of a measurement, whose time begins now.
    progress.step(sequence::FrameStep::filter, 1, false, at(9));
    progress.does("a measurement did not end");
    const auto begun = Progress::Clock::now();
    EXPECT_EQ(progress.waits(true, begun + 10s), 0);
    EXPECT_EQ(progress.waits(false, begun + 90s), 80);
    EXPECT_GE(progress.longest(begun + 100s)->seconds, 20);
    EXPECT_LT(progress.longest(begun + 100s)->seconds, 60);
}

// A worker and previews around one gate, whose previews may take an hour.
class Gate : public Hanging {
  protected:
    void SetUp() override {
        Hanging::SetUp();
        close();
        const ServiceSettings service = settings();
        store_ = std::move(*JobStore::open(service.store, 1));
        reader_ = std::make_unique<JobReader>(service.roots, *registry_, version_, 1);
        readers_ = std::make_unique<Readers>(*reader_, *users_);
        device_.device = egl::ContextOptions::kSoftware;
        worker_ = std::make_unique<Worker>(*store_, *readers_, counters_, gate_, *registry_,
                                           WorkerSettings{.device = device_});
        ASSERT_TRUE(worker_->begin().ok());
    }
    void TearDown() override {
        worker_.reset();
        ServiceTest::TearDown();
    }
    // A job that waits for the device.
    std::string waiting() {
        const std::string id = store_->add({JobKind::run, body()}, 1)->job.id;
        worker_->wake();
        EXPECT_TRUE(wait_for([&] { return waited() > 0; }));
        return id;
    }
    double waited() {
        const std::string text = counters_.text({}, 0);
        const std::string name = "\npostchain_preview_wait_seconds_total ";
        return std::stod(text.substr(text.find(name) + name.size()));
    }
    Job now(const std::string& id) { return **store_->job(id); }

    DeviceGate gate_{1h};
    egl::ContextOptions device_;
    const std::string version_ = "test";
    Counters counters_;
    std::unique_ptr<JobStore> store_;
    std::unique_ptr<JobReader> reader_;
    std::unique_ptr<Readers> readers_;
    std::unique_ptr<Worker> worker_;
};

TEST_F(Gate, AWorkerDoesNotBeginWithoutItsDevice) {
    egl::ContextOptions missing;
    missing.device = 99;
    Worker other(*store_, *readers_, counters_, gate_, *registry_,
                 WorkerSettings{.device = missing});
    EXPECT_THAT(other.begin().message(), HasSubstr("99"));
}

TEST_F(Gate, AWaitingJobCanBeCanceled) {
    const DeviceGate::Reservation preview(gate_);
    const std::string id = waiting();
    ASSERT_TRUE(*store_->cancel(id));
    worker_->stop_job(id);
    worker_->drain();
    EXPECT_EQ(worker_->end(), 0u) << "it hangs";
}

TEST_F(Gate, APreviewHoldsTheGate) {
    Previews previews(ServiceSettings(), 0, device_, *registry_, gate_);
    ASSERT_TRUE(previews.begin().ok());
    EXPECT_EQ(gate_.ask(), RunDecision::go_on);
    const std::string body =
        R"({"chain": {"postchain": 1, "passes": ["hanging"]}, "input": "in.####.exr", "frame": 3})";
    JobRequest request = test::got(reader_->preview(body));
    std::promise<Answer<Picture>> answer;
    ASSERT_TRUE(previews.run(body, std::move(request), reader_->roots(), {},
                             [&](Answer<Picture> made) { answer.set_value(std::move(made)); }));
    ASSERT_TRUE(wait_for([] { return g_hanging > 0; }));
    const std::string id = waiting();
    const double once = waited();
    EXPECT_TRUE(wait_for([&] { return waited() > once; })) << "it asks again";
    EXPECT_EQ(now(id).done, 0);
    EXPECT_EQ(now(id).state, JobState::running);
    g_hangs = false;
    test::got(answer.get_future().get());
    EXPECT_TRUE(wait_for([&] { return now(id).state == JobState::done; })) << now(id).message;
    EXPECT_EQ(now(id).done, 6);
}

}  // namespace
}  // namespace postchain::service
