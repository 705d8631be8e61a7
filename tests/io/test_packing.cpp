// ZIP's byte transforms against a plain implementation, and streams of deflate against zlib.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <random>
#include <vector>

#include "tools/sequence/exr/zip.h"

namespace postchain::io {
namespace {

std::vector<uint8_t> random_bytes(size_t count) {
    std::mt19937 random(uint32_t(count) + 7);
    std::vector<uint8_t> bytes(count);
    for (uint8_t& b : bytes) b = uint8_t(random());
    return bytes;
}

// Every length around the widths of vectors, since remainders have separate code.
TEST(ZipBytes, WordsApartAndTogether) {
    for (size_t words = 0; words < 100; ++words) {
        const std::vector<uint8_t> bytes = random_bytes(2 * words);
        std::vector<uint8_t> halves(2 * words + 1, 0xee), again(2 * words + 1, 0xee);
        split_words(bytes.data(), words, halves.data(), halves.data() + words);
        for (size_t i = 0; i < words; ++i) {
            ASSERT_EQ(halves[i], bytes[2 * i]) << words;
            ASSERT_EQ(halves[words + i], bytes[2 * i + 1]) << words;
        }
        ASSERT_EQ(halves.back(), 0xee);
        join_words(halves.data(), halves.data() + words, words, again.data());
        ASSERT_TRUE(std::equal(bytes.begin(), bytes.end(), again.begin())) << words;
        ASSERT_EQ(again.back(), 0xee);
    }
}

TEST(ZipBytes, DifferencesAndBack) {
    for (size_t count = 0; count < 100; ++count) {
        const std::vector<uint8_t> bytes = random_bytes(count);
        std::vector<uint8_t> changed = bytes;
        changed.push_back(0xee);
        to_differences(changed.data(), count);
        for (size_t i = 0; i < count; ++i) {
            const int before = i == 0 ? 128 : int(bytes[i - 1]);
            ASSERT_EQ(int(changed[i]), (int(bytes[i]) - before + 128 + 256) % 256) << count;
        }
        from_differences(changed.data(), count);
        ASSERT_EQ(changed.back(), 0xee);
        changed.pop_back();
        ASSERT_EQ(changed, bytes);
    }
}

std::vector<uint8_t> text_bytes(size_t count) {
    std::vector<uint8_t> bytes = random_bytes(count);
    for (uint8_t& b : bytes) b = uint8_t(b % 5);
    return bytes;
}

const std::byte* as_bytes(const std::vector<uint8_t>& bytes) {
    return reinterpret_cast<const std::byte*>(bytes.data());
}

TEST(ZlibStream, ZlibReadsWhatIsPacked) {
    for (const size_t count : {size_t(1000), size_t(5000), size_t(300000)}) {
        const std::vector<uint8_t> bytes = text_bytes(count);
        size_t last = 0;
        for (const int level : {-1, 0, 1, 4, 9, 99}) {
            Deflater deflater(level);
            std::vector<uint8_t> packed(count + count / 100 + 100), again(count);
            const size_t size = deflater.pack(
                as_bytes(bytes), count, reinterpret_cast<std::byte*>(packed.data()), packed.size());
            uLongf got = again.size();
            ASSERT_EQ(uncompress(again.data(), &got, packed.data(), size), Z_OK) << level;
            ASSERT_EQ(got, count);
            EXPECT_EQ(again, bytes) << level;
            EXPECT_EQ(size > count, level <= 0);
            EXPECT_EQ(size<count / 2, level> 0);
            if (level == 99) {
                EXPECT_EQ(size, last);  // as 9
            }
            last = size;
        }
    }
}

TEST(ZlibStream, WhatDoesNotFitIsSaid) {
    const std::vector<uint8_t> bytes = random_bytes(4000);
    std::vector<uint8_t> packed(4000, 0xee);
    Deflater deflater(1);
    EXPECT_EQ(
        deflater.pack(as_bytes(bytes), 4000, reinterpret_cast<std::byte*>(packed.data()), 3000),
        0u);
    EXPECT_EQ(packed[3000], 0xee);
}

TEST(ZlibStream, OnlyTheWholeAndUndamagedStreamIsUnpacked) {
    const std::vector<uint8_t> bytes = text_bytes(3000);
    std::vector<uint8_t> packed(4000), again(3001, 0xee);
    uLongf size = packed.size();
    ASSERT_EQ(compress2(packed.data(), &size, bytes.data(), bytes.size(), 6), Z_OK);
    Inflater inflater;
    const auto unpack = [&](const std::vector<uint8_t>& from, size_t n, size_t count) {
        return inflater.unpack(as_bytes(from), n, reinterpret_cast<std::byte*>(again.data()),
                               count);
    };
    ASSERT_TRUE(unpack(packed, size, 3000));
    EXPECT_EQ(std::memcmp(again.data(), bytes.data(), 3000), 0);
    EXPECT_EQ(again.back(), 0xee);
    EXPECT_FALSE(unpack(packed, size, 2999));
    EXPECT_EQ(again.back(), 0xee);
    EXPECT_FALSE(unpack(packed, size, 3001));
    for (size_t n = 0; n < size; ++n) ASSERT_FALSE(unpack(packed, n, 3000)) << n;
    // The last four bytes are the Adler-32.
    for (size_t i = size - 4; i < size; ++i) {
        std::vector<uint8_t> wrong = packed;
        wrong[i] ^= 1;
        EXPECT_FALSE(unpack(wrong, size, 3000)) << i;
    }
    std::vector<uint8_t> no_zlib = packed;
    no_zlib[0] ^= 0xf;
    EXPECT_FALSE(unpack(no_zlib, size, 3000));
}

}  // namespace
}  // namespace postchain::io
