#include "tests/service/support.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

namespace postchain::test {

constexpr auto kPatience = std::chrono::minutes(10);

namespace fs = std::filesystem;
using namespace service;

void ServiceTest::SetUp() {
    std::signal(SIGPIPE, SIG_IGN);  // as the program does
    fs::create_directories(root("out"));
    fs::create_directories(outside());
    write_sequence(root(), {1, 2, 3, 4, 5, 6}, 24, 16);
}

std::string ServiceTest::body(const std::string& more) {
    return concat(R"({"chain": {"postchain": 1, "passes": ["fxaa"]},
 "input": "in.####.exr", "output": "out/o.####.exr")",
                  more, "}");
}

ServiceSettings ServiceTest::settings() {
    ServiceSettings settings;
    settings.store = folder_.path("store.db");
    settings.device = "software";
    settings.attempts = attempts_;
    settings.max_queue = max_queue_;
    settings.max_memory = max_memory_;
    settings.version = version_;
    settings.program = program_;
    settings.preview_program = preview_program_;
    settings.queue = queue_;
    settings.users = users_;
    settings.frame_timeout_s = frame_timeout_s_;
    settings.slice_s = slice_s_;
    settings.drain = drain_;
    settings.remote = remote_;
    settings.log = [this](const LogLine& line) {
        const std::lock_guard lock(log_mutex_);
        log_.push_back(line);
    };
    settings.roots = *Roots::of({root()});
    return settings;
}

void ServiceTest::use(const std::string& users) {
    std::string text = users;
    const std::string key = "token: ";
    for (size_t at = 0; (at = text.find(key, at)) != std::string::npos;) {
        const size_t end = text.find_first_of(",}", at);
        const std::string token = text.substr(at + key.size(), end - at - key.size());
        const std::string hashes = "tokens: [" + must(hash_of_token(token)) + "]";
        text.replace(at, end - at, hashes);
        at += hashes.size();
    }
    std::ofstream(folder_.path("users.yaml")) << "postchain_users: 1\nusers:\n" << text;
    users_ = must(Users::of_file(folder_.path("users.yaml"), [this](const std::string& folder) {
        return Roots::of({root()})->within({folder}).status();
    }));
}

std::string ServiceTest::submit(const std::string& body, const std::string& of) {
    bool created = false;
    const Job job = got(service_->submit(user(of), body, "", &created));
    EXPECT_TRUE(created);
    return job.id;
}

Problem ServiceTest::refused(const std::string& body, const std::string& of) {
    bool created = false;
    Problem problem = problem_of(service_->submit(user(of), body, "", &created));
    EXPECT_FALSE(created);
    return problem;
}

Answer<Picture> ServiceTest::answer_to(const Ask& ask) {
    const auto promise = std::make_shared<std::promise<Answer<Picture>>>();
    auto answer = promise->get_future();
    ask([promise](Answer<Picture> got) { promise->set_value(std::move(got)); });
    if (answer.wait_for(kPatience) != std::future_status::ready)
        return Problem{Problem::Kind::internal, "no answer"};
    return answer.get();
}

ServiceTest::Ask ServiceTest::previewing(const std::string& body,
                                         const PictureWanted& wanted) const {
    return [=, this](auto done) { service_->preview(user(), body, wanted, std::move(done)); };
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
