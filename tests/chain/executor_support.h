// Fixture of the executor's tests: plans made by hand, over shaders in a folder of their own.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "chain/gl/executor.h"
#include "tests/support/temp_folder.h"

namespace postchain::test {

class Execute : public ::testing::Test {
  protected:
    static void SetUpTestSuite();
    static void TearDownTestSuite();
    // Reads its shaders in folder_.
    static std::unique_ptr<Executor> make_executor(
        const ExecutorOptions& options = {}, const gl::Device& device = gl::describe_current());
    // color -> a -> b, each step scaling by 2 and adding the pixel's x.
    static Plan two_steps(int width, int height, Format format = Format::rgba32f);
    // color -> result: 1 in blocks whose first pixel is dark, 2 in the others.
    static Plan sorted(int width, int height);
    // -> result: one step over 7 x 5 work groups.
    static Plan counted(uint64_t group_taps);

    static std::unique_ptr<TempFolder> folder_;
    static std::unique_ptr<Executor> executor_;
};

}  // namespace postchain::test
