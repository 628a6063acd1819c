"""Expected numbers of tests/nanoscope.rs: SciFiReaders, pySPM and struct on the same file. Run: .venv/bin/python check_nanoscope.py"""
import os, struct
path = os.environ.get("AFMID_DATA", "../../shared/data") + "/loaders/spm/BrukerReader_ForceCurve_Sapphire_TAP525.001"
raw = open(path, "rb").read()
for name, at in (("DeflectionError", 40960), ("ZSensor", 43008)):
    codes = struct.unpack("<1024h", raw[at:at + 2048])
    for part, c in (("extend", codes[:512][::-1]), ("retract", codes[512:])):
        print("struct", name, part, sum(c), [c[i] for i in (0, 1, 255, 511)])
try:
    from SciFiReaders.readers.microscopy.spm.afm.bruker_nano import BrukerAFMReader
    for d in BrukerAFMReader(path).read():
        a, x = [int(v) for v in d.compute()], [int(v) for v in d.dim_0.values]
        print("SciFiReaders", d.title, sum(a), [a[i] for i in (0, 1, 256, 510, 511)], sum(x), [x[i] for i in (0, 1, 256, 510, 511)])
except Exception as e:
    print("SciFiReaders failed:", repr(e))
try:
    import pySPM
    b = pySPM.Bruker(path)
    print("pySPM", len(b.layers), [{k: v for k, v in l.items() if k in (b"Data offset", b"Data length", b"Samps/line", b"Bytes/pixel", b"@4:Image Data")} for l in b.layers])
    print("pySPM scanner", [l for l in b.scanners][:1] and "scanner list read")
except Exception as e:
    print("pySPM failed:", repr(e))
