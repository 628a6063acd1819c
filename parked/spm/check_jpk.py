"""Expected numbers of tests/jpk.rs: afmformats on the files that the test leaves in target/tmp. Run: .venv/bin/python check_jpk.py"""
import glob
from afmformats.formats.fmt_jpk.jpk_reader import JPKReader
for path in sorted(glob.glob("target/tmp/*.jpk-force")):
    r = JPKReader(path)
    for seg in (0, 1):
        for column in ("force", "height (piezo)"):
            print(path, seg, column, [float(x) for x in r.get_data(column, 0, seg)])
        try:
            md = r.get_metadata(0, seg)
            print("  points, duration, rate:", md["point count"], md["duration"], md["point count"] / md["duration"], md["date"] if "date" in md else "", md["time"] if "time" in md else "")
        except Exception as e:
            print("  metadata failed:", repr(e))
