// postchain run --like: repeats an output from its record.
#include "tests/command/fixture.h"

namespace postchain::test::like_test {
namespace {

using LikeTest = CommandTest;

Json record_of(const std::string& path) {
    const auto file = io::ExrFile::open(path);
    EXPECT_TRUE(file.ok());
    const auto& attributes = file->parts()[0].attributes;
    const auto found = attributes.find("postchain/record");
    EXPECT_TRUE(found != attributes.end());
    return found == attributes.end() ? Json::object() : Json::parse(found->second);
}

TEST_F(LikeTest, EqualBitsFromThePictureAlone) {
    write_sequence(at(""), {1, 2, 3});
    ASSERT_EQ(filter("all", {"--set", "camera.f_stop=1.2", "--precision", "fp16"}).code, 0);
    std::filesystem::remove(at("all.yaml"));
    std::filesystem::remove(out(2) + ".json");
    expect_ends(run({"run", "--like", out(2), "-o", at("out/again.####.exr")}), 0,
                {"repeated, the same chain", "1 written of 1 frame"});
    EXPECT_EQ(read_color(at("out/again.0002.exr")).data, read_color(out(2)).data);
    const Json first = record_of(out(2)), second = record_of(at("out/again.0002.exr"));
    EXPECT_EQ(first["work"], second["work"]);
    const Json stop = first["resolved"]["camera"]["f_stop"];
    EXPECT_EQ(stop["value"], 1.2);
    EXPECT_EQ(stop["from"], "option");
    EXPECT_EQ(stop["where"], "set camera.f_stop=1.2");
    EXPECT_TRUE(contains(first["resolved"]["camera"]["focal_length_mm"]["where"].get<std::string>(),
                         "all.yaml:2"));
    EXPECT_EQ(first["settings"]["precision"], "fp16");
}

TEST_F(LikeTest, BytesDoNotDependOnHowPathsAreSpelled) {
    write_sequence(at(""), {1});
    write_text(at("camera.json"), R"({"f_stop": 2})");
    const auto bytes = [&](const std::string& folder, const std::string& to) {
        expect_ends(run({"run", folder + "all.yaml", "-i", folder + "in.####.exr", "--camera",
                         folder + "camera.json", "-o", to, "--on-existing", "overwrite"},
                        {.folder = at("")}),
                    0);
        return read_text(out(1));
    };
    const std::string whole = bytes(at(""), out());
    EXPECT_TRUE(bytes("", "out/o.####.exr") == whole);
    EXPECT_TRUE(bytes("./out/../", "./out/o.####.exr") == whole);
    EXPECT_EQ(record_of(out(1))["resolved"]["camera"]["f_stop"]["where"], at("all.yaml") + ":2");
}

TEST_F(LikeTest, WhatIsGivenOverrides) {
    write_sequence(at(""), {1, 2});
    for (const char* name : {"behind.0001.exr", "other.0001.exr"})
        std::filesystem::copy_file(in(1), at(name));
    ASSERT_EQ(
        filter("all", {"--frames", "1", "--precision", "fp16", "--behind", at("behind.####.exr")})
            .code,
        0);
    const auto again = [&](const Arguments& more, const std::vector<std::string>& words) {
        expect_ends(run(joined({"run", "--like", out(1), "-o", at("out/again.####.exr"),
                                "--on-existing", "overwrite"},
                               more)),
                    0, words);
        return record_of(at("out/again.0001.exr"));
    };
    const std::string behind = at("behind.####.exr"), other = at("other.####.exr");
    EXPECT_EQ(again({}, {"repeated"})["settings"]["behind"], behind);
    EXPECT_EQ(again({"--behind", other}, {})["settings"]["behind"], other);
    const Json record = again({"-i", in(), "--precision", "fp32", "--set", "camera.f_stop=5.6"},
                              {"chain, settings or input files differ", "2 written of 2 frames"});
    EXPECT_EQ(record["resolved"]["camera"]["f_stop"]["value"], 5.6);
    EXPECT_EQ(record["settings"].value("precision", "fp32"), "fp32");
    EXPECT_FALSE(record["settings"].contains("behind"));  // it belongs to the recorded input
    EXPECT_GT(largest_difference(read_color(at("out/again.0001.exr")), read_color(out(1))), 1e-4);
}

TEST_F(LikeTest, SaysWhatDoesNotHoldAnyMore) {
    write_sequence(at(""), {1});
    for (const char* name : {"camera.json", "same.json"}) write_text(at(name), R"({"f_stop": 2})");
    write_text(at("dof.yaml"),
               "postchain: 1\ncamera: {focal_length_mm: 50, sensor_width_mm: 36, focus_distance: 2,"
               " meters_per_unit: 0.05}\npasses: [depth_of_field]\n");
    ASSERT_EQ(filter("dof", {"--camera", at("camera.json"), "--precision", "fp16"}).code, 0);
    const auto again = [&](const Arguments& more, int code = 0) {
        const Outcome outcome = run(joined(
            {"run", "--like", out(1), "-o", at("out/again.####.exr"), "--on-existing", "overwrite"},
            more));
        EXPECT_EQ(outcome.code, code) << outcome.text();
        return outcome.text();
    };
    const auto f_stop = [&] {
        return record_of(at("out/again.0001.exr"))["resolved"]["camera"]["f_stop"]["value"];
    };
    EXPECT_TRUE(contains(again({}), "repeated"));
    EXPECT_FALSE(contains(again({}), "warning"));
    write_text(at("camera.json"), R"({"f_stop": 16})");
    EXPECT_TRUE(contains(again({}), "camera.json has changed"));
    EXPECT_EQ(f_stop(), 2);
    EXPECT_FALSE(contains(again({"--camera", at("camera.json")}), "has changed"));
    EXPECT_EQ(f_stop(), 16);
    std::filesystem::remove(at("camera.json"));
    EXPECT_TRUE(contains(again({}), "camera.json no longer exists"));
    EXPECT_EQ(f_stop(), 2);
    write_sequence(at(""), {1}, 64, 32);
    const std::string larger = again({});
    EXPECT_TRUE(contains(larger, "in.0001.exr of ") && contains(larger, "differ")) << larger;
    std::filesystem::rename(in(1), at("other.0001.exr"));
    const std::string elsewhere = again({"-i", at("other.####.exr")});
    EXPECT_FALSE(contains(elsewhere, "was made from")) << elsewhere;
    EXPECT_TRUE(contains(again({}, 4), "in.0001.exr, which no longer exists"));
    // A record of another version, with a setting that this one does not know.
    std::filesystem::rename(at("other.0001.exr"), in(1));
    std::string bytes = read_text(out(1));
    for (const char* word : {"\"precision\"", "\"version\":\""}) {
        const size_t found = bytes.find(word);
        ASSERT_NE(found, std::string::npos) << word;
        bytes[found + std::string(word).size() - (word[1] == 'p' ? 2 : 0)] = '7';
    }
    write_text(out(1), bytes);
    const std::string other = again({});
    EXPECT_TRUE(contains(other, "was made by postchain 7")) << other;
    EXPECT_TRUE(contains(other, "its setting precisio7 is unknown in this version")) << other;
}

TEST_F(LikeTest, Refusals) {
    write_sequence(at(""), {1});
    expect_ends(run({"run", "--like", in(1), "-o", out()}), 4, {"no attribute postchain/record"});
    EXPECT_EQ(run({"run", "--like", at("absent.exr"), "-o", out()}).code, 4);
    ASSERT_EQ(filter("all").code, 0);
    const auto onto = run({"run", "--like", out(1), "-o", out(), "--on-existing", "overwrite"});
    EXPECT_NE(onto.code, 0) << onto.text();
}

}  // namespace
}  // namespace postchain::test::like_test
