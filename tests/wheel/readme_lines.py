"""Usage: readme_lines.py README NAME...: prints the README's blocks of Python that call afmid.NAME, in order, one program."""

import re
import sys
from pathlib import Path

text = Path(sys.argv[1]).read_text(encoding="utf-8")
blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
for name in sys.argv[2:]:
    found = [block for block in blocks if f"afmid.{name}(" in block]
    if not found:
        sys.exit(f"{sys.argv[1]} has no block of Python with afmid.{name}(")
    print(found[0])
