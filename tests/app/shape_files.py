"""Makes small files of the kinds in which people bring shapes."""

import gzip
import math
import struct
import zlib

import numpy as np

BOX_CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
BOX_QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def box(size=(1, 1, 1), lower=(0, 0, 0), lid=True):
    """Points and triangles of a box, without its top where it has no lid."""
    points = [tuple(l + s * c for l, s, c in zip(lower, size, corner)) for corner in BOX_CORNERS]
    quads = BOX_QUADS if lid else BOX_QUADS[:1] + BOX_QUADS[2:]
    return points, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def sphere(rings, radius=1.0, centre=(0, 0, 0)):
    """A sphere of 4 rings (rings - 1) triangles."""
    around = 2 * rings
    points = [(0, 0, -1)] + [(math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), -math.cos(t))
                             for t in (math.pi * i / rings for i in range(1, rings))
                             for p in (2 * math.pi * j / around for j in range(around))] + [(0, 0, 1)]
    last = len(points) - 1
    triangles = []
    for j in range(around):
        k = (j + 1) % around
        triangles += [(0, 1 + k, 1 + j), (last, last - around + j, last - around + k)]
        for i in range(rings - 2):
            a, b, c, d = (1 + i * around + j, 1 + i * around + k, 1 + (i + 1) * around + j, 1 + (i + 1) * around + k)
            triangles += [(a, b, d), (a, d, c)]
    return [tuple(c + radius * v for c, v in zip(centre, p)) for p in points], triangles


def binary_stl(points, triangles, head=b"solid made by a scanner"):
    corners = np.array(points, dtype="<f4")[np.array(triangles)]
    rows = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = corners
    return head.ljust(80) + struct.pack("<I", len(triangles)) + rows.tobytes()


def ascii_stl(name, points, triangles, end="\n"):
    lines = [f"solid {name}"]
    for t in triangles:
        lines += ["  facet normal 0 0 0", "    outer loop", *("      vertex {:.9g} {:.9g} {:.9g}".format(*points[c]) for c in t),
                  "    endloop", "  endfacet"]
    return end.join([*lines, f"endsolid {name}", ""])


def obj(points, faces):
    lines = ["# a comment", "mtllib none.mtl", "o grain", *("v {} {} {}".format(*p) for p in points), "vn 0 0 1", "s off"]
    return "\n".join(lines + ["f " + " ".join(f"{c + 1}//1" for c in face) for face in faces] + [""])


def ply(points, faces, form):
    head = (f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
            f"property float z\nproperty uchar red\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    if form == "ascii":
        return (head + "".join("{} {} {} 7\n".format(*p) for p in points)
                + "".join(f"{len(f)} {' '.join(map(str, f))}\n" for f in faces)).encode()
    order = "<" if "little" in form else ">"
    return (head.encode() + b"".join(struct.pack(order + "3fB", *p, 7) for p in points)
            + b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in faces))


def labels(size=(24, 20, 16)):
    """Two balls that touch, of labels 3 and 700, and a bar of label 9 that the volume's edge cuts; [z, y, x]."""
    z, y, x = np.meshgrid(*(np.arange(n) + 0.5 for n in size[::-1]), indexing="ij")
    voxels = np.zeros(size[::-1], np.uint16)
    voxels[(x - 7) ** 2 + (y - 10) ** 2 + (z - 8) ** 2 < 25] = 3
    voxels[((x - 16) ** 2 + (y - 10) ** 2 + (z - 8) ** 2 < 25) & (voxels == 0)] = 700
    voxels[(y < 4) & (z < 5)] = 9
    return voxels


def metaimage(voxels, folder, packed=False):
    raw = voxels.tobytes()
    name = "scan.zraw" if packed else "scan.raw"
    (folder / name).write_bytes(zlib.compress(raw) if packed else raw)
    sizes = " ".join(map(str, voxels.shape[::-1]))
    text = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = {packed}\n"
            f"Offset = -0.1 0.05 0\nElementSpacing = 0.005 0.005 0.01\nDimSize = {sizes}\nElementType = MET_USHORT\n"
            f"ElementDataFile = {name}\n")
    file = folder / ("packed.mhd" if packed else "scan.mhd")
    file.write_text(text)
    return file


def nrrd(voxels):
    head = (f"NRRD0004\n# made by hand\ntype: unsigned short\ndimension: 3\nsizes: {' '.join(map(str, voxels.shape[::-1]))}\n"
            "encoding: gzip\nendian: little\nspacings: 0.005 0.005 0.01\n\n")
    return head.encode() + gzip.compress(voxels.astype("<u2").tobytes())


def nifti(voxels):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *voxels.shape[::-1], 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 512, 16)
    struct.pack_into("<8f", head, 76, 1, 0.005, 0.005, 0.01, 1, 1, 1, 1)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    head[123] = 2  # mm
    head[344:348] = b"n+1\0"
    return gzip.compress(bytes(head) + voxels.astype("<u2").tobytes())


def tesr(voxels):
    sizes = " ".join(map(str, voxels.shape[::-1]))
    return (f"***tesr\n **format\n  2.0\n **general\n  3\n  {sizes}\n  0.005 0.005 0.01\n **data\n  ascii\n"
            + "\n".join(" ".join(map(str, row)) for row in voxels.reshape(-1, voxels.shape[2])) + "\n***end\n")


def vti(voxels):
    extent = " ".join(f"0 {n}" for n in voxels.shape[::-1])
    raw = zlib.compress(voxels.astype("<u2").tobytes())
    data = struct.pack("<4I", 1, voxels.size * 2, 0, len(raw)) + raw
    return (f'<?xml version="1.0"?>\n<VTKFile type="ImageData" byte_order="LittleEndian" compressor="vtkZLibDataCompressor">\n'
            f'<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="0.005 0.005 0.01"><Piece Extent="{extent}"><CellData>'
            '<DataArray type="UInt16" Name="grain" format="appended" offset="0"/></CellData></Piece></ImageData>\n'
            '<AppendedData encoding="raw">\n_').encode() + data + b"\n</AppendedData></VTKFile>"


SVG = ('<?xml version="1.0"?>\n<!-- drawn by hand -->\n<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 40">\n'
       '<g transform="translate(10,-30)"><path d="M0 0 h20 v20 h-20 z m5 5 v10 h10 v-10 z"/></g>\n</svg>\n')
DXF = "\n".join("0 SECTION 2 ENTITIES 0 LINE 10 0 20 0 11 20 21 0 0 LINE 10 20 20 20 11 20 21 0 0 LWPOLYLINE 90 3 70 0 10 20 20 20 "
                "10 0 20 20 10 0 20 0 0 CIRCLE 10 10 20 10 40 5 0 ENDSEC 0 EOF".split()) + "\n"
CSV = "x,y,line\n0,0,a\n20,0,a\n20,20,a\n0,20,a\n5,5,b\n5,15,b\n15,15,b\n15,5,b\n"
