#!/usr/bin/env python3
"""Writes the pictures of this folder: kinds of files that the crate `image` does not write.

    pip install pillow==13.0.0
    python make_pictures.py

All are of 20×18 pixels or smaller, so that a decoder needs some microseconds for each. Pillow writes the compressed ones;
the others are written here, byte by byte.
"""

import io
import struct
import zlib
from pathlib import Path

from PIL import Image

HERE = Path(__file__).resolve().parent / "pictures"
WIDTH, HEIGHT = 20, 12


def color(x, y):
    return (x * 12 % 256, y * 20 % 256, x * y % 256)


def picture(size=(WIDTH, HEIGHT)):
    made = Image.new("RGB", size)
    made.putdata([color(x, y) for y in range(size[1]) for x in range(size[0])])
    return made


def by_pillow(name, made, kind, **options):
    file = io.BytesIO()
    made.save(file, kind, **options)
    keep(name, file.getvalue())


def keep(name, content):
    assert len(content) < 2000, (name, len(content))
    (HERE / name).write_bytes(content)


# TIFF.

SHORT, LONG, FLOAT = 3, 4, 11
SIZES = {SHORT: 2, LONG: 4, FLOAT: 4}
NEW_SUBFILE, OLD_SUBFILE, ORIENTATION, SUB_DIRECTORIES = 254, 255, 274, 330


def page(size, channels, samples, bits=8, photometric=None, compression=1, chunks=None, tags=None, further=()):
    """A page: its tags, the bytes of its strips (or tiles), and its subdirectories."""
    if photometric is None:
        photometric = 1 if channels == 1 else 2
    chunks = [samples] if chunks is None else chunks
    all_tags = {
        256: (SHORT, [size[0]]),
        257: (SHORT, [size[1]]),
        258: (SHORT, [bits] * channels),
        259: (SHORT, [compression]),
        262: (SHORT, [photometric]),
        277: (SHORT, [channels]),
    }
    all_tags.update(tags or {})
    if 322 not in all_tags:
        all_tags.setdefault(278, (SHORT, [size[1]]))
    return all_tags, chunks, list(further)


def tiff(pages, order="<", is_big=False):
    """The file with these pages in a chain. `order` is struct's sign of the byte order; BigTIFF has 64 bits."""
    offset = "Q" if is_big else "L"
    pack = lambda form, *values: struct.pack(order + form, *values)
    header = {"<": b"II", ">": b"MM"}[order] + (pack("HHH", 43, 8, 0) if is_big else pack("H", 42))
    file = bytearray(header + pack(offset, 0))
    room = struct.calcsize(order + offset)

    def value(kind, values):
        return pack({SHORT: "H", LONG: "L", FLOAT: "f"}[kind] * len(values), *values)

    def directory(a_page):
        """Appends a page; returns its position and that of the link to the next one."""
        tags, chunks, further = a_page
        tags = dict(tags)
        sub_directories = [directory(one)[0] for one in further]
        if sub_directories:
            tags[SUB_DIRECTORIES] = (LONG, sub_directories)
        places = []
        for chunk in chunks:
            places.append(len(file))
            file.extend(chunk + b"\0" * (len(chunk) % 2))
        offsets, counts = (324, 325) if 322 in tags else (273, 279)
        tags[offsets], tags[counts] = (LONG, places), (LONG, [len(chunk) for chunk in chunks])
        entries = bytearray()
        for tag in sorted(tags):
            kind, values = tags[tag]
            data = value(kind, values)
            entries += pack("HH", tag, kind) + pack(offset, len(values))
            if len(data) <= room:
                entries += data + b"\0" * (room - len(data))
            else:
                entries += pack(offset, len(file))
                file.extend(data)
        at = len(file)
        file.extend(pack("Q" if is_big else "H", len(tags)) + entries + pack(offset, 0))
        return at, len(file) - room

    link = len(header)
    for a_page in pages:
        at, next_link = directory(a_page)
        file[link : link + room] = pack(offset, at)
        link = next_link
    return bytes(file)


