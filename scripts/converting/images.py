"""Images and volumes as arrays [z, y, x] (or [y, x]), with what their files say of lengths."""

import dataclasses
import gzip
import mmap
import os
import re
import struct
import zlib

import numpy as np

from converting.common import InputError, note

IMAGES = (".tif", ".tiff", ".png", ".bmp")


@dataclasses.dataclass
class Volume:
    """Voxels, the slowest direction first. Lengths as x, y, z; None where the file does not say them."""

    voxels: "np.ndarray | Planes"
    spacing: list | None = None
    first: list | None = None  # centre of the first voxel
    unit: str | None = None

    def drop(self):
        """Gives memory back that voxels of a file took which have been looked at."""
        data = self.voxels
        while isinstance(data, np.ndarray):
            data = data.base
        data = data.obj if isinstance(data, memoryview) else data
        if isinstance(data, mmap.mmap):
            data.madvise(mmap.MADV_DONTNEED)


class Planes:
    """Voxels that are read when planes of them are asked for; read(first, last) gives these as an array."""

    def __init__(self, shape, dtype, read):
        self.shape, self.dtype, self.read = shape, np.dtype(dtype), read

    def __getitem__(self, part):
        first, last, _ = part.indices(self.shape[0])
        return self.read(first, last)

    def __array__(self, dtype=None):
        return np.asarray(self.read(0, self.shape[0]), dtype)


def finish(data, dtype, sizes, name):
    """Bytes as an array; `sizes` are x, y, z, x fastest."""
    dtype, count = np.dtype(dtype), int(np.prod(sizes, dtype=np.int64))
    needed = count * dtype.itemsize
    if len(data) < needed:
        raise InputError(f"{name}: holds {len(data)} bytes of voxels; {' x '.join(map(str, sizes))} of {dtype.itemsize} "
                         f"bytes need {needed}: it is cut off, or its header is wrong")
    if len(data) > needed:
        note(f"{name}: holds {len(data) - needed} bytes behind its voxels; they are left out")
    array = np.frombuffer(data, dtype, count).reshape(sizes[::-1])
    return array[0] if len(sizes) == 3 and sizes[2] == 1 else array


def contents(path):
    """The bytes of a file, which are read when they are looked at."""
    try:
        with open(path, "rb") as file:
            try:
                return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            except (ValueError, OSError):  # an empty file, or none of a disk
                return file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:  # what a damaged head can make of a name
        raise InputError(f"{path}: is no name of a file") from None


def behind(data, at):
    """The bytes from a place on, not copied."""
    return memoryview(data)[at:]


def natural(name):
    """A key that sorts slice9 before slice10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def numbers(text, count, where, kind=float):
    try:
        values = [kind(word) for word in text.split()]
    except ValueError:
        raise InputError(f"{where}: '{text[:60]}' is not {count} numbers") from None
    if len(values) != count:
        raise InputError(f"{where}: '{text[:60]}' holds {len(values)} numbers; {count} are needed")
    return values


def plane_of(image, where):
    """A page of labels or grey values."""
    if image.mode not in ("1", "L", "P", "I", "I;16", "I;16B", "I;16L", "F"):
        raise InputError(f"{where}: is an image in colour ({image.mode}); labels are one number for each pixel")
    array = np.array(image)
    if array.dtype.kind == "f":
        if not (np.isfinite(array).all() and (array == np.round(array)).all()):
            raise InputError(f"{where}: holds values that are no whole numbers; labels are whole")
        array = array.astype(np.int64)
    return array.astype(np.uint8) if array.dtype == bool else array


def tiff_lengths(image):
    """Spacing in metres by the resolution tags and ImageJ's words; pages: None where nothing says how far apart."""
    tags = getattr(image, "tag_v2", {})
    per = {2: 0.0254, 3: 0.01}.get(int(tags.get(296, 2)))
    words = dict(re.findall(r"^(\w+)=(.*)$", str(tags.get(270, "")), re.M))
    if 282 not in tags or 283 not in tags or not float(tags[282]) > 0 or not float(tags[283]) > 0:
        return None, None
    metres = {"micron": 1e-6, "um": 1e-6, "\\u00B5m": 1e-6, "mm": 1e-3, "cm": 1e-2, "nm": 1e-9,
              "inch": 0.0254}.get(words.get("unit"))
    if "ImageJ" in words and metres:
        plane = [metres / float(tags[282]), metres / float(tags[283])]
        return plane, metres * float(words["spacing"]) if "spacing" in words else None
    if per is None or float(tags[282]) in (72.0, 96.0, 1.0):  # what programs write that do not know it
        return None, None
    return [per / float(tags[282]), per / float(tags[283])], None


