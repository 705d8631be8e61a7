#include "tools/apps/common/stop_on_signal.h"

#include <unistd.h>

#include <csignal>

#include "tools/apps/common/log.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain {
namespace {

std::atomic<bool> g_stop = false;
std::atomic<int> g_signal = 0;
std::atomic<bool> g_reload = false;

void on_signal(int number) {
    if (g_stop.exchange(true)) {
        io::remove_live_temporaries();
        _exit(kExitSignal + number);
    }
    g_signal = number;
}

}  // namespace

StopOnSignal::StopOnSignal(bool reloads) {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;  // reads and writes under way must not fail
    for (int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
    if (!reloads) return;
    action.sa_handler = [](int) { g_reload = true; };
    sigaction(SIGHUP, &action, nullptr);
}

bool StopOnSignal::asked_to_reload() {
    return g_reload.exchange(false);
}

StopOnSignal::~StopOnSignal() {
    if (g_stop) io::remove_live_temporaries();
}

const std::atomic<bool>& StopOnSignal::flag() const {
    return g_stop;
}

int StopOnSignal::exit_code() const {
    return kExitSignal + g_signal;
}

int StopOnSignal::interrupted(const std::string& how_to_go_on) const {
    const char* name = g_signal == SIGINT ? "SIGINT" : g_signal == SIGTERM ? "SIGTERM" : "SIGHUP";
    log::warning(concat("interrupted (", name, "); ", how_to_go_on));
    return exit_code();
}

}  // namespace postchain
