import pyuff, numpy as np
for f in ['Sample_UFF58b_bin.uff','sample_dataset58_psd.uff']:
    u=pyuff.UFF('../../../shared/data/loaders/uff/'+f)
    print(f,u.get_set_types(), u.get_n_sets())
    d=u.read_sets()
    d=d if isinstance(d,list) else [d]
    for s in d:
        v=s['data']; print({k:w for k,w in s.items() if k not in('x','data')})
        print(v.dtype,len(v),repr(v.sum()),[repr(v[i]) for i in (0,1,len(v)//2,len(v)-1)], s['x'][:3],s['x'][-1])
