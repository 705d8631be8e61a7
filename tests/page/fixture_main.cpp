// page_fixture DIR: writes the report of fixture.h as DIR/index.html, as DIR/light.html with its
// images in "DIR/its images", and without a truth as DIR/blind.html; with a score of the input,
// a winner and a warning as DIR/scored.html, two variants that won and, without a truth, that did
// not as DIR/ab.html and DIR/undecided.html, and with relMSE as DIR/relative.html.
#include <cstdio>

#include "tests/page/fixture.h"
#include "tools/measure/report/page/page.h"

int main(int argc, char** argv) {
    using namespace postchain::report;
    using Make = Report (*)(const std::string&);
    if (argc != 2) return 2;
    const std::string folder = argv[1];
    const std::pair<const char*, Make> pages[] = {{"index", testing::make_report},
                                                  {"light", testing::make_report},
                                                  {"blind", testing::make_blind_report},
                                                  {"scored", testing::make_scored_report},
                                                  {"ab", testing::make_ab_report},
                                                  {"undecided", testing::make_undecided_report},
                                                  {"relative", testing::make_relative_report}};
    for (const auto& [name, make] : pages) {
        const bool beside = std::string(name) == "light";
        const auto status = write_page(make(folder), folder + "/" + name + ".html",
                                       {beside ? folder + "/its pictures" : ""});
        if (status.ok()) continue;
        std::fprintf(stderr, "%s\n", status.message().c_str());
        return 1;
    }
    return 0;
}
