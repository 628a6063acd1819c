import glob, pyuff, numpy as np
for n in ['single','double','uneven','uneven-double','uneven-58b','uneven-58b-wide','binary-1-2','binary-2-2','binary-1-4','binary-2-4','several','free']:
    try:
        u=pyuff.UFF(f'kept/{n}.uff'); print(n,u.get_set_types())
        for i,t in enumerate(u.get_set_types()):
            if t==58:
                s=u.read_sets(i); print('   ',s['data'],s['x'],s['abscissa_inc'],s['rsp_node'],s['rsp_dir'],s['ordinate_axis_units_lab'])
    except Exception as e: print(n,'ERR',repr(e)[:120])
from nptdms import TdmsFile
for n in ['daqmx-false','daqmx-true','digital']:
    t=TdmsFile.open(f'kept/{n}.tdms')
    for g in t.groups():
        for c in g.channels():
            print(n,c.path,c.read_data(scaled=False))
import lvm_read
for n in ['sections','holes']:
    d=lvm_read.read(f'kept/{n}.lvm',read_from_pickle=False,dump_file=False)
    print(n,d['Segments'],[d[i].get('data') is not None and d[i]['data'].tolist() for i in range(d['Segments'])])
import pandas as pd
for n,k in [('tab.txt',dict(sep='\t')),('comma.csv',{}),('semicolon.csv',dict(sep=';',decimal=',')),('rounded.csv',{}),('holes.csv',{})]:
    print(n,pd.read_csv('kept/'+n,**k).to_dict('list'))