# What Pillow raises of damaged files.
DAMAGES = (OSError, SyntaxError, ValueError, EOFError, KeyError, TypeError, OverflowError, MemoryError)


def read_pages(path):
    """A TIFF of one or more pages, a PNG or a BMP: an array or Planes, and lengths."""
    from PIL import Image  # pylint: disable=import-outside-toplevel
    Image.MAX_IMAGE_PIXELS = None
    try:
        with Image.open(path) as image:
            plane, apart = tiff_lengths(image)
            count = getattr(image, "n_frames", 1)
            image.seek(0)
            page = plane_of(image, f"{path}: page 0")
    except DAMAGES as error:
        return by_tifffile(path, error), None, None
    pages = Planes((count, *page.shape), page.dtype, lambda first, last: some_pages(path, first, last, page.shape))
    return (page if count == 1 else pages), plane, apart


def some_pages(path, first, last, shape):
    from PIL import Image  # pylint: disable=import-outside-toplevel
    pages = []
    try:
        with Image.open(path) as image:
            for i in range(first, last):
                image.seek(i)
                pages.append(plane_of(image, f"{path}: page {i}"))
                if pages[-1].shape != shape:
                    raise InputError(f"{path}: page {i} is {pages[-1].shape[1]} x {pages[-1].shape[0]}, page 0 is "
                                     f"{shape[1]} x {shape[0]}")
    except DAMAGES as error:
        return by_tifffile(path, error)[first:last]
    return np.stack(pages)


def by_tifffile(path, error):
    """All pages of what Pillow cannot read."""
    try:
        import tifffile  # pylint: disable=import-outside-toplevel
        pages = np.asarray(tifffile.imread(path))
    except ImportError:
        raise InputError(f"{path}: cannot be read as an image: {error}") from None
    except Exception as other:  # whatever tifffile finds
        raise InputError(f"{path}: cannot be read as an image: {error}; {other}") from None
    if pages.ndim not in (2, 3) or not pages.size:
        raise InputError(f"{path}: holds no pages; it is cut off or damaged")
    return pages


def from_pages(voxels, plane, apart, name):
    if len(voxels.shape) == 2:
        return Volume(voxels, plane, None, "m" if plane else None)
    if plane and apart is None:
        note(f"{name}: gives {plane[0]:.6g} x {plane[1]:.6g} m in the page, and nothing for the distance of pages")
    return Volume(voxels, plane + [apart] if plane else None, None, "m" if plane else None)


def read_image(path):
    return from_pages(*read_pages(path), path)


def read_folder(path):
    """A folder of slices, in the order of the numbers in their names."""
    names = sorted((n for n in os.listdir(path) if n.lower().endswith(IMAGES) and not n.startswith(".")), key=natural)
    if not names:
        raise InputError(f"{path}: holds no slices ({', '.join(IMAGES)})")
    names = [os.path.join(path, n) for n in names]
    page, plane, apart = read_pages(names[0])

    def slices(first, last):
        pages = [read_pages(name)[0] for name in names[first:last]]
        for name, found in zip(names[first:last], pages):
            if len(found.shape) != 2 or found.shape != page.shape:
                raise InputError(f"{name}: is not one page as large as {os.path.basename(names[0])}")
        return np.stack(pages)

    if len(names) == 1 or len(page.shape) != 2:
        return from_pages(slices(0, 1)[0], plane, apart, path)
    return from_pages(Planes((len(names), *page.shape), page.dtype, slices), plane, apart, path)


