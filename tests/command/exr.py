"""Reads and writes EXR files of one part in plain Python, apart from OpenEXR: scanlines, no or ZIP
compression, half and float channels. Source: OpenEXR File Layout; murmur3: Appleby, public domain.
"""
import struct
import zlib

_SIZES = {1: (2, "e"), 2: (4, "f")}  # per pixel type: bytes, struct letter
_LINES = {0: 1, 2: 1, 3: 16}         # lines per chunk: no compression, ZIPS, ZIP


class Picture:
    """attributes: name -> (type, bytes). channels: name -> (letter of its type, list of values)."""

    def __init__(self, width, height, attributes, channels):
        self.width, self.height = width, height
        self.attributes, self.channels = attributes, channels

    def text(self, name):
        return self.attributes[name][1].decode()

    def values(self, name):
        return self.channels[name][1]

    def raw(self, name):
        letter, values = self.channels[name]
        return struct.pack(f"<{len(values)}{letter}", *values)

    def words(self, name):
        """Bits of a float channel as integers."""
        values = self.values(name)
        return struct.unpack(f"<{len(values)}I", struct.pack(f"<{len(values)}f", *values))


def flat(width, height, channels):
    """A picture of these float channels in its own display window. channels: name -> list of values."""
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return Picture(width, height, {
        "dataWindow": ("box2i", window), "displayWindow": ("box2i", window), "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)), "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1))},
        {name: ("f", values) for name, values in channels.items()})


def _text(data, at):
    end = data.index(0, at)
    return data[at:end].decode(), end + 1


def _unpacked(data, size):
    if len(data) == size:
        return data
    data = bytearray(zlib.decompress(data))
    for i in range(1, len(data)):
        data[i] = (data[i - 1] + data[i] - 128) & 255
    half = (len(data) + 1) // 2
    out = bytearray(len(data))
    out[0::2], out[1::2] = data[:half], data[half:]
    return bytes(out)


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    assert data[:4] == b"\x76\x2f\x31\x01" and data[5] & 0x1a == 0, path
    at, attributes = 8, {}
    while data[at]:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = kind, data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = right - left + 1, bottom - top + 1
    listed, where, table = attributes["channels"][1], 0, []
    while listed[where]:
        name, where = _text(listed, where)
        table.append((name, struct.unpack_from("<i", listed, where)[0]))
        where += 16
    row_bytes = sum(_SIZES[kind][0] for _, kind in table) * width
    lines = _LINES[attributes["compression"][1][0]]
    channels = {name: (_SIZES[kind][1], [0.0] * (width * height)) for name, kind in table}
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        first, size = struct.unpack_from("<ii", data, offset)
        count = min(lines, bottom + 1 - first)
        pixels, place = _unpacked(data[offset + 8:offset + 8 + size], count * row_bytes), 0
        for y in range(first - top, first - top + count):
            for name, kind in table:
                size, letter = _SIZES[kind]
                channels[name][1][y * width:(y + 1) * width] = struct.unpack_from(
                    f"<{width}{letter}", pixels, place)
                place += size * width
    return Picture(width, height, attributes, channels)


def write(path, picture):
    """Writes uncompressed channels, in alphabetical order as EXR requires."""
    names = sorted(picture.channels)
    kinds = {letter: kind for kind, (_, letter) in _SIZES.items()}
    listed = b"".join(name.encode() + struct.pack("<xiiii", kinds[picture.channels[name][0]], 0, 1,
                                                  1) for name in names) + b"\0"
    attributes = dict(picture.attributes, channels=("chlist", listed),
                      compression=("compression", b"\0"))
    header = b"\x76\x2f\x31\x01\x02" + bytes([4 if any(len(n) > 31 for n in names + list(
        attributes)) else 0, 0, 0])
    for name, (kind, value) in attributes.items():
        header += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value))
        header += value
    header += b"\0"
    _, top, _, _ = struct.unpack("<4i", attributes["dataWindow"][1])
    rows = []
    for y in range(picture.height):
        row = b"".join(struct.pack(f"<{picture.width}{picture.channels[n][0]}",
                                   *picture.values(n)[y * picture.width:(y + 1) * picture.width])
                       for n in names)
        rows.append(struct.pack("<ii", top + y, len(row)) + row)
    first = len(header) + 8 * picture.height
    offsets = struct.pack(f"<{picture.height}Q", *(first + y * len(rows[0])
                                                   for y in range(picture.height)))
    with open(path, "wb") as file:
        file.write(header + offsets + b"".join(rows))


def crypto_id(name):
    """Id of a name: MurmurHash3_32, with an exponent of neither all zeros nor all ones."""
    data, hashed, mask = name.encode(), 0, 0xffffffff

    def turned(value, by):
        return (value << by | value >> 32 - by) & mask

    def mixed(block):
        return turned(block * 0xcc9e2d51 & mask, 15) * 0x1b873593 & mask

    whole = len(data) // 4 * 4
    for at in range(0, whole, 4):
        hashed = turned(hashed ^ mixed(int.from_bytes(data[at:at + 4], "little")), 13)
        hashed = (hashed * 5 + 0xe6546b64) & mask
    if data[whole:]:
        hashed ^= mixed(int.from_bytes(data[whole:], "little"))
    hashed ^= len(data)
    hashed = (hashed ^ hashed >> 16) * 0x85ebca6b & mask
    hashed = (hashed ^ hashed >> 13) * 0xc2b2ae35 & mask
    hashed ^= hashed >> 16
    return hashed ^ 1 << 23 if hashed >> 23 & 255 in (0, 255) else hashed


def matte(picture, layer, name):
    """Coverage of a name's id, summed over all ranks."""
    wanted, total, level = crypto_id(name), [0.0] * (picture.width * picture.height), 0
    while f"{layer}{level:02}.r" in picture.channels:
        for rank in ("rg", "ba"):
            ids = picture.words(f"{layer}{level:02}.{rank[0]}")
            coverages = picture.values(f"{layer}{level:02}.{rank[1]}")
            total = [t + (c if i == wanted else 0) for t, i, c in zip(total, ids, coverages)]
        level += 1
    return total
