#include "growth.h"

#include <valgrind/callgrind.h>

#include <cstdio>
#include <ctime>
#include <iostream>
#include <map>
#include <set>

namespace postchain::growth {
namespace {

constexpr size_t kSmall = size_t(16) << 10;

void dump(const Case& one, size_t bytes, const char* size) {
    const std::string text = one.text(bytes);
    const std::string name = one.name + " | " + size;
    CALLGRIND_ZERO_STATS;
    one.run(text);
    CALLGRIND_DUMP_STATS_AT(name.c_str());
}

double seconds_of(const Case& one) {
    const std::string text = one.text(kLarge);
    const auto now = [] {
        timespec time = {};
        ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
        return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
    };
    const double began = now();
    one.run(text);
    return now() - began;
}

void print_times(const std::vector<Case>& cases) {
    std::multimap<double, std::string> times;
    for (const Case& one : cases) times.emplace(seconds_of(one), one.name);
    for (const auto& [seconds, name] : times) std::printf("%8.4f s  %s\n", seconds, name.c_str());
}

}  // namespace

int run_cases(const std::vector<Case>& cases, const std::string& what) {
    if (what == "times") {
        print_times(cases);
        return 0;
    }
    if (what != "doubled" && what != "whole") {
        std::fprintf(stderr, "expected doubled, whole or times\n");
        return 2;
    }
    std::set<std::string> named;
    for (std::string line; what == "whole" && std::getline(std::cin, line);) named.insert(line);
    for (const Case& one : cases) {
        if (what == "whole" && !named.contains(one.name)) continue;
        one.run(one.text(kSmall / 4));  // fills what is kept from call to call
        if (what == "whole") {
            dump(one, kLarge, "whole");
        } else {
            dump(one, kSmall, "once");
            dump(one, 2 * kSmall, "twice");
        }
    }
    return 0;
}

}  // namespace postchain::growth