META_TYPES = {"MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4",
              "MET_UINT": "u4", "MET_LONG_LONG": "i8", "MET_ULONG_LONG": "u8", "MET_FLOAT": "f4", "MET_DOUBLE": "f8"}


def read_meta(path):
    """MetaImage: .mhd beside its data, or .mha with them."""
    data, head, at, line = contents(path), {}, 0, 0
    while at < len(data):
        end = data.find(b"\n", at)
        end = len(data) if end < 0 else end
        line += 1
        key, equals, value = data[at:end].decode("latin-1").partition("=")
        at = end + 1
        if key.strip() and not equals:
            raise InputError(f"{path}:{line}: is not 'Key = value'; is this the head of a MetaImage?")
        head[key.strip()] = value.strip()
        if key.strip() == "ElementDataFile":
            break
    for key in ("DimSize", "ElementType", "ElementDataFile"):
        if key not in head:
            raise InputError(f"{path}: has no {key}")
    if head["ElementType"] not in META_TYPES or int(head.get("ElementNumberOfChannels", "1")) != 1:
        raise InputError(f"{path}: ElementType {head['ElementType']} is not read; known are {', '.join(META_TYPES)}")
    count = len(head["DimSize"].split())
    if count not in (2, 3):
        raise InputError(f"{path}: DimSize has {count} numbers; images have 2 and volumes 3")
    sizes = numbers(head["DimSize"], count, f"{path}: DimSize", int)
    turned = head.get("TransformMatrix", head.get("Rotation"))
    if turned and numbers(turned, count * count, f"{path}: TransformMatrix") != list(np.eye(count).ravel()):
        raise InputError(f"{path}: TransformMatrix turns the volume; resample it along its axes")
    name = head["ElementDataFile"]
    if name == "LOCAL":
        raw, name = behind(data, at), path
    else:
        name = os.path.join(os.path.dirname(path), name)
        raw = contents(name)
    if head.get("CompressedData", "False").lower() == "true":
        try:
            raw = zlib.decompress(raw)
        except zlib.error as error:
            raise InputError(f"{name}: cannot be unpacked ({error}); it is cut off or damaged") from None
    elif int(head.get("HeaderSize", "0")) > 0:
        raw = behind(raw, int(head["HeaderSize"]))
    big = head.get("BinaryDataByteOrderMSB", head.get("ElementByteOrderMSB", "False")).lower() == "true"
    voxels = finish(raw, (">" if big else "<") + META_TYPES[head["ElementType"]], sizes, name)
    spacing = head.get("ElementSpacing", head.get("ElementSize"))
    offset = head.get("Offset", head.get("Position", head.get("Origin")))
    return Volume(voxels, numbers(spacing, count, f"{path}: ElementSpacing") if spacing else None,
                  numbers(offset, count, f"{path}: Offset") if offset else None)


NRRD_TYPES = {"i1": "int8 signed char|int8_t", "u1": "uint8 uchar|unsigned char|uint8_t",
              "i2": "int16 short|short int|signed short|int16_t", "u2": "uint16 ushort|unsigned short|uint16_t",
              "i4": "int32 int|signed int|int32_t", "u4": "uint32 uint|unsigned int|uint32_t",
              "i8": "int64 longlong|long long|int64_t", "u8": "uint64 ulonglong|unsigned long long|uint64_t",
              "f4": "float", "f8": "double"}


def nrrd_type(text, path):
    for code, names in NRRD_TYPES.items():
        if text in names.replace(" ", "|", 1).split("|"):
            return code
    raise InputError(f"{path}: the type '{text[:40]}' is not read")


