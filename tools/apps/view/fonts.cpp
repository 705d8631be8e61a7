#include "tools/apps/view/fonts.h"

#include <fontconfig/fontconfig.h>

#include <cmath>
#include <deque>
#include <map>

namespace postchain::view {
namespace {

constexpr const char* kFamily = "Noto Sans";
constexpr float kOwnFontPx = 13;  // of ImGui's built-in font, whose pixels are then sharp

// Latin, Greek, Cyrillic, punctuation, arrows, signs.
const ImWchar kUsual[] = {0x20,   0x24f,  0x370,  0x52f,  0x1e00, 0x1eff, 0x2010, 0x205e,
                          0x20a0, 0x20bf, 0x2190, 0x21ff, 0x2200, 0x22ff, 0};

bool is_usual(ImWchar letter) {
    for (size_t i = 0; kUsual[i]; i += 2)
        if (letter >= kUsual[i] && letter <= kUsual[i + 1]) return true;
    return false;
}

}  // namespace

FontFile font_with(const std::string& family, ImWchar letter) {
    FcPattern* wanted = FcPatternCreate();
    FcCharSet* letters = FcCharSetCreate();
    FcCharSetAddChar(letters, letter);
    FcPatternAddString(wanted, FC_FAMILY, reinterpret_cast<const FcChar8*>(family.c_str()));
    FcPatternAddCharSet(wanted, FC_CHARSET, letters);
    FcPatternAddInteger(wanted, FC_WEIGHT, FC_WEIGHT_REGULAR);
    FcPatternAddInteger(wanted, FC_SLANT, FC_SLANT_ROMAN);
    FcPatternAddBool(wanted, FC_SCALABLE, FcTrue);
    FcConfigSubstitute(nullptr, wanted, FcMatchPattern);
    FcDefaultSubstitute(wanted);
    FcResult outcome;
    FontFile font;
    if (FcPattern* found = FcFontMatch(nullptr, wanted, &outcome)) {
        FcChar8* path = nullptr;
        FcCharSet* has = nullptr;
        if (FcPatternGetString(found, FC_FILE, 0, &path) == FcResultMatch &&
            FcPatternGetCharSet(found, FC_CHARSET, 0, &has) == FcResultMatch &&
            FcCharSetHasChar(has, letter)) {
            font.path = reinterpret_cast<const char*>(path);
            FcPatternGetInteger(found, FC_INDEX, 0, &font.index);
        }
        FcPatternDestroy(found);
    }
    FcCharSetDestroy(letters);
    FcPatternDestroy(wanted);
    // The index's upper half names an instance of a variable font.
    font.index &= 0xffff;
    return font;
}

bool add_letters(const std::string& text, std::set<ImWchar>& letters) {
    bool added = false;
    for (size_t i = 0; i < text.size();) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const size_t length = lead < 0x80 ? 1 : lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
        uint32_t letter = length == 1 ? lead : lead & (0xffu >> (length + 1));
        for (size_t k = 1; k < length && i + k < text.size(); ++k)
            letter = letter << 6 | (static_cast<unsigned char>(text[i + k]) & 0x3f);
        i += length;
        // ImGui's letters have 16 bits.
        if (letter < 0x80 || letter > 0xffff || is_usual(ImWchar(letter))) continue;
        added = letters.insert(ImWchar(letter)).second || added;
    }
    return added;
}

void load_fonts(ImFontAtlas& atlas, float size_px, const std::set<ImWchar>& letters) {
    atlas.Clear();
    const float size = std::round(size_px);
    const FontFile usual = font_with(kFamily, 'a');
    ImFontConfig config;
    config.FontNo = usual.index;
    if (usual.path.empty() ||
        !atlas.AddFontFromFileTTF(usual.path.c_str(), size, &config, kUsual)) {
        config = ImFontConfig();
        config.SizePixels = std::round(size / 16 * kOwnFontPx);
        atlas.AddFontDefault(&config);
    }
    // The atlas reads the ranges when it is built.
    static std::deque<ImVector<ImWchar>> ranges;
    ranges.clear();
    std::map<std::pair<std::string, int>, ImFontGlyphRangesBuilder> fonts;
    for (const ImWchar letter : letters)
        if (const FontFile font = font_with(kFamily, letter); !font.path.empty())
            fonts[{font.path, font.index}].AddChar(letter);
    for (auto& [font, builder] : fonts) {
        ranges.emplace_back();
        builder.BuildRanges(&ranges.back());
        ImFontConfig more;
        more.MergeMode = true;
        more.FontNo = font.second;
        atlas.AddFontFromFileTTF(font.first.c_str(), size, &more, ranges.back().Data);
    }
    atlas.Build();
}

}  // namespace postchain::view
