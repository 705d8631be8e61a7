// Non-EXR images, written and read back by OpenImageIO as stored, and runs over them in this
// process.
#pragma once

#include <OpenImageIO/imageio.h>

#include <array>
#include <string>
#include <vector>

#include "tests/run/fixture.h"
#include "tests/support/environment.h"

namespace postchain::test {

struct Stored {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;  // integers divided by their type's maximum
};

struct Kind {
    const char* file;
    OIIO::TypeDesc type;
    int bits;
    int channels;
    bool unassociated = false;
    const char* space = "";
};
constexpr auto kByte = OIIO::TypeDesc::UINT8;
constexpr auto kShort = OIIO::TypeDesc::UINT16;
constexpr auto kFloat = OIIO::TypeDesc::FLOAT;

// Contains every 8- and 10-bit code, and a sixth of the 16-bit codes.
Stored noise_of(const Kind& kind, int width = 96, int height = 64);
void write_picture(const std::string& path, const Kind& kind, const Stored& picture);
// In the file's own type, alpha as stored.
Stored read_picture(const std::string& path, OIIO::ImageSpec* spec = nullptr);

// How a run ends, and what the command would print of it.
struct RunOutcome {
    int code = 0;
    std::string said;

    bool says(const std::string& words) const {
        return as_options(said).find(words) != std::string::npos;
    }
};

// Runs of a chain without passes from in_name to out/out_name.
class FormatsTest : public sequence::SequenceTest {
  protected:
    using Words = std::vector<std::string>;
    void SetUp() override {
        SequenceTest::SetUp();
        set_variable("OCIO", "");
    }
    // Options of the command, by the table of job settings.
    RunOutcome run(const Words& words);
    RunOutcome through(const std::string& in_name, const std::string& out_name, Words more = {}) {
        Words words = {"--input",       at(in_name), "--output", at("out/" + out_name),
                       "--on-existing", "overwrite"};
        words.insert(words.end(), more.begin(), more.end());
        return run(words);
    }
    bool exists(const std::string& path) const { return std::filesystem::exists(path); }
    // An EXR of one row: R, G, B, A of each pixel.
    void write_exr(const std::string& name, const std::vector<std::array<float, 4>>& pixels) {
        ImageF image(int(pixels.size()), 1, 4);
        for (size_t i = 0; i < pixels.size(); ++i)
            for (int c = 0; c < 4; ++c) image.at(int(i), 0, c) = pixels[i][size_t(c)];
        ASSERT_TRUE(
            io::write_planes_exr(at(name), image, {"R", "G", "B", "A"}, io::OnExisting::overwrite)
                .ok());
    }
    nlohmann::json sidecar_of(const std::string& out_name) const {
        return nlohmann::json::parse(read_text(at("out/" + out_name + ".json")));
    }
};

}  // namespace postchain::test