def read_nrrd(path):
    data = contents(path)
    end = re.search(rb"\r?\n\r?\n", data)
    head_text = data[:end.start() if end else len(data)]
    head, lines = {}, head_text.decode("latin-1").splitlines()
    for i, line in enumerate(lines[1:], 2):
        if line.startswith("#") or ":=" in line or not line.strip():
            continue
        key, colon, value = line.partition(":")
        if not colon:
            raise InputError(f"{path}:{i}: is not 'key: value'")
        head[key.strip().lower()] = value.strip()
    for key in ("type", "dimension", "sizes", "encoding"):
        if key not in head:
            raise InputError(f"{path}: has no '{key}'")
    head["encoding"] = head["encoding"].lower()
    count, = numbers(head["dimension"], 1, f"{path}: dimension", int)
    if count not in (2, 3):
        raise InputError(f"{path}: has {count} dimensions; images have 2 and volumes 3")
    sizes, code = numbers(head["sizes"], count, f"{path}: sizes", int), nrrd_type(head["type"], path)
    beside = head.get("data file", head.get("datafile"))
    name = os.path.join(os.path.dirname(path), beside) if beside else path
    raw = contents(name) if beside else behind(data, end.end()) if end else b""
    try:
        if head["encoding"] in ("gzip", "gz"):
            raw = gzip.decompress(raw)
    except (EOFError, OSError, zlib.error) as error:
        raise InputError(f"{name}: cannot be unpacked ({error}); it is cut off or damaged") from None
    if head["encoding"] in ("ascii", "text", "txt"):
        raw = np.array(bytes(raw).split(), dtype=float).astype(code).tobytes()
    elif head["encoding"] not in ("raw", "gzip", "gz"):
        raise InputError(f"{path}: the encoding '{head['encoding']}' is not read; known are raw, gzip, ascii")
    order = ">" if head.get("endian", "little") == "big" and head["encoding"] not in ("ascii", "text", "txt") else "<"
    spacing = numbers(head["spacings"], count, f"{path}: spacings") if "spacings" in head else None
    if "space directions" in head:
        rows = [numbers(v.replace(",", " "), count, f"{path}: space directions")
                for v in re.findall(r"\(([^)]*)\)", head["space directions"])]
        matrix = np.array(rows)
        if matrix.shape != (count, count) or (matrix - np.diag(np.diag(matrix))).any():
            raise InputError(f"{path}: 'space directions' turn the volume; resample it along its axes")
        spacing = [abs(v) for v in np.diag(matrix)]
    origin = re.search(r"\(([^)]*)\)", head.get("space origin", ""))
    units = set(re.findall(r'"([^"]*)"', head.get("space units", "")))
    return Volume(finish(raw, order + code, sizes, name), spacing,
                  numbers(origin.group(1).replace(",", " "), count, f"{path}: space origin") if origin else None,
                  {"mm": "mm", "um": "um", "m": "m", "microns": "um"}.get(units.pop() if len(units) == 1 else ""))


NIFTI_TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8"}


def read_nifti(path):
    data = contents(path)
    if data[:2] == b"\x1f\x8b":
        try:
            data = gzip.decompress(data)
        except (EOFError, OSError, zlib.error) as error:
            raise InputError(f"{path}: cannot be unpacked ({error}); it is cut off or damaged") from None
    order = next((o for o in "<>" if len(data) >= 348 and struct.unpack(o + "i", data[:4])[0] == 348), None)
    if order is None or data[344:347] not in (b"n+1", b"ni1"):
        raise InputError(f"{path}: is no NIfTI-1 file (a head of 348 bytes)")
    dims = struct.unpack(order + "8h", data[40:56])
    code, = struct.unpack(order + "h", data[70:72])
    pixels = struct.unpack(order + "8f", data[76:108])
    start, slope, inter = struct.unpack(order + "3f", data[108:120])
    sizes = [max(1, v) for v in dims[1:1 + max(0, dims[0])]]
    while len(sizes) > 2 and sizes[-1] == 1:
        sizes.pop()
    if code not in NIFTI_TYPES or len(sizes) not in (2, 3):
        raise InputError(f"{path}: {len(sizes)} dimensions of type {code} are not read")
    raw, name = behind(data, int(start)), path
    if data[344:347] == b"ni1":
        name = re.sub(r"\.hdr(\.gz)?$", ".img", path)
        raw = behind(contents(name), int(start))
    voxels = finish(raw, order + NIFTI_TYPES[code], sizes, name)
    if slope not in (0.0, 1.0) or inter != 0.0:
        voxels = voxels * float(slope or 1.0) + float(inter)
    unit = {1: "m", 2: "mm", 3: "um"}.get(data[123] & 7)
    return Volume(voxels, [float(v) for v in pixels[1:1 + len(sizes)]], None, unit)


