// Pictures as reports and the service send them.
//
//   base64 --> zlib --> high bytes of all values, then the low bytes (one plane for 8-bit maps)
//          --> differences to the left (first column: to above), channel by channel --> pixels
//
// Written by tools/page/encode.cpp.

async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

export function from_base64(text) {
    const binary = atob(text.trim());
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
    return bytes;
}

// Undoes the differences. `bytes`: the inflated planes; result: interleaved, row 0 at the top.
function integrate(bytes, { width, height, channels, bits }) {
    const count = width * height * channels;
    if (bytes.length !== (count * bits) / 8)
        throw new Error(`picture holds ${bytes.length} bytes, not ${(count * bits) / 8}`);
    const wide = bits === 16;
    const out = wide ? new Uint16Array(count) : new Uint8Array(count);
    let i = 0;
    for (let c = 0; c < channels; ++c) {
        let above = 0;
        for (let y = 0; y < height; ++y) {
            let left = above;
            let to = y * width * channels + c;
            for (let x = 0; x < width; ++x, ++i, to += channels) {
                const step = wide ? (bytes[i] << 8) | bytes[count + i] : bytes[i];
                left = wide ? (left + step) & 0xffff : (left + step) & 0xff;
                out[to] = left;
                if (x === 0) above = left;
            }
        }
    }
    return out;
}

// entry: {width, height, channels, bits}
export const decode_picture = async (bytes, entry) => integrate(await inflate(bytes), entry);

// {width, height, channels, bits, data} of a file that begins with its size.
export async function picture_of_file(buffer) {
    const view = new DataView(buffer);
    if (view.byteLength < 16 || view.getUint32(0) !== 0x50504943)
        throw new Error("the reply is not a picture");
    const [width, height, channels] = [4, 8, 12].map((at) => view.getUint32(at, true));
    const entry = { width, height, channels, bits: 16 };
    return { ...entry, data: await decode_picture(new Uint8Array(buffer, 16), entry) };
}
