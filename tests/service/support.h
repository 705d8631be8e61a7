// A service over a folder of small frames.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "chain/pass.h"
#include "tests/io/exr_files.h"
#include "tools/service/work/service.h"

namespace postchain::test {

// FOLDER/root/in.####.exr (frames 1..), FOLDER/root/out/, FOLDER/store.db, FOLDER/outside/.
class ServiceTest : public testing::Test {
  protected:
    void SetUp() override;

    std::string root(const std::string& name = "") const;
    std::string outside(const std::string& name = "") const;
    // A run of FXAA over all frames, with extra members: ", \"strict\": true".
    static std::string body(const std::string& more = "");

    void open();  // fails the test on errors
    void close() { service_.reset(); }
    service::ServiceSettings settings() const;

    // The id. Fails the test if the job is refused.
    std::string submit(const std::string& body);
    service::Problem refused(const std::string& body);
    service::Job job(const std::string& id) const;
    std::vector<service::JobFrame> frames(const std::string& id) const;
    service::Job ended(const std::string& id) const;  // waits
    // Waits for the image. Fails the test on a problem.
    static service::Picture picture(
        const std::function<void(std::function<void(service::Answer<service::Picture>)>)>& ask);
    // Waits until it is true; false after half a minute.
    static bool wait_for(const std::function<bool()>& what);

    TempFolder folder_;
    int attempts_ = 2;
    size_t max_queue_ = 100;
    const PassRegistry* registry_;  // the built-in passes, unless a test has its own
    std::unique_ptr<service::Service> service_;
};

}  // namespace postchain::test
