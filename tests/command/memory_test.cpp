// Memory of frames is predicted before it is allocated, and limited.
#include <gtest/gtest.h>

#include "tests/command/fixture.h"

namespace postchain::test::memory_test {
namespace {

using MemoryTest = CommandTest;

TEST_F(MemoryTest, EveryVerbThatReadsFramesHasALimit) {
    write_sequence(at(""), {1, 2});
    for (const Arguments& words :
         {Arguments{"run", at("all.yaml"), "-i", in(), "-o", out()},
          {"plan", at("all.yaml"), "-i", in()},
          {"inspect", in()},
          {"diff", in(), in()},
          {"ab", at("all.yaml"), at("fxaa.yaml"), "-i", in(), "-r", in(), "-o", at("ab")},
          {"bench", at("fxaa.yaml"), "-i", in(), "-r", in(), "-o", at("bench"), "--sweep",
           "fxaa.preset=12,39"}}) {
        SCOPED_TRACE(words[0]);
        expect_ends(run(joined(words, {"--max-memory", "10K"})), 4,
                    {"in.0001.exr", "KiB of memory", "--max-memory allows 10.0 KiB"});
    }
    expect_ends(run({"inspect", in(), "--max-memory", "8X"}), 2);
    EXPECT_EQ(outputs(), std::vector<std::string>());
}

// With room for one frame at a time, frames are processed in turn, with the same bits.
TEST_F(MemoryTest, FramesWaitForEachOther) {
    write_sequence(at(""), {1, 2, 3, 4, 5});
    ASSERT_EQ(filter("all").code, 0);
    const std::string bits = read_text(out(4));
    expect_ends(filter("all", {"--on-existing", "overwrite", "--max-memory", "250K"}), 0);
    EXPECT_EQ(read_text(out(4)), bits);
    EXPECT_EQ(outputs().size(), 5u);
}

}  // namespace
}  // namespace postchain::test::memory_test
