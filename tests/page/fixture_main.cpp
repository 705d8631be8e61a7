// page_fixture DIR: writes the report of fixture.h as DIR/index.html, as DIR/light.html with its
// images in "DIR/its images", and without a truth as DIR/blind.html; with a score of the input,
// a winner and a warning as DIR/scored.html, two variants that won and that did not as DIR/ab.html
// and DIR/undecided.html, and with relMSE as DIR/relative.html.
#include <cstdio>

#include "tests/page/fixture.h"
#include "tools/measure/report/page/page.h"

int main(int argc, char** argv) {
    using namespace postchain::report;
    if (argc != 2) return 2;
    const std::string folder = argv[1];
    const Report report = testing::make_report(folder);
    auto status = write_page(report, folder + "/index.html");
    if (status.ok())
        status = write_page(report, folder + "/light.html", {folder + "/its pictures"});
    if (status.ok())
        status = write_page(testing::make_blind_report(folder), folder + "/blind.html");
    if (status.ok())
        status = write_page(testing::make_scored_report(folder), folder + "/scored.html");
    if (status.ok()) status = write_page(testing::make_ab_report(folder), folder + "/ab.html");
    if (status.ok())
        status = write_page(testing::make_undecided_report(folder), folder + "/undecided.html");
    if (status.ok())
        status = write_page(testing::make_relative_report(folder), folder + "/relative.html");
    if (status.ok()) return 0;
    std::fprintf(stderr, "%s\n", status.message().c_str());
    return 1;
}
