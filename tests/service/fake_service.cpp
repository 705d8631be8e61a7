#include "tests/service/fake_service.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "chain/base/stop.h"

namespace postchain::service {

namespace {

using Json = nlohmann::ordered_json;
using std::chrono::milliseconds;

constexpr int kFrames = 4;

test::FakeSettings g_settings;  // of the next open()

Problem no_job() {
    return {Problem::Kind::not_found, "there is no such job", {}, 0};
}

}  // namespace

struct Service::State {
    test::FakeSettings settings;
    std::mutex mutex;
    std::vector<Job> jobs;
    std::vector<Event> all;
    std::function<void(const Event&)> listener;
    bool draining = false;
    std::atomic<int> left = 0;  // clients of previews
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("postchain-fake-" + std::to_string(getpid()));

    ~State() {
        std::error_code ignored;
        std::filesystem::remove_all(folder, ignored);
    }

    ResultFile file(const std::string& name, const std::string& type, const std::string& text) {
        std::filesystem::create_directories(folder);
        std::ofstream(folder / name, std::ios::binary) << text;
        return {(folder / name).string(), name, type, text.size()};
    }
    std::vector<std::thread> threads;

    Job* find(const std::string& id) {
        const auto at =
            std::find_if(jobs.begin(), jobs.end(), [&](const Job& job) { return job.id == id; });
        return at == jobs.end() ? nullptr : &*at;
    }

    void tell(const std::string& job, const std::string& type, std::string data = "{}") {
        if (settings.event_bytes > 0)
            data = "{\"padding\": \"" + std::string(settings.event_bytes, 'x') + "\"}";
        all.push_back({int64_t(all.size()) + 1, job, now_ms(), type, data});
        if (listener) listener(all.back());
    }

    // A job in a thread of its own.
    void run(const std::string& id) {
        for (int done = 0; done <= kFrames; ++done) {
            std::this_thread::sleep_for(settings.frame);
            const std::lock_guard lock(mutex);
            Job& job = *find(id);
            if (job.ended_ms != 0) return;  // canceled
            job.state = JobState::running;
            job.frames = kFrames;
            job.done = done;
            tell(id, done == 0 ? "started" : "frame");
            if (done < kFrames) continue;
            job.state = JobState::done;
            job.ended_ms = now_ms();
            tell(id, "done");
        }
    }
};

Service::Service(std::unique_ptr<State> state) : state_(std::move(state)) {}

Service::~Service() {
    for (std::thread& thread : state_->threads) thread.join();
}

Result<std::unique_ptr<Service>> Service::open(const ServiceSettings&, const PassRegistry&) {
    auto state = std::make_unique<State>();
    state->settings = g_settings;
    for (size_t i = 0; i < g_settings.past_events; ++i) state->tell("1", "frame");
    return std::unique_ptr<Service>(new Service(std::move(state)));
}

void Service::drain() {
    const std::lock_guard lock(state_->mutex);
    state_->draining = true;
}

size_t Service::end() {
    drain();
    return 0;
}

bool Service::alive() const {
    return true;
}

Answer<Job> Service::submit(const User& user, const std::string& body, const std::string&,
                            bool* created) {
    *created = false;
    const std::lock_guard lock(state_->mutex);
    const Json json = Json::parse(body, nullptr, false);
    if (!json.is_object())
        return Problem{Problem::Kind::invalid,
                       "the body is no JSON object",
                       {{"body", 1, 1, Severity::error, "", "no JSON object", StatusCode::chain}},
                       0};
    const auto waiting = std::count_if(state_->jobs.begin(), state_->jobs.end(),
                                       [](const Job& j) { return j.ended_ms == 0; });
    if (size_t(waiting) >= state_->settings.max_queue)
        return Problem{Problem::Kind::busy, "the queue is full", {}, 7};
    Job job;
    job.id = "j" + std::to_string(state_->jobs.size() + 1);
    job.body = body;
    job.owner = user.name;
    job.created_ms = now_ms();
    state_->jobs.push_back(job);
    *created = true;
    state_->tell(job.id, "queued");
    if (state_->settings.frame.count() > 0)
        state_->threads.emplace_back([this, id = job.id] { state_->run(id); });
    return job;
}

Answer<std::vector<Job>> Service::jobs(const JobQuery& query) const {
    const std::lock_guard lock(state_->mutex);
    std::vector<Job> found(state_->jobs.rbegin(), state_->jobs.rend());
    found.resize(std::min(found.size(), query.limit));
    return found;
}

Answer<Job> Service::job(const std::string& id) const {
    const std::lock_guard lock(state_->mutex);
    if (const Job* job = state_->find(id)) return *job;
    return no_job();
}

Answer<std::vector<JobFrame>> Service::frames(const std::string& id, size_t from,
                                              size_t limit) const {
    const std::lock_guard lock(state_->mutex);
    const Job* job = state_->find(id);
    if (!job) return no_job();
    std::vector<JobFrame> frames;
    for (int i = int(from) + 1; i <= job->frames && frames.size() < limit; ++i)
        frames.push_back({i, i <= job->done ? FrameState::written : FrameState::waiting, 1,
                          "out.exr", "", 12.5, "{\"frame\": 1}"});
    return frames;
}

Answer<JobFrame> Service::frame(const std::string&, int) const {
    return Problem{Problem::Kind::not_found, "the job has no such frame", {}, 0};
}

Answer<Job> Service::cancel(const User&, const std::string& id) {
    const std::lock_guard lock(state_->mutex);
    Job* job = state_->find(id);
    if (!job) return no_job();
    if (job->ended_ms != 0) return Problem{Problem::Kind::conflict, "it has ended", {}, 0};
    job->state = JobState::canceled;
    job->ended_ms = now_ms();
    state_->tell(id, "canceled");
    return *job;
}

Answer<Job> Service::change(const User&, const std::string& id, const std::string&) {
    return job(id);
}

Answer<Job> Service::forget(const User&, const std::string& id) {
    return job(id);
}

Answer<Job> Service::retry(const User&, const std::string& id) {
    return job(id);
}

Answer<std::vector<Event>> Service::events(const std::string& id, int64_t after,
                                           size_t limit) const {
    const std::lock_guard lock(state_->mutex);
    if (!id.empty() && !state_->find(id)) return no_job();
    std::vector<Event> found;
    for (const Event& event : state_->all)
        if (event.id > after && (id.empty() || event.job == id) && found.size() < limit)
            found.push_back(event);
    return found;
}

int64_t Service::newest_event() const {
    const std::lock_guard lock(state_->mutex);
    return int64_t(state_->all.size());
}

void Service::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(state_->mutex);
    state_->listener = std::move(listener);
}

