// A process with a service and nothing else, to be killed: opens the store, submits a job under a
// key, waits for its end and prints one line.
//
//   service_worker STORE ROOT BODY_FILE KEY ATTEMPTS
//
// Exit code 0: the job is done; 1: it ended otherwise; 2: the service could not be opened.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

#include "passes/registry.h"
#include "tools/service/work/service.h"

int main(int argc, char** argv) {
    using namespace postchain;
    using namespace postchain::service;
    if (argc != 6) return 2;
    ServiceSettings settings;
    settings.store = argv[1];
    settings.device = "software";
    settings.version = POSTCHAIN_VERSION;
    settings.attempts = std::atoi(argv[5]);
    auto roots = Roots::of({argv[2]});
    if (!roots.ok()) return 2;
    settings.roots = *roots;
    auto opened = Service::open(settings, builtin_passes());
    if (!opened.ok()) {
        std::fprintf(stderr, "%s\n", opened.status().message().c_str());
        return 2;
    }
    std::ifstream file(argv[3]);
    const std::string body{std::istreambuf_iterator<char>(file), {}};
    bool created = false;
    const auto answer = (*opened)->submit(body, argv[4], &created);
    if (const auto* problem = std::get_if<Problem>(&answer)) {
        std::fprintf(stderr, "%s\n", problem->detail.c_str());
        return 2;
    }
    const std::string id = std::get<Job>(answer).id;
    for (;;) {
        const auto now = (*opened)->job(id);
        const Job* job = std::get_if<Job>(&now);
        if (!job) return 2;
        if (job->ended_ms != 0) {
            std::printf("%s: %d frames, %d done, %d failed; %s\n", name_of(job->state), job->frames,
                        job->done, job->failed, job->message.c_str());
            return job->state == JobState::done ? 0 : 1;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
}
