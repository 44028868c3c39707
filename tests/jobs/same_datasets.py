"""Claim of its caller: two archives hold byte-identical datasets. Prints the first that differs; exit code 1.
usage: same_datasets.py A.h5 B.h5"""
import sys

import h5py


def datasets(path):
    out = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset):
            out[name] = item

    file = h5py.File(path)
    file.visititems(keep)
    return out


def content(dataset):
    values = dataset[()]
    return values.tolist() if values.dtype.kind == "O" else (values.dtype.str, values.shape, values.tobytes())


a, b = datasets(sys.argv[1]), datasets(sys.argv[2])
if a.keys() != b.keys():
    sys.exit(f"only in one: {sorted(a.keys() ^ b.keys())}")
for name in sorted(a):
    if content(a[name]) != content(b[name]):
        sys.exit(f"{name} differs")
print(f"{len(a)} datasets are equal")
