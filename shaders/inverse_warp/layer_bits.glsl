// Sets of extra layers: a bit for each, 32 to a word.

int words_of(sampler2DArray layers) {
    return (textureSize(layers, 0).z + 31) / 32;
}

// The bits of a word that stand for a layer.
uint bits_of_word(sampler2DArray layers, int word) {
    const int left = textureSize(layers, 0).z - 32 * word;
    return left >= 32 ? 0xffffffffu : (1u << left) - 1u;
}

// Takes the first layer out of a word.
int next_layer(inout uint bits, int word) {
    const int bit = findLSB(bits);
    bits &= bits - 1u;
    return 32 * word + bit;
}