def read_hdf5(path, wanted):
    import h5py  # pylint: disable=import-outside-toplevel
    try:
        with h5py.File(path, "r") as file:
            found = []
            file.visititems(lambda name, item: found.append(name) if isinstance(item, h5py.Dataset)
                            and item.dtype.kind in "iub" and len([n for n in item.shape if n > 1]) in (2, 3) else None)
            if wanted is None and len(found) > 1:
                found = [n for n in found if n.endswith("FeatureIds")] or found
            if wanted is None and len(found) != 1:
                raise InputError(f"{path}: holds {len(found)} data sets that could be labels ({', '.join(found[:8])}); "
                                 "name one: --dataset NAME")
            name = wanted or found[0]
            if name not in file:
                raise InputError(f"{path}: has no data set '{name}'; it holds {', '.join(found[:8])}")
            voxels = planes_of_data(path, name, file[name])
            geometry = next((file[g] for g in walk(file) if g.endswith("_SIMPL_GEOMETRY")), None)
            spacing = [float(v) for v in geometry["SPACING"][()]] if geometry and "SPACING" in geometry else None
            origin = [float(v) for v in geometry["ORIGIN"][()]] if geometry and "ORIGIN" in geometry else None
    except (OSError, KeyError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be read as HDF5: {error}") from None
    first = [o + s / 2 for o, s in zip(origin, spacing)] if origin and spacing else None
    return Volume(voxels, spacing, first)


def planes_of_data(path, name, data):
    """The values of a data set without its axes of one, when they are asked for."""
    import h5py  # pylint: disable=import-outside-toplevel
    sizes = [n for n in data.shape if n > 1]
    if not data.shape or data.shape[0] == 1 or len(sizes) < 2:
        return data[()].reshape(sizes)

    def read(first, last):
        try:
            with h5py.File(path, "r") as file:
                return file[name][first:last].reshape([last - first, *sizes[1:]])
        except (OSError, KeyError, RuntimeError) as error:
            raise InputError(f"{path}: cannot be read as HDF5: {error}") from None

    return Planes(sizes, data.dtype, read)


def walk(file):
    names = []
    file.visit(names.append)
    return names


def read_tesr(path):
    """Raster tessellation of Neper."""
    data = contents(path)
    if not data[:1000].lstrip().startswith(b"***tesr"):
        raise InputError(f"{path}:1: does not begin with ***tesr")
    mark = re.search(rb"\*\*general\s+(\d)\s", data)
    body = re.search(rb"\*\*data\s+(\S+)[^\S\n]*\n", data)
    if not mark or not body:
        raise InputError(f"{path}: has no section **general or **data; it is cut off")
    count = int(mark.group(1))
    words = data[mark.end():body.start()].decode("latin-1").split()
    if count not in (2, 3):
        raise InputError(f"{path}: **general: {count} dimensions; images have 2 and volumes 3")
    sizes = numbers(" ".join(words[:count]), count, f"{path}: **general", int)
    spacing = numbers(" ".join(words[count:2 * count]), count, f"{path}: **general")
    origin = re.search(rb"\*origin\s+([^*]*)", data[mark.end():body.start()])
    low = numbers(origin.group(1).decode(), count, f"{path}: *origin") if origin else [0.0] * count
    form, rest = body.group(1).decode(), behind(data, body.end())
    if form == "*file":
        raise InputError(f"{path}: holds its voxels in another file; write it with the format ascii")
    if form == "ascii":
        words = bytes(rest).split(b"***end")[0].split()
        if len(words) != int(np.prod(sizes)):
            raise InputError(f"{path}: holds {len(words)} voxels; {int(np.prod(sizes))} are needed: it is cut off")
        try:
            voxels = np.array(words, dtype=np.int64).reshape(sizes[::-1])
        except (ValueError, OverflowError) as error:
            raise InputError(f"{path}: **data: {error}; it is damaged") from None
    elif form in ("binary8", "binary16", "binary32"):
        code = {"binary8": "u1", "binary16": "<i2", "binary32": "<i4"}[form]
        needed = int(np.prod(sizes)) * np.dtype(code).itemsize
        voxels = finish(rest[:needed], code, sizes, path)
    else:
        raise InputError(f"{path}: data of the form '{form}' are not read; known are ascii, binary8, 16, 32")
    return Volume(voxels, spacing, [o + s / 2 for o, s in zip(low, spacing)])


def read_vti(path, wanted):
    from converting.vtk_xml import VtkFile  # pylint: disable=import-outside-toplevel
    file = VtkFile(contents(path), path)
    image = file.root.find("ImageData")
    if image is None:
        raise InputError(f"{path}: is no image of VTK, but {file.kind or 'something else'}")
    extent = [int(v) for v in image.get("WholeExtent", "").split()]
    spacing = [float(v) for v in image.get("Spacing", "1 1 1").split()]
    origin = [float(v) for v in image.get("Origin", "0 0 0").split()]
    pieces = image.findall("Piece")
    if len(extent) != 6 or len(pieces) != 1:
        raise InputError(f"{path}: has {len(pieces)} pieces; an image of one piece can be read")
    cells = [max(1, extent[2 * k + 1] - extent[2 * k]) for k in range(3)]
    for section, grow in (("CellData", 0), ("PointData", 1)):
        arrays = file.arrays(pieces[0].find(section))
        names = [wanted] if wanted in arrays else [n for n, a in arrays.items()
                                                   if wanted is None and "Int" in a.get("type", "")]
        if len(names) > 1:
            raise InputError(f"{path}: holds the arrays {', '.join(names)}; name one: --dataset NAME")
        if names:
            sizes = [extent[2 * k + 1] - extent[2 * k] + 1 for k in range(3)] if grow else cells
            values = np.array(file.values(arrays[names[0]]))
            if values.size != int(np.prod(sizes)):
                raise InputError(f"{path}: the array '{names[0]}' has {values.size} values; {int(np.prod(sizes))} are needed")
            low = [o + extent[2 * k] * s for k, (o, s) in enumerate(zip(origin, spacing))]
            return Volume(values.reshape(sizes[::-1]).squeeze(), spacing,
                          low if grow else [o + s / 2 for o, s in zip(low, spacing)])
    raise InputError(f"{path}: holds no array of whole numbers" + (f" called '{wanted}'" if wanted else ""))


def read_raw(path, shape, dtype):
    """Bytes without a head: sizes x, y, z and a type as numpy writes it."""
    return Volume(finish(contents(path), dtype, shape, path))


READERS = {".mhd": read_meta, ".mha": read_meta, ".nrrd": read_nrrd, ".nhdr": read_nrrd, ".nii": read_nifti,
           ".nii.gz": read_nifti, ".hdr": read_nifti, ".tesr": read_tesr, **{ending: read_image for ending in IMAGES}}
NAMED = {".vti": read_vti, ".h5": read_hdf5, ".hdf5": read_hdf5, ".dream3d": read_hdf5}


def read(path, dataset=None):
    """A file or a folder of slices."""
    if not os.path.exists(path):
        raise InputError(f"{path}: there is no such file")
    if os.path.isdir(path):
        return read_folder(path)
    name = os.path.basename(path).lower()
    for ending, reader in NAMED.items():
        if name.endswith(ending):
            return reader(path, dataset)
    for ending, reader in READERS.items():
        if name.endswith(ending):
            return reader(path)
    raise InputError(f"{path}: the ending is not known; known are {', '.join([*READERS, *NAMED])}, and .raw with --shape "
                     "and --type")
