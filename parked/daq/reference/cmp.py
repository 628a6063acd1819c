import glob,logging
from nptdms import TdmsFile
import numpy as np
for f in sorted(glob.glob('kept/*.tdms')):
    print('==',f)
    try:
        t=TdmsFile.read(f)
        for g in t.groups():
            for c in g.channels():
                try:
                    d=c[:]
                    print('  ',c.path,d.tolist()[:14] if d.dtype.kind in 'fiub' else d.dtype)
                except Exception as e: print('  ',c.path,'ERR',repr(e)[:80])
    except Exception as e: print('  ERR',repr(e)[:100])
