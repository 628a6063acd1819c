import sys,glob
from nptdms import TdmsFile
import numpy as np
for f in sorted(glob.glob('../../../shared/data/loaders/tdms/*')):
    print('=====',f)
    t=TdmsFile.read(f)
    print('root',dict(t.properties))
    for g in t.groups():
        print('group',g.path,dict(g.properties))
        for c in g.channels():
            d=c[:]; r=c.raw_data
            print(' ',c.path,c.data_type,len(c),d.dtype,getattr(r,'dtype',None) if not isinstance(r,dict) else {k:v.dtype for k,v in r.items()},dict(c.properties))
            if d.dtype.kind in 'fiub':
                print('   sum',repr(float(np.sum(d,dtype=float))),[repr(float(d[i])) for i in (0,1,len(d)//2,-1)] if len(d) else None)
            if isinstance(r,dict):
                for k,v in r.items(): print('   raw',k,v[:6],v.sum(dtype=float))
            elif r.dtype.kind in 'fiub': print('   raw sum',float(np.sum(r,dtype=float)))
