// Memory of frames, and the number of frames admitted at a time.
#include "tools/sequence/source/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "tests/command/frames.h"
#include "tools/sequence/exr/worker_pool.h"

namespace postchain::sequence {
namespace {

TEST(Memory, SizesAreReadAndWritten) {
    for (const auto& [text, bytes] : {std::pair<const char*, uint64_t>{"1", 1},
                                      {"4096", 4096},
                                      {"4096B", 4096},
                                      {"8G", 8ull << 30},
                                      {"8 GiB", 8ull << 30},
                                      {"500m", 500ull << 20},
                                      {"1.5GB", 3ull << 29},
                                      {"2T", 2ull << 40},
                                      {"64KiB", 65536}}) {
        const auto read = parse_bytes(text);
        ASSERT_TRUE(read.ok()) << text;
        EXPECT_EQ(*read, bytes) << text;
    }
    for (const char* text : {"", "G", "0", "0G", "0.9", "-1G", "8X", "8GG", "1e300", "nan", "8G8"})
        EXPECT_EQ(parse_bytes(text).status().code(), StatusCode::usage) << text;
    EXPECT_EQ(bytes_text(500), "500 bytes");
    EXPECT_EQ(bytes_text(6657199309), "6.2 GiB");
    EXPECT_GT(default_memory_limit(), uint64_t(100) << 20);
}

TEST(Memory, OfAFrameByItsChannels) {
    test::TempFolder folder;
    test::write_frame(folder.path("f.exr"), test::make_planes(40, 30));
    const SourceSettings settings;
    auto header = open_source_frame(settings, {{Role::color, folder.path("f.exr")}}, 1);
    ASSERT_TRUE(header.ok());
    const uint64_t pixels = 40 * 30;
    // Float color: as stored, and as a plane.
    EXPECT_EQ(frame_bytes(*header, {Role::color}, io::Keep::nothing, 30), pixels * (16 + 16));
    EXPECT_EQ(frame_bytes(*header, {Role::color}, io::Keep::nothing, 3), pixels / 10 * (16 + 16));
    EXPECT_EQ(frame_bytes(*header, {Role::color, Role::inverse_depth}, io::Keep::nothing, 30),
              pixels * (16 + 16 + 4 + 4));
    // Written back: also all nine channels as stored, the result, and the result as stored.
    EXPECT_EQ(frame_bytes(*header, {Role::color}, io::Keep::all, 30),
              pixels * (16 + 16 + 36 + 16 + 16));
}

TEST(Memory, OfMattesAndLayers) {
    test::TempFolder folder;
    test::write_frame(folder.path("f.exr"), test::make_planes(40, 30));
    auto header = open_source_frame({}, {{Role::color, folder.path("f.exr")}}, 1);
    ASSERT_TRUE(header.ok());
    const auto bytes = [&](RoleSet present) {
        return frame_bytes(*header, present, io::Keep::nothing, 30);
    };
    const uint64_t alone = bytes({Role::color}), pixels = 40 * 30;
    header->layers.mattes.resize(2);
    header->layers.filtered.resize(3);
    EXPECT_EQ(bytes({Role::color}), alone);
    EXPECT_EQ(bytes({Role::color, Role::mattes}), alone + 2 * pixels * 4);
    EXPECT_EQ(bytes({Role::color, Role::layers}), alone + 3 * pixels * 16);
    // A cryptomatte of six ranks (an id and a coverage each), as read and as filtered, and the
    // layers of a chunk of ids: 32 of so few pixels, as read and as filtered.
    header->layers.cryptomattes.resize(2);
    for (auto& cryptomatte : header->layers.cryptomattes) cryptomatte.levels.resize(3);
    header->layers.filtered_cryptomattes = 1;
    EXPECT_EQ(bytes({Role::color}), alone);
    EXPECT_EQ(bytes({Role::color, Role::layers}),
              alone + 3 * pixels * 16 + 2 * pixels * 6 * 8 + 2 * 32 * pixels * 16);
    header->layers.filtered_cryptomattes = 0;
    // Written back: the layers first together and then separately, and with a fill mask both
    // beside the mask, which is kept as read and as filtered.
    const auto kept = [&] {
        return frame_bytes(*header, {Role::color, Role::layers}, io::Keep::all, 30);
    };
    const uint64_t written = pixels * (16 + 16 + 36 + 16 + 16);
    EXPECT_EQ(kept(), written + 3 * 3 * pixels * 16);
    header->layers.fill_mask = "fill";
    EXPECT_EQ(kept(), written + 4 * 3 * pixels * 16 + 2 * pixels * 16);
    // A larger window: all its channels again, and their color.
    header->layers = {};
    const io::Window own = header->window;
    header->window.max_x += 4;
    const uint64_t grown = uint64_t(own.width() + 4) * 30;
    EXPECT_EQ(frame_bytes(*header, {Role::color}, io::Keep::all, 30),
              grown * 16 + pixels * (16 + 36) + grown * 16 + grown * (36 + 16));
}

TEST(Memory, LayersAtOnceAreFewerOfLargerImages) {
    const uint64_t one_layer = uint64_t(3) << 23;  // pixels that fill the budget alone
    for (const auto& [pixels, layers] : {std::pair(uint64_t(1), 32),
                                         {one_layer / 32, 32},
                                         {one_layer / 31, 31},
                                         {one_layer / 2, 2},
                                         {one_layer / 2 + 1, 1},
                                         {one_layer * 9, 1}})
        EXPECT_EQ(layers_at_once(pixels), layers) << pixels;
}

// Each thread flattens a chunk of its own.
TEST(Memory, OfADeepFrameByItsChunks) {
    io::WorkerPool::shared().set_threads(3);
    EXPECT_GT(io::WorkerPool::shared().slots(), 1u);
    test::TempFolder folder;
    const std::string path = folder.path("f.exr");
    test::FilePart part{.channels = {{"A"}, {"B"}, {"G"}, {"R"}, {"Z", Imf::FLOAT}},
                        .compression = Imf::ZIPS_COMPRESSION};
    uint64_t bytes[2];
    for (const bool deep : {false, true}) {
        part.deep = deep;
        part.samples = [](int, int, size_t) { return std::vector<float>(3, 1); };
        test::write_file(path, {part});
        const auto header = open_source_frame({}, {{Role::color, path}}, 1);
        ASSERT_TRUE(header.ok()) << header.status().message();
        const uint64_t chunk = header->files.color_file().parts()[0].flattening_bytes;
        EXPECT_EQ(chunk > 0, deep);
        bytes[deep] = frame_bytes(*header, {Role::color}, io::Keep::nothing, 9) -
                      chunk * io::WorkerPool::shared().slots();
    }
    EXPECT_EQ(bytes[0], bytes[1]);
    io::WorkerPool::shared().set_threads(1);
}

TEST(Memory, WhatIsTooMuchIsRefused) {
    EXPECT_TRUE(check_memory("f.exr", 1 << 20, 0).ok());
    EXPECT_TRUE(check_memory("f.exr", 1 << 20, 1 << 20).ok());
    const Status status = check_memory("f.exr", 3 << 20, 2 << 20);
    EXPECT_EQ(status.code(), StatusCode::memory);
    for (const auto& word : std::vector<std::string>{"f.exr", "3.0 MiB", "2.0 MiB",
                                                     "{max_memory}"_keyed, "raise the limit"})
        EXPECT_THAT(status.message(), testing::HasSubstr(word));
}

TEST(Memory, OfControlGroupsAndThoseAroundThem) {
    test::TempFolder folder;
    namespace fs = std::filesystem;
    const std::string mounted = folder.path("cgroup"), groups = folder.path("groups");
    const auto write = [](const std::string& path, const std::string& text) {
        fs::create_directories(fs::path(path).parent_path());
        std::ofstream(path) << text;
    };
    const auto limit = [&](const std::string& text) {
        write(groups, text);
        return memory_of_groups(groups, mounted);
    };
    // Version 2.
    write(mounted + "/system.slice/memory.max", "8000\n");
    write(mounted + "/system.slice/a.service/memory.max", "max\n");
    write(mounted + "/system.slice/b.service/memory.max", "500\n");
    EXPECT_EQ(limit("0::/system.slice/a.service\n"), 8000u);
    EXPECT_EQ(limit("0::/system.slice/b.service\n"), 500u);
    EXPECT_EQ(limit("0::/other\n"), 0u);
    EXPECT_EQ(limit("0::/\n"), 0u);
    write(mounted + "/memory.max", "7000\n");
    EXPECT_EQ(limit("0::/\n"), 7000u);
    EXPECT_EQ(limit("0::/not/mounted/here\n"), 7000u) << "in a container";
    // Version 1.
    write(mounted + "/memory/jobs/memory.limit_in_bytes", "600\n");
    EXPECT_EQ(limit("5:cpu,cpuacct:/jobs\n4:memory:/jobs/one\n"), 600u);
    EXPECT_EQ(limit("5:cpu,cpuacct:/jobs\n"), 0u);
    EXPECT_EQ(memory_of_groups(folder.path("none"), mounted), 0u);
}

TEST(Memory, TheGateIsFullAtItsLimit) {
    ::alarm(60);  // a gate that lets in less waits forever
    MemoryGate gate(10), without_limit(0);
    for (const uint64_t bytes : {6u, 4u}) gate.enter(bytes);
    std::atomic<bool> inside = false;
    std::thread last([&] {
        gate.enter(1);
        inside = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_FALSE(inside) << "11 of 10 bytes";
    gate.leave(4);
    last.join();
    for (const uint64_t bytes : {uint64_t(1) << 62, uint64_t(1) << 61}) without_limit.enter(bytes);
    ::alarm(0);
}

TEST(Memory, TheGateLetsInWhatFits) {
    MemoryGate gate(10);
    std::atomic<int> inside = 0, most = 0, most_alone = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&, bytes = uint64_t(i % 4 == 0 ? 20 : 4)] {
            for (int round = 0; round < 200; ++round) {
                gate.enter(bytes);
                const int now = ++inside;
                if (now > most) most = now;
                if (bytes == 20 && now > most_alone) most_alone = now;
                std::this_thread::yield();
                --inside;
                gate.leave(bytes);
            }
        });
    for (auto& thread : threads) thread.join();
    EXPECT_LE(most, 2);        // of 4 bytes each
    EXPECT_EQ(most_alone, 1);  // of more than the gate holds
}

}  // namespace
}  // namespace postchain::sequence
