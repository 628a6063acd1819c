import lvm_read, numpy as np, glob
for f in sorted(glob.glob('../../../shared/data/loaders/lvm/*')):
    d=lvm_read.read(f,read_from_pickle=False,dump_file=False)
    print(f.split('/')[-1],d['Segments'],[ (k,v) for k,v in d.items() if isinstance(k,str)][:3])
    s=d[0]; print({k:v for k,v in s.items() if k!='data'}); print(s['data'].shape, np.nansum(s['data'],axis=0).tolist())
