// Memory of frames is predicted before it is allocated, and limited.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfOutputFile.h>
#include <gtest/gtest.h>
#include <half.h>

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

// 2048 x 16384 pixels in a few hundred kilobytes; uncompressed, color takes 768 MiB.
TEST_F(MemoryTest, InspectTakesNoMoreOfATallFrame) {
    const int width = 2048, height = 16384;
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    std::vector<half> row(size_t(width), half(0.5f));
    Imf::FrameBuffer buffer;
    for (const char* name : {"R", "G", "B", "A"}) {
        header.channels().insert(name, Imf::Channel(Imf::HALF));
        buffer.insert(name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(row.data()), 2, 0));
    }
    {
        Imf::OutputFile file(in(1).c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(height);
    }
    const auto outcome = run({"inspect", in(1)});
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_TRUE(contains(outcome.out, "memory_to_filter: 2.0 GiB")) << outcome.out;
    if (!POSTCHAIN_SANITIZED) {
        EXPECT_LT(outcome.peak_kib, 400 << 10);
    }
}

}  // namespace
}  // namespace postchain::test::memory_test