def rgb_bytes(width, height):
    return bytes(value for y in range(height) for x in range(width) for value in color(x, y))


def tiffs():
    small, large = (3, 2), (8, 6)
    thumbnail = page(small, 3, rgb_bytes(*small), tags={NEW_SUBFILE: (LONG, [1])})
    turned = page(large, 3, rgb_bytes(*large), tags={NEW_SUBFILE: (LONG, [0]), ORIENTATION: (SHORT, [6])})
    mask = page(large, 1, bytes(48), tags={NEW_SUBFILE: (LONG, [4])})
    keep("pages.tif", tiff([thumbnail, turned, mask]))
    old = page(small, 3, rgb_bytes(*small), tags={OLD_SUBFILE: (SHORT, [2])})
    keep("old-thumbnail.tif", tiff([old, page(large, 3, rgb_bytes(*large))], ">"))
    whole = page(large, 3, rgb_bytes(*large), tags={NEW_SUBFILE: (LONG, [0])})
    with_whole = page(small, 3, rgb_bytes(*small), tags={NEW_SUBFILE: (LONG, [1])}, further=[whole])
    keep("subdirectory.tif", tiff([with_whole], ">"))

    # All red values, then green and blue; the decoder reads eight bits per index and needs no more colours.
    colors = [(index * 4000 + channel * 900) % 65536 for channel in range(3) for index in range(16)]
    indices = bytes((x + y) % 16 for y in range(6) for x in range(8))
    palette = page(large, 1, indices, photometric=3, tags={320: (SHORT, colors)})
    keep("palette.tif", tiff([palette]))
    keep("palette-big.tif", tiff([thumbnail, palette], ">", is_big=True))

    # Strips of two rows, in which each sample is stored as the difference from the one on its left.
    rows = []
    for y in range(6):
        row = [color(x, y) for x in range(8)]
        before = [(0, 0, 0)] + row[:-1]
        rows.append(bytes((value - last) % 256 for one, other in zip(row, before) for value, last in zip(one, other)))
    strips = [zlib.compress(rows[y] + rows[y + 1]) for y in (0, 2, 4)]
    keep("strips-deflate.tif", tiff([page(large, 3, b"", compression=8, chunks=strips, tags={278: (SHORT, [2]), 317: (SHORT, [2])})]))

    # Two by two tiles of 16×16 pixels, the right and lower ones partly outside.
    size = (20, 18)
    tiles = []
    for top in (0, 16):
        for left in (0, 16):
            inside = [(color(x, y) if x < size[0] and y < size[1] else (0, 0, 0)) for y in range(top, top + 16) for x in range(left, left + 16)]
            tiles.append(zlib.compress(bytes(value for one in inside for value in one)))
    tiled = page(size, 3, b"", compression=8, chunks=tiles, tags={322: (SHORT, [16]), 323: (SHORT, [16])})
    keep("tiles-deflate.tif", tiff([tiled], ">"))

    planes = [bytes(color(x, y)[channel] for y in range(6) for x in range(8)) for channel in range(3)]
    keep("planar.tif", tiff([page(large, 3, b"", chunks=planes, tags={284: (SHORT, [2])})]))
    inks = bytes(value for y in range(6) for x in range(8) for value in (*color(x, y), 3 * x))
    keep("inks.tif", tiff([page(large, 4, inks, photometric=5)]))
    deep_inks = struct.pack(">192H", *(257 * value for value in inks))
    keep("inks-16.tif", tiff([page(large, 4, deep_inks, bits=16, photometric=5)], ">"))
    # Ten bits in sixteen, as industrial cameras store them.
    keep("grey-10.tif", tiff([page(large, 1, struct.pack(">48H", *range(100, 580, 10)), bits=16)], ">"))
    keep("grey-white-is-zero.tif", tiff([page(large, 1, bytes(range(48)), photometric=0)]))
    floats = [value * 4.0 for value in rgb_bytes(4, 3)]
    float_tags = {339: (SHORT, [3] * 3)}
    keep("floats-10.tif", tiff([page((4, 3), 3, struct.pack("<36f", *floats), bits=32, tags=float_tags)]))
    shares = [value / 255 for pixel in range(12) for value in (20 * pixel, 9 * pixel, 77, 200)]
    alpha_tags = {338: (SHORT, [2]), 339: (SHORT, [3] * 4)}
    keep("floats-alpha.tif", tiff([page((4, 3), 4, struct.pack("<48f", *shares), bits=32, tags=alpha_tags)]))

    by_pillow("lzw.tif", picture(), "TIFF", compression="tiff_lzw")
    by_pillow("packbits.tif", picture().convert("L"), "TIFF", compression="packbits")
    by_pillow("fax.tif", picture().convert("1"), "TIFF", compression="group4")
    by_pillow("jpeg.tif", picture().convert("L"), "TIFF", compression="jpeg", quality=50)


