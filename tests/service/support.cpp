#include "tests/service/support.h"

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "tests/command/frames.h"

namespace postchain::test {

constexpr auto kPatience = std::chrono::minutes(2);

namespace fs = std::filesystem;
using namespace service;

void ServiceTest::SetUp() {
    registry_ = &builtin_passes();
    fs::create_directories(root("out"));
    fs::create_directories(outside());
    write_sequence(root(), {1, 2, 3, 4, 5, 6}, 24, 16);
}

std::string ServiceTest::root(const std::string& name) const {
    return folder_.path("root" + (name.empty() ? "" : "/" + name));
}

std::string ServiceTest::outside(const std::string& name) const {
    return folder_.path("outside" + (name.empty() ? "" : "/" + name));
}

std::string ServiceTest::body(const std::string& more) {
    return R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr",
 "output": "out/o.####.exr")" +
           more + "}";
}

ServiceSettings ServiceTest::settings() {
    ServiceSettings settings;
    settings.store = folder_.path("store.db");
    settings.device = "software";
    settings.attempts = attempts_;
    settings.max_queue = max_queue_;
    settings.version = "test";
    settings.users = users_;
    settings.frame_timeout_s = frame_timeout_s_;
    settings.slice_s = slice_s_;
    settings.drain = drain_;
    settings.remote = remote_;
    settings.log = [this](const LogLine& line) {
        const std::lock_guard lock(log_mutex_);
        log_.push_back(line);
    };
    auto roots = Roots::of({root()});
    EXPECT_TRUE(roots.ok()) << roots.status().message();
    if (roots.ok()) settings.roots = *roots;
    return settings;
}

void ServiceTest::open() {
    auto opened = Service::open(settings(), *registry_);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    service_ = std::move(*opened);
}

std::string ServiceTest::held_body(const std::string& more) {
    std::string text = body(more);
    return text.replace(text.find("fxaa"), 4, "held");
}

void ServiceTest::hold() {
    static const PassRegistry with_held = with_pass<HeldPass>("held");
    registry_ = &with_held;
    HeldPass::held = true;
    HeldPass::waits = false;
    open();
}

void ServiceTest::TearDown() {
    HeldPass::held = false;
}

std::optional<Identity> HeldPass::identity(const PlanContext& context) const {
    for (; held && context.frame.frame_number >= 3; usleep(1000)) waits = true;
    return FakePass::identity(context);
}

const User& ServiceTest::user(const std::string& name) const {
    return *users_->named(name);
}

void ServiceTest::use(const std::string& users) {
    std::ofstream(folder_.path("users.yaml")) << "postchain_users: 1\nusers:\n" << users;
    auto made = Users::of_file(folder_.path("users.yaml"), [this](const std::string& folder) {
        return Roots::of({root()})->within({folder}).status();
    });
    ASSERT_TRUE(made.ok()) << made.status().message();
    users_ = *made;
}

std::string ServiceTest::submit(const std::string& body, const std::string& of) {
    bool created = false;
    const auto answer = service_->submit(user(of), body, "", &created);
    if (const auto* problem = std::get_if<Problem>(&answer)) {
        ADD_FAILURE() << problem->detail << "\n" << text_of(problem->diagnostics);
        return "";
    }
    EXPECT_TRUE(created);
    return std::get<Job>(answer).id;
}

Problem ServiceTest::refused(const std::string& body, const std::string& of) {
    bool created = false;
    auto answer = service_->submit(user(of), body, "", &created);
    EXPECT_FALSE(created);
    if (auto* problem = std::get_if<Problem>(&answer)) return std::move(*problem);
    ADD_FAILURE() << "was taken: " << body;
    return {};
}

Job ServiceTest::job(const std::string& id) const {
    const auto answer = service_->job(id);
    if (const auto* job = std::get_if<Job>(&answer)) return *job;
    ADD_FAILURE() << std::get<Problem>(answer).detail;
    return {};
}

std::vector<JobFrame> ServiceTest::frames(const std::string& id) const {
    const auto answer = service_->frames(id);
    if (const auto* frames = std::get_if<std::vector<JobFrame>>(&answer)) return *frames;
    ADD_FAILURE() << std::get<Problem>(answer).detail;
    return {};
}

Answer<Picture> ServiceTest::answer_to(const Ask& ask) {
    const auto promise = std::make_shared<std::promise<Answer<Picture>>>();
    auto answer = promise->get_future();
    ask([promise](Answer<Picture> got) { promise->set_value(std::move(got)); });
    if (answer.wait_for(kPatience) != std::future_status::ready)
        return Problem{Problem::Kind::internal, "no answer"};
    return answer.get();
}

Picture ServiceTest::picture(const Ask& ask) {
    auto got = answer_to(ask);
    if (const auto* problem = std::get_if<Problem>(&got)) {
        ADD_FAILURE() << problem->detail << text_of(problem->diagnostics);
        return {};
    }
    return std::get<Picture>(std::move(got));
}

Problem ServiceTest::no_picture(const Ask& ask) {
    auto got = answer_to(ask);
    if (auto* problem = std::get_if<Problem>(&got)) return std::move(*problem);
    ADD_FAILURE() << "an image of type " << std::get<Picture>(got).type;
    return {};
}

bool ServiceTest::wait_for(const std::function<bool()>& what) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!what()) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
}

Job ServiceTest::ended(const std::string& id) const {
    Job now;
    EXPECT_TRUE(wait_for([&] { return (now = job(id)).ended_ms != 0; })) << "job " << id;
    return now;
}

std::string ServiceTest::in_folder(std::string body, const std::string& folder) const {
    fs::create_directories(root(folder));
    return body.replace(body.find("out/"), 4, folder + "/");
}

void ServiceTest::add_frames(int last) const {
    for (int frame = 7; frame <= last; ++frame) write_sequence(root(), {frame}, 24, 16);
}

std::vector<Event> ServiceTest::events(const std::string& id) const {
    return std::get<std::vector<Event>>(service_->events(id, 0, 1000));
}

std::string ServiceTest::types_of(const std::string& id) const {
    std::string types;
    for (const Event& event : events(id)) types += event.type + " ";
    return types;
}

std::string ServiceTest::logged() {
    const std::lock_guard lock(log_mutex_);
    std::string text;
    for (const LogLine& line : log_) text += line.message + "\n";
    return text;
}

}  // namespace postchain::test
