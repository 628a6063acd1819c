#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets that are not HDF5 of afmid's own into fuzz/corpus (`AFMID_WRITE_SEEDS=1 cargo test --test integrity corpus` writes those).

Run it with an interpreter that has h5py and numpy: .tools/bin/python fuzz/seeds.py after `make test-deps`. Every file is made here, none is measured.
"""
import gzip
import io
import json
import struct
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy

ROOT = Path(__file__).resolve().parent.parent
CORPUS = ROOT / "fuzz/corpus"
SAMPLES = [1, -2, 300, -30000, 7, 0]


def write(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


# NI TDMS
def tdms_text(order, text):
    return struct.pack(order + "I", len(text)) + text.encode()


def tdms_segment(order, flags, objects, raw):
    meta = struct.pack(order + "I", len(objects)) if flags & 2 else b""
    for path, index, properties in objects:
        meta += tdms_text(order, path) + index + struct.pack(order + "I", len(properties))
        for name, kind, value in properties:
            meta += tdms_text(order, name) + struct.pack(order + "I", kind) + value
    flags |= 64 if order == ">" else 0
    return b"TDSm" + struct.pack("<I", flags) + struct.pack(order + "IQQ", 4713, len(meta) + len(raw), len(meta)) + meta + raw


def tdms():
    for order, name in [("<", "little"), (">", "big")]:
        plain = lambda code, values: struct.pack(order + "IIIQ", 20, code, 1, values)
        timing = [
            ("wf_increment", 10, struct.pack(order + "d", 1e-6)),
            ("wf_start_time", 0x44, struct.pack(order + "Qq", 7, 1000) if order == "<" else struct.pack(">qQ", 1000, 7)),
            ("unit_string", 0x20, tdms_text(order, "V")),
            ("NI_Number_Of_Scales", 7, struct.pack(order + "I", 1)),
            ("NI_Scale[0]_Scale_Type", 0x20, tdms_text(order, "Linear")),
            ("NI_Scale[0]_Linear_Slope", 10, struct.pack(order + "d", 2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", 10, struct.pack(order + "d", 0.5)),
        ]
        text = struct.pack(order + "IIIQQ", 28, 0x20, 1, 1, 7)
        objects = [
            ("/", struct.pack(order + "I", 2**32 - 1), []),
            ("/'g'", struct.pack(order + "I", 2**32 - 1), []),
            ("/'g'/'a'", plain(2, 2), timing),
            ("/'g'/'b'", plain(10, 1), []),
            ("/'g'/'t'", text, []),
        ]
        raw = (struct.pack(order + "2hd", 1, -2, 0.5) + struct.pack(order + "I", 3) + b"abc") * 3
        again = tdms_segment(order, 14, [("/'g'/'a'", struct.pack(order + "I", 0), [])], struct.pack(order + "2h", 5, 6))
        write("tdms", f"{name}.tdms", tdms_segment(order, 14, objects, raw) + again)
        both = [("/'g'/'a'", plain(2, 3), timing), ("/'g'/'b'", plain(3, 3), [])]
        interleaved = b"".join(struct.pack(order + "hi", value, 2 * value) for value in SAMPLES)
        write("tdms", f"interleaved-{name}.tdms", tdms_segment(order, 46, both, interleaved))
        scaler = struct.pack(order + "5I", 3, 0, 0, 0, 0) + struct.pack(order + "5I", 1, 1, 1, 0, 1)
        daqmx = struct.pack(order + "IIIQI", 0x1269, 2**32 - 1, 1, 2, 2) + scaler + struct.pack(order + "3I", 2, 4, 2)
        write("tdms", f"daqmx-{name}.tdms", tdms_segment(order, 142, [("/'g'/'d'", daqmx, [])], bytes(range(24))))
    write("tdms", "cut.tdms", tdms_segment("<", 14, [("/'g'/'a'", struct.pack("<IIIQ", 20, 2, 1, 2), [])], b"\1\0")[:-1])


# NumPy
def npy(array, version=(1, 0)):
    out = io.BytesIO()
    numpy.lib.format.write_array(out, numpy.asarray(array), version=version)
    return out.getvalue()


def arrays():
    write("npy", "i2.npy", npy(numpy.array(SAMPLES, "<i2")))
    write("npy", "f8-big.npy", npy(numpy.array(SAMPLES, ">f8")))
    write("npy", "columns.npy", npy(numpy.asfortranarray(numpy.arange(24, dtype="<f4").reshape(12, 2)), (2, 0)))
    write("npy", "fields.npy", npy(numpy.array([(1, 2.5), (3, 4.5)], [("a", "<i4"), ("b", "<f8")]), (3, 0)))
    write("npy", "u8.npy", npy(numpy.array([2**63, 1, 2], "<u8")))
    write("npy", "scalar.npy", npy(5.0))
    for name, save in [("stored", numpy.savez), ("deflated", numpy.savez_compressed)]:
        out = io.BytesIO()
        save(out, defl=numpy.array(SAMPLES, "<i2"), fs=numpy.array(1e6), grid=numpy.arange(40.0).reshape(2, 20))
        write("npz", f"{name}.npz", out.getvalue())
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", npy(numpy.zeros(4000)))
        archive.writestr("folder/note.txt", "no array")
    write("npz", "zeros.npz", out.getvalue())


# MATLAB 4 and 5 to 7
def mat():
    def element(order, kind, data):
        if 1 <= len(data) <= 4:
            head = struct.pack(order + "I", len(data) << 16 | kind)
        else:
            head = struct.pack(order + "II", kind, len(data))
        whole = head + data
        return whole + b"\0" * (-len(whole) % 8)

    def array(order, flags, shape, name, rest):
        inside = element(order, 6, struct.pack(order + "II", flags, 0)) + element(order, 5, struct.pack(f"{order}{len(shape)}i", *shape))
        return element(order, 14, inside + element(order, 1, name.encode()) + rest)

    for order, mark, name in [("<", b"\x00\x01IM", "little"), (">", b"\x01\x00MI", "big")]:
        header = b"MATLAB 5.0 MAT-file, a seed".ljust(124) + mark
        numbers = element(order, 3, struct.pack(order + "6h", *SAMPLES))
        y = array(order, 6, [1, 6], "y", numbers)
        fs = array(order, 6, [1, 1], "fs", element(order, 9, struct.pack(order + "d", 1e5)))
        inner = array(order, 6, [6, 1], "", numbers)
        fields = element(order, 5, struct.pack(order + "i", 8)) + element(order, 1, b"trace\0\0\0") + inner
        struct_ = array(order, 2, [1, 1], "s", fields)
        cell = array(order, 1, [1, 2], "c", inner + inner)
        text = array(order, 4, [1, 2], "t", element(order, 4, struct.pack(order + "2H", 86, 47)))
        complex_ = array(order, 6 | 0x800, [1, 2], "z", element(order, 9, struct.pack(order + "2d", 1, 2)) * 2)
        sparse = array(order, 5, [2, 2], "p", element(order, 5, struct.pack(order + "2i", 0, 1)) * 2 + element(order, 9, struct.pack(order + "2d", 1, 2)))
        write("mat", f"level5-{name}.mat", header + y + fs + struct_ + cell + text + complex_ + sparse)
        packed = [zlib.compress(part) for part in (y, fs, struct_)]
        write("mat", f"level7-{name}.mat", header + b"".join(struct.pack(order + "II", 15, len(part)) + part for part in packed))
        code = 0 if order == "<" else 1000
        level4 = struct.pack(order + "5I", code, 6, 1, 0, 2) + b"y\0" + struct.pack(order + "6d", *SAMPLES)
        level4 += struct.pack(order + "5I", code + 30, 1, 3, 0, 2) + b"n\0" + struct.pack(order + "3h", 1, 2, 3)
        write("mat", f"level4-{name}.mat", level4)


# Igor binary waves
def ibw():
    def sealed(order, data, at, length):
        words = struct.unpack(f"{order}{length // 2}H", bytes(data[:length]))
        data[at : at + 2] = struct.pack(order + "H", -sum(words) & 0xFFFF)
        return bytes(data)

    for order, name in [("<", "little"), (">", "big")]:
        note, labels = b"NumPtsPerSec: 2000\rInvOLS: 1e-07\r", b"".join(label.ljust(32, b"\0") for label in (b"", b"Raw", b"Defl"))
        data = struct.pack(order + "6f", *SAMPLES)
        head = bytearray(384)
        struct.pack_into(order + "H", head, 0, 5)
        struct.pack_into(order + "5I", head, 4, 320 + len(data), 0, len(note), 0, 0)
        struct.pack_into(order + "I", head, 40, len(labels))
        struct.pack_into(order + "2IH", head, 72, 0, 6, 2)
        head[92:97] = b"wave0"
        struct.pack_into(order + "2I", head, 132, 3, 2)
        struct.pack_into(order + "d", head, 148, 1e-3)
        head[212], head[216] = ord("V"), ord("s")
        write("ibw", f"version5-{name}.ibw", sealed(order, head, 2, 384) + data + note + labels)
        old = bytearray(16 + 110) + data + bytes(16)
        struct.pack_into(order + "HI", old, 0, 2, 126 + len(data))
        struct.pack_into(order + "I", old, 6, len(note))
        struct.pack_into(order + "H", old, 16, 2)
        old[22:27], old[50], old[54] = b"wave0", ord("V"), ord("s")
        struct.pack_into(order + "I", old, 58, 6)
        struct.pack_into(order + "d", old, 64, 1e-3)
        write("ibw", f"version2-{name}.ibw", sealed(order, old, 14, 16 + 126) + note)


# Bruker Nanoscope
def nanoscope():
    for size, code, name in [(2, "h", "two-bytes"), (4, "i", "four-bytes")]:
        data = struct.pack(f"<5{code}", 1, 2, 3, 4, -5)
        text = "\\*Force file list\r\n\\Version: 0x08150308\r\n\\Date: 12:04:58 AM Thu May 17 2018\r\n\\*Scanner list\r\n\\@Sens. Zsens: V 35.88 nm/V\r\n"
        text += "\\*Ciao scan list\r\n\\@Sens. DeflSens: V 72.76923 nm/V\r\n\\Scan Rate: 9\r\n\\*Ciao force list\r\n\\Scan rate: 2\r\n\\Forward vel.: 30\r\n\\Reverse vel.: 10\r\n"
        text += f"\\*Ciao force image list\r\n\\Data offset: 1024\r\n\\Data length: {len(data)}\r\n\\Bytes/pixel: {size}\r\n\\Samps/line: 3 2\r\n\\Spring Constant: 0.5\r\n"
        text += '\\@4:Image Data: S [DeflectionError] "Deflection Error"\r\n\\@4:Z scale: V [Sens. DeflSens] (0.0003750000 V/LSB) 2.5 V\r\n\\*File list end\r\n\x1a'
        write("nanoscope", f"{name}.000", text.encode().ljust(1024, b"\0") + data)


# JPK force curves
def jpk():
    def scaling(key, multiplier, unit):
        return (
            f"{key}.type=linear\n{key}.style=offsetmultiplier\n{key}.offset=-0.007\n{key}.multiplier={multiplier}\n"
            f"{key}.unit.type=metric-unit\n{key}.unit.unit={unit}\n"
        )

    def channel(prefix, encoder):
        sets = prefix + "conversion-set.conversion"
        text = scaling(prefix + encoder + ".scaling", "3.0921021713588157E-4", "V")
        text += f"{sets}s.list=distance\n{sets}s.default=distance\n{sets}s.base=volts\n{sets}.volts.name=Volts\n{sets}.volts.defined=false\n"
        text += f"{sets}.distance.defined=true\n{sets}.distance.type=simple\n{sets}.distance.base-calibration-slot=volts\n{sets}.distance.calibration-slot=distance\n"
        return text + scaling(sets + ".distance.scaling", "7.000143623002982E-8", "m")

    def segment(style):
        return (
            f"force-segment-header.num-points=5\nforce-segment-header.duration=0.25\nforce-segment-header.settings.style={style}\n"
            "force-segment-header.time-stamp=2016-02-05 13\\:27\\:32 +0100\nchannels.list=vDeflection\n"
        )

    general = "file-format-version=0.13\nforce-scan-series.header.position-index=0\n"
    for method, name in [(zipfile.ZIP_STORED, "stored"), (zipfile.ZIP_DEFLATED, "deflated")]:
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", method) as archive:
            add = lambda path, data: archive.writestr(zipfile.ZipInfo(path), data, compress_type=method)
            add("header.properties", general)
            for number, style in enumerate(["extend", "retract"]):
                text = segment(style) + "channel.vDeflection.data.file.name=channels/vDeflection.dat\nchannel.vDeflection.data.type=short\n"
                text += "channel.vDeflection.data.encoder.type=signedshort\n" + channel("channel.vDeflection.", "data.encoder")
                add(f"segments/{number}/segment-header.properties", text)
                add(f"segments/{number}/channels/vDeflection.dat", struct.pack(">5h", *SAMPLES[:5]))
        write("jpk", f"{name}.jpk-force", out.getvalue())
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        add = lambda path, data: archive.writestr(zipfile.ZipInfo(path), data, compress_type=zipfile.ZIP_DEFLATED)
        add("header.properties", general)
        shared = "lcd-info.0.channel.name=vDeflection\nlcd-info.0.type=integer-data\nlcd-info.0.encoder.type=signedinteger\n"
        add("shared-data/header.properties", shared + channel("lcd-info.0.", "encoder") + "force-segment-header-info.0.settings.style=extend\n")
        text = segment("x").replace("settings.style=x", "force-segment-header-info.*=0")
        add("segments/0/segment-header.properties", text + "channel.vDeflection.lcd-info.*=0\nchannel.vDeflection.data.file.name=channels/vDeflection.dat\n")
        add("segments/0/channels/vDeflection.dat", struct.pack(">5i", *SAMPLES[:5]))
    write("jpk", "shared.jpk-force", out.getvalue())


# Universal File Format 58
def uff():
    def dataset(ident, kind, points, even, data):
        text = f"    -1\n{ident}\nfirst line\nNONE\n18-Apr-16 13:49:58\nNONE\nNONE\n"
        text += f"{1:5}{0:10}{0:5}{0:10} {'NONE':10}{12:10}{-2:4} {'NONE':10}{0:10}{0:4}\n"
        text += f"{kind:10}{points:10}{int(even):10}{0.0:13.5E}{0.5:13.5E}{0.0:13.5E}\n"
        axis = lambda quantity, label, unit: f"{quantity:10}{0:5}{0:5}{0:5} {label:20} {unit:20}\n"
        text += axis(17, "time", "s") + axis(8, "Displacement", "m") + 2 * axis(0, "NONE", "NONE")
        return text.encode() + data + b"    -1\n"

    numbers = "".join(f"{value:20.11E}" for value in SAMPLES[:4]).encode() + b"\n"
    write("uff", "text.uff", dataset("    58", 4, 4, True, numbers) + dataset("    58", 2, 4, True, b"".join(f"{value:13.5E}".encode() for value in SAMPLES[:4]) + b"\n"))
    write("uff", "uneven.uff", dataset("    58", 4, 2, False, numbers))
    for order, endian, name in [("<", 1, "little"), (">", 2, "big")]:
        data = struct.pack(order + "6f", *SAMPLES)
        ident = f"    58b{endian:6}{2:6}{11:12}{len(data):12}{0:6}{0:6}{0:12}{0:12}"
        write("uff", f"binary-{name}.uff", dataset(ident, 2, 6, True, data))
    write("uff", "unknown-set.uff", "    -1\n   151\nmodel\n    -1\n".encode() + dataset("    58", 4, 4, True, numbers))


# classic netCDF: records of two variables, one of two lanes, and an axis with its unit
def netcdf():
    def name(text, size):
        return struct.pack(">" + size, len(text)) + text + b"\0" * (-len(text) % 4)

    def attribute(key, kind, data, count, size):
        return name(key, size) + struct.pack(">i" + size, kind, count) + data + b"\0" * (-len(data) % 4)

    def listed(tag, parts, size):
        return struct.pack(">i" + size, tag if parts else 0, len(parts)) + b"".join(parts)

    for version, size, offset in [(1, "i", "i"), (2, "i", "q"), (5, "q", "q")]:
        def header(begins):
            units = [attribute(b"units", 2, b"ms", 2, size), attribute(b"scale_factor", 6, struct.pack(">d", 0.5), 1, size)]
            variables = [(b"t", [0], units, 6, 8), (b"y", [0, 1], units[1:], 3, 4), (b"fs", [], [], 5, 4)]
            entries = []
            for (key, dims, about, kind, bytes_), begin in zip(variables, begins):
                entry = name(key, size) + struct.pack(">" + size, len(dims)) + b"".join(struct.pack(">" + size, dim) for dim in dims)
                entries.append(entry + listed(12, about, size) + struct.pack(">i" + size + offset, kind, bytes_, begin))
            dimensions = [name(b"t", size) + struct.pack(">" + size, 0), name(b"lane", size) + struct.pack(">" + size, 2)]
            rate = [attribute(b"sampling_rate", 6, struct.pack(">d", 1000.0), 1, size)]
            return b"CDF" + bytes([version]) + struct.pack(">" + size, len(SAMPLES)) + listed(10, dimensions, size) + listed(12, rate, size) + listed(11, entries, size)

        length = len(header([0, 0, 0]))
        records = b"".join(struct.pack(">d2h", i * 1.0, value, -value) for i, value in enumerate(SAMPLES))
        write("netcdf", f"cdf{version}.nc", header([length + 4, length + 12, length]) + struct.pack(">f", 1000.0) + records)


# text
def text():
    write("text", "comma.csv", "time [s],deflection [V]\n" + "".join(f"{i * 1e-3:.3f},{value / 8}\n" for i, value in enumerate(SAMPLES)))
    write("text", "semicolon.csv", "Zeit (s);Signal (mV)\n" + "".join(f"{i / 1000:.3f};{value / 8}\n".replace(".", ",") for i, value in enumerate(SAMPLES)))
    write("text", "tabs.txt", "# sample_rate_hz = 1000\n# unit: V\n" + "".join(f"{value}\t{value * 2}\n" for value in SAMPLES))
    write("text", "one-column.txt", "\r\n".join(str(value) for value in SAMPLES) + "\r\nnan\r\n-inf\r\n1e400\r\n")
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\t{x}\nTime_Pref\tAbsolute\n"
    head += "Operator\ta\nDate\t2016/08/23\nTime\t10:45:47.035255731\n***End_of_Header***\t\n\t\n"
    part = "Channels\t2\t\nSamples\t3\t3\t\nDate\t2016/08/23\t2016/08/23\t\nTime\t10:45:47.03\t10:45:47.03\t\nY_Unit_Label\tVolts\tg\t\nX_Dimension\tTime\tTime\t\nX0\t0.0E+0\t0.0E+0\t\nDelta_X\t1.0E-3\t1.0E-3\t\n***End_of_Header***\t\t\t\n"
    rows = "X_Value\ta\tb\tComment\n" + "".join(f"{i * 1e-3}\t{value}\t{2 * value}\n" for i, value in enumerate(SAMPLES[:3]))
    write("text", "one.lvm", head.format(x="One") + part + rows)
    write("text", "none.lvm", head.format(x="No") + part + rows.replace("X_Value", "") + "\n" + part + rows)
    write("text", "multi.lvm", head.format(x="Multi") + part + "X_Value\ta\tX_Value\tb\tComment\n" + "0.0\t1\t0.0\t2\n0.001\t3\t0.002\t4\n")


# tables with headers of oscilloscopes
def scope_tables():
    write("text", "rigol.csv", "X,CH1,Start,Increment,\nSequence,Volt,-2.0e-03,1.0e-03\n" + "".join(f"{i},{value},,\n" for i, value in enumerate(SAMPLES)))
    write("text", "beside.csv", "Record Length,3,,0.000,1\nSample Interval,1E-3,,0.001,2\nVertical Units,V,,0.002,3\n,,,0.003,4\n")
    head = "waveform,a\nt0,1/1/2021 10:00:00\ndelta t,1E-3\n\ntime,a\n"
    write("text", "blocks.csv", (head + "1/1/2021 10:00:00,1\n1/1/2021 10:00:01,2\n") * 2)


# waveform audio
def wav():
    def chunk(name, data, order="<"):
        return name + struct.pack(order + "I", len(data)) + data + b"\0" * (len(data) % 2)

    def form(tag, channels, bits, order="<"):
        frame = channels * bits // 8
        return struct.pack(order + "HHIIHH", tag, channels, 8000, 8000 * frame, frame, bits)

    guid = struct.pack("<HHI", 22, 16, 0) + struct.pack("<H", 1) + bytes.fromhex("000000001000800000aa00389b71")
    codes = struct.pack("<6h", *SAMPLES)
    both = chunk(b"fmt ", form(1, 2, 16)) + chunk(b"data", codes)
    write("wav", "pcm.wav", chunk(b"RIFF", b"WAVE" + chunk(b"LIST", b"odd") + both))
    write("wav", "extensible.wav", chunk(b"RIFF", b"WAVE" + chunk(b"fmt ", form(0xFFFE, 1, 24) + guid) + chunk(b"data", bytes(range(9)))))
    write("wav", "float.wav", chunk(b"RIFF", b"WAVE" + chunk(b"fmt ", form(3, 1, 64)) + chunk(b"data", struct.pack("<6d", *SAMPLES))))
    write("wav", "big.wav", chunk(b"RIFX", b"WAVE" + chunk(b"fmt ", form(1, 1, 16, ">"), ">") + chunk(b"data", struct.pack(">6h", *SAMPLES), ">"), ">"))
    sizes = struct.pack("<QQQI", 90, 12, 6, 0)
    write("wav", "long.wav", b"RF64" + b"\xff" * 4 + b"WAVE" + chunk(b"ds64", sizes) + chunk(b"fmt ", form(1, 1, 16)) + b"data" + b"\xff" * 4 + codes)


# waveforms of oscilloscopes
def scopes():
    for order, name in [("<", "little"), (">", "big")]:
        about = bytearray(346)
        samples = struct.pack(order + "6h", *SAMPLES)
        about[0:8], about[16:26], about[196:197], about[244:245] = b"WAVEDESC", b"LECROY_2_3", b"V", b"S"
        struct.pack_into(order + "2h8i", about, 32, 1, int(order == "<"), 346, 0, 0, 32, 0, 0, len(samples), 0)
        struct.pack_into(order + "i", about, 116, 6)
        struct.pack_into(order + "i", about, 144, 2)
        struct.pack_into(order + "3f", about, 156, 0.5, 2.0, 0.0)
        struct.pack_into(order + "f", about, 176, 1e-6)
        struct.pack_into(order + "dBBBBH", about, 296, 4.5, 3, 2, 1, 12, 2020)
        whole = bytes(about) + b"\0" * 32 + samples
        write("lecroy", f"{name}.trc", b"#9" + f"{len(whole):09}".encode() + whole)

    def waveform(wide, label, kind, segment, *buffers):
        out = struct.pack("<5ifdddii", 140, kind, len(buffers), 6, 0, 0.0, 0.0, 2e-6, 0.0, 2, 1)
        out += b"22 NOV 2020".ljust(16, b"\0") + b"19:02:34".ljust(16, b"\0") + b"MODEL:SERIAL".ljust(24, b"\0") + label.ljust(16, b"\0")
        out += struct.pack("<dI", 0.0, segment)
        for kind, data in buffers:
            width = 1 if kind == 6 else 4
            out += struct.pack("<ihhq" if wide else "<ihhi", 16 if wide else 12, kind, width, len(data)) + data
        return out

    values = struct.pack("<6f", *SAMPLES)
    for mark, wide, name in [(b"AG10", False, "agilent"), (b"RG03", True, "rigol")]:
        parts = [waveform(wide, b"1", 1, 1, (1, values)), waveform(wide, b"1", 1, 2, (1, values))]
        parts += [waveform(wide, b"2", 2, 0, (2, values), (3, values)), waveform(wide, b"D0", 6, 0, (6, b"\0\1"))]
        body = b"".join(parts)
        write("keysight", f"{name}.bin", mark + struct.pack("<qi" if wide else "<ii", 12 + len(body), len(parts)) + body)

    begin = ':WFMPRE:BYT_NR 2;BIT_NR 16;ENCDG {coding};BN_FMT RI;BYT_OR MSB;NR_PT 6;WFID "Ch1, DC; a note";PT_FMT {form};XINCR 1.0E-5;XUNIT "s";'
    begin += 'YMULT 0.5;YZERO 1.0;YOFF 2.0;YUNIT "V";:CURVE '
    codes = struct.pack(">6h", *SAMPLES)
    write("isf", "binary.isf", begin.format(coding="BIN", form="Y").encode() + b"#212" + codes)
    write("isf", "envelope.isf", begin.format(coding="BIN", form="ENV").encode() + b"#212" + codes)
    write("isf", "text.isf", begin.format(coding="ASC", form="Y") + ",".join(map(str, SAMPLES)) + "\n")
    short = ':WFMP:NR_P 6;:WFMP:BYT_N 1;ENC BIN;BN_F RP;BYT_O LSB;WFI "Ch2";PT_F Y;XUN "s";XIN 1E-3;YUN "V";YMU 40E-3;YOF 0;YZE 0;:CURV #16'
    write("isf", "short.isf", short.encode() + bytes(range(6)))


# samples without a header; the first eight bytes are the description (entrances.rs)
def raw():
    data = struct.pack("<64h", *[int(3000 * numpy.sin(i / 5)) for i in range(64)])
    for name, head in [("one", [2, 0, 0, 0, 1, 1, 1, 0]), ("behind", [4, 1, 4, 2, 2, 2, 0, 0]), ("rows", [6, 0, 1, 3, 3, 1, 1, 0]), ("wrong-order", [2, 1, 0, 0, 1, 1, 1, 0])]:
        write("raw_binary", f"{name}.bin", bytes(head) + data)


# HDF5 of other programs: few bytes, many kinds
def foreign():
    def save(name, fill, **options):
        path = CORPUS / "foreign_hdf5" / f"{name}.h5"
        path.parent.mkdir(parents=True, exist_ok=True)
        with h5py.File(path, "w", **options) as file:
            fill(file)

    def plain(file):
        file.attrs["fs"] = 1000.0
        data = file.create_dataset("group/defl", data=numpy.array(SAMPLES, ">i2"))
        data.attrs["units"], data.attrs["scale_factor"] = "V", numpy.float32(0.5)
        file["dt"] = 1e-3
        file["loop"] = file["group"]
        file["soft"] = h5py.SoftLink("/nowhere")

    def chunked(file):
        file.create_dataset("map", data=numpy.arange(60, dtype="<f4").reshape(3, 20), chunks=(1, 20), compression="gzip", shuffle=True)
        file.create_dataset("empty", shape=(0,), maxshape=(None,), dtype="<f8")
        file.create_dataset("sparse", shape=(40,), chunks=(8,), dtype="<i4", fillvalue=7)

    def odd(file):
        file.attrs["started_at"] = "2020-01-01T00:00:00"
        file.attrs.create("sampling_rate", [5, 6])
        file["texts"] = ["a", "bc"]
        file["compound"] = numpy.zeros(3, [("a", "<i4"), ("b", "<f8")])
        file["complex"] = numpy.zeros(3, "<c16")
        file["half"] = numpy.zeros(3, "<f2")
        file["flag"] = numpy.zeros(3, bool)
        file.create_dataset("ragged", (2,), dtype=h5py.vlen_dtype("<i4"))[0] = [1, 2]

    def matlab(file):
        file["y"] = numpy.arange(8.0).reshape(1, 8)
        file["y"].attrs["MATLAB_class"] = numpy.bytes_("double")

    def frame(file):
        group = file.create_group("df")
        group.attrs["pandas_type"] = numpy.bytes_("frame_table")
        records = numpy.zeros(6, [("index", "<f8"), ("values_block_0", "<f8", (2,)), ("code", "<i2")])
        records["index"], records["code"] = numpy.arange(6) * 1e-3, SAMPLES
        table = group.create_dataset("table", data=records, chunks=(4,), compression="gzip", shuffle=True)
        table.attrs["values_block_0_kind"], table.attrs["index_kind"] = numpy.bytes_("(lp0\nVy\np1\naVz\np2\na."), numpy.bytes_("float")
        fixed = file.create_group("fixed")
        fixed.attrs["pandas_type"] = numpy.bytes_("frame")
        fixed["axis1"], fixed["block0_items"] = numpy.arange(6) * 1e-3, numpy.array(["a", "b"], "S")
        fixed["block0_values"] = numpy.zeros((6, 2))
        codes = file.create_group("jpk")
        codes.attrs["encoder.scaling.multiplier"], codes.attrs["encoder.scaling.unit.unit"] = 1e-9, numpy.bytes_("V")
        codes["y"] = numpy.array(SAMPLES, "<i4")

    save("plain", plain)
    save("frame", frame)
    save("chunked", chunked)
    save("latest", chunked, libver="latest")
    save("odd", odd)
    save("matlab", matlab, userblock_size=512)
    path = CORPUS / "foreign_hdf5/matlab.h5"
    bytes_ = bytearray(path.read_bytes())
    bytes_[:124] = b"MATLAB 7.3 MAT-file, a seed".ljust(124)
    path.write_bytes(bytes_)


# configs and arguments
def configs():
    names = ["free-lever", "sweep-order", "simulate-demo", "frid", "thermal-spectrum"]
    for name in names:
        write("config", f"{name}.toml", (ROOT / f"configs/{name}.toml").read_bytes())
    for path in sorted((ROOT / "tests/diagnostics").glob("*.toml")):
        write("config", f"wrong-{path.name}", path.read_bytes())
    write("config", "plugin.toml", '[pipeline]\nname = "p"\n[plugins]\na = { command = ["true"], timeout_s = 3 }\nb = "true \'two words\'"\n[[stage]]\nid = "a"\nuses = "exec:a"\nparams = { x = 1979-05-27T07:32:00Z, y = [1, { z = inf }] }\n')
    write("config", "swept.toml", '[pipeline]\nname = "p"\nseed = 3\n[[stage]]\nid = "a"\nuses = "simulate.model"\n[sweep]\n"a.samples" = [1, 2]\na.seed = [3, "4"]\n')
    lines = ["events.window_samples=4096", "records.files=['a.h5', \"b\"]", "events . window_samples = [1, 2.5, inf, 1979-05-27]", "pipeline.seed=7", 'pipeline.name="n"', "events.kind=snap-in", "events.a.b.c={ d = true }", '"records"."sample_rate_hz"=0x1F', "events=1", "=", "nobody.x=1"]
    for number, line in enumerate(lines):
        write("set_argument", f"{number:02}", line)
    write("set_argument", "several", "\n".join(lines))


# what plugins say
def plugins():
    shake = {"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "seed", "version": "1"}
    shapes = ["array", "table", "state_space", "document"]
    properties = {
        "scale": {"type": "number", "default": 1.0, "minimum": 0, "exclusiveMaximum": 10, "description": "a factor"},
        "steps": {"type": "integer", "default": 2, "multipleOf": 2},
        "mode": {"enum": ["plain", "loud"], "default": "plain"},
        "file": {"type": "string", "format": "path", "default": "", "maxLength": 100},
        "list": {"type": "array", "items": {"type": ["number", "null"]}, "maxItems": 3, "default": []},
        "inner": {"type": "object", "properties": {"x": {"const": 1, "default": 1}}, "additionalProperties": False, "default": {}},
    }
    description = {
        "name": "seed", "version": "1", "summary": "Says what it is", "source": "none",
        "inputs": [{"name": "recording", "shape": "recording", "optional": True}],
        "outputs": [{"name": shape, "shape": shape, "tag": "t", "doc": "d", "finite": False, "optional": True} for shape in shapes],
        "parameters": {"type": "object", "properties": properties, "additionalProperties": False, "required": []},
        "deterministic": True, "seeded": False,
        "examples": [{"title": "one", "parameters": {"scale": 2}, "inputs": {}}],
    }
    array = {
        "shape": "array", "axes": [{"name": "t", "unit": "s", "length": 3, "values": [0, 1, 2]}], "attributes": {"a": 1, "b": "x", "c": 0.5, "d": True},
        "variables": [
            {"name": "y", "unit": "V", "dims": ["t"], "kind": "real", "values": [1, 2.5, 3]},
            {"name": "n", "unit": "", "dims": ["t"], "kind": "integer", "values": [1, 2, 3]},
            {"name": "z", "unit": "", "dims": [], "kind": "complex", "re": [1], "im": [2]},
        ],
    }
    table = {
        "shape": "table", "rows": 2,
        "columns": [
            {"name": "f", "unit": "Hz", "kind": "real", "values": [1, 2]},
            {"name": "n", "kind": "integer", "values": [1, 2]},
            {"name": "ok", "kind": "flag", "values": [0, 1]},
            {"name": "word", "kind": "text", "values": ["a", "b"]},
        ],
    }
    model = {
        "shape": "state_space", "states": 1, "inputs": 1, "outputs": 1, "sample_time_s": 1e-6, "innovation_variance": 0.5, "parameter_names": ["p"],
        "matrices": {"A": [0.5], "B": [1], "C": [1], "D": [0], "K": [0], "x0": [0], "parameters": [0.5], "covariance": [1]},
    }
    document = {"shape": "document", "value": {"deep": [[[{}]], None, 1e300]}}
    made = {"outputs": {"array": array, "table": table, "state_space": model, "document": document}, "warnings": ["w"]}
    lines = lambda *messages: "".join(json.dumps(message) + "\n" for message in messages)
    write("plugin_lines", "whole", lines(shake, {"id": 1, "result": description}, {"id": 2, "progress": {"done": 1, "total": 3}}, {"id": 2, "result": made}))
    write("plugin_lines", "refused", lines(shake, {"id": 1, "result": description}, {"id": 2, "error": {"message": "no", "help": "yes"}}))
    path = {"shape": "table", "file": "out.h5", "rows": 2, "columns": [{"name": "f", "kind": "real", "values": "/f"}]}
    write("plugin_lines", "by-path", lines(shake, {"id": 1, "result": description}, {"id": 2, "result": {"outputs": {"table": path}}}))
    write("plugin_lines", "old", lines({**shake, "protocol": {"min": 2, "max": 3}}))
    claims = json.loads(json.dumps(made))
    claims["outputs"]["array"]["axes"][0]["length"] = 2**62
    write("plugin_lines", "claims-much", lines(shake, {"id": 1, "result": description}, {"id": 2, "result": claims}))


# frequency responses
def responses():
    rows = [(0.5 * k, 3.0 - k, 2.0 / k) for k in range(1, 9)]
    lines = "".join(f"{f:e}\t{a:e}\t{b:e}\n" for f, a, b in rows)
    write("responses", "signal-calc.txt", "Frequency\t Real\t Imaginary\n\nUnits:\nHz\t(m)(N)\t \n" + lines)
    write("responses", "packed.txt.gz", gzip.compress(lines.encode(), mtime=0))
    write("responses", "amplitude.csv", "Frequency (Hz),Mag (dB),Phase (deg),Coherence\n" + "".join(f"{f},{a},{b},0.5\n" for f, a, b in rows))
    text = "    -1\n    58\nan FRF\nNONE\nNONE\nNONE\nNONE\n"
    text += f"{4:5}{0:10}{0:5}{0:10} {'NONE':10}{3:10}{-3:4} {'NONE':10}{12:10}{1:4}\n"
    text += f"{5:10}{8:10}{1:10}{0.5:13.5E}{0.5:13.5E}{0.0:13.5E}\n"
    axis = lambda quantity, unit: f"{quantity:10}{0:5}{0:5}{0:5} {'NONE':20} {unit:20}\n"
    text += axis(18, "Hz") + axis(8, "m") + axis(13, "N") + axis(0, "NONE")
    text += "".join(f"{a:13.5E}{b:13.5E}\n" for _, a, b in rows)
    write("responses", "complex.uff", text + "    -1\n")


# what inspect is given: one of each
def inspected():
    for target, name in [("tdms", "little.tdms"), ("npz", "deflated.npz"), ("mat", "level7-little.mat"), ("jpk", "deflated.jpk-force"), ("text", "comma.csv"), ("text", "one.lvm"), ("uff", "text.uff"), ("ibw", "version5-little.ibw"), ("nanoscope", "two-bytes.000"), ("wav", "pcm.wav"), ("lecroy", "little.trc"), ("keysight", "rigol.bin"), ("isf", "short.isf"), ("foreign_hdf5", "plain.h5")]:
        write("inspect", name, (CORPUS / target / name).read_bytes())
    decay = [int(20000 * numpy.exp(-i / 200) * numpy.sin(i / 3)) for i in range(1200)]
    write("inspect", "decay.csv", "time [s],y [V]\n" + "".join(f"{i * 1e-5:.5f},{value}\n" for i, value in enumerate(decay)))


for make in (tdms, arrays, mat, ibw, nanoscope, jpk, uff, netcdf, text, scope_tables, wav, scopes, raw, foreign, configs, plugins, responses, inspected):
    make()