void Service::preview(const User&, const std::string&, const PictureWanted& wanted,
                      GivePicture done) {
    const auto end = std::chrono::steady_clock::now() + state_->settings.picture;
    const auto left = [&] { return wanted.left && *wanted.left; };
    while (std::chrono::steady_clock::now() < end && !left())
        std::this_thread::sleep_for(milliseconds(5));
    if (left()) ++state_->left;
    done(Picture{wanted.type, std::string(state_->settings.picture_bytes, 'p')});
}

void Service::frame_image(const User& user, const std::string& id, int, bool,
                          const PictureWanted& wanted, GivePicture done) {
    job_image(user, id, wanted, std::move(done));
}

void Service::job_image(const User&, const std::string& id, const PictureWanted& wanted,
                        GivePicture done) {
    const auto found = job(id);
    if (const auto* wrong = std::get_if<Problem>(&found)) return done(*wrong);
    done(Picture{wanted.type, "png"});
}

void Service::input_image(const User&, const std::string&, int, const PictureWanted& wanted,
                          GivePicture done) {
    done(Picture{wanted.type, "png"});
}

Answer<std::string> Service::browse(const User&, const std::string& folder) const {
    if (folder == "slow") std::this_thread::sleep_for(state_->settings.picture);
    while (folder == "endless" && !is_stopped())
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return "{\"folder\": \"" + folder + "\"}";
}

Answer<std::string> Service::chains(const User&, const std::string&) const {
    return std::string("{\"chains\": []}");
}

Answer<ResultFile> Service::report_file(const User&, const std::string& id,
                                        const std::string& name) const {
    const auto found = job(id);
    if (const auto* wrong = std::get_if<Problem>(&found)) return *wrong;
    // As if it had become shorter since.
    if (name == "shortened.json") {
        ResultFile file = state_->file(name, "application/json", "{");
        file.bytes = 1'000'000;
        return file;
    }
    if (name != "index.html") return Problem{Problem::Kind::not_found, "no such file", {}, 0};
    return state_->file(
        "index.html", "text/html",
        "<p>report</p>\n<script type=\"text/plain\" id=\"image-1\">data:,x</script>\n");
}

Answer<ResultFile> Service::output(const User&, const std::string& id, int frame) const {
    const auto found = job(id);
    if (const auto* wrong = std::get_if<Problem>(&found)) return *wrong;
    if (frame < 1 || frame > kFrames)
        return Problem{Problem::Kind::not_found, "no such frame", {}, 0};
    return state_->file("o." + std::to_string(frame) + ".exr", "image/x-exr",
                        std::string(size_t(frame) * 300'000, char('0' + frame)));
}

Answer<std::string> Service::plan(const User&, const std::string& body) {
    if (!Json::accept(body)) return Problem{Problem::Kind::invalid, "no JSON", {}, 0};
    return std::string("{\"frame\": 1}");
}

Answer<Diagnostics> Service::check_chain(const std::string& body) const {
    if (!Json::accept(body)) return Problem{Problem::Kind::invalid, "no JSON", {}, 0};
    return Diagnostics{{"chain.yaml", 1, 1, Severity::error, "", body, StatusCode::chain}};
}

std::string Service::passes() const {
    return "{}";
}
std::string Service::chain_schema() const {
    return "{\"type\": \"object\"}";
}
io::Json Service::job_schema() const {
    return {{"type", "object"}};
}
Health Service::health() const {
    const std::lock_guard lock(state_->mutex);
    return {true, true, true, true, state_->draining, false, "fake", "no Landlock"};
}
std::string Service::metrics() const {
    return "postchain_fake 1\n# TYPE postchain_fake_left gauge\npostchain_fake_left " +
           std::to_string(state_->left) + "\n";
}

namespace test {

std::unique_ptr<Service> fake_service(const FakeSettings& settings) {
    g_settings = settings;
    return std::move(*Service::open(ServiceSettings{}, PassRegistry(std::vector<PassType>())));
}

}  // namespace test
}  // namespace postchain::service
