"""VTK's XML files (.vtp, .vti): arrays as text, base64 or appended bytes, compressed by zlib or not. Plain Python."""

import array
import base64
import binascii
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zlib

from converting.common import InputError

TYPES = {"Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H", "Int32": "i", "UInt32": "I", "Int64": "q",
         "UInt64": "Q", "Float32": "f", "Float64": "d"}


class VtkFile:
    """The tree of a file, and the values of its arrays."""

    def __init__(self, data, name):
        self.name = name
        self.appended, self.encoding = b"", "raw"
        begin = data.find(b"<AppendedData")
        if begin >= 0:  # raw bytes are no XML
            head_end = data.find(b">", begin)
            mark = data.find(b"_", head_end)
            end = data.rfind(b"</AppendedData>")
            if mark < 0:
                raise InputError(f"{name}: the appended data do not begin with '_'; the file is cut off or damaged")
            self.encoding = "base64" if b"base64" in data[begin:head_end] else "raw"
            self.appended = data[mark + 1:end if end > mark else len(data)]
            data = data[:begin] + b"</VTKFile>"
        try:
            self.root = ElementTree.fromstring(data)
        except ElementTree.ParseError as error:
            raise InputError(f"{name}:{error.position[0]}: is no XML file of VTK: {error}") from None
        if self.root.tag != "VTKFile":
            raise InputError(f"{name}: is no XML file of VTK; its root is <{self.root.tag}>")
        self.kind = self.root.get("type", "")
        self.order = "<" if self.root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.header = "Q" if self.root.get("header_type") == "UInt64" else "I"
        self.compressed = self.root.get("compressor") is not None
        if self.compressed and "ZLib" not in self.root.get("compressor"):
            raise InputError(f"{name}: is compressed by {self.root.get('compressor')}; zlib can be read")

    def arrays(self, element):
        """The arrays of an element by their names."""
        return {a.get("Name", ""): a for a in element.iter("DataArray")} if element is not None else {}

    def values(self, element):
        """The numbers of a DataArray."""
        code = TYPES.get(element.get("type"))
        label = f"{self.name}: array '{element.get('Name', '')}'"
        if code is None:
            raise InputError(f"{label}: numbers of type {element.get('type')} are not known")
        form = element.get("format", "ascii")
        if form == "ascii":
            try:
                return array.array(code, [float(w) if code in "fd" else int(w) for w in (element.text or "").split()])
            except (ValueError, OverflowError) as error:
                raise InputError(f"{label}: {error}") from None
        if form == "appended":
            offset = int(element.get("offset", "0"))
            raw = self.appended[offset:]
            encoded = self.encoding == "base64"
        else:
            raw, encoded = re.sub(rb"\s", b"", (element.text or "").encode()), True
        try:
            content = self.unpack(raw, encoded)
        except (struct.error, zlib.error, binascii.Error, IndexError) as error:
            raise InputError(f"{label}: cannot be unpacked ({error}); the file is cut off or damaged") from None
        values = array.array(code)
        values.frombytes(content[:len(content) // values.itemsize * values.itemsize])
        if (self.order == "<") != (sys.byteorder == "little"):
            values.byteswap()
        return values

    def unpack(self, raw, encoded):
        size = struct.calcsize(self.header)

        def numbers(count, at=0):
            taken = self.decode(raw[at:], count * size) if encoded else raw[at:at + count * size]
            return struct.unpack(f"{self.order}{count}{self.header}", taken)

        if not self.compressed:
            length, = numbers(1)
            content = self.decode(raw, size + length)[size:] if encoded else raw[size:size + length]
            if len(content) < length:
                raise struct.error(f"{len(content)} of {length} bytes are there")
            return content
        blocks, = numbers(1)
        head = numbers(3 + blocks)
        begin = (3 + blocks) * size
        if encoded:  # head and blocks are encoded apart
            raw, begin = self.decode(raw[-(-begin // 3) * 4:], sum(head[3:])), 0
        parts = []
        for length in head[3:]:
            parts.append(zlib.decompress(raw[begin:begin + length]))
            begin += length
        return b"".join(parts)

    @staticmethod
    def decode(text, count):
        """The first bytes of base64."""
        return base64.b64decode(text[:-(-count // 3) * 4])[:count]