# PNG.


def png(name, size, bits, kind, samples, palette=b"", transparency=b"", is_interlaced=False):
    """`samples` gives the values of a pixel."""
    width, height = size

    def packed(pixels):
        if bits == 16:
            return struct.pack(f">{len(pixels)}H", *pixels)
        if bits == 8:
            return bytes(pixels)
        text = "".join(f"{value:0{bits}b}" for value in pixels)
        text += "0" * (-len(text) % 8)
        return bytes(int(text[at : at + 8], 2) for at in range(0, len(text), 8))

    def rows(xs, ys):
        return b"".join(b"\0" + packed([value for x in xs for value in samples(x, y)]) for y in ys if len(xs) > 0)

    if is_interlaced:
        passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
        data = b"".join(rows(range(x, width, dx), range(y, height, dy)) for x, y, dx, dy in passes)
    else:
        data = rows(range(width), range(height))

    def chunk(tag, content):
        return struct.pack(">L", len(content)) + tag + content + struct.pack(">L", zlib.crc32(tag + content))

    header = struct.pack(">LLBBBBB", width, height, bits, kind, 0, 0, int(is_interlaced))
    chunks = [chunk(b"IHDR", header)]
    chunks += [chunk(b"PLTE", palette)] if palette else []
    chunks += [chunk(b"tRNS", transparency)] if transparency else []
    chunks += [chunk(b"IDAT", zlib.compress(data, 9)), chunk(b"IEND", b"")]
    keep(name, b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def pngs():
    size = (11, 7)
    grey, rgb, indexed, grey_alpha, rgb_alpha = 0, 2, 3, 4, 6
    colors = bytes(value for index in range(16) for value in (index * 15, 255 - index * 9, index * index))
    index = lambda x, y: ((x + y) % 16,)
    png("palette.png", size, 4, indexed, index, palette=colors)
    png("palette-alpha.png", size, 8, indexed, index, palette=colors, transparency=bytes([0, 90, 255]))
    png("palette-interlaced.png", size, 2, indexed, lambda x, y: ((x + y) % 4,), palette=colors[:12], is_interlaced=True)
    png("interlaced.png", size, 8, rgb, color, is_interlaced=True)
    png("bits.png", size, 1, grey, lambda x, y: ((x * y) % 2,))
    png("grey-10.png", size, 16, grey, lambda x, y: (90 * x + y,))
    png("grey-dark.png", size, 16, grey, lambda x, y: (257 * ((x + y) % 15),))
    png("grey-alpha-12.png", size, 16, grey_alpha, lambda x, y: (370 * x + y, 65535))
    png("rgb-12.png", size, 16, rgb, lambda x, y: tuple(16 * value for value in color(x, y)))
    png("rgb-key.png", size, 8, rgb, color, transparency=struct.pack(">3H", *color(2, 1)))
    png("rgba-10.png", size, 16, rgb_alpha, lambda x, y: (*(4 * value for value in color(x, y)), 6553 * y))
    png("alpha-unset.png", size, 8, rgb_alpha, lambda x, y: (*color(x, y), y % 2))


# BMP.


def bmp(name, bits, compression, pixels, colors=b"", masks=b""):
    start = 14 + 40 + len(masks) + len(colors)
    header = struct.pack("<LllHHLLllLL", 40, 6, 4, 1, bits, compression, len(pixels), 2835, 2835, len(colors) // 4, 0)
    keep(name, b"BM" + struct.pack("<LHHL", start + len(pixels), 0, 0, start) + header + masks + colors + pixels)


def bmps():
    colors = bytes(value for index in range(16) for value in (index * 16, 255 - index * 16, index * 5, 0))
    bmp("palette.bmp", 8, 0, bytes((x + y) % 16 for y in range(4) for x in (0, 1, 2, 3, 4, 5, 0, 0)), colors)
    bmp("palette-4.bmp", 4, 0, bytes([0x12, 0x34, 0x56, 0]) * 4, colors)
    # A run, literal pixels with a filling byte, a jump, a run beside the end of a line, and the end.
    runs = bytes([6, 3, 0, 0, 0, 3, 1, 2, 3, 0, 3, 7, 0, 0, 0, 2, 2, 0, 4, 9, 0, 0, 6, 1, 0, 1])
    bmp("runs-8.bmp", 8, 1, runs, colors)
    bmp("runs-4.bmp", 4, 2, bytes([6, 0x35, 0, 0, 0, 6, 0x12, 0x34, 0x56, 0, 0, 0, 6, 0x77, 0, 0, 6, 0x10, 0, 1]), colors)
    sixteen = struct.pack("<24H", *((x * 6 << 11) | (y * 15 << 5) | (x + y) for y in range(4) for x in range(6)))
    bmp("masks-16.bmp", 16, 3, sixteen, masks=struct.pack("<3L", 0xF800, 0x07E0, 0x001F))
    by_pillow("rgb-32.bmp", picture((6, 4)).convert("RGBA"), "BMP")


def others():
    exif = Image.Exif()
    exif[ORIENTATION] = 6
    by_pillow("lossy.webp", picture(), "WEBP", quality=20, method=6)
    see_through = picture()
    see_through.putalpha(Image.linear_gradient("L").resize((WIDTH, HEIGHT)))
    by_pillow("lossy-alpha-turned.webp", see_through, "WEBP", quality=20, method=6, exif=exif)
    by_pillow("palette.webp", picture().quantize(8).convert("RGB"), "WEBP", lossless=True, method=6)
    moving = [picture((8, 6)), picture((8, 6)).rotate(180)]
    by_pillow("animated.webp", moving[0], "WEBP", save_all=True, append_images=moving[1:], duration=50, lossless=True)
    for frame in moving:
        frame.putalpha(Image.linear_gradient("L").resize(frame.size))
    by_pillow("animated-alpha.webp", moving[0], "WEBP", save_all=True, append_images=moving[1:], duration=50, quality=20)

    by_pillow("progressive.jpg", picture(), "JPEG", quality=30, progressive=True)
    by_pillow("progressive-turned.jpg", picture((9, 7)), "JPEG", quality=30, progressive=True, subsampling=0, exif=exif)
    by_pillow("restarts.jpg", picture(), "JPEG", quality=30, subsampling=0, restart_marker_blocks=2)
    by_pillow("subsampled.jpg", picture(), "JPEG", quality=30, subsampling=2, optimize=True)
    by_pillow("inks.jpg", picture().convert("CMYK"), "JPEG", quality=30)


if __name__ == "__main__":
    HERE.mkdir(exist_ok=True)
    tiffs()
    pngs()
    bmps()
    others()
