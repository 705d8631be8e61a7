// Appends to POSTCHAIN_REACHED_BY what each test of a GoogleTest program has reached, the processes
// that it starts included: "SUITE.NAME MILLISECONDS FAILED POINT:SEEN ...".
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>

#include "tests/mutants/points/fault_point.h"

namespace {

class Listener : public testing::EmptyTestEventListener {
    void OnTestStart(const testing::TestInfo&) override {
        std::memset(postchain::fault_point::reached, 0, postchain::fault_point::kMaxPoints);
    }
    void OnTestEnd(const testing::TestInfo& test) override {
        std::ofstream out(std::getenv("POSTCHAIN_REACHED_BY"), std::ios::app);
        out << test.test_suite_name() << '.' << test.name() << ' ' << test.result()->elapsed_time()
            << ' ' << test.result()->Failed();
        for (int point = 0; point < postchain::fault_point::kMaxPoints; ++point)
            if (const int what = postchain::fault_point::reached[point])
                out << ' ' << point << ':' << what;
        out << '\n';
    }
};

const bool added = [] {
    if (!std::getenv("POSTCHAIN_REACHED_BY")) return false;
    testing::UnitTest::GetInstance()->listeners().Append(new Listener);
    return true;
}();

}  // namespace
