// Writes the images of corpus/picture: make_image_seeds FOLDER. Every format with its bit depths,
// packings, tiles and alpha, a few pixels each.
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <string>
#include <vector>

namespace {

using OIIO::TypeDesc;

struct Seed {
    std::string name;  // with extension
    TypeDesc type = TypeDesc::UINT8;
    int bits = 8;
    int channels = 3;
    std::vector<std::pair<std::string, std::string>> attributes = {};
    int tile = 0;
};

bool write(const std::string& folder, const Seed& seed) {
    constexpr int kWidth = 12, kHeight = 9;
    const std::string path = folder + "/valid_" + seed.name;
    OIIO::ImageSpec spec(kWidth, kHeight, seed.channels, seed.type);
    if (seed.type == TypeDesc::UINT16 || seed.type == TypeDesc::UINT8)
        spec.attribute("oiio:BitsPerSample", seed.bits);
    if (seed.channels == 4) spec.alpha_channel = 3;
    spec.tile_width = spec.tile_height = seed.tile;
    spec.attribute("oiio:UnassociatedAlpha", 1);
    for (const auto& [name, text] : seed.attributes) spec.attribute(name, text);
    std::vector<float> values;
    for (int i = 0; i < kWidth * kHeight * seed.channels; ++i)
        values.push_back(float(i * 37 % 101) / 100);
    const auto out = OIIO::ImageOutput::create(path);
    if (out && out->open(path, spec) && out->write_image(TypeDesc::FLOAT, values.data()) &&
        out->close())
        return true;
    std::fprintf(stderr, "%s: %s\n", path.c_str(), OIIO::geterror().c_str());
    return false;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_image_seeds FOLDER\n");
        return 2;
    }
    const Seed seeds[] = {
        {"8.png"},
        {"16_alpha.png", TypeDesc::UINT16, 16, 4},
        {"text.png",
         TypeDesc::UINT8,
         8,
         4,
         {{"ImageDescription", "a shot"}, {"oiio:ColorSpace", "Linear"}}},
        {"none.tif", TypeDesc::UINT8, 8, 3, {{"compression", "none"}}},
        {"lzw.tif", TypeDesc::UINT16, 16, 4, {{"compression", "lzw"}}},
        {"packbits.tif", TypeDesc::UINT8, 8, 4, {{"compression", "packbits"}}},
        {"zip.tif", TypeDesc::FLOAT, 32, 3, {{"compression", "zip"}}},
        {"half.tif", TypeDesc::HALF, 16, 4, {{"compression", "zip"}}},
        {"tiles.tif", TypeDesc::UINT8, 8, 3, {{"compression", "zip"}}, 16},
        {"8.dpx"},
        {"10.dpx", TypeDesc::UINT16, 10, 3},
        {"12.dpx", TypeDesc::UINT16, 12, 3},
        {"16_alpha.dpx", TypeDesc::UINT16, 16, 4},
        {"baseline.jpg"},
        {"progressive.jpg", TypeDesc::UINT8, 8, 3, {{"jpeg:progressive", "1"}}},
        {"rgbe.hdr", TypeDesc::FLOAT, 32, 3},
    };
    bool good = true;
    for (const Seed& seed : seeds) good = write(argv[1], seed) && good;
    return good ? 0 : 1;
}
